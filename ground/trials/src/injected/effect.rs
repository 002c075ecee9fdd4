//! What may be put into a recording.
//!
//! In: a [`Scene`], chance, a strength in typical sizes. Out: the channels it touches; the scene has it in, in all windows. Laws are
//! written here for rows of real readings: they act on what a sensor wrote (its real motion and real noise), or on the reference's
//! record, and share no equation with the library. What has a name has the verdict's.

mod field;
mod novel;
mod reference;
mod sensor;
mod stream;

use nalgebra::Vector3;

use super::{recording::Kind, scene::Scene};
use crate::draw::Draw;

/// Something that can be put into a recording.
#[derive(Clone, Copy)]
pub struct Injection {
    /// Its name in verdicts; for a novel one, its name in the answer.
    pub name: &'static str,
    /// Whether verdicts have a name for it.
    pub in_library: bool,
    /// Sensors that a recording must have.
    pub needs: &'static [Kind],
    /// Whether it is random from row to row: its variance goes with the square of its strength.
    pub random: bool,
    /// Whether it needs a thermometer beside the reference.
    pub warm: bool,
    /// Puts it in; says which channels it touches.
    pub apply: fn(&mut Scene, &mut Draw, f64) -> Vec<String>,
}

const fn shaped(
    name: &'static str,
    needs: &'static [Kind],
    apply: fn(&mut Scene, &mut Draw, f64) -> Vec<String>,
) -> Injection {
    Injection {
        name,
        in_library: true,
        needs,
        random: false,
        warm: false,
        apply,
    }
}

const fn random(
    name: &'static str,
    needs: &'static [Kind],
    apply: fn(&mut Scene, &mut Draw, f64) -> Vec<String>,
) -> Injection {
    Injection {
        random: true,
        ..shaped(name, needs, apply)
    }
}

const fn warm(
    name: &'static str,
    needs: &'static [Kind],
    apply: fn(&mut Scene, &mut Draw, f64) -> Vec<String>,
) -> Injection {
    Injection {
        warm: true,
        ..shaped(name, needs, apply)
    }
}

const GYRO: &[Kind] = &[Kind::Gyro];
const ACCELEROMETER: &[Kind] = &[Kind::Accelerometer];
const MAGNETOMETER: &[Kind] = &[Kind::Magnetometer];
const GYRO_AND_ACCELEROMETER: &[Kind] = &[Kind::Gyro, Kind::Accelerometer];
const GYRO_AND_MAGNETOMETER: &[Kind] = &[Kind::Gyro, Kind::Magnetometer];

/// All that a recording with these sensors can have; `novel` for those without a name.
pub fn all(kinds: &[Kind], novel: bool) -> Vec<Injection> {
    let all = [sensor::ALL, field::ALL, stream::ALL, reference::ALL, novel::ALL].concat();
    all.into_iter()
        .filter(|one| one.in_library != novel && one.needs.iter().all(|kind| kinds.contains(kind)))
        .collect()
}

/// Changes what the sensors at these places wrote, row by row; says which channels that touches.
fn each(scene: &mut Scene, sensors: &[usize], change: impl Fn(usize, Vector3<f64>) -> Vector3<f64>) -> Vec<String> {
    for &at in sensors {
        for (row, value) in scene.sensors[at].values.iter_mut().enumerate() {
            *value = change(row, *value);
        }
    }
    names(scene, sensors)
}

/// The channels of sensors.
fn names(scene: &Scene, sensors: &[usize]) -> Vec<String> {
    sensors.iter().flat_map(|at| scene.sensors[*at].names.clone()).collect()
}

/// One of the sensors of a kind.
fn one(scene: &Scene, kind: Kind, draw: &mut Draw) -> usize {
    let all = scene.of(kind);
    all[draw.below(all.len())]
}

/// All channels.
fn everything(scene: &Scene) -> Vec<String> {
    names(scene, &(0..scene.sensors.len()).collect::<Vec<_>>())
}

/// Whether a row of a scene lies in one of some stretches that come and go: the first begins after a tenth to a third of the log.
fn comes_and_goes(scene: &Scene, draw: &mut Draw) -> impl Fn(usize) -> bool + use<> {
    let rows = scene.times_s.len() as f64;
    let (from, long) = (rows * draw.uniform(0.1, 0.33), rows * draw.uniform(0.25, 0.45));
    move |row| (from..from + long).contains(&(row as f64))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{
        super::{
            ratio::Yardstick,
            recording::{self, Purpose},
        },
        *,
    };

    #[test]
    fn every_injection_disturbs_what_it_says_it_touches_and_nothing_else() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data");
        let recording = recording::all(&folder, Purpose::Judge)
            .expect("a minute")
            .swap_remove(0);
        let healthy = Scene::new(&recording);
        let yardstick = Yardstick::new(&healthy, &recording.case.windows.fit, 0.8, 1.5);
        assert!(yardstick.measured(&healthy, false).ratio < 1e-6);
        let kinds: Vec<Kind> = recording.sensors.iter().map(|sensor| sensor.kind).collect();
        for injection in [all(&kinds, false), all(&kinds, true)].concat() {
            let mut struck = healthy.clone();
            if injection.warm {
                struck.temperature_c = Some(super::super::temperature(&struck, &mut Draw::new(3)));
            }
            let touched = (injection.apply)(&mut struck, &mut Draw::new(5), 10.0);
            let plain = yardstick.measured(&struck, injection.random);
            assert!(plain.ratio > 3.0, "{}: {plain:?}", injection.name);
            let is_record = struck
                .record
                .iter()
                .zip(&healthy.record)
                .any(|(one, other)| one.q_nb != other.q_nb)
                || struck.gravity != healthy.gravity
                || struck.field_n_ut != healthy.field_n_ut;
            for (now, before) in struck.sensors.iter().zip(&healthy.sensors) {
                for (own, name) in now.names.iter().enumerate() {
                    let same = now
                        .values
                        .iter()
                        .zip(&before.values)
                        .all(|(now, before)| now[own] == before[own]);
                    assert!(same || touched.contains(name), "{} touches {name}", injection.name);
                    assert!(
                        is_record || !same || !touched.contains(name),
                        "{} leaves {name}",
                        injection.name
                    );
                }
            }
        }
    }
}
