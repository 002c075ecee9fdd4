//! Effects by which what is read is of the past: packets lost, and what follows in its own time.

use super::*;

#[test]
fn a_packet_that_is_lost_takes_all_sensors_of_it_thermometers_too() {
    /// The first row that is another's.
    const LOST: usize = 300;
    let nominal = twin(DENSE);
    let loss = Active {
        cause: Cause {
            effect: by_name("packet-loss").unwrap(),
            locality: Locality::Unit,
            variant: DENSE.1 * LOST as f64,
        },
        theta: vec![DENSE.1],
    };
    let (with, without) = (nominal.predict(&[loss]), nominal.predict(&[]));
    for (channel, (with, without)) in nominal.unit().channels.iter().zip(with.iter().zip(&without)) {
        let resolved = 1e-6 * channel.sigma();
        let apart = |rows: core::ops::Range<usize>, later: usize| {
            rows.map(|row| (with[row] - without[row + later]).abs())
                .fold(0.0, f64::max)
        };
        assert!(apart(0..LOST, 0) < resolved, "{}", channel.name);
        assert!(apart(LOST..DENSE.0 - 1, 1) < resolved, "{}", channel.name);
        assert!(
            apart(LOST..DENSE.0 - 1, 0) > 1e3 * resolved,
            "{} is not moved",
            channel.name
        );
    }
}

#[test]
fn a_die_that_follows_is_as_far_behind_as_a_low_pass_of_a_sine_says() {
    const TAU_S: f64 = 10.0;
    const K: f64 = 1e-3;
    // The exercise's temperature, 12 degC sin(w t); its slope through 1 / (1 + tau s).
    const W: f64 = 0.031;
    let behind = |t_s: f64| {
        let (sine, cosine) = (W * t_s).sin_cos();
        12.0 * W * (cosine + W * TAU_S * sine) / (1.0 + (W * TAU_S).powi(2))
    };
    let twin = twin(SPARSE);
    let active = Active {
        cause: Cause {
            effect: by_name("gyro-temperature-hysteresis").unwrap(),
            locality: Locality::All,
            variant: TAU_S,
        },
        theta: vec![K; 4],
    };
    let gyro = active.cause.channels(twin.unit())[0];
    let with = twin.channel(gyro, std::slice::from_ref(&active)).into_owned();
    let (nominal, channel) = (twin.channel(gyro, &[]), &twin.unit().channels[gyro]);
    let rows = with.iter().zip(nominal.iter()).zip(twin.starts_s());
    // The die begins settled, and the sine in the middle of it.
    for ((with, without), t_s) in rows.filter(|(_, t_s)| **t_s > 12.0 * TAU_S) {
        let expected = K * behind(t_s + channel.slot_s - channel.tau_s());
        assert!(
            (with - without - expected).abs() < 1e-5 * K * 12.0 * W,
            "{t_s} s: {} {expected}",
            with - without
        );
    }
}
