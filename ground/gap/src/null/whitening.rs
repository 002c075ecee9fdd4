//! Augmented whitening: slow errors of the reference, the field and the zeros are taken out of a log by one Kalman pass.
//!
//! In: independent [`Process`]es, the state; [`Sample`]s in the order of time, each a sparse row `h` of the processes' values and a
//! white variance `r`; then columns of readings at the samples. Out: each column in units of its innovations,
//! `u = (y - h'x) / sqrt(s)`, `s = h'P h + r`, all by one sequence of gains. For a residual and columns so whitened every inner product
//! is the generalised one, `u'v = y'K^-1 z` with `K` the covariance of all samples, and the log-likelihood of a residual is
//! `-(sum ln s + u'u + n ln 2 pi) / 2`. Sources: Rosenberg 1973; de Jong 1991; Harvey, "Forecasting, structural time series models and the
//! Kalman filter", 1989, section 3.4. Samples are taken one at a time, for their white parts are independent.
//!
//! An attitude error is Matern 3/2, which can be differentiated: that of an Ornstein-Uhlenbeck process would have a white rate,
//! which gyros do not see (Rasmussen and Williams 2006, section 4.2; as a state: Hartikainen and Sarkka 2010).
//!
//! Refuses nothing: a sample whose variance is not above zero and finite is passed over and is zero in every column.

use nalgebra::{DMatrix, DVector};

/// A stationary or a wandering error; its value is its first state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Process {
    /// Covariance `sigma^2 (1 + a) exp(-a)`, `a = sqrt(3) |dt| / alike_s`; its second state is its derivative.
    Matern {
        /// Standard deviation.
        sigma: f64,
        /// \[s\] over which it stays alike.
        alike_s: f64,
    },
    /// Covariance `sigma^2 exp(-|dt| / alike_s)` (Ornstein-Uhlenbeck).
    Alike {
        /// Standard deviation.
        sigma: f64,
        /// \[s\] over which it stays alike.
        alike_s: f64,
    },
    /// A walk from zero.
    Walk {
        /// Standard deviation after a second.
        per_root_s: f64,
    },
}

impl Process {
    /// States it has.
    pub fn states(self) -> usize {
        match self {
            Process::Matern { .. } => 2,
            Process::Alike { .. } | Process::Walk { .. } => 1,
        }
    }

    /// Rate of a Matern process, `sqrt(3) / alike_s`.
    fn pace(alike_s: f64) -> f64 {
        3f64.sqrt() / alike_s
    }

    /// Variances at the beginning.
    fn first(self) -> [f64; 2] {
        match self {
            Process::Matern { sigma, alike_s } => {
                let square = sigma * sigma;
                [square, square * Self::pace(alike_s).powi(2)]
            }
            Process::Alike { sigma, .. } => [sigma * sigma, 0.0],
            Process::Walk { .. } => [0.0; 2],
        }
    }

    /// Transition over a time and the covariance of what is new, each row by row.
    fn step(self, over_s: f64) -> ([[f64; 2]; 2], [[f64; 2]; 2]) {
        match self {
            Process::Matern { alike_s, .. } => {
                let pace = Self::pace(alike_s);
                let (fade, along) = ((-pace * over_s).exp(), pace * over_s);
                let go = [
                    [fade * (1.0 + along), fade * over_s],
                    [-fade * pace * along, fade * (1.0 - along)],
                ];
                let [value, rate] = self.first();
                let kept =
                    |row: usize, column: usize| go[row][0] * value * go[column][0] + go[row][1] * rate * go[column][1];
                let new = [[value - kept(0, 0), -kept(0, 1)], [-kept(1, 0), rate - kept(1, 1)]];
                (go, new)
            }
            Process::Alike { sigma, alike_s } => {
                let fade = (-over_s / alike_s).exp();
                let new = -sigma * sigma * (-2.0 * over_s / alike_s).exp_m1();
                ([[fade, 0.0], [0.0; 2]], [[new, 0.0], [0.0; 2]])
            }
            Process::Walk { per_root_s } => {
                let new = per_root_s * per_root_s * over_s;
                ([[1.0, 0.0], [0.0; 2]], [[new, 0.0], [0.0; 2]])
            }
        }
    }
}

/// Where each process' states begin, and how many there are in all.
pub fn places(processes: &[Process]) -> (Vec<usize>, usize) {
    let mut count = 0;
    let places = processes.iter().map(|process| {
        count += process.states();
        count - process.states()
    });
    (places.collect(), count)
}

/// One sample.
#[derive(Clone, Debug)]
pub struct Sample {
    /// \[s\] when; not before the sample before it.
    pub t_s: f64,
    /// States that it sees ([`places`]), and how much of each.
    pub sees: Vec<(usize, f64)>,
    /// Variance of its white part.
    pub variance: f64,
}

/// What happens at one sample, whatever the column.
struct Step {
    /// Transition of each process since the sample before; none at the same instant.
    go: Vec<[[f64; 2]; 2]>,
    sees: Vec<(usize, f64)>,
    /// `P h / s`
    gain: DVector<f64>,
    /// `1 / sqrt(s)`; zero for a sample that is passed over.
    weight: f64,
}

/// The gains of a log.
pub struct Whitening {
    processes: Vec<Process>,
    states: usize,
    steps: Vec<Step>,
    log_determinant: f64,
}

impl Whitening {
    /// Makes the one sequence of gains.
    pub fn new(processes: &[Process], samples: &[Sample]) -> Self {
        let (places, states) = places(processes);
        let mut covariance = DMatrix::<f64>::zeros(states, states);
        for (process, at) in processes.iter().zip(&places) {
            let first = process.first();
            (0..process.states()).for_each(|own| covariance[(at + own, at + own)] = first[own]);
        }
        let (mut steps, mut log_determinant) = (Vec::with_capacity(samples.len()), 0.0);
        let mut before_s = samples.first().map_or(0.0, |sample| sample.t_s);
        for sample in samples {
            let over_s = (sample.t_s - before_s).max(0.0);
            before_s = before_s.max(sample.t_s);
            let mut go = Vec::new();
            if over_s > 0.0 {
                let moves: Vec<_> = processes.iter().map(|process| process.step(over_s)).collect();
                go = moves.iter().map(|(go, _)| *go).collect();
                carry(&go, &places, processes, &mut covariance);
                covariance.transpose_mut();
                carry(&go, &places, processes, &mut covariance);
                for ((process, at), (_, new)) in processes.iter().zip(&places).zip(&moves) {
                    let own = 0..process.states();
                    own.clone().for_each(|row| {
                        (own.clone()).for_each(|column| covariance[(at + row, at + column)] += new[row][column]);
                    });
                }
            }
            let mut gain = DVector::zeros(states);
            (sample.sees.iter()).for_each(|(state, part)| gain.axpy(*part, &covariance.column(*state), 1.0));
            let seen: f64 = sample.sees.iter().map(|(state, part)| part * gain[*state]).sum();
            let variance = seen + sample.variance;
            let is_used = sample.variance > 0.0 && variance.is_finite();
            let weight = if is_used { variance.sqrt().recip() } else { 0.0 };
            if is_used {
                log_determinant += variance.ln();
                covariance.ger(-1.0 / variance, &gain, &gain, 1.0);
                gain /= variance;
            }
            steps.push(Step {
                go,
                sees: sample.sees.clone(),
                gain,
                weight,
            });
        }
        Whitening {
            processes: processes.to_vec(),
            states,
            steps,
            log_determinant,
        }
    }

    /// Whitens columns, one sample a row.
    pub fn whiten(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let (places, _) = places(&self.processes);
        // A sample a column: what belongs together then lies together.
        let mut white = columns.transpose();
        let mut states = DMatrix::<f64>::zeros(self.states, columns.ncols());
        for (at, step) in self.steps.iter().enumerate() {
            if !step.go.is_empty() {
                carry(&step.go, &places, &self.processes, &mut states);
            }
            let mut innovation = white.column_mut(at);
            if step.weight <= 0.0 {
                innovation.fill(0.0);
                continue;
            }
            for (own, mut state) in innovation.iter_mut().zip(states.column_iter_mut()) {
                *own -= step.sees.iter().map(|(place, part)| part * state[*place]).sum::<f64>();
                if *own != 0.0 {
                    state.axpy(*own, &step.gain, 1.0);
                }
            }
            innovation *= step.weight;
        }
        white.transpose()
    }

    /// The columns that are these when they are white; a sample that is passed over is what it is here.
    pub fn taken_back(&self, white: &DMatrix<f64>) -> DMatrix<f64> {
        let (places, _) = places(&self.processes);
        let mut columns = white.transpose();
        let mut states = DMatrix::<f64>::zeros(self.states, white.ncols());
        for (at, step) in self.steps.iter().enumerate() {
            if !step.go.is_empty() {
                carry(&step.go, &places, &self.processes, &mut states);
            }
            if step.weight <= 0.0 {
                continue;
            }
            for (own, mut state) in columns.column_mut(at).iter_mut().zip(states.column_iter_mut()) {
                let innovation = *own / step.weight;
                *own = innovation + step.sees.iter().map(|(place, part)| part * state[*place]).sum::<f64>();
                state.axpy(innovation, &step.gain, 1.0);
            }
        }
        columns.transpose()
    }

    /// `-(sum ln s + u'u + n ln 2 pi) / 2` of a residual.
    pub fn log_likelihood(&self, residual: &DVector<f64>) -> f64 {
        let white = self.whiten(&DMatrix::from_columns(std::slice::from_ref(residual)));
        let used = self.steps.iter().filter(|step| step.weight > 0.0).count();
        -0.5 * (self.log_determinant + white.norm_squared() + used as f64 * std::f64::consts::TAU.ln())
    }
}

/// Moves every process' states on, in each column.
fn carry(go: &[[[f64; 2]; 2]], places: &[usize], processes: &[Process], columns: &mut DMatrix<f64>) {
    for mut column in columns.column_iter_mut() {
        for ((process, at), go) in processes.iter().zip(places).zip(go) {
            let value = column[*at];
            if process.states() == 2 {
                let rate = column[at + 1];
                column[*at] = go[0][0] * value + go[0][1] * rate;
                column[at + 1] = go[1][0] * value + go[1][1] * rate;
            } else {
                column[*at] = go[0][0] * value;
            }
        }
    }
}

#[cfg(test)]
mod tests;
