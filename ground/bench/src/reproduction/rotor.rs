//! Figures of the paper on dry-tuned gyros.
//!
//! Its records are not printed. What is: the drift's parameters, which a record simulated from them must give back, and
//! equations, whose corrected forms are shown at worked numbers.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::{Line, Reproduced, ReproductionError, Sources};
use crate::drift::{rotor, stability::stability};

/// The record's length \[samples\] and interval [s]: 24 h at 0.2 Hz.
const SAMPLES: usize = 17_280;
const STEP_S: f64 = 5.0;

/// Its figures.
///
/// # Errors
/// When the parameters cannot be read.
pub fn figures(sources: &Sources<'_>) -> Result<Vec<Reproduced>, ReproductionError> {
    Ok(vec![drift(sources)?, decay()?, merit()?, turn_on()])
}

fn drift(sources: &Sources<'_>) -> Result<Reproduced, ReproductionError> {
    let printed = sources.numbers("003_drift_stability.csv", ["value"])?;
    let (white, held) = match printed[..] {
        [[white], [held], ..] => (white, held),
        _ => (f64::NAN, f64::NAN),
    };
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut draw = move || -> f64 { StandardNormal.sample(&mut random) };
    let mut level = 0.0;
    let mut sample = |_| {
        // The walk's rate is held over a sample, which its printed unit, deg/h/s, asks for.
        level += held * STEP_S * draw();
        level + white * draw()
    };
    let record: Vec<f64> = (0..SAMPLES).map(&mut sample).collect();
    let found = stability(&record, STEP_S).map_err(|error| ReproductionError::Calculation {
        table: "drift stability",
        why: error.to_string(),
    })?;
    let half = |interval: crate::drift::stability::Interval| (interval.high - interval.low) / 2.0;
    Ok(Reproduced {
        table: "Drift stability (dry-tuned gyro)",
        lines: vec![
            Line::new("s_w [deg/h]", &[white], &[found.white.value], half(found.white)),
            Line::new(
                "s_r [deg/h/s]",
                &[held],
                &[found.held_walk()],
                half(found.walk_step) / STEP_S,
            ),
        ],
        why: "The record is not printed. One of 24 h simulated with the paper's parameters gives them back by maximum \
              likelihood within their 95 % intervals. The ramp is not reported.",
    })
}

fn decay() -> Result<Reproduced, ReproductionError> {
    let found = rotor::decay_time(&[(10.0, 1.0), (35.0, 0.6)]).map_err(|error| ReproductionError::Calculation {
        table: "decay time constant",
        why: error.to_string(),
    })?;
    Ok(Reproduced {
        table: "Decay time constant (dry-tuned gyro)",
        lines: vec![Line::new(
            "1.0 at 10 s, 0.6 at 35 s: eq. 4 as printed, and the time constant [s]",
            &[(1.0_f64 / 0.6).ln() / 25.0],
            &[found],
            1e-9,
        )],
        why: "No measured amplitudes are printed. Equation 4 gives the reciprocal of what it is said to give.",
    })
}

fn merit() -> Result<Reproduced, ReproductionError> {
    // A = 1e-5, An = Bn = 1e-7, Cn = 1.5e-7, C = 1.4e-5 kg m2 at 200 Hz: eigenvalues of eqs. 1 and 2 with the minus sign.
    let (first_s, second_s) = (282.699_695_75, 141.697_963_91);
    let found = rotor::merit(first_s, 1.0, second_s, 2.0).map_err(|error| ReproductionError::Calculation {
        table: "figure of merit",
        why: error.to_string(),
    })?;
    let exact = (1.4e-5 + 1e-7) / (1e-7 + 1e-7 - 1.5e-7);
    Ok(Reproduced {
        table: "Figure of merit (dry-tuned gyro)",
        lines: vec![
            Line::new(
                "(C + An)/(An + Bn - Cn), and from two periods",
                &[exact],
                &[found],
                0.01 * exact,
            ),
            Line::new(
                "eq. 5 as printed, with 2 pi and speeds in Hz, and from two periods",
                &[found / std::f64::consts::TAU],
                &[found],
                0.01 * exact,
            ),
        ],
        why: "No measured periods are printed. Periods computed from a rotor's inertias (equations 1 and 2, the second with \
              the minus sign that makes it a gyroscope) give its figure of merit; equation 5 does only with speeds in \
              rad/s. At one hertz from the tuning speed it is off by 0.7 %.",
    })
}

fn turn_on() -> Reproduced {
    Reproduced {
        table: "Turn-on repeatability, scale (dry-tuned gyro)",
        lines: Vec::new(),
        why: "0.9 deg/h is printed, the turn-ons are not; nor are the points of the scale factor's and the 24 positions' \
              tests. The methods are held by tests with simulated gyros.",
    }
}
