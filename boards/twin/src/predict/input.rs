//! The input of a channel after its filters, made once for all questions that have it in common.
//!
//! In: what a channel looks at, when, and through what ([`Look`]). Out: its input at those instants. A low-pass runs over the
//! whole motion and is the same for all sensors of a kind; an input is the same for all effects that are added to it. A
//! [`Memory`] keeps both from one question to the next, as of a derivative by one parameter after another.

use nalgebra::Vector3;

use super::{Aim, Chain, Feel, Filter, Kind, Twin};

/// Relative distance below which two time constants are taken as this far apart: the partial fractions of two equal
/// low-passes divide zero by zero.
const SEPARATION: f64 = 1e-4;

/// Low-passes by kind and time constant.
pub(super) type Filters = Vec<(Kind, f64, Filter)>;

/// What a channel's input depends on.
#[derive(PartialEq)]
pub(super) struct Look {
    aim: Aim,
    /// \[s\] time constant of the second low-pass, or below zero of a lead.
    lag_s: f64,
    /// \[s\] time constant of the high-pass.
    high_pass_s: Option<f64>,
    /// \[s\] when it is read, one instant a cycle.
    instants_s: Vec<f64>,
}

impl Look {
    /// That of a chain, whose readings are logged at `t_s`.
    pub fn of(chain: &Chain, t_s: &[f64]) -> Self {
        Self {
            aim: chain.aim,
            lag_s: chain.lag_s,
            high_pass_s: chain.high_pass_s,
            instants_s: t_s.iter().map(|t_s| chain.instant(*t_s)).collect(),
        }
    }
}

/// Series of what is felt that are kept: as many as there are kinds of sensors, each of which may be late by itself.
const FELT: usize = 4;

/// What questions to one [`Twin`] have in common.
#[derive(Default)]
pub struct Memory {
    /// Low-passes beside the nominal channels' own.
    filters: Filters,
    /// The latest questions of each channel, the latest last.
    latest: Vec<Latest>,
    /// What the centre feels at other instants than the nominal channels', by these instants, the latest asked for last: all channels that
    /// are equally late feel the same, whatever they look at.
    felt: Vec<(Vec<f64>, Vec<Feel>)>,
}

/// Questions of a channel that are kept: it may look along either way of three axes, and those who ask of exchanged axes ask in every order.
const ASKED: usize = 6;

/// A late question of a channel that does not look as described.
struct Latest {
    channel: usize,
    look: Look,
    input: Vec<f64>,
}

impl Memory {
    /// Keeps what is felt at these instants and says that they were asked for last.
    fn keep(&mut self, instants_s: Vec<f64>, felt: impl Fn(f64) -> Feel) {
        let known = self.felt.iter().position(|(own, _)| *own == instants_s);
        let latest = match known {
            Some(at) => self.felt.remove(at),
            None => {
                let felt = instants_s.iter().map(|t_s| felt(*t_s)).collect();
                (instants_s, felt)
            }
        };
        if self.felt.len() == FELT {
            self.felt.remove(0);
        }
        self.felt.push(latest);
    }
}

impl Twin {
    /// The input of a channel that looks so.
    pub(super) fn input<'a>(&self, channel: usize, look: Look, memory: &'a mut Memory) -> &'a [f64] {
        &self.latest(channel, look, memory).input
    }

    /// What the centre feels at these instants.
    pub(super) fn felt<'a>(&self, instants_s: Vec<f64>, memory: &'a mut Memory) -> &'a [Feel] {
        memory.keep(instants_s, |t_s| self.scene.feel(t_s));
        memory.felt.last().map_or(&[], |(_, felt)| felt)
    }

    /// The same at two series of instants.
    pub(super) fn felt_at_both<'a>(&self, instants_s: [Vec<f64>; 2], memory: &'a mut Memory) -> [&'a [Feel]; 2] {
        let is_one = instants_s[0] == instants_s[1];
        instants_s
            .into_iter()
            .for_each(|instants_s| memory.keep(instants_s, |t_s| self.scene.feel(t_s)));
        match &memory.felt[..] {
            [.., (_, felt)] if is_one => [felt, felt],
            [.., (_, first), (_, second)] => [first, second],
            _ => [&[], &[]],
        }
    }

    /// [degC/s] The temperature's rate of change at these instants through a low-pass of `tau_s` > 0: of a low-pass
    /// `tau y' + y = T` it is `y' = (T - y)/tau`.
    pub(super) fn temperature_rates(&self, tau_s: f64, instants_s: Vec<f64>, memory: &mut Memory) -> Vec<f64> {
        let look = Look {
            aim: Aim {
                sensor: Kind::Thermometer,
                axis_b: Vector3::zeros(),
                lever_m: Vector3::zeros(),
            },
            lag_s: 0.0,
            high_pass_s: None,
            instants_s,
        };
        let mut rates = self.through(&look, 0.0, &mut memory.filters);
        let slow = self.through(&look, tau_s, &mut memory.filters);
        combine(&mut rates, 1.0 / tau_s, &slow, -1.0 / tau_s);
        rates
    }

    fn latest<'a>(&self, channel: usize, look: Look, memory: &'a mut Memory) -> &'a Latest {
        let Memory { filters, latest, .. } = memory;
        let known = latest
            .iter()
            .position(|known| known.channel == channel && known.look == look);
        let at = known.unwrap_or_else(|| {
            let mut own = (0..latest.len()).filter(|at| latest[*at].channel == channel);
            let oldest = own.next().filter(|_| own.count() + 1 >= ASKED);
            oldest.map(|oldest| latest.remove(oldest));
            latest.push(Latest {
                channel,
                input: self.filtered(&look, self.unit.channels[channel].tau_s(), filters),
                look,
            });
            latest.len() - 1
        });
        &latest[at]
    }

    /// The input through a low-pass of `tau_s` and what the look has beside it; filters that are made for it are added to
    /// `filters`. Filters in a row are a weighted sum of first-order ones (partial fractions).
    pub(super) fn filtered(&self, look: &Look, tau_s: f64, filters: &mut Filters) -> Vec<f64> {
        let mut through = |tau_s: f64| self.through(look, tau_s, filters);
        let mut slow = through(tau_s);
        if look.lag_s > 0.0 {
            let lag_s = apart(look.lag_s, tau_s);
            let second = through(lag_s);
            combine(&mut slow, tau_s / (tau_s - lag_s), &second, -lag_s / (tau_s - lag_s));
        } else if look.lag_s < 0.0 {
            // Low-pass and lead: y + |lag| y', and tau y' = u - y.
            let lead_s = -look.lag_s;
            let tau_s = if tau_s > 0.0 { tau_s } else { lead_s * SEPARATION };
            let sharper = through(0.0);
            let softer = if slow == sharper { through(tau_s) } else { slow.clone() };
            combine(&mut slow, 1.0, &sharper, lead_s / tau_s);
            combine(&mut slow, 1.0, &softer, -lead_s / tau_s);
        }
        if let Some(high_pass_s) = look.high_pass_s {
            let high_pass_s = apart(high_pass_s, tau_s);
            let kept = through(high_pass_s);
            let gain = high_pass_s / (high_pass_s - tau_s);
            combine(&mut slow, gain, &kept, -gain);
        }
        slow
    }

    /// The input through one low-pass.
    fn through(&self, look: &Look, tau_s: f64, filters: &mut Filters) -> Vec<f64> {
        let sensor = look.aim.sensor;
        let at = |filter: &Filter| self.scene.inputs(&look.aim, filter, &look.instants_s);
        let mut known = self.filters.iter().chain(filters.iter());
        if let Some((.., filter)) = known.find(|(kind, tau, _)| (*kind, *tau) == (sensor, tau_s)) {
            return at(filter);
        }
        let filter = self.scene.filter(sensor, tau_s);
        let input = at(&filter);
        filters.push((sensor, tau_s, filter));
        input
    }
}

fn combine(sum: &mut [f64], weight: f64, other: &[f64], other_weight: f64) {
    for (sum, other) in sum.iter_mut().zip(other) {
        *sum = *sum * weight + other * other_weight;
    }
}

fn apart(tau_s: f64, from_s: f64) -> f64 {
    if (tau_s - from_s).abs() < SEPARATION * from_s {
        from_s * (1.0 + SEPARATION)
    } else {
        tau_s
    }
}
