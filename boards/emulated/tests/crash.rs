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
    part::Nanos,
    plant::Plant,
    run::{Fault, Scheduled},
};

/// Runs in every cycle with an attitude.
const ESTIMATION: &str = "6Filter11keep_finite";
/// Two instructions that are none (`udf #0`): a HardFault.
const UNDEFINED: u32 = 0xDE00_DE00;
/// `push {r0-r7, lr}` and back to it: the stack runs over.
const PUSH_FOR_EVER: u32 = 0xE7FD_B5FF;

fn crash_is_told(word: u32, told: &str) {
    let broken = image().with_code(ESTIMATION, word).expect("the function is there");
    let mut tape = Tape::default();
    let plant = Plant::ideal(world("still"));
    // The function is first run some 1.2 s after a start: one crash, for each start is translated anew.
    let report = fly_with(&Options::default(), &broken, plant, &[], 2_400 * MS, &mut tape).expect("it flies");
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

/// The RAM of the unit's state (memory.x), as the linker names its beginning.
const VARIABLES: &str = "__sdata";
const VARIABLES_BYTES: usize = 56 * 1024;
/// Where that is, from the beginning of what a RAM flip is counted round.
const VARIABLES_AT: usize = 64 * 1024;

/// Where the block of the filter's covariance begins that has attitude and velocity, from the beginning of the variables; and when
/// a window's work on it is done \[ns\]. It is what a derived frame says of the attitude's covariance, in rows of five.
fn covariance() -> (usize, Nanos) {
    let script = || vec![(MS, b"G_DL".to_vec())];
    let mut tape = Tape {
        script: script(),
        ..Tape::default()
    };
    let plant = || Plant::new(world("still"), 7);
    emulated::fly(image(), plant(), &[], 6_000 * MS, &mut tape).expect("it flies");
    let frames = tape.derived();
    let settled = frames
        .windows(2)
        .rfind(|pair| pair[0].estimate.covariance_n != pair[1].estimate.covariance_n);
    let [_, settled] = settled.expect("windows that close") else {
        unreachable!()
    };
    let [nn, ne, nd, ..] = settled.estimate.covariance_n;
    // The step follows its cycle, and the next one is 200 ms later.
    let at = settled.start_us * 1_000 + 120 * MS;
    let options = Options {
        statics: vec![(VARIABLES.into(), VARIABLES_BYTES)],
        ..Options::default()
    };
    let mut tape = Tape {
        script: script(),
        ..Tape::default()
    };
    let report = fly_with(&options, image(), plant(), &[], at, &mut tape).expect("it flies");
    let row: Vec<u8> = [nn, ne, nd].iter().flat_map(|number| number.to_le_bytes()).collect();
    let bytes = &report.statics[0];
    let numbers = |from: usize| bytes[from..from + 12] == row[..];
    let places: Vec<usize> = (0..VARIABLES_BYTES - 100)
        .step_by(4)
        .filter(|at| numbers(*at))
        .collect();
    // The other places have six numbers, where this one has the covariance with the velocity after three.
    let second = ne.to_le_bytes();
    let of_five = places.iter().filter(|at| bytes[**at + 20..**at + 24] == second);
    let of_five: Vec<&usize> = of_five.collect();
    let [place] = of_five[..] else {
        panic!("{places:x?} {of_five:x?}")
    };
    (*place, at)
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    /// U9: a copy of the mode is found by what it is in WAIT and in FLIGHT, and one bit of it is flipped.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
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

    /// U3: where arithmetic overflows, in FLIGHT and recording: the record is said, and is in the log at the next start.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
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

    /// U9: bits of the attitude filter flip in the RAM, one in seven packets. Each is found and said, and no frame is without an attitude
    /// or has one that is off by more than it says.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn flipped_bits_of_the_filter_in_ram_are_found_and_the_attitude_goes_on() {
        let (place, from) = covariance();
        // Any bit of any of the 25 numbers, both odd so that all of them have their turn.
        let flips: Vec<Scheduled> = (0..25)
            .map(|n| Scheduled {
                at: from + 1_400 * MS * n,
                fault: Fault::RamFlip(
                    8 * (VARIABLES_AT + place) as u32 + 32 * (n as u32 * 7 % 25) + n as u32 * 11 % 32,
                ),
            })
            .collect();
        let flown = |faults: &[Scheduled]| {
            let mut tape = Tape {
                script: vec![(MS, b"G_DL".to_vec())],
                ..Tape::default()
            };
            let plant = Plant::new(world("still"), 7);
            let end = from + 36_000 * MS;
            let report = emulated::fly(image(), plant, faults, end, &mut tape).expect("it flies");
            assert!(report.resets.is_empty(), "{:?}", report.resets);
            tape
        };
        let (undisturbed, struck) = (flown(&[]), flown(&flips));
        let said = struck.said();
        let found = said.matches("a flipped bit of the attitude filter was found: it goes on from its copy");
        assert_eq!(found.count(), flips.len(), "{said}");
        assert!(!undisturbed.said().contains("flipped"));
        let (expected, frames) = (undisturbed.derived(), struck.derived());
        assert_eq!(expected.len(), frames.len());
        for (expected, frame) in expected.iter().zip(&frames) {
            let Some(was) = expected.estimate.q_nb else { continue };
            let is = frame.estimate.q_nb.expect("an attitude in every frame");
            let cosine: f32 = was.iter().zip(is).map(|(was, is)| was * is).sum();
            let off = 2.0 * (1.0 - cosine * cosine).max(0.0).sqrt();
            let [nn, _, _, ee, _, dd] = frame.estimate.covariance_n;
            let said = (nn + ee + dd).sqrt();
            // Two degrees, as of any attitude here; a window that was begun is lost, and gyros alone go on.
            assert!(
                off < 0.035 && off < 3.0 * said,
                "{}: {off} of {said} rad",
                frame.counter
            );
        }
    }
}
