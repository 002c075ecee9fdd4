//! The fit windows as a least-squares problem: residuals and columns of every channel in units of its noise.
//!
//! In: the twin, the fit windows, how well the reference is known. Out: what [`crate::null::joint`] and
//! [`crate::null::evidence`] work on. What the twin predicts is compared at the rows that are there and that the reference
//! saw.
//!
//! A reference that is not exact (an optical system, a surveyed field) errs slowly: for what stands in n its error is taken for alike over
//! about [`REFERENCE_CORRELATION_S`], so a sample of it weighs as little as one a second would, however fast the log is. Its rate weighs as
//! the spectrum of the stated error has it. Its fast
//! errors are [`crate::input::reference`]'s and make some samples worth less than others. They are one vector that all sensors of a
//! kind see, and each channel is fitted by itself: what `n` channels share, each takes for `n` times its energy, so that together
//! they say no more of it than one.

mod frame;

use std::{collections::BTreeSet, sync::Arc};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use twin::{
    effect::{Active, Cause},
    predict::{Accuracy, Column, Kind, Memory, Twin},
};

pub use self::frame::Frame;
use crate::{
    input::{reference::Reference, windows::Fit},
    null::{
        calibration::{calibration, stamps},
        interval::Interval,
        joint::Columns,
    },
    thresholds::{REFERENCE_CORRELATION_S, REFERENCE_LIMITED},
};

/// An effect in a model: what, how large, and for effects that come and go, when.
#[derive(Clone, Debug)]
pub struct Component {
    /// What and how large.
    pub active: Active,
    /// When; `None` for always.
    pub span: Option<Interval>,
}

#[cfg(test)]
impl Component {
    /// An effect of the library, always there.
    pub(crate) fn always(effect: &str, locality: twin::effect::Locality, theta: &[f64]) -> Self {
        let cause = Cause {
            effect: twin::effect::by_name(effect).expect("in the library"),
            locality,
            variant: 0.0,
        };
        let theta = theta.to_vec();
        Component {
            active: Active { cause, theta },
            span: None,
        }
    }
}

/// The least-squares problem of a case.
pub struct Problem<'a> {
    /// The twin along the log.
    pub twin: &'a Twin,
    /// In the unit's channel order.
    pub frames: Vec<Frame>,
    /// Standard deviation of a sample as the nominal twin has it, reference included, channel by channel at every row of the
    /// log.
    pub sigmas: Vec<Vec<f64>>,
    /// The same without the errors that the reference makes from sample to sample, one a channel.
    pub steady: Vec<f64>,
    /// What the reference leaves open, common to several channels.
    pub reference: Vec<Column>,
    /// What told the truth.
    pub instrument: &'a Reference,
    /// The twin along what the unit truly did, where that is not what was told.
    retold: Option<Twin>,
    /// What is open of each channel.
    open: Vec<Vec<Column>>,
}

impl<'a> Problem<'a> {
    /// Sets it up.
    pub fn new(twin: &'a Twin, fit: &Fit, instrument: &'a Reference) -> Self {
        let accuracy = &instrument.accuracy;
        let starts_s = twin.starts_s();
        let steps = starts_s.len().saturating_sub(1).max(1) as f64;
        let rate_hz = steps / (starts_s.last().unwrap_or(&1.0) - starts_s.first().unwrap_or(&0.0)).max(f64::EPSILON);
        let (mut sigmas, mut steady) = (Vec::new(), Vec::new());
        let mut frames = Vec::new();
        for (index, (channel, series)) in twin.unit().channels.iter().zip(&fit.channels).enumerate() {
            let slow = Slow::of(twin, accuracy, channel.sensor);
            let alike = (rate_hz * slow.alike_s).max(1.0);
            let slow = slow.sigma;
            let fast = |row: usize| channel.sigma().hypot(instrument.fast_sigma(index, row));
            steady.push(channel.sigma().hypot(slow));
            sigmas.push((0..starts_s.len()).map(|row| fast(row).hypot(slow)).collect());
            let white = white_sigma(twin, instrument, index);
            let rows = series
                .rows
                .iter()
                .map(|row| white(*row as usize).hypot(slow * alike.sqrt()));
            let weights = DVector::from_iterator(series.rows.len(), rows);
            frames.push(Frame {
                quiet_energy: 0.0,
                factor: None,
                colour: None,
                series: series.clone(),
                own: weights.map(|weight| channel.sigma() / weight),
                weights,
                nuisance: DMatrix::zeros(series.rows.len(), 0).into(),
                nuisance_names: Vec::new(),
            });
        }
        let mut problem = Problem {
            twin,
            frames,
            sigmas,
            steady,
            reference: Vec::new(),
            instrument,
            retold: None,
            open: Vec::new(),
        };
        problem.open_all();
        problem
    }

    /// The twin along what the unit truly did, as far as that is known.
    pub fn true_twin(&self) -> &Twin {
        self.retold.as_ref().unwrap_or(self.twin)
    }

    /// What is open of a channel.
    pub fn open(&self, channel: usize) -> &[Column] {
        &self.open[channel]
    }

    /// Takes the motion for what it is with this cause: what the unit's calibration and the field leave open is open along
    /// that. Whether the cause is one that says so.
    pub fn retell(&mut self, cause: &Cause) -> bool {
        let Some(retold) = self.twin.retold(cause) else {
            return false;
        };
        self.retold = Some(retold);
        self.open_all();
        true
    }

    /// Makes the columns of what is open.
    fn open_all(&mut self) {
        let channels = 0..self.frames.len();
        self.open = channels
            .map(|channel| calibration(self.true_twin(), self.instrument, channel))
            .collect();
        for (frame, columns) in self.frames.iter_mut().zip(&self.open) {
            let nuisance = DMatrix::from_fn(frame.series.rows.len(), columns.len(), |row, column| {
                let column = &columns[column];
                column.entries[0].1[frame.series.rows[row] as usize] * column.sigma / frame.weights[row]
            });
            frame.nuisance = nuisance.into();
            frame.factorise();
            let names = columns.iter().map(|column| (column.name.clone(), column.sigma));
            frame.nuisance_names = names.collect();
        }
        self.reference = self.true_twin().field_columns(&self.instrument.accuracy);
        self.reference.extend(stamps(self.true_twin(), self.instrument));
        self.settle();
    }

    /// [physical unit] noise of a sample and the fast errors of the reference, without what is alike over many.
    pub fn white_sigma(&self, channel: usize, row: usize) -> f64 {
        white_sigma(self.twin, self.instrument, channel)(row)
    }

    /// The unit's own noise over what it scatters with the fast errors of the reference in, of a channel at a row.
    pub fn own_part(&self, channel: usize, row: usize) -> f64 {
        let own = self.twin.unit().channels[channel].sigma();
        let fast = self.instrument.fast_sigma(channel, row);
        if fast > 0.0 { own / own.hypot(fast) } else { 1.0 }
    }

    /// [physical unit^2] half the mean square by which what the reference errs slowly changes in a channel over so many seconds.
    pub fn slow_change(&self, channel: usize, over_s: f64) -> f64 {
        let slow = Slow::of(
            self.twin,
            &self.instrument.accuracy,
            self.twin.unit().channels[channel].sensor,
        );
        // One less the correlation, which begins as `2 t / alike` for both kinds of spectrum.
        slow.sigma.powi(2) * (2.0 * over_s / slow.alike_s).min(1.0)
    }

    /// Whether the reference errs more than a channel scatters by itself: how that scatters then says nothing.
    pub fn is_limited(&self, channel: usize) -> bool {
        let own = self.twin.unit().channels[channel].sigma();
        let sigmas = &self.sigmas[channel];
        let mean = sigmas.iter().map(|sigma| sigma * sigma).sum::<f64>() / sigmas.len().max(1) as f64;
        mean > REFERENCE_LIMITED * own * own
    }

    /// Residuals in units of noise as they are in standard deviations of a sample: what is alike over many samples counts for
    /// less in the fit than it scatters.
    pub fn in_sigmas(&self, channel: usize, residuals: &DVector<f64>) -> DVector<f64> {
        let frame = &self.frames[channel];
        let samples = residuals.iter().zip(frame.weights.iter()).zip(&frame.series.rows);
        let standard = samples.map(|((rest, weight), row)| rest * weight / self.sigmas[channel][*row as usize]);
        DVector::from_iterator(residuals.len(), standard)
    }

    /// Takes other frames for these: other weights, and other values.
    pub fn reframe(&mut self, frames: Vec<Frame>) {
        self.frames = frames;
        self.settle();
    }

    fn settle(&mut self) {
        for channel in 0..self.frames.len() {
            let residual = self.residual(channel, &[]);
            let frame = &mut self.frames[channel];
            frame.quiet_energy = frame.normal(&DMatrix::zeros(residual.len(), 0), &residual).energy;
        }
    }

    /// Readings of one channel at every row of the log.
    pub fn predict(&self, channel: usize, model: &[Component]) -> Vec<f64> {
        self.predict_with(channel, model, &mut Memory::default())
    }

    /// The same of every channel.
    pub fn predictions(&self, model: &[Component]) -> Vec<Vec<f64>> {
        self.each_channel(|channel, memory| self.predict_with(channel, model, memory))
    }

    /// Asks of every channel, on all cores, with what is kept from others of the same core.
    pub fn each_channel<T: Send>(&self, ask: impl Fn(usize, &mut Memory) -> T + Sync) -> Vec<T> {
        let channels: Vec<usize> = (0..self.frames.len()).collect();
        each(&channels, ask)
    }

    /// The same of one channel, with what is kept from others.
    fn predict_with(&self, channel: usize, model: &[Component], memory: &mut Memory) -> Vec<f64> {
        let (always, passing): (Vec<&Component>, Vec<&Component>) =
            model.iter().partition(|component| component.span.is_none());
        let always: Vec<Active> = always.into_iter().map(|component| component.active.clone()).collect();
        let base = self.twin.channel_with(channel, &always, memory).into_owned();
        let mut readings = base.clone();
        for component in passing {
            if !component.active.touches(channel, self.twin.unit()) {
                continue;
            }
            let mut with = always.clone();
            with.push(component.active.clone());
            let with = self.twin.channel_with(channel, &with, memory);
            for (row, start_s) in self.twin.starts_s().iter().enumerate() {
                if component.span.is_none_or(|span| span.contains(*start_s)) {
                    readings[row] += with[row] - base[row];
                }
            }
        }
        readings
    }

    /// Rows with a fitted sample, rising.
    pub fn fitted_rows(&self) -> Vec<usize> {
        let all = self.frames.iter().flat_map(|frame| &frame.series.rows);
        let mut rows: Vec<usize> = all.map(|row| *row as usize).collect();
        rows.sort_unstable();
        rows.dedup();
        rows
    }

    /// Readings of one channel at every row of the log; NaN where nothing was fitted.
    pub fn measured(&self, channel: usize) -> Vec<f64> {
        let series = &self.frames[channel].series;
        let mut rows = vec![f64::NAN; self.twin.starts_s().len()];
        (series.rows.iter().zip(&series.values)).for_each(|(row, value)| rows[*row as usize] = *value);
        rows
    }

    /// Measured minus predicted of one channel, in units of noise.
    pub fn residual(&self, channel: usize, model: &[Component]) -> DVector<f64> {
        self.residual_with(channel, model, &mut Memory::default())
    }

    /// The same of every channel.
    pub fn residuals(&self, model: &[Component]) -> Vec<DVector<f64>> {
        self.each_channel(|channel, memory| self.residual_with(channel, model, memory))
    }

    /// The same of one channel, with what is kept from others.
    pub fn residual_with(&self, channel: usize, model: &[Component], memory: &mut Memory) -> DVector<f64> {
        self.left_by(channel, &self.predict_with(channel, model, memory))
    }

    /// Measured minus these readings at every row of the log of one channel, in units of noise.
    pub fn left_by(&self, channel: usize, predicted: &[f64]) -> DVector<f64> {
        let frame = &self.frames[channel];
        let samples = frame.series.rows.iter().zip(&frame.series.values);
        let errors = samples.map(|(row, value)| value - predicted[*row as usize]);
        frame.white(DVector::from_iterator(frame.series.rows.len(), errors))
    }

    /// Places in a model of the parts of one effect that are one name with `model[of]`, which is among them: at several places with channels in
    /// common, such as what all plates share and what each has of its own. They are fitted together and mean nothing alone. One effect
    /// twice at one place is two events.
    pub fn parts(&self, model: &[Component], of: usize) -> Vec<usize> {
        let channels = |at: usize| model[at].active.cause.channels(self.twin.unit());
        let (own, place) = (&model[of].active.cause, channels(of));
        let is_part = |at: &usize| {
            let other = &model[*at].active.cause;
            let is_elsewhere = other.effect.page().name == own.effect.page().name && other.locality != own.locality;
            *at == of || is_elsewhere && channels(*at).iter().any(|channel| place.contains(channel))
        };
        (0..model.len()).filter(is_part).collect()
    }

    /// What parts of a model add to each channel they touch at every row, in physical units.
    pub fn added(&self, model: &[Component], of: &[usize]) -> Vec<(usize, Vec<f64>)> {
        let (own, others): (Vec<_>, Vec<_>) = model.iter().enumerate().partition(|(at, _)| of.contains(at));
        let others: Vec<Component> = others.into_iter().map(|(_, component)| component.clone()).collect();
        let touched = own
            .iter()
            .flat_map(|(_, component)| component.active.cause.channels(self.twin.unit()));
        let touched: BTreeSet<usize> = touched.collect();
        let difference = |channel: usize| {
            let pairs = self
                .predict(channel, model)
                .into_iter()
                .zip(self.predict(channel, &others));
            (channel, pairs.map(|(with, without)| with - without).collect())
        };
        touched.into_iter().map(difference).collect()
    }

    /// The same at the fitted samples, in units of noise.
    pub fn contribution(&self, model: &[Component], of: &[usize]) -> Vec<(usize, DVector<f64>)> {
        let fitted = |(channel, added): (usize, Vec<f64>)| {
            let frame = &self.frames[channel];
            let values = frame.series.rows.iter().map(|row| added[*row as usize]);
            (
                channel,
                frame.white(DVector::from_iterator(frame.series.rows.len(), values)),
            )
        };
        self.added(model, of).into_iter().map(fitted).collect()
    }

    /// What a channel's calibration still leaves open once it is fitted, in physical units at every row of the log: a row of
    /// the matrix for each direction, for one standard deviation.
    pub fn still_open(&self, channel: usize) -> DMatrix<f64> {
        let columns = self.open(channel);
        let mut open = DMatrix::from_fn(columns.len(), self.twin.starts_s().len(), |column, row| {
            columns[column].entries[0].1[row] * columns[column].sigma
        });
        self.frames[channel].solve_open(&mut open);
        open
    }

    /// Derivatives by the parameters of `model[of]`: for each parameter, the channels it touches, in units of noise.
    pub fn slopes(&self, model: &[Component], of: usize) -> Vec<Vec<(usize, DVector<f64>)>> {
        let span = model[of].span;
        let actives: Vec<Active> = model.iter().map(|component| component.active.clone()).collect();
        let cause = &actives[of].cause;
        let slopes = each(&cause.channels(self.twin.unit()), |channel, memory| {
            (channel, self.twin.slopes(&actives, of, channel, memory))
        });
        let columns = self.twin.columns(cause, slopes);
        columns.par_iter().map(|column| self.in_noise(column, span)).collect()
    }

    /// A column at the rows that are fitted, in units of noise.
    pub fn in_noise(&self, column: &Column, span: Option<Interval>) -> Vec<(usize, DVector<f64>)> {
        let starts_s = self.twin.starts_s();
        let at = |(channel, values): &(usize, Vec<f64>)| {
            let frame = &self.frames[*channel];
            let of_row = frame.series.rows.iter().map(|row| {
                let row = *row as usize;
                let is_on = span.is_none_or(|span| span.contains(starts_s[row]));
                if is_on { values[row] } else { 0.0 }
            });
            (
                *channel,
                frame.white(DVector::from_iterator(frame.series.rows.len(), of_row)),
            )
        };
        column.entries.iter().map(at).collect()
    }

    /// Columns of every channel for some parameters, given as [`Problem::slopes`] gives them.
    pub fn columns(&self, parameters: &[Vec<(usize, DVector<f64>)>]) -> Vec<Columns> {
        let empty = |frame: &Frame| Columns {
            nuisance: Arc::clone(&frame.nuisance),
            effects: DMatrix::zeros(frame.series.rows.len(), parameters.len()),
        };
        let mut columns: Vec<Columns> = self.frames.iter().map(empty).collect();
        for (place, entries) in parameters.iter().enumerate() {
            for (channel, values) in entries {
                columns[*channel].effects.set_column(place, values);
            }
        }
        columns
    }

    /// The reference's columns, in units of noise.
    pub fn reference_columns(&self) -> Vec<Vec<(usize, DVector<f64>)>> {
        self.reference
            .iter()
            .map(|column| self.in_noise(column, None))
            .collect()
    }
}

/// Asks of some channels on all cores. What is kept from one to the next is kept by neighbours, which are a sensor's axes, so a core has as
/// many as it can.
fn each<T: Send>(channels: &[usize], ask: impl Fn(usize, &mut Memory) -> T + Sync) -> Vec<T> {
    let share = channels.len().div_ceil(rayon::current_num_threads()).max(1);
    let asked = channels.par_iter().with_min_len(share);
    asked
        .map_init(Memory::default, |memory, channel| ask(*channel, memory))
        .collect()
}

/// What a reference that errs slowly puts into the readings of a kind of sensor.
struct Slow {
    /// Standard deviation, in physical units.
    sigma: f64,
    /// \[s\] the time for which one sample of it stands: the largest density of its spectrum, two-sided, over its variance.
    alike_s: f64,
}

impl Slow {
    fn of(twin: &Twin, accuracy: &Accuracy, kind: Kind) -> Self {
        let attitude = accuracy.attitude_sigma_rad;
        if kind == Kind::Gyro && attitude > 0.0 {
            // Its rate: of a Matern 3/2 error the variance is `3 s^2 / T^2`, and the density `4 l^3 s^2 w^2 / (l^2 + w^2)^2`, `l` being
            // `sqrt(3) / T`, at most `l s^2` (Rasmussen and Williams 2006, section 4.2).
            let per_s = 3f64.sqrt() / accuracy.attitude_correlation_s;
            return Slow {
                sigma: per_s * attitude,
                alike_s: per_s.recip(),
            };
        }
        let environment = twin.environment();
        let sigma = match kind {
            Kind::Accelerometer => environment.gravity * attitude,
            Kind::Magnetometer => (accuracy.field_sigma_ut).hypot(environment.field_n_ut.norm() * attitude),
            Kind::Gyro | Kind::Thermometer => 0.0,
        };
        Slow {
            sigma,
            alike_s: 2.0 * REFERENCE_CORRELATION_S,
        }
    }
}

/// Of a channel, by the row; what channels share counts once.
fn white_sigma<'a>(twin: &'a Twin, instrument: &'a Reference, index: usize) -> impl Fn(usize) -> f64 + 'a {
    let channels = &twin.unit().channels;
    let channel = &channels[index];
    let beside = channels.iter().filter(|own| own.sensor == channel.sensor);
    let sharing: f64 = beside.map(|own| own.axis_b.dot(&channel.axis_b).powi(2)).sum();
    move |row| (channel.sigma()).hypot(sharing.sqrt() * instrument.fast_sigma(index, row))
}

#[cfg(test)]
pub(crate) mod tumbling;

#[cfg(test)]
mod tests;
