//! How far a held-out gap shrinks, and what that says of an effect: what [`crate::input::hold::Held::judge`] gives.

use crate::thresholds::GAP_KNOWN;

/// One channel's gap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelShrink {
    /// Held-out samples that are there.
    pub samples: usize,
    /// Gaps in sigma.
    pub before: f64,
    /// With the calibration refitted.
    pub recalibrated: f64,
    /// With effect and calibration fitted.
    pub after: f64,
    /// Root mean square residual in physical units before.
    pub before_rms: f64,
    /// And after.
    pub after_rms: f64,
}

impl ChannelShrink {
    /// Whether the model made it worse by more than chance: twice the standard deviation of a gap of so many samples.
    pub fn is_worse(&self) -> bool {
        self.samples > 0 && self.after - self.before > 2.0 / (2.0 * self.samples as f64).sqrt()
    }
}

/// The held-out gap before and after.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shrink {
    /// Gap of the nominal twin, sigma.
    pub before: f64,
    /// Gap with the calibration refitted, no effect.
    pub recalibrated: f64,
    /// Gap with effect and calibration fitted.
    pub after: f64,
    /// What a perfect twin would leave.
    pub floor: f64,
    /// 100 (before - after) / (before - floor), or 0 where there is no gap to shrink.
    pub percent: f64,
    /// Its 95 % interval.
    pub interval_percent: [f64; 2],
    /// 95 % interval of what the effect takes off beyond recalibration, in sigma of the total gap.
    pub beyond_recalibration: [f64; 2],
    /// In the unit's channel order.
    pub channels: Vec<ChannelShrink>,
}

impl Shrink {
    /// Whether the held-out samples speak against the effect: with 97.5 % recalibration alone shrinks the gap more.
    pub fn refutes_the_effect(&self) -> bool {
        self.beyond_recalibration[1] < 0.0
    }

    /// Whether the held-out samples speak for the effect: the gap shrinks with 97.5 %, and recalibration alone does not
    /// shrink it more; where both shrink it as much, it is the size of that calibration which speaks. An attribution that fails
    /// this is withdrawn, whatever its evidence.
    pub fn supports_the_effect(&self) -> bool {
        self.interval_percent[0] > 0.0
            && self.beyond_recalibration[1] >= -GAP_KNOWN * (self.before - self.floor).max(0.0)
    }
}

/// The largest shrink to be had, in percent: fitting `parameters` leaves a part `parameters / snr^2` of the excess energy
/// (`n` parameters fitted to noise of one take up `n` of its energy), which a gap of `before` sigma over its `floor` counts as a root mean square.
pub fn ceiling_percent([before, floor]: [f64; 2], parameters: usize, snr: f64) -> f64 {
    let lost = (parameters as f64 / (snr * snr)).min(1.0);
    let [excess, least] = [before * before - floor * floor, floor * floor];
    if before - floor > GAP_KNOWN && snr > 0.0 {
        100.0 * (before - (least + excess * lost).sqrt()) / (before - floor)
    } else {
        0.0
    }
}
