//! Where a gyro stands in a multi-position test, and what the Earth does to it there.
//!
//! In: the angles of a table whose middle axis is horizontal and points east and whose inner axis carries the gyro's
//! spin axis; the latitude. Out: gravity \[g\] and the Earth's rate [deg/h] along the gyro's axes `(x, y, spin)`, right-handed.
//!
//! With middle angle `b` the spin axis is `cos b` up and `sin b` north; the inner angle `a` turns `x`, `y` about it,
//! from `x` in the meridian plane. The spin axis is polar, along the Earth's rotation, at `b = 90 deg - latitude`, or
//! against it half a turn further. ([`twenty_four`]: section 3.7 of the dry-tuned gyro paper, which says 24 positions,
//! eight of them polar, and not which.)

/// Earth's rotation [deg/h] (WGS 84: 7.2921158e-5 rad/s).
pub const EARTH_RATE: f64 = 15.041068639;

/// Gravity and the Earth's rate along the gyro's axes `x`, `y`, spin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Direction of gravity times its size \[g\]: `(0, 0, -1)` with the spin axis up.
    pub gravity: [f64; 3],
    /// Rate the gyro turns at [deg/h].
    pub rate: [f64; 3],
}

impl Position {
    /// At rest on the table, angles and latitude in degrees.
    pub fn on_table(inner_deg: f64, middle_deg: f64, latitude_deg: f64) -> Self {
        let (sa, ca) = inner_deg.to_radians().sin_cos();
        let (sb, cb) = middle_deg.to_radians().sin_cos();
        let (sl, cl) = latitude_deg.to_radians().sin_cos();
        // North, east, down.
        let spin = [sb, 0.0, -cb];
        let meridian = [cb, 0.0, sb];
        // Right-handed: x, y, spin. At inner angle zero x lies in the meridian plane and y = spin cross x.
        let across = [
            spin[1] * meridian[2] - spin[2] * meridian[1],
            spin[2] * meridian[0] - spin[0] * meridian[2],
            spin[0] * meridian[1] - spin[1] * meridian[0],
        ];
        let x: [f64; 3] = std::array::from_fn(|k| ca * meridian[k] + sa * across[k]);
        let y: [f64; 3] = std::array::from_fn(|k| ca * across[k] - sa * meridian[k]);
        let along = |v: [f64; 3]| {
            let dot = |axis: [f64; 3]| (0..3).map(|k| axis[k] * v[k]).sum::<f64>();
            [dot(x), dot(y), dot(spin)]
        };
        Self {
            gravity: along([0.0, 0.0, 1.0]),
            rate: along([EARTH_RATE * cl, 0.0, -EARTH_RATE * sl]),
        }
    }
}

/// Inner and middle angles \[deg\] of 24 positions that determine all that can be: the spin axis up, north, down and south
/// with inner steps of a right angle, and eight polar positions with inner angles between those, without which the
/// product of the two sensitive axes stays unexcited.
pub fn twenty_four(latitude_deg: f64) -> Vec<(f64, f64)> {
    let quarters = [0.0, 90.0, 180.0, 270.0];
    let cardinal = quarters
        .iter()
        .flat_map(|middle| quarters.iter().map(move |inner| (*inner, *middle)));
    let poles = [90.0 - latitude_deg, 270.0 - latitude_deg];
    let polar = poles
        .iter()
        .flat_map(|middle| quarters.iter().map(move |inner| (inner + 45.0, *middle)));
    cardinal.chain(polar).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROUNDING: f64 = 1e-12;

    fn check(found: [f64; 3], expected: [f64; 3]) {
        assert!(
            found.iter().zip(expected).all(|(a, b)| (a - b).abs() < ROUNDING),
            "{found:?}, not {expected:?}"
        );
    }

    #[test]
    fn eight_of_the_24_positions_are_polar() {
        let latitude = -23.211132298;
        let across = |angles: &(f64, f64)| {
            let rate = Position::on_table(angles.0, angles.1, latitude).rate;
            rate[0].hypot(rate[1])
        };
        let positions = twenty_four(latitude);
        assert_eq!(positions.len(), 24);
        assert_eq!(positions.iter().filter(|angles| across(angles) < 1e-9).count(), 8);
    }

    #[test]
    fn gravity_and_the_earths_rate_are_where_they_should_be() {
        // Spin up, at the equator: gravity against the spin axis, all of the Earth's rate along x.
        let up = Position::on_table(0.0, 0.0, 0.0);
        check(up.gravity, [0.0, 0.0, -1.0]);
        check(up.rate, [EARTH_RATE, 0.0, 0.0]);
        // Spin north, x down; a quarter turn of the inner axis puts y up.
        check(Position::on_table(0.0, 90.0, 0.0).gravity, [1.0, 0.0, 0.0]);
        check(Position::on_table(90.0, 90.0, 0.0).gravity, [0.0, -1.0, 0.0]);
        // Spin up at the site of the tetrahedron: rate (north 13.823626205, down +5.927993281) deg/h.
        let site = Position::on_table(0.0, 0.0, -23.211132298).rate;
        assert!(
            (site[0] - 13.823626205).abs() < 1e-8 && (site[2] + 5.927993281).abs() < 1e-8,
            "{site:?}"
        );
    }
}
