//! Inner products of columns with the calibration marginalised, each made when first asked for.
//!
//! In: columns in units of noise, channel by channel. Out: `e'P f` and `e'P r`. A screen needs each hypothesis' own products
//! and those with what is already chosen, which is a thousandth of all pairs of a library of two thousand columns.

use std::{
    borrow::Cow,
    sync::{Arc, Mutex, PoisonError},
};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    library::column::Column,
    null::{
        evidence::Screen,
        problem::{Frame, Problem},
    },
};

/// Columns that are taken from colour to colour together: what happens at a sample is then read once for all of them.
const BLOCK: usize = 32;

/// A column: for each channel it touches, its values in units of noise.
pub type Entries = Vec<(usize, DVector<f64>)>;

/// Columns and the products known so far.
#[derive(Debug, Default)]
pub struct Products {
    columns: Vec<Column>,
    /// For each column and channel `L^-1 N'e`, so that `e'P f = e'f - open_e'open_f`.
    open: Vec<Entries>,
    /// Of each column with itself and those before it, as far as they were asked for: a thousandth.
    known: Mutex<Vec<Vec<(usize, f64)>>>,
}

impl Clone for Products {
    fn clone(&self) -> Self {
        Self {
            columns: self.columns.clone(),
            open: self.open.clone(),
            known: Mutex::new(self.known.lock().unwrap_or_else(PoisonError::into_inner).clone()),
        }
    }
}

impl Products {
    /// Adds a column; returns its place.
    pub fn push(&mut self, problem: &Problem, column: Column) -> usize {
        self.open.push(open_part(problem, &column.entries()));
        self.columns.push(column);
        self.known_mut().push(Vec::new());
        self.columns.len() - 1
    }

    /// Adds columns.
    pub fn extend(&mut self, problem: &Problem, columns: Vec<Column>) {
        let open = columns.par_iter().map(|column| open_part(problem, &column.entries()));
        self.open.par_extend(open);
        self.columns.extend(columns);
        let count = self.columns.len();
        self.known_mut().resize_with(count, Vec::new);
    }

    /// Replaces a column.
    pub fn renew(&mut self, problem: &Problem, place: usize, column: Entries) {
        self.open[place] = open_part(problem, &column);
        self.columns[place] = Column::Held(column);
        let known = self.known_mut();
        known[place].clear();
        let after = known.iter_mut().skip(place);
        after.for_each(|row| row.retain(|(before, _)| *before != place));
    }

    fn known_mut(&mut self) -> &mut Vec<Vec<(usize, f64)>> {
        self.known.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// After the problem's frames were these.
    pub fn reframe(&mut self, problem: &Problem, before: &[Frame]) {
        if (problem.frames.iter().chain(before)).any(|frame| frame.colour.is_some()) {
            for column in &mut self.columns {
                *column = Column::Held(column.entries().into_owned());
            }
        }
        self.reframe_courses(problem, before);
        for (channel, (frame, before)) in problem.frames.iter().zip(before).enumerate() {
            let columns = self.columns.iter_mut().filter_map(|column| match column {
                Column::Held(entries) => Some(entries),
                Column::Carried(_) => None,
            });
            let own = columns.flatten().filter(|(of, _)| *of == channel);
            let own = own.map(|(_, values)| values);
            let mut own: Vec<&mut DVector<f64>> = own.collect();
            own.par_chunks_mut(BLOCK).for_each(|block| {
                let white = DMatrix::from_fn(frame.weights.len(), block.len(), |row, at| block[at][row]);
                let anew = frame.whites(before.physical(white));
                (block.iter_mut().zip(anew.column_iter())).for_each(|(own, anew)| own.copy_from(&anew));
            });
        }
        let columns = self.columns.par_iter();
        self.open = columns.map(|column| open_part(problem, &column.entries())).collect();
        self.known_mut().iter_mut().for_each(Vec::clear);
    }

    /// The same of what waves carry: a course that many columns have in common stays one.
    fn reframe_courses(&mut self, problem: &Problem, before: &[Frame]) {
        let mut renewed: Vec<(Arc<DVector<f64>>, Arc<DVector<f64>>)> = Vec::new();
        let carried = self.columns.iter_mut().filter_map(|column| match column {
            Column::Held(_) => None,
            Column::Carried(parts) => Some(parts),
        });
        for (channel, course, _) in carried.flatten() {
            let known = renewed.iter().find(|(old, _)| Arc::ptr_eq(old, course));
            let anew = known.map(|(_, anew)| Arc::clone(anew)).unwrap_or_else(|| {
                let physical = course.component_mul(&before[*channel].weights);
                let anew = Arc::new(problem.frames[*channel].white(physical));
                renewed.push((Arc::clone(course), Arc::clone(&anew)));
                anew
            });
            *course = anew;
        }
    }

    /// A column's values.
    pub fn column(&self, place: usize) -> Cow<'_, Entries> {
        self.columns[place].entries()
    }

    /// The same in one channel.
    pub fn values(&self, place: usize, channel: usize) -> Option<Cow<'_, DVector<f64>>> {
        self.columns[place].values(channel)
    }

    /// The channels that a column touches.
    pub fn channels(&self, place: usize) -> Vec<usize> {
        self.columns[place].channels()
    }

    /// Columns there are.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// `e'P f`.
    pub fn product(&self, one: usize, other: usize) -> f64 {
        let (before, after) = (one.min(other), one.max(other));
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, value)) = known()[after].iter().find(|(own, _)| *own == before) {
            return *value;
        }
        let value = self.columns[one].dot(&self.columns[other]) - inner(&self.open[one], &self.open[other]);
        let row = &mut known()[after];
        if row.iter().all(|(own, _)| *own != before) {
            row.push((before, value));
        }
        value
    }

    /// `e'P r` of every column, for one residual a channel.
    pub fn scores(&self, problem: &Problem, residuals: &[DVector<f64>]) -> Vec<f64> {
        let all: Entries = residuals.iter().cloned().enumerate().collect();
        let open = open_part(problem, &all);
        let score = |(column, own): (&Column, &Entries)| column.dot_entries(&all) - inner(own, &open);
        (self.columns.par_iter().zip(&self.open)).map(score).collect()
    }

    /// Normal equations of some columns.
    pub fn screen(&self, places: &[usize], scores: &[f64], prior_sigmas: &[f64]) -> Screen {
        let mut screen = Screen::zeros(places.iter().map(|place| prior_sigmas[*place]).collect());
        for (row, one) in places.iter().enumerate() {
            screen.score[row] = scores[*one];
            for (column, other) in places.iter().enumerate() {
                screen.information[(row, column)] = self.product(*one, *other);
            }
        }
        screen
    }
}

fn open_part(problem: &Problem, column: &Entries) -> Entries {
    column
        .iter()
        .map(|(channel, values)| (*channel, problem.frames[*channel].open_part(values)))
        .collect()
}

fn inner(one: &Entries, other: &Entries) -> f64 {
    let on = |channel: usize| other.iter().find(|(index, _)| *index == channel);
    one.iter()
        .filter_map(|(channel, values)| on(*channel).map(|(_, others)| values.dot(others)))
        .sum()
}
