//! Inner products of columns with the calibration marginalised, each made when first asked for.
//!
//! In: columns in units of noise, channel by channel. Out: `e'P f` and `e'P r`. A screen needs each hypothesis' own products
//! and those with what is already chosen, which is a thousandth of all pairs of a library of two thousand columns.

use std::{
    borrow::Cow,
    sync::{Mutex, PoisonError},
};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    library::column::{Column, Entries},
    null::{
        evidence::Screen,
        problem::{Frame, Problem},
    },
};

/// Columns that are taken from colour to colour together: what happens at a sample is then read once for all of them.
const BLOCK: usize = 32;

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
        self.open.push(open_part(problem, &column));
        self.columns.push(column);
        self.known_mut().push(Vec::new());
        self.columns.len() - 1
    }

    /// Adds columns.
    pub fn extend(&mut self, problem: &Problem, columns: Vec<Column>) {
        let open = columns.par_iter().map(|column| open_part(problem, column));
        self.open.par_extend(open);
        self.columns.extend(columns);
        let count = self.columns.len();
        self.known_mut().resize_with(count, Vec::new);
    }

    /// Replaces a column.
    pub fn renew(&mut self, problem: &Problem, place: usize, column: Entries) {
        let column = Column::of(column);
        self.open[place] = open_part(problem, &column);
        self.columns[place] = column;
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
        let is_coloured = |frame: &Frame| frame.colour.is_some();
        if problem.frames.iter().chain(before).any(is_coloured) {
            self.recolour(problem, before);
        } else {
            Column::reframe(&mut self.columns, problem, before);
        }
        let columns = self.columns.par_iter();
        self.open = columns.map(|column| open_part(problem, column)).collect();
        self.known_mut().iter_mut().for_each(Vec::clear);
    }

    /// Takes the columns from colour to colour.
    fn recolour(&mut self, problem: &Problem, before: &[Frame]) {
        let mut of_channels: Vec<Vec<&mut DVector<f64>>> = before.iter().map(|_| Vec::new()).collect();
        let columns = self.columns.iter_mut().flat_map(Column::whole);
        columns.for_each(|(channel, values)| of_channels[channel].push(values));
        for ((frame, before), mut own) in problem.frames.iter().zip(before).zip(of_channels) {
            own.par_chunks_mut(BLOCK).for_each(|block| {
                let white = DMatrix::from_fn(frame.weights.len(), block.len(), |row, at| block[at][row]);
                let anew = frame.whites(before.physical(white));
                (block.iter_mut().zip(anew.column_iter())).for_each(|(own, anew)| own.copy_from(&anew));
            });
        }
    }

    /// A column as the library holds it; [`Self::column`] copies its values.
    pub fn held(&self, place: usize) -> &Column {
        &self.columns[place]
    }

    /// A column's values.
    pub fn column(&self, place: usize) -> Entries {
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
        let own = |(channel, values): &(usize, DVector<f64>)| (*channel, problem.frames[*channel].open_part(values));
        let open: Entries = all.iter().map(own).collect();
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

fn open_part(problem: &Problem, column: &Column) -> Entries {
    let own = |channel: usize| Some((channel, problem.frames[channel].open_part(&*column.values(channel)?)));
    column.channels().into_iter().filter_map(own).collect()
}

fn inner(one: &Entries, other: &Entries) -> f64 {
    let on = |channel: usize| other.iter().find(|(index, _)| *index == channel);
    one.iter()
        .filter_map(|(channel, values)| on(*channel).map(|(_, others)| values.dot(others)))
        .sum()
}
