//! What a trial's answer says, as JSON.

use serde::{Deserialize, Serialize};

/// One thing that was wrong.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cause {
    /// Its name in verdicts, or of a novel disturbance.
    pub effect: String,
    /// Whether verdicts have a name for it.
    pub in_library: bool,
    /// The channels it touches.
    pub channels: Vec<String>,
    /// Strength it was dealt with.
    pub strength: f64,
    /// Its own part of [`Answer::snr_marginal`]; an effect at the largest size it is dealt at may be hardly there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub snr_marginal: Option<f64>,
    /// Its part that is left where nobody knows the motion: in each packet by itself, and as one course where that was counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub snr_withheld: Option<(f64, Option<f64>)>,
    /// \[deg\] what it does to an attitude alone, where that was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attitude_deg: Option<f64>,
    /// By which it makes the gap of the sensor that shows it most grow, of what it was, where that was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_growth: Option<f64>,
    /// Its sizes, where its law has parameters that verdicts state too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sizes: Vec<Size>,
}

/// One size of a cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Size {
    /// Its name in verdicts.
    pub parameter: String,
    /// The channel that has it; all those touched where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// In SI, field in uT.
    pub value: f64,
}

/// What was wrong with a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The case.
    pub case: String,
    /// R0 nothing wrong, R0m nothing wrong but the description a little, R1 one cause, R3 a novel one, R4 two, R5 a real case, R6 three
    /// or four, R7 one in a real recording, R8 one at most, without the motion.
    pub ring: String,
    /// Seed of everything drawn.
    pub seed: u64,
    /// Causes; none for R0.
    pub effects: Vec<Cause>,
    /// Size of what is wrong, in sigmas over the fit window, beyond what calibration errors can imitate.
    pub snr_marginal: f64,
    /// True attitudes in the fit window, `t_s, qw, qx, qy, qz`, of a case whose motion is withheld.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub attitudes: Vec<[f64; 5]>,
    /// The recording it is in, of a real one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}
