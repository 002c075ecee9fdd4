//! Motions of the trials: one seeded family, other than any the diagnosis was practised on.
//!
//! In: a seed. Out: yaw, pitch and roll as sums of three sinusoids each, let in and out by an envelope so that the unit
//! moves and rests by turns; the centre on Lissajous paths of decimetres; a temperature that rises and falls. All with exact
//! derivatives, because the accelerometers feel the second one.

use nalgebra::Vector3;
use twin::motion::{Attitude, Jet, Motion, Pose, Profile};

use crate::{draw::Draw, followed::Followed};

/// Sinusoids of one angle.
const TONES: usize = 3;

/// How lively a motion is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Slow turns to many attitudes with long rests.
    Positions,
    /// A table about all axes in turn, up to a turn a second and a half.
    Table,
    /// Carried about by hand.
    Hand,
}

/// A motion of the family.
#[derive(Clone, Debug)]
pub struct Wander {
    envelope: Profile,
    /// For yaw, pitch and roll: amplitude \[rad\], angular frequency [rad/s], phase \[rad\].
    angles: [[(f64, f64, f64); TONES]; 3],
    /// For each axis of n: amplitude \[m\], angular frequency [rad/s].
    path: [(f64, f64); 3],
    /// Mean and swing \[degC\], angular frequency [rad/s].
    temperature: (f64, f64, f64),
    duration_s: f64,
}

impl Wander {
    /// The motion of a draw, `duration_s` long; `warm` lets the temperature swing by 6 to 15 degC.
    pub fn draw(style: Style, warm: bool, duration_s: f64, draw: &mut Draw) -> Self {
        let (slowest, fastest, swing, moves_s, rests_s, reach_m) = match style {
            Style::Positions => (0.05, 0.25, 1.6, (10.0, 20.0), (8.0, 15.0), 0.0),
            Style::Table => (0.1, 0.8, 1.4, (25.0, 50.0), (6.0, 12.0), 0.0),
            Style::Hand => (0.3, 2.2, 0.6, (30.0, 70.0), (4.0, 9.0), 0.12),
        };
        let mut envelope = Profile::from_rest(0.0).coast(draw.uniform(5.0, 10.0));
        while envelope.end_s() < duration_s + 10.0 {
            envelope = envelope
                .move_to(1.0, 3.0)
                .coast(draw.uniform(moves_s.0, moves_s.1))
                .move_to(0.0, 3.0)
                .coast(draw.uniform(rests_s.0, rests_s.1));
        }
        let mut tone = |_: usize| {
            (
                draw.sign() * draw.uniform(0.3, 1.0) * swing,
                draw.log_uniform(slowest, fastest),
                draw.uniform(-3.1, 3.1),
            )
        };
        let angles = [(); 3].map(|()| std::array::from_fn(&mut tone));
        let path = [(); 3].map(|()| (reach_m * draw.uniform(0.3, 1.0), draw.uniform(0.8, 3.0)));
        let temperature = match warm {
            true => (
                draw.uniform(24.0, 32.0),
                draw.sign() * draw.uniform(6.0, 15.0),
                draw.uniform(0.02, 0.035),
            ),
            false => (25.0 + draw.uniform(-0.5, 0.5), 0.3, 0.02),
        };
        Wander {
            envelope,
            angles,
            path,
            temperature,
            duration_s,
        }
    }

    fn place(&self, axis: usize, t_s: f64) -> Jet {
        let (amplitude_m, rate) = self.path[axis];
        self.envelope.at(t_s) * Jet::sine(amplitude_m, rate, t_s)
    }

    fn angle(&self, axis: usize, t_s: f64) -> Jet {
        let envelope = self.envelope.at(t_s);
        let sum = self.angles[axis]
            .iter()
            .fold(Jet::default(), |sum, (amplitude, rate, phase)| {
                sum + Jet::sine(*amplitude, *rate, t_s + phase / rate)
            });
        envelope * sum
    }
}

impl Motion for Wander {
    fn at(&self, t_s: f64) -> Pose {
        let attitude = Attitude::level()
            .yawed(self.angle(0, t_s))
            .pitched(self.angle(1, t_s))
            .rolled(self.angle(2, t_s));
        let (mean_c, swing_c, rate) = self.temperature;
        Pose {
            acc_n: Vector3::from_fn(|axis, _| self.place(axis, t_s).acc),
            temperature_c: Some(mean_c + swing_c * (rate * t_s).sin()),
            ..Pose::turning(attitude)
        }
    }

    fn duration_s(&self) -> Option<f64> {
        Some(self.duration_s)
    }

    fn position_n(&self, t_s: f64) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.place(axis, t_s).value)
    }
}

impl Followed for Wander {
    fn heading_rad(&self, t_s: f64) -> f64 {
        self.angle(0, t_s).value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// \[s\] half the step of the difference quotients, and what they are off by at 2.5 rad/s: (H w)^2 / 6 with a margin.
    const H: f64 = 1e-3;
    const QUOTIENT: f64 = 5e-4;

    fn motions() -> impl Iterator<Item = Wander> {
        [Style::Positions, Style::Table, Style::Hand]
            .into_iter()
            .zip(0..)
            .map(|(style, seed)| Wander::draw(style, true, 600.0, &mut Draw::new(seed)))
    }

    #[test]
    fn the_centre_accelerates_as_its_path_says() {
        for motion in motions() {
            for step in 0..400 {
                let t = 1.5 * f64::from(step) + 0.21;
                let [before, now, after] = [t - H, t, t + H].map(|t| motion.position_n(t));
                let acc = (after - 2.0 * now + before) / (H * H);
                assert!((acc - motion.at(t).acc_n).norm() < QUOTIENT, "{t}");
            }
        }
    }

    #[test]
    fn the_rate_is_the_attitudes() {
        for motion in motions() {
            for step in 0..400 {
                let t = 1.5 * f64::from(step) + 0.37;
                let turn = motion.at(t - H).attitude.q_nb.inverse() * motion.at(t + H).attitude.q_nb;
                let rate = turn.scaled_axis() / (2.0 * H);
                assert!((rate - motion.at(t).attitude.rate_nb_b).norm() < QUOTIENT, "{t}");
            }
        }
    }

    #[test]
    fn all_of_them_stay_within_the_sensors_ranges() {
        for motion in motions() {
            let most = (0..6000).map(|k| motion.at(0.1 * f64::from(k)).attitude.rate_nb_b.amax());
            assert!(most.fold(0.0, f64::max) < 5.5);
        }
    }
}
