//! The release image when its own code fails: what it leaves behind, and how it goes on.
//!
//! The image is the one that flies, but for one function, whose first word is written over, as a cell of the flash that has
//! gone wrong would.

#[allow(dead_code, reason = "each test file uses its own share of the bench")]
mod bench;

use bench::{MS, Tape, image, world};
use emems::{
    board::ResetCause,
    crash::CrashCause,
    flight_log::{
        LOG_START, page,
        record::{self, Content},
    },
    nand::{PAGES_PER_BLOCK, PageAddress},
};
use emulated::{Options, flight::fly_keeping, fly_with};
use twin::{
    plant::Plant,
    run::{Fault, Scheduled},
};

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

/// U3: where arithmetic overflows, in FLIGHT and recording: the record is said, and is in the log at the next start.
#[test]
fn a_panic_leaves_a_crash_record_that_the_log_keeps() {
    let broken = image().with_panic(ESTIMATION).expect("an overflow that is seen");
    let mut tape = Tape {
        script: vec![(600 * MS, b"G_MVG_MVG_MGG_MG".to_vec())],
        ..Tape::default()
    };
    let plant = Plant::ideal(world("still"));
    let (report, plant) =
        fly_keeping(&Options::default(), &broken, plant, &[], 3_000 * MS, &mut tape).expect("it flies");
    let causes: Vec<_> = report.resets.iter().map(|(_, cause)| *cause).collect();
    assert!(
        !causes.is_empty() && causes.iter().all(|cause| *cause == ResetCause::Software),
        "{causes:?}"
    );
    assert!(
        tape.said().contains("crash before this start: Panic at"),
        "{}",
        tape.said()
    );
    let mut chip = plant.lock().nand.cells.clone();
    let pages = (LOG_START..LOG_START + 20).flat_map(|block| (0..PAGES_PER_BLOCK).map(move |page| (block, page)));
    let crashes = pages.filter_map(|(block, page)| {
        let mut bytes = chip.read(PageAddress { block, page });
        page::correct(&mut bytes)[0].ok()?;
        match record::decode(page::record(&bytes, 0)).ok()?.1 {
            Content::Header(header) => header.start?.crash,
            _ => None,
        }
    });
    let crashes: Vec<_> = crashes.collect();
    assert!(!crashes.is_empty(), "no boot header has a crash");
    assert!(
        crashes
            .iter()
            .all(|crash| crash.cause == CrashCause::Panic && crash.place.ends_with(".rs")),
        "{crashes:?}"
    );
}

/// The RAM of the unit's state (memory.x), as the linker names its beginning.
const VARIABLES: &str = "__sdata";
const VARIABLES_BYTES: usize = 56 * 1024;
/// Where that is, from the beginning of what a RAM flip is counted round.
const VARIABLES_AT: usize = 64 * 1024;

/// U9: a copy of the mode is found by what it is in WAIT and in FLIGHT, and one bit of it is flipped.
#[test]
fn a_flipped_bit_of_the_mode_in_ram_is_put_right_and_said() {
    let flown = |commands: &[u8], faults: &[Scheduled]| {
        let mut tape = Tape {
            script: vec![(500 * MS, commands.to_vec()), (1_500 * MS, b"G_ST".to_vec())],
            ..Tape::default()
        };
        let options = Options {
            statics: vec![(VARIABLES.into(), VARIABLES_BYTES)],
            ..Options::default()
        };
        let plant = Plant::ideal(world("still"));
        let mut report = fly_with(&options, image(), plant, faults, 1_700 * MS, &mut tape).expect("it flies");
        (report.statics.remove(0), tape.said())
    };
    // Mode, recording, derived frames and whether the log is awaited, in four bits: WAIT, and FLIGHT.
    let ([waiting, flying], said) = {
        let ((waiting, _), (flying, said)) = (flown(b"G_ST", &[]), flown(b"G_MVG_MV", &[]));
        ([waiting, flying], said)
    };
    assert!(said.contains("G_ST FLIGHT") && !said.contains("put right"), "{said}");
    let is_pair = |bytes: &[u8], at: usize, vital: u8| bytes[at] == vital && bytes[at + 1] == !vital;
    let places: Vec<usize> = (0..VARIABLES_BYTES - 1)
        .filter(|at| is_pair(&waiting, *at, 0b0000) && is_pair(&flying, *at, 0b1000))
        .collect();
    let [place] = places[..] else { panic!("{places:x?}") };
    let flip = Scheduled {
        at: 1_000 * MS,
        fault: Fault::RamFlip(8 * (VARIABLES_AT + place) as u32 + 3),
    };
    let (after, said) = flown(b"G_MVG_MV", &[flip]);
    assert!(
        said.contains("a flipped bit of the mode was put right") && said.contains("G_ST FLIGHT"),
        "{said}"
    );
    assert!(is_pair(&after, place, 0b1000));
}
