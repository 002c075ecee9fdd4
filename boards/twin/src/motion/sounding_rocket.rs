//! A sounding-rocket flight after VSB-30: rail, two stages, spin, yo-yo, micro-gravity, re-entry, parachute.
//!
//! Public figures it is built on: two solid stages (S31, S30), fin-stabilised, unguided, launched from a rail, 400 kg of
//! payload; 242 km of apogee and 6.2 min of micro-gravity from Alcantara (Pesquisa FAPESP, "Foguete na microgravidade",
//! Operacao Cuma II, 2007); apogee 4 min 1 s after lift-off at 227 km (AEB on Operacao Santa Branca, 2022). Times of
//! staging and of the yo-yo, thrust curve, spin (three turns a second), coning and re-entry are of the usual size for such a
//! vehicle, not flight data; the test below integrates them and finds the published apogee.
//!
//! x_b is the roll axis, nose forward; on the pad it points up along the rail. At three turns a second the plates' gyros
//! saturate, and so does the accelerometer at the end of the burn: so they would in flight. The drag of the re-entry is
//! taken as vertical, since nothing on board feels where the horizontal speed went.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::Profile;
use super::{Attitude, Motion, Pose};

/// [m/s2] the unit of the specific-force schedules below.
const G0: f64 = 9.80665;
/// \[s\] after lift-off: first-stage burn-out, second-stage ignition and burn-out, yo-yo, begin and end of
/// micro-gravity, parachute, end of the motion.
const BURN_OUT_1_S: f64 = 12.0;
const IGNITION_2_S: f64 = 15.0;
const BURN_OUT_2_S: f64 = 38.2;
const YO_YO_S: f64 = 53.0;
const FREE_FALL_S: f64 = 67.0;
const ENTRY_S: f64 = 439.0;
const PARACHUTE_S: f64 = 520.0;
const END_S: f64 = 570.0;

/// The flight, from power-on on the pad to the parachute.
#[derive(Clone, Debug)]
pub struct SoundingRocket {
    pad_wait_s: f64,
    gravity: f64,
    /// [m/s2] thrust less drag, along x_b.
    axial: Profile,
    /// [m/s2] what holds it up against gravity: the rail, later drag and parachute.
    upward: Profile,
    azimuth: Profile,
    elevation: Profile,
    cone_phase: Profile,
    cone_half_angle: Profile,
    roll: Profile,
    temperature_c: Profile,
}

/// What may go otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// Turns a second when the burn is over.
    pub turns_per_s: f64,
    /// The yo-yo is released.
    pub yo_yo: bool,
}

impl Course {
    /// As it should.
    pub const NOMINAL: Course = Course {
        turns_per_s: 3.0,
        yo_yo: true,
    };
}

impl SoundingRocket {
    /// Lift-off `pad_wait_s` after power-on, under `gravity` [m/s2].
    pub fn new(pad_wait_s: f64, gravity: f64) -> Self {
        SoundingRocket::on(Course::NOMINAL, pad_wait_s, gravity)
    }

    /// The same on a course.
    pub fn on(course: Course, pad_wait_s: f64, gravity: f64) -> Self {
        let on_pad = |value: f64| Profile::from_rest(value).coast(pad_wait_s);
        let until = |profile: Profile, after_lift_off_s: f64| {
            let wait_s = pad_wait_s + after_lift_off_s - profile.end_s();
            profile.coast(wait_s)
        };
        let turns = |per_second: f64| per_second * TAU;

        // Thrust takes over from the rail; it grows as propellant burns; drag brakes between the stages.
        let boost = until(on_pad(0.0).move_to(4.8 * G0, 0.4), 0.5).move_to(5.8 * G0, 6.0);
        let coast = until(boost, BURN_OUT_1_S)
            .move_to(-1.2 * G0, 0.8)
            .move_to(-0.8 * G0, 2.0);
        let burn = until(coast, IGNITION_2_S)
            .move_to(3.2 * G0, 0.6)
            .ramp_to_rate(0.4 * G0, 1.0);
        let axial = until(burn, BURN_OUT_2_S).move_to(0.0, 1.5);

        let flight = until(on_pad(gravity).move_to(0.0, 0.4), ENTRY_S);
        let entry = flight
            .move_to(1.0 * G0, 20.0)
            .move_to(10.8 * G0, 16.0)
            .move_to(gravity, 18.0);
        let upward = until(entry, PARACHUTE_S).move_to(4.0 * G0, 0.5).move_to(gravity, 4.0);

        // Towards the Atlantic; gravity bends the path while fins hold the nose on it; then the attitude is free.
        let azimuth = until(on_pad(70.0_f64.to_radians()), ENTRY_S).ramp_to_rate(turns(0.2), 20.0);
        let elevation = on_pad(85.0_f64.to_radians()).move_to(78.0_f64.to_radians(), BURN_OUT_2_S);
        let elevation = until(elevation, ENTRY_S).move_to(0.1, 30.0);

        // A spinning body cones; the yo-yo kicks it, rate control then damps it.
        let cone_phase = until(on_pad(0.0), 1.0).ramp_to_rate(turns(0.4), 3.0);
        let cone_phase = until(cone_phase, YO_YO_S).ramp_to_rate(turns(0.05), 1.0);
        let cone_half_angle = until(on_pad(0.0), 1.0).move_to(0.02, 5.0);
        let cone_half_angle = until(cone_half_angle, YO_YO_S).move_to(0.06, 1.0).move_to(0.002, 12.0);

        // Spin motors just above the rail, then canted fins; the yo-yo takes the spin away.
        let thirds = |of: f64| turns(course.turns_per_s * of / 3.0);
        let spin = until(on_pad(0.0), 0.6).ramp_to_rate(thirds(1.0), 1.5);
        let spin = spin.ramp_to_rate(thirds(2.0), 9.5);
        let spin = until(spin, IGNITION_2_S).ramp_to_rate(thirds(3.0), BURN_OUT_2_S - IGNITION_2_S);
        let spin = if course.yo_yo {
            let slowed = until(spin, YO_YO_S).ramp_to_rate(turns(0.1), 1.0);
            until(slowed, YO_YO_S + 4.0).ramp_to_rate(0.0, 8.0)
        } else {
            spin
        };
        let roll = until(spin, ENTRY_S).ramp_to_rate(turns(0.5), 40.0);

        let warmed = until(on_pad(30.0).move_to(34.0, 60.0), ENTRY_S);
        Self {
            pad_wait_s,
            gravity,
            axial,
            upward,
            azimuth: until(azimuth, PARACHUTE_S).ramp_to_rate(turns(0.03), 5.0),
            elevation: until(elevation, PARACHUTE_S).move_to(82.0_f64.to_radians(), 6.0),
            cone_phase: until(cone_phase, FREE_FALL_S - 3.0).ramp_to_rate(0.0, 2.0),
            cone_half_angle,
            roll: until(roll, PARACHUTE_S).ramp_to_rate(turns(0.05), 5.0),
            temperature_c: warmed.move_to(48.0, END_S - ENTRY_S),
        }
    }
}

impl Motion for SoundingRocket {
    fn at(&self, t_s: f64) -> Pose {
        // After its end it goes on under the parachute: an attitude that stood still while its rate went on would be no motion.
        let phase = self.cone_phase.at(t_s);
        let attitude = Attitude::level()
            .yawed(self.azimuth.at(t_s))
            .pitched(self.elevation.at(t_s))
            .rolled(phase)
            .pitched(self.cone_half_angle.at(t_s))
            .rolled(self.roll.at(t_s) + phase * -1.0);
        let thrust_n = attitude.q_nb * Vector3::new(self.axial.at(t_s).value, 0.0, 0.0);
        let flown_s = t_s - self.pad_wait_s;
        Pose {
            attitude,
            acc_n: thrust_n + Vector3::new(0.0, 0.0, self.gravity - self.upward.at(t_s).value),
            temperature_c: Some(self.temperature_c.at(t_s).value),
            lift_off: flown_s >= 0.0,
            micro_g: (FREE_FALL_S..ENTRY_S).contains(&flown_s),
        }
    }

    fn duration_s(&self) -> Option<f64> {
        Some(self.pad_wait_s + END_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{Environment, World};
    use crate::motion::check;
    use crate::truth::TruthSource;

    const PAD_S: f64 = 30.0;

    fn flight() -> World<SoundingRocket> {
        let environment = Environment::alcantara();
        World {
            motion: SoundingRocket::new(PAD_S, environment.gravity),
            environment,
        }
    }

    /// Altitude \[m\] and vertical speed [m/s], upwards, `flown_s` after lift-off, by integrating the force it feels.
    fn altitudes() -> Vec<(f64, f64, f64)> {
        let (world, step) = (flight(), 0.05);
        let (mut height, mut speed) = (0.0, 0.0);
        (0..=(END_S / step) as u32)
            .map(|i| {
                let t = PAD_S + f64::from(i) * step;
                let force_n = world.motion.at(t).attitude.q_nb * world.at(t).force_b;
                // Inverse-square gravity; at 240 km it is 7 % less than at the pad.
                let gravity = world.environment.gravity * (6.371e6 / (6.371e6_f64 + height)).powi(2);
                speed += (-force_n.z - gravity) * step;
                height += speed * step;
                (t - PAD_S, height, speed)
            })
            .collect()
    }

    #[test]
    fn it_reaches_the_published_apogee_at_the_published_time() {
        let (t, apogee, _) = altitudes().into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!((230e3..255e3).contains(&apogee), "{apogee} m");
        assert!((235.0..265.0).contains(&t), "{t} s");
    }

    #[test]
    fn micro_gravity_lasts_six_minutes_above_the_atmosphere() {
        let world = flight();
        for (t, height, _) in altitudes() {
            let truth = world.at(PAD_S + t);
            if truth.micro_g {
                assert!(height > 80e3, "{height} m at {t}");
                assert!(truth.force_b.norm() < 1e-9, "{} at {t}", truth.force_b);
                assert!(truth.rate_b.norm() < 0.1_f64.to_radians(), "{} at {t}", truth.rate_b);
            }
        }
        assert!((ENTRY_S - FREE_FALL_S - 6.2 * 60.0).abs() < 1.0);
    }

    #[test]
    fn it_comes_down_slowly_and_in_the_air() {
        let (_, height, speed) = altitudes().pop().unwrap();
        assert!(
            (1e3..40e3).contains(&height) && (-250.0..0.0).contains(&speed),
            "{height} m, {speed} m/s"
        );
    }

    #[test]
    fn the_spin_saturates_the_gyros_until_the_yo_yo() {
        let roll_deg = |after_s: f64| flight().at(PAD_S + after_s).rate_b.x.to_degrees();
        assert!(roll_deg(-1.0).abs() < 0.01);
        assert!(
            (roll_deg(BURN_OUT_2_S + 4.0) - 1080.0).abs() < 1.0,
            "{}",
            roll_deg(BURN_OUT_2_S + 4.0)
        );
        assert!(
            (roll_deg(YO_YO_S + 2.0) - 36.0).abs() < 1.0,
            "{}",
            roll_deg(YO_YO_S + 2.0)
        );
    }

    #[test]
    fn the_burn_peaks_at_twelve_g() {
        let axial = |t: f64| flight().at(PAD_S + t).force_b.x / G0;
        let peak = (0..600).map(|i| axial(f64::from(i) * 0.1)).fold(0.0, f64::max);
        assert!((11.5..12.8).contains(&peak), "{peak} g");
    }

    #[test]
    fn on_the_pad_it_feels_one_g_along_the_rail_and_no_line_is_asserted() {
        let truth = flight().at(PAD_S - 0.001);
        assert!(
            (truth.force_b.x - 9.7804 * 85.0_f64.to_radians().sin()).abs() < 1e-6,
            "{}",
            truth.force_b
        );
        assert!(!truth.lift_off && !truth.micro_g && flight().at(PAD_S).lift_off);
    }

    #[test]
    fn its_derivatives_are_those_of_its_attitude() {
        check::derivatives(&flight().motion, 0.0, PAD_S + 80.0);
        check::derivatives(&flight().motion, PAD_S + 430.0, PAD_S + END_S + 60.0);
    }
}
