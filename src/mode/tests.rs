extern crate std;

use std::vec::Vec;

use super::*;
use crate::command::{COMMANDS, Heard, Parser};

const WAITING: State = State {
    mode: Mode::Wait,
    task: Task::Idle,
    recording: false,
    derived: false,
    awaits_log: false,
    pending: None,
    lift_off: false,
};
const FLYING: State = State {
    mode: Mode::Flight,
    ..WAITING
};

/// WAIT while packets go to the umbilical.
const SENDING: State = State {
    task: Task::SendPackets,
    ..WAITING
};

/// The state after the bytes, whether anything was erased, and whether the calibration set was changed.
fn after(mut state: State, bytes: &[u8]) -> (State, bool, bool) {
    let mut parser = Parser::default();
    let (mut erased, mut calibrated) = (false, false);
    for (at, byte) in bytes.iter().enumerate() {
        if let Some(Heard::Command(command)) = parser.hear(*byte, 1000 * at as u64) {
            let reply = state.command(command, 1000 * at as u64);
            erased |= reply == Reply::Done(Action::Erase);
            let set = |command| reply == Reply::Done(Action::Calibration(command));
            calibrated |= set(Command::LoadSet) || set(Command::ForgetSet);
            calibrated |= matches!(reply, Reply::Done(Action::Rail(_) | Action::Site(_)));
        }
    }
    (state, erased, calibrated)
}

/// Every way the seven commands of App. A.3 and ours are given: the words that carry one out.
fn deeds() -> Vec<Vec<u8>> {
    let once = COMMANDS.iter().map(|entry| match entry.command {
        Command::DumpRange { .. } => b"G_LR000000000010".to_vec(),
        Command::SetWord { .. } => b"G_CW00040000A040".to_vec(),
        Command::Rail(_) => b"G_RA1B5821340503".to_vec(),
        Command::Site(_) => b"G_SI2634FF18F7DDFC84020A400F00".to_vec(),
        _ => entry.word.to_vec(),
    });
    let confirmed: [&[u8]; 10] = [
        b"G_MVG_MV",
        b"G_MEG_ME",
        b"G_MAG_CA",
        b"G_CLG_CK",
        b"G_CXG_CK",
        b"G_RA1B5821340503G_CK",
        b"G_SI2634FF18F7DDFC84020A400F00G_CK",
        b"G_MGG_MG",
        b"G_MTG_MT",
        b"G_MtG_Mt",
    ];
    once.chain(confirmed.map(<[u8]>::to_vec)).collect()
}

/// Checks the `garbled` forms of every deed, and of every two deeds in a row: none erases unless G_CA was sent, none
/// changes the calibration set, the rail or the site unless G_CK was sent, none leads to a mode whose word was not sent.
fn check(garble: impl Fn(&[u8]) -> Vec<Vec<u8>>) {
    let says = |sent: &[u8], word: &[u8]| sent.windows(word.len()).any(|letters| letters == word);
    for state in [WAITING, FLYING] {
        for first in deeds() {
            for second in [Vec::new()].into_iter().chain(deeds()) {
                let sent = [first.as_slice(), &second].concat();
                for bytes in garble(&sent) {
                    let (got, erased, calibrated) = after(state, &bytes);
                    let text = std::string::String::from_utf8_lossy(&bytes).into_owned();
                    assert!(!erased || says(&sent, b"G_CA"), "{state:?}: {text} erases");
                    assert!(!calibrated || says(&sent, b"G_CK"), "{state:?}: {text} changes the set");
                    let word = if got.mode == Mode::Flight { b"G_MV" } else { b"G_ME" };
                    assert!(
                        got.mode == state.mode || says(&sent, word),
                        "{state:?}: {text} leads to {:?}",
                        got.mode
                    );
                }
            }
        }
    }
}

#[test]
fn no_one_bit_error_erases_or_changes_to_a_mode_that_was_not_sent() {
    check(|sent| {
        let flip = |bit: usize| {
            let mut bytes = sent.to_vec();
            bytes[bit / 8] ^= 1 << (bit % 8);
            bytes
        };
        (0..8 * sent.len()).map(flip).collect()
    });
}

#[test]
fn no_lost_doubled_or_swapped_byte_erases_or_changes_to_a_mode_that_was_not_sent() {
    check(|sent| {
        let mut garbled = Vec::new();
        for at in 0..sent.len() {
            let mut lost = sent.to_vec();
            lost.remove(at);
            let mut doubled = sent.to_vec();
            doubled.insert(at, sent[at]);
            garbled.extend([lost, doubled]);
            if at + 1 < sent.len() {
                let mut swapped = sent.to_vec();
                swapped.swap(at, at + 1);
                garbled.push(swapped);
            }
        }
        garbled
    });
}

#[test]
fn no_two_bit_error_in_one_deed_erases() {
    for sent in deeds() {
        for first in 0..8 * sent.len() {
            for second in 0..first {
                let mut bytes = sent.clone();
                bytes[first / 8] ^= 1 << (first % 8);
                bytes[second / 8] ^= 1 << (second % 8);
                let (_, erased, calibrated) = after(WAITING, &bytes);
                assert!(!erased && (!calibrated || sent.ends_with(b"G_CK")), "{bytes:?}");
            }
        }
    }
}

#[test]
fn a_mode_change_takes_the_word_twice_within_ten_seconds() {
    let mut state = WAITING;
    assert_eq!(state.command(Command::Flight, 0), Reply::Confirm(Command::Flight));
    assert_eq!(
        state.command(Command::Status, 1),
        Reply::Done(Action::Report(Command::Status))
    );
    assert_eq!(state.command(Command::Flight, 2), Reply::Confirm(Command::Flight));
    assert_eq!(
        state.command(Command::Flight, CONFIRM_WITHIN_US + 3),
        Reply::Confirm(Command::Flight)
    );
    assert_eq!(
        state.command(Command::Flight, CONFIRM_WITHIN_US + 4),
        Reply::Done(Action::None)
    );
    assert_eq!(state.mode, Mode::Flight);
}

#[test]
fn an_erase_takes_a_second_different_word_and_no_lift_off() {
    let mut state = WAITING;
    assert_eq!(
        state.command(Command::ConfirmErase, 0),
        Reply::Refused(Refusal::NothingToConfirm)
    );
    assert_eq!(state.command(Command::Erase, 0), Reply::Confirm(Command::ConfirmErase));
    assert_eq!(state.command(Command::Erase, 1), Reply::Confirm(Command::ConfirmErase));
    assert_eq!(state.command(Command::ConfirmErase, 2), Reply::Done(Action::Erase));
    let mut flying = FLYING;
    assert_eq!(
        flying.command(Command::Erase, 0),
        Reply::Refused(Refusal::Mode(Mode::Wait))
    );
    state.lift_off = true;
    assert_eq!(state.command(Command::Erase, 3), Reply::Refused(Refusal::LiftOff));
}

#[test]
fn a_task_of_the_other_mode_is_refused() {
    let mut state = WAITING;
    assert_eq!(
        state.command(Command::Record, 0),
        Reply::Refused(Refusal::Mode(Mode::Flight))
    );
    let mut flying = FLYING;
    let place = 0;
    for command in [
        Command::SendPackets,
        Command::Dump,
        Command::Stop,
        Command::SelfTest,
        Command::SetWord { place, bytes: [0; 4] },
        Command::LoadSet,
        Command::ForgetSet,
        Command::ConfirmSet,
        Command::ReadSet,
        Command::Rail(Rail::default()),
        Command::Site(site::Told::default()),
    ] {
        assert_eq!(flying.command(command, 0), Reply::Refused(Refusal::Mode(Mode::Wait)));
    }
    assert_eq!(flying.command(Command::Record, 0), Reply::Confirm(Command::Record));
    assert_eq!(flying.command(Command::Record, 1), Reply::Done(Action::None));
    assert!(flying.recording);
}

/// C1: a word that one bit makes of another one does nothing alone.
#[test]
fn recording_and_packets_take_their_word_twice_within_ten_seconds() {
    for (before, command) in [
        (FLYING, Command::Record),
        (WAITING, Command::SendPackets),
        (WAITING, Command::Stop),
    ] {
        let before = State {
            task: if command == Command::Stop {
                Task::SendPackets
            } else {
                Task::Idle
            },
            ..before
        };
        for (second, at_us) in [
            (command, CONFIRM_WITHIN_US + 1),
            (Command::Status, 1),
            (Command::Wait, 1),
        ] {
            let mut state = before;
            assert_eq!(state.command(command, 0), Reply::Confirm(command));
            let reply = state.command(second, at_us);
            assert_ne!(reply, Reply::Done(Action::None), "{command:?} {second:?}");
            assert_eq!(
                (state.mode, state.task, state.recording),
                (before.mode, before.task, before.recording)
            );
        }
        let mut state = before;
        state.command(command, 0);
        assert_eq!(state.command(command, CONFIRM_WITHIN_US), Reply::Done(Action::None));
        assert_ne!((state.task, state.recording), (before.task, before.recording));
    }
}

#[test]
fn lift_off_starts_flight_and_recording_once() {
    let mut state = WAITING;
    assert!(state.lift_off(true));
    assert_eq!((state.mode, state.recording), (Mode::Flight, true));
    state.command(Command::Wait, 0);
    state.command(Command::Wait, 1);
    assert!(!state.lift_off(true), "a line stuck asserted does not undo G_ME");
    assert_eq!((state.mode, state.recording), (Mode::Wait, false));
}

#[test]
fn a_set_is_loaded_or_forgotten_by_a_second_different_word() {
    let mut state = WAITING;
    let done = |command| Reply::Done(Action::Calibration(command));
    assert_eq!(
        state.command(Command::ConfirmSet, 0),
        Reply::Refused(Refusal::NothingToConfirm)
    );
    for armed in [Command::LoadSet, Command::ForgetSet] {
        assert_eq!(state.command(armed, 0), Reply::Confirm(Command::ConfirmSet));
        assert_eq!(state.command(armed, 1), Reply::Confirm(Command::ConfirmSet));
        assert_eq!(state.command(Command::ConfirmSet, 2), done(armed));
        assert_eq!(
            state.command(Command::ConfirmSet, 3),
            Reply::Refused(Refusal::NothingToConfirm)
        );
    }
    // The confirmation of one thing is not that of another.
    state.command(Command::Erase, 4);
    assert_eq!(
        state.command(Command::ConfirmSet, 5),
        Reply::Refused(Refusal::NothingToConfirm)
    );
    state.command(Command::LoadSet, 6);
    assert_eq!(
        state.command(Command::ConfirmErase, 7),
        Reply::Refused(Refusal::NothingToConfirm)
    );
    state.command(Command::LoadSet, 8);
    assert_eq!(
        state.command(Command::ConfirmSet, CONFIRM_WITHIN_US + 9),
        Reply::Refused(Refusal::NothingToConfirm)
    );
}

/// A wrong bit makes no word one that changes something without a confirmation.
#[test]
fn no_word_that_changes_the_state_at_once_is_one_bit_from_another() {
    use crate::command::COMMANDS;
    for one in &COMMANDS {
        for other in &COMMANDS {
            let wrong: u32 = (one.word.iter().zip(other.word))
                .map(|(a, b)| (a ^ b).count_ones())
                .sum();
            let changes = [WAITING, SENDING, FLYING].into_iter().any(|before| {
                [false, true].into_iter().any(|derived| {
                    let before = State { derived, ..before };
                    let mut after = before;
                    after.command(other.command, 0);
                    after.pending = None;
                    after != before
                })
            });
            assert!(
                wrong != 1 || !changes,
                "{:?} {:?}",
                core::str::from_utf8(one.word),
                core::str::from_utf8(other.word)
            );
        }
    }
}

#[test]
fn the_log_is_believed_once_and_only_before_anybody_else_has_spoken() {
    let flying = Resumed {
        flight: true,
        recording: true,
        derived: true,
        ..Resumed::default()
    };
    let awaiting = State {
        awaits_log: true,
        ..State::default()
    };
    let mut after_power_on = awaiting;
    after_power_on.recovered(flying);
    assert_eq!(
        (after_power_on.mode, after_power_on.recording, after_power_on.derived),
        (Mode::Flight, true, true)
    );
    for now_us in [0, 1] {
        after_power_on.command(Command::Wait, now_us);
    }
    after_power_on.recovered(flying);
    assert_eq!(after_power_on.mode, Mode::Wait, "a mode that was commanded stands");

    let mut commanded = awaiting;
    for now_us in [0, 1] {
        commanded.command(Command::Wait, now_us);
    }
    commanded.recovered(flying);
    assert_eq!(commanded.mode, Mode::Wait, "also where the command came before the log");

    let mut known = State::default();
    known.recovered(flying);
    assert_eq!(known.mode, Mode::Wait, "retained memory knows better");
}

/// U9: any one bit of the state or of its copies, in any state.
#[test]
fn a_flipped_bit_of_the_mode_is_put_right_by_its_copies() {
    for vital in 0..16 {
        let mut sound = State::default();
        sound.restore(vital);
        assert_eq!(sound.vital(), vital);
        let sound_copies = Copies::of(&sound);
        for bit in 0..20 {
            let (mut state, mut copies) = (sound, sound_copies);
            match bit {
                0..4 => state.restore(vital ^ 1 << bit),
                _ => copies.0[(bit - 4) / 8] ^= 1 << ((bit - 4) % 8),
            }
            assert!(copies.mend(&mut state), "{vital} {bit}");
            assert_eq!((state, copies), (sound, sound_copies), "{vital} {bit}");
            assert!(!copies.mend(&mut state), "{vital} {bit}: once");
        }
    }
}
