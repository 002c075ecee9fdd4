//! A two-axis table: what its angles and rates do to the unit fixed on it.
//!
//! In: inner and outer angle, which axis turns and how fast, and how the unit is mounted. Out: rate and specific force in
//! b. The outer axis is fixed and horizontal, the inner one is carried by it:
//! `v_b = R(inner_b, -alpha) R(outer_b, -beta) v_l`, where the laboratory frame l coincides with b at zero angles. So a
//! turning outer axis is seen at `R(inner_b, -alpha) outer_b` and a turning inner one at `inner_b`, whatever the angles.
//!
//! For [`Mount::EMEMS`] this gives all of Tables 4.1 and 4.6 of Marinho (2017), once read in b; for [`Mount::SIQUEIRA`]
//! it gives Table 7.3 of Siqueira (2014) with the sign of its z column turned: that column belongs to a left-handed frame.

use nalgebra::{Rotation3, Unit, Vector3};

/// Earth's rate [rad/s] (Siqueira 2014, Appendix D).
pub const EARTH_RATE: f64 = 7.292_115_854_7e-5;

/// How the unit sits on the table when both angles are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// Inner axis in b.
    pub inner_b: Vector3<f64>,
    /// Outer axis in b.
    pub outer_b: Vector3<f64>,
    /// Down in b.
    pub down_b: Vector3<f64>,
}

/// The axis that turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turning {
    /// The axis the unit is fixed to ("axis 1" of Marinho, "interno" of Siqueira).
    Inner,
    /// The axis that carries the inner one ("axis 2", "intermediário").
    Outer,
}

/// Angles of both axes \[rad\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Inner angle.
    pub inner_rad: f64,
    /// Outer angle.
    pub outer_rad: f64,
}

/// Where the table stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Gravity [m/s2].
    pub gravity_m_s2: f64,
    /// Latitude \[rad\], north positive.
    pub latitude_rad: f64,
    /// Azimuth of the outer axis \[rad\], east of north; `None` if nobody measured it.
    pub outer_azimuth_rad: Option<f64>,
}

impl Mount {
    /// The e-MEMS unit on its table (Marinho 2017, Figure 4.1): inner axis down through z, outer axis along y.
    pub const EMEMS: Mount = Mount {
        inner_b: Vector3::new(0.0, 0.0, 1.0),
        outer_b: Vector3::new(0.0, 1.0, 0.0),
        down_b: Vector3::new(0.0, 0.0, 1.0),
    };

    /// The gyro tetrahedron of Siqueira (2014), Figure 7.4: inner axis up through X, middle axis along Y.
    pub const SIQUEIRA: Mount = Mount {
        inner_b: Vector3::new(1.0, 0.0, 0.0),
        outer_b: Vector3::new(0.0, 1.0, 0.0),
        down_b: Vector3::new(-1.0, 0.0, 0.0),
    };

    /// Rotation from laboratory to b.
    pub fn dcm_bl(&self, pose: Pose) -> Rotation3<f64> {
        self.inner_turn(pose) * Rotation3::from_axis_angle(&Unit::new_normalize(self.outer_b), -pose.outer_rad)
    }

    /// The turning axis in b.
    pub fn axis_b(&self, pose: Pose, turning: Turning) -> Vector3<f64> {
        match turning {
            Turning::Inner => self.inner_b,
            Turning::Outer => self.inner_turn(pose) * self.outer_b,
        }
    }

    /// Mean inertial rate [rad/s] in b over whole turns at `rate_rad_s`: the table's, and of the Earth's only what lies
    /// along the turning axis, since the rest goes round. Without an azimuth the Earth's rate is left out.
    pub fn rate_b(&self, pose: Pose, turning: Turning, rate_rad_s: f64, site: &Site) -> Vector3<f64> {
        let axis_b = self.axis_b(pose, turning);
        let earth_b = self.earth_rate_b(pose, site).unwrap_or_default();
        axis_b * (rate_rad_s + axis_b.dot(&earth_b))
    }

    /// The Earth's rate [rad/s] in b with the table at rest; `None` without an azimuth.
    pub fn earth_rate_b(&self, pose: Pose, site: &Site) -> Option<Vector3<f64>> {
        let azimuth_rad = site.outer_azimuth_rad?;
        // In l the outer axis is horizontal at this azimuth, and north is turned back from it about down.
        let turn = Rotation3::from_axis_angle(&Unit::new_normalize(self.down_b), -azimuth_rad);
        let north_l = turn * self.outer_b;
        let (sin, cos) = site.latitude_rad.sin_cos();
        Some(self.dcm_bl(pose) * (north_l * cos - self.down_b * sin) * EARTH_RATE)
    }

    /// Specific force [m/s2] in b on a table at rest that leans by small angles: its outer axis points down by
    /// `lean_rad[0]`, and its outer angle reads too little by `lean_rad[1]`.
    pub fn force_b(&self, pose: Pose, site: &Site, lean_rad: [f64; 2]) -> Vector3<f64> {
        let across = self.outer_b.cross(&self.down_b);
        let [outer, zero] = lean_rad;
        let down_l = (self.down_b + self.outer_b * outer - across * zero).normalize();
        -(self.dcm_bl(pose) * down_l) * site.gravity_m_s2
    }

    fn inner_turn(&self, pose: Pose) -> Rotation3<f64> {
        Rotation3::from_axis_angle(&Unit::new_normalize(self.inner_b), -pose.inner_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of sines of angles up to two turns.
    const ROUNDING: f64 = 1e-12;

    const SITE: Site = Site {
        gravity_m_s2: 1.0,
        latitude_rad: -0.405_110_679,
        outer_azimuth_rad: None,
    };

    fn pose(inner_deg: f64, outer_deg: f64) -> Pose {
        Pose {
            inner_rad: inner_deg.to_radians(),
            outer_rad: outer_deg.to_radians(),
        }
    }

    #[test]
    fn gravity_is_that_of_table_4_6() {
        // gravity_e/g = (cos b, sin a sin b, -cos a sin b); x_b = z_e, y_b = y_e, z_b = x_e.
        for (a, b) in [
            (0.0, 30.0),
            (270.0, 90.0),
            (180.0, 71.565),
            (300.0, 101.565),
            (60.0, 401.565),
        ] {
            let ((sa, ca), (sb, cb)) = (f64::to_radians(a).sin_cos(), f64::to_radians(b).sin_cos());
            let expected_b = Vector3::new(-ca * sb, sa * sb, cb);
            assert!((Mount::EMEMS.force_b(pose(a, b), &SITE, [0.0; 2]) + expected_b).norm() < ROUNDING);
        }
    }

    #[test]
    fn the_outer_axis_is_seen_as_in_table_4_1_and_the_inner_one_always_alike() {
        for inner_deg in [0.0, 30.0, 90.0, 150.0, 180.0, 210.0, 270.0, 330.0] {
            let (sin, cos) = f64::to_radians(inner_deg).sin_cos();
            let outer_b = Mount::EMEMS.axis_b(pose(inner_deg, 40.0), Turning::Outer);
            assert!((outer_b - Vector3::new(sin, cos, 0.0)).norm() < ROUNDING);
            let inner_b = Mount::EMEMS.axis_b(pose(inner_deg, 180.0), Turning::Inner);
            assert_eq!(inner_b, Vector3::z(), "row 2 of Table 4.1 has the wrong sign");
        }
        let middle = Mount::SIQUEIRA.axis_b(pose(30.0, 0.0), Turning::Outer);
        assert!((middle - Vector3::new(0.0, 0.75_f64.sqrt(), -0.5)).norm() < ROUNDING);
    }

    #[test]
    fn the_earth_turns_as_at_the_site_of_appendix_d() {
        // Outer axis north: Y of Siqueira's frame north, X up, so Z = X cross Y points west.
        let site = Site {
            outer_azimuth_rad: Some(0.0),
            ..SITE
        };
        let earth_b = Mount::SIQUEIRA.earth_rate_b(Pose::default(), &site).expect("azimuth");
        let deg_h = earth_b.map(|rate| rate.to_degrees() * 3600.0);
        // Seed values 13.823626205 north and 5.927993281 down, at latitude -23.211132308 deg.
        assert!(
            (deg_h - Vector3::new(-5.927_993, 13.823_626, 0.0)).norm() < 1e-5,
            "{deg_h}"
        );
        let east = Site {
            outer_azimuth_rad: Some(std::f64::consts::FRAC_PI_2),
            ..SITE
        };
        let rate_b = Mount::SIQUEIRA.rate_b(Pose::default(), Turning::Outer, 0.1, &east);
        assert!(
            (rate_b - Vector3::y() * 0.1).norm() < ROUNDING,
            "about east the Earth's rate goes round"
        );
    }

    #[test]
    fn a_lean_turns_gravity_by_its_angle() {
        let leaning = Mount::EMEMS.force_b(pose(0.0, 0.0), &SITE, [0.001, 0.0]);
        assert!((leaning - Vector3::new(0.0, -0.001, -1.0)).norm() < 1e-6);
        let zero = Mount::EMEMS.force_b(pose(0.0, 30.0), &SITE, [0.0, 0.001]);
        let turned = Mount::EMEMS.force_b(
            Pose {
                outer_rad: 30_f64.to_radians() + 0.001,
                ..pose(0.0, 0.0)
            },
            &SITE,
            [0.0; 2],
        );
        assert!((zero - turned).norm() < 1e-6, "{zero} {turned}");
    }
}
