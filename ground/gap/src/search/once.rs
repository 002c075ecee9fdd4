//! When an effect is on: a magnet that is brought and taken away, a heater that is switched on.
//!
//! In: an effect's slopes, and the residual without it. Out: the stretch of time in which it explains most, if that is much
//! better than always, and by how much. All stretches between [`EDGES`] instants are compared by their evidence
//! (a generalised likelihood ratio, Willsky and Jones 1976, with the prior's price); having compared them costs the logarithm
//! of their number. A stretch that reaches an end of the fit is open there. Only effects whose cause
//! [passes](twin::effect::Page::passes) have stretches.

use nalgebra::DVector;

use crate::{
    input::windows::Span,
    library::products::Entries,
    null::problem::Problem,
    search::interval_sums::{Piece, Touched},
    thresholds::{LEAST_PART, STRETCH_MARGIN},
};

/// Instants at which an effect may begin or end.
const EDGES: usize = 41;

/// Steps into which the distance to the next of them is parted, again and again, when the best two are known.
const FINE: i32 = 8;

/// The stretch of time in which the effect with these `slopes` is on, and the nats it gains over always, the price of having
/// looked taken off; `None` for always. `rest` is the residual of every channel without it.
pub fn stretch(problem: &Problem, rest: &[DVector<f64>], slopes: &[Entries], sigmas: &[f64]) -> Option<(Span, f64)> {
    let starts_s = problem.twin.starts_s();
    let rows = problem
        .frames
        .iter()
        .flat_map(|frame| &frame.series.rows)
        .map(|row| starts_s[*row as usize]);
    let (from_s, to_s) = rows.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), t| {
        (from.min(t), to.max(t))
    });
    let touched = Touched::all(problem, slopes, |channel| rest[channel].clone());
    let taken = touched.iter().map(|own| own.frame.open_part(&own.residual));
    let taken: Vec<DVector<f64>> = taken.collect();
    let sums = |edges: &[f64]| -> Vec<Piece> {
        let mut sums = vec![Piece::none(&touched, slopes.len())];
        for pair in edges.windows(2) {
            let span = Span {
                from: pair[0],
                to: pair[1],
            };
            let sum = piece(&touched, slopes.len(), starts_s, span);
            sums.push(sum.and(&sums[sums.len() - 1]));
        }
        sums
    };
    let evidence = |from: &Piece, to: &Piece| -> f64 {
        let screen = to.less(from).screen(&touched, sigmas, &taken);
        screen.log_evidence().unwrap_or(f64::NEG_INFINITY)
    };
    let best = |edges: &[f64], is_tried: &dyn Fn(f64, f64) -> bool| -> Option<(f64, (f64, f64))> {
        let sums = sums(edges);
        let pairs = (0..edges.len()).flat_map(|from| (from + 1..edges.len()).map(move |to| (from, to)));
        let tried = pairs.filter(|(from, to)| is_tried(edges[*from], edges[*to]));
        let judged = tried.map(|(from, to)| (evidence(&sums[from], &sums[to]), (edges[from], edges[to])));
        let always = evidence(&sums[0], &sums[edges.len() - 1]);
        let (most, span) = judged.max_by(|one, other| one.0.total_cmp(&other.0))?;
        Some((most - always, span))
    };
    let step_s = (to_s - from_s) / (EDGES - 1) as f64;
    let coarse: Vec<f64> = (0..EDGES).map(|index| from_s + step_s * index as f64).collect();
    let last_s = coarse[EDGES - 1];
    let price = ((EDGES * (EDGES - 1) / 2) as f64).ln();
    let (gain, (on_s, off_s)) = best(&coarse, &|_, _| true)?;
    if gain <= STRETCH_MARGIN + price || (on_s == from_s && off_s == last_s) {
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
        let Some((finer, span)) = best(&fine, &is_near).filter(|(finer, _)| *finer >= most) else {
            break;
        };
        (most, (on_s, off_s)) = (finer, span);
        step_s /= f64::from(FINE);
    }
    // One damaged sample is not something that was there for a while.
    let halves = sums(&[on_s, 0.5 * (on_s + off_s), off_s]);
    let whole = evidence(&halves[0], &halves[2]);
    if evidence(&halves[0], &halves[1]).min(evidence(&halves[1], &halves[2])) < LEAST_PART * whole {
        return None;
    }
    let span = Span {
        from: if on_s == from_s { f64::NEG_INFINITY } else { on_s },
        to: if off_s == last_s { f64::INFINITY } else { off_s },
    };
    Some((span, most - price))
}

/// What a stretch adds.
fn piece(touched: &[Touched], width: usize, starts_s: &[f64], span: Span) -> Piece {
    let mut piece = Piece::none(touched, width);
    for (at, own) in touched.iter().enumerate() {
        let rows = &own.frame.series.rows;
        // The rows of a stretch are consecutive, because rows rise with time.
        let place = |t_s: f64| rows.partition_point(|row| starts_s[*row as usize] < t_s);
        let samples: Vec<usize> = (place(span.from)..place(span.to)).collect();
        piece.add(at, own, &samples);
    }
    piece
}
