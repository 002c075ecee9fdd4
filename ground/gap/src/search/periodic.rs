//! When an effect is on that comes again and again: a transmitter with its beacon, a heater with its thermostat.
//!
//! In: an effect's slopes, and the residual without it. Out: the stretch of time that comes again in which it explains most,
//! and by how much more than always. Residuals are folded at each period tried, and the one in whose phases they differ most
//! is taken (epoch folding; Leahy et al. 1983); then all stretches of phases are compared by their evidence, finer and finer,
//! as [`crate::search::once`] does for one stretch. Having looked costs the logarithm of how many were compared.

use nalgebra::DVector;

use crate::{
    input::windows::Span,
    library::products::Entries,
    null::{
        evidence::Screen,
        interval::{Interval, phase},
        problem::Problem,
    },
    search::interval_sums::{Piece, Touched},
    thresholds::{LEAST_PART, STRETCH_MARGIN},
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

/// The residuals of the channels that an effect touches.
struct Folded<'a> {
    /// \[s\] instants of the rows of the log.
    starts_s: &'a [f64],
    channels: Vec<Touched<'a>>,
    sigmas: &'a [f64],
}

/// The stretch that comes again in which the effect with these `slopes` is on, and the nats it gains over always; `None` for
/// none that is much better. `rest` is the residual of every channel without it.
pub fn again(problem: &Problem, rest: &[DVector<f64>], slopes: &[Entries], sigmas: &[f64]) -> Option<(Interval, f64)> {
    let folded = Folded::new(problem, rest, slopes, sigmas);
    let instants = folded.channels.iter().flat_map(|channel| folded.instants_s(channel));
    let (from_s, to_s) = instants.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), t_s| {
        (from.min(t_s), to.max(t_s))
    });
    let span_s = to_s - from_s;
    let (least_hz, most_hz) = (FEWEST / span_s, 1.0 / SHORTEST_S);
    if !(span_s.is_finite() && least_hz < most_hz) {
        return None;
    }
    let step_hz = 1.0 / (STEPS * span_s);
    let steps = ((most_hz - least_hz) / step_hz) as usize;
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
    let (mut found, mut hz_step, mut edge_step) = (None, 0.5 * step_hz, 1.0 / PHASES as f64);
    for _ in 0..ROUNDS {
        let tried = (-2..=2).map(|index| 1.0 / (1.0 / every_s + hz_step * f64::from(index)));
        let best = tried.filter_map(|every_s| folded.best(every_s, from_s, &all).map(|best| (best, every_s)));
        let ((gain, [on, off]), period_s) = best.max_by(|one, other| one.0.0.total_cmp(&other.0.0))?;
        every_s = period_s;
        found = Some((gain, on, off));
        (hz_step, edge_step) = (0.4 * hz_step, 0.4 * edge_step);
        all = edges(&[on, off], edge_step);
    }
    let (gain, on, off) = found?;
    let price = ((steps * PHASES * PHASES) as f64).ln();
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
    let parts = (0..3).map(|third| {
        let from = from_s + third_s * f64::from(third);
        let to = if third == 2 { f64::INFINITY } else { from + third_s };
        folded.within(on, Span { from, to })
    });
    let gains = folded.gains(parts.collect())?;
    let expected: f64 = gains.iter().map(|[_, expected]| expected).sum();
    let is_in = |[own, expected_there]: &[f64; 2]| {
        *own > LEAST_PART * expected_there && *expected_there > LEAST_PART * expected / gains.len() as f64
    };
    let is_there = gains.iter().all(is_in);
    (gain > STRETCH_MARGIN + price && is_there).then_some((on, gain - price))
}

impl<'a> Folded<'a> {
    fn new(problem: &'a Problem<'a>, rest: &[DVector<f64>], slopes: &[Entries], sigmas: &'a [f64]) -> Self {
        // What the calibration leaves of it.
        let left = |channel: usize| problem.frames[channel].left(&rest[channel]);
        Folded {
            starts_s: problem.twin.starts_s(),
            channels: Touched::all(problem, slopes, left),
            sigmas,
        }
    }

    /// \[s\] instants of a channel's samples.
    fn instants_s(&self, channel: &Touched) -> impl Iterator<Item = f64> {
        let rows = channel.frame.series.rows.iter();
        rows.map(|row| self.starts_s[*row as usize])
    }

    /// How much the phases of a period differ: the energy of their means.
    fn differ(&self, every_s: f64) -> f64 {
        let phase_of = |t_s: &f64| (phase(t_s / every_s) * PHASES as f64) as usize % PHASES;
        let phase_of: Vec<usize> = self.starts_s.iter().map(phase_of).collect();
        let of_channel = |channel: &Touched| -> f64 {
            let mut phases = [(0.0, 0.0); PHASES];
            for (row, left) in channel.frame.series.rows.iter().zip(channel.residual.iter()) {
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
        let pieces = self.pieces(every_s, from_s, &edges);
        let whole = pieces.iter().fold(self.none(), |sum, piece| sum.and(piece));
        let always = self.evidence(&whole);
        let mut best: Option<(f64, [f64; 2])> = None;
        for on in 0..edges.len() {
            let mut sum = self.none();
            for length in 1..edges.len() {
                sum = sum.and(&pieces[(on + length - 1) % edges.len()]);
                let gain = self.evidence(&sum) - always;
                if best.is_none_or(|(most, _)| gain > most) {
                    best = Some((gain, [edges[on], edges[(on + length) % edges.len()]]));
                }
            }
        }
        best
    }

    fn none(&self) -> Piece {
        Piece::none(&self.channels, self.sigmas.len())
    }

    /// Sums between each phase and the next.
    fn pieces(&self, every_s: f64, from_s: f64, edges: &[f64]) -> Vec<Piece> {
        let mut pieces: Vec<Piece> = edges.iter().map(|_| self.none()).collect();
        for (at, channel) in self.channels.iter().enumerate() {
            let mut samples: Vec<Vec<usize>> = vec![Vec::new(); edges.len()];
            for (sample, t_s) in self.instants_s(channel).enumerate() {
                let phase = phase((t_s - from_s) / every_s);
                let piece = edges.partition_point(|edge| *edge <= phase);
                samples[(piece + edges.len() - 1) % edges.len()].push(sample);
            }
            for (piece, samples) in pieces.iter_mut().zip(samples) {
                piece.add(at, channel, &samples);
            }
        }
        pieces
    }

    /// What is there while it is on, in a part of the time.
    fn within(&self, on: Interval, part: Span) -> Screen {
        let mut piece = self.none();
        for (at, channel) in self.channels.iter().enumerate() {
            let is_in = |(_, t_s): &(usize, f64)| on.contains(*t_s) && part.contains(*t_s);
            let samples = self.instants_s(channel).enumerate().filter(is_in);
            let samples: Vec<usize> = samples.map(|(sample, _)| sample).collect();
            piece.add(at, channel, &samples);
        }
        self.screen(&piece)
    }

    /// \[nats\] what parameters that are fitted to some parts together explain of each, and what they would if they were as large there.
    fn gains(&self, parts: Vec<Screen>) -> Option<Vec<[f64; 2]>> {
        let mut whole = Screen::zeros(self.sigmas.to_vec());
        for part in &parts {
            whole.information += &part.information;
            whole.score += &part.score;
        }
        let all: Vec<usize> = (0..self.sigmas.len()).collect();
        let theta = whole.estimate(&all)?.parameters;
        let gains = parts.iter().map(|part| {
            let expected = 0.5 * theta.dot(&(&part.information * &theta));
            [theta.dot(&part.score) - expected, expected]
        });
        Some(gains.collect())
    }

    fn evidence(&self, piece: &Piece) -> f64 {
        self.screen(piece).log_evidence().unwrap_or(f64::NEG_INFINITY)
    }

    fn screen(&self, piece: &Piece) -> Screen {
        piece.screen(&self.channels, self.sigmas, &[])
    }
}
