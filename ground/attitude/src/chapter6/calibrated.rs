//! The twin's unit in the laboratory: the parameters that LMS EC and MV SEC find on it.
//!
//! In: the unit's seed. Out: a set a method, as the unit would be sent it. The unit is the one that flies the rotation
//! tests: same parts, same biases. It is flown, each time from power-on and after [`LATER_S`] at rest, through
//!
//! | motion | for | method of chapter 4 |
//! |---|---|---|
//! | rate table, Table 4.1 with rows 2 and 10 put right, at 200 deg/s each way | gyros | LMS EC, section 4.2.1 |
//! | the same table at rest, the 78 positions of Table 4.6 | accelerometers | LMS EC, section 4.2.2 |
//! | rests in 230 random attitudes, as many as for Table 6.1 | accelerometers, magnetometers | MV SEC, section 4.3 |
//!
//! LMS EC is told what the table does, MV SEC only how strong gravity and the field are. What a method has no input for
//! keeps its parameters by MT: the magnetometers of LMS EC, the gyros of MV SEC, and MV SEC takes the nominal rotation of
//! each triad to b. The fits are those of `ground calibrate`, on means of the packets' counts; there is one temperature.

use bench::{
    controlled::{self, CalibrationError, Options},
    ellipsoid::{Ellipsoid, EllipsoidError},
    experiment::{Excitation, Experiment, Trial},
    set::{
        Entry, Set as File,
        image::{self, ImageError},
    },
    turntable::{Mount, Pose, Site, Turning},
};
use emems::{
    calibration::{Channel, Ranges, Set},
    geometry::{PLATES, TRIAD_AXES, dcm_bp},
    sample::Kind,
    unit::Settings,
};
use logs::cycles::Cycle;
use nalgebra::Vector3;
use packets::channel::{self, CHANNELS};
use twin::{
    environment::Environment,
    motion::{self, Axis, Motion, Plateau, Position, RateTable, TABLE_4_1},
    part::signal::Noise,
};

use super::flown;

/// \[s\] at rest before a motion begins. Noise is a function of the time since power-on: from here on it is none that a
/// rotation test has, the longer of which takes 89 s, so no test is flown with the noise its parameters were fitted to.
pub(super) const LATER_S: f64 = 100.0;

/// [deg/s] of the rate table (Table 4.2), and \[s\] each way.
const RATE_DEG_S: f64 = 200.0;
const PLATEAU_S: f64 = 10.0;
/// \[s\] of a plateau after which the low-pass of a gyro has settled, and how long it is looked at: five whole turns, over
/// which the Earth's rate across the axis is zero in the mean.
const SETTLE_S: f64 = 0.5;
const TURNS_S: f64 = 9.0;

/// \[s\] half of what is looked at of a rest, but for the second in which the table would turn about.
const HALF_REST_S: f64 = 1.0;

/// Random attitudes.
const ATTITUDES: u64 = 230;

/// Table 4.6: both axes at the start, and which of them goes once round in steps of 30 deg. Its rows 4 to 6 print theta
/// from zero; the decompositions beside it hold for the outer axis' own angle, which is what stands here.
const TABLE_4_6: [Position; 6] = [
    Position::new(0.0, 0.0, Axis::Outer),
    Position::new(270.0, 90.0, Axis::Inner),
    Position::new(270.0, 90.0, Axis::Outer),
    Position::new(180.0, 71.5655, Axis::Outer),
    Position::new(300.0, 71.5655, Axis::Outer),
    Position::new(60.0, 71.5655, Axis::Outer),
];

/// Why a method found no set.
#[derive(Debug, thiserror::Error)]
pub enum NotCalibrated {
    /// LMS EC.
    #[error(transparent)]
    Controlled(#[from] CalibrationError),
    /// MV SEC, on the triad of this name.
    #[error("{0}: {1}")]
    Ellipsoid(String, EllipsoidError),
    /// The unit does not take what was found.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Gyros and accelerometers by LMS EC, magnetometers by MT.
pub fn lms_ec(seed: u64) -> Result<Set, NotCalibrated> {
    let mut found = File::new("twin");
    for experiment in [rates(seed), forces(seed)] {
        let calibration = controlled::calibrate(&experiment, &Options::default())?;
        found.merge(Entry::controlled(&calibration, experiment.kind));
    }
    Ok(image::image(&found, ranges())?.set)
}

/// Accelerometers and magnetometers by MV SEC, gyros by MT.
pub fn mv_sec(seed: u64) -> Result<Set, NotCalibrated> {
    let random = Noise::new(!seed);
    let attitude = |k: u64| {
        // Every direction of gravity in b is as likely, from either side of the outer axis.
        let level = (1.0 - 2.0 * random.uniform(3 * k)).acos().to_degrees();
        let side = if random.uniform(3 * k + 1) < 0.5 { -1.0 } else { 1.0 };
        Position::new(360.0 * random.uniform(3 * k + 2), side * level, Axis::Outer)
    };
    let attitudes: Vec<Position> = (0..ATTITUDES).map(attitude).collect();
    let rests = at_rest(&attitudes, seed);
    let site = Environment::laboratory();
    let mut found = File::new("twin");
    for (kind, sensor, strength) in [
        (Kind::Accelerometer, "accelerometer", site.gravity),
        (Kind::Magnetometer, "magnetometer", site.field_n_ut.norm()),
    ] {
        for plate in 0..PLATES {
            let names = [0, 1, 2].map(|axis| image::name(Channel::of(kind, 3 * plate + axis)));
            let point = |rest: &Means| match rest.of(&names)[..] {
                [Some(x), Some(y), Some(z)] => Some(Vector3::new(x, y, z)),
                _ => None,
            };
            let points: Vec<Vector3<f64>> = rests.iter().filter_map(point).collect();
            let ellipsoid =
                Ellipsoid::fit(&points, strength).map_err(|why| NotCalibrated::Ellipsoid(names.join(", "), why))?;
            found.merge(Entry::ellipsoid(&ellipsoid, &names, sensor, &dcm_bp(plate).cast()));
        }
    }
    Ok(image::image(&found, ranges())?.set)
}

fn ranges() -> Ranges {
    Ranges::of(&Settings::NOMINAL)
}

/// The laboratory as the one who calibrates knows it; level and at zero the outer axis, y of b, points east.
fn site() -> Site {
    let laboratory = Environment::laboratory();
    Site {
        gravity_m_s2: laboratory.gravity,
        latitude_rad: laboratory.latitude,
        outer_azimuth_rad: Some(std::f64::consts::FRAC_PI_2),
    }
}

/// Table 4.1, turned both ways.
fn rates(seed: u64) -> Experiment {
    let table = RateTable::new(&TABLE_4_1, RATE_DEG_S.to_radians(), PLATEAU_S);
    let cycles = flown::cycles(Later(table.clone()), seed);
    let run = |plateau: &Plateau| {
        let position = TABLE_4_1[plateau.position];
        let pose = pose(&position);
        let turning = match position.turns {
            Axis::Inner => Turning::Inner,
            Axis::Outer => Turning::Outer,
        };
        let rate_rad_s = plateau.rate_nb_b.dot(&Mount::EMEMS.axis_b(pose, turning));
        let from_s = plateau.from_s + SETTLE_S;
        (
            Mount::EMEMS.rate_b(pose, turning, rate_rad_s, &site()),
            Means::over(&cycles, from_s, from_s + TURNS_S),
        )
    };
    experiment(Kind::Gyro, PLATES, table.plateaus().iter().map(run))
}

/// Table 4.6, at rest.
fn forces(seed: u64) -> Experiment {
    let round = |from: &Position| {
        let from = *from;
        (0..13).map(move |k| match from.turns {
            Axis::Inner => Position::new(from.inner_deg + 30.0 * f64::from(k), from.outer_deg, from.turns),
            Axis::Outer => Position::new(from.inner_deg, from.outer_deg + 30.0 * f64::from(k), from.turns),
        })
    };
    let positions: Vec<Position> = TABLE_4_6.iter().flat_map(round).collect();
    let force_b = positions
        .iter()
        .map(|position| Mount::EMEMS.force_b(pose(position), &site(), [0.0; 2]));
    experiment(Kind::Accelerometer, TRIAD_AXES, force_b.zip(at_rest(&positions, seed)))
}

fn pose(position: &Position) -> Pose {
    Pose {
        inner_rad: position.inner_deg.to_radians(),
        outer_rad: position.outer_deg.to_radians(),
    }
}

/// What all channels of a kind put out in each excitation.
fn experiment(kind: Kind, channels: usize, rows: impl Iterator<Item = (Vector3<f64>, Means)>) -> Experiment {
    let channels: Vec<String> = (0..channels).map(|k| image::name(Channel::of(kind, k))).collect();
    let trial = |(number, (excitation_b, means)): (usize, (Vector3<f64>, Means))| Trial {
        label: (number + 1).to_string(),
        line: 0,
        claimed_b: None,
        pose: None,
        excitation_b,
        temperature_c: f64::NAN,
        values: means.of(&channels),
        stated: Vec::new(),
    };
    Experiment {
        file: "twin".into(),
        kind: if kind == Kind::Gyro {
            Excitation::Rate
        } else {
            Excitation::Force
        },
        trials: rows.enumerate().map(trial).collect(),
        channels,
        declared: None,
        remarks: Vec::new(),
    }
}

/// Means over the rests in each of these positions: a rate table that turns at no rate.
fn at_rest(positions: &[Position], seed: u64) -> Vec<Means> {
    let table = RateTable::new(positions, 0.0, HALF_REST_S);
    let cycles = flown::cycles(Later(table.clone()), seed);
    let both_ways = table.plateaus().chunks_exact(2);
    both_ways
        .map(|ways| Means::over(&cycles, ways[0].from_s, ways[1].to_s))
        .collect()
}

/// A motion that begins [`LATER_S`] after power-on.
struct Later<M>(M);

impl<M: Motion> Motion for Later<M> {
    fn at(&self, t_s: f64) -> motion::Pose {
        self.0.at(t_s - LATER_S)
    }

    fn duration_s(&self) -> Option<f64> {
        self.0.duration_s().map(|duration_s| duration_s + LATER_S)
    }
}

/// \[counts\] mean of every channel, in the order of [`CHANNELS`]; `None` for one that was never read.
struct Means(Vec<Option<f64>>);

impl Means {
    /// Over a stretch of a motion that began [`LATER_S`] after power-on.
    fn over(cycles: &[Cycle], from_s: f64, to_s: f64) -> Self {
        let stretch = from_s + LATER_S..to_s + LATER_S;
        let within = cycles
            .iter()
            .filter(|cycle| stretch.contains(&flown::t_s(cycle.sample.start_us)));
        let counts: Vec<_> = within.map(|cycle| channel::counts(&cycle.sample.reading)).collect();
        let mean = |place: usize| {
            let read: Vec<f64> = counts.iter().filter_map(|all| all[place].map(f64::from)).collect();
            (!read.is_empty()).then(|| read.iter().sum::<f64>() / read.len() as f64)
        };
        Means((0..CHANNELS.len()).map(mean).collect())
    }

    /// Of some channels, by name.
    fn of(&self, names: &[String]) -> Vec<Option<f64>> {
        let place = |name: &String| CHANNELS.iter().position(|channel| channel.name == name);
        names.iter().map(|name| place(name).and_then(|k| self.0[k])).collect()
    }
}
