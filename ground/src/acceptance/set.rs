//! The first calibration set: what the poses and turns say of every channel that is where the drawing has it.
//!
//! Accelerometers from gravity in six poses, magnetometers from the field of the table in the same, gyros from six turns and their
//! bias at rest. It is as good as the hand that held the unit: the covariance, which is of the residuals, says how good. A
//! channel that is not as drawn is left out: its wire is to be mended, not calibrated away.

use bench::set::{Entry, Set};
use nalgebra::{DMatrix, DVector};
use packets::channel::{ACC_LSB, GYRO_LSB, MAG_LSB_UT};

use super::{
    fit::{AxisFit, GyroFit, TriadFit},
    judge::Outcome,
};

/// The set, of a unit called so.
pub fn first(outcome: &Outcome, unit: &str) -> Set {
    let mut set = Set::new(unit);
    let triads = [
        ("a", "accelerometer", ACC_LSB, &outcome.accelerometers),
        ("m", "magnetometer", MAG_LSB_UT, &outcome.magnetometers),
    ];
    for (letter, sensor, lsb, fits) in triads {
        for (plate, fit) in fits.iter().enumerate() {
            let Some(fit) = fit.as_ref().filter(|fit| drawn(fit, plate)) else {
                continue;
            };
            for (axis, name) in fit.axes.iter().zip(["x", "y", "z"]) {
                set.channels
                    .push(axis_entry(format!("{letter}{}{name}", plate + 1), sensor, lsb, axis));
            }
        }
    }
    for (plate, fit) in outcome.gyros.iter().enumerate() {
        if let Some(fit) = fit.as_ref().filter(|fit| fit.plate == plate && !fit.inverted) {
            set.channels.push(gyro_entry(format!("g{}", plate + 1), fit));
        }
    }
    set
}

fn drawn(fit: &TriadFit, plate: usize) -> bool {
    fit.seat.is_drawn(plate)
}

fn rows(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let symmetric = (matrix + matrix.transpose()) / 2.0;
    symmetric.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn axis_entry(name: String, sensor: &str, lsb: f64, fit: &AxisFit) -> Entry {
    // Sensitivity [counts per unit] and bias [counts] are both a nominal unit over the count.
    Entry {
        name,
        sensor: sensor.into(),
        part: String::new(),
        method: "acceptance".into(),
        sensitivity_b: (fit.sensitivity_b / lsb).into(),
        bias_counts: vec![fit.bias / lsb],
        scale_per_k: Vec::new(),
        reference_c: None,
        valid_c: None,
        scatter_counts: fit.scatter / lsb,
        freedom: fit.freedom,
        covariance: rows(&(&fit.covariance / lsb.powi(2))),
        delay_s: None,
        lever_m: None,
    }
}

fn gyro_entry(name: String, fit: &GyroFit) -> Entry {
    let mut covariance = DMatrix::from_diagonal(&DVector::from_element(4, 0.0));
    covariance
        .view_mut((0, 0), (3, 3))
        .copy_from(&(&fit.covariance / GYRO_LSB.powi(2)));
    covariance[(3, 3)] = (fit.bias.1 / GYRO_LSB).powi(2);
    Entry {
        name,
        sensor: "gyro".into(),
        part: String::new(),
        method: "acceptance".into(),
        sensitivity_b: (fit.sensitivity_b / GYRO_LSB).into(),
        bias_counts: vec![fit.bias.0 / GYRO_LSB],
        scale_per_k: Vec::new(),
        reference_c: None,
        valid_c: None,
        scatter_counts: fit.scatter / GYRO_LSB,
        freedom: fit.freedom,
        covariance: rows(&covariance),
        delay_s: None,
        lever_m: None,
    }
}
