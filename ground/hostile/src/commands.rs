//! The umbilical's words: whatever comes, and whenever, nothing is erased unless both words of it came whole, and no
//! mode is entered whose word did not come twice.
//!
//! The bytes are pairs: a byte on the line, and how long after the one before, in steps of [`STEP_US`].

use emems::{
    command::{Heard, Parser},
    mode::{Action, Mode, Reply, State},
};

/// \[us\] what a step of the fuzzer's clock is worth: up to 12.75 s, longer than any confirmation waits.
const STEP_US: u64 = 50_000;

fn times(said: &[u8], word: &[u8]) -> usize {
    said.windows(word.len()).filter(|letters| *letters == word).count()
}

/// The target.
pub fn commands(bytes: &[u8]) {
    let (mut parser, mut state, mut now_us) = (Parser::default(), State::default(), 0);
    let timed = bytes.as_chunks::<2>().0;
    let said: Vec<u8> = timed.iter().map(|[byte, _]| *byte).collect();
    for (heard, [byte, steps]) in timed.iter().enumerate() {
        now_us += u64::from(*steps) * STEP_US;
        let Some(Heard::Command(command)) = parser.hear(*byte, now_us) else {
            continue;
        };
        let said = &said[..=heard];
        let before = state.mode;
        if state.command(command, now_us) == Reply::Done(Action::Erase) {
            assert!(times(said, b"G_MA") >= 1 && times(said, b"G_CA") >= 1);
            assert_eq!(state.mode, Mode::Wait);
        }
        if state.mode != before {
            let word = if state.mode == Mode::Flight { b"G_MV" } else { b"G_ME" };
            assert!(times(said, word) >= 2);
        }
    }
}
