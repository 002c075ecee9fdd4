//! When an effect is on: a magnet that is brought and taken away, a heater that is switched on.
//!
//! In: an effect found over the whole fit, its slopes, and the residual without it. Out: the stretch of time in which it
//! explains most, if that is much better than always. All stretches between [`EDGES`] instants are compared by their evidence
//! (a generalised likelihood ratio, Willsky and Jones 1976, with the prior's price); having compared them costs the logarithm
//! of their number. A stretch that reaches an end of the fit is open there. Only effects whose cause
//! [passes](twin::effect::Page::passes) have stretches.

use nalgebra::{DMatrix, DVector};

use crate::{
    evidence::Screen,
    library::Entries,
    problem::{Component, Problem},
    windows::Span,
};

/// Instants at which an effect may begin or end.
const EDGES: usize = 41;

/// [nats] a stretch must gain over always, beyond the price of having looked.
const MARGIN: f64 = 10.0;

/// Sums of one stretch: products of the columns, with the residual, and what the calibration can imitate.
struct Piece {
    information: DMatrix<f64>,
    score: DVector<f64>,
    open: Vec<DMatrix<f64>>,
}

/// The stretch of time in which the effect with these `slopes` is on; `None` for always. `others` is the model without it.
pub fn stretch(problem: &Problem, others: &[Component], slopes: &[Entries], sigmas: &[f64]) -> Option<Span> {
    let starts_s = problem.twin.starts_s();
    let rows = problem
        .frames
        .iter()
        .flat_map(|frame| &frame.series.rows)
        .map(|row| starts_s[*row as usize]);
    let (from_s, to_s) = rows.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), t| {
        (from.min(t), to.max(t))
    });
    let edge = |index: usize| from_s + (to_s - from_s) * index as f64 / (EDGES - 1) as f64;
    let touched: Vec<usize> = (0..problem.frames.len())
        .filter(|channel| {
            slopes
                .iter()
                .any(|entries| entries.iter().any(|(index, _)| index == channel))
        })
        .collect();
    let residuals: Vec<DVector<f64>> = touched
        .iter()
        .map(|channel| problem.residual(*channel, others))
        .collect();
    let open_residuals: Vec<DVector<f64>> = touched
        .iter()
        .zip(&residuals)
        .map(|(channel, residual)| problem.frames[*channel].open_part(residual))
        .collect();
    let pieces: Vec<Piece> = (0..EDGES - 1)
        .map(|index| {
            piece(
                problem,
                &touched,
                &residuals,
                slopes,
                Span {
                    from: edge(index),
                    to: edge(index + 1),
                },
            )
        })
        .collect();
    let evidence = |from: usize, to: usize| -> f64 {
        let mut screen = Screen::zeros(sigmas.to_vec());
        let mut open: Vec<DMatrix<f64>> = pieces[from].open.iter().map(|open| open * 0.0).collect();
        for piece in &pieces[from..to] {
            screen.information += &piece.information;
            screen.score += &piece.score;
            open.iter_mut().zip(&piece.open).for_each(|(sum, open)| *sum += open);
        }
        for (open, residual) in open.iter().zip(&open_residuals) {
            screen.information -= open.tr_mul(open);
            screen.score -= open.tr_mul(residual);
        }
        let all: Vec<usize> = (0..sigmas.len()).collect();
        screen
            .estimate(&all)
            .map_or(f64::NEG_INFINITY, |estimate| estimate.log_evidence)
    };
    let always = evidence(0, EDGES - 1);
    let stretches = (0..EDGES - 1).flat_map(|from| (from + 1..EDGES).map(move |to| (from, to)));
    let price = ((EDGES * (EDGES - 1) / 2) as f64).ln();
    let (gain, (from, to)) = stretches
        .map(|(from, to)| (evidence(from, to) - always, (from, to)))
        .max_by(|one, other| one.0.total_cmp(&other.0))?;
    let is_worth_it = gain > MARGIN + price && (from, to) != (0, EDGES - 1);
    is_worth_it.then(|| Span {
        from: if from == 0 { f64::NEG_INFINITY } else { edge(from) },
        to: if to == EDGES - 1 { f64::INFINITY } else { edge(to) },
    })
}

fn piece(problem: &Problem, touched: &[usize], residuals: &[DVector<f64>], slopes: &[Entries], span: Span) -> Piece {
    let starts_s = problem.twin.starts_s();
    let width = slopes.len();
    let mut piece = Piece {
        information: DMatrix::zeros(width, width),
        score: DVector::zeros(width),
        open: Vec::new(),
    };
    for (channel, residual) in touched.iter().zip(residuals) {
        let frame = &problem.frames[*channel];
        // The rows of a stretch are consecutive, because rows rise with time.
        let first = frame
            .series
            .rows
            .partition_point(|row| starts_s[*row as usize] < span.from);
        let last = frame
            .series
            .rows
            .partition_point(|row| starts_s[*row as usize] < span.to);
        let mut columns = DMatrix::zeros(last - first, width);
        for (place, entries) in slopes.iter().enumerate() {
            if let Some((_, values)) = entries.iter().find(|(index, _)| index == channel) {
                columns.set_column(place, &values.rows(first, last - first));
            }
        }
        piece.information += columns.tr_mul(&columns);
        piece.score += columns.tr_mul(&residual.rows(first, last - first));
        let mut open = frame.nuisance.rows(first, last - first).tr_mul(&columns);
        frame.solve_open(&mut open);
        piece.open.push(open);
    }
    piece
}
