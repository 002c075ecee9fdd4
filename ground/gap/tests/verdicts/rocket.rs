//! A boost without a reference: gyros at their stops, and an effect that one phase alone shows.

use crate::twin_case::Log;
use gap::parity::analysed;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use serde_json::Value;
use tempfile::TempDir;
use twin::{
    effect::{Active, Cause, Locality, by_name},
    environment::Environment,
    kinematics::{Attitude, Motion, Pose, Profile},
    motion::SoundingRocket,
};

fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    move || StandardNormal.sample(&mut random)
}

/// The texts of a case: its verdict, its screen, its attitude.
fn judged(folder: &TempDir) -> (Value, String, Option<String>) {
    let texts = analysed(folder.path(), &[], &|_, _| ()).expect("judged");
    let of = |file: &str| {
        texts
            .iter()
            .find(|(name, _)| name == file)
            .map(|(_, text)| text.clone())
    };
    let verdict = serde_json::from_str(&of("verdict.json").expect("a verdict")).expect("json");
    (verdict, of("all.txt").expect("a screen"), of("attitude.csv"))
}

/// Ten seconds at rest, eight of six times gravity, then free fall, turning slowly.
struct Pushed {
    up: Profile,
    yaw: Profile,
}

impl Pushed {
    fn new() -> Self {
        Self {
            up: Profile::from_rest(0.0)
                .coast(10.0)
                .move_to(5.0 * 9.8, 0.5)
                .coast(8.0)
                .move_to(-9.78, 0.5),
            yaw: Profile::from_rest(0.3).coast(12.0).ramp_to_rate(0.2, 20.0),
        }
    }
}

impl Motion for Pushed {
    fn at(&self, t_s: f64) -> Pose {
        Pose {
            acc_n: Vector3::new(0.0, 0.0, -self.up.at(t_s).value),
            ..Pose::turning(Attitude::level().yawed(self.yaw.at(t_s)))
        }
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}

/// Of a log of it whose second plate has this quadratic term, pushed or at rest all the time.
fn quadratic(size: f64) -> Value {
    let motion = Pushed::new();
    let active = [Active {
        cause: Cause {
            effect: by_name("accel-nonlinearity").expect("an effect"),
            locality: Locality::Group("plate 2".to_owned()),
            variant: 0.0,
        },
        theta: vec![size],
    }];
    let log = Log {
        active: &active,
        ..Log::nominal(&motion, Environment::alcantara(), (0.0, 60.0))
    };
    let windows = "[motion_known]\nnone = true\n[windows]\nfit = [[0.0, 50.0]]\nhold = [[50.0, 60.0]]\n";
    judged(&log.folder("pushed", noise(5), "", windows)).0
}

#[test]
fn an_effect_that_the_thrust_alone_shows_says_so_in_the_verdict() {
    let verdict = quadratic(2e-3);
    let cause = &verdict["causes"][0];
    assert_eq!(cause["effect"], "accel-nonlinearity", "{verdict:#}");
    assert_eq!(cause["only_in"], "thrust", "{cause:#}");
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_healthy_rocket_leaves_its_spin_out_and_settles() {
        let site = Environment::alcantara();
        let motion = SoundingRocket::new(20.0, site.gravity);
        let windows = "[motion_known]\nnone = true\n[windows]\nfit = [[0.0, 160.0]]\nhold = [[160.0, 240.0]]\n";
        let log = Log::nominal(&motion, site, (0.0, 240.0));
        let (verdict, screen, attitude) = judged(&log.folder("rocket", noise(3), "", windows));
        assert_eq!(verdict["outcome"], "clean", "{screen}");
        // 18 sigma with the spin.
        let gap = verdict["gap"]["before"].as_f64().expect("a gap");
        assert!((0.97..1.03).contains(&gap), "{gap}");
        assert!(screen.contains("LEFT OUT"), "{screen}");
        let unwrapped = screen.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            unwrapped.contains("of the packets that were LEFT OUT nothing is said"),
            "{screen}"
        );
        let left_out = verdict["left_out"].as_u64().expect("packets");
        assert!((150..300).contains(&left_out), "{left_out}");
        let attitude = attitude.expect("has settled");
        let rows: Vec<Vec<f64>> = (attitude.lines().skip(1))
            .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
            .collect();
        let (mut error, mut stated) = (0.0, 0.0);
        for row in &rows {
            let q_nb = UnitQuaternion::from_quaternion(Quaternion::new(row[1], row[2], row[3], row[4]));
            error += q_nb.angle_to(&motion.at(row[0]).attitude.q_nb).to_degrees().powi(2);
            stated += row[5..8].iter().map(|sigma| sigma * sigma).sum::<f64>();
        }
        let [error, stated] = [error, stated].map(|sum| (sum / rows.len() as f64).sqrt());
        println!("{} rows, off {error} deg, stated {stated}", rows.len());
        assert!(error < 3.0 * stated && stated < 1.0, "{error} {stated}");
        // Beyond the spin it falls, and nothing tells a turn about the field: no attitude is given there.
        let last_s = rows.last().expect("rows")[0];
        assert!((20.0..40.0).contains(&last_s), "{last_s}");
    }
}
