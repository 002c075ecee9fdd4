//! What may come of bytes on the umbilical, wrong ones included: rows C1, C3 and C15 of the fault catalogue.
//!
//! `docs/threats.md` says what each word reads and writes; a new word must stand there, and in `docs/console.md`.

use std::collections::{BTreeMap, BTreeSet};

use emems::{
    command::{COMMANDS, Command, Heard, Parser, WORD_BYTES, Word},
    flight_log::dump::{self, DUMP_START},
    mode::{Action, CONFIRM_WITHIN_US, Mode, Reply, State, Task},
    packet::PACKET_BYTES,
};
use host_tests::{Flight, S, world};
use rand_xoshiro::{
    Xoshiro256PlusPlus,
    rand_core::{Rng, SeedableRng},
};

/// \[us\] a byte takes at 115200 8N1.
const BYTE_US: u64 = 87;

#[test]
fn every_word_is_on_the_page_of_threats_with_what_it_reads_and_writes() {
    let rows: Vec<Vec<&str>> = include_str!("../../docs/threats.md")
        .lines()
        .filter(|line| line.starts_with("| G_"))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    let told: BTreeSet<&str> = rows.iter().map(|row| row[0]).collect();
    let words: BTreeSet<&str> = (COMMANDS.iter())
        .map(|entry| str::from_utf8(entry.word).expect("letters"))
        .collect();
    assert_eq!(
        words, told,
        "docs/threats.md says of each word what it reads and writes"
    );
    assert_eq!(rows.len(), told.len(), "a word is there twice");
    for row in rows {
        assert!(row.len() == 3 && row.iter().all(|cell| !cell.is_empty()), "{row:?}");
    }
    let console = include_str!("../../docs/console.md");
    for word in words {
        assert!(console.contains(word), "docs/console.md lacks {word}");
    }
}

/// A word with digits where it takes them.
fn deed(word: &[u8; WORD_BYTES]) -> Vec<u8> {
    match word {
        b"G_LR" => b"G_LR000000000010".to_vec(),
        b"G_CW" => b"G_CW00040000A040".to_vec(),
        b"G_RA" => b"G_RA1B5821340503".to_vec(),
        b"G_SI" => b"G_SI2634FF18F7DDFC84020A400F00".to_vec(),
        _ => word.to_vec(),
    }
}

/// The replies on these bytes, one a millisecond, and the state after them.
fn after(mut state: State, bytes: &[u8]) -> (State, Vec<Reply>) {
    let mut parser = Parser::default();
    let mut replies = Vec::new();
    for (at_ms, byte) in bytes.iter().enumerate() {
        let now_us = 1000 * at_ms as u64;
        if let Some(Heard::Command(command)) = parser.hear(*byte, now_us) {
            replies.push(state.command(command, now_us));
        }
    }
    (state, replies)
}

fn state(words: &[u8]) -> State {
    after(State::default(), words).0
}

/// Every word with every one-bit error, in WAIT, in WAIT while packets are sent, and in FLIGHT while they are recorded. The
/// word that arrives is another one in a few cases; what comes of it is a question or a report that the console shows.
#[test]
fn one_wrong_bit_in_a_word_costs_a_report_at_most() {
    let mut exchanged = BTreeSet::new();
    for before in [state(b""), state(b"G_MTG_MTG_DL"), state(b"G_MVG_MVG_MGG_MG")] {
        for entry in &COMMANDS {
            let sent = deed(entry.word);
            for bit in 0..8 * sent.len() {
                let mut came = sent.clone();
                came[bit / 8] ^= 1 << (bit % 8);
                let text = String::from_utf8_lossy(&came).into_owned();
                let (state, replies) = after(before, &came);
                assert!(replies.len() <= 1, "{text}: {replies:?}");
                assert_eq!(
                    (state.mode, state.recording, state.task),
                    (before.mode, before.recording, task_after(before, &sent, &came)),
                    "{text}"
                );
                for reply in replies {
                    if came[..WORD_BYTES] != sent[..WORD_BYTES] {
                        exchanged.insert(format!("{}>{}", String::from_utf8_lossy(&sent[..4]), &text[..4]));
                    }
                    match reply {
                        Reply::Refused(_) | Reply::Confirm(_) | Reply::Done(Action::None | Action::Report(_)) => {}
                        // Digits that came wrong: another place or content of a set that its checksum covers.
                        Reply::Done(Action::Calibration(Command::SetWord { .. })) => {
                            assert_eq!(entry.word, b"G_CW", "{text}");
                        }
                        done => panic!("{text} for {}: {done:?}", String::from_utf8_lossy(&sent)),
                    }
                }
            }
        }
    }
    let pairs = ["G_ME>G_MA", "G_ME>G_MG", "G_MT>G_Mt", "G_MT>G_MV", "G_Mt>G_MT"];
    for pair in pairs {
        assert!(exchanged.contains(pair), "{pair} is no longer one bit: {exchanged:?}");
    }
    for (word, letters) in exchanged.iter().filter_map(|pair| pair.split_once('>')) {
        assert!(
            letters != "G_CL" && letters != "G_CA",
            "{word} becomes {letters} by one bit"
        );
    }
}

/// The task after a word: no other than before, unless it was a dump that was asked for, whose digits may have come wrong.
fn task_after(before: State, sent: &[u8], came: &[u8]) -> Task {
    match (
        sent.starts_with(b"G_LR") && came.starts_with(b"G_LR"),
        after(before, came).0.task,
    ) {
        (true, task @ Task::Dump { .. }) => task,
        _ => before.task,
    }
}

/// Random bytes: half of them of any value, half letters of the words. The parser keeps no more than the longest word,
/// answers a byte at most once, and nothing is erased or entered whose words did not come, told here by the last four bytes.
#[test]
fn a_parser_keeps_thirty_letters_whatever_comes() {
    let count: u64 =
        std::env::var("EMEMS_RUNS").map_or(3_000_000, |runs| runs.parse().expect("EMEMS_RUNS is a number"));
    assert!(size_of::<Parser>() <= 64, "{} bytes", size_of::<Parser>());
    let letters: Vec<u8> = COMMANDS.iter().flat_map(|entry| entry.word[2..].to_vec()).collect();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let (mut parser, mut state) = (Parser::default(), State::default());
    let mut came: BTreeMap<Word, [Option<u64>; 2]> = BTreeMap::new();
    let (mut last, mut heard, mut erased, mut entered) = ([0; 4], 0_u64, 0_u64, 0_u64);
    for at in 0..count {
        let choice = random.next_u64();
        let byte = match choice >> 60 {
            0..8 => choice as u8,
            8..11 => b'G',
            11..13 => b'_',
            _ => letters[usize::from(choice as u8) % letters.len()],
        };
        let now_us = at * BYTE_US;
        last = [last[1], last[2], last[3], byte];
        if last.starts_with(b"G_") {
            let times = came.entry(last).or_default();
            *times = [times[1], Some(now_us)];
        }
        let Some(found) = parser.hear(byte, now_us) else {
            continue;
        };
        heard += 1;
        let Heard::Command(command) = found else { continue };
        let before = state.mode;
        let recent = |word: &Word, nth: usize| {
            let time = came.get(word).and_then(|times| times[nth]);
            time.is_some_and(|time| now_us - time <= CONFIRM_WITHIN_US)
        };
        if state.command(command, now_us) == Reply::Done(Action::Erase) {
            erased += 1;
            assert!(last == *b"G_CA" && recent(b"G_MA", 1), "byte {at}");
        }
        if state.mode != before {
            entered += 1;
            let word = if state.mode == Mode::Flight { b"G_MV" } else { b"G_ME" };
            assert!(last == *word && recent(word, 0), "byte {at}");
        }
    }
    println!("{count} bytes, {heard} heard, {erased} erased, {entered} times to another mode");
    assert!(heard > count / 1_000, "{heard} words: too few to say anything");
    let kept = format!("{parser:?}");
    let letters = kept.split(['[', ']']).nth(1).expect("the letters");
    assert!(letters.split(',').count() <= 16, "{kept}");
}

/// Pages far beyond the log, places beyond a set: no answer carries anything but records of the log.
#[test]
fn what_is_asked_for_beyond_the_log_or_a_set_is_not_there() {
    let flown = Flight::ideal(world("still"))
        .say(S, b"G_MVG_MVG_MGG_MG")
        .say(3 * S, b"G_MEG_ME")
        .say(4 * S, b"G_LRFFFFFFFFFFFF")
        .say(5 * S, b"G_LR000000FFFFFF")
        .say(7 * S, b"G_LR0FFFFF000001")
        .say(8 * S, b"G_CW011C00000000G_CWFFFFFFFFFFFF")
        .say(9 * S, b"G_CR")
        .fly(11 * S);
    let line = &flown.umbilical;
    let mut pages = Vec::new();
    for at in (0..line.len()).filter(|at| line[*at] == DUMP_START) {
        let end = line[at..]
            .iter()
            .position(|byte| *byte == b'\n')
            .map_or(line.len(), |end| at + end + 1);
        let packet = at
            .checked_sub(PACKET_BYTES)
            .and_then(|from| line[from..at].first_chunk());
        let (page, _) = dump::decode(&line[at..end], packet).expect("a frame of the log");
        pages.push(page);
    }
    let ends: Vec<String> = flown
        .replies()
        .into_iter()
        .filter(|reply| reply.contains("dump ends"))
        .collect();
    assert_eq!(ends.len(), 3, "{:?}", flown.replies());
    let used: u32 = ends[1]
        .split(' ')
        .next_back()
        .and_then(|used| used.parse().ok())
        .expect("pages used");
    assert!(
        !pages.is_empty() && pages.iter().all(|page| *page < used),
        "{pages:?} of {used}"
    );
    let distinct: BTreeSet<u32> = pages.iter().copied().collect();
    assert_eq!(
        distinct.len(),
        pages.len(),
        "only the range that holds something was sent"
    );
    for place in ["011C", "FFFF"] {
        assert!(
            flown.replied(&format!("G_CW no: a set has no place {place}")),
            "{:?}",
            flown.replies()
        );
    }
}
