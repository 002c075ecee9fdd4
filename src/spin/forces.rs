//! The rate in what accelerometers at different places disagree by.
//!
//! In: one reading of the twelve axes, and the rate with its derivative as they are believed. Out: up to nine equations with
//! white noise of variance one, each of which sees the spin, the rate across it, their derivatives and the levers' scale, and the
//! force that all feel. With `r_p` the place of plate `p`, `h_k` an axis on it,
//!
//! ```text
//! y_k = h_k . (F + (1 + lever) (w' x r_p + w x (w x r_p)))        w' = (a, T d + w_x (u'_z, -u'_y)),  u' = T u
//! ```
//!
//! (A. R. Schuler, A. Grammatikos, K. A. Fegley, "Measuring rotational motion with linear accelerometers", IEEE Trans. AES-3(3),
//! 1967; A. J. Padgaonkar, K. W. Krieger, A. I. King, "Measurement of angular acceleration of a rigid body using linear
//! accelerometers", J. Appl. Mech. 42(3), 1975; for many of them by maximum likelihood I. Skog, J.-O. Nilsson, P. Handel, A. Nehorai,
//! "Inertial sensor arrays, maximum likelihood, and Cramer-Rao bound", IEEE Trans. Signal Process. 64(16), 2016.) The force `F` is
//! anything: three Householder reflections of the rows, each divided by its standard deviation, turn it out of all but three of
//! them (G. H. Golub, "Numerical methods for solving linear least squares problems", Numer. Math. 7, 1965). An axis at the end of
//! its range costs an equation.
//!
//! Gives none with fewer than four axes, or where those left do not span space.

use nalgebra::{ComplexField, Vector3};

use crate::{
    calibration::Set,
    geometry::{PLATES, TRIAD_AXES},
};

/// Equations of a reading at most.
pub const EQUATIONS: usize = TRIAD_AXES - 3;

/// States that an equation sees: spin, its derivative, rate across (2), its derivative (2), lever.
pub const SEEN: usize = 7;

/// Columns: force, residual, states.
const COLUMNS: usize = 3 + 1 + SEEN;

/// What is believed of the rate when a reading was taken.
#[derive(Clone, Copy, Debug)]
pub struct Believed {
    /// [rad/s] in b.
    pub rate_b: Vector3<f32>,
    /// [rad/s2] in b.
    pub rate_dot_b: Vector3<f32>,
    /// Axes across the spin that do not spin, in b.
    pub across_b: [Vector3<f32>; 2],
    /// \[1\] levers are longer by.
    pub lever: f32,
}

/// One reading.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// [m/s2] along each axis, without what it had on the pad.
    pub along: [f32; TRIAD_AXES],
    /// Axes that gave it, bit `k` the `k`-th.
    pub used: u16,
    /// [m2/s4] variance of each beside noise, scale and direction: of unlike ages, of vibration.
    pub variance: f32,
}

/// What a reading says.
#[derive(Clone, Copy, Debug)]
pub struct Equations {
    /// Residual over its standard deviation.
    pub residuals: [f32; EQUATIONS],
    /// What of the states it sees, over the same.
    pub rows: [[f32; SEEN]; EQUATIONS],
    /// How many there are.
    pub count: usize,
    /// [m/s2] the force at the centre.
    pub force_b: Vector3<f32>,
}

/// [m/s2] rounding and what of the pad's mean is not known.
const REST: f32 = 0.02;

/// Smallest column of the force that still spans space.
const SPANS: f32 = 1e-3;

/// The equations of a reading.
pub fn equations(set: &Set, reading: &Reading, believed: &Believed) -> Option<Equations> {
    let mut rows = [[0.0_f32; COLUMNS]; TRIAD_AXES];
    let largest = reading.along.iter().enumerate().fold(0.0_f32, |largest, (k, along)| {
        if reading.used >> k & 1 == 1 {
            largest.max(along.abs())
        } else {
            largest
        }
    });
    let [of_acc, ..] = set.uncertainty;
    let mut count = 0;
    for plate in 0..PLATES {
        let columns = at_place(&set.place_b[plate], believed);
        for k in 3 * plate..3 * plate + 3 {
            if reading.used >> k & 1 == 0 {
                continue;
            }
            let (axis, along) = (&set.acc[k], reading.along[k]);
            let square = |x: f32| x * x;
            let variance = square(axis.noise)
                + square(REST)
                + square(of_acc.scale * along)
                + square(of_acc.direction * largest)
                + reading.variance;
            let by_sd = 1.0 / ComplexField::sqrt(variance);
            let row = &mut rows[count];
            for (element, along) in row.iter_mut().zip(&axis.axis_b) {
                *element = along * by_sd;
            }
            row[3] = (along - axis.axis_b.dot(&columns[SEEN])) * by_sd;
            for (element, column) in row[4..].iter_mut().zip(&columns) {
                *element = axis.axis_b.dot(column) * by_sd;
            }
            count += 1;
        }
    }
    if count < 4 {
        return None;
    }
    reflect(rows.get_mut(..count)?)?;
    let mut found = Equations {
        residuals: [0.0; EQUATIONS],
        rows: [[0.0; SEEN]; EQUATIONS],
        count: count - 3,
        force_b: solve(&rows),
    };
    for (k, row) in rows[3..count].iter().enumerate() {
        found.residuals[k] = row[3];
        found.rows[k].copy_from_slice(&row[4..]);
    }
    Some(found)
}

/// What a place feels by each state's error, and at last by what is believed.
fn at_place(place_b: &Vector3<f32>, believed: &Believed) -> [Vector3<f32>; SEEN + 1] {
    let Believed {
        rate_b,
        rate_dot_b,
        across_b: [y, z],
        lever,
    } = believed;
    let x = Vector3::x();
    let stretched_b = place_b * (1.0 + lever);
    let swept_b = rate_b.cross(&stretched_b);
    // The derivative of `w' x r + w x (w x r)` by a rate along `axis`, which turns with b if it is across the spin.
    let by_rate = |axis: &Vector3<f32>, turns: &Vector3<f32>| {
        turns.cross(&stretched_b) + axis.cross(&swept_b) + rate_b.cross(&axis.cross(&stretched_b))
    };
    let spin = rate_b.x;
    let turned = |axis: &Vector3<f32>| Vector3::new(0.0, axis.z, -axis.y);
    let felt_b = rate_dot_b.cross(place_b) + rate_b.cross(&rate_b.cross(place_b));
    [
        by_rate(&x, &turned(rate_b)),
        x.cross(&stretched_b),
        by_rate(y, &(turned(y) * spin)),
        by_rate(z, &(turned(z) * spin)),
        y.cross(&stretched_b),
        z.cross(&stretched_b),
        felt_b,
        felt_b * (1.0 + lever),
    ]
}

/// Three reflections that leave nothing of the first three columns below the third row.
fn reflect(rows: &mut [[f32; COLUMNS]]) -> Option<()> {
    for c in 0..3 {
        let square: f32 = rows[c..].iter().map(|row| row[c] * row[c]).sum();
        let norm = ComplexField::sqrt(square);
        if norm.is_nan() || norm <= SPANS {
            return None;
        }
        let first = rows[c][c];
        let norm = if first > 0.0 { -norm } else { norm };
        // v = column - norm e, |v|^2 = 2 norm (norm - first)
        let mut v = [0.0; TRIAD_AXES];
        for (v, row) in v.iter_mut().zip(&rows[c..]) {
            *v = row[c];
        }
        v[0] -= norm;
        let by = 2.0 / (2.0 * norm * (norm - first));
        for column in c..COLUMNS {
            let dot: f32 = rows[c..].iter().zip(&v).map(|(row, v)| row[column] * v).sum();
            for (row, v) in rows[c..].iter_mut().zip(&v) {
                row[column] -= by * dot * v;
            }
        }
    }
    Some(())
}

/// The force, by the triangle that the reflections left.
fn solve(rows: &[[f32; COLUMNS]; TRIAD_AXES]) -> Vector3<f32> {
    let z = rows[2][3] / rows[2][2];
    let y = (rows[1][3] - rows[1][2] * z) / rows[1][1];
    let x = (rows[0][3] - rows[0][1] * y - rows[0][2] * z) / rows[0][0];
    Vector3::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{calibration::Ranges, unit::Settings};

    fn set() -> Set {
        Set::nominal(Ranges::of(&Settings::NOMINAL))
    }

    /// The rate of a body that spins by `spin` while its axis turns by `across` in axes that do not spin.
    fn believed([spin, spin_up, u, v, du, dv, lever]: [f32; SEEN]) -> Believed {
        let across_b = [Vector3::new(0.0, 0.6, -0.8), Vector3::new(0.0, 0.8, 0.6)];
        let turning_b = across_b[0] * u + across_b[1] * v;
        let turned_b = Vector3::new(0.0, turning_b.z, -turning_b.y) * spin;
        Believed {
            rate_b: Vector3::new(spin, 0.0, 0.0) + turning_b,
            rate_dot_b: Vector3::new(spin_up, 0.0, 0.0) + across_b[0] * du + across_b[1] * dv + turned_b,
            across_b,
            lever,
        }
    }

    fn felt(set: &Set, force_b: Vector3<f32>, of: &Believed) -> Reading {
        let along = core::array::from_fn(|k| {
            let place_b = set.place_b[k / 3] * (1.0 + of.lever);
            let all_b = force_b + of.rate_dot_b.cross(&place_b) + of.rate_b.cross(&of.rate_b.cross(&place_b));
            set.acc[k].axis_b.dot(&all_b)
        });
        Reading {
            along,
            used: 0xFFF,
            variance: 0.0,
        }
    }

    const TRUE: [f32; SEEN] = [18.0, -3.0, 0.05, -0.1, 0.3, 0.2, 0.02];

    #[test]
    fn what_is_true_leaves_nothing_whatever_the_force_and_whichever_axes_are_left() {
        let set = set();
        let force_b = Vector3::new(70.0, -3.0, 2.0);
        let mut reading = felt(&set, force_b, &believed(TRUE));
        for used in [0xFFF, 0xFF0, 0b1110_1011_1010] {
            reading.used = used;
            let found = equations(&set, &reading, &believed(TRUE)).expect("equations");
            assert_eq!(found.count as u32, used.count_ones() - 3);
            let worst = found
                .residuals
                .iter()
                .fold(0.0_f32, |worst, left| worst.max(left.abs()));
            assert!(worst < 1e-3, "{worst}");
            assert!((found.force_b - force_b).norm() < 1e-3, "{}", found.force_b);
        }
        reading.used = 0b111;
        assert!(equations(&set, &reading, &believed(TRUE)).is_none());
    }

    #[test]
    fn each_state_is_seen_as_a_small_error_of_it_shows() {
        let set = set();
        let force_b = Vector3::new(20.0, 1.0, 0.0);
        for k in 0..SEEN {
            let step = 1e-2;
            let mut moved = TRUE;
            moved[k] += step;
            let reading = felt(&set, force_b, &believed(moved));
            let found = equations(&set, &reading, &believed(TRUE)).expect("equations");
            for (row, residual) in found.rows.iter().zip(found.residuals) {
                // Quadratic in the spin: half a thousandth of itself.
                let expected = row[k] * step;
                assert!(
                    (residual - expected).abs() < 2e-3 * expected.abs() + 2e-3,
                    "{k}: {residual} {expected}"
                );
            }
        }
    }
}
