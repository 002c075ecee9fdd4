//! Who goes first, and who may not.

use super::*;
use crate::geometry::triad_axes_b;

const VECTOR_B: Vector3<f32> = Vector3::new(3.0, -2.0, 9.0);

/// Twelve axes that agree, with these variances, but for some that are off.
fn seen(variances: [f32; 12], off: &[(usize, f32)]) -> [Seen; 12] {
    let axes_b = triad_axes_b();
    let mut seen = core::array::from_fn(|k| Seen {
        value: axes_b[k].dot(&VECTOR_B),
        variance: variances[k],
        ..Seen::default()
    });
    for (k, by) in off {
        seen[*k].value += by;
    }
    seen
}

/// Of axes that are alike each beyond the gate goes: `r / sqrt(v (1 - l))` with a leverage of a quarter.
#[test]
fn an_axis_goes_beyond_six_standard_deviations() {
    for k in 0..12 {
        for side in [-1.0, 1.0] {
            // Residual by the fault: three quarters of it, over the root of three quarters.
            let most = side * GATE / 0.866_025_4;
            for (part, goes) in [(0.995, false), (1.005, true)] {
                let mut seen = seen([1.0; 12], &[(k, part * most)]);
                let mut solution = Solution::NOTHING;
                assert!(agreed(&triad_axes_b(), &mut seen, 0xFFF, &mut solution));
                let expected = if goes { 0xFFF & !(1 << k) } else { 0xFFF };
                assert_eq!(solution.used, expected, "{k} {part}");
                // Held against the vector of those that agree.
                let off = seen[k].off.0;
                let by = if goes { part * most } else { 0.75 * part * most };
                assert!((off - by).abs() < 1e-3, "{k}: {off}");
            }
        }
    }
}

/// Of two the one that is further off goes first, and both are out at the end.
#[test]
fn two_wild_axes_on_two_plates_are_both_out() {
    for k in 0..6 {
        for j in 6..12 {
            let mut seen = seen([1.0; 12], &[(k, 40.0), (j, -300.0)]);
            let mut solution = Solution::NOTHING;
            assert!(agreed(&triad_axes_b(), &mut seen, 0xFFF, &mut solution));
            assert_eq!(solution.used, 0xFFF & !(1 << k | 1 << j));
            assert!((solution.vector_b - VECTOR_B).norm() < 1e-3);
        }
    }
}

/// An axis that all but explains itself is not checked: the others disagree with it.
#[test]
fn an_axis_that_explains_itself_is_not_out() {
    let mut variances = [1.0; 12];
    // Others say a third of what it says itself, and of that a hundredth.
    variances[0] = 0.01;
    let mut seen = seen(variances, &[(0, 20.0)]);
    let mut solution = Solution::NOTHING;
    agreed(&triad_axes_b(), &mut seen, 0xFFF, &mut solution);
    assert_eq!(solution.used & 1, 1);
    assert!(Disagreement::of(&seen[0], true).is_none());
}

/// Without redundancy it is not decidable who is off.
#[test]
fn with_three_axes_and_one_more_it_is_decided_and_with_three_it_is_not_asked() {
    let mut seen = seen([1.0; 12], &[(0, 50.0)]);
    let mut solution = Solution::NOTHING;
    assert!(agreed(&triad_axes_b(), &mut seen, 0b111, &mut solution));
    assert_eq!((solution.used, solution.known), (0b111, Known::All));
    assert!(agreed(&triad_axes_b(), &mut seen, 0b011, &mut solution));
    assert_ne!(solution.known, Known::All);
    // A residual is a disagreement with the vector without the axis.
    let used = Seen {
        value: 0.0,
        variance: 2.0,
        off: (3.0, 0.5),
    };
    let with = Disagreement::of(&used, true).expect("redundancy");
    assert_eq!((with.by, with.share), (4.0, 1.0 / 0.75));
    let without = Disagreement::of(&used, false).expect("held against others");
    assert_eq!((without.by, without.share), (3.0, 1.25));
}
