//! The physical effects a unit may have and its nominal twin lacks: one file a piece of physics, one trait.
//!
//! The same entry of [`LIBRARY`] injects an effect into a prediction, is fitted to a log, and is what the report prints.
//! An [`Effect`] says on its [`Page`] what it is, and in [`Effect::act`] what it does to the [`Chain`] of one channel, given
//! the parameters of its block. A [`Cause`] is an effect at a [`Locality`] (and, for an effect with a parameter that is not
//! smooth, at one [`Effect::variants`] of it); an [`Active`] is a cause with its parameters. In use:
//!
//! ```text
//! for effect in LIBRARY
//!   for locality in effect.localities(unit)          one sensor, one plate, each its own, all alike, the unit
//!     for variant in effect.variants(starts_s)       usually one: 0
//!       cause = Cause { effect, locality, variant }
//!       cause.parameters(unit)                       names, units, prior sigmas; theta = 0 is "no effect"
//!       twin.predict(&[Active { cause, theta }])     readings of every channel
//!       twin.jacobian(&[Active { cause, theta }], 0) derivatives, only of the channels it touches
//! ```
//!
//! [`Nature`] tells how an effect is found: a `Smooth` one by its Jacobian; a `Discrete` one by trying its variants (it has
//! no parameters); a `Spread` one by the likelihood of the residual ([`Effect::log_likelihood`]), for it changes how readings
//! scatter and not what they are.

mod accel_range;
mod axis_order;
mod bend;
mod bias;
mod bias_temperature;
mod bias_walk;
mod bit_fault;
mod cause;
mod clock_rate;
mod coarse_quantisation;
mod cross_field;
mod current_field;
mod earth_rate;
mod eddy_current;
mod field_gradient;
mod field_model;
mod g2_sensitivity;
mod g_sensitivity;
mod gravity_value;
mod gyro_lag;
mod gyro_supply;
mod hard_iron;
mod high_pass;
mod hysteresis;
mod latency;
mod lever_arm;
mod line;
mod mains_alias;
mod misalignment;
mod mounting;
mod noise_level;
mod nonlinearity;
mod packet_corruption;
mod packet_loss;
mod page;
mod plate_flexing;
mod plate_rotation;
mod plate_swap;
mod read_skew;
mod reference_lag;
mod reference_rate_scale;
mod reference_sign;
mod sampling_jitter;
mod saturation;
mod scale;
mod scale_temperature;
mod set_reset;
mod shock;
mod sine_response;
mod site;
mod soft_iron;
mod spread;
mod stale_sample;
mod stuck_channel;
mod table_tilt;
mod temperature_hysteresis;
#[cfg(test)]
mod tests;
mod vibration;
mod vibration_rectification;
mod warm_up;
mod wave;

pub use self::wave::Wave;
pub use cause::{Active, Cause, Locality, Parameter, UnknownEffect};
pub use page::{CorrectedAs, Nature, Needs, Page, Scope, Symbol, Texture};
pub use site::Site;
pub use spread::{Beneath, View, logged_step, most_likely, sigma_of};
pub use vibration::WANDERS;

use crate::channel::{Chain, Feel, UnitDescription};
use crate::environment::Environment;
use crate::part::signal::Noise;

/// All effects: gyros, accelerometers, magnetometers, reference and environment, timing, noise and bits.
pub const LIBRARY: &[&dyn Effect] = &[
    &bias::Bias(&bias::GYRO),
    &bias_temperature::BiasTemperature(&bias_temperature::GYRO),
    &temperature_hysteresis::TemperatureHysteresis,
    &warm_up::WarmUp,
    &scale::Scale(&scale::GYRO),
    &scale_temperature::ScaleTemperature(&scale_temperature::GYRO),
    &nonlinearity::GyroNonlinearity,
    &misalignment::Misalignment(&misalignment::GYRO),
    &g_sensitivity::GSensitivity,
    &g2_sensitivity::G2Sensitivity,
    &earth_rate::EarthRate,
    &gyro_lag::GyroLag,
    &gyro_supply::GyroSupply,
    &saturation::Saturation,
    &sine_response::SineResponse,
    &bias::Bias(&bias::ACCEL),
    &bias_temperature::BiasTemperature(&bias_temperature::ACCEL),
    &scale::Scale(&scale::ACCEL),
    &scale_temperature::ScaleTemperature(&scale_temperature::ACCEL),
    &misalignment::Misalignment(&misalignment::ACCEL),
    &nonlinearity::AccelNonlinearity,
    &lever_arm::LeverArm,
    &vibration_rectification::VibrationRectification,
    &hysteresis::Hysteresis,
    &high_pass::HighPass,
    &accel_range::AccelRange,
    &hard_iron::HardIron,
    &soft_iron::SoftIron,
    &scale_temperature::ScaleTemperature(&scale_temperature::MAG),
    &bias_temperature::BiasTemperature(&bias_temperature::MAG),
    &cross_field::CrossField,
    &set_reset::SetReset,
    &current_field::CurrentField,
    &eddy_current::EddyCurrent,
    &field_gradient::FieldGradient,
    &mains_alias::MainsAlias,
    &axis_order::AxisOrder,
    &plate_rotation::PlateRotation,
    &plate_swap::PlateSwap,
    &gravity_value::GravityValue,
    &table_tilt::TableTilt,
    &mounting::Mounting,
    &reference_rate_scale::ReferenceRateScale,
    &reference_lag::ReferenceLag,
    &reference_sign::ReferenceSign,
    &field_model::FieldModel,
    &plate_flexing::PlateFlexing,
    &latency::Latency(&latency::ALL),
    &latency::Latency(&latency::GYRO),
    &latency::Latency(&latency::ACCEL),
    &latency::Latency(&latency::MAG),
    &read_skew::ReadSkew,
    &clock_rate::ClockRate,
    &packet_loss::PacketLoss,
    &bias_walk::BiasWalk,
    &stale_sample::StaleSample,
    &sampling_jitter::SamplingJitter,
    &coarse_quantisation::CoarseQuantisation,
    &bit_fault::BitFault,
    &stuck_channel::StuckChannel,
    &packet_corruption::PacketCorruption,
    &noise_level::NoiseLevel,
    &vibration::Vibration,
    &shock::Shock,
];

/// An effect and all that are mistaken for it or it for them: to withhold it from the library, withhold these.
pub fn kin(name: &str) -> Vec<&'static str> {
    let pages = LIBRARY.iter().map(|effect| effect.page());
    let is_kin = |page: &&Page| {
        page.name == name
            || page.siblings.contains(&name)
            || by_name(name).is_some_and(|effect| effect.page().siblings.contains(&page.name))
    };
    pages.filter(is_kin).map(|page| page.name).collect()
}

/// The effect of that name.
pub fn by_name(name: &str) -> Option<&'static dyn Effect> {
    LIBRARY.iter().copied().find(|effect| effect.page().name == name)
}

/// Instants that divide a log evenly; an effect that begins at some instant is tried at these. Between them the onset is
/// free: any instant is a variant.
const ONSETS: usize = 15;

/// \[s\] the onsets to try.
pub fn onsets(starts_s: &[f64]) -> impl Iterator<Item = f64> {
    let (from_s, to_s) = (*starts_s.first().unwrap_or(&0.0), *starts_s.last().unwrap_or(&0.0));
    (1..=ONSETS).map(move |k| from_s + (to_s - from_s) * k as f64 / (ONSETS + 1) as f64)
}

/// ln probability of some logs, as a function of an effect's parameters.
pub type Likelihood<'a> = Box<dyn Fn(&[f64]) -> f64 + 'a>;

/// A physical effect.
pub trait Effect: Sync {
    /// What it is.
    fn page(&self) -> &'static Page;

    /// Changes the chain of one channel. `theta` is the block of parameters that holds for this channel, in the order of
    /// the page; zero is no effect. One that only changes the scatter leaves the chain alone.
    fn act<'a>(&self, _theta: &'a [f64], _variant: f64, _site: &Site<'a>, _chain: &mut Chain<'a>) {}

    /// What the unit truly feels where the truth instrument tells another state; `None` of an effect that leaves that alone.
    fn retold(&self, _variant: f64, _feel: &Feel, _environment: &Environment) -> Option<Feel> {
        None
    }

    /// ln probability of the logs of the channels of one block under this effect, for one that changes their scatter; the
    /// nominal one for the others. Where the block is a channel the logarithms of several channels add up, so that the set of
    /// channels concerned can be found one by one; unless they share what is unknown of it.
    fn log_likelihood(&self, _theta: &[f64], _variant: f64, views: &[View]) -> f64 {
        views.iter().map(View::nominal).sum()
    }

    /// The same as a function of the parameters, for a search: what does not depend on them is done once.
    fn likelihood<'a>(&'a self, variant: f64, views: &'a [View<'a>]) -> Likelihood<'a> {
        Box::new(move |theta| self.log_likelihood(theta, variant, views))
    }

    /// What the channels of one block would have measured with this effect, before rounding, for one that changes their
    /// scatter; what they measured for the others.
    fn disturb(&self, _theta: &[f64], _variant: f64, views: &[View], _noise: Noise) -> Vec<Vec<f64>> {
        views.iter().map(|view| view.measured.to_vec()).collect()
    }

    /// What the samples of the channels of one block were before this effect, as far as what was logged tells, for one that
    /// changes their scatter; nothing for one that does not say. A calibration is fitted to these: an effect that makes
    /// readings larger on the whole, or a few of them anything, would be taken for one.
    fn beneath(&self, _theta: &[f64], _variant: f64, _views: &[View]) -> Vec<Vec<Beneath>> {
        Vec::new()
    }

    /// The values to try of a parameter in which the effect is not smooth (an onset, a time constant, a choice), for a log
    /// whose cycles begin at these instants \[s\].
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![0.0]
    }

    /// Whether what a recorded reference errs by while the unit moves looks like this variant: beside such a reference it is not sought.
    fn is_like_a_reference(&self, _variant: f64) -> bool {
        false
    }

    /// What a variant says, in words, where the page does not: which bit, which axis, since when.
    fn told(&self, _variant: f64) -> Option<String> {
        None
    }

    /// The variant that these channels, in which it was found, tell together, where those tried stand too far apart or the
    /// likelihood averages over them.
    fn settled(&self, _views: &[View]) -> Option<f64> {
        None
    }

    /// What a channel would log with this effect on the whole, at every row, where its sensor reads what is predicted, given
    /// what was measured of it where that is known. An effect that pushes readings no way leaves that as it is.
    fn expected(&self, _variant: f64, view: &View) -> Vec<f64> {
        view.predicted.to_vec()
    }

    /// The variant that does the same to readings with another zero: a calibration may take one for the other.
    fn shifted(&self, _variant: f64) -> Option<f64> {
        None
    }

    /// The variant that says that it happened before the log began, of an effect that happens at random: when it did is of one
    /// log, how often and how much is of the unit.
    fn happened(&self) -> Option<f64> {
        None
    }

    /// The variant with the same course that lacks what this effect's physics makes of it: where it explains a log better, this
    /// effect stands in for something without a name.
    fn without_its_physics(&self, _variant: f64) -> Option<f64> {
        None
    }

    /// The wave that carries this variant, if one does: its columns are courses of time times the sine, for the first half of the
    /// parameters, and the same courses times the cosine for the others. Variant 0 has no frequency and leaves the courses.
    fn wave(&self, _variant: f64) -> Option<Wave> {
        None
    }

    /// Whether this variant comes again and again, with a period that is to be found: it is on in such stretches only.
    fn repeats(&self, _variant: f64) -> bool {
        false
    }

    /// How many times its prior sigma a parameter is sought in, of a variant whose sizes are of another order.
    fn reach(&self, _variant: f64) -> f64 {
        1.0
    }

    /// Whether values other than the variants are possible too, [`Effect::between`] these: the variants are then where a search
    /// begins.
    fn has_values_between(&self) -> bool {
        false
    }

    /// The values about its variants between which others are possible; by itself the variants.
    fn between(&self, starts_s: &[f64]) -> Vec<f64> {
        self.variants(starts_s)
    }

    /// Where it can be in this unit.
    fn localities(&self, unit: &UnitDescription) -> Vec<Locality> {
        cause::localities(self.page(), unit)
    }
}
