//! Which channels are the three gyros, accelerometers and magnetometers of one plate, and what they read.
//!
//! In: a unit and its log. Out: [`Sensors`]; its [`Samples`], and the [`Model`] of what its description says of their errors.

use nalgebra::Vector3;
use twin::{
    environment::Environment,
    predict::{Channel, Kind, UnitDescription},
};

use crate::{
    input::{case::Surroundings, log::Log},
    parity::{
        chips::directions,
        plate::{
            filter::Model,
            samples::{Samples, Triad},
        },
    },
};

/// \[uT\] how much the field of a room differs from place to place, where `case.toml` says nothing of it: 1.5 uT/m over a metre and 0.8 uT, as
/// in the room of BROAD.
const ROOM_UT: f64 = 1.7;

/// \[m\] about which a unit is carried.
const CARRIED_M: f64 = 1.0;

/// \[s\] over which a field stays alike where `case.toml` does not say it.
const ALIKE_S: f64 = 10.0;

/// \[s\] how far the instants of magnetometers and gyros may be apart beyond what the description says: what real parts did.
const DELAY_S: f64 = 0.02;

/// [m/s] how fast a unit moves that is carried about a place: BROAD's quick translations by hand have root mean squares of some 1 m/s.
const VELOCITY_M_S: f64 = 1.0;

/// Of a turn, what it is off by beyond constant scales and cross axes: without it the attitude of ten undisturbed recordings (BROAD) is off by
/// 2.7 to 5 times its sigmas, with it by 0.8 to 1.8 times.
const BENT: f64 = 0.004;

/// \[rad\] tilt and heading of a first attitude, where the log begins at rest and where it does not.
const BEGIN: [[f64; 2]; 2] = [[0.1, 0.5], [0.5, 1.0]];

/// Channels by their place in the unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sensors {
    gyros: [usize; 3],
    accelerometers: [usize; 3],
    magnetometers: Option<[usize; 3]>,
}

impl Sensors {
    /// Of a unit that has three gyros, three accelerometers and three or no magnetometers, of each three independent directions: it has no
    /// redundancy, and still an attitude. None of any other.
    pub fn of(unit: &UnitDescription) -> Option<Self> {
        let kind = |kind: Kind| -> Vec<usize> {
            let all = unit.channels.iter().enumerate();
            all.filter(|(_, own)| own.sensor == kind).map(|(at, _)| at).collect()
        };
        let three = |kind: Vec<usize>| -> Option<[usize; 3]> {
            let three: [usize; 3] = kind.try_into().ok()?;
            directions(unit, three).try_inverse().map(|_| three)
        };
        let magnetometers = kind(Kind::Magnetometer);
        let is_blind = magnetometers.is_empty();
        let magnetometers = three(magnetometers);
        (is_blind || magnetometers.is_some()).then_some(())?;
        Some(Self {
            gyros: three(kind(Kind::Gyro))?,
            accelerometers: three(kind(Kind::Accelerometer))?,
            magnetometers,
        })
    }

    /// Names of a kind's channels.
    pub fn names(&self, unit: &UnitDescription, kind: Kind) -> Vec<String> {
        let own = match kind {
            Kind::Gyro => &self.gyros[..],
            Kind::Accelerometer => &self.accelerometers[..],
            Kind::Magnetometer => self.magnetometers.as_ref().map_or(&[][..], |own| &own[..]),
            Kind::Thermometer => &[],
        };
        own.iter().map(|at| unit.channels[*at].name.clone()).collect()
    }

    /// Whether heading is seen.
    pub fn has_field(&self) -> bool {
        self.magnetometers.is_some()
    }

    /// What they read; none of a log that has no two rows with all gyros, or none with all accelerometers.
    pub fn samples(&self, log: &Log, unit: &UnitDescription) -> Option<Samples> {
        let triad = |own: [usize; 3]| triad(log, unit, own);
        let (rates, forces) = (triad(self.gyros)?, triad(self.accelerometers)?);
        let fields = self.magnetometers.and_then(triad).unwrap_or_default();
        (rates.t_s.len() >= 2 && !forces.t_s.is_empty()).then(|| Samples::of(rates, forces, fields))
    }

    /// What the description and the surroundings say of errors, with nothing that is not calibration; `is_still` whether the log begins at rest.
    pub fn model(
        &self,
        unit: &UnitDescription,
        environment: &Environment,
        around: &Surroundings,
        is_still: bool,
    ) -> Model {
        let largest = |own: &[usize], of: &dyn Fn(&Channel) -> f64| -> f64 {
            own.iter().map(|at| of(&unit.channels[*at])).fold(0.0, f64::max)
        };
        let (gyros, accelerometers) = (&self.gyros, &self.accelerometers);
        let magnetometers: &[usize] = self.magnetometers.as_ref().map_or(&[], |own| &own[..]);
        let by_place = around.field_gradient_sigma_ut_m.unwrap_or(0.0) * CARRIED_M;
        let by_time = around.field_wander_sigma_ut.unwrap_or(0.0);
        let stated = around.field_sigma_ut.hypot(by_place).hypot(by_time);
        let scale = |own: &[usize]| largest(own, &|own| own.scale_sigma);
        Model {
            field_n_ut: environment.field_n_ut,
            gravity_m_s2: environment.gravity,
            gyro: [largest(gyros, &Channel::sigma), largest(gyros, &|own| own.bias_sigma)],
            matrix: [scale(gyros), largest(gyros, &|own| own.axis_sigma_rad)],
            bent: BENT,
            force: [
                largest(accelerometers, &Channel::sigma),
                largest(accelerometers, &|own| own.bias_sigma),
                scale(accelerometers).max(largest(accelerometers, &|own| own.axis_sigma_rad)),
            ],
            field: largest(magnetometers, &Channel::sigma),
            delay_s: DELAY_S,
            iron: [largest(magnetometers, &|own| own.bias_sigma), 0.0],
            beside: [0.0, 0.0],
            place: [
                if stated > 0.0 { stated } else { ROOM_UT },
                around.field_correlation_s.unwrap_or(ALIKE_S),
            ],
            velocity: VELOCITY_M_S,
            begin: BEGIN[usize::from(!is_still)],
        }
    }
}

/// Rows in which all three have a sample.
fn triad(log: &Log, unit: &UnitDescription, own: [usize; 3]) -> Option<Triad> {
    let after_s = own
        .iter()
        .map(|at| unit.channels[*at].slot_s - unit.channels[*at].tau_s())
        .sum::<f64>()
        / 3.0;
    let series = own.map(|at| &log.channels[at]);
    let mut next = [0; 3];
    let (mut t_s, mut readings) = (Vec::new(), Vec::new());
    for (row, start_s) in log.start_s.iter().enumerate() {
        let mut reading = Vector3::zeros();
        let mut seen = 0;
        for axis in 0..3 {
            let rows = &series[axis].rows;
            while next[axis] < rows.len() && (rows[next[axis]] as usize) < row {
                next[axis] += 1;
            }
            if rows.get(next[axis]).is_some_and(|own| *own as usize == row) {
                reading[axis] = series[axis].values[next[axis]] - unit.channels[own[axis]].bias;
                seen += 1;
            }
        }
        let now_s = start_s + after_s;
        if seen == 3 && t_s.last().is_none_or(|last| now_s > *last) {
            t_s.push(now_s);
            readings.push(reading);
        }
    }
    Triad::of(&directions(unit, own), t_s, &readings)
}
