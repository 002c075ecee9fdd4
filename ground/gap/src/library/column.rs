//! A column of the library: held from where it is not zero, or as a course of time times a wave that many columns have in common.
//!
//! In: columns in units of noise, channel by channel, or courses and a [`Wave`]. Out: values and inner products. A line of the mains is
//! looked for at a hundred frequencies in twelve channels: six columns a frequency, which are the same three courses times a sine and
//! a cosine. What begins at one of fifteen instants is zero before, and all zero where that is after the fit windows. Held as a whole both
//! were four fifths of the library of an hour.
//!
//! Only columns that are taken for white can be so: a colour makes of a product no product, and of zeros no zeros.

use std::{borrow::Cow, sync::Arc};

use nalgebra::DVector;
use twin::effect::{Active, Cause, Wave};

use crate::null::problem::{Frame, Problem};

/// A column: for each channel it touches, its values in units of noise.
pub type Entries = Vec<(usize, DVector<f64>)>;

/// A course or a wave, which many columns have in common.
type Series = Arc<DVector<f64>>;

/// A column: for each channel that it touches its values.
#[derive(Clone, Debug)]
pub struct Column(Vec<(usize, Part)>);

/// Values of one channel.
#[derive(Clone, Debug)]
enum Part {
    /// From this sample on; zero before.
    Held(usize, DVector<f64>),
    /// A course, and the wave that it is multiplied with.
    Carried(Series, Series),
}

/// Samples before which zeros are not left out: inner products sum so many side by side, and in the same order with them and without.
const LANES: usize = 8;

impl Part {
    /// These values.
    fn of(values: DVector<f64>) -> Self {
        let zeros = values.iter().take_while(|value| **value == 0.0).count();
        let first = zeros - zeros % LANES;
        // Another half would take as long to move as it saves.
        match 2 * first > values.len() {
            true => Part::Held(first, values.rows(first, values.len() - first).into_owned()),
            false => Part::Held(0, values),
        }
    }

    fn values(&self) -> Cow<'_, DVector<f64>> {
        match self {
            Part::Held(0, values) => Cow::Borrowed(values),
            Part::Held(first, values) => {
                let mut all = DVector::zeros(first + values.len());
                all.rows_mut(*first, values.len()).copy_from(values);
                Cow::Owned(all)
            }
            Part::Carried(course, wave) => Cow::Owned(course.component_mul(wave)),
        }
    }

    fn dot(&self, other: &Part) -> f64 {
        match (self, other) {
            (Part::Held(first, values), Part::Held(other_first, others)) => {
                let from = *first.max(other_first);
                let [own, others] = [(first, values), (other_first, others)].map(|(first, values)| {
                    let skipped = from - first;
                    values.rows(skipped, values.len() - skipped)
                });
                own.dot(&others)
            }
            (Part::Held(first, values), Part::Carried(course, wave))
            | (Part::Carried(course, wave), Part::Held(first, values)) => {
                let [course, wave] = [course, wave].map(|own| &own.as_slice()[*first..]);
                product([course, wave, values.as_slice()])
            }
            (Part::Carried(course, wave), Part::Carried(other_course, other_wave)) => {
                product([course, wave, other_course, other_wave].map(|own| own.as_slice()))
            }
        }
    }

    fn dot_values(&self, others: &DVector<f64>) -> f64 {
        match self {
            Part::Held(first, values) => values.dot(&others.rows(*first, values.len())),
            Part::Carried(course, wave) => product([course.as_slice(), wave.as_slice(), others.as_slice()]),
        }
    }
}

impl Column {
    /// These values.
    pub fn of(entries: Entries) -> Self {
        let part = |(channel, values)| (channel, Part::of(values));
        Self(entries.into_iter().map(part).collect())
    }

    /// Its values.
    pub fn entries(&self) -> Entries {
        let own = self.0.iter();
        own.map(|(channel, part)| (*channel, part.values().into_owned()))
            .collect()
    }

    /// The channels that it touches.
    pub fn channels(&self) -> Vec<usize> {
        self.0.iter().map(|(channel, _)| *channel).collect()
    }

    /// Its values in one channel.
    pub fn values(&self, channel: usize) -> Option<Cow<'_, DVector<f64>>> {
        let own = self.0.iter().find(|(own, _)| *own == channel);
        own.map(|(_, part)| part.values())
    }

    /// Inner product with another.
    pub fn dot(&self, other: &Column) -> f64 {
        let on = |channel: usize| other.0.iter().find(|(other, _)| *other == channel);
        let both = self
            .0
            .iter()
            .filter_map(|(channel, part)| Some(part.dot(&on(*channel)?.1)));
        both.sum()
    }

    /// Inner product with values.
    pub fn dot_entries(&self, others: &Entries) -> f64 {
        let on = |channel: usize| others.iter().find(|(other, _)| *other == channel);
        let both = (self.0.iter()).filter_map(|(channel, part)| Some(part.dot_values(&on(*channel)?.1)));
        both.sum()
    }

    /// What these columns are after the problem's frames were others. A course that many have in common stays one.
    pub fn reframe(columns: &mut [Column], problem: &Problem, before: &[Frame]) {
        let mut renewed: Vec<(Series, Series)> = Vec::new();
        for (channel, part) in columns.iter_mut().flat_map(|column| &mut column.0) {
            let (frame, before) = (&problem.frames[*channel], &before[*channel]);
            match part {
                Part::Held(first, values) => {
                    let [from, to] = [before, frame].map(|frame| frame.weights.rows(*first, values.len()));
                    values.component_mul_assign(&from);
                    values.component_div_assign(&to);
                }
                Part::Carried(course, _) => {
                    let known = renewed.iter().find(|(old, _)| Arc::ptr_eq(old, course));
                    let anew = known.map(|(_, anew)| Arc::clone(anew)).unwrap_or_else(|| {
                        let physical = course.component_mul(&before.weights);
                        let anew = Arc::new(physical.component_div(&frame.weights));
                        renewed.push((Arc::clone(course), Arc::clone(&anew)));
                        anew
                    });
                    *course = anew;
                }
            }
        }
    }

    /// All of its values, one vector a channel, to be changed.
    pub fn whole(&mut self) -> impl Iterator<Item = (usize, &mut DVector<f64>)> {
        for (_, part) in &mut self.0 {
            if !matches!(part, Part::Held(0, _)) {
                *part = Part::Held(0, part.values().into_owned());
            }
        }
        self.0.iter_mut().filter_map(|(channel, part)| match part {
            Part::Held(_, values) => Some((*channel, values)),
            Part::Carried(..) => None,
        })
    }
}

/// Sum over samples of the product of several series of one length.
fn product<const N: usize>(series: [&[f64]; N]) -> f64 {
    let length = series[0].len();
    let mut chunks = series.map(|own| own[..length].chunks_exact(LANES));
    // A sum by itself waits for every one of its additions.
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

/// The course of one parameter in a channel, which is of a group.
struct Course {
    channel: usize,
    group: usize,
    values: Series,
}

/// What the waves of an effect carry.
pub struct Carrier {
    /// For each parameter of the first half, in each channel that it touches.
    courses: Vec<Vec<Course>>,
    /// Of each parameter.
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
            for (channel, values) in problem.in_noise(column, None) {
                parts.push(Course {
                    channel,
                    group: carrier.group(problem, channel)?,
                    values: Arc::new(values),
                });
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
        let waves: Vec<[Series; 2]> = self.groups.iter().map(of_group).collect();
        let half = |half: usize| {
            let waves = &waves;
            let part = move |own: &Course| {
                let wave = Arc::clone(&waves[own.group][half]);
                (own.channel, Part::Carried(Arc::clone(&own.values), wave))
            };
            (self.courses.iter()).map(move |parts| Column(parts.iter().map(part).collect()))
        };
        half(0).chain(half(1)).zip(self.sigmas.iter().copied()).collect()
    }
}

#[cfg(test)]
mod tests;
