//! The problem in the colour of what a model leaves, where the reference is not exact.
//!
//! In: the problem's frames, what a model leaves of each, how reference and field err slowly. Out: [`tinted`], frames in whose units a residual
//! and every column are white ([`Colour`]). The field's [`gradient`] is open in them beside the calibration. A thermometer keeps its frame: it
//! sees nothing of the motion.

use nalgebra::{DMatrix, DVector};
use twin::predict::Kind;

use crate::{
    input::case::SlowErrors,
    null::{
        colour::Colour,
        gradient,
        model::Model,
        problem::{Frame, Problem},
        wander::{of_states, processes, sees, zero_walk},
        whitening::{Process, places},
    },
};

/// The problem's frames, each in the colour of what `model` leaves of it.
pub fn tinted(problem: &Problem, model: &Model, errors: &SlowErrors) -> Vec<Frame> {
    let twin = problem.true_twin();
    let starts_s = twin.starts_s();
    let gradient = gradient::columns(twin, errors);
    let mut frames = problem.frames.clone();
    for (channel, frame) in frames.iter_mut().enumerate() {
        let own = &twin.unit().channels[channel];
        if own.sensor == Kind::Thermometer || frame.series.rows.is_empty() {
            continue;
        }
        let rows: Vec<usize> = frame.series.rows.iter().map(|row| *row as usize).collect();
        let of_channel = gradient.iter().filter_map(|column| {
            let (_, values) = column.entries.iter().find(|(of, _)| *of == channel)?;
            let fitted = rows.iter().map(|row| values[*row] * column.sigma);
            Some(frame.white(DVector::from_iterator(rows.len(), fitted)))
        });
        let open: Vec<DVector<f64>> = of_channel.collect();
        if !open.is_empty() {
            frame.widen(&DMatrix::from_columns(&open));
        }
        let shared = processes(errors);
        let shared = if own.sensor == Kind::Magnetometer {
            &shared[..]
        } else {
            &shared[..3]
        };
        let own_processes: Vec<Process> = shared.iter().copied().chain([zero_walk(own)]).collect();
        let (at, states) = places(&own_processes);
        let feels = twin.feels(channel);
        let seen: Vec<Vec<(usize, f64)>> = (rows.iter().zip(frame.weights.iter()))
            .map(|(row, weight)| {
                let slow = of_states(&sees(own, &feels[*row]), &at);
                let all = slow.into_iter().chain([(states - 1, 1.0)]);
                all.map(|(state, part)| (state, part / weight)).collect()
            })
            .collect();
        let times_s: Vec<f64> = rows.iter().map(|row| starts_s[*row]).collect();
        frame.tint(Colour::of(&model.fitted.rest[channel], &times_s, &own_processes, &seen));
    }
    frames
}
