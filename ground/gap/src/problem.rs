//! The fit windows as a least-squares problem: residuals and columns of every channel in units of its noise.
//!
//! In: the twin, the fit windows, how well the reference is known. Out: what [`crate::joint`] and [`crate::evidence`] work
//! on. What the twin predicts is compared at the rows that are there and that the reference saw.
//!
//! A reference that is not exact (an optical system, a surveyed field) errs slowly: its error is alike over about
//! [`REFERENCE_CORRELATION_S`], so a sample of it weighs as little as one a second would, however fast the log is.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use twin::{
    effect::Active,
    predict::{Accuracy, Channel, Column, Kind, Twin},
};

use crate::{
    gram::Normal,
    joint::Columns,
    log::Series,
    windows::{Fit, Span},
};

/// [s] over which the error of a reference, or of a field that is not uniform, stays alike: a hand moves half a metre
/// in it.
pub const REFERENCE_CORRELATION_S: f64 = 1.0;

/// [s] between a gyro's conversions, by its own clock (ADIS16265 data sheet, table 1).
const GYRO_PERIOD_S: f64 = 1.0 / 256.0;

/// [s] between a thermometer's, by its own clock (TMP102, SBOS397).
const THERMOMETER_PERIOD_S: f64 = 0.25;

/// [s] between the conversions of a channel's part by its own clock; 0 where it has none that is known of. A reading is up
/// to half of it older or younger than described, and that evenly, so a stated sigma is a period over the root of 12.
pub fn conversion_period_s(channel: &Channel) -> f64 {
    let stated = channel.instant_sigma_s.map(|sigma_s| sigma_s * 12f64.sqrt());
    stated.unwrap_or(match channel.sensor {
        Kind::Gyro => GYRO_PERIOD_S,
        Kind::Thermometer => THERMOMETER_PERIOD_S,
        Kind::Accelerometer | Kind::Magnetometer => 0.0,
    })
}

/// [s] how well the instant of a channel is known: as its description says, or as its part lets anyone know it. A
/// thermometer is described as read at once, and is up to a whole period older.
pub fn instant_sigma_s(channel: &Channel) -> f64 {
    let spread = match (channel.sensor, channel.instant_sigma_s) {
        (Kind::Thermometer, None) => 3f64.sqrt(),
        _ => 12f64.sqrt(),
    };
    conversion_period_s(channel) / spread
}

/// What the calibration leaves open in one channel: its own, and the instant at which it is read. Where the description says
/// that its part has a clock of its own, this instant drifts too.
pub fn calibration(twin: &Twin, index: usize) -> Vec<Column> {
    let mut columns = twin.calibration(index);
    let channel = &twin.unit().channels[index];
    let sigma = instant_sigma_s(channel);
    if sigma <= 0.0 {
        return columns;
    }
    let slope = twin.by_instant(index);
    let starts_s = twin.starts_s();
    let (first, last) = (starts_s.first().unwrap_or(&0.0), starts_s.last().unwrap_or(&0.0));
    let (middle, half) = (0.5 * (last + first), (0.5 * (last - first)).max(f64::MIN_POSITIVE));
    let drifting = || {
        slope
            .iter()
            .zip(starts_s)
            .map(|(slope, t_s)| slope * (t_s - middle) / half)
    };
    let drift = channel.instant_sigma_s.map(|_| ("instant_drift", drifting().collect()));
    let shapes = [("instant", slope.clone())].into_iter().chain(drift);
    columns.extend(shapes.map(|(name, values)| Column {
        name: format!("{name}_{}", channel.name),
        sigma,
        entries: vec![(index, values)],
    }));
    columns
}

/// An effect in a model: what, how large, and for effects that come and go, when.
#[derive(Clone, Debug)]
pub struct Component {
    /// What and how large.
    pub active: Active,
    /// When; `None` for always.
    pub span: Option<Span>,
}

/// One channel of the fit windows.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Its samples.
    pub series: Series,
    /// Physical units a unit of noise in the fit.
    pub weight_sigma: f64,
    /// What the calibration leaves open, in units of noise for one prior sigma.
    pub nuisance: DMatrix<f64>,
    /// Names and prior sigmas of those columns.
    pub nuisance_names: Vec<(String, f64)>,
    /// `r'Pr` with no effect in.
    pub quiet_energy: f64,
    factor: Option<Cholesky<f64, Dyn>>,
}

impl Frame {
    /// `L^-1 N'x`: what the calibration can imitate of a column.
    pub fn open_part(&self, column: &DVector<f64>) -> DVector<f64> {
        let mut open = DMatrix::from_columns(&[self.nuisance.tr_mul(column)]);
        self.solve_open(&mut open);
        open.column(0).into_owned()
    }

    /// `N'x` to `L^-1 N'x`, in place.
    pub fn solve_open(&self, open: &mut DMatrix<f64>) {
        match &self.factor {
            Some(factor) => {
                factor.l_dirty().solve_lower_triangular_mut(open);
            }
            None => open.fill(0.0),
        }
    }

    /// Weighs its samples anew: the noise is `factor` times what it was taken for.
    pub fn reweigh(&mut self, factor: f64) {
        self.weight_sigma *= factor;
        self.nuisance /= factor;
        let open = self.nuisance.ncols();
        self.factor = Cholesky::new(DMatrix::identity(open, open) + self.nuisance.tr_mul(&self.nuisance));
    }

    /// Normal equations of some columns with the calibration marginalised.
    pub fn normal(&self, effects: &DMatrix<f64>, residual: &DVector<f64>) -> Normal {
        Normal::marginal(&self.nuisance, self.factor.as_ref(), effects, residual)
    }
}

/// The least-squares problem of a case.
pub struct Problem<'a> {
    /// The twin along the log.
    pub twin: &'a Twin,
    /// In the unit's channel order.
    pub frames: Vec<Frame>,
    /// Standard deviation of a sample as the nominal twin has it, reference included, in the unit's channel order.
    pub sigmas: Vec<f64>,
    /// What the reference leaves open, common to several channels.
    pub reference: Vec<Column>,
}

impl<'a> Problem<'a> {
    /// Sets it up.
    pub fn new(twin: &'a Twin, fit: &Fit, accuracy: &Accuracy) -> Self {
        let starts_s = twin.starts_s();
        let steps = starts_s.len().saturating_sub(1).max(1) as f64;
        let rate_hz = steps / (starts_s.last().unwrap_or(&1.0) - starts_s.first().unwrap_or(&0.0)).max(f64::EPSILON);
        let alike = (2.0 * REFERENCE_CORRELATION_S * rate_hz).max(1.0);
        let mut sigmas = Vec::new();
        let mut frames = Vec::new();
        for (index, (channel, series)) in twin.unit().channels.iter().zip(&fit.channels).enumerate() {
            let reference = match channel.sensor {
                Kind::Accelerometer => twin.environment().gravity * accuracy.attitude_sigma_rad,
                Kind::Magnetometer => accuracy
                    .field_sigma_ut
                    .hypot(twin.environment().field_n_ut.norm() * accuracy.attitude_sigma_rad),
                Kind::Gyro | Kind::Thermometer => 0.0,
            };
            sigmas.push(channel.sigma().hypot(reference));
            let weight_sigma = channel.sigma().hypot(reference * alike.sqrt());
            let columns = calibration(twin, index);
            let nuisance = DMatrix::from_fn(series.rows.len(), columns.len(), |row, column| {
                let column = &columns[column];
                column.entries[0].1[series.rows[row] as usize] * column.sigma / weight_sigma
            });
            let open = nuisance.ncols();
            frames.push(Frame {
                quiet_energy: 0.0,
                factor: Cholesky::new(DMatrix::identity(open, open) + nuisance.tr_mul(&nuisance)),
                series: series.clone(),
                weight_sigma,
                nuisance,
                nuisance_names: columns.into_iter().map(|column| (column.name, column.sigma)).collect(),
            });
        }
        let mut problem = Problem {
            twin,
            frames,
            sigmas,
            reference: twin.field_columns(accuracy),
        };
        problem.settle();
        problem
    }

    /// Weighs channels anew by these factors of their noise.
    pub fn reweigh(&mut self, factors: &[f64]) {
        for (frame, factor) in self.frames.iter_mut().zip(factors) {
            if *factor != 1.0 {
                frame.reweigh(*factor);
            }
        }
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
        let (always, passing): (Vec<&Component>, Vec<&Component>) =
            model.iter().partition(|component| component.span.is_none());
        let always: Vec<Active> = always.into_iter().map(|component| component.active.clone()).collect();
        let base = self.twin.channel(channel, &always).into_owned();
        let mut readings = base.clone();
        for component in passing {
            if !component.active.touches(channel, self.twin.unit()) {
                continue;
            }
            let mut with = always.clone();
            with.push(component.active.clone());
            let with = self.twin.channel(channel, &with);
            for (row, start_s) in self.twin.starts_s().iter().enumerate() {
                if component.span.is_none_or(|span| span.contains(*start_s)) {
                    readings[row] += with[row] - base[row];
                }
            }
        }
        readings
    }

    /// Measured minus predicted of one channel, in units of noise.
    pub fn residual(&self, channel: usize, model: &[Component]) -> DVector<f64> {
        let predicted = self.predict(channel, model);
        let frame = &self.frames[channel];
        let pairs = frame.series.rows.iter().zip(&frame.series.values);
        let errors = pairs.map(|(row, value)| (value - predicted[*row as usize]) / frame.weight_sigma);
        DVector::from_iterator(frame.series.rows.len(), errors)
    }

    /// What `model[of]` adds to each channel it touches at every row, in physical units.
    pub fn added(&self, model: &[Component], of: usize) -> Vec<(usize, Vec<f64>)> {
        let mut others = model.to_vec();
        let own = others.remove(of);
        let difference = |channel: usize| {
            let pairs = self
                .predict(channel, model)
                .into_iter()
                .zip(self.predict(channel, &others));
            (channel, pairs.map(|(with, without)| with - without).collect())
        };
        let touched = own.active.cause.channels(self.twin.unit());
        touched.into_iter().map(difference).collect()
    }

    /// The same at the fitted samples, in units of noise.
    pub fn contribution(&self, model: &[Component], of: usize) -> Vec<(usize, DVector<f64>)> {
        let fitted = |(channel, added): (usize, Vec<f64>)| {
            let frame = &self.frames[channel];
            let rows = frame.series.rows.iter();
            let values = rows.map(|row| added[*row as usize] / frame.weight_sigma);
            (channel, DVector::from_iterator(frame.series.rows.len(), values))
        };
        self.added(model, of).into_iter().map(fitted).collect()
    }

    /// What a channel's calibration still leaves open once it is fitted, in physical units at every row of the log: a row of
    /// the matrix for each direction, for one standard deviation.
    pub fn still_open(&self, channel: usize) -> DMatrix<f64> {
        let columns = calibration(self.twin, channel);
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
        let columns = self.twin.jacobian(&actives, of);
        columns.into_iter().map(|column| self.in_noise(&column, span)).collect()
    }

    /// A column at the rows that are fitted, in units of noise.
    pub fn in_noise(&self, column: &Column, span: Option<Span>) -> Vec<(usize, DVector<f64>)> {
        let starts_s = self.twin.starts_s();
        let at = |(channel, values): &(usize, Vec<f64>)| {
            let frame = &self.frames[*channel];
            let of_row = frame.series.rows.iter().map(|row| {
                let row = *row as usize;
                let is_on = span.is_none_or(|span| span.contains(starts_s[row]));
                if is_on { values[row] / frame.weight_sigma } else { 0.0 }
            });
            (*channel, DVector::from_iterator(frame.series.rows.len(), of_row))
        };
        column.entries.iter().map(at).collect()
    }

    /// Columns of every channel for some parameters, given as [`Problem::slopes`] gives them.
    pub fn columns(&self, parameters: &[Vec<(usize, DVector<f64>)>]) -> Vec<Columns> {
        let empty = |frame: &Frame| Columns {
            nuisance: frame.nuisance.clone(),
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
