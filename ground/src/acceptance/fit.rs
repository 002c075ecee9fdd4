//! Sensors against what was done to them: sensitivity and bias by least squares, and which sensor of the drawing that is.
//!
//! A triad in poses k feels a known vector x_k (b): `y_k = S x_k + bias`, S 3 x 3, solved axis by axis. A gyro in turns k integrates
//! `theta_k = s . a_k`. Then S is held against the drawing: for every plate j and every exchange and inversion P of axes,
//! `|S / scale - P R_bj^T|`, scale being what makes the rows of S of length one on the mean. The drawing's own place is kept
//! unless another fits three times better (as `bench::wiring` has it): a crooked part is not a wrong one.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use twin::geometry::{dcm_bp, gyro_axis_b};

use bench::least_squares;

/// Another place is believed when it fits better by this factor.
const CLEARLY: f64 = 3.0;

/// One axis: `y = sensitivity_b . x + bias`.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisFit {
    /// In b, nominal units a unit.
    pub sensitivity_b: Vector3<f64>,
    /// Nominal units.
    pub bias: f64,
    /// Covariance of both, in this order.
    pub covariance: DMatrix<f64>,
    /// Root mean square residual.
    pub scatter: f64,
    /// Observations less parameters.
    pub freedom: usize,
}

/// Where a triad is, by what it feels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seat {
    /// Plate it feels like, from 0.
    pub plate: usize,
    /// Axis of that plate that each of its own feels, and whether with the other sign.
    pub axes: [(usize, bool); 3],
}

/// A triad.
#[derive(Clone, Debug, PartialEq)]
pub struct TriadFit {
    /// x, y, z.
    pub axes: [AxisFit; 3],
    /// Where it is.
    pub seat: Seat,
    /// \[deg\] the axis that is farthest from where it should be there.
    pub off_deg: f64,
}

/// A gyro.
#[derive(Clone, Debug, PartialEq)]
pub struct GyroFit {
    /// In b, nominal rate a rate.
    pub sensitivity_b: Vector3<f64>,
    /// Its covariance.
    pub covariance: DMatrix<f64>,
    /// \[rad\] root mean square residual of a turn.
    pub scatter: f64,
    /// Turns less three.
    pub freedom: usize,
    /// [rad/s] at rest, and the standard deviation of that mean.
    pub bias: (f64, f64),
    /// Plate whose axis it feels.
    pub plate: usize,
    /// With the other sign.
    pub inverted: bool,
    /// \[deg\] from that axis.
    pub off_deg: f64,
}

/// Why something cannot be fitted, in words.
pub type Unfitted = &'static str;

/// A triad in poses: what it should feel (b), and what it reads, in the same unit.
pub fn triad(plate: usize, felt_b: &[Vector3<f64>], read: &[Vector3<f64>]) -> Result<TriadFit, Unfitted> {
    if felt_b.len() < 5 {
        return Err("fewer than five poses");
    }
    let design = DMatrix::from_fn(felt_b.len(), 4, |row, column| {
        felt_b[row].get(column).copied().unwrap_or(1.0)
    });
    let axis = |axis: usize| -> Result<AxisFit, Unfitted> {
        let observed = DVector::from_iterator(read.len(), read.iter().map(|vector| vector[axis]));
        let solved = least_squares::solve(&design, &observed).map_err(|_| "the poses do not turn it every way")?;
        let [x, y, z] = [0, 1, 2].map(|k| solved.parameters[k]);
        Ok(AxisFit {
            sensitivity_b: Vector3::new(x, y, z),
            bias: solved.parameters[3],
            covariance: solved.covariance,
            scatter: solved.scatter,
            freedom: solved.freedom,
        })
    };
    let axes = [axis(0)?, axis(1)?, axis(2)?];
    let rows = axes.each_ref().map(|axis| axis.sensitivity_b.transpose());
    let s_pb = Matrix3::from_rows(&rows);
    let scale = s_pb.norm() / 3_f64.sqrt();
    if scale < 0.05 {
        return Err("it feels nothing of the poses");
    }
    let (seat, _) = seat(plate, &(s_pb / scale));
    let off = |axis: &usize| {
        let expected_b = axis_b(seat, *axis);
        let found_b = axes[*axis].sensitivity_b;
        found_b.angle(&expected_b).to_degrees()
    };
    let off_deg = [0, 1, 2].iter().map(off).fold(0.0, f64::max);
    Ok(TriadFit { axes, seat, off_deg })
}

/// Direction in b that an axis of a triad in a place has.
fn axis_b(seat: Seat, axis: usize) -> Vector3<f64> {
    let (of_plate, inverted) = seat.axes[axis];
    let column = dcm_bp(seat.plate).column(of_plate).into_owned();
    if inverted { -column } else { column }
}

/// The place that fits a triad of scale one best, and how badly.
fn seat(plate: usize, s_pb: &Matrix3<f64>) -> (Seat, f64) {
    let misfit = |seat: &Seat| {
        let off = |axis: usize| (s_pb.row(axis).transpose() - axis_b(*seat, axis)).norm_squared();
        (off(0) + off(1) + off(2)).sqrt()
    };
    let drawn = Seat {
        plate,
        axes: [(0, false), (1, false), (2, false)],
    };
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let places = (0..4).flat_map(|plate| {
        orders.into_iter().flat_map(move |order| {
            (0..8_u8).map(move |signs| Seat {
                plate,
                axes: std::array::from_fn(|axis| (order[axis], signs >> axis & 1 == 1)),
            })
        })
    });
    let best = places
        .map(|seat| (seat, misfit(&seat)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((drawn, f64::INFINITY));
    let own = misfit(&drawn);
    if own <= CLEARLY * best.1 { (drawn, own) } else { best }
}

impl Seat {
    /// Whether it is where the drawing has it.
    pub fn is_drawn(&self, plate: usize) -> bool {
        *self
            == Seat {
                plate,
                axes: [(0, false), (1, false), (2, false)],
            }
    }

    /// In words, for a triad that belongs to `plate`.
    pub fn words(&self, plate: usize) -> String {
        let name = |axis: usize| ["x", "y", "z"][axis];
        let mut words = Vec::new();
        if self.plate != plate {
            words.push(format!("feels like plate {}", self.plate + 1));
        }
        for (axis, (of_plate, inverted)) in self.axes.into_iter().enumerate() {
            match (of_plate == axis, inverted) {
                (true, false) => {}
                (true, true) => words.push(format!("{} inverted", name(axis))),
                (false, inverted) => {
                    words.push(format!(
                        "{} is {}{}",
                        name(axis),
                        if inverted { "-" } else { "" },
                        name(of_plate)
                    ));
                }
            }
        }
        if words.is_empty() {
            "as drawn".into()
        } else {
            words.join(", ")
        }
    }
}

/// A gyro in turns: rotations \[rad, b\] and what it integrated \[rad\].
pub fn gyro(plate: usize, angles_b: &[Vector3<f64>], read: &[f64], bias: (f64, f64)) -> Result<GyroFit, Unfitted> {
    if angles_b.len() < 3 {
        return Err("fewer than three turns");
    }
    let design = DMatrix::from_fn(angles_b.len(), 3, |row, column| angles_b[row][column]);
    let observed = DVector::from_column_slice(read);
    let solved = least_squares::solve(&design, &observed).map_err(|_| "the turns leave an axis out")?;
    let sensitivity_b = Vector3::new(solved.parameters[0], solved.parameters[1], solved.parameters[2]);
    if sensitivity_b.norm() < 0.05 {
        return Err("it feels nothing of the turns");
    }
    let axes = (0..4).flat_map(|plate| [(plate, false), (plate, true)]);
    let axis = |(plate, inverted): (usize, bool)| {
        if inverted {
            -gyro_axis_b(plate)
        } else {
            gyro_axis_b(plate)
        }
    };
    let off = |seat: &(usize, bool)| sensitivity_b.angle(&axis(*seat));
    let best = axes.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or((plate, false));
    let (plate, inverted) = if off(&(plate, false)) <= CLEARLY * off(&best) {
        (plate, false)
    } else {
        best
    };
    Ok(GyroFit {
        sensitivity_b,
        covariance: solved.covariance,
        scatter: solved.scatter,
        freedom: solved.freedom,
        bias,
        plate,
        inverted,
        off_deg: off(&(plate, inverted)).to_degrees(),
    })
}

/// The field of the table \[t\] that a triad as drawn makes of its readings in poses, and its residual as a part of that field:
/// `y_k = R_pb R_bt,k f + bias`, six parameters.
pub fn field_t(plate: usize, to_b: &[Matrix3<f64>], read: &[Vector3<f64>]) -> Option<(Vector3<f64>, f64)> {
    let dcm_pb = dcm_bp(plate).transpose();
    let design = DMatrix::from_fn(3 * to_b.len(), 6, |row, column| match column {
        0..3 => (dcm_pb * to_b[row / 3])[(row % 3, column)],
        _ => f64::from(u8::from(column - 3 == row % 3)),
    });
    let observed = DVector::from_fn(3 * read.len(), |row, _| read[row / 3][row % 3]);
    let solved = least_squares::solve(&design, &observed).ok()?;
    let field = Vector3::new(solved.parameters[0], solved.parameters[1], solved.parameters[2]);
    Some((field, solved.scatter / field.norm()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acceptance::pose::{POSES, TURNS};

    fn felt() -> Vec<Vector3<f64>> {
        POSES
            .iter()
            .map(|pose| pose.in_b(&Vector3::new(0.0, 0.0, -9.8)))
            .collect()
    }

    fn read(s_pb: Matrix3<f64>) -> Vec<Vector3<f64>> {
        felt()
            .iter()
            .map(|force_b| s_pb * force_b + Vector3::new(0.1, -0.2, 0.3))
            .collect()
    }

    #[test]
    fn every_place_of_every_triad_is_told_from_every_other() {
        for own in 0..4 {
            for other in 0..4 {
                for (order, signs) in [([0, 1, 2], 0_u8), ([1, 0, 2], 1), ([0, 1, 2], 4), ([2, 0, 1], 7)] {
                    let seat = Seat {
                        plate: other,
                        axes: std::array::from_fn(|axis| (order[axis], signs >> axis & 1 == 1)),
                    };
                    let rows = [0, 1, 2].map(|axis| axis_b(seat, axis).transpose());
                    let found = triad(own, &felt(), &read(Matrix3::from_rows(&rows) * 1.05)).expect("fitted");
                    assert_eq!(found.seat, seat, "{own}");
                    assert!(found.off_deg < 0.01, "{}", found.off_deg);
                    assert!((found.axes[2].bias - 0.3).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_crooked_triad_stays_where_it_is_drawn() {
        let crooked = nalgebra::Rotation3::from_euler_angles(0.05, -0.08, 0.04).into_inner();
        let found = triad(1, &felt(), &read(crooked * dcm_bp(1).transpose())).expect("fitted");
        assert!(found.seat.is_drawn(1));
        assert!(found.off_deg > 4.0, "{}", found.off_deg);
    }

    #[test]
    fn gyros_on_other_chip_selects_and_upside_down_are_told() {
        let angles: Vec<_> = TURNS.iter().map(|turn| turn.angle_b()).collect();
        let turned = |plate: usize, sign: f64| -> Vec<f64> {
            angles
                .iter()
                .map(|angle| sign * gyro_axis_b(plate).dot(angle) * 1.01)
                .collect()
        };
        for own in 0..4 {
            for (other, sign) in [(0, 1.0), (1, -1.0), (2, 1.0), (3, -1.0)] {
                let found = gyro(own, &angles, &turned(other, sign), (0.0, 0.0)).expect("fitted");
                assert_eq!((found.plate, found.inverted), (other, sign < 0.0));
                assert!((found.sensitivity_b.norm() - 1.01).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn the_field_of_the_table_comes_out_and_a_turned_triad_contradicts_itself() {
        let to_b: Vec<Matrix3<f64>> = POSES
            .iter()
            .map(|pose| pose.q_tb().inverse().to_rotation_matrix().into_inner())
            .collect();
        let field = Vector3::new(17.0, -6.9, -14.2);
        let drawn: Vec<_> = to_b
            .iter()
            .map(|m| dcm_bp(2).transpose() * m * field + Vector3::new(3.0, 0.0, 1.0))
            .collect();
        let (found, misfit) = field_t(2, &to_b, &drawn).expect("found");
        assert!((found - field).norm() < 1e-9 && misfit < 1e-9);
        let turned: Vec<_> = drawn.iter().map(|v| Vector3::new(v.y, -v.x, v.z)).collect();
        assert!(field_t(2, &to_b, &turned).is_some_and(|(_, misfit)| misfit > 0.3));
    }
}
