//! The unit as its designers believe it to be: a gap case's `unit.toml`, as far as the bench needs it.
//!
//! In: TOML. Out: for every channel its axis, scale, range and noise. Fields the bench does not use are passed over.
//! Refused: what is no such file, and channels without a scale.

use nalgebra::Vector3;
use serde::Deserialize;

/// A nominal unit.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Nominal {
    /// Its name.
    pub name: String,
    /// \[s\] between two packets.
    pub cycle_s: Option<f64>,
    /// Its channels.
    #[serde(rename = "channel")]
    pub channels: Vec<NominalChannel>,
}

/// A nominal channel, in units (m/s2, rad/s, uT, degC).
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct NominalChannel {
    /// Its name.
    pub name: String,
    /// accelerometer, gyro, magnetometer or thermometer.
    pub sensor: String,
    /// Sensitive axis in b; thermometers have none.
    pub axis_b: Option<[f64; 3]>,
    /// Units per count.
    pub lsb: f64,
    /// White noise of a sample.
    pub noise_sigma: Option<f64>,
    /// Beyond it the channel clips.
    pub range: Option<[f64; 2]>,
    /// Width of its code; none for a channel that is not rounded.
    pub bits: Option<u32>,
}

impl Nominal {
    /// Reads a unit file.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let nominal: Nominal = toml::from_str(text).map_err(|error| error.to_string())?;
        match nominal
            .channels
            .iter()
            .find(|channel| !(channel.lsb.is_finite() && channel.lsb > 0.0))
        {
            Some(channel) => Err(format!("channel {}: lsb must be a positive number", channel.name)),
            None => Ok(nominal),
        }
    }

    /// A channel.
    pub fn channel(&self, name: &str) -> Option<&NominalChannel> {
        self.channels.iter().find(|channel| channel.name == name)
    }

    /// Axes of some channels, or the first name that has none.
    ///
    /// # Errors
    /// The name.
    pub fn axes_b(&self, names: &[String]) -> Result<Vec<Vector3<f64>>, String> {
        let axis = |name: &String| {
            let axis_b = self.channel(name).and_then(|channel| channel.axis_b);
            axis_b.map(Vector3::from).ok_or_else(|| name.clone())
        };
        names.iter().map(axis).collect()
    }
}

impl NominalChannel {
    /// Outputs from here on are no measurement \[counts\]: the range, less a count where the channel is rounded.
    pub fn limit_counts(&self) -> f64 {
        let rounding = if self.bits.is_some() { 1.0 } else { 0.0 };
        let least = |[low, high]: [f64; 2]| low.abs().min(high.abs()) / self.lsb - rounding;
        self.range.map_or(f64::INFINITY, least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: &str = "name = \"u\"\ncycle_s = 0.2\n[[channel]]\nname = \"g1\"\nsensor = \"gyro\"\n\
        axis_b = [0.0, 0.6, 0.8]\nlsb = 0.5\nrange = [-100.0, 100.0]\nbits = 14\nslot_s = 0.1\n";

    #[test]
    fn axes_and_limits_are_those_of_the_file() {
        let unit = Nominal::parse(UNIT).expect("unit");
        assert_eq!(unit.axes_b(&["g1".into()]), Ok(vec![Vector3::new(0.0, 0.6, 0.8)]));
        assert_eq!(unit.axes_b(&["g1".into(), "g9".into()]), Err("g9".into()));
        assert_eq!(unit.channel("g1").map(NominalChannel::limit_counts), Some(199.0));
    }

    #[test]
    fn a_scale_of_zero_is_refused() {
        let error = Nominal::parse(&UNIT.replace("0.5", "0.0")).expect_err("zero");
        assert_eq!(error, "channel g1: lsb must be a positive number");
        assert!(Nominal::parse("not toml").is_err());
    }
}
