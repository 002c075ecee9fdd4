//! Readings of a unit in a world, cycle by cycle, without its buses: for campaigns of many hours.
//!
//! In: a truth, a seed, what the parts are like and what befalls them. Out: a [`Reading`] for each cycle. Each part
//! converts by its own clock as in the twin and the unit reads the last conversion, so plates see a motion at instants up
//! to a conversion apart; accelerometers feel their lever arms. Biases, noise and rounding are the twin's.

use std::sync::Arc;

use emems::{
    calibration::{CHANNELS, Channel},
    sample::{Errors, Kind, Reading},
};
use nalgebra::Vector3;
pub use twin::fault::ill::Ill;
use twin::{geometry, part::signal::Noise, truth::TruthSource};

/// \[s\] from cycle to cycle.
pub const PERIOD_S: f64 = 0.2;
/// Standard deviation of the noise of an axis: m/s2, uT, rad/s, as the twin's parts have it.
pub const NOISE: [f64; 3] = [0.045, 0.2, 0.00344];
/// Standard deviation of the bias of an axis.
pub const BIAS: [f64; 3] = [0.02, 0.1, 0.0015];
/// SI of a count at the unit's nominal ranges.
pub const PER_COUNT: [f64; 3] = [3e-3 * 9.80665, 100.0 / 1090.0, 0.07326 * std::f64::consts::PI / 180.0];
/// \[s\] between conversions: 50 Hz, 75 Hz, 256 Hz.
const CONVERSION_S: [f64; 3] = [0.02, 1.0 / 75.0, 1.0 / 256.0];
/// \[counts\] ends of the range.
const ENDS: [(f64, f64); 3] = [(-2048.0, 2047.0), (-2048.0, 2047.0), (-4368.0, 4368.0)];

/// A unit in a world.
#[derive(Clone)]
pub struct Unit {
    world: Arc<dyn TruthSource>,
    noise: Noise,
    bias: [f64; CHANNELS],
    phase_s: [f64; 12],
    /// What befalls it, and from when to when \[s\].
    pub ills: Vec<(f64, f64, Ill)>,
    /// \[s\] of the world in which the first cycle falls.
    pub begins_s: f64,
    cycle: u64,
    last: Option<Reading>,
}

fn index(channel: Channel) -> usize {
    match channel.kind() {
        Kind::Accelerometer => 0,
        Kind::Magnetometer => 1,
        _ => 2,
    }
}

/// Axes of the sensor a channel belongs to.
pub fn sensor(channel: Channel) -> std::ops::Range<usize> {
    let n = usize::from(channel.0);
    if n < 24 { n / 3 * 3..n / 3 * 3 + 3 } else { n..n + 1 }
}

impl Unit {
    /// Of this seed, with biases so many times the twin's.
    pub fn new(world: Arc<dyn TruthSource>, seed: u64, biased: f64) -> Self {
        let noise = Noise::new(seed);
        let bias = |n: usize| biased * BIAS[index(Channel(n as u8))] * noise.stream(100).normal(n as u64);
        Unit {
            world,
            noise,
            bias: std::array::from_fn(bias),
            phase_s: std::array::from_fn(|part| noise.stream(101).uniform(part as u64) * CONVERSION_S[part / 4]),
            ills: Vec::new(),
            begins_s: 0.0,
            cycle: 0,
            last: None,
        }
    }

    /// With something befalling it from `from_s` to `to_s`.
    pub fn ill(mut self, from_s: f64, to_s: f64, ill: Ill) -> Self {
        self.ills.push((from_s, to_s, ill));
        self
    }

    /// \[s\] of the cycle that comes next.
    pub fn now_s(&self) -> f64 {
        self.begins_s + self.cycle as f64 * PERIOD_S
    }

    /// Whether the world does not turn now, but with the Earth.
    pub fn at_rest(&self) -> bool {
        self.world.at(self.now_s()).rate_b.norm() < 1e-4
    }

    /// \[SI\] what each axis is exposed to in a cycle, without bias and noise.
    fn exposed(&self, now_s: f64) -> [f64; CHANNELS] {
        let seen = |part: usize| {
            let conversion_s = CONVERSION_S[part / 4];
            self.world
                .at(now_s - (now_s + self.phase_s[part]).rem_euclid(conversion_s))
        };
        let mut along = [0.0; CHANNELS];
        for plate in 0..4 {
            let dcm_pb = geometry::dcm_bp(plate).transpose();
            let (force, field) = (seen(plate), seen(4 + plate));
            let place_b = geometry::accelerometer_place_b(plate);
            let arm_b = force.rate_dot_b.cross(&place_b) + force.rate_b.cross(&force.rate_b.cross(&place_b));
            let put = |along: &mut [f64], v: Vector3<f64>| along.copy_from_slice(v.as_slice());
            put(&mut along[3 * plate..3 * plate + 3], dcm_pb * (force.force_b + arm_b));
            put(&mut along[12 + 3 * plate..15 + 3 * plate], dcm_pb * field.field_b_ut);
            along[24 + plate] = geometry::gyro_axis_b(plate).dot(&seen(8 + plate).rate_b);
        }
        along
    }

    /// The next cycle's reading.
    pub fn reading(&mut self) -> Reading {
        let now_s = self.now_s();
        let mut along = self.exposed(now_s);
        let mut noisy = [1.0; CHANNELS];
        let present: Vec<Ill> = self
            .ills
            .iter()
            .filter(|ill| (ill.0..ill.1).contains(&now_s))
            .map(|ill| ill.2)
            .collect();
        let since = |what: Ill| {
            self.ills
                .iter()
                .find(|ill| ill.2 == what)
                .map_or(0.0, |ill| now_s - ill.0)
        };
        for ill in &present {
            match *ill {
                Ill::Bias(channel, by) => along[usize::from(channel.0)] += by,
                Ill::Ramp(channel, by) => along[usize::from(channel.0)] += by * since(*ill),
                Ill::Scale(channel, times) => along[usize::from(channel.0)] *= times,
                Ill::Noise(channel, times) => noisy[usize::from(channel.0)] = times,
                Ill::Exchanged(one, other) => along.swap(usize::from(one.0), usize::from(other.0)),
                Ill::Frozen(_) | Ill::Garbage(_) => {}
            }
        }
        let mut counts: [i16; CHANNELS] = std::array::from_fn(|n| {
            let kind = index(Channel(n as u8));
            let noise = NOISE[kind] * noisy[n] * self.noise.stream(n as u64).normal(self.cycle);
            let codes = (along[n] + self.bias[n] + noise) / PER_COUNT[kind];
            codes.round().clamp(ENDS[kind].0, ENDS[kind].1) as i16
        });
        for ill in present {
            match (ill, self.last) {
                (Ill::Frozen(channel), Some(last)) => {
                    let last = flat(&last);
                    counts[sensor(channel)].copy_from_slice(&last[sensor(channel)]);
                }
                (Ill::Garbage(channel), _) => {
                    for n in sensor(channel) {
                        let word = self.noise.stream(200 + n as u64).word(self.cycle) as i16;
                        counts[n] = if n < 24 { word >> 4 } else { word >> 2 };
                    }
                }
                _ => {}
            }
        }
        let reading = self.packed(&counts);
        self.cycle += 1;
        self.last = Some(reading);
        reading
    }

    fn packed(&self, counts: &[i16; CHANNELS]) -> Reading {
        let triads = |first: usize| std::array::from_fn(|plate| std::array::from_fn(|k| counts[first + 3 * plate + k]));
        Reading {
            errors: Errors(0),
            acc_p: triads(0),
            mag_p: triads(12),
            gyro: std::array::from_fn(|plate| counts[24 + plate]),
            gyro_temperature: [0; 4],
            temperature: [400; 4],
            ..Reading::unread(self.cycle as u16)
        }
    }
}

fn flat(reading: &Reading) -> [i16; CHANNELS] {
    let all = reading
        .acc_p
        .as_flattened()
        .iter()
        .chain(reading.mag_p.as_flattened())
        .chain(&reading.gyro);
    let mut all = all.copied();
    std::array::from_fn(|_| all.next().unwrap_or(0))
}
