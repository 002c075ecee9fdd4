//! What is said about a recording's unit and place: case.toml and unit.toml after the case format.
//!
//! In: either file's text, or a session of BROAD. Out: the same as values, and the texts of a BROAD case. Sigmas of BROAD's unit are its
//! noise at rest and what its sessions differ by; reference and field are as the recordings show them at rest (the optical attitude errs
//! by 2 to 4 mrad for tens of seconds, the room's field by 1.5 uT/m).

use serde::{Deserialize, Serialize};

use super::recording::Calibrated;

/// case.toml.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CaseText {
    /// `gap-case/1`.
    pub format: String,
    /// Its name.
    pub name: String,
    /// `csv`.
    pub kind: String,
    /// What anyone could see.
    pub about: String,
    /// File of the unit.
    pub unit: String,
    /// File of the log.
    pub measured: String,
    /// File of the reference.
    pub motion: String,
    /// Where.
    pub environment: EnvironmentText,
    /// How well the reference knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceText>,
    /// When.
    pub windows: Windows,
}

/// The environment of a case.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct EnvironmentText {
    /// Gravity.
    pub gravity_m_s2: f64,
    /// Latitude.
    pub latitude_deg: f64,
    /// Field in n.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field_n_ut: Option<[f64; 3]>,
    /// How well it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field_sigma_ut: Option<f64>,
    /// How much of it changes in a log.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field_wander_sigma_ut: Option<f64>,
    /// Over which time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field_correlation_s: Option<f64>,
    /// How much it changes with the place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field_gradient_sigma_ut_m: Option<f64>,
    /// Temperature at which the description holds.
    pub temperature_c: f64,
}

/// How well the reference knows.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReferenceText {
    /// Attitude.
    pub attitude_sigma_rad: f64,
    /// Over which its error stays alike.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude_correlation_s: Option<f64>,
    /// Place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_sigma_m: Option<f64>,
}

/// \[s\] what is fitted on, and what is judged on.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Windows {
    /// Fitted on.
    pub fit: Vec<[f64; 2]>,
    /// Judged on.
    pub hold: Vec<[f64; 2]>,
}

/// unit.toml.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct UnitText {
    /// Its name.
    pub name: String,
    /// Its channels.
    pub channel: Vec<ChannelText>,
}

/// A channel of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ChannelText {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub sensor: String,
    /// What it shares a chip with.
    pub group: String,
    /// Its axis.
    pub axis_b: [f64; 3],
    /// SI of a count.
    pub lsb: f64,
    /// Its zero.
    pub bias: f64,
    /// White noise of a row.
    pub noise_sigma: f64,
    /// How well the calibration knows its zero.
    pub bias_sigma: f64,
    /// Its scale.
    pub scale_sigma: f64,
    /// Its axis.
    pub axis_sigma_rad: f64,
    /// Where it clips.
    pub range: [f64; 2],
    /// \[s\] from a row's time to what it shows.
    #[serde(default)]
    pub slot_s: f64,
    /// Where it is.
    #[serde(default)]
    pub lever_m: [f64; 3],
}

/// \[s\] of a window of a long recording, and how many windows a short one has at least.
const WINDOW_S: f64 = 20.0;
const WINDOWS: f64 = 6.0;

/// Windows to fit on and to judge on, in turn, over these times.
pub fn alternating(times_s: &[f64]) -> Windows {
    let (first, last) = (
        times_s.first().copied().unwrap_or(0.0),
        times_s.last().copied().unwrap_or(0.0),
    );
    let step_s = WINDOW_S.min((last - first) / WINDOWS);
    let mut windows = Windows::default();
    let mut from_s = first;
    while step_s > 0.0 && from_s < last - 0.1 * step_s {
        let to_s = (from_s + step_s).min(last);
        let list = match windows.fit.len() > windows.hold.len() {
            true => &mut windows.hold,
            false => &mut windows.fit,
        };
        list.push([from_s, to_s]);
        from_s += step_s;
    }
    windows
}

/// The unit of BROAD in a session.
pub(super) fn of_broad(calibrated: &Calibrated) -> UnitText {
    let triad =
        |letter: char, sensor: &str, noise: [f64; 3], bias: [f64; 3], sigmas: [f64; 3], range: f64, slot_s: f64| {
            let channel = move |axis: usize| ChannelText {
                name: format!("{letter}{}", ['x', 'y', 'z'][axis]),
                sensor: sensor.to_owned(),
                group: "unit".to_owned(),
                axis_b: std::array::from_fn(|at| f64::from(u8::from(at == axis))),
                lsb: 1.0,
                bias: bias[axis],
                noise_sigma: noise[axis],
                bias_sigma: sigmas[0],
                scale_sigma: sigmas[1],
                axis_sigma_rad: sigmas[2],
                range: [-range, range],
                slot_s,
                lever_m: if letter == 'a' { calibrated.lever_m } else { [0.0; 3] },
            };
            [channel(0), channel(1), channel(2)]
        };
    let none = [0.0; 3];
    UnitText {
        name: "nine-axis unit, delays, lever arm and biases calibrated".to_owned(),
        channel: [
            triad(
                'g',
                "gyro",
                [0.0019; 3],
                calibrated.gyro_bias,
                [0.000_35, 0.004, 0.004],
                34.9,
                -0.0042,
            ),
            triad(
                'a',
                "accelerometer",
                [0.05, 0.06, 0.07],
                none,
                [0.05, 0.004, 0.004],
                156.9,
                -0.0027,
            ),
            triad('m', "magnetometer", [0.7; 3], none, [0.6, 0.01, 0.01], 1200.0, -0.0152),
        ]
        .concat(),
    }
}

/// A BROAD case in this field.
pub(super) fn case_of_broad(field_n_ut: [f64; 3]) -> CaseText {
    CaseText {
        format: "gap-case/1".to_owned(),
        name: String::new(),
        kind: "csv".to_owned(),
        about: "A nine-axis unit moved by hand in a room; attitude and position from an optical system.".to_owned(),
        unit: "unit.toml".to_owned(),
        measured: "measured.csv.gz".to_owned(),
        motion: "motion.csv.gz".to_owned(),
        environment: EnvironmentText {
            gravity_m_s2: 9.8127,
            latitude_deg: 52.51,
            field_n_ut: Some(field_n_ut),
            field_sigma_ut: Some(0.8),
            field_wander_sigma_ut: Some(0.15),
            field_correlation_s: Some(10.0),
            field_gradient_sigma_ut_m: Some(1.5),
            temperature_c: 25.0,
        },
        reference: Some(ReferenceText {
            attitude_sigma_rad: 0.003,
            attitude_correlation_s: Some(20.0),
            position_sigma_m: Some(0.0003),
        }),
        windows: Windows::default(),
    }
}

/// A file's text.
pub(super) fn text(value: &impl Serialize) -> String {
    toml::to_string(value).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_alternate_and_leave_nothing_out() {
        let times: Vec<f64> = (0..2000).map(|row| 15.0 + 0.1 * f64::from(row)).collect();
        let windows = alternating(&times);
        assert_eq!((windows.fit[0], windows.hold[0]), ([15.0, 35.0], [35.0, 55.0]));
        let whole: f64 = windows
            .fit
            .iter()
            .chain(&windows.hold)
            .map(|[from, to]| to - from)
            .sum();
        assert!((whole - 199.9).abs() < 1e-9, "{whole}");
        // A minute has three of each.
        let minute = alternating(&times[..600]);
        assert_eq!((minute.fit.len(), minute.hold.len()), (3, 3));
    }
}
