use super::*;
use crate::answer::Cause;

fn judged(ring: &str, truth: &[&str], verdict: Option<&str>) -> Judged {
    let cause = |name: &&str| Cause {
        snr_withheld: None,
        effect: name.to_string(),
        in_library: true,
        channels: vec!["g1".into()],
        strength: 1.0,
        snr_marginal: None,
        sizes: Vec::new(),
        attitude_deg: None,
        gap_growth: None,
    };
    Judged {
        answer: Answer {
            case: "T".into(),
            attitudes: Vec::new(),
            ring: ring.into(),
            seed: 0,
            effects: truth.iter().map(cause).collect(),
            snr_marginal: 20.0,
            source: None,
        },
        verdict: verdict.map(|text| serde_json::from_str(text).expect("a verdict")),
        channels: Some(9),
    }
}

fn value(lines: &[Line], what: &str) -> f64 {
    lines.iter().find(|line| line.what == what).expect(what).value
}

const RIGHT: &str = r#"{"causes":[{"effect":"gyro-bias","channels":["g1"],"probability":0.9}],"none_of_these":0.02,
    "alternatives":[{"effect":"gyro-g2","probability":0.08}],"shrink":{"percent":97.0}}"#;
const WRONG: &str = r#"{"causes":[{"effect":"gyro-g2","channels":["g1","g2"],"probability":0.9}],
    "indistinguishable":[["gyro-bias","gyro-g2"]],"none_of_these":0.0}"#;
const UNKNOWN: &str = r#"{"causes":[],"none_of_these":0.9}"#;
const NOTHING: &str = r#"{"causes":[],"none_of_these":0.01}"#;

#[test]
fn right_and_wrong_names_are_told_apart() {
    let lines = table(&[
        judged("R1", &["gyro-bias"], Some(RIGHT)),
        judged("R1", &["gyro-bias"], Some(WRONG)),
    ]);
    assert_eq!(value(&lines, "top-1"), 0.5);
    assert_eq!(value(&lines, "truth in declared set of at most 3"), 1.0);
    assert_eq!(value(&lines, "gap detected (one effect)"), 1.0);
    assert_eq!(value(&lines, "mean probability on the truth"), 0.45);
    assert!((value(&lines, "localisation F1 (channels)") - (1.0 + 2.0 / 3.0) / 2.0).abs() < 1e-12);
}

#[test]
fn sizes_are_held_against_what_they_were() {
    let stated = r#"{"causes":[{"effect":"gyro-bias","channels":["g1","g2"],"probability":0.9,"parameters":{
        "b_g1":{"value":0.0103,"sigma":0.0001},"b_g2":{"value":0.0196,"sigma":0.0001}}}],
        "shrink":{"hold_before":2.0,"percent":97.0}}"#;
    let mut case = judged("R1", &["gyro-bias"], Some(stated));
    case.answer.snr_marginal = 40.0;
    let size = |channel: &str, value: f64| crate::answer::Size {
        parameter: "b".into(),
        channel: Some(channel.into()),
        value,
    };
    case.answer.effects[0].sizes = vec![size("g1", 0.01), size("g2", 0.02)];
    let lines = table(std::slice::from_ref(&case));
    // (0.3, 0.4) of (10, 20) mrad/s.
    let error = value(&lines, "median error of the parameters [%], SNR >= 30");
    assert!((error - 100.0 * 0.5 / 500f64.sqrt()).abs() < 1e-9, "{error}");
    // Two parameters of some 220 sigmas together leave nothing to be seen: all shrinks, and three points did not.
    let off = value(&lines, "median of predicted less achieved shrink [points], SNR >= 15");
    assert!((off - 3.0).abs() < 0.02, "{off}");
    let mut oracle = case.clone();
    oracle
        .verdict
        .as_mut()
        .and_then(|verdict| verdict.shrink.as_mut())
        .expect("given")
        .percent = Some(100.0);
    assert_eq!(efficiency(&[case], &[oracle]).value, 0.97);
}

#[test]
fn a_sensor_is_found_by_any_of_its_axes() {
    let mut case = judged("R1", &["accel-bias"], Some(RIGHT));
    case.answer.effects[0].channels = ["a3x", "a3y", "a3z"].map(str::to_owned).into();
    let verdict = case.verdict.as_mut().expect("given");
    verdict.causes[0].channels = vec!["a3y".into(), "a4y".into()];
    let lines = table(&[case]);
    // One sensor of two named is right, and the one there is is named; of the axes one of three.
    assert!((value(&lines, "localisation F1 (sensors)") - 2.0 / 3.0).abs() < 1e-12);
    assert!((value(&lines, "localisation F1 (channels)") - 2.0 / 5.0).abs() < 1e-12);
}

#[test]
fn a_name_where_there_is_none_is_false() {
    let lines = table(&[
        judged("R0", &[], Some(RIGHT)),
        judged("R0", &[], Some(NOTHING)),
        judged("R3", &["slow-tone"], Some(RIGHT)),
        judged("R3", &["slow-tone"], Some(UNKNOWN)),
    ]);
    assert_eq!(value(&lines, "false name, nothing wrong"), 0.5);
    assert_eq!(value(&lines, "unknown called, nothing wrong"), 0.0);
    assert_eq!(value(&lines, "false name, novel"), 0.5);
    assert_eq!(value(&lines, "none of these, novel"), 0.5);
}

#[test]
fn giving_up_counts_against_the_tool() {
    let lines = table(&[
        judged("R0", &[], None),
        judged("R1", &["gyro-bias"], None),
        judged("R3", &["slow-tone"], None),
    ]);
    for (what, worst) in [
        ("false name, nothing wrong", 1.0),
        ("top-1", 0.0),
        ("false name, novel", 1.0),
        ("none of these, novel", 0.0),
    ] {
        assert_eq!(value(&lines, what), worst, "{what}");
    }
}

#[test]
fn two_effects_are_counted_one_by_one() {
    let both = r#"{"causes":[{"effect":"gyro-bias","probability":0.9},{"effect":"lever-arm","probability":0.9},
        {"effect":"gyro-bias","probability":0.8}]}"#;
    let lines = table(&[
        judged("R4", &["gyro-bias", "hard-iron"], Some(both)),
        judged("R4", &["gyro-bias", "lever-arm"], Some(both)),
    ]);
    assert_eq!(value(&lines, "R4: precision"), 0.75);
    assert_eq!(value(&lines, "R4: recall"), 0.75);
}

#[test]
fn of_two_effects_one_that_is_hardly_there_is_not_missed() {
    let one = r#"{"causes":[{"effect":"gyro-bias","probability":0.9}]}"#;
    let mut case = judged("R4", &["gyro-bias", "gyro-g2"], Some(one));
    for (ratio, recall) in [(2.0, 1.0), (MARGINAL_SNR, 0.5)] {
        case.answer.effects[1].snr_marginal = Some(ratio);
        let lines = table(std::slice::from_ref(&case));
        assert_eq!(value(&lines, "R4: recall"), recall);
        assert_eq!(value(&lines, "R4: precision"), 1.0);
    }
}

#[test]
fn a_withheld_effect_that_is_given_a_neighbours_name_is_false() {
    let lines = table(&[
        judged(WITHHELD, &["gyro-bias"], Some(WRONG)),
        judged(WITHHELD, &["gyro-bias"], Some(UNKNOWN)),
        judged(WITHHELD, &["gyro-bias"], Some(NOTHING)),
    ]);
    assert!((value(&lines, "false name, withheld") - 1.0 / 3.0).abs() < 1e-12);
    assert!((value(&lines, "none of these, withheld") - 1.0 / 3.0).abs() < 1e-12);
}

#[test]
fn the_set_of_ninety_percent_is_the_likeliest_names_that_reach_it() {
    let lines = table(&[
        judged("R1", &["gyro-g2"], Some(RIGHT)),
        judged("R1", &["gyro-bias"], Some(RIGHT)),
        judged("R1", &["gyro-bias"], Some(UNKNOWN)),
    ]);
    // The first name has 0.9 alone.
    assert!((value(&lines, "90 % set holds the truth") - 1.0 / 3.0).abs() < 1e-12);
}

#[test]
fn a_false_name_is_one_beside_a_flag_too() {
    let flagged = r#"{"causes":[{"effect":"gyro-g2","probability":0.9}],"none_of_these":1.0,"outcome":"partly-named",
        "remainder":{"matters":0.8}}"#;
    let lines = table(&[
        judged("R3", &["slow-tone"], Some(flagged)),
        judged("R7", &["gyro-g2"], Some(flagged)),
    ]);
    assert_eq!(value(&lines, "false name, novel"), 0.0);
    assert_eq!(value(&lines, "R3: false name, flag or not"), 1.0);
    assert_eq!(value(&lines, "R7: false name, flag or not"), 0.0);
    assert_eq!(value(&lines, "R7: top-1"), 1.0);
}

#[test]
fn what_is_left_matters_by_what_no_name_covers() {
    let verdict =
        r#"{"causes":[{"effect":"gyro-bias","probability":0.9}],"outcome":"named","remainder":{"matters":0.2}}"#;
    let case = |unsaid: &str, attitude_deg: f64, growth: f64| {
        let mut case = judged("R7", &["gyro-bias", unsaid], Some(verdict));
        case.answer.effects[1].attitude_deg = Some(attitude_deg);
        case.answer.effects[1].gap_growth = Some(growth);
        case.answer.effects[0].attitude_deg = Some(9.0);
        case.answer.effects[0].gap_growth = Some(9.0);
        case
    };
    let so = |case: &Judged| statements::matters(&case.answer, case.verdict.as_ref().expect("given"));
    assert_eq!(so(&case("hard-iron", 0.2, 0.01)), Some(false));
    assert_eq!(so(&case("hard-iron", 0.6, 0.01)), Some(true));
    assert_eq!(so(&case("hard-iron", 0.2, 0.06)), Some(true));
    assert_eq!(so(&case("gyro-bias", 9.0, 9.0)), Some(false));
    let mut unknown = case("hard-iron", 0.2, 0.01);
    unknown.answer.effects[1].gap_growth = None;
    assert_eq!(so(&unknown), None);
    // Of what is said to matter with 0.2 and does, 0.8 is off.
    assert!((value(&table(&[case("hard-iron", 0.6, 0.01)]), "Brier of matters") - 0.64).abs() < 1e-12);
}

/// What is plain and too small to care about may be called clean: it is counted beside what matters, not among it.
#[test]
fn what_does_not_matter_is_counted_for_itself() {
    let named =
        r#"{"causes":[{"effect":"hard-iron","probability":0.9}],"outcome":"named","remainder":{"matters":0.0}}"#;
    let flagged = r#"{"causes":[],"outcome":"unknown","remainder":{"matters":0.9}}"#;
    let case = |in_library: bool, attitude_deg: f64, verdict: &str| {
        let mut case = judged("R7", &["hard-iron"], Some(verdict));
        let effect = &mut case.answer.effects[0];
        (effect.in_library, effect.attitude_deg, effect.gap_growth) = (in_library, Some(attitude_deg), Some(0.0));
        case
    };
    let lines = table(&[
        case(true, 0.6, named),
        case(true, 0.1, NOTHING),
        case(false, 0.6, flagged),
        case(false, 0.1, NOTHING),
    ]);
    assert_eq!(value(&lines, "R7: top-1"), 0.5);
    assert_eq!(value(&lines, "R7: top-1, of what matters"), 1.0);
    assert_eq!(value(&lines, "R3, R7: novel, said to matter"), 0.5);
    assert_eq!(value(&lines, "R3, R7: novel that matters, said to matter"), 1.0);
}

#[test]
fn an_interval_is_held_against_the_windows_kept_back() {
    let verdict = |after: f64| {
        format!(
            r#"{{"gap":{{"floor":1.0}},"shrink":{{"hold_after":{after}}},"remainder":{{"channels":["mx","my","mz"],
            "sigma":{{"interval_90":[0.5,0.7]}}}}}}"#
        )
    };
    let held = |after: f64| statements::is_held(&judged("R0", &[], Some(&verdict(after))));
    // A third of nine channels scatters by 0.6 sigma more: sqrt(1 + 0.36 / 3).
    assert_eq!(held(1.12f64.sqrt()), Some(true));
    assert_eq!(held(1.0), Some(false));
    assert_eq!(statements::is_held(&judged("R0", &[], Some(NOTHING))), None);
}

#[test]
fn nothing_wrong_is_a_statement_with_a_probability() {
    let verdict = r#"{"causes":[{"effect":"gyro-bias","probability":0.5}],"remainder":{"matters":0.2}}"#;
    let all = statements::of(&judged("R0", &[], Some(verdict)));
    let clean = all
        .iter()
        .find(|one| one.what == statements::What::Clean)
        .expect("stated");
    assert!((clean.probability - 0.4).abs() < 1e-12 && clean.is_so);
    assert_eq!(all.len(), 3);
}

/// A case without its motion, with this ratio left, and what was said.
fn withheld(truth: &[&str], left: f64, verdict: &str) -> Judged {
    let mut case = judged("R8", truth, Some(verdict));
    for cause in &mut case.answer.effects {
        cause.snr_withheld = Some((0.5 * left, Some(left)));
    }
    case
}

#[test]
fn without_the_motion_what_is_visible_is_asked_for_and_what_is_not_must_stay_unnamed() {
    let lines = table(&[
        withheld(&["gyro-bias"], 9.0, RIGHT),
        withheld(&["gyro-bias"], 9.0, WRONG),
        withheld(&["gyro-bias"], 6.0, NOTHING),
        withheld(&["latency"], 0.5, RIGHT),
        withheld(&["latency"], 0.5, NOTHING),
        withheld(&[], 0.0, NOTHING),
    ]);
    assert_eq!(value(&lines, "R8: visible at 8 and more, top-1"), 0.5);
    assert_eq!(value(&lines, "R8: visible at 8 and more, top-1 or declared set"), 1.0);
    assert_eq!(value(&lines, "R8: visible at 5 to 8, top-1"), 0.0);
    assert_eq!(value(&lines, "R8: not visible (below 3), something named"), 0.5);
    assert_eq!(value(&lines, "R8: nothing wrong, false name"), 0.0);
}

#[test]
fn a_motion_that_says_it_settled_must_be_where_it_says() {
    let said = |text: &str, error_deg: Option<f64>| {
        let mut case = withheld(&[], 0.0, text);
        let attitude = case.verdict.as_mut().and_then(|verdict| verdict.attitude.as_mut());
        attitude.expect("said").error_deg = error_deg;
        case
    };
    let settled = r#"{"causes":[],"attitude":{"is_settled":true,"sigma_deg":0.5}}"#;
    let not = r#"{"causes":[],"attitude":{"is_settled":false}}"#;
    let share = |case: Judged| value(&table(&[case]), "R8: motion converged, or said that it did not");
    assert_eq!(share(said(settled, Some(1.4))), 1.0);
    assert_eq!(share(said(settled, Some(1.6))), 0.0);
    assert_eq!(share(said(settled, None)), 0.0);
    assert_eq!(share(said(not, None)), 1.0);
}

#[test]
fn the_share_that_is_left_is_held_against_the_dealers_at_its_kind_of_place() {
    let said = |share: f64| {
        format!(
            r#"{{"causes":[],"visible":[{{"effect":"gyro-bias","place":"one","with_reference":10.0,"by_parity":{}}},
            {{"effect":"gyro-bias","place":"each","with_reference":10.0,"by_parity":5.0}}]}}"#,
            10.0 * share
        )
    };
    // Dealt 10 of 20, at one gyro.
    let of = |share: f64| {
        let case = withheld(&["gyro-bias"], 20.0, &said(share));
        value(&table(&[case]), "R8: share left by parity within 15 % of the dealer's")
    };
    assert_eq!((of(0.56), of(0.7)), (1.0, 0.0));
}
