//! How the unit moves: attitude and acceleration of its centre as pure functions of time.
//!
//! One motion a file. A motion knows nothing of gravity, Earth rate or field; [`World`] adds those. Analytic motions are
//! built of [`Profile`]s and [`Attitude`] turns and so have exact derivatives. [`LIST`] names them for the command line.

#[cfg(test)]
mod check;
mod guided;
mod rate_table;
mod recorded;
mod rotation_test;
mod rough;
mod smooth;
mod sounding_rocket;
mod spline;
mod still;
mod tumble;

use std::sync::Arc;

use emems::site::{Launch, Site};
use nalgebra::Vector3;

pub use guided::Guided;
pub use rate_table::{Axis, Plateau, Position, RateTable, TABLE_4_1};
pub use recorded::Recorded;
pub use rotation_test::RotationTest;
pub use rough::{Levels, Rough};
pub use sounding_rocket::{Course, SoundingRocket};
pub use still::Still;
pub use tumble::Tumble;

use crate::environment::{Environment, World};
pub use crate::kinematics::{Attitude, Jet, Motion, Pose, Profile};
use crate::truth::TruthSource;

impl Motion for Arc<dyn Motion> {
    fn at(&self, t_s: f64) -> Pose {
        (**self).at(t_s)
    }

    fn duration_s(&self) -> Option<f64> {
        (**self).duration_s()
    }

    fn position_n(&self, t_s: f64) -> Vector3<f64> {
        (**self).position_n(t_s)
    }
}

/// A motion of any kind, somewhere on Earth.
pub type AnyWorld = World<Arc<dyn Motion>>;

/// A motion the command line offers.
pub struct Named {
    /// What to type.
    pub name: &'static str,
    /// What it is, in one line.
    pub about: &'static str,
    /// Where a launch crew tells the unit that it is; one without a known field is not told, but compiled in.
    pub site: Site,
    /// Whether the flight shakes the unit, beyond what the motion says.
    is_rough: bool,
    world: fn() -> AnyWorld,
}

/// \[s\] on the pad before lift-off, long enough for alignment and gyro bias at rest.
const PAD_WAIT_S: f64 = 30.0;

/// All motions, each at its default site.
pub const LIST: [Named; 7] = [
    Named {
        name: "still",
        about: "at rest, level, in the laboratory",
        site: Site::LABORATORY,
        is_rough: false,
        world: || laboratory(Still::level()),
    },
    Named {
        name: "rate-table",
        about: "the twelve positions of the gyro calibration (Table 4.1), 200 deg/s each way",
        site: Site::LABORATORY,
        is_rough: false,
        world: || laboratory(RateTable::calibration()),
    },
    Named {
        name: "tumble",
        about: "10 s rest, then all three axes at once",
        site: Site::LABORATORY,
        is_rough: false,
        world: || laboratory(Tumble::new()),
    },
    Named {
        name: "rotation-1",
        about: "rotation test 1 of chapter 6: each axis on its own",
        site: Site::LABORATORY,
        is_rough: false,
        world: || laboratory(RotationTest::first()),
    },
    Named {
        name: "rotation-2",
        about: "rotation test 2 of chapter 6: yaw 40, pitch 35, roll 45 and -30 deg, and back",
        site: Site::LABORATORY,
        is_rough: false,
        world: || laboratory(RotationTest::second()),
    },
    Named {
        name: "rocket",
        about: "a VSB-30 flight from Alcantara: 30 s on the pad, boost, 6 min of micro-gravity, re-entry",
        site: Site::ALCANTARA,
        is_rough: false,
        world: alcantara,
    },
    Named {
        name: "rocket-rough",
        about: "the same with vibration, buffeting, thrust oscillation and gyros that feel force",
        site: Site {
            launch: match Site::ALCANTARA.launch {
                Some(launch) => Some(Launch {
                    bias_per_g_deg_s: 0.02,
                    ..launch
                }),
                None => None,
            },
            ..Site::ALCANTARA
        },
        is_rough: true,
        world: alcantara,
    },
];

/// The motion of that name at its default site; `None` if there is none.
pub fn by_name(name: &str) -> Option<Box<dyn TruthSource>> {
    let named = LIST.iter().find(|named| named.name == name)?;
    let world = (named.world)();
    Some(match named.is_rough {
        true => Box::new(Rough::new(world, PAD_WAIT_S, Levels::ROUGH, 1)),
        false => Box::new(world),
    })
}

/// The same, motion and site apart.
pub fn world_by_name(name: &str) -> Option<AnyWorld> {
    LIST.iter()
        .find(|named| named.name == name)
        .map(|named| (named.world)())
}

fn alcantara() -> AnyWorld {
    let site = Environment::alcantara();
    World {
        motion: Arc::new(SoundingRocket::new(PAD_WAIT_S, site.gravity)),
        environment: site,
    }
}

fn laboratory<M: Motion + 'static>(motion: M) -> AnyWorld {
    World {
        motion: Arc::new(motion),
        environment: Environment::laboratory(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_named_motion_begins_at_rest() {
        for named in &LIST {
            let truth = by_name(named.name).expect(named.name).at(1.0);
            assert!(
                truth.rate_b.norm() < 1e-4,
                "{} turns faster than the Earth at its start",
                named.name
            );
            assert!(
                (truth.force_b.norm() - 9.78).abs() < 0.01,
                "{} is not at one g",
                named.name
            );
        }
    }

    #[test]
    fn what_the_unit_is_told_of_the_launch_site_is_so() {
        let site = Environment::alcantara();
        let field = Site::ALCANTARA.launch.expect("a known field");
        let [dip, declination] =
            [field.dip_deg, Site::ALCANTARA.declination_deg].map(|deg| f64::from(deg).to_radians());
        let told_n = Vector3::new(dip.cos() * declination.cos(), dip.cos() * declination.sin(), dip.sin());
        assert!((told_n * f64::from(field.norm_ut) - site.field_n_ut).norm() < 0.01);
        assert!((f64::from(Site::ALCANTARA.gravity) - site.gravity).abs() < 1e-4);
        assert!((f64::from(Site::ALCANTARA.latitude_deg).to_radians() - site.latitude).abs() < 1e-4);
    }

    #[test]
    fn an_unknown_name_is_none() {
        assert!(by_name("still-standing").is_none());
    }
}
