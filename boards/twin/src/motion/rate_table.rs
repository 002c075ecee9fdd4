//! The two-axis rate table of the gyro calibration (thesis 002, Table 4.1), turned both ways in every position.
//!
//! Axis 2 (angle beta) is the outer, horizontal one; axis 1 (alpha) the inner one, along the unit's down axis. The thesis
//! states in its left-handed frame e that gravity is (cos b, sin a sin b, -cos a sin b) g and that the rates are
//! (1, 0, 0) from axis 1 and (0, cos a, sin a) from axis 2; in b (x_b = z_e, y_b = y_e, z_b = x_e) both are those of a
//! pitch by beta followed by a yaw by alpha, which is what is turned here. Both sense directions in one position undo
//! each other, so the table ends each position where it began it.

use nalgebra::Vector3;

use super::Profile;
use super::{Attitude, Motion, Pose};

/// An axis of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Axis 1, along the unit's down axis.
    Inner,
    /// Axis 2, horizontal.
    Outer,
}

/// Where the table stands before it turns, and which axis turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// \[deg\] axis 1.
    pub inner_deg: f64,
    /// \[deg\] axis 2.
    pub outer_deg: f64,
    /// The axis that turns.
    pub turns: Axis,
}

impl Position {
    /// Both axes at the start \[deg\], and the one that turns.
    pub const fn new(inner_deg: f64, outer_deg: f64, turns: Axis) -> Self {
        Self {
            inner_deg,
            outer_deg,
            turns,
        }
    }
}

/// Table 4.1: the twelve positions. 7 and 8 repeat 6 and 5, as printed.
pub const TABLE_4_1: [Position; 12] = [
    Position::new(0.0, 0.0, Axis::Inner),
    Position::new(0.0, 180.0, Axis::Inner),
    Position::new(0.0, 0.0, Axis::Outer),
    Position::new(180.0, 0.0, Axis::Outer),
    Position::new(90.0, 0.0, Axis::Outer),
    Position::new(270.0, 0.0, Axis::Outer),
    Position::new(270.0, 0.0, Axis::Outer),
    Position::new(90.0, 0.0, Axis::Outer),
    Position::new(30.0, 0.0, Axis::Outer),
    Position::new(210.0, 0.0, Axis::Outer),
    Position::new(150.0, 0.0, Axis::Outer),
    Position::new(330.0, 0.0, Axis::Outer),
];

/// A stretch of constant rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plateau {
    /// Index of the position.
    pub position: usize,
    /// [rad/s] rate of the table, in b.
    pub rate_nb_b: Vector3<f64>,
    /// \[s\] when it begins.
    pub from_s: f64,
    /// \[s\] when it ends.
    pub to_s: f64,
}

/// \[s\] to move between positions; the longest way is 270 deg.
const MOVE_S: f64 = 3.0;
/// \[s\] at rest before and after turning in a position.
const DWELL_S: f64 = 2.0;
/// \[s\] from rest to the rate, and twice that from one sense to the other.
const RAMP_S: f64 = 1.0;

/// The table working through its positions.
#[derive(Clone, Debug)]
pub struct RateTable {
    inner: Profile,
    outer: Profile,
    plateaus: Vec<Plateau>,
}

impl RateTable {
    /// Table 4.1 at 200 deg/s, the rate of the thesis' samples (Tables 4.2 to 4.5), 5 s each way.
    pub fn calibration() -> Self {
        Self::new(&TABLE_4_1, 200.0_f64.to_radians(), 5.0)
    }

    /// These positions in turn, at `rate` [rad/s] for `plateau_s` and then at the opposite rate for as long.
    pub fn new(positions: &[Position], rate: f64, plateau_s: f64) -> Self {
        let (mut inner, mut outer) = (Profile::from_rest(0.0), Profile::from_rest(0.0));
        let mut plateaus = Vec::new();
        for (index, place) in positions.iter().enumerate() {
            let alpha = place.inner_deg.to_radians();
            inner = inner.coast(DWELL_S).move_to(alpha, MOVE_S).coast(DWELL_S);
            outer = outer
                .coast(DWELL_S)
                .move_to(place.outer_deg.to_radians(), MOVE_S)
                .coast(DWELL_S);
            let axis_b = match place.turns {
                Axis::Inner => Vector3::z(),
                Axis::Outer => Vector3::new(alpha.sin(), alpha.cos(), 0.0),
            };
            let begin_s = inner.end_s();
            let both_ways = |axis: Profile| {
                let there = axis.ramp_to_rate(rate, RAMP_S).coast(plateau_s);
                there
                    .ramp_to_rate(-rate, 2.0 * RAMP_S)
                    .coast(plateau_s)
                    .ramp_to_rate(0.0, RAMP_S)
            };
            let both_ways_s = 4.0 * RAMP_S + 2.0 * plateau_s;
            (inner, outer) = match place.turns {
                Axis::Inner => (both_ways(inner), outer.coast(both_ways_s)),
                Axis::Outer => (inner.coast(both_ways_s), both_ways(outer)),
            };
            let [there_s, back_s] = [begin_s + RAMP_S, begin_s + 3.0 * RAMP_S + plateau_s];
            for (rate, from_s) in [(rate, there_s), (-rate, back_s)] {
                let rate_nb_b = axis_b * rate;
                plateaus.push(Plateau {
                    position: index,
                    rate_nb_b,
                    from_s,
                    to_s: from_s + plateau_s,
                });
            }
        }
        Self {
            inner: inner.coast(DWELL_S),
            outer: outer.coast(DWELL_S),
            plateaus,
        }
    }

    /// The stretches of constant rate, in order of time: two a position.
    pub fn plateaus(&self) -> &[Plateau] {
        &self.plateaus
    }
}

impl Motion for RateTable {
    fn at(&self, t_s: f64) -> Pose {
        Pose::turning(Attitude::level().pitched(self.outer.at(t_s)).yawed(self.inner.at(t_s)))
    }

    fn duration_s(&self) -> Option<f64> {
        Some(self.inner.end_s())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::check;

    /// Rounding of angles of up to 1000 deg.
    const EXACT: f64 = 1e-9;
    const H: f64 = 0.866_025_403_784;

    /// Table 4.1 with rows 2 and 10 corrected: rate over w_m along (x_e, y_e, z_e).
    const RATE_E: [[f64; 3]; 12] = [
        [1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [0.0, 0.0, -1.0],
        [0.0, 0.0, 1.0],
        [0.0, H, 0.5],
        [0.0, -H, -0.5],
        [0.0, -H, 0.5],
        [0.0, H, -0.5],
    ];

    #[test]
    fn each_position_turns_as_the_corrected_table_says_in_both_senses() {
        let table = RateTable::calibration();
        assert_eq!(table.plateaus().len(), 24);
        for (index, plateau) in table.plateaus().iter().enumerate() {
            let [x_e, y_e, z_e] = RATE_E[plateau.position];
            let sense = if index % 2 == 0 { 1.0 } else { -1.0 };
            let expected = Vector3::new(z_e, y_e, x_e) * sense * 200.0_f64.to_radians();
            assert!(
                (plateau.rate_nb_b - expected).norm() < EXACT,
                "plateau {index}: {}",
                plateau.rate_nb_b
            );
            for part in [0.0, 0.3, 1.0] {
                let t = plateau.from_s + part * (plateau.to_s - plateau.from_s);
                let attitude = table.at(t).attitude;
                assert!((attitude.rate_nb_b - expected).norm() < EXACT, "plateau {index} at {t}");
                assert!(attitude.rate_dot_nb_b.norm() < EXACT, "plateau {index} at {t}");
            }
        }
    }

    #[test]
    fn gravity_follows_the_tables_law() {
        // In e: (cos b, sin a sin b, -cos a sin b); here alpha = 30 deg, beta = 40 deg, right after the move.
        let table = RateTable::new(&[Position::new(30.0, 40.0, Axis::Inner)], 1.0, 1.0);
        let gravity_b = table.at(DWELL_S + MOVE_S).attitude.q_nb.inverse() * Vector3::z();
        let (a, b) = (30.0_f64.to_radians(), 40.0_f64.to_radians());
        let [x_e, y_e, z_e] = [b.cos(), a.sin() * b.sin(), -a.cos() * b.sin()];
        assert!((gravity_b - Vector3::new(z_e, y_e, x_e)).norm() < EXACT, "{gravity_b}");
    }

    #[test]
    fn it_leaves_each_position_where_it_came_to_it() {
        let table = RateTable::new(&TABLE_4_1[4..5], 3.0, 5.0);
        let end = table.duration_s().unwrap();
        let came = table.at(DWELL_S + MOVE_S).attitude.q_nb;
        assert!(came.angle_to(&table.at(end).attitude.q_nb) < EXACT);
    }

    #[test]
    fn its_derivatives_are_those_of_its_attitude() {
        check::derivatives(&RateTable::new(&TABLE_4_1[..3], 2.0, 1.0), 0.0, 40.0);
    }
}
