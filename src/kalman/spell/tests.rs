//! Each rule of the page by itself, just within its bound and just beyond it.

use super::*;

const PARAMS: Params = Params {
    field_gate: 0.5,
    gate: 4.0,
    disturbance: 0.5,
    recovery_s: 5.0,
    ..Params::ROOM
};

/// Nothing to see: an attitude and a reference that explain a residual of a quarter each, squared.
const NOTHING: Shown = Shown {
    duration_s: 1.0,
    disturbance: 0.0,
    residual: 0.0,
    of_state: 0.0625,
    of_reference: 0.0625,
    horizontal: 0.5,
};

fn disturbed(disturbance: f32) -> Shown {
    Shown { disturbance, ..NOTHING }
}

fn contradicted(residual: f32) -> Shown {
    Shown { residual, ..NOTHING }
}

#[test]
fn a_spell_begins_beyond_either_gate() {
    let begins = |shown: Shown| {
        let mut spell = Spell::default();
        let used = spell.go_on(&PARAMS, &shown);
        // Its variance is more than that of the attitude: the field is not used.
        assert_eq!(used, !spell.lasts());
        spell.lasts()
    };
    assert!(!begins(NOTHING));
    assert!(!begins(disturbed(0.25)) && begins(disturbed(0.2501)));
    // Four standard deviations of 0.125: 4 sqrt(0.125).
    let most = 4.0 * nalgebra::ComplexField::sqrt(0.125_f32);
    for sign in [-1.0, 1.0] {
        assert!(!begins(contradicted(sign * 0.999 * most)) && begins(contradicted(sign * 1.001 * most)));
    }
    let exactly = Shown {
        of_state: 0.25,
        of_reference: 0.0,
        ..contradicted(2.0)
    };
    assert!(!begins(exactly));
}

/// It ends when nothing was shown for as long as recovery takes, and not before.
#[test]
fn a_spell_ends_after_calm_without_a_break() {
    let mut spell = Spell::default();
    spell.go_on(&PARAMS, &disturbed(1.0));
    for break_after in [1, 4] {
        (0..break_after).for_each(|_| assert!(!spell.go_on(&PARAMS, &NOTHING) && spell.lasts()));
        assert!(!spell.go_on(&PARAMS, &disturbed(1.0)));
    }
    (0..4).for_each(|_| assert!(!spell.go_on(&PARAMS, &NOTHING) && spell.lasts()));
    assert!(spell.go_on(&PARAMS, &NOTHING) && !spell.lasts());
    // Out of a spell nothing counts towards its end.
    for _ in 0..20 {
        assert!(spell.go_on(&PARAMS, &NOTHING));
    }
    assert!(!spell.go_on(&PARAMS, &disturbed(1.0)));
    assert!(!spell.go_on(&PARAMS, &NOTHING) && spell.lasts());
}

/// The field is used with the most that it has shown, once the attitude is known no better.
#[test]
fn a_spell_has_the_variance_of_the_most_it_has_shown() {
    let shows = |shown: &[Shown]| {
        let mut spell = Spell::default();
        let used = shown.iter().fold(true, |_, shown| spell.go_on(&PARAMS, shown));
        (spell.noise(1.0).alone, used)
    };
    // Norm and dip: half of it, squared. The heading: what the attitude's own variance leaves.
    assert_eq!(shows(&[disturbed(0.5)]), (0.125, false));
    assert_eq!(shows(&[contradicted(2.0)]), (4.0 - 0.0625, false));
    assert_eq!(
        shows(&[contradicted(2.0), disturbed(0.5), contradicted(1.5)]),
        (4.0 - 0.0625, false)
    );
    let unsure = |of_state: f32| Shown {
        of_state,
        ..disturbed(0.5)
    };
    assert_eq!(shows(&[unsure(0.125)]), (0.125, false));
    assert_eq!(shows(&[unsure(0.126)]), (0.125, true));
    // All windows of it are one witness.
    let mut spell = Spell::default();
    for _ in 0..3 {
        spell.go_on(&PARAMS, &disturbed(0.5));
    }
    assert_eq!(
        (spell.noise(1.0).lasting, spell.noise(0.5).lasting),
        (3.0 * 0.125, 6.0 * 0.125)
    );
}

/// What the gyros come to explain contradicts still while it is nearer to the most than to nothing.
#[test]
fn a_contradiction_goes_on_until_it_is_less_than_half() {
    let explained = |residual: f32| Shown {
        of_state: 9.0,
        ..contradicted(residual)
    };
    let lasts_on = |residual: f32| {
        let mut spell = Spell::default();
        spell.go_on(&PARAMS, &contradicted(3.0));
        spell.go_on(&PARAMS, &contradicted(2.0));
        spell.go_on(&PARAMS, &explained(residual));
        spell.calm_s == 0.0
    };
    assert!(lasts_on(1.51) && !lasts_on(1.5) && !lasts_on(1.49));
    // That of a spell of norm and dip alone is none.
    let mut spell = Spell::default();
    spell.go_on(&PARAMS, &disturbed(1.0));
    spell.go_on(&PARAMS, &explained(0.1));
    assert_eq!((spell.calm_s, spell.contradiction), (1.0, 0.0));
    // And not that of the spell before.
    let mut spell = Spell::default();
    spell.go_on(&PARAMS, &contradicted(3.0));
    for _ in 0..5 {
        spell.go_on(&PARAMS, &NOTHING);
    }
    assert!(!spell.lasts() && spell.go_on(&PARAMS, &explained(2.0)));
}

/// With the times as odds: `c^2 T_other / (T_believed + T_other)`.
#[test]
fn the_doubt_is_the_contradiction_by_the_odds() {
    let mut spell = Spell::default();
    assert_eq!(spell.doubt(), 0.0);
    // The field stood by the attitude for six seconds.
    for accepted in [true, true, false, true] {
        spell.go_on(&PARAMS, &NOTHING);
        assert_eq!(spell.judge(accepted, 2.0), Some(accepted));
    }
    assert_eq!((spell.stood_by_s, spell.doubt()), (6.0, 0.0));
    // About the vertical the residual is as much more as the field is less than all horizontal.
    for second in 1..=6 {
        spell.go_on(&PARAMS, &contradicted(2.0));
        let contradicted_s = second as f32;
        assert_eq!(spell.doubt(), 16.0 * contradicted_s / (6.0 + contradicted_s));
        let says = spell.judge(false, 1.0);
        assert_eq!(says, (second == 6).then_some(false), "{second}");
    }
    // In calm, and after norm and dip have shown a disturbance, it says nothing.
    let mut calm = spell;
    calm.go_on(&PARAMS, &NOTHING);
    assert_eq!(calm.judge(false, 1.0), None);
    let mut disturbance = spell;
    disturbance.go_on(&PARAMS, &disturbed(1.0));
    assert_eq!((disturbance.judge(false, 1.0), disturbance.doubt()), (None, 0.0));
    let mut young = Spell::default();
    young.go_on(&PARAMS, &disturbed(1.0));
    assert_eq!((young.judge(false, 1.0), young.judge(true, 1.0)), (None, None));
    // The attitude is given up: the field has stood by the new one for as long as it had contradicted the old one.
    let mut given_up = spell;
    given_up.have_other_attitude(true);
    assert!(!given_up.lasts());
    assert_eq!(given_up.doubt(), 16.0 * 6.0 / (6.0 + 6.0));
    given_up.judge(true, 4.0);
    assert_eq!(given_up.doubt(), 16.0 * 6.0 / (6.0 + 10.0));
    // Found afresh for another reason: nothing is held against it.
    let mut other = spell;
    other.have_other_attitude(false);
    assert_eq!((other.stood_by_s, other.given_up_s), (0.0, 0.0));
}
