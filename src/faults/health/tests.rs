//! The word, bit by bit.

use super::*;

#[test]
fn the_word_says_of_each_axis_whether_it_is_used() {
    for n in 0..CHANNELS as u8 {
        let channel = Channel(n);
        let (kind, k) = match n {
            0..12 => (Kind::Accelerometer, n),
            12..24 => (Kind::Magnetometer, n - 12),
            _ => (Kind::Gyro, n - 24),
        };
        let health = SensorHealth::CALIBRATION.unused(kind, 1 << k);
        assert_eq!(health.0, 1 << 31 | 1 << n);
        assert_eq!(health.unused_channels(), Channels(1 << n));
        for other in 0..CHANNELS as u8 {
            assert_eq!(health.uses(Channel(other)), other != n, "{other}");
        }
        assert!(!health.uses(channel) && SensorHealth::GYROS.uses(channel));
        // What is not used stays so.
        assert_eq!(health.unused(kind, 1 << k), health);
    }
    assert_eq!(SensorHealth(u32::MAX).unused_channels(), Channels::ALL);
}

#[test]
fn what_is_not_isolable_has_a_bit_of_its_own() {
    let all = [
        SensorHealth::ACCELEROMETERS,
        SensorHealth::MAGNETOMETERS,
        SensorHealth::GYROS,
        SensorHealth::CALIBRATION,
    ];
    for (k, one) in all.into_iter().enumerate() {
        assert_eq!(one.0, 1 << (28 + k));
        let (with, without) = (SensorHealth(3).with_if(one, true), SensorHealth(3).with_if(one, false));
        assert_eq!((with.0, without.0), (3 | one.0, 3));
        assert_eq!(with.with_if(one, true), with);
        for other in all {
            assert_eq!(with.contains(other), other == one);
        }
        assert!(!without.contains(one) && with.contains(SensorHealth(3)) && !with.contains(SensorHealth(7)));
    }
    assert!(SensorHealth(7).contains(SensorHealth(5)) && !SensorHealth(5).contains(SensorHealth(7)));
    let unnamed = |verdict: Verdict| verdict.is_unnamed();
    assert!(unnamed(Verdict::Disagreeing) && unnamed(Verdict::Biased) && unnamed(Verdict::Noisy));
    assert!(
        ![Verdict::Sound, Verdict::Reversed, Verdict::Exchanged, Verdict::Frozen]
            .into_iter()
            .any(unnamed)
    );
}
