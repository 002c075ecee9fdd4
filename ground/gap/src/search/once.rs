//! When an effect is on: a magnet that is brought and taken away, a heater that is switched on.
//!
//! In: an effect's slopes, and the residual without it. Out: the stretch of time in which it explains most, if that is much
//! better than always, and by how much. All stretches between [`EDGES`] instants are compared by their evidence
//! (a generalised likelihood ratio, Willsky and Jones 1976, with the prior's price); having compared them costs the logarithm
//! of their number. A stretch that reaches an end of the fit is open there. Only effects whose cause
//! [passes](twin::effect::Page::passes) have stretches.

use crate::{
    input::windows::Span,
    library::column::Entries,
    null::problem::Problem,
    search::interval_sums::{Residual, Steps, Stretches, Touched},
    thresholds::{DOUBTED, LEAST_PART},
};

/// Instants at which an effect may begin or end.
const EDGES: usize = 41;

/// Steps into which the distance to the next of them is parted, again and again, when the best two are known.
const FINE: i32 = 8;

/// \[nats\] the price of having looked at all stretches.
pub fn price() -> f64 {
    ((EDGES * (EDGES - 1) / 2) as f64).ln()
}

/// The channels that an effect touches, and its columns at the first instants tried: the same whatever the residual is.
pub struct Tried<'a> {
    touched: Vec<Touched<'a>>,
    sigmas: Vec<f64>,
    edges: Vec<f64>,
    steps: Steps,
}

impl<'a> Tried<'a> {
    /// Of an effect with these `slopes`, and prior sigmas of its parameters.
    pub fn of(problem: &'a Problem<'a>, slopes: &[Entries], sigmas: Vec<f64>) -> Self {
        let touched = Touched::all(problem, slopes);
        let starts_s = problem.twin.starts_s();
        let rows = problem.frames.iter().flat_map(|frame| &frame.series.rows);
        let (from_s, to_s) = rows.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), row| {
            let t_s = starts_s[*row as usize];
            (from.min(t_s), to.max(t_s))
        });
        let step_s = (to_s - from_s) / (EDGES - 1) as f64;
        let edges: Vec<f64> = (0..EDGES).map(|index| from_s + step_s * index as f64).collect();
        Tried {
            steps: Steps::at(&touched, sigmas.len(), &edges, |t_s| t_s),
            touched,
            sigmas,
            edges,
        }
    }

    fn at(&self, edges: &[f64]) -> Steps {
        Steps::at(&self.touched, self.sigmas.len(), edges, |t_s| t_s)
    }

    fn explaining<'s>(&self, steps: &'s Steps, residual: &Residual) -> Stretches<'s> {
        steps.explaining(&self.touched, residual, &self.sigmas)
    }

    /// \[nats\] that the effect gains by being on in one stretch of time only.
    pub fn over_always(&self, residual: &Residual, when: Span) -> Option<f64> {
        let steps = self.at(&[when.from, when.to]);
        let stretches = self.explaining(&steps, residual);
        Some(stretches.screen(0, 1).log_evidence()? - stretches.always().log_evidence()?)
    }

    /// The stretch of time in which the effect is on, and the nats it gains over always, the price of having looked taken off; `None` for
    /// always. The residual is without the effect.
    pub fn stretch(&self, problem: &Problem, residual: &Residual) -> Option<(Span, f64)> {
        let evidence = |stretches: &Stretches, from: usize, to: usize| -> f64 {
            (stretches.screen(from, to).log_evidence()).unwrap_or(f64::NEG_INFINITY)
        };
        let best = |steps: &Steps, edges: &[f64], is_tried: &dyn Fn(f64, f64) -> bool| -> Option<(f64, (f64, f64))> {
            let stretches = self.explaining(steps, residual);
            let pairs = (0..edges.len()).flat_map(|from| (from + 1..edges.len()).map(move |to| (from, to)));
            let tried = pairs.filter(|(from, to)| is_tried(edges[*from], edges[*to]));
            let judged = tried.map(|(from, to)| (evidence(&stretches, from, to), (edges[from], edges[to])));
            let always = evidence(&stretches, 0, edges.len() - 1);
            let (most, span) = judged.max_by(|one, other| one.0.total_cmp(&other.0))?;
            Some((most - always, span))
        };
        let (from_s, last_s) = (self.edges[0], self.edges[EDGES - 1]);
        let step_s = (last_s - from_s) / (EDGES - 1) as f64;
        let price = price();
        let (gain, (on_s, off_s)) = best(&self.steps, &self.edges, &|_, _| true)?;
        if gain <= DOUBTED + price || (on_s == from_s && off_s == last_s) {
            return None;
        }
        // Each edge nearer and nearer, down to a sample: one sample on the wrong side of a large step is an outlier.
        let sample_s = (last_s - from_s) / problem.twin.starts_s().len().max(1) as f64;
        let (mut most, mut on_s, mut off_s, mut step_s) = (gain, on_s, off_s, step_s);
        while step_s > sample_s {
            let is_near = |from: f64, to: f64| (from - on_s).abs() <= step_s && (to - off_s).abs() <= step_s;
            let inner = [on_s, off_s]
                .into_iter()
                .filter(|edge_s| *edge_s != from_s && *edge_s != last_s);
            let around =
                |edge_s: f64| (-FINE..=FINE).map(move |index| edge_s + step_s * f64::from(index) / f64::from(FINE));
            let mut fine: Vec<f64> = inner.flat_map(around).chain([from_s, last_s]).collect();
            fine.retain(|edge_s| (from_s..=last_s).contains(edge_s));
            fine.sort_by(f64::total_cmp);
            fine.dedup();
            let Some((finer, span)) = best(&self.at(&fine), &fine, &is_near).filter(|(finer, _)| *finer >= most) else {
                break;
            };
            (most, (on_s, off_s)) = (finer, span);
            step_s /= f64::from(FINE);
        }
        // One damaged sample is not something that was there for a while.
        let halves = self.at(&[on_s, 0.5 * (on_s + off_s), off_s]);
        let halves = self.explaining(&halves, residual);
        if evidence(&halves, 0, 1).min(evidence(&halves, 1, 2)) < LEAST_PART * evidence(&halves, 0, 2) {
            return None;
        }
        let span = Span {
            from: if on_s == from_s { f64::NEG_INFINITY } else { on_s },
            to: if off_s == last_s { f64::INFINITY } else { off_s },
        };
        Some((span, most - price))
    }
}
