use emems::sample::{Errors, Reading};

use super::*;

const S: Nanos = 1_000_000_000;

fn planned(text: &str) -> Planned {
    text.parse().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_text_is_a_fault_and_comes_back_as_itself() {
    for text in [
        "silent:a2@10s..20s",
        "stretch:m1=20@3s",
        "reset@31s..60s x20",
        "power-cut=4@2.5s",
        "lift-off:bouncing=0.05@1s",
        "hang:nand@7s",
        "clock-step=-65.536@3s",
    ] {
        assert_eq!(planned(text).to_string(), text);
    }
    assert_eq!(planned("silent:g4@250ms").from, S / 4);
    assert_eq!(planned("reset@1h").from, 3600 * S);
}

#[test]
fn what_cannot_be_meant_is_refused_with_what_could() {
    for (text, why) in [
        ("silent:a2", "say when"),
        ("sleepy@1s", "there are silent restart"),
        ("silent@1s", "say which: a1"),
        ("silent:a5@1s", "a5 is none of a1"),
        ("stretch:g1@1s", "g1 is none of"),
        ("reset:a1@1s", "leave out :a1"),
        ("reset=3@1s", "reset has no size"),
        ("silent:a1@soon", "is no number"),
        ("silent:a1@3s..2s", "end before it begins"),
        ("reset@3s x5", "need an end"),
        ("reset@3s..4s x0", "need an end"),
        ("reset@-3s", "is no time"),
    ] {
        let refusal = text.parse::<Planned>().expect_err(text).to_string();
        assert!(refusal.contains(why) && refusal.starts_with(text), "{refusal}");
    }
}

#[test]
fn every_word_has_a_name_of_its_own_and_strikes() {
    for word in &WORDS {
        assert_eq!(
            WORDS.iter().filter(|other| other.name == word.name).count(),
            1,
            "{}",
            word.name
        );
        let target = word.on.name(0).map_or(String::new(), |name| format!(":{name}"));
        let strokes = planned(&format!("{}{target}@1s..2s", word.name)).strokes(1);
        assert_eq!(strokes.len(), 1 + usize::from(word.lasts()), "{}", word.name);
        assert_eq!(strokes[0].at, S);
        assert!(!word.places.is_empty() && !word.meaning.is_empty());
    }
}

#[test]
fn several_strikes_are_drawn_from_the_seed_alone() {
    let plan = planned("silent:a1@10s..20s x7");
    let strokes = plan.strokes(5);
    assert_eq!(strokes, plan.strokes(5));
    assert_ne!(strokes, plan.strokes(6));
    assert_eq!(strokes.len(), 14);
    assert!(strokes.is_sorted_by_key(|stroke| stroke.at));
    assert!(strokes.iter().all(|stroke| (10 * S..=20 * S).contains(&stroke.at)));
    let begun = strokes.iter().filter(|stroke| stroke.fault == Fault::Silent(0));
    assert_eq!(begun.count(), 7);
    let both = schedule(&[plan, planned("reset@15s")], 5);
    assert!(both.len() == 15 && both.is_sorted_by_key(|stroke| stroke.at));
}

fn readings() -> Vec<(Nanos, Reading)> {
    let reading = |n: u16| Reading {
        errors: Errors(0),
        acc_p: [[n as i16; 3]; 4],
        gyro: [n as i16; 4],
        ..Reading::unread(n)
    };
    (0..10).map(|n| (u64::from(n) * S / 5, reading(n))).collect()
}

#[test]
fn a_log_is_rewritten_as_if_the_fault_had_struck() {
    let mut silent = readings();
    let struck = log::rewrite(&mut silent, &[planned("silent:a2@1s..1.5s")], 1).expect("in a log");
    assert_eq!(struck, [("silent", 3)].into());
    let marked: Vec<u16> = silent.iter().map(|(_, reading)| reading.errors.0).collect();
    assert_eq!(marked, [0, 0, 0, 0, 0, 2, 2, 2, 0, 0]);
    assert_eq!(silent[6].1.acc_p[1], Reading::unread(0).acc_p[1]);
    let mut frozen = readings();
    log::rewrite(&mut frozen, &[planned("frozen:g3@1s")], 1).expect("in a log");
    let gyro: Vec<i16> = frozen.iter().map(|(_, reading)| reading.gyro[2]).collect();
    assert_eq!(gyro, [0, 1, 2, 3, 4, 5, 5, 5, 5, 5]);
    let mut stuck = readings();
    log::rewrite(&mut stuck, &[planned("bus-stuck@0s..0.1s")], 1).expect("in a log");
    assert_eq!((stuck[0].1.errors.0, stuck[1].1.errors.0), (0xF0FF, 0));
    let refused = log::rewrite(&mut readings(), &[planned("reset@1s")], 1).expect_err("not in a log");
    assert!(refused.to_string().contains("reset cannot be made in a log"));
}
