//! When an effect is on that comes again and again: a transmitter with its beacon, a heater with its thermostat.
//!
//! In: an effect's slopes, and the residual without it. Out: the stretch of time that comes again in which it explains most,
//! and by how much more than always. Residuals are folded at each period tried, and the one in whose phases they differ most
//! is taken (epoch folding; Leahy et al. 1983); then all stretches of phases are compared by their evidence, finer and finer,
//! as [`crate::search::once`] does for one stretch, until it is plain that none is there. Having looked costs the logarithm of how many were compared.

use crate::{
    input::windows::Span,
    library::column::Entries,
    null::{
        interval::{Interval, phase},
        problem::Problem,
    },
    search::interval_sums::{Residual, Steps, Touched},
    thresholds::{DOUBTED, LEAST_PART},
};

/// Phases into which a period is folded.
const PHASES: usize = 24;

/// \[s\] the shortest period; the longest comes three times in the fitted time, so that it is seen to come again.
const SHORTEST_S: f64 = 4.0;
const FEWEST: f64 = 3.0;

/// Steps of frequency in which the last cycle moves by a period.
const STEPS: f64 = 4.0;

/// Times the period and the edges are sought nearer.
const ROUNDS: usize = 6;

/// The round after which a stretch that is there shows half of what is asked of it. Edges are then tried a 60th of a period apart and the period
/// to a 40th of the last cycle, so a stretch of a phase or more overlaps the one tried by two thirds and more. Below half, what later rounds
/// find is a few samples.
const SHOWN_AFTER: usize = 1;

/// The channels that an effect touches, and a residual.
struct Folded<'a> {
    /// \[s\] instants of the rows of the log.
    starts_s: &'a [f64],
    channels: Vec<Touched<'a>>,
    residual: &'a Residual,
    sigmas: &'a [f64],
}

/// The stretch that comes again in which the effect with these `slopes` is on, and the nats it gains over always; `None` for
/// none that is much better. The residual is without it.
pub fn again(problem: &Problem, residual: &Residual, slopes: &[Entries], sigmas: &[f64]) -> Option<(Interval, f64)> {
    let folded = Folded {
        starts_s: problem.twin.starts_s(),
        channels: Touched::all(problem, slopes),
        residual,
        sigmas,
    };
    let instants = folded.channels.iter().flat_map(|channel| &channel.instants_s);
    let (from_s, to_s) = instants.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), t_s| {
        (from.min(*t_s), to.max(*t_s))
    });
    let span_s = to_s - from_s;
    let (least_hz, most_hz) = (FEWEST / span_s, 1.0 / SHORTEST_S);
    if !(span_s.is_finite() && least_hz < most_hz) {
        return None;
    }
    let step_hz = 1.0 / (STEPS * span_s);
    let steps = steps(span_s);
    let periods = (0..=steps).map(|step| 1.0 / (least_hz + step_hz * step as f64));
    let mut every_s = periods
        .map(|every_s| (folded.differ(every_s), every_s))
        .max_by(|one, other| one.0.total_cmp(&other.0))?
        .1;
    let edges = |around: &[f64], step: f64| -> Vec<f64> {
        let near = |edge: &f64| {
            (-3..=3)
                .map(|index| phase(edge + step * f64::from(index)))
                .collect::<Vec<_>>()
        };
        around.iter().flat_map(near).collect()
    };
    let mut all: Vec<f64> = (0..PHASES).map(|phase| phase as f64 / PHASES as f64).collect();
    let price = price(span_s);
    let (mut found, mut hz_step, mut edge_step) = (None, 0.5 * step_hz, 1.0 / PHASES as f64);
    for round in 0..ROUNDS {
        let tried = (-2..=2).map(|index| 1.0 / (1.0 / every_s + hz_step * f64::from(index)));
        let best = tried.filter_map(|every_s| folded.best(every_s, from_s, &all).map(|best| (best, every_s)));
        let ((gain, [on, off]), period_s) = best.max_by(|one, other| one.0.0.total_cmp(&other.0.0))?;
        if round >= SHOWN_AFTER && gain < 0.5 * (DOUBTED + price) {
            return None;
        }
        every_s = period_s;
        found = Some((gain, on, off));
        (hz_step, edge_step) = (0.4 * hz_step, 0.4 * edge_step);
        all = edges(&[on, off], edge_step);
    }
    let (gain, on, off) = found?;
    let from = from_s + on * every_s;
    let stretch = Span {
        from,
        to: from + phase(off - on) * every_s,
    };
    let on = Interval {
        stretch,
        every_s: Some(every_s),
    };
    // What comes again is there in each third as far as the fitted samples show it: a few damaged samples are in some cycles of some period.
    let third_s = span_s / 3.0;
    let thirds = [0, 1, 2].map(|third| {
        let from = from_s + third_s * f64::from(third);
        let to = if third == 2 { f64::INFINITY } else { from + third_s };
        Span { from, to }
    });
    let gains = folded.gains(on, &thirds)?;
    let expected: f64 = gains.iter().map(|[_, expected]| expected).sum();
    let is_in = |[own, expected_there]: &[f64; 2]| {
        *own > LEAST_PART * expected_there && *expected_there > LEAST_PART * expected / gains.len() as f64
    };
    let is_there = gains.iter().all(is_in);
    (gain > DOUBTED + price && is_there).then_some((on, gain - price))
}

/// Periods that are tried in so long a time, but one.
fn steps(span_s: f64) -> usize {
    ((1.0 / SHORTEST_S - FEWEST / span_s) * STEPS * span_s).max(0.0) as usize
}

/// \[nats\] the price of having looked at all periods and edges in so long a time.
pub fn price(span_s: f64) -> f64 {
    ((steps(span_s) * PHASES * PHASES).max(1) as f64).ln()
}

impl Folded<'_> {
    /// How much the phases of a period differ: the energy of their means.
    fn differ(&self, every_s: f64) -> f64 {
        let phase_of = |t_s: &f64| (phase(t_s / every_s) * PHASES as f64) as usize % PHASES;
        let phase_of: Vec<usize> = self.starts_s.iter().map(phase_of).collect();
        let of_channel = |channel: &Touched| -> f64 {
            let mut phases = [(0.0, 0.0); PHASES];
            for (row, left) in channel.frame.series.rows.iter().zip(channel.left(self.residual)) {
                let phase = &mut phases[phase_of[*row as usize]];
                phase.0 += left;
                phase.1 += 1.0;
            }
            phases
                .iter()
                .map(|(sum, count)| sum * sum / f64::max(*count, 1.0))
                .sum()
        };
        self.channels.iter().map(of_channel).sum()
    }

    /// The best stretch between two of these phases after `from_s`, and the nats it gains over always.
    fn best(&self, every_s: f64, from_s: f64, edges: &[f64]) -> Option<(f64, [f64; 2])> {
        let mut edges = edges.to_vec();
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let steps = self.steps(&edges, |t_s| phase((t_s - from_s) / every_s));
        let stretches = steps.explaining(&self.channels, self.residual, self.sigmas);
        let always = stretches.always().log_evidence()?;
        let pairs = (0..edges.len()).flat_map(|on| (0..edges.len()).map(move |off| (on, off)));
        let judged = pairs.filter(|(on, off)| on != off).filter_map(|(on, off)| {
            let gain = stretches.screen(on, off).log_evidence()? - always;
            Some((gain, [edges[on], edges[off]]))
        });
        judged.max_by(|one, other| one.0.total_cmp(&other.0))
    }

    fn steps(&self, edges: &[f64], order: impl Fn(f64) -> f64) -> Steps {
        Steps::at(&self.channels, self.sigmas.len(), edges, order)
    }

    /// \[nats\] what parameters that are fitted to all samples explain in each part of the time, and what they would if they were as large
    /// there.
    fn gains(&self, on: Interval, parts: &[Span]) -> Option<Vec<[f64; 2]>> {
        let cycle = |t_s: f64| f64::from(u8::from(!on.contains(t_s)));
        let steps = self.steps(&[0.0, 1.0], cycle);
        let stretch = steps
            .explaining(&self.channels, self.residual, self.sigmas)
            .screen(0, 1);
        let all: Vec<usize> = (0..self.sigmas.len()).collect();
        let theta = stretch.estimate(&all)?.parameters;
        let mut gains = vec![[0.0; 2]; parts.len()];
        for channel in &self.channels {
            let explained = channel.explained(&theta, |t_s| on.contains(t_s));
            let samples = channel
                .instants_s
                .iter()
                .zip(explained.iter().zip(channel.left(self.residual)));
            for (t_s, (explained, residual)) in samples {
                let expected = 0.5 * explained * explained;
                for (gain, _) in gains.iter_mut().zip(parts).filter(|(_, part)| part.contains(*t_s)) {
                    gain[0] += explained * residual - expected;
                    gain[1] += expected;
                }
            }
        }
        Some(gains)
    }
}
