//! Effects against the same physics written another way: a changed description, environment or motion.

use nalgebra::UnitQuaternion;

use super::*;

fn twin_of(unit: UnitDescription, environment: Environment, motion: &dyn Motion) -> Twin {
    let scene = Scene::new(motion, &environment, 0.0, 241.0, 0.02);
    let starts_s = (0..SPARSE.0).map(|k| SPARSE.1 * k as f64).collect();
    Twin::new(unit, environment, scene, starts_s).unwrap()
}

/// The exercise, turned in n and in b: `q = n q_nb b`.
struct Turned(UnitQuaternion<f64>, UnitQuaternion<f64>);

impl Motion for Turned {
    fn at(&self, t_s: f64) -> Pose {
        let Pose { attitude, acc_n, .. } = Exercise.at(t_s);
        Pose {
            attitude: Attitude {
                q_nb: self.0 * attitude.q_nb * self.1,
                rate_nb_b: self.1.inverse() * attitude.rate_nb_b,
                rate_dot_nb_b: self.1.inverse() * attitude.rate_dot_nb_b,
            },
            acc_n: self.0 * acc_n,
            ..Exercise.at(t_s)
        }
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}

/// Largest difference, in sigmas, between the effect and the changed twin, over the channels the effect touches; and how large
/// the effect is itself.
fn compared(name: &str, locality: Locality, variant: f64, theta: &[f64], changed: &Twin) -> (f64, f64) {
    let nominal = twin(SPARSE);
    let active = Active {
        cause: Cause {
            effect: by_name(name).unwrap(),
            locality,
            variant,
        },
        theta: theta.to_vec(),
    };
    let with = predicted(&nominal, &active);
    let apart = difference(&nominal, &active.cause, &with, &changed.predict(&[])).amax();
    (
        apart,
        difference(&nominal, &active.cause, &nominal.predict(&[]), &with).amax(),
    )
}

/// Part of the effect: a low-pass of tau and the delay that stands for it differ by (w tau)^2, 4e-3 at 10 rad/s and 6 ms.
const SAME: f64 = 4e-3;

fn same(name: &str, locality: Locality, variant: f64, theta: &[f64], changed: &Twin) {
    let (apart, whole) = compared(name, locality, variant, theta, changed);
    assert!(apart < SAME * whole && whole > 0.1, "{name}: {apart} of {whole}");
}

pub(super) fn changed_unit(change: impl Fn(usize, &mut crate::channel::Channel)) -> Twin {
    let mut unit = emems(thesis_slot_s);
    unit.channels
        .iter_mut()
        .enumerate()
        .for_each(|(index, channel)| change(index, channel));
    twin_of(unit, Environment::laboratory(), &Exercise)
}

fn changed_site(change: impl Fn(&mut Environment)) -> Twin {
    let mut environment = Environment::laboratory();
    change(&mut environment);
    twin_of(emems(thesis_slot_s), environment, &Exercise)
}

#[test]
fn an_effect_on_the_unit_is_a_changed_description() {
    let all = Locality::Common;
    same(
        "lever-arm",
        all.clone(),
        0.0,
        &[0.02, -0.01, 0.03],
        &changed_unit(|_, channel| {
            channel.lever_m += Vector3::new(0.02, -0.01, 0.03);
        }),
    );
    same(
        "read-skew",
        Locality::Unit,
        0.0,
        &[1e-3],
        &changed_unit(|_, channel| {
            channel.slot_s += 1e-3 * (channel.slot_s / 7.425e-3).round();
        }),
    );
    same(
        "latency",
        Locality::Unit,
        0.0,
        &[0.03],
        &changed_unit(|_, channel| channel.slot_s -= 0.03),
    );
    same(
        "reference-lag",
        Locality::Unit,
        0.0,
        &[0.03],
        &changed_unit(|_, channel| channel.slot_s += 0.03),
    );
    let b = Vector3::new(0.4, -0.3, 0.8);
    same(
        "hard-iron",
        all,
        0.0,
        b.as_slice(),
        &changed_unit(|_, channel| {
            if channel.name.starts_with('m') {
                channel.bias += channel.axis_b.dot(&b);
            }
        }),
    );
}

#[test]
fn an_effect_of_the_site_is_a_changed_environment() {
    same(
        "gravity-value",
        Locality::Unit,
        0.0,
        &[0.05],
        &changed_site(|site| site.gravity += 0.05),
    );
    let change = Vector3::new(0.5, -0.2, 0.7);
    same(
        "field-model",
        Locality::Unit,
        0.0,
        change.as_slice(),
        &changed_site(|site| site.field_n_ut += change),
    );
}

#[test]
fn a_turned_unit_or_horizon_is_a_turned_motion() {
    let turn = Vector3::new(0.03, -0.02, 0.04);
    // The unit's own axes are R v_b: its attitude is q_nb R*, and its centre is where it was.
    let q = UnitQuaternion::from_scaled_axis(turn);
    let laboratory = Environment::laboratory();
    same("mounting", Locality::Unit, 0.0, turn.as_slice(), &{
        twin_of(emems(thesis_slot_s), laboratory, &Turned(UnitQuaternion::identity(), q))
    });
    // The reference's n is tilted: true attitude R q_nb, while the acceleration it tells stays in its own n.
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(0.02, -0.03, 0.0));
    let tilted = twin_of(
        emems(thesis_slot_s),
        laboratory,
        &Turned(tilt, UnitQuaternion::identity()),
    );
    same("table-tilt", Locality::Unit, 0.0, &[0.02, -0.03], &tilted);
}

/// The exercise with components of its quaternion reversed; rates are quotients of those.
struct Reversed([f64; 3]);

impl Reversed {
    fn q_nb(&self, t_s: f64) -> UnitQuaternion<f64> {
        let told = Exercise.at(t_s).attitude.q_nb;
        let vector = told.vector().component_mul(&Vector3::from(self.0));
        UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_parts(told.scalar(), vector))
    }

    fn rate_nb_b(&self, t_s: f64) -> Vector3<f64> {
        const STEP_S: f64 = 1e-4;
        let turned = self.q_nb(t_s - STEP_S).inverse() * self.q_nb(t_s + STEP_S);
        turned.scaled_axis() / (2.0 * STEP_S)
    }
}

impl Motion for Reversed {
    fn at(&self, t_s: f64) -> Pose {
        const STEP_S: f64 = 1e-3;
        let rate_dot_nb_b = (self.rate_nb_b(t_s + STEP_S) - self.rate_nb_b(t_s - STEP_S)) / (2.0 * STEP_S);
        Pose {
            attitude: Attitude {
                q_nb: self.q_nb(t_s),
                rate_nb_b: self.rate_nb_b(t_s),
                rate_dot_nb_b,
            },
            ..Exercise.at(t_s)
        }
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}

#[test]
fn an_attitude_with_a_wrong_sign_is_another_motion() {
    for signs in 1..8_u32 {
        let reversed = Reversed([0, 1, 2].map(|axis| if signs >> axis & 1 == 1 { -1.0 } else { 1.0 }));
        let truly = twin_of(emems(thesis_slot_s), Environment::laboratory(), &reversed);
        let (apart, whole) = compared("reference-sign", Locality::Unit, -f64::from(signs), &[], &truly);
        // A low-pass by two instants is wrong by (w tau)^4: a thousandth at 15 rad/s and 12 ms, which is where little moves.
        assert!(
            whole > 100.0 && apart < 4e-4 * whole,
            "{signs}: {apart} of {whole} sigmas"
        );
        let cause = Cause {
            effect: by_name("reference-sign").unwrap(),
            locality: Locality::Unit,
            variant: -f64::from(signs),
        };
        let retold = twin(SPARSE).retold(&cause).unwrap().predict(&[]);
        let apart = difference(&truly, &cause, &retold, &truly.predict(&[])).amax();
        assert!(apart < 4e-4 * whole, "{signs}: {apart} of {whole} sigmas");
    }
}

/// The exercise on a table that turns 1 % more about the vertical than it says.
struct Geared;

impl Motion for Geared {
    fn at(&self, t_s: f64) -> Pose {
        let told = Exercise.at(t_s);
        Pose {
            attitude: exercised(1.01, t_s),
            ..told
        }
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}

#[test]
fn a_geared_table_turns_further_than_its_record_says() {
    let geared = twin_of(emems(thesis_slot_s), Environment::laboratory(), &Geared);
    same("reference-rate-scale", Locality::Unit, 1.0, &[0.01], &geared);
}

#[test]
fn the_reading_order_is_that_of_the_slots_and_where_parts_have_clocks_that_of_the_file() {
    let own = changed_unit(|index, channel| {
        // Of parts with clocks of their own a slot is as old as the reading.
        channel.slot_s = if index % 2 == 0 { 0.013 } else { 0.002 };
        channel.instant_sigma_s = Some(0.004);
    });
    let cause = Cause {
        effect: by_name("read-skew").unwrap(),
        locality: Locality::Unit,
        variant: 0.0,
    };
    let late = own.channel(
        own.unit().channel("g2").unwrap(),
        &[Active {
            cause,
            theta: vec![1e-3],
        }],
    );
    // Four accelerometers, four magnetometers and a gyro are read before.
    let by_hand = {
        let mut unit = own.unit().clone();
        let index = unit.channel("g2").unwrap();
        unit.channels[index].slot_s += 9e-3;
        twin_of(unit, Environment::laboratory(), &Exercise)
            .channel(index, &[])
            .into_owned()
    };
    let apart = late.iter().zip(&by_hand).map(|(one, other)| (one - other).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-9);
}

#[test]
fn eddy_currents_delay_the_field_to_first_order() {
    let delayed = changed_unit(|_, channel| channel.slot_s -= if channel.name.starts_with('m') { 2e-3 } else { 0.0 });
    let (apart, whole) = compared("eddy-current", Locality::Unit, 0.0, &[2e-3], &delayed);
    assert!(apart < 0.01 * whole, "{apart} of {whole}");
}

#[test]
fn a_gradient_is_the_same_field_where_the_centre_is_and_another_at_the_plates() {
    // A unit carried along x in a gradient dBx/dx = 2 uT/m: its x reading rises by 2 uT for every metre, plates included.
    let nominal = twin(SPARSE);
    let cause = Cause {
        effect: by_name("field-gradient").unwrap(),
        locality: Locality::Unit,
        variant: 0.0,
    };
    let active = Active {
        cause,
        theta: vec![2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01],
    };
    let index = nominal.unit().channel("m4y").unwrap();
    let (with, without) = (predicted(&nominal, &active), nominal.predict(&[]));
    let [channel, plate, face] = ["m4y", "a4x", "a4z"].map(|name| {
        let index = nominal.unit().channel(name).unwrap();
        &nominal.unit().channels[index]
    });
    let place_b = plate.lever_m + 0.01 * face.axis_b;
    for ((with, without), feel) in with[index].iter().zip(&without[index]).zip(nominal.feels(index)) {
        let place_n = feel.position_n + feel.q_nb * place_b;
        let change_n = Vector3::new(2.0 * place_n.x, 0.0, -2.0 * place_n.z);
        assert!((with - without - channel.axis_b.dot(&feel.to_b(change_n))).abs() < 1e-9);
    }
}

#[test]
fn every_signed_order_of_axes_is_another_one() {
    let nominal = twin((3, 7.0));
    let effect = by_name("mag-axis-order").unwrap();
    let read = |variant: f64| {
        let cause = Cause {
            effect,
            locality: Locality::Group("plate 2".to_owned()),
            variant,
        };
        let readings = predicted(
            &nominal,
            &Active {
                cause,
                theta: Vec::new(),
            },
        );
        ["m2x", "m2y", "m2z"].map(|name| (readings[nominal.unit().channel(name).unwrap()][1] * 1e6) as i64)
    };
    let mut found: Vec<_> = effect.variants(nominal.starts_s()).into_iter().map(read).collect();
    found.push(read(0.0));
    let count = found.len();
    found.sort_unstable();
    found.dedup();
    assert_eq!((found.len(), count), (55, 55));
}
