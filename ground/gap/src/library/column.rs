//! A column of the library: held, or as a course of time times a wave that many columns have in common.
//!
//! In: columns in units of noise, channel by channel, or courses and a [`Wave`]. Out: values and inner products. A line of the mains is
//! looked for at a hundred frequencies in twelve channels: six columns a frequency, which are the same three courses times a sine and
//! a cosine. Held they were two thirds of the memory of an hour.
//!
//! Only columns that are taken for white can be carried: a colour makes of a product no product.

use std::{borrow::Cow, sync::Arc};

use nalgebra::DVector;
use twin::effect::{Active, Cause, Wave};

use crate::{library::products::Entries, null::problem::Problem};

/// A column.
#[derive(Clone, Debug)]
pub enum Column {
    /// Its values in each channel that it touches.
    Held(Entries),
    /// For each channel a course, and the wave that it is multiplied with.
    Carried(Vec<(usize, Arc<DVector<f64>>, Arc<DVector<f64>>)>),
}

impl Column {
    /// Its values.
    pub fn entries(&self) -> Cow<'_, Entries> {
        match self {
            Column::Held(entries) => Cow::Borrowed(entries),
            Column::Carried(parts) => {
                let own = |(channel, course, wave): &(usize, Arc<DVector<f64>>, Arc<DVector<f64>>)| {
                    (*channel, course.component_mul(wave))
                };
                Cow::Owned(parts.iter().map(own).collect())
            }
        }
    }

    /// The channels that it touches.
    pub fn channels(&self) -> Vec<usize> {
        match self {
            Column::Held(entries) => entries.iter().map(|(channel, _)| *channel).collect(),
            Column::Carried(parts) => parts.iter().map(|(channel, ..)| *channel).collect(),
        }
    }

    /// Its values in one channel.
    pub fn values(&self, channel: usize) -> Option<Cow<'_, DVector<f64>>> {
        match self {
            Column::Held(entries) => {
                let own = entries.iter().find(|(own, _)| *own == channel);
                own.map(|(_, values)| Cow::Borrowed(values))
            }
            Column::Carried(parts) => {
                let own = parts.iter().find(|(own, ..)| *own == channel);
                own.map(|(_, course, wave)| Cow::Owned(course.component_mul(wave)))
            }
        }
    }

    /// Inner product with another.
    pub fn dot(&self, other: &Column) -> f64 {
        match (self, other) {
            (Column::Carried(own), Column::Carried(others)) => {
                let on = |channel: usize| others.iter().find(|(other, ..)| *other == channel);
                let both = own.iter().filter_map(|(channel, course, wave)| {
                    let (_, other_course, other_wave) = on(*channel)?;
                    Some(product([course, wave, other_course, other_wave]))
                });
                both.sum()
            }
            (Column::Held(entries), carried) | (carried, Column::Held(entries)) => carried.dot_entries(entries),
        }
    }

    /// Inner product with values.
    pub fn dot_entries(&self, others: &Entries) -> f64 {
        let on = |channel: usize| others.iter().find(|(other, _)| *other == channel);
        match self {
            Column::Held(entries) => {
                let both = entries.iter().filter_map(|(channel, values)| {
                    let (_, others) = on(*channel)?;
                    Some(values.dot(others))
                });
                both.sum()
            }
            Column::Carried(parts) => {
                let both = parts.iter().filter_map(|(channel, course, wave)| {
                    let (_, others) = on(*channel)?;
                    Some(product([course, wave, others]))
                });
                both.sum()
            }
        }
    }
}

/// Sum over samples of the product of several series of one length.
fn product<const N: usize>(series: [&DVector<f64>; N]) -> f64 {
    /// Sums side by side: one by itself waits for every one of its additions.
    const LANES: usize = 8;
    let series = series.map(DVector::as_slice);
    let length = series[0].len();
    let mut chunks = series.map(|own| own[..length].chunks_exact(LANES));
    let mut sums = [0.0; LANES];
    for _ in 0..length / LANES {
        let mut products = [1.0; LANES];
        for own in chunks.iter_mut().filter_map(Iterator::next) {
            (products.iter_mut().zip(own)).for_each(|(product, value)| *product *= value);
        }
        (sums.iter_mut().zip(products)).for_each(|(sum, product)| *sum += product);
    }
    let last = length - length % LANES..length;
    let rest = last.map(|sample| series.iter().map(|own| own[sample]).product::<f64>());
    sums.iter().sum::<f64>() + rest.sum::<f64>()
}

/// Channels that feel a wave at the same instants, those of the samples that are fitted \[s\].
struct Group {
    slot_s: f64,
    instants_s: Vec<f64>,
}

/// What the waves of an effect carry.
pub struct Carrier {
    /// A course for each parameter of the first half, and its sigma: for each channel that it touches its group, and itself.
    courses: Vec<Vec<(usize, usize, Arc<DVector<f64>>)>>,
    sigmas: Vec<f64>,
    groups: Vec<Group>,
}

impl Carrier {
    /// Of a cause whose variants are waves; `None` where its columns have to be held.
    pub fn of(problem: &Problem, cause: &Cause) -> Option<Self> {
        cause.effect.wave(cause.variant)?;
        if problem.frames.iter().any(|frame| frame.colour.is_some()) {
            return None;
        }
        // Of no frequency: sines are zero, cosines one.
        let courses = Cause {
            variant: 0.0,
            ..cause.clone()
        };
        let width = courses.parameters(problem.twin.unit()).len();
        let zero = Active {
            cause: courses,
            theta: vec![0.0; width],
        };
        let columns = problem.twin.jacobian(&[zero], 0);
        let mut carrier = Self {
            courses: Vec::new(),
            sigmas: columns.iter().map(|column| column.sigma).collect(),
            groups: Vec::new(),
        };
        for column in columns.iter().skip(width / 2) {
            let mut parts = Vec::new();
            for (channel, course) in problem.in_noise(column, None) {
                parts.push((channel, carrier.group(problem, channel)?, Arc::new(course)));
            }
            carrier.courses.push(parts);
        }
        Some(carrier)
    }

    fn group(&mut self, problem: &Problem, channel: usize) -> Option<usize> {
        let slot_s = problem.twin.unit().channels[channel].slot_s;
        let seen_s = problem.twin.seen_s(channel)?;
        let rows = problem.frames[channel].series.rows.iter();
        let instants_s: Vec<f64> = rows.map(|row| seen_s[*row as usize]).collect();
        let is_it = |group: &Group| group.slot_s == slot_s && group.instants_s == instants_s;
        let known = self.groups.iter().position(is_it);
        Some(known.unwrap_or_else(|| {
            self.groups.push(Group { slot_s, instants_s });
            self.groups.len() - 1
        }))
    }

    /// The columns of a wave, each with the sigma of its parameter.
    pub fn columns(&self, wave: Wave) -> Vec<(Column, f64)> {
        let of_group = |group: &Group| {
            let instants_s = group.instants_s.iter();
            let (sines, cosines): (Vec<f64>, Vec<f64>) =
                instants_s.map(|t_s| wave.sine_cosine(*t_s, group.slot_s)).unzip();
            [sines, cosines].map(|values| Arc::new(DVector::from_vec(values)))
        };
        let waves: Vec<[Arc<DVector<f64>>; 2]> = self.groups.iter().map(of_group).collect();
        let half = |half: usize| {
            let waves = &waves;
            self.courses.iter().map(move |parts| {
                let parts = parts
                    .iter()
                    .map(|(channel, group, course)| (*channel, Arc::clone(course), Arc::clone(&waves[*group][half])));
                Column::Carried(parts.collect())
            })
        };
        half(0).chain(half(1)).zip(self.sigmas.iter().copied()).collect()
    }
}

#[cfg(test)]
mod tests;
