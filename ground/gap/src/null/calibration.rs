//! What is open of each channel although the twin is right: its calibration, the instant at which it is read, and how its
//! reference answers to motion.
//!
//! In: the twin and its [`Reference`]. Out: columns with prior sigmas, which every fit takes out first. That of the stamps of the reference's
//! record is one of all channels; the others are of one channel each.

use twin::predict::{Channel, Column, Kind, Twin};

use crate::input::reference::Reference;

/// \[s\] between a gyro's conversions, by its own clock (ADIS16265 data sheet, table 1).
const GYRO_PERIOD_S: f64 = 1.0 / 256.0;

/// Standard deviation of the instant of a gyro of which nothing says when it converts, in rows of the reference's record. In twelve recordings of BROAD
/// without an effect in time (36 gyros, 3.5 ms a row) it is 0.026, and 0.06 at most; of six gyros on a rocket (10 ms a row), about what all have in common,
/// 0.02 to 0.06.
const INSTANT_ROWS: f64 = 0.03;

/// \[s\] between a thermometer's, by its own clock (TMP102, SBOS397).
const THERMOMETER_PERIOD_S: f64 = 0.25;

/// \[s\] between the conversions of a channel's part by its own clock; 0 where it has none that is known of. A reading is up
/// to half of it older or younger than described, and that evenly, so a stated sigma is a period over the root of 12.
pub fn conversion_period_s(channel: &Channel) -> f64 {
    let stated = channel.instant_sigma_s.map(|sigma_s| sigma_s * 12f64.sqrt());
    stated.unwrap_or(match channel.sensor {
        Kind::Gyro => GYRO_PERIOD_S,
        Kind::Thermometer => THERMOMETER_PERIOD_S,
        Kind::Accelerometer | Kind::Magnetometer => 0.0,
    })
}

/// \[s\] how well the instant of a channel is known: as its description says, or as its part lets anyone know it. A
/// thermometer is described as read at once, and is up to a whole period older.
pub fn instant_sigma_s(channel: &Channel) -> f64 {
    let spread = match (channel.sensor, channel.instant_sigma_s) {
        (Kind::Thermometer, None) => 3f64.sqrt(),
        _ => 12f64.sqrt(),
    };
    conversion_period_s(channel) / spread
}

/// What the calibration leaves open in one channel: its own, and the instant at which it is read. Where the description says
/// that its part has a clock of its own, this instant drifts too. A reference that is not exact has a response of its own.
pub fn calibration(twin: &Twin, instrument: &Reference, index: usize) -> Vec<Column> {
    let mut columns = twin.calibration(index);
    let channel = &twin.unit().channels[index];
    if let Some(sigma) = instrument.response_sigma(index) {
        columns.push(Column {
            name: format!("reference_response_{}", channel.name),
            sigma,
            entries: vec![(index, twin.bend(index))],
        });
    }
    let is_of_record = is_without_clock(channel) && instrument.step_s() > 0.0;
    let sigma = match is_of_record {
        true => INSTANT_ROWS * instrument.step_s(),
        false => instant_sigma_s(channel),
    };
    if sigma <= 0.0 {
        return columns;
    }
    let slope = twin.by_instant(index);
    let starts_s = twin.starts_s();
    let (first, last) = (starts_s.first().unwrap_or(&0.0), starts_s.last().unwrap_or(&0.0));
    let (middle, half) = (0.5 * (last + first), (0.5 * (last - first)).max(f64::MIN_POSITIVE));
    let drifting = || {
        slope
            .iter()
            .zip(starts_s)
            .map(|(slope, t_s)| slope * (t_s - middle) / half)
    };
    let drift = channel.instant_sigma_s.map(|_| ("instant_drift", drifting().collect()));
    let shapes = [("instant", slope.clone())].into_iter().chain(drift);
    columns.extend(shapes.map(|(name, values)| Column {
        name: format!("{name}_{}", channel.name),
        sigma,
        entries: vec![(index, values)],
    }));
    columns
}

/// Whether a channel is a gyro of which nothing says when it converts.
fn is_without_clock(channel: &Channel) -> bool {
    channel.sensor == Kind::Gyro && channel.bits.is_none() && channel.instant_sigma_s.is_none()
}

/// What the stamps of a record leave open of all channels: half a row to either side, evenly, where gyros alone see the motion. Where other sensors would
/// show such a shift by as much as their noise, they say whether it is the gyros' or of all, and nothing is open.
pub fn stamps(twin: &Twin, instrument: &Reference) -> Option<Column> {
    let sigma = instrument.step_s() / 12f64.sqrt();
    if sigma <= 0.0 {
        return None;
    }
    let channels = &twin.unit().channels;
    let of = |is_asked: fn(Kind) -> bool| (0..channels.len()).filter(move |index| is_asked(channels[*index].sensor));
    let mut shown = 0.0;
    for index in of(|sensor| matches!(sensor, Kind::Accelerometer | Kind::Magnetometer)) {
        let in_noise = sigma / channels[index].sigma();
        let slopes = twin.by_instant(index).into_iter().filter(|slope| slope.is_finite());
        shown += slopes.map(|slope| (slope * in_noise).powi(2)).sum::<f64>();
        if shown >= 1.0 {
            return None;
        }
    }
    let seeing = of(|sensor| sensor != Kind::Thermometer);
    Some(Column {
        name: "reference_instant".to_owned(),
        sigma,
        entries: seeing.map(|index| (index, twin.by_instant(index))).collect(),
    })
}
