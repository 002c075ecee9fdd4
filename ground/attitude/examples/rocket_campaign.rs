//! Many units through the sounding rocket's flight: what the attitude was off by in each phase, and what it said.
//!
//! `cargo run --ignore-rust-version --target host-tuple -p emems-attitude --example rocket_campaign -- [UNITS] [smooth|rough|rougher] [PAGE.html]`
//! flies so many units (default 100; `1001-1100`: those of these seeds), each with its own parts, clocks and noise, on the host board in virtual time, some two
//! seconds of processor each, and prints a line a phase. The page has the error and three standard deviations over the flight.
//!
//! Each unit is told a field that is off by what a model is: each component by a normal number of
//! [`FIELD_OFF_UT`]. Its vehicle has hard iron as large as the crew says that swinging leaves of it
//! ([`Launch::iron_sd_ut`]), which turns with the spin. Its gyros' scales and directions are off as the set that all fly with says
//! ([`gyros`]). Rough flights are as [`Levels`] has them, and their gyros feel force.
//!
//! The error is the rotation vector from the attitude that the unit sent to the truth at the same instant, in n. Total: root mean
//! square of its length over all packets of a phase and all units. Nose: the same of the angle between the two x axes. Said: the root
//! of the mean trace of the covariance sent, and of its part that turns the nose. NEES: mean of `e' P^-1 e / 3`, one if
//! the covariance is right.

use std::{env, error::Error, fs, sync::Arc, sync::Mutex, thread};

use chart::{Axis, Block, Figure, Layer, Marks, Panel, html};
use emems::{
    calibration::{Ranges, Set},
    derived::{self, DERIVED_BYTES, Derived},
    site::{Launch, Site},
    unit::Settings,
};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use twin::{
    environment::{Environment, World},
    host::{self, timing::BOOT},
    motion::{Levels, Motion, Rough, SoundingRocket},
    part::{Nanos, signal::Noise},
    plant::{Plant, Quality},
    run::{Bench, Flow},
    truth::{Truth, TruthSource},
};

/// \[uT\] standard deviation of what a component of the field is told wrong: 0.2 deg of 26 uT.
const FIELD_OFF_UT: f64 = 0.09;

/// \[s\] after power-on.
const LIFT_OFF_S: f64 = 30.0;
const END_S: f64 = 600.0;

/// \[s\] begin and end after power-on, and what it is.
const PHASES: [(f64, f64, &str); 10] = [
    (5.0, 30.0, "pad"),
    (31.0, 36.0, "lift-off"),
    (36.0, 42.0, "spin-up"),
    (42.0, 60.0, "second stage"),
    (60.0, 83.0, "coast, three turns a second"),
    (83.0, 97.0, "yo-yo"),
    (97.0, 200.0, "micro-gravity to 200 s"),
    (200.0, 469.0, "micro-gravity to the end"),
    (469.0, 550.0, "entry"),
    (555.0, 600.0, "parachute"),
];

/// An attitude that was sent.
struct Sent {
    t_s: f64,
    error_n: Vector3<f64>,
    nose_n: Vector3<f64>,
    covariance_n: Matrix3<f64>,
}

/// Asks for derived frames and keeps them.
#[derive(Default)]
struct Listener {
    frames: Vec<Derived>,
    asked: bool,
}

impl Bench for Listener {
    fn telemetry(&mut self, _at: Nanos, bytes: &[u8]) {
        if bytes.len() == DERIVED_BYTES {
            self.frames.extend(derived::decode(bytes).ok());
        }
    }

    fn umbilical(&mut self, _at: Nanos, _bytes: &[u8]) {}

    fn log(&mut self, _at: Nanos, _line: &str) {}

    fn commands(&mut self, now: Nanos) -> Vec<u8> {
        if now < 1_000_000 || std::mem::replace(&mut self.asked, true) {
            return Vec::new();
        }
        b"G_DL".to_vec()
    }

    fn advanced(&mut self, _now: Nanos) -> Flow {
        Flow::Continue
    }
}

/// What the crew of this unit tells it.
fn told(seed: u64, levels: Option<Levels>) -> Site {
    let off = Noise::new(seed).stream(0xF1E1D);
    let off_n = Vector3::from_fn(|axis, _| FIELD_OFF_UT * off.normal(axis as u64));
    let field_n_ut = Environment::alcantara().field_n_ut + off_n;
    let bias_per_g_deg_s = levels.map_or(0.0, |levels| levels.rate_per_g.to_degrees());
    let launch = Site::ALCANTARA.launch.map(|launch| Launch {
        norm_ut: field_n_ut.norm() as f32,
        dip_deg: field_n_ut.z.atan2(field_n_ut.xy().norm()).to_degrees() as f32,
        bias_per_g_deg_s: bias_per_g_deg_s as f32,
        ..launch
    });
    Site {
        declination_deg: field_n_ut.y.atan2(field_n_ut.x).to_degrees() as f32,
        launch,
        ..Site::ALCANTARA
    }
}

/// A flight in a vehicle with hard iron, by a unit whose gyros are off.
struct InVehicle<T> {
    source: T,
    iron_b_ut: Vector3<f64>,
    /// Of the rate, what the gyros have beyond it.
    gyros: Matrix3<f64>,
}

impl<T: TruthSource> TruthSource for InVehicle<T> {
    fn at(&self, t_s: f64) -> Truth {
        let mut truth = self.source.at(t_s);
        truth.field_b_ut += self.iron_b_ut;
        truth.rate_b += self.gyros * truth.rate_b;
        truth
    }

    fn duration_s(&self) -> Option<f64> {
        self.source.duration_s()
    }
}

/// \[uT\] what swinging has left of the iron of this unit's vehicle.
fn iron_b_ut(seed: u64, site: &Site) -> Vector3<f64> {
    let sd_ut = site.launch.map_or(0.0, |launch| f64::from(launch.iron_sd_ut));
    let drawn = Noise::new(seed).stream(0x1204);
    Vector3::from_fn(|axis, _| sd_ut * drawn.normal(axis as u64))
}

/// What the gyros of this unit have of the rate beyond it: each one's scale and direction are off by normal numbers with the deviations
/// of the set. It is what least squares over the four make of that; what they would disagree on beside is left out.
fn gyros(seed: u64, set: &Set) -> Matrix3<f64> {
    let drawn = Noise::new(seed).stream(0x6_9705);
    let [_, _, sd] = set.uncertainty;
    let [scale, direction] = [sd.scale, sd.direction].map(f64::from);
    let axes_b = set.gyro.map(|axis| axis.axis_b.map(f64::from));
    let off = |(k, axis_b): (u64, &Vector3<f64>)| {
        let normal = Vector3::from_fn(|axis, _| drawn.normal(3 * k + axis as u64));
        let along = axis_b * axis_b.dot(&normal);
        axis_b * ((normal - along) * direction + along * scale).transpose()
    };
    let squares: Matrix3<f64> = axes_b.iter().map(|axis_b| axis_b * axis_b.transpose()).sum();
    let solved = squares.try_inverse().expect("four axes of a tetrahedron span space");
    solved * (0..).zip(&axes_b).map(off).sum::<Matrix3<f64>>()
}

/// Flies the unit of this seed.
fn fly(seed: u64, levels: Option<Levels>) -> Vec<Sent> {
    let environment = Environment::alcantara();
    let motion = SoundingRocket::new(LIFT_OFF_S, environment.gravity);
    let settings = Settings {
        site: told(seed, levels),
        ..Settings::NOMINAL
    };
    let smooth = InVehicle {
        source: World {
            motion: motion.clone(),
            environment,
        },
        iron_b_ut: iron_b_ut(seed, &settings.site),
        gyros: gyros(seed, &Set::compiled_in(Ranges::of(&settings))),
    };
    let world: Arc<dyn TruthSource> = match levels {
        Some(levels) => Arc::new(Rough::new(smooth, LIFT_OFF_S, levels, seed)),
        None => Arc::new(smooth),
    };
    let mut listener = Listener::default();
    let plant = Plant::with(world, seed, Quality::FREE_CLOCKS);
    host::fly(plant, settings, &[], (END_S * 1e9) as Nanos, &mut listener);
    let sent = |frame: &Derived| {
        let [w, x, y, z] = frame.estimate.q_nb?.map(f64::from);
        let found = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let t_s = (frame.increments.end_us as f64 * 1e3 + BOOT as f64) * 1e-9;
        let truth = motion.at(t_s).attitude.q_nb;
        let [nn, ne, nd, ee, ed, dd] = frame.estimate.covariance_n.map(f64::from);
        Some(Sent {
            t_s,
            error_n: (truth * found.inverse()).scaled_axis(),
            nose_n: truth * Vector3::x(),
            covariance_n: Matrix3::new(nn, ne, nd, ne, ee, ed, nd, ed, dd),
        })
    };
    listener.frames.iter().filter_map(sent).collect()
}

impl Sent {
    fn nose_error_square(&self) -> f64 {
        self.error_n.cross(&self.nose_n).norm_squared()
    }

    fn nose_variance(&self) -> f64 {
        self.covariance_n.trace() - self.nose_n.dot(&(self.covariance_n * self.nose_n))
    }

    fn nees(&self) -> f64 {
        let inverse = self.covariance_n.try_inverse();
        inverse.map_or(f64::NAN, |inverse| self.error_n.dot(&(inverse * self.error_n)) / 3.0)
    }
}

/// \[deg\] root of the mean of squares \[rad2\].
fn rms(squares: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = squares.fold((0.0, 0.0), |(count, sum), square| (count + 1.0, sum + square));
    (sum / count).sqrt().to_degrees()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    sum / count
}

fn print(units: &[Vec<Sent>]) {
    println!("                                  s   total    said    nose    said   worst    NEES  within 3 sd");
    for (from_s, to_s, name) in PHASES {
        let within = || {
            let all = units.iter().flatten();
            all.filter(move |sent| (from_s..to_s).contains(&sent.t_s))
        };
        let worst = within().map(|sent| sent.error_n.norm()).fold(0.0, f64::max);
        let inside = mean(within().flat_map(|sent| {
            (0..3).map(|axis| {
                let sd = sent.covariance_n[(axis, axis)].sqrt();
                f64::from(u8::from(sent.error_n[axis].abs() < 3.0 * sd))
            })
        }));
        println!(
            "{name:28} {from_s:3.0}-{to_s:3.0} {:7.3} {:7.3} {:7.3} {:7.3} {:7.2} {:7.2} {:8.1} %",
            rms(within().map(|sent| sent.error_n.norm_squared())),
            rms(within().map(|sent| sent.covariance_n.trace())),
            rms(within().map(Sent::nose_error_square)),
            rms(within().map(Sent::nose_variance)),
            worst.to_degrees(),
            mean(within().map(Sent::nees)),
            100.0 * inside,
        );
    }
}

/// Error and three standard deviations of one unit in full, of the others the error alone.
fn page(units: &[Vec<Sent>]) -> Result<String, Box<dyn Error>> {
    /// \[deg\] what is drawn at least, on a logarithmic axis.
    const LEAST: f64 = 1e-3;
    let line = |unit: &[Sent], of: &dyn Fn(&Sent) -> f64| {
        let points = unit
            .iter()
            .map(|sent| (sent.t_s, of(sent).sqrt().to_degrees().max(LEAST)));
        points.collect::<Vec<_>>()
    };
    type Of = fn(&Sent) -> f64;
    let panels: [(&str, Of, Of); 2] = [
        (
            "total",
            |sent| sent.error_n.norm_squared(),
            |sent| 9.0 * sent.covariance_n.trace(),
        ),
        ("nose", Sent::nose_error_square, |sent| 9.0 * sent.nose_variance()),
    ];
    let panels = panels.map(|(title, error, variance)| {
        let mut layers: Vec<Layer> = (units.iter())
            .map(|unit| Layer::new("error, each unit", 5, Marks::Line(line(unit, &error))))
            .collect();
        if let Some(first) = units.first() {
            layers.push(Layer::new("error, first unit", 0, Marks::Line(line(first, &error))));
            layers.push(Layer::new(
                "three standard deviations, first unit",
                1,
                Marks::Line(line(first, &variance)),
            ));
        }
        Panel {
            title: title.into(),
            x: Axis::linear("s after power-on"),
            y: Axis::logarithmic("deg"),
            layers,
        }
    });
    let figure = Figure::of("Attitude through the flight", 1, &panels)?;
    let about = "Error of the attitude that the unit sent, and three standard deviations as it said them.";
    Ok(html("Through the boost", about, &[Block::Figure(figure)]))
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let units = arguments.next().unwrap_or("100".into());
    let (first, last) = units.split_once('-').unwrap_or(("1", &units));
    let (first, last): (u64, u64) = (first.parse()?, last.parse()?);
    let levels = match arguments.next().as_deref() {
        None | Some("smooth") => None,
        Some("rough") => Some(Levels::ROUGH),
        Some("rougher") => Some(Levels::ROUGHER),
        Some(other) => return Err(format!("{other}: a flight is smooth, rough or rougher").into()),
    };
    let next = Mutex::new(first);
    let flown = Mutex::new(Vec::new());
    let fly_some = || {
        loop {
            let seed = {
                let mut next = next.lock().expect("no thread panics with it");
                let seed = *next;
                *next += 1;
                seed
            };
            if seed > last {
                return;
            }
            let unit = fly(seed, levels);
            flown.lock().expect("no thread panics with it").push((seed, unit));
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(fly_some);
        }
    });
    let mut flown = flown.into_inner()?;
    flown.sort_by_key(|(seed, _)| *seed);
    let units: Vec<Vec<Sent>> = flown.into_iter().map(|(_, unit)| unit).collect();
    print(&units);
    if let Some(path) = arguments.next() {
        fs::write(&path, page(&units)?).map_err(|error| format!("{path}: {error}"))?;
        println!("page: {path}");
    }
    Ok(())
}
