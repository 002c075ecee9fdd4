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

/// Columns that go through the steps side by side: none waits for the sums of another.
const SIDE: usize = 8;

/// Which way columns go through the steps.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    ToWhite,
    Back,
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
                carry(&go, processes, covariance.as_mut_slice(), states);
                covariance.transpose_mut();
                carry(&go, processes, covariance.as_mut_slice(), states);
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
        self.through(columns, Way::ToWhite)
    }

    /// The columns that are these when they are white; a sample that is passed over is what it is here.
    pub fn taken_back(&self, white: &DMatrix<f64>) -> DMatrix<f64> {
        self.through(white, Way::Back)
    }

    /// What of a column each sample's value makes of its inner product with a white one: `y'dual(u) = whiten(y)'u`.
    pub fn dual(&self, white: &DVector<f64>) -> DVector<f64> {
        let mut dual = DVector::zeros(white.len());
        let mut states = vec![0.0; self.states];
        for (at, step) in self.steps.iter().enumerate().rev() {
            if step.weight > 0.0 {
                let of_gain: f64 = states
                    .iter()
                    .zip(step.gain.iter())
                    .map(|(state, gain)| state * gain)
                    .sum();
                dual[at] = step.weight * white[at] + of_gain;
                step.sees
                    .iter()
                    .for_each(|(place, part)| states[*place] -= part * dual[at]);
            }
            if !step.go.is_empty() {
                let transposed: Vec<[[f64; 2]; 2]> = (step.go.iter())
                    .map(|go| [[go[0][0], go[1][0]], [go[0][1], go[1][1]]])
                    .collect();
                carry(&transposed, &self.processes, &mut states, 1);
            }
        }
        dual
    }

    fn through(&self, columns: &DMatrix<f64>, way: Way) -> DMatrix<f64> {
        let mut passed = columns.clone();
        let samples = columns.nrows().max(1);
        let mut blocks = passed.as_mut_slice().chunks_exact_mut(SIDE * samples);
        (&mut blocks).for_each(|block| self.step_through::<SIDE>(block, way));
        let rest = blocks.into_remainder().chunks_exact_mut(samples);
        rest.for_each(|column| self.step_through::<1>(column, way));
        passed
    }

    /// So many columns, one after the other.
    fn step_through<const COLUMNS: usize>(&self, columns: &mut [f64], way: Way) {
        let samples = self.steps.len();
        let mut states = vec![[0.0; COLUMNS]; self.states];
        for (at, step) in self.steps.iter().enumerate() {
            if !step.go.is_empty() {
                carry(&step.go, &self.processes, states.as_flattened_mut(), COLUMNS);
            }
            if step.weight <= 0.0 {
                if way == Way::ToWhite {
                    (0..COLUMNS).for_each(|column| columns[column * samples + at] = 0.0);
                }
                continue;
            }
            let mut expected = [0.0; COLUMNS];
            for (place, part) in &step.sees {
                (expected.iter_mut().zip(&states[*place])).for_each(|(sum, state)| *sum += part * state);
            }
            let mut innovations = [0.0; COLUMNS];
            for (column, (innovation, expected)) in innovations.iter_mut().zip(expected).enumerate() {
                let value = &mut columns[column * samples + at];
                match way {
                    Way::ToWhite => {
                        *innovation = *value - expected;
                        *value = *innovation * step.weight;
                    }
                    Way::Back => {
                        *innovation = *value / step.weight;
                        *value = *innovation + expected;
                    }
                }
            }
            for (state, gain) in states.iter_mut().zip(step.gain.iter()) {
                (state.iter_mut().zip(innovations)).for_each(|(state, innovation)| *state += gain * innovation);
            }
        }
    }

    /// `-(sum ln s + u'u + n ln 2 pi) / 2` of a residual.
    pub fn log_likelihood(&self, residual: &DVector<f64>) -> f64 {
        let white = self.whiten(&DMatrix::from_columns(std::slice::from_ref(residual)));
        let used = self.steps.iter().filter(|step| step.weight > 0.0).count();
        -0.5 * (self.log_determinant + white.norm_squared() + used as f64 * std::f64::consts::TAU.ln())
    }
}

/// Moves every process' states on; of each state `width` values, one a column, before those of the next.
fn carry(go: &[[[f64; 2]; 2]], processes: &[Process], mut states: &mut [f64], width: usize) {
    for (process, go) in processes.iter().zip(go) {
        let (own, others) = std::mem::take(&mut states).split_at_mut(process.states() * width);
        states = others;
        let (values, rates) = own.split_at_mut(width);
        if rates.is_empty() {
            values.iter_mut().for_each(|value| *value *= go[0][0]);
        }
        for (value, rate) in values.iter_mut().zip(rates) {
            (*value, *rate) = (
                go[0][0] * *value + go[0][1] * *rate,
                go[1][0] * *value + go[1][1] * *rate,
            );
        }
    }
}

#[cfg(test)]
mod tests;
