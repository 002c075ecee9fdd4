//! Ring R7: a dealt effect in a healthy recording of a real unit.
//!
//! In: [`Recording`]s for a purpose, a seed. Out: a case folder of kind `csv`, and the [`Answer`]. Noise, motion, room and reference are
//! real; what is wrong is known exactly. Each effect is in the whole log, or comes and goes, so that both windows have it, and as plain
//! as drawn beside what the healthy recording leaves ([`ratio`]). Of five cases three have an effect with a name, one has something novel,
//! and one is healthy. What a recording cannot show at [`LARGEST`] typical sizes is not put into it: the next effect is tried.

mod description;
mod effect;
mod ratio;
pub mod recording;
mod scene;
mod series;
mod told;

use std::{fmt::Write as _, fs, io::Write as _, path::Path};

use flate2::{Compression, write::GzEncoder};

use self::{
    effect::Injection,
    ratio::{Plain, Yardstick},
    recording::{Kind, Recording},
    scene::Scene,
};
use crate::{
    answer::{Answer, Cause},
    deal::{DealError, SNR},
    draw::Draw,
    strength,
};

/// Largest strength, in typical sizes; the same of what has no name.
const LARGEST: f64 = 10.0;
const LARGEST_NOVEL: f64 = 20.0;

/// Least ratio of a case, of the least that is asked for: a strength is found to some percent.
const LEAST_RATIO: f64 = 0.9 * SNR.0;

/// The recordings and effects of a deal, each in an order that is drawn once.
pub struct Injected {
    recordings: Vec<Recording>,
    named: Vec<Injection>,
    novel: Vec<Injection>,
    next: [usize; 2],
}

/// What is wrong with a case of some number.
fn is_novel(number: usize) -> Option<bool> {
    [Some(false), Some(false), Some(false), Some(true), None][number % 5]
}

/// How many cases with a name, novel, or healthy there were before it: each of the three goes through all recordings in turn.
fn among_its_like(number: usize) -> usize {
    (0..number)
        .filter(|before| is_novel(*before) == is_novel(number))
        .count()
}

impl Injected {
    /// A deal from recordings.
    pub fn new(recordings: Vec<Recording>, draw: &mut Draw) -> Self {
        let every = [Kind::Gyro, Kind::Accelerometer, Kind::Magnetometer];
        let mut shuffled = |novel: bool| {
            let mut list = effect::all(&every, novel);
            for last in (1..list.len()).rev() {
                list.swap(last, draw.below(last + 1));
            }
            list
        };
        Injected {
            named: shuffled(false),
            novel: shuffled(true),
            recordings,
            next: [0; 2],
        }
    }

    /// Deals case `number` into `folder/name`.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn deal(&mut self, folder: &Path, name: &str, number: usize, seed: u64) -> Result<Answer, DealError> {
        let recording = &self.recordings[among_its_like(number) % self.recordings.len()];
        let mut draw = Draw::new(seed);
        let mut healthy = Scene::new(recording);
        if draw.chance(0.25) {
            healthy.temperature_c = Some(temperature(&healthy, &mut draw.stream(1)));
        }
        let environment = &recording.case.environment;
        let yardstick = Yardstick::new(
            &healthy,
            &recording.case.windows.fit,
            environment.field_sigma_ut.unwrap_or(0.0),
            environment.field_gradient_sigma_ut_m.unwrap_or(0.0),
        );
        let wanted = draw.log_uniform(SNR.0, SNR.1);
        let kinds: Vec<Kind> = recording.sensors.iter().map(|sensor| sensor.kind).collect();
        let (list, next) = match is_novel(number) {
            None => (&[][..], &mut 0),
            Some(false) => (self.named.as_slice(), &mut self.next[0]),
            Some(true) => (self.novel.as_slice(), &mut self.next[1]),
        };
        let mut struck = None;
        for _ in 0..list.len() {
            let injection = list[*next % list.len()];
            *next += 1;
            if injection.needs.iter().all(|kind| kinds.contains(kind)) {
                struck = strike(&healthy, &yardstick, injection, wanted, &draw);
            }
            if struck.is_some() {
                break;
            }
        }
        let (scene, effects, plain) = match struck {
            Some((scene, cause, plain)) => (scene, vec![cause], plain),
            None => (healthy, Vec::new(), Plain::default()),
        };
        write(folder, name, recording, &scene)?;
        Ok(Answer {
            case: name.to_owned(),
            attitudes: Vec::new(),
            ring: "R7".to_owned(),
            seed,
            snr_marginal: plain.ratio,
            effects,
            source: Some(recording.name.clone()),
        })
    }
}

/// Puts an effect in at the ratio wanted; `None` where it cannot be seen.
fn strike(
    healthy: &Scene,
    yardstick: &Yardstick,
    injection: Injection,
    wanted: f64,
    draw: &Draw,
) -> Option<(Scene, Cause, Plain)> {
    let mut healthy = healthy.clone();
    if injection.warm && healthy.temperature_c.is_none() {
        healthy.temperature_c = Some(temperature(&healthy, &mut draw.stream(1)));
    }
    let at = |strength: f64| {
        let mut scene = healthy.clone();
        let channels = (injection.apply)(&mut scene, &mut draw.stream(2), strength);
        let plain = yardstick.measured(&scene, injection.random);
        (scene, channels, plain)
    };
    let largest = if injection.in_library { LARGEST } else { LARGEST_NOVEL };
    // The ratio of a variance goes with the square of its strength.
    let power = if injection.random { 2.0 } else { 1.0 };
    let (strength, _) = strength::sized(wanted, power, largest, |strength| at(strength).2.ratio);
    let (mut scene, channels, plain) = at(strength);
    let sizes = std::mem::take(&mut scene.sizes);
    (plain.ratio >= LEAST_RATIO).then(|| {
        let cause = Cause {
            snr_withheld: None,
            effect: injection.name.to_owned(),
            in_library: injection.in_library,
            channels,
            strength,
            snr_marginal: Some(plain.ratio),
            sizes,
            attitude_deg: Some(plain.attitude_deg),
            gap_growth: Some(plain.growth),
        };
        (scene, cause, plain)
    })
}

/// \[degC\] of every row: a room that warms and a draught, some ten degrees about 25.
fn temperature(scene: &Scene, draw: &mut Draw) -> Vec<f64> {
    let (rise, swing) = (draw.uniform(-8.0, 8.0), draw.uniform(3.0, 8.0));
    let (turns, phase) = (draw.uniform(0.6, 1.8), draw.uniform(0.0, std::f64::consts::TAU));
    let rows = scene.times_s.len() as f64;
    (0..scene.times_s.len())
        .map(|row| {
            let part = row as f64 / rows;
            25.0 + rise * (part - 0.5) + swing * (std::f64::consts::TAU * turns * part + phase).sin()
        })
        .collect()
}

fn write(folder: &Path, name: &str, recording: &Recording, scene: &Scene) -> Result<(), DealError> {
    let folder = folder.join(name);
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| DealError::Write { path, source }
    };
    fs::create_dir_all(&folder).map_err(failed(&folder))?;
    let mut case = recording.case.clone();
    case.name = name.to_owned();
    case.unit = "unit.toml".to_owned();
    case.measured = "measured.csv.gz".to_owned();
    case.motion = "motion.csv.gz".to_owned();
    case.environment.gravity_m_s2 = scene.gravity;
    case.environment.field_n_ut = scene.field_n_ut.map(|field_n| field_n.into());
    let put = |file: &str, text: &str| {
        let path = folder.join(file);
        fs::write(&path, text).map_err(failed(&path))
    };
    let pack = |file: &str, text: &str| {
        let path = folder.join(file);
        let packed = || {
            let mut packed = GzEncoder::new(fs::File::create(&path)?, Compression::fast());
            packed.write_all(text.as_bytes())?;
            packed.finish().map(drop)
        };
        packed().map_err(failed(&path))
    };
    put("case.toml", &description::text(&case))?;
    put("unit.toml", &recording.unit)?;
    pack("measured.csv.gz", &measured(scene))?;
    pack("motion.csv.gz", &motion(scene))
}

/// Numbers as the recordings have them: no more digits than those.
fn measured(scene: &Scene) -> String {
    let names: Vec<&str> = scene
        .sensors
        .iter()
        .flat_map(|sensor| &sensor.names)
        .map(String::as_str)
        .collect();
    let mut text = format!("t_s,{}\n", names.join(","));
    for (row, t_s) in scene.times_s.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(text, "{t_s:.4}");
        for sensor in &scene.sensors {
            let digits = match sensor.kind {
                Kind::Gyro => 6,
                Kind::Accelerometer => 4,
                Kind::Magnetometer => 3,
            };
            for value in &sensor.values[row] {
                let _ = match value.is_finite() {
                    true => write!(text, ",{value:.digits$}"),
                    false => write!(text, ","),
                };
            }
        }
        text.push('\n');
    }
    text
}

fn motion(scene: &Scene) -> String {
    let has_place = scene.record.iter().any(|pose| pose.place_n.is_some());
    let mut text = String::from("t_s,qw,qx,qy,qz");
    text.push_str(if has_place { ",px_m,py_m,pz_m" } else { "" });
    text.push_str(if scene.temperature_c.is_some() {
        ",temperature_c\n"
    } else {
        "\n"
    });
    for (row, (t_s, pose)) in scene.times_s.iter().zip(&scene.record).enumerate() {
        let _ = write!(text, "{t_s:.4}");
        let _ = match pose.q_nb {
            Some(q) => write!(text, ",{:.7},{:.7},{:.7},{:.7}", q.w, q.i, q.j, q.k),
            None => write!(text, ",,,,"),
        };
        if has_place {
            let _ = match pose.place_n {
                Some(place) => write!(text, ",{:.5},{:.5},{:.5}", place.x, place.y, place.z),
                None => write!(text, ",,,"),
            };
        }
        if let Some(temperature_c) = scene.temperature_c.as_ref().and_then(|all| all.get(row)) {
            let _ = write!(text, ",{temperature_c:.3}");
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{recording::Purpose, *};

    #[test]
    fn a_seed_is_a_case_and_a_healthy_one_is_the_recording() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data");
        let place = tempfile::tempdir().expect("a folder");
        let dealt = |name: &str, number: usize| {
            let recordings = recording::all(&folder, Purpose::Judge).expect("a minute");
            let mut injected = Injected::new(recordings, &mut Draw::new(4));
            injected.deal(place.path(), name, number, 77).expect("dealt")
        };
        let (one, same, healthy) = (dealt("A", 0), dealt("B", 0), dealt("C", 4));
        assert_eq!((&one.effects, one.snr_marginal), (&same.effects, same.snr_marginal));
        assert!(
            (LEAST_RATIO..1.5 * SNR.1).contains(&one.snr_marginal),
            "{}",
            one.snr_marginal
        );
        assert_eq!((healthy.effects.len(), healthy.snr_marginal), (0, 0.0));
        let read = |case: &str| packed::read(&place.path().join(case).join("measured.csv.gz"), 1 << 28).expect(case);
        assert_eq!(read("A"), read("B"));
        let original = packed::read(&folder.join("practice/R06/measured.csv.gz"), 1 << 28).expect("a minute");
        let lines = |bytes: &[u8]| {
            String::from_utf8_lossy(bytes)
                .replace("-0.000000", "0.000000")
                .lines()
                .count()
        };
        assert_eq!(lines(&read("C")), lines(&original));
    }

    #[test]
    fn every_recording_is_healthy_has_a_name_and_has_none_at_times() {
        for (recordings, what) in [(5, None), (4, Some(true)), (3, Some(false)), (5, Some(false))] {
            let own = (0..5 * recordings).filter(|number| is_novel(*number) == what);
            let places: std::collections::BTreeSet<usize> =
                own.map(|number| among_its_like(number) % recordings).collect();
            assert_eq!(places.len(), recordings, "{what:?}");
        }
    }
}
