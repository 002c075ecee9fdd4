//! Shocks: taps, stops, separation. All accelerometers, and the gyros with them, jump together for a few samples.

use nalgebra::{Matrix3, Vector3};

use super::spread::{Beneath, View, mixed, mixture, unusual_part};
use super::{Effect, Likelihood, Nature, Page, Scope, Symbol, Texture};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// `shock`.
pub struct Shock;

const PAGE: Page = Page {
    name: "shock",
    physics: "Blows: now and then all accelerometers are far off together, and often the gyros with them.",
    equation: "with probability p all y are off by W times their noise along one vector",
    source: "Taps and stops: 1 to 100 m/s2",
    excited_by: "blows",
    siblings: &["vibration", "packet-corruption", "accel-hysteresis"],
    confirm_by: "A faster log of one blow; damp the mounting.",
    nature: Nature::Spread,
    scope: Scope::Unit,
    sensors: &[Kind::Accelerometer, Kind::Gyro],
    parameters: &[Symbol::positive("p", "1", 0.01)],
    texture: Texture::Outliers,
    ..Page::SMOOTH
};

/// Part of a blow by which it differs from sensor to sensor: they are read some milliseconds apart, and at some distance.
const SENSORS_DIFFER: f64 = 0.3;

/// Part of the cycles that may be in a blow: what is off more often shakes.
const BLOWN_CYCLES: f64 = 0.2;

/// How often a blow turns the unit too, and does not go through its middle.
const TURNS: f64 = 0.5;

/// First of the streams that each sensor has for itself; those before are the blow's.
const OWN: u64 = 7;

/// What the sensors of a kind read in one cycle, in units of their noise.
#[derive(Clone, Copy, Default)]
struct Jolt {
    count: f64,
    /// Sum of the squares.
    energy: f64,
    /// Sum of the readings along the sensors' axes, in b.
    along_b: Vector3<f64>,
    /// The axes' normal matrix.
    axes: Matrix3<f64>,
}

impl Jolt {
    fn add(&mut self, axis_b: Vector3<f64>, value: f64) {
        self.count += 1.0;
        self.energy += value * value;
        self.along_b += axis_b * value;
        self.axes += axis_b * axis_b.transpose();
    }

    /// ln of how much likelier this is with a vector of `size` along axes A in all, which has a covariance of
    /// `s I + size^2 A A'`, `s = 1 + (SENSORS_DIFFER size)^2`. By the matrix determinant lemma and Woodbury.
    fn gain(&self, size: f64) -> f64 {
        let own = 1.0 + (SENSORS_DIFFER * size).powi(2);
        let inner = Matrix3::identity() + self.axes * (size * size / own);
        let common = inner
            .try_inverse()
            .map_or(0.0, |inverse| self.along_b.dot(&(inverse * self.along_b)));
        let volume = self.count * own.ln() + inner.determinant().ln();
        0.5 * (self.energy * (1.0 - 1.0 / own) + common * (size / own).powi(2) - volume)
    }
}

/// ln probability of all that was read in each cycle, without a blow and in one.
fn of_rows(views: &[View], variant: f64) -> Vec<[f64; 2]> {
    let count = views.iter().map(|view| view.measured.len()).max().unwrap_or(0);
    let mut rows = vec![(0.0, [Jolt::default(); 2]); count];
    for view in views {
        let (sigma, axis_b) = (view.channel.sigma(), view.channel.axis_b);
        let law = view.normal_law(sigma);
        let of_kind = usize::from(view.channel.sensor == Kind::Gyro);
        for (k, residual) in view.residuals() {
            rows[k].0 += law(residual);
            rows[k].1[of_kind].add(axis_b, residual / sigma);
        }
    }
    let rows = rows.into_iter();
    rows.map(|(usual, [pushed, turned])| {
        [
            usual,
            usual + pushed.gain(variant) + mixed(TURNS, 0.0, turned.gain(variant)),
        ]
    })
    .collect()
}

impl Effect for Shock {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        self.likelihood(variant, views)(theta)
    }

    fn likelihood<'a>(&'a self, variant: f64, views: &'a [View<'a>]) -> Likelihood<'a> {
        let rows = of_rows(views, variant);
        Box::new(move |theta| {
            let p = theta[0].clamp(0.0, 0.999);
            let mixed = mixture(p);
            let hits: f64 = rows.iter().map(|[usual, hit]| unusual_part(p, *usual, *hit)).sum();
            let is_rare = hits <= BLOWN_CYCLES * rows.len() as f64;
            let of_row = |[usual, hit]: &[f64; 2]| if is_rare { mixed(*usual, *hit) } else { *usual };
            rows.iter().map(of_row).sum()
        })
    }

    fn beneath(&self, theta: &[f64], variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let p = theta[0].clamp(0.0, 0.999);
        let rows = of_rows(views, variant).into_iter();
        let worth: Vec<f64> = rows.map(|[usual, hit]| 1.0 - unusual_part(p, usual, hit)).collect();
        views.iter().map(|view| view.each_worth(|k, _| worth[k])).collect()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        // A blow pushes the unit as a whole, and may turn it: sensors of a kind feel parts of one vector.
        let hit = |(number, view): (usize, &View)| {
            let channel = view.channel;
            let (first, often) = match channel.sensor {
                Kind::Gyro => (4, theta[0] * TURNS),
                _ => (1, theta[0]),
            };
            let own = noise.stream(OWN + number as u64);
            let sample = |(k, measured): (usize, &f64)| {
                let at = k as u64;
                if noise.uniform(at) >= often {
                    return *measured;
                }
                let blow = Vector3::from_fn(|axis, _| noise.stream(first + axis as u64).normal(at));
                let felt = channel.axis_b.dot(&blow) + SENSORS_DIFFER * own.normal(at);
                measured + variant * channel.sigma() * felt
            };
            view.measured.iter().enumerate().map(sample).collect()
        };
        views.iter().enumerate().map(hit).collect()
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(format!("blows of some {variant} times the noise"))
    }

    /// How many times as far they scatter.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![5.0, 20.0, 100.0]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    #[test]
    fn the_gain_is_the_ratio_of_two_normal_laws() {
        let axes = [
            [1.0, 0.0, 0.0],
            [0.0, 0.6, 0.8],
            [0.6, -0.8, 0.0],
            [0.0, 0.0, -1.0],
            [0.48, 0.6, 0.64],
        ]
        .map(Vector3::from);
        let values = DVector::from_row_slice(&[0.7, -2.1, 3.3, 0.2, -1.4]);
        let mut jolt = Jolt::default();
        (axes.iter().zip(values.iter())).for_each(|(axis_b, value)| jolt.add(*axis_b, *value));
        for size in [0.5, 5.0, 100.0] {
            let covariance = DMatrix::from_fn(axes.len(), axes.len(), |row, column| {
                let own = f64::from(u8::from(row == column)) * (1.0 + (SENSORS_DIFFER * size).powi(2));
                own + size * size * axes[row].dot(&axes[column])
            });
            let factor = covariance.cholesky().unwrap();
            let hit = -0.5 * (factor.solve(&values).dot(&values) + factor.determinant().ln());
            let usual = -0.5 * values.norm_squared();
            assert!((jolt.gain(size) - (hit - usual)).abs() < 1e-9, "{size}");
        }
    }
}
