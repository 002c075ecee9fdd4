//! TRIAD and QUEST against the textbook, and their covariances against the errors they make.

use emems::{
    attitude::dcm_bn,
    quest::quest,
    triad::{Observation, Sighting, Unobservable, triad},
};
use host_tests::reference::wahba;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

struct Random(Xoshiro256PlusPlus);

impl Random {
    fn normal3(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| StandardNormal.sample(&mut self.0))
    }
}

fn sighting(seen_b: Vector3<f64>, known_n: Vector3<f64>, seen_sd: f64) -> Sighting {
    Sighting {
        seen_b: seen_b.cast(),
        known_n: known_n.cast(),
        seen_sd: seen_sd as f32,
        known_sd: 0.0,
    }
}

/// An eigenvector is rounded as its matrix is (four rotations of 1e-7) over the gap to the next eigenvalue, which for
/// directions 15 deg apart with these weights comes down to 0.02.
const ROUNDING: f64 = 2e-5;

#[test]
fn thousands_of_random_sightings_agree_with_the_reference() {
    let mut random = Random(Xoshiro256PlusPlus::seed_from_u64(1));
    for _ in 0..5_000 {
        let q_nb = UnitQuaternion::from_scaled_axis(random.normal3() * 2.0);
        let known: Vec<Vector3<f64>> = (0..3).map(|_| random.normal3()).collect();
        let seen: Vec<Vector3<f64>> = known
            .iter()
            .map(|v| q_nb.inverse() * v + random.normal3() * 0.01)
            .collect();
        let sines = (
            known[0].normalize().cross(&known[1].normalize()).norm(),
            seen[0].normalize().cross(&seen[1].normalize()).norm(),
        );
        if sines.0.min(sines.1) < 0.25 {
            continue;
        }
        let sightings: Vec<Sighting> = (0..3)
            .map(|i| sighting(seen[i], known[i], 0.01 * (i + 1) as f64))
            .collect();
        let check = |found: UnitQuaternion<f32>, expected: Matrix3<f64>| {
            let off = (dcm_bn(&found).cast::<f64>() - expected).amax();
            assert!(off < ROUNDING, "{off}");
        };
        check(
            triad(&sightings[0], &sightings[1]).expect("not collinear").q_nb,
            wahba::triad([seen[0], seen[1]], [known[0], known[1]]),
        );
        let weighted: Vec<_> = (0..3)
            .map(|i| (seen[i], known[i], 1.0 / ((i + 1) as f64).powi(2)))
            .collect();
        check(quest(&sightings).expect("not collinear").q_nb, wahba::best(&weighted));
    }
}

/// Sample covariance in b over `DRAWS` noisy sightings, and what the method says of itself.
fn compared(method: fn(&[Sighting; 2]) -> Result<Observation, Unobservable>) -> (Matrix3<f64>, Matrix3<f64>) {
    const DRAWS: usize = 40_000;
    const SD: [f64; 2] = [0.004, 0.02];
    let mut random = Random(Xoshiro256PlusPlus::seed_from_u64(2));
    let q_nb = UnitQuaternion::from_euler_angles(0.17, -0.35, 0.52);
    let known = [Vector3::new(0.0, 0.0, -1.0), Vector3::new(0.7, -0.2, -0.5).normalize()];
    let (mut sample, mut said) = (Matrix3::zeros(), Matrix3::zeros());
    for _ in 0..DRAWS {
        let sightings = [0, 1].map(|i| {
            let turned = UnitQuaternion::from_scaled_axis(random.normal3() * SD[i]) * (q_nb.inverse() * known[i]);
            sighting(turned, known[i], SD[i])
        });
        let found = method(&sightings).expect("not collinear");
        // Small rotation in b by which the found attitude differs.
        let error = (q_nb.inverse() * found.q_nb.cast()).scaled_axis();
        sample += error * error.transpose() / DRAWS as f64;
        said += found.covariance_b.cast::<f64>() / DRAWS as f64;
    }
    (sample, said)
}

/// Three standard deviations of a sample variance of 40,000 draws, and the curvature that a first-order covariance
/// leaves out.
const SAMPLING: f64 = 0.025;

#[test]
fn the_covariance_of_triad_is_that_of_its_errors() {
    let (sample, said) = compared(|sightings| triad(&sightings[0], &sightings[1]));
    assert!((sample - said).norm() < SAMPLING * said.norm(), "{sample} {said}");
}

#[test]
fn the_covariance_of_quest_is_that_of_its_errors() {
    let (sample, said) = compared(|sightings| quest(sightings));
    assert!((sample - said).norm() < SAMPLING * said.norm(), "{sample} {said}");
}
