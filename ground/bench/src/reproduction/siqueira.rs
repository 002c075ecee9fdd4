//! Tables 7.2 to 7.5 and 8.1 of Siqueira (2014); its Allan deviations are in [`allan`](super::allan).

use nalgebra::Vector3;

use super::{Line, Reproduced, ReproductionError, Sources};
use crate::{
    controlled::{Calibration, Contradicted, Options, calibrate},
    experiment::{Excitation, Experiment, Trial},
    turntable::{Mount, Pose, Turning},
};

/// In the order of the tables' columns.
pub const CHANNELS: [&str; 4] = ["SD02", "SD04", "SD03", "LME02"];
/// Inner angles of the runs that turn about the middle axis, rows 5 to 16 of Table 7.3 in pairs.
const INNER_DEG: [f64; 6] = [0.0, 180.0, 90.0, -90.0, 30.0, -30.0];
/// [deg/s] rate of every run.
const RATE_DEG_S: f64 = 6.0;
/// Half a unit of the last digit of Table 7.5's scale.
const SCALE_DIGIT: f64 = 5e-6;

/// Its tables.
///
/// # Errors
/// When one cannot be read.
pub fn tables(sources: &Sources<'_>) -> Result<Vec<Reproduced>, ReproductionError> {
    let (experiment, found) = campaign(sources)?;
    Ok(vec![
        factory(sources, &found)?,
        sequences(&experiment),
        solution(sources, &found)?,
        calibration(sources, &found)?,
        drift(sources)?,
    ])
}

/// Tables 7.3 (as printed) and 7.4 as one campaign, rates in deg/s and outputs in V, and what comes of it when rows that
/// contradict the data are read as the data say.
///
/// # Errors
/// When the tables cannot be read.
pub fn campaign(sources: &Sources<'_>) -> Result<(Experiment, Calibration), ReproductionError> {
    let rates = sources.numbers("000_table7_3_sequences.csv", ["wx_printed", "wy_printed", "wz_printed"])?;
    let outputs = sources.numbers("000_table7_4_raw_means.csv", ["SD02_V", "SD04_V", "SD03_V", "LME02_V"])?;
    let trial = |(k, (rate, output)): (usize, (&[f64; 3], &[f64; 4]))| Trial {
        label: (k + 1).to_string(),
        line: k + 2,
        claimed_b: None,
        pose: None,
        excitation_b: Vector3::from(*rate),
        temperature_c: f64::NAN,
        values: output.iter().copied().map(Some).collect(),
        stated: Vec::new(),
    };
    let experiment = Experiment {
        file: "Table 7.4".into(),
        kind: Excitation::Rate,
        channels: CHANNELS.map(String::from).to_vec(),
        trials: rates.iter().zip(&outputs).enumerate().map(trial).collect(),
        declared: None,
        remarks: Vec::new(),
    };
    let options = Options {
        contradicted: Contradicted::Correct,
        ..Options::default()
    };
    let found = calibrate(&experiment, &options).map_err(|error| ReproductionError::Calculation {
        table: "Table 7.4",
        why: error.to_string(),
    })?;
    Ok((experiment, found))
}

/// The table's row of a channel; Tables 7.2 and 7.5 go by gyro number 1 to 4, as the channels do.
fn scales(found: &Calibration) -> Vec<f64> {
    found
        .channels
        .iter()
        .map(|channel| channel.response.counts_per_unit())
        .collect()
}

fn factory(sources: &Sources<'_>, found: &Calibration) -> Result<Reproduced, ReproductionError> {
    let printed = sources.numbers("000_table7_2_factory.csv", ["scale_V_per_dps"])?;
    let line = |(name, (printed, ours)): (&str, (&[f64; 1], f64))| {
        // Four decimals are printed.
        Line::new(format!("{name}, scale [V/(deg/s)]"), printed, &[ours], 5e-5)
    };
    Ok(Reproduced {
        table: "Table 7.2 (Siqueira)",
        lines: CHANNELS
            .into_iter()
            .zip(printed.iter().zip(scales(found)))
            .map(line)
            .collect(),
        why: "The maker's values cannot be had again from the thesis. Beside them what Table 7.4 says: they are off by up to \
              50 % and leave 22, 77, 22 and 77 mV of its voltages unexplained, a correct calibration about 1 mV.",
    })
}

fn sequences(experiment: &Experiment) -> Reproduced {
    let mut axes = vec![
        (Vector3::x(), 1.0),
        (Vector3::x(), -1.0),
        (Vector3::x(), 1.0),
        (Vector3::x(), -1.0),
    ];
    for inner_deg in INNER_DEG {
        let pose = Pose {
            inner_rad: inner_deg.to_radians(),
            outer_rad: 0.0,
        };
        let axis = Mount::SIQUEIRA.axis_b(pose, Turning::Outer);
        // The table's z is that of a left-handed frame.
        let axis = Vector3::new(axis.x, axis.y, -axis.z);
        axes.extend([(axis, 1.0), (axis, -1.0)]);
    }
    let line = |(trial, (axis, sign)): (&Trial, (Vector3<f64>, f64))| {
        let ours = axis * (sign * RATE_DEG_S);
        Line::new(
            format!("sequence {} [deg/s]", trial.label),
            trial.excitation_b.as_slice(),
            ours.as_slice(),
            1e-6,
        )
    };
    Reproduced {
        table: "Table 7.3 (Siqueira)",
        lines: experiment.trials.iter().zip(axes).map(line).collect(),
        why: "Rates by the law of the table's axes, z left-handed as printed. Rows 7, 8, 11, 12 and 15 have the wrong sign; \
              the voltages of Table 7.4 alone blame the same five, without the law.",
    }
}

fn solution(sources: &Sources<'_>, found: &Calibration) -> Result<Reproduced, ReproductionError> {
    let columns = ["K_V_per_dps", "hx", "hy", "hz", "bias_V"];
    let golden = sources.numbers("000_table7_4_ls_solution_righthanded_as_wired.csv", columns)?;
    let line = |(channel, golden): (&crate::controlled::Channel, &[f64; 5])| {
        let fit = &channel.response;
        let axis = fit.axis_b();
        let ours = [fit.counts_per_unit(), axis.x, axis.y, -axis.z, fit.bias[0]];
        // Twelve digits of the solution, nine decimals of the rates.
        Line::new(format!("{}: scale, axis, bias", channel.name), golden, &ours, 2e-10)
    };
    Ok(Reproduced {
        table: "Table 7.4 (Siqueira)",
        lines: found.channels.iter().zip(&golden).map(line).collect(),
        why: "Measured voltages. Beside each other: their exact least-squares solution found apart from this program, and \
              ours after it found the five contradicting rows and corrected them. SD-04 is inverted. Pairs left out are \
              predicted to 1.4 to 2.0 mV.",
    })
}

fn calibration(sources: &Sources<'_>, found: &Calibration) -> Result<Reproduced, ReproductionError> {
    let columns = [
        "scale_factory",
        "scale_cal",
        "scale_diff",
        "bias_factory",
        "bias_cal",
        "bias_diff",
    ];
    let printed = sources.numbers("000_table7_5_printed_cal.csv", columns)?;
    let mut lines = Vec::new();
    for (row, name) in printed.iter().zip(CHANNELS) {
        let [scale_factory, scale, scale_diff, bias_factory, bias, bias_diff] = *row;
        lines.push(Line::new(
            format!("{name}: differences of scale and bias"),
            &[scale_diff, bias_diff],
            &[scale_factory - scale, bias - bias_factory],
            1e-9,
        ));
    }
    for ((row, name), ours) in printed.iter().zip(CHANNELS).zip(scales(found)) {
        lines.push(Line::new(
            format!("{name}: scale [V/(deg/s)]"),
            &[row[1]],
            &[ours],
            SCALE_DIGIT,
        ));
    }
    Ok(Reproduced {
        table: "Table 7.5 (Siqueira)",
        lines,
        why: "It cannot come from Table 7.4. LME-02 is seen along X twice, 0.07775 and 0.07729 V/(deg/s); any weighting lies \
              between, the printed 0.07455 does not. With the printed calibration the voltages are off by 9, 55, 22 and \
              9 mV, with ours by about 1. It is of another run. Its own differences are right.",
    })
}

fn drift(sources: &Sources<'_>) -> Result<Reproduced, ReproductionError> {
    let printed = sources.numbers("000_table8_1_residual_drift.csv", ["drift_deg_per_h"])?;
    let x = printed.first().map_or(f64::NAN, |row| row[0]);
    Ok(Reproduced {
        table: "Table 8.1 (Siqueira)",
        lines: vec![Line::new(
            "X, from 4.61 deg in 100 minutes [deg/h]",
            &[x],
            &[4.61 * 60.0 / 100.0],
            0.05,
        )],
        why: "X follows from the orbit test of section 8. Of the tests about Y and Z nothing but the result is printed.",
    })
}
