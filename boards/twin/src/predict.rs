//! The digital twin: what every channel of a unit should read along a known motion.
//!
//! In: a [`UnitDescription`], a [`Scene`] (motion in environment) and the instants at which the cycles begin; then, for
//! every question, which effects of the library are active, where and how large. Out: predicted readings in physical units
//! before rounding, one series a channel, clipped to the channel's range; their derivatives by effect and by calibration
//! parameter ([`Column`]), and how far they may be off ([`Channel::sigma`], [`Twin::calibration`]).
//!
//! Channel `k` is read at `cycle start + slot_s`. All of it is a pure function of its arguments; nothing is random here.

mod calibration;
mod emems;
mod grid;
mod heading;
mod input;
mod scene;
#[cfg(test)]
mod tests;

use std::borrow::Cow;

pub use calibration::{Accuracy, Column};
pub use emems::{conversion_s, emems, thesis_slot_s};
pub use grid::{Grid, LowPass};
pub use input::Memory;
use input::{Filters, Look};
pub use scene::{Filter, Scene};

use crate::channel::BEFORE;
pub use crate::channel::{Aim, Chain, Channel, Feel, Kind, KnownEffect, UnitDescription, UnitError};
use crate::effect::{Active, Cause, Nature, Parameter, Site, UnknownEffect};
use crate::environment::Environment;

/// Step of the difference quotients, in prior sigmas: rounding is then 1e-12 of a prior effect and curvature 1e-6.
const STEP: f64 = 1e-3;

/// Of one channel, the places of the parameters that touch it, each with the derivatives of its readings.
pub type Slopes = Vec<(usize, Vec<f64>)>;

/// The twin along one log.
pub struct Twin {
    unit: UnitDescription,
    environment: Environment,
    scene: Scene,
    /// \[s\] when the cycles begin.
    starts_s: Vec<f64>,
    /// Low-passes of the nominal channels, by kind and time constant.
    filters: Filters,
    known: Vec<Active>,
    /// What the centre feels when a channel is read, less the delay of its low-pass, by that instant after the start of the
    /// cycle [s]: many effects ask for it, and few move the instants.
    felt: Vec<(f64, Vec<Feel>)>,
    /// Inputs of the nominal channels after their low-pass: most effects leave them alone.
    plain: Vec<Vec<f64>>,
    nominal: Vec<Vec<f64>>,
}

impl Twin {
    /// A twin of `unit` in `scene`, whose cycles (or rows of the log) begin at `starts_s`. `environment` is the scene's.
    pub fn new(
        unit: UnitDescription,
        environment: Environment,
        scene: Scene,
        starts_s: Vec<f64>,
    ) -> Result<Self, UnknownEffect> {
        let known = unit
            .effects
            .iter()
            .map(|known| Active::known(known, &unit))
            .collect::<Result<_, _>>()?;
        let mut filters = Filters::new();
        for channel in &unit.channels {
            let (sensor, tau_s) = (channel.sensor, channel.tau_s());
            if !filters.iter().any(|(kind, tau, _)| (*kind, *tau) == (sensor, tau_s)) {
                filters.push((sensor, tau_s, scene.filter(sensor, tau_s)));
            }
        }
        let mut twin = Self {
            unit,
            environment,
            scene,
            starts_s,
            filters,
            known,
            felt: Vec::new(),
            plain: Vec::new(),
            nominal: Vec::new(),
        };
        for channel in &twin.unit.channels {
            let after_s = seen_s(channel);
            if !twin.felt.iter().any(|(kept_s, _)| *kept_s == after_s) {
                let instants_s = twin.starts_s.iter().map(|start_s| start_s + after_s);
                twin.felt
                    .push((after_s, instants_s.map(|t_s| twin.scene.feel(t_s)).collect()));
            }
        }
        twin.plain = (0..twin.unit.channels.len())
            .map(|index| {
                let channel = &twin.unit.channels[index];
                let look = Look::of(&Chain::of(channel), &twin.instants_s(index));
                twin.filtered(&look, channel.tau_s(), &mut Filters::new())
            })
            .collect();
        twin.nominal = (0..twin.unit.channels.len())
            .map(|index| twin.computed(index, &[], &mut Memory::default()))
            .collect();
        Ok(twin)
    }

    /// The twin of what is truly felt, and by sensors that truly look where they do, if a cause says that either is told
    /// wrongly: what is open about a unit is open along that.
    pub fn retold(&self, cause: &Cause) -> Option<Self> {
        let truly = |feel: &Feel| cause.effect.retold(cause.variant, feel, &self.environment);
        let is_moved = truly(&self.scene.feel(*self.starts_s.first()?)).is_some();
        let scene = match is_moved {
            true => self.scene.retold(|feel| truly(feel).unwrap_or(*feel)),
            false => self.scene.clone(),
        };
        let mut unit = self.unit.clone();
        let active = Active {
            cause: cause.clone(),
            theta: vec![],
        };
        let is_gross = cause.effect.page().nature == Nature::Discrete;
        for (index, channel) in unit.channels.iter_mut().enumerate().filter(|_| is_gross) {
            let mut chain = Chain::of(&self.unit.channels[index]);
            active.act(&self.site(index), &mut chain);
            (channel.axis_b, channel.lever_m) = (chain.aim.axis_b, chain.aim.lever_m);
        }
        (is_moved || unit != self.unit)
            .then(|| Self::new(unit, self.environment, scene, self.starts_s.clone()).ok())
            .flatten()
    }

    fn site(&self, index: usize) -> Site<'_> {
        Site {
            unit: &self.unit,
            index,
            channel: &self.unit.channels[index],
            environment: &self.environment,
            log_s: (
                *self.starts_s.first().unwrap_or(&0.0),
                *self.starts_s.last().unwrap_or(&0.0),
            ),
        }
    }

    /// The unit.
    pub fn unit(&self) -> &UnitDescription {
        &self.unit
    }

    /// Where it is.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// \[s\] when the cycles begin.
    pub fn starts_s(&self) -> &[f64] {
        &self.starts_s
    }

    /// \[s\] when this channel is read, one instant a cycle.
    pub fn instants_s(&self, channel: usize) -> Vec<f64> {
        let slot_s = self.unit.channels[channel].slot_s;
        self.starts_s.iter().map(|start_s| start_s + slot_s).collect()
    }

    /// \[s\] when what an effect adds to this channel is felt, one instant a cycle; `None` where a known effect may move these.
    pub fn seen_s(&self, channel: usize) -> Option<Vec<f64>> {
        let after_s = seen_s(&self.unit.channels[channel]);
        let instants_s = self.starts_s.iter().map(|start_s| start_s + after_s);
        self.known.is_empty().then(|| instants_s.collect())
    }

    /// What the unit's centre feels when this channel is read, one state a cycle.
    pub fn feels(&self, channel: usize) -> Vec<Feel> {
        self.instants_s(channel)
            .into_iter()
            .map(|t_s| self.scene.feel(t_s))
            .collect()
    }

    /// Readings of every channel, in the order of the unit, with these effects.
    pub fn predict(&self, active: &[Active]) -> Vec<Vec<f64>> {
        let mut memory = Memory::default();
        (0..self.unit.channels.len())
            .map(|index| self.channel_with(index, active, &mut memory).into_owned())
            .collect()
    }

    /// Readings of one channel.
    pub fn channel(&self, index: usize, active: &[Active]) -> Cow<'_, [f64]> {
        self.channel_with(index, active, &mut Memory::default())
    }

    /// The same, with what is kept from other channels.
    pub fn channel_with(&self, index: usize, active: &[Active], memory: &mut Memory) -> Cow<'_, [f64]> {
        match active.iter().any(|active| active.touches(index, &self.unit)) {
            true => Cow::Owned(self.computed(index, active, memory)),
            false => Cow::Borrowed(&self.nominal[index]),
        }
    }

    fn computed(&self, index: usize, active: &[Active], memory: &mut Memory) -> Vec<f64> {
        let channel = &self.unit.channels[index];
        let t_s = self.instants_s(index);
        let site = self.site(index);
        let mut chain = Chain::of(channel);
        for active in self.known.iter().chain(active) {
            active.act(&site, &mut chain);
        }
        let mut readings = match chain.looks_as(channel) {
            true => self.plain[index].clone(),
            false => self.input(index, Look::of(&chain, &t_s), memory).to_vec(),
        };
        let seen = |ago_s: f64| -> Vec<f64> { t_s.iter().map(|t_s| chain.instant(*t_s) - ago_s).collect() };
        // A high-pass takes the bias with it.
        let bias = if chain.high_pass_s.is_some() { 0.0 } else { chain.bias };
        let mut added = vec![0.0; readings.len()];
        if chain.is_additive() {
            let felt = match chain.is_delayed() {
                true => self.felt(seen(channel.tau_s()), memory),
                false => self.nominal_felt(channel),
            };
            let terms = added.iter_mut().zip(felt).zip(&readings);
            terms.for_each(|((added, feel), reading)| *added = chain.added(feel, *reading));
        }
        if chain.is_gross() {
            let [near, far] = match chain.is_delayed() || channel.tau_s() > 0.0 {
                true => self.felt_at_both(BEFORE.map(|part| seen(part * channel.tau_s())), memory),
                // Without a low-pass all of it is felt at once.
                false => [self.nominal_felt(channel); 2],
            };
            let felt = added.iter_mut().zip(near).zip(far);
            felt.for_each(|((added, near), far)| *added += chain.added_gross([near, far]));
        }
        (readings.iter_mut().zip(added)).for_each(|(reading, added)| *reading += added + bias);
        for (tau_s, per_rate) in chain.thermal() {
            let rates = self.temperature_rates(*tau_s, seen(channel.tau_s()), memory);
            (readings.iter_mut().zip(rates)).for_each(|(reading, rate)| *reading += per_rate * rate);
        }
        chain.finish(&t_s, &mut readings);
        for reading in &mut readings {
            *reading = reading.clamp(channel.range[0], channel.range[1]);
        }
        readings
    }

    /// What the centre feels when what a channel reads passes its low-pass, if it is read when it should be.
    fn nominal_felt(&self, channel: &Channel) -> &[Feel] {
        let known = self.felt.iter().find(|(after_s, _)| *after_s == seen_s(channel));
        known.map_or(&[], |(_, felt)| felt)
    }

    /// Derivatives of the readings by the parameters of `active[of]`, one column a parameter: central differences, exact
    /// for what is linear. Channels the effect does not touch are left out.
    pub fn jacobian(&self, active: &[Active], of: usize) -> Vec<Column> {
        let mut memory = Memory::default();
        let touched = active[of].cause.channels(&self.unit).into_iter();
        let slopes = touched.map(|channel| (channel, self.slopes(active, of, channel, &mut memory)));
        self.columns(&active[of].cause, slopes.collect())
    }

    /// The same of one channel.
    pub fn slopes(&self, active: &[Active], of: usize, channel: usize, memory: &mut Memory) -> Slopes {
        let cause = &active[of].cause;
        let mut moved = active.to_vec();
        let parameters = cause.parameters(&self.unit).into_iter().enumerate();
        let touching = parameters.filter(|(place, _)| cause.touched_by(*place, &self.unit).contains(&channel));
        let slope = |(place, parameter): (usize, Parameter)| {
            let step = STEP * parameter.prior_sigma;
            let theta = active[of].theta[place];
            let mut at = |value: f64| {
                moved[of].theta[place] = value;
                self.computed(channel, &moved, memory)
            };
            let (after, before) = (at(theta + step), at(theta - step));
            moved[of].theta[place] = theta;
            let both = after.iter().zip(before);
            (
                place,
                both.map(|(after, before)| (after - before) / (2.0 * step)).collect(),
            )
        };
        touching.map(slope).collect()
    }

    /// Columns of the parameters of a cause, of the slopes of channels.
    pub fn columns(&self, cause: &Cause, slopes: Vec<(usize, Slopes)>) -> Vec<Column> {
        let column = |parameter: Parameter| Column {
            name: parameter.name,
            sigma: parameter.prior_sigma,
            entries: Vec::new(),
        };
        let mut columns: Vec<Column> = cause.parameters(&self.unit).into_iter().map(column).collect();
        for (channel, slopes) in slopes {
            for (place, slopes) in slopes {
                columns[place].entries.push((channel, slopes));
            }
        }
        columns
    }
}

/// \[s\] after the start of the cycle: what a channel's low-pass lets through when it is read, to first order in its time
/// constant. What an effect adds comes from then; for terms of some percent of a reading that is exact enough.
fn seen_s(channel: &Channel) -> f64 {
    channel.slot_s - channel.tau_s()
}
