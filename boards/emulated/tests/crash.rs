//! The release image when its own code fails: what it leaves behind, and how it goes on.
//!
//! The image is the one that flies, but for one function, whose first word is written over, as a cell of the flash that has
//! gone wrong would.

#[allow(dead_code, reason = "each test file uses its own share of the bench")]
mod bench;

use bench::{MS, Tape, image, world};
use emems::board::ResetCause;
use emulated::{Options, fly_with};
use twin::plant::Plant;

/// Runs in every cycle with an attitude.
const ESTIMATION: &str = "kalman6Filter11keep_finite";
/// Two instructions that are none (`udf #0`): a HardFault.
const UNDEFINED: u32 = 0xDE00_DE00;
/// `push {r0-r7, lr}` and back to it: the stack runs over.
const PUSH_FOR_EVER: u32 = 0xE7FD_B5FF;

fn crash_is_told(word: u32, told: &str) {
    let broken = image().with_code(ESTIMATION, word).expect("the function is there");
    let mut tape = Tape::default();
    let plant = Plant::ideal(world("still"));
    let report = fly_with(&Options::default(), &broken, plant, &[], 3_000 * MS, &mut tape).expect("it flies");
    assert!(!report.resets.is_empty(), "the code was not run");
    assert!(
        report.resets.iter().all(|(_, cause)| *cause == ResetCause::Software),
        "{:?}",
        report.resets
    );
    assert!(tape.said().contains(told), "{}", tape.said());
    let first = report.resets[0].0;
    assert!(tape.packets().iter().any(|(at, _)| *at > first), "no packet afterwards");
}

#[test]
fn an_instruction_that_is_none_leaves_a_crash_record_and_the_unit_goes_on() {
    crash_is_told(UNDEFINED, "crash before this start: HardFault");
}

/// Without a stack of its own the fault's handler faults as well: the processor locks up until the watchdog bites, and the
/// crash has no record.
#[test]
fn a_stack_that_runs_over_leaves_a_crash_record_and_the_unit_goes_on() {
    crash_is_told(PUSH_FOR_EVER, "crash before this start: StackOverflow");
}
