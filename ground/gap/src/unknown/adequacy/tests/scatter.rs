//! What an effect on the scatter claims, and what is there.

use super::*;

/// What is left of these residuals if they are held to a law of the scatter of some channels.
fn held_to(channels: &[usize], of: &(dyn Fn(&mut [DVector<f64>], u64) + Sync), residuals: &[DVector<f64>]) -> Leftover {
    let (views, joint) = scene();
    judge(
        &views,
        &joint,
        &joint.fit(residuals),
        &[],
        Some(Disturb { channels, of }),
    )
}

fn says(left: &Leftover, what: &str) -> bool {
    left.aspects.iter().any(|aspect| aspect.what.contains(what))
}

/// A law of outliers anywhere in the range would else stand for any samples that are a little off.
#[test]
fn outliers_have_the_size_that_their_law_claims() {
    let anywhere = |residuals: &mut [DVector<f64>], seed: u64| {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (Ok(size), Ok(once)) = (Uniform::new(-2000.0, 2000.0), Uniform::new(0.0, 100.0)) else {
            return;
        };
        (residuals[0].iter_mut()).for_each(|value| {
            if once.sample(&mut random) < 1.0 {
                *value += size.sample(&mut random);
            }
        });
    };
    let p_with = |size: Option<f64>| {
        let mut residuals = noise(7);
        match size {
            Some(size) => (0..6).for_each(|k| residuals[0][100 * k + 37] += size),
            None => anywhere(&mut residuals, 5),
        }
        held_to(&[0], &anywhere, &residuals).p
    };
    assert!(p_with(None) > 0.05 && p_with(Some(9.0)) < 0.01);
}

/// A law of values that are anything has room for each of them, but not for their being what was read before.
#[test]
fn values_that_are_sent_again_are_not_anything() {
    let anything = |residuals: &mut [DVector<f64>], seed: u64| {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (Ok(size), Ok(once)) = (Uniform::new(-20.0, 20.0), Uniform::new(0.0, 100.0)) else {
            return;
        };
        for value in residuals[0].iter_mut() {
            if once.sample(&mut random) < 1.5 {
                *value = size.sample(&mut random);
            }
        }
    };
    let unlike = |again: bool| {
        let (views, _) = scene();
        let mut residuals = noise(7);
        if again {
            let predicted = &views[0].predicted;
            (20..SAMPLES).step_by(60).for_each(|row| {
                residuals[0][row] = predicted[row - 1] + residuals[0][row - 1] - predicted[row];
            });
        } else {
            anything(&mut residuals, 5);
        }
        says(
            &held_to(&[0], &anything, &residuals),
            "the distance from the sample before",
        )
    };
    assert!(unlike(true) && !unlike(false));
}

/// Gyros wander each by itself; what all of them follow, a supply, is no walk.
#[test]
fn a_course_that_all_follow_is_not_each_ones_own() {
    let walk = |seed: u64| -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut level = 0.0;
        let mut next = |_| {
            let step: f64 = StandardNormal.sample(&mut random);
            level += 0.2 * step;
            level
        };
        (0..SAMPLES).map(&mut next).collect()
    };
    let each_its_own = |residuals: &mut [DVector<f64>], seed: u64| {
        for (channel, residual) in (0..).zip(residuals) {
            *residual += DVector::from_vec(walk(seed.wrapping_add(channel)));
        }
    };
    let together = |is_one: bool| {
        let mut residuals = noise(7);
        if is_one {
            let common = DVector::from_vec(walk(5));
            (residuals.iter_mut().zip([1.0, -0.7, 1.4])).for_each(|(residual, part)| *residual += &common * part);
        } else {
            each_its_own(&mut residuals, 5);
        }
        says(&held_to(&[0, 1, 2], &each_its_own, &residuals), "one way together")
    };
    assert!(together(true) && !together(false));
}

/// That they are not there is said of the energy; of a size nothing can be said.
#[test]
fn outliers_that_are_not_there_have_no_size() {
    let blows = |residuals: &mut [DVector<f64>], _: u64| {
        (0..6).for_each(|k| residuals[0][100 * k + 37] += 9.0);
    };
    let left = held_to(&[0], &blows, &noise(7));
    assert!(says(&left, "not the energy"), "{:?}", left.aspects);
    assert!(!says(&left, "not the size"), "{:?}", left.aspects);
}

#[test]
fn an_effect_on_the_scatter_is_held_to_the_energy_that_it_claims() {
    let swings = |residuals: &mut [DVector<f64>], seed: u64| {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut level = 0.0;
        (residuals[0].iter_mut()).for_each(|value| {
            let step: f64 = StandardNormal.sample(&mut random);
            level = 0.9 * level + 0.4 * step;
            *value += level;
        });
    };
    let p_with = |there: bool| {
        let mut residuals = noise(7);
        if there {
            swings(&mut residuals, 5);
        }
        held_to(&[0], &swings, &residuals).p
    };
    assert!(p_with(true) > 0.05 && p_with(false) < 0.01);
}

#[test]
fn noise_that_comes_and_goes_in_all_of_a_kind_is_seen_where_it_is_weak_in_each() {
    // Half a sigma more, in an eighth of the time.
    let left = judged(|_, residual| {
        (residual.iter_mut().enumerate()).for_each(|(row, value)| *value *= if row / 20 % 8 == 3 { 1.6 } else { 1.0 });
    });
    let first = &left.aspects[0].what;
    assert!(
        left.p < 0.01 && first.contains("gyros: noise that comes and goes"),
        "{left:?}"
    );
}
