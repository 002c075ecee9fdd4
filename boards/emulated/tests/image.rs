//! The release image on the stand: what it reads, when it sends, what it is told.

#[allow(dead_code, reason = "each test file uses its own share of the bench")]
mod bench;

use std::sync::OnceLock;

use bench::{MS, Tape, flown, image, world};
use emems::{board::ResetCause, health::Health, sample::Reading, unit::Settings};
use emulated::{Covers, Error, Options, Report, fly_with};
use twin::{
    host,
    part::Nanos,
    plant::{Plant, Quality},
    run::{Fault, Scheduled},
};

/// \[ns\] between packets.
const PERIOD: Nanos = 200 * MS;
/// \[ns\] what the unit's period may jitter: 0.1 ms is allowed, microseconds are seen.
const JITTER: Nanos = MS / 10;
/// All I2C sensors: accelerometers, magnetometers, thermometers.
const I2C_SENSORS: u16 = 0xF0FF;
/// Cycles until every sensor is configured and has a sample.
const SETTLED: usize = 2;

fn readings(tape: &Tape) -> Vec<Reading> {
    tape.packets().into_iter().map(|(_, reading)| reading).collect()
}

/// \[ms\] the calm flight: the image's checksum is known after 240 KiB at 4 KiB every 200 ms.
const CALM_MS: u64 = 13_700;
/// When it is told G_ME, and when it is asked for its status.
const TOLD: Nanos = 633 * MS;
const ASKED: Nanos = 13_500 * MS;

/// The tape of the calm flight before it.
fn to_say() -> Tape {
    Tape {
        script: vec![(TOLD, b"G_ME".to_vec()), (ASKED, b"G_ST".to_vec())],
        ..Tape::default()
    }
}

/// A flight at rest that nothing befalls. Translating the image costs more than flying it, so what is asked of such a flight is asked
/// of one.
fn fly_calmly() -> (Tape, Report) {
    let options = Options {
        statics: vec![("_SEGGER_RTT".into(), 10)],
        ..Options::default()
    };
    let mut tape = to_say();
    let report = flown(&options, &[], CALM_MS, &mut tape);
    (tape, report)
}

fn calm() -> &'static (Tape, Report) {
    static CALM: OnceLock<(Tape, Report)> = OnceLock::new();
    CALM.get_or_init(fly_calmly)
}

#[test]
fn a_packet_comes_every_200_ms() {
    let (tape, report) = calm();
    let packets = tape.packets();
    assert!(packets.len() >= 67, "{} packets", packets.len());
    for pair in packets.windows(2) {
        assert_eq!(pair[1].1.counter, pair[0].1.counter + 1);
        let period = pair[1].0 - pair[0].0;
        assert!(period.abs_diff(PERIOD) <= JITTER, "{period} ns");
    }
    assert_eq!(report.flown, CALM_MS * MS);
    assert_eq!(report.resets, []);
    assert_eq!(report.unanswered, [""; 0]);
}

#[test]
fn the_image_reads_what_the_host_run_reads() {
    let mut host = to_say();
    let plant = Plant::ideal(world("still"));
    host::fly(plant, Settings::NOMINAL, &[], CALM_MS * MS, &mut host);
    let [emulated, host] = [&calm().0, &host].map(readings);
    assert!(emulated.len() > SETTLED + 60);
    assert_eq!(emulated[SETTLED..emulated.len()], host[SETTLED..emulated.len()]);
}

#[test]
fn at_rest_every_plate_reads_gravity_the_field_no_rate_and_25_degrees() {
    let reading = *readings(&calm().0).last().expect("packets");
    assert_eq!(reading.errors.0, 0);
    let norm = |counts: [i16; 3]| counts.map(|count| f64::from(count).powi(2)).iter().sum::<f64>().sqrt();
    for plate in 0..4 {
        // 3 mg/count at +-6 g; three axes rounded to a count each.
        assert!((norm(reading.acc_p[plate]) - 333.3).abs() < 2.0, "{reading:?}");
        // The plates turn the field, they do not change it.
        assert!(
            (norm(reading.mag_p[plate]) - norm(reading.mag_p[0])).abs() < 2.0,
            "{reading:?}"
        );
        assert!(reading.gyro[plate].abs() <= 1, "{reading:?}");
        // 0.0625 degC/count.
        assert!(reading.temperature[plate].abs_diff(400) <= 1, "{reading:?}");
    }
}

#[test]
fn two_runs_are_the_same_to_the_nanosecond_and_the_instruction() {
    let (tape, report) = fly_calmly();
    assert_eq!(calm().0, tape);
    assert_eq!(calm().1, report);
}

#[test]
fn without_the_cover_of_last_no_i2c_sensor_is_read() {
    let covers = Covers {
        i2c_last: false,
        ..Covers::default()
    };
    let options = Options {
        covers,
        ..Options::default()
    };
    let mut tape = Tape::default();
    flown(&options, &[], 900, &mut tape);
    let errors = readings(&tape).last().map(|reading| reading.errors.0);
    assert_eq!(errors, Some(I2C_SENSORS));
    // Each read returns the byte too many of the one before it.
    let shifted = ["holds 0x", "read 0x"];
    assert!(shifted.iter().any(|text| tape.said().contains(text)), "{}", tape.said());
}

#[test]
fn without_the_cover_of_the_timer_the_units_clock_jumps_and_packets_come_too_early() {
    let covers = Covers {
        timer_update: false,
        ..Covers::default()
    };
    let options = Options {
        covers,
        ..Options::default()
    };
    let mut bare = Tape::default();
    flown(&options, &[], 400, &mut bare);
    let first = |tape: &Tape| tape.packets()[0].0;
    assert!(
        first(&calm().0) - first(&bare) > 30 * MS,
        "half a period of the time driver is 32.768 ms"
    );
}

#[test]
fn a_command_is_answered_within_its_millisecond_or_two() {
    let (tape, _) = calm();
    let answer = tape.umbilical.iter().find(|(at, _)| *at >= TOLD);
    // Four bytes there and one back at 115200 8N1 take 0.43 ms.
    assert!(answer.is_some_and(|(at, _)| *at < TOLD + 2 * MS), "{:?}", tape.said());
    assert!(tape.said().contains("G_ME"), "{}", tape.said());
}

#[test]
fn a_framing_error_on_every_byte_loses_the_command_and_nothing_else() {
    let options = Options {
        framing_errors_per_million: 1_000_000,
        ..Options::default()
    };
    let mut tape = Tape {
        script: vec![(633 * MS, b"G_MV".to_vec())],
        ..Tape::default()
    };
    let report = flown(&options, &[], 1_300, &mut tape);
    assert_eq!(report.resets, []);
    assert_eq!(readings(&tape).last().map(|reading| reading.errors.0), Some(0));
    assert!(!tape.said().contains("G_MV"), "{}", tape.said());
}

#[test]
fn a_board_without_its_crystal_says_so_everywhere_and_flies_on() {
    let options = Options {
        no_crystal: true,
        ..Options::default()
    };
    let mut tape = Tape {
        script: vec![(500 * MS, b"G_DLG_ST".to_vec())],
        ..Tape::default()
    };
    flown(&options, &[], 1_000, &mut tape);
    assert!(tape.said().contains("G_ST clock internal"), "{}", tape.said());
    let health = tape.derived().last().expect("derived frames").health;
    assert!(health.contains(Health::INTERNAL_OSCILLATOR), "{health:?}");
    assert!(
        tape.log
            .iter()
            .any(|line| line.contains("WARN") && line.contains("crystal")),
        "{:?}",
        tape.log
    );
    assert!(tape.packets().len() >= 2);
}

#[test]
fn a_static_is_read_by_its_name_and_a_wrong_name_is_refused() {
    assert_eq!(calm().1.statics, [b"SEGGER RTT".to_vec()]);
    let options = Options {
        statics: vec![("NO_SUCH_STATIC".into(), 10)],
        ..Options::default()
    };
    let refused = fly_with(
        &options,
        image(),
        Plant::ideal(world("still")),
        &[],
        MS,
        &mut Tape::default(),
    );
    assert!(matches!(&refused, Err(Error::Image(error)) if error.to_string().contains("NO_SUCH_STATIC")));
}

/// The voltage detector's interrupt counts; a reset in between loses none.
#[test]
fn dips_of_the_supply_are_counted_since_power_on() {
    let supply = |at: u64, failing: bool| Scheduled {
        at: at * MS,
        fault: Fault::SupplyFailing(failing),
    };
    let reset = Scheduled {
        at: 900 * MS,
        fault: Fault::Reset,
    };
    let faults = [
        supply(400, true),
        supply(420, false),
        supply(600, true),
        supply(620, false),
        reset,
        supply(1_400, true),
        supply(1_420, false),
    ];
    let mut tape = Tape {
        script: vec![(1_700 * MS, b"G_ST".to_vec())],
        ..Tape::default()
    };
    flown(&Options::default(), &faults, 1_900, &mut tape);
    assert!(tape.said().contains("read-out 1 dips 3 "), "{}", tape.said());
}

/// \[bytes\] what the stack may have grown to: 60 % of its place. Most is the estimator's, while it is being built.
const STACK_CEILING: usize = 64 * 1024 * 6 / 10;

/// \[bytes\] what the status told of it.
fn stack_used(tape: &Tape) -> usize {
    let said = tape.said();
    let used = said
        .split("stack ")
        .nth(1)
        .and_then(|rest| rest.split_once(" of 65536 bytes"));
    used.and_then(|(used, _)| used.parse().ok()).expect("the status tells")
}

/// Lift-off is at 30 s: six seconds of the filter of the spin.
#[test]
fn the_stack_stays_within_its_place_in_the_spin() {
    let mut tape = Tape {
        script: vec![(500 * MS, b"G_DL".to_vec()), (36_000 * MS, b"G_ST".to_vec())],
        ..Tape::default()
    };
    // With noise: sensors that flicker by nothing are left out as frozen.
    let plant = Plant::with(world("rocket"), 7, Quality::NOMINAL);
    fly_with(&Options::default(), image(), plant, &[], 36_500 * MS, &mut tape).expect("it flies");
    let spins = tape
        .derived()
        .iter()
        .filter(|frame| frame.estimate.q_nb.is_some() && frame.estimate.rate_b[0] > 4.5)
        .count();
    assert!(spins > 5, "{spins} packets");
    let used = stack_used(&tape);
    println!("{used} bytes of stack in the spin");
    assert!((512..=STACK_CEILING).contains(&used), "{used}");
}

#[test]
fn the_stack_stays_within_its_place_through_commands_self_test_and_faults() {
    let faults = [
        Scheduled {
            at: 1_500 * MS,
            fault: Fault::BusStuck(true),
        },
        Scheduled {
            at: 1_900 * MS,
            fault: Fault::BusStuck(false),
        },
    ];
    let mut tape = Tape {
        script: vec![
            (500 * MS, b"G_DLG_MTG_MTG_HE".to_vec()),
            (2_100 * MS, b"G_AT".to_vec()),
            (7_500 * MS, b"G_ST".to_vec()),
        ],
        ..Tape::default()
    };
    flown(&Options::default(), &faults, 8_000, &mut tape);
    let used = stack_used(&tape);
    println!("{used} bytes of stack");
    // A mark that was never painted or never read would be 0 or all of it.
    assert!((512..=STACK_CEILING).contains(&used), "{used}");
    assert!(
        tape.derived()
            .iter()
            .all(|frame| !frame.health.contains(Health::INTERNAL_OSCILLATOR))
    );
}

/// Exceptions (ARMv7-M ARM, B1.5.2), and `svc #0` twice.
const NMI: usize = 2;
const SVCALL: usize = 11;
const SUPERVISOR_CALL: u32 = 0xDF00_DF00;

/// U6: the clock security system's NMI ends in a reset, and the internal oscillator takes over. The emulator cannot raise the NMI. The
/// exception of a supervisor call leads to the same handler, so a function of the estimation makes one; it is run some 1.2 s after a start.
#[test]
fn a_crystal_that_stops_in_flight_costs_a_reset_and_flight_goes_on() {
    assert_eq!(image().vector(NMI), image().vector(SVCALL), "one handler");
    let calling = image()
        .with_code("6Filter11keep_finite", SUPERVISOR_CALL)
        .expect("the function is there");
    let mut tape = Tape {
        script: vec![(600 * MS, b"G_DLG_MVG_MV".to_vec()), (2_100 * MS, b"G_ST".to_vec())],
        ..Tape::default()
    };
    let fault = Scheduled {
        at: 900 * MS,
        fault: Fault::CrystalLost,
    };
    let plant = Plant::ideal(world("still"));
    let report = fly_with(&Options::default(), &calling, plant, &[fault], 2_300 * MS, &mut tape).expect("it flies");
    assert_eq!(report.struck.get("crystal-lost"), Some(&1));
    let Some((at, ResetCause::Software)) = report.resets.first().copied() else {
        panic!("{:?}", report.resets)
    };
    assert!(at > 900 * MS);
    for told in ["UnhandledException at", "G_ST FLIGHT", "G_ST clock internal"] {
        assert!(tape.said().contains(told), "{told} in {}", tape.said());
    }
    let after = tape
        .packets()
        .into_iter()
        .find(|(sent, _)| *sent > at)
        .expect("packets");
    assert!(after.0 - at < 500 * MS, "{} ns", after.0 - at);
    let health = tape.derived().last().expect("derived frames").health;
    assert!(health.contains(Health::INTERNAL_OSCILLATOR), "{health:?}");
}

/// U10: what `ground size` prints of the file is what the unit finds in its flash, and another image has another one.
#[test]
fn the_status_has_the_checksum_of_the_image_and_another_one_for_another() {
    let (tape, _) = calm();
    let checksum = image().checksum().expect("an ELF file");
    assert!(
        tape.said().contains(&format!(" image {checksum:08X}")),
        "{checksum:08X} in {}",
        tape.said()
    );
    let other = image()
        .with_code("6Filter11keep_finite", 0)
        .expect("the function is there");
    assert_ne!(other.checksum(), Some(checksum));
}

/// C4: every byte with noise, then a wire that is held low: errors as fast as the line carries them. The first word after each
/// is heard.
#[test]
fn noise_and_a_break_on_the_umbilical_cost_the_words_in_them_and_nothing_else() {
    let noise = |at, on| Scheduled {
        at,
        fault: Fault::UmbilicalNoise(on),
    };
    let held = |at, on| Scheduled {
        at,
        fault: Fault::UmbilicalBreak(on),
    };
    let faults = [
        noise(500 * MS, true),
        noise(900 * MS, false),
        held(1_200 * MS, true),
        held(2_200 * MS, false),
    ];
    let mut tape = Tape {
        script: vec![
            (600 * MS, b"G_VEG_HE".to_vec()),
            (901 * MS, b"G_MTG_MT".to_vec()),
            (1_500 * MS, b"G_VEG_HE".to_vec()),
            (2_201 * MS, b"G_MtG_Mt".to_vec()),
            (2_300 * MS, b"G_ST".to_vec()),
        ],
        ..Tape::default()
    };
    let report = flown(&Options::default(), &faults, 2_600, &mut tape);
    assert_eq!(report.resets, []);
    assert_eq!(report.struck.get("umbilical-noise"), Some(&8), "{:?}", report.struck);
    // A frame takes 86.9 us.
    assert!(report.struck["umbilical-break"] > 11_000, "{:?}", report.struck);
    let said = tape.said();
    assert!(said.contains("G_MT ok") && said.contains("G_Mt ok"), "{said}");
    assert!(!said.contains("G_VE"), "{said}");
    let packets = tape.packets();
    for pair in packets.windows(2) {
        let period = pair[1].0 - pair[0].0;
        assert!(period.abs_diff(PERIOD) <= 2 * MS, "{period} ns");
    }
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn option_bytes_are_told_and_a_brown_out_reset_that_is_not_set_as_the_board_asks_is_said_at_the_start() {
        for (set_mv, read_out) in [(0, 0), (2100, 1), (2400, 2), (2700, 1)] {
            let mut plant = Plant::ideal(world("still"));
            plant.options.brown_out.set_mv = set_mv;
            plant.options.read_out = read_out;
            let mut tape = Tape {
                script: vec![(400 * MS, b"G_ST".to_vec())],
                ..Tape::default()
            };
            fly_with(&Options::default(), image(), plant, &[], 600 * MS, &mut tape).expect("it flies");
            let status = format!("brown-out {set_mv} mV of 2700 read-out {read_out} dips 0");
            assert!(tape.said().contains(&status), "{}", tape.said());
            let warning = format!("brown-out reset at {set_mv} mV, the board asks for 2700");
            assert_eq!(tape.said().contains(&warning), set_mv < 2700, "{}", tape.said());
        }
    }
}
