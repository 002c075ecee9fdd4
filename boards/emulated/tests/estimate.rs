//! The estimation on the emulated board: the bits a host finds again, and what it costs.

#[allow(dead_code, reason = "each test file uses its own share of the bench")]
mod bench;

use bench::{MS, Tape, image, world};
use emems::{
    board::ResetCause,
    derived::{self, Derived},
    estimate::Estimator,
    health::Health,
    mode::Mode,
    sample::Sample,
    site::{Site, Told},
    unit::Settings,
};
use twin::{
    plant::Plant,
    run::{Fault, Scheduled},
};

/// Instructions in a microsecond: the emulator executes 168 million a second.
const PER_US: u32 = 168;
/// Instructions that half of the steps stay below: what they took when this was written, and a sixth more. 20,000 is wanted.
const MEDIAN_CEILING: u32 = 100_000;

/// Thirty seconds of tumbling from power-on, derived frames on.
fn tumbled() -> Tape {
    let mut tape = Tape {
        script: vec![(MS, b"G_DL".to_vec())],
        ..Tape::default()
    };
    let plant = Plant::new(world("tumble"), 7);
    emulated::fly(image(), plant, &[], 30_000 * MS, &mut tape).expect("the image flies");
    tape
}

#[test]
fn a_host_reproduces_every_bit_of_the_image_s_estimate() {
    let tape = tumbled();
    let (packets, frames) = (tape.packets(), tape.derived());
    assert!(frames.len() > 145, "{} frames", frames.len());
    let mut estimator = Estimator::of(&Settings::NOMINAL);
    let mut costs = Vec::new();
    for frame in &frames {
        let packet = packets.iter().find(|(_, reading)| reading.counter == frame.counter);
        let (_, reading) = *packet.expect("its packet");
        let sample = Sample {
            reading,
            start_us: frame.start_us,
            slots_us: frame.slots_us,
        };
        let again = Derived {
            estimate: estimator.step(&sample, &frame.increments),
            ..*frame
        };
        assert_eq!(
            derived::encode(frame),
            derived::encode(&again),
            "cycle {}",
            frame.counter
        );
        costs.push(frame.estimate_us * PER_US);
    }
    costs.sort_unstable();
    println!(
        "instructions of a step: least {}, median {}, most {}",
        costs[0],
        costs[costs.len() / 2],
        costs[costs.len() - 1]
    );
    assert!(costs[costs.len() / 2] < MEDIAN_CEILING);
}

/// A site told over the umbilical: from one cycle on the image's estimate is that of a unit that begins afresh there.
#[test]
fn a_host_reproduces_every_bit_of_the_image_s_estimate_at_a_site_that_is_told() {
    let mut tape = Tape {
        script: vec![
            (MS, b"G_DL".to_vec()),
            (2_000 * MS, b"G_SI2634FF18F7DDFC84020A400F00G_CK".to_vec()),
        ],
        ..Tape::default()
    };
    let plant = Plant::new(world("rocket"), 7);
    emulated::fly(image(), plant, &[], 6_000 * MS, &mut tape).expect("the image flies");
    assert!(tape.said().contains("site taken"), "{}", tape.said());
    let (packets, frames) = (tape.packets(), tape.derived());
    let told = Told::of(&Site::ALCANTARA).expect("a launch site");
    let differing = |taken_at: usize| {
        let mut estimator = Estimator::of(&Settings::NOMINAL);
        let differ = |(number, frame): &(usize, &Derived)| {
            if *number == taken_at {
                estimator.begin_at(&told.site(&Settings::NOMINAL.site));
            }
            let packet = packets.iter().find(|(_, reading)| reading.counter == frame.counter);
            let sample = Sample {
                reading: packet.expect("its packet").1,
                start_us: frame.start_us,
                slots_us: frame.slots_us,
            };
            let again = Derived {
                estimate: estimator.step(&sample, &frame.increments),
                ..**frame
            };
            derived::encode(frame) != derived::encode(&again)
        };
        frames.iter().enumerate().filter(differ).count()
    };
    let at_once = frames
        .iter()
        .position(|frame| frame.start_us > 1_700_000)
        .expect("frames");
    let taken_at: Vec<usize> = (at_once..at_once + 4).filter(|place| differing(*place) == 0).collect();
    assert_eq!(taken_at.len(), 1, "{taken_at:?}");
    assert!(differing(frames.len()) > 10);
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn after_a_reset_in_flight_the_first_frame_has_the_attitude_and_says_why_the_unit_started() {
        let mut tape = Tape {
            script: vec![(MS, b"G_DL".to_vec()), (1_000 * MS, b"G_MVG_MV".to_vec())],
            ..Tape::default()
        };
        let plant = Plant::new(world("tumble"), 7);
        let reset = Scheduled {
            at: 5_077 * MS,
            fault: Fault::Reset,
        };
        emulated::fly(image(), plant, &[reset], 6_500 * MS, &mut tape).expect("the image flies");
        let frames = tape.derived();
        let starts = frames.windows(2).position(|pair| pair[1].start_us < pair[0].start_us);
        let (before, after) = frames.split_at(starts.expect("a reset") + 1);
        let last = before.last().expect("frames");
        let first = after.first().expect("derived frames go on");
        let start = first.start.expect("a start");
        assert_eq!((start.reset, start.starts, start.crash), (ResetCause::Pin, 2, None));
        assert_eq!(first.mode, Mode::Flight);
        assert!(
            (1..=2).contains(&(first.counter - last.counter)),
            "{} {}",
            last.counter,
            first.counter
        );
        // At rest; found afresh it would take five packets.
        let (was, is) = (
            last.estimate.q_nb.expect("an attitude"),
            first.estimate.q_nb.expect("an attitude"),
        );
        let cosine: f32 = was.iter().zip(is).map(|(was, is)| was * is).sum();
        assert!(cosine.abs() > 0.9999, "{was:?} {is:?}");
        let [nn, _, _, ee, _, dd] = first.estimate.covariance_n;
        println!("deviations {} {} {} rad", nn.sqrt(), ee.sqrt(), dd.sqrt());
    }

    /// From lift-off on a step takes milliseconds in one piece. Nobody who waits for a part meanwhile takes it for silent.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_rocket_that_is_well_loses_no_sensor_while_its_spin_is_followed() {
        let mut tape = Tape {
            script: vec![(MS, b"G_DL".to_vec())],
            ..Tape::default()
        };
        emulated::fly(image(), Plant::new(world("rocket"), 7), &[], 36_000 * MS, &mut tape).expect("the image flies");
        assert!(tape.said().contains("lift-off: FLIGHT"), "{}", tape.said());
        assert!(!tape.said().contains("lost"), "{}", tape.said());
        let unwell = Health::RECONFIGURED.with(Health::BUS_RECOVERED);
        let frames = tape.derived();
        assert!(frames.iter().all(|frame| frame.health.0 & unwell.0 == 0));
        let longest_us = frames.iter().map(|frame| frame.estimate_us).max();
        assert!(longest_us > Some(2_000), "{longest_us:?}: no step was long");
    }
}
