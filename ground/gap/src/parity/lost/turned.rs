//! What field and force of a row are off from those of a row before it, turned by the rates between.
//!
//! In: a log and its unit. Out: [`Turned`]; [`Turned::off`] is `d` of [`super`].
//!
//! The rates are a cubic between two rows, by the values and the slopes of their ends. With `w` the rates, `w'` the slopes and `T` the
//! time between,
//!
//! ```text
//! theta = T (w_1 + w_2) / 2 + T^2 (w_1' - w_2') / 12 + s (w_2 - w_1) + T^2 (w_1 x w_2) / 12
//! ```
//!
//! where `s` is by how much the vector is read after the gyros; the last term is that of coning. Nothing is asked of the time between:
//! `s_1` is the slope from the row before the first to the first, and `s_2` from the second to the one after it. They are those of half a
//! cycle before and after, so that of a rate that bends evenly `w_1' - w_2' = (s_1 - s_2) T / (T + cycle)`. The vectors are means of several
//! rows to either side, turned alike. Sensors of a row are read one after another, meanwhile `v' = -w x v`.

use nalgebra::{DVector, Matrix3, Rotation3, Vector3};
use twin::predict::{Kind, UnitDescription};

use crate::{input::log::Log, parity::turning::SPANS};

/// Part of a cycle by which rows that follow each other may be off: half of what would make the number of cycles doubtful.
const REGULAR: f64 = 0.25;

/// Kinds of which a vector in n is turned.
const VECTORS: [Kind; 2] = [Kind::Magnetometer, Kind::Accelerometer];

/// A vector of each row, by the channels of a kind.
struct Vectors {
    /// \[s\] after the start of the row.
    at_s: f64,
    /// Of each row; none where its sensors do not span.
    own_b: Vec<Option<Vector3<f64>>>,
}

/// A vector of each row, with what the rows to one side say of it.
struct Sides {
    /// \[s\] after the gyros.
    later_s: f64,
    before_b: Vec<Option<Vector3<f64>>>,
    after_b: Vec<Option<Vector3<f64>>>,
}

/// What is needed of a log.
pub struct Turned {
    start_s: Vec<f64>,
    rates_b: Vec<Option<Vector3<f64>>>,
    vectors: Vec<Sides>,
    cycle_s: f64,
}

impl Turned {
    /// Of a log, with so many rows to either side; none where its unit has no rate, or nothing that turns.
    pub fn of(log: &Log, unit: &UnitDescription, cycle_s: f64, rows: usize) -> Option<Self> {
        let still = vec![Some(Vector3::zeros()); log.start_s.len()];
        let rates = Vectors::of(log, unit, Kind::Gyro, &still)?;
        let vectors = VECTORS
            .iter()
            .filter_map(|kind| Vectors::of(log, unit, *kind, &rates.own_b));
        let vectors: Vec<Vectors> = vectors.collect();
        let mut turned = Self {
            start_s: log.start_s.clone(),
            rates_b: rates.own_b,
            vectors: Vec::new(),
            cycle_s,
        };
        turned.vectors = vectors
            .into_iter()
            .map(|own| turned.sides(own, rates.at_s, rows))
            .collect();
        (!turned.vectors.is_empty()).then_some(turned)
    }

    /// Means of so many rows, each turned by the rates.
    fn sides(&self, of: Vectors, rates_at_s: f64, rows: usize) -> Sides {
        let later_s = of.at_s - rates_at_s;
        let turn = |row: usize, bend: Option<Vector3<f64>>| {
            let theta = self.theta(row, row + 1, self.cycle_s, bend?)? + later_s * self.change(row, row + 1)?;
            Some(Rotation3::new(theta))
        };
        // Nothing beyond the row that the mean is of.
        let left = |row: usize| Some(self.slope(row.checked_sub(1)?)? - self.slope(row)?);
        let right = |row: usize| Some(self.slope(row)? - self.slope(row + 1)?);
        let before = |row: usize| {
            let (mut sum, mut back) = (of.own_b[row]?, Rotation3::identity());
            for other in (row.checked_sub(rows - 1)?..row).rev() {
                back *= turn(other, left(other))?.inverse();
                sum += back * of.own_b[other]?;
            }
            Some(sum / rows as f64)
        };
        let after = |row: usize| {
            let (mut sum, mut back) = (of.own_b[row]?, Rotation3::identity());
            for other in row + 1..row + rows {
                back *= turn(other - 1, right(other - 1))?;
                sum += back * (*of.own_b.get(other)?)?;
            }
            Some(sum / rows as f64)
        };
        Sides {
            later_s,
            before_b: (0..self.rows()).map(before).collect(),
            after_b: (0..self.rows()).map(after).collect(),
        }
    }

    /// How many.
    pub fn rows(&self) -> usize {
        self.start_s.len()
    }

    /// \[s\]
    pub fn start_s(&self, row: usize) -> f64 {
        self.start_s[row]
    }

    /// `d` of two rows that are so far apart; none where a row lacks a vector, a slope is not known, or the log tells neither that the two
    /// rows follow each other nor that they are so far apart.
    pub fn off(&self, from: usize, to: usize, apart_s: f64) -> Option<DVector<f64>> {
        let slopes = self.slope(from.checked_sub(1)?)? - self.slope(to)?;
        let theta = self.theta(from, to, apart_s, slopes * (apart_s / (apart_s + self.cycle_s)))?;
        let change = self.change(from, to)?;
        let mut off = DVector::zeros(3 * self.vectors.len());
        for (at, own) in self.vectors.iter().enumerate() {
            let turn = Rotation3::new(-(theta + own.later_s * change));
            off.fixed_rows_mut::<3>(3 * at)
                .copy_from(&(own.after_b[to]? - turn * own.before_b[from]?));
        }
        Some(off)
    }

    /// The turn between two rows that the log tells to be as far apart as their places are, and that are `apart_s` apart; `bend` is what
    /// the slope of the rates loses meanwhile.
    fn theta(&self, from: usize, to: usize, apart_s: f64, bend: Vector3<f64>) -> Option<Vector3<f64>> {
        if !self.is_regular(from, to) {
            return None;
        }
        let (first, second) = (self.rates_b[from]?, self.rates_b[to]?);
        Some(0.5 * apart_s * (first + second) + apart_s * apart_s / 12.0 * (bend + first.cross(&second)))
    }

    fn is_regular(&self, from: usize, to: usize) -> bool {
        let told_s = |to: &f64| to - self.start_s[from];
        let off_s = |told_s: f64| told_s - (to - from) as f64 * self.cycle_s;
        (self.start_s.get(to).map(told_s)).is_some_and(|told_s| off_s(told_s).abs() < REGULAR * self.cycle_s)
    }

    /// \[rad/s\] by which the rates change.
    fn change(&self, from: usize, to: usize) -> Option<Vector3<f64>> {
        Some((*self.rates_b.get(to)?)? - self.rates_b[from]?)
    }

    /// \[rad/s2\] of the rates between a row and the next.
    fn slope(&self, row: usize) -> Option<Vector3<f64>> {
        let is_regular = self.is_regular(row, row + 1);
        Some(self.change(row, row + 1).filter(|_| is_regular)? / self.cycle_s)
    }
}

impl Vectors {
    /// By least squares of what a row has of a kind, which turns meanwhile; none where the kind does not span.
    fn of(log: &Log, unit: &UnitDescription, kind: Kind, rates_b: &[Option<Vector3<f64>>]) -> Option<Self> {
        let own: Vec<usize> = (0..unit.channels.len())
            .filter(|index| unit.channels[*index].sensor == kind && !log.channels[*index].rows.is_empty())
            .collect();
        let instant_s = |index: usize| unit.channels[index].slot_s - unit.channels[index].tau_s();
        let at_s = own.iter().map(|index| instant_s(*index)).sum::<f64>() / own.len().max(1) as f64;
        let mut sums = vec![(Matrix3::<f64>::zeros(), Vector3::<f64>::zeros()); log.start_s.len()];
        for index in own {
            let (channel, series) = (&unit.channels[index], &log.channels[index]);
            let after_s = instant_s(index) - at_s;
            for (row, value) in series.rows.iter().zip(&series.values) {
                let Some(rate_b) = rates_b[*row as usize] else { continue };
                // a . (v - t w x v) = (a - t a x w) . v
                let along = channel.axis_b - after_s * channel.axis_b.cross(&rate_b);
                let (matrix, right) = &mut sums[*row as usize];
                *matrix += along * along.transpose();
                *right += along * (value - channel.bias);
            }
        }
        let solve = |(matrix, right): (Matrix3<f64>, Vector3<f64>)| {
            let spans = matrix.symmetric_eigenvalues().min() > SPANS;
            matrix.cholesky().filter(|_| spans).map(|own| own.solve(&right))
        };
        let own_b: Vec<Option<Vector3<f64>>> = sums.into_iter().map(solve).collect();
        own_b.iter().any(Option::is_some).then_some(Self { at_s, own_b })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// \[uT\] in n.
    const FIELD: Vector3<f64> = Vector3::new(20.0, -7.0, 40.0);

    /// Three gyros, and three magnetometers that are read one after another later, turned about z as told.
    fn turning(angle: impl Fn(f64) -> f64, rate: impl Fn(f64) -> f64) -> (Log, UnitDescription) {
        let mut text = "name = \"x\"\ncycle_s = 0.2\n".to_owned();
        for (index, sensor) in ["gyro", "magnetometer"]
            .iter()
            .flat_map(|sensor| [*sensor; 3])
            .enumerate()
        {
            let axis = Vector3::ith(index % 3, 1.0);
            text += &format!(
                "[[channel]]\nname = \"c{index}\"\nsensor = \"{sensor}\"\ngroup = \"x\"\naxis_b = [{:.1}, {:.1}, {:.1}]\n\
                 slot_s = {}\nlsb = 0.001\nnoise_sigma = 0.01\n",
                axis.x,
                axis.y,
                axis.z,
                0.01 * index.saturating_sub(3) as f64
            );
        }
        let unit = UnitDescription::read(&text, "unit.toml").expect("a unit");
        let mut log = Log::empty(6);
        for row in 0..8 {
            log.start_s.push(0.2 * row as f64);
            for (index, channel) in unit.channels.iter().enumerate() {
                let at_s = 0.2 * row as f64 + channel.slot_s;
                let own = match channel.sensor {
                    Kind::Gyro => Vector3::new(0.0, 0.0, rate(at_s)),
                    _ => Rotation3::new(Vector3::z() * -angle(at_s)) * FIELD,
                };
                log.channels[index].rows.push(row);
                log.channels[index].values.push(channel.axis_b.dot(&own));
            }
        }
        (log, unit)
    }

    #[test]
    fn the_field_turns_as_far_as_the_rates_say_and_of_a_lost_packet_twice_as_far() {
        for rows in [1, 2] {
            let (log, unit) = turning(|t_s| 0.5 * t_s, |_| 0.5);
            let turned = Turned::of(&log, &unit, 0.2, rows).expect("turns");
            let off = |apart_s: f64| turned.off(3, 4, apart_s).expect("rows beside it").norm();
            // Samples of a row lie 20 ms apart, of which the square is left out: (0.01 w)^2 of the field.
            assert!(off(0.2) < 1e-4 * FIELD.norm(), "{}", off(0.2));
            let once_more = 2.0 * f64::sin(0.5 * 0.1) * FIELD.xy().norm();
            assert!(
                (off(0.4) - once_more).abs() < 1e-3 * once_more,
                "{} {once_more}",
                off(0.4)
            );
        }
    }

    #[test]
    fn rates_that_bend_are_followed_between_rows() {
        let (log, unit) = turning(|t_s| t_s.powi(3) / 3.0, |t_s| t_s * t_s);
        let turned = Turned::of(&log, &unit, 0.2, 1).expect("turns");
        let off = turned.off(3, 4, 0.2).expect("rows beside it").norm();
        // Straight between the rows they would be off by T^3 w'' / 12.
        let straight = 0.2f64.powi(3) * 2.0 / 12.0 * FIELD.xy().norm();
        assert!(off < 0.1 * straight, "{off} of {straight}");
    }

    #[test]
    fn rows_that_do_not_follow_each_other_say_nothing() {
        let (mut log, unit) = turning(|t_s| 0.5 * t_s, |_| 0.5);
        log.start_s[4..].iter_mut().for_each(|start_s| *start_s += 0.2);
        let turned = Turned::of(&log, &unit, 0.2, 1).expect("turns");
        assert_eq!(turned.off(3, 4, 0.2), None);
        assert!(turned.off(1, 2, 0.2).is_some());
    }
}
