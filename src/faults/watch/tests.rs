//! The edges of what is held of one axis.

use super::*;
use crate::faults::trace::{LONG, Systematic};

const ALLOWED: f32 = 0.04;
const LIMITS: Limits = Limits {
    short: 5.0,
    long: 5.0,
    squares: 90.0,
};

/// An axis that has agreed for a full window, with this offset learnt.
fn quiet(offset: f32) -> (Watch, Systematic) {
    let (mut watch, mut systematic) = (Watch::new(1e-4, ALLOWED, 1e-4), Systematic::NONE);
    for _ in 0..LONG {
        let place = systematic.push(0.0);
        watch.note(place, 0.0, 1.0, 0.0);
    }
    watch.offset = offset;
    (watch, systematic)
}

/// The parts of six standard deviations of the calibration, 1.2.
#[test]
fn an_offset_that_creeps_is_learnt_up_to_three_quarters_of_what_it_may_be() {
    for side in [-1.0, 1.0] {
        for (part, learns) in [(0.0, true), (0.7, true), (0.74, true), (0.76, false), (1.1, false)] {
            let (mut watch, systematic) = quiet(side * part * 1.2);
            let added = systematic.added();
            let mut other = watch;
            let bounds = systematic.bounds(LIMITS, &added, QUIET, 1.0);
            assert_eq!(watch.learn_quietly(0.01, 1.0, &bounds).is_some(), learns, "{part}");
            let alarm = other.learn(0.01, 1.0, LIMITS, &added);
            assert!((alarm - part * part).abs() < 0.01, "{part}: {alarm}");
            for watch in [watch, other] {
                assert_eq!(watch.offset != side * part * 1.2, learns, "{part}");
            }
        }
    }
}

/// An offset beyond what it may be is given up with the axis, another is kept.
#[test]
fn an_axis_that_is_excluded_keeps_an_offset_that_may_be() {
    for (part, kept) in [(0.99, true), (-0.99, true), (1.01, false), (-1.01, false)] {
        let (mut watch, _) = quiet(part * 1.2);
        watch.exclude(Verdict::Disagreeing);
        assert_eq!(watch.offset, if kept { part * 1.2 } else { 0.0 });
        assert!(watch.excluded() && !watch.seen_long());
        // The name may change, the offset stands.
        watch.offset = 2.0;
        watch.exclude(Verdict::Frozen);
        assert_eq!((watch.offset, watch.verdict), (2.0, Verdict::Frozen));
    }
}

/// From the third strike on an alarm is as loud as there were threes of them.
#[test]
fn strikes_in_a_row_are_an_alarm() {
    let (mut watch, systematic) = quiet(0.0);
    let alarm = |watch: &Watch| watch.alarm(LIMITS, &systematic.added());
    for strikes in 1..=6_u8 {
        watch.strike(true);
        let thirds = f32::from(strikes) / 3.0;
        let expected = if strikes < 3 { 0.0 } else { thirds * thirds };
        assert!((alarm(&watch) - expected).abs() < 1e-5, "{strikes}: {}", alarm(&watch));
    }
    watch.strike(false);
    assert_eq!(alarm(&watch), 0.0);
}
