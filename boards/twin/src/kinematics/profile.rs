//! One scalar that moves smoothly from rest to rest, with its exact first and second derivative.
//!
//! In: a schedule of holds, moves and changes of rate. Out: [`Jet`] at any time. Each piece is the quintic with the
//! given value and rate and no acceleration at both ends (quintic Hermite), so the second derivative is continuous and
//! no accelerometer, however far from the centre, sees a jump. Before the first knot it rests, after the last it goes on
//! at the rate it then has.

use std::ops::{Add, Mul};

/// A scalar with its first two time derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// Its value.
    pub value: f64,
    /// [1/s] first derivative.
    pub rate: f64,
    /// [1/s2] second derivative.
    pub acc: f64,
}

impl Jet {
    /// `amplitude * sin(rate * t_s)`.
    pub fn sine(amplitude: f64, rate: f64, t_s: f64) -> Self {
        let (sin, cos) = (rate * t_s).sin_cos();
        Self {
            value: amplitude * sin,
            rate: amplitude * rate * cos,
            acc: -amplitude * rate * rate * sin,
        }
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            rate: self.rate + other.rate,
            acc: self.acc + other.acc,
        }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            rate: self.rate * other.value + self.value * other.rate,
            acc: self.acc * other.value + 2.0 * self.rate * other.rate + self.value * other.acc,
        }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            rate: self.rate * factor,
            acc: self.acc * factor,
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Knot {
    t_s: f64,
    value: f64,
    rate: f64,
}

/// A schedule of smooth moves of one scalar, built from its start onwards.
#[derive(Clone, Debug)]
pub struct Profile {
    first: Knot,
    rest: Vec<Knot>,
}

impl Profile {
    /// At rest at `value` from time zero.
    pub fn from_rest(value: f64) -> Self {
        Self {
            first: Knot {
                t_s: 0.0,
                value,
                rate: 0.0,
            },
            rest: Vec::new(),
        }
    }

    /// Goes on at the rate it has for `for_s` seconds: a hold when it is at rest.
    pub fn coast(self, for_s: f64) -> Self {
        let last = self.last();
        self.knot(for_s, last.value + last.rate * for_s, last.rate)
    }

    /// Moves to `value` within `within_s` and comes to rest there.
    pub fn move_to(self, value: f64, within_s: f64) -> Self {
        self.knot(within_s, value, 0.0)
    }

    /// Changes its rate to `rate` within `within_s`, monotonically; on the way it advances by the mean of both rates.
    pub fn ramp_to_rate(self, rate: f64, within_s: f64) -> Self {
        let last = self.last();
        self.knot(within_s, last.value + 0.5 * (last.rate + rate) * within_s, rate)
    }

    /// \[s\] when the schedule ends.
    pub fn end_s(&self) -> f64 {
        self.last().t_s
    }

    /// Value and derivatives at `t_s`.
    pub fn at(&self, t_s: f64) -> Jet {
        let next = self.rest.partition_point(|knot| knot.t_s <= t_s);
        let from = match next.checked_sub(1) {
            Some(previous) => self.rest[previous],
            None => self.first,
        };
        match self.rest.get(next) {
            Some(to) if t_s > from.t_s => quintic(from, *to, t_s),
            _ => Jet {
                value: from.value + from.rate * (t_s - from.t_s),
                rate: from.rate,
                acc: 0.0,
            },
        }
    }

    fn last(&self) -> Knot {
        self.rest.last().copied().unwrap_or(self.first)
    }

    fn knot(mut self, after_s: f64, value: f64, rate: f64) -> Self {
        let t_s = self.last().t_s + after_s;
        self.rest.push(Knot { t_s, value, rate });
        self
    }
}

/// The quintic through two knots whose second derivative vanishes at both.
fn quintic(from: Knot, to: Knot, t_s: f64) -> Jet {
    let length = to.t_s - from.t_s;
    let s = (t_s - from.t_s) / length;
    let (start, end, step) = (from.rate * length, to.rate * length, to.value - from.value);
    let c3 = 10.0 * step - 6.0 * start - 4.0 * end;
    let c4 = -15.0 * step + 8.0 * start + 7.0 * end;
    let c5 = 6.0 * step - 3.0 * start - 3.0 * end;
    Jet {
        value: from.value + s * (start + s * s * (c3 + s * (c4 + s * c5))),
        rate: (start + s * s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5))) / length,
        acc: s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5)) / (length * length),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a quintic of order one.
    const EXACT: f64 = 1e-12;
    /// Central difference over 2e-4 s of curves whose fifth derivative is of order 100.
    const DIFFERENCE: f64 = 1e-4;

    fn near(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() < tolerance, "{a} is not {b}");
    }

    #[test]
    fn it_passes_through_every_knot_of_its_schedule() {
        let profile = Profile::from_rest(1.0)
            .coast(2.0)
            .move_to(3.0, 1.0)
            .ramp_to_rate(4.0, 0.5)
            .coast(1.0);
        near(profile.at(-1.0).value, 1.0, EXACT);
        near(profile.at(2.0).value, 1.0, EXACT);
        near(profile.at(2.5).value, 2.0, EXACT);
        near(profile.at(3.0).value, 3.0, EXACT);
        near(profile.at(3.5).value, 4.0, EXACT);
        near(profile.at(4.0).value, 6.0, EXACT);
        near(profile.at(4.0).rate, 4.0, EXACT);
        near(profile.end_s(), 4.5, EXACT);
        near(profile.at(5.0).value, 10.0, EXACT);
    }

    #[test]
    fn its_derivatives_are_those_of_its_value() {
        let profile = Profile::from_rest(1.0)
            .move_to(3.0, 1.0)
            .ramp_to_rate(4.0, 0.5)
            .coast(1.0)
            .move_to(0.0, 2.0);
        let h = 1e-4;
        for i in 1..450 {
            let t = f64::from(i) * 0.01;
            let (before, now, after) = (profile.at(t - h), profile.at(t), profile.at(t + h));
            near(now.rate, (after.value - before.value) / (2.0 * h), DIFFERENCE);
            near(now.acc, (after.rate - before.rate) / (2.0 * h), 100.0 * DIFFERENCE);
        }
    }

    #[test]
    fn its_second_derivative_does_not_jump_at_a_knot() {
        let profile = Profile::from_rest(0.0)
            .move_to(1.0, 1.0)
            .ramp_to_rate(2.0, 1.0)
            .move_to(0.0, 1.0);
        for knot in [0.0, 1.0, 2.0, 3.0] {
            near(profile.at(knot - 1e-9).acc, 0.0, 1e-6);
            near(profile.at(knot + 1e-9).acc, 0.0, 1e-6);
        }
    }

    #[test]
    fn a_change_of_rate_never_overshoots() {
        let profile = Profile::from_rest(0.0).ramp_to_rate(2.0, 1.0);
        for i in 0..=100 {
            let rate = profile.at(f64::from(i) * 0.01).rate;
            assert!((0.0..=2.0).contains(&rate), "{rate}");
        }
    }

    #[test]
    fn a_product_of_jets_follows_the_product_rule() {
        let product = Jet {
            value: 2.0,
            rate: 3.0,
            acc: 5.0,
        } * Jet {
            value: 7.0,
            rate: 11.0,
            acc: 13.0,
        };
        assert_eq!(
            product,
            Jet {
                value: 14.0,
                rate: 43.0,
                acc: 127.0
            }
        );
    }
}
