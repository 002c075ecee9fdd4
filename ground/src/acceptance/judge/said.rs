//! What the unit says: firmware, option bytes, clock, self-tests, the recorder, the lines.

use emems::sample::SENSORS;

use super::Finding;
use crate::acceptance::{
    evidence::Evidence,
    limits,
    status::{SelfTest, Status, self_test, version},
};

fn finding(part: &str, what: &'static str, measured: String, limit: &str, good: bool, check: &str) -> Finding {
    Finding {
        part: part.into(),
        what,
        measured,
        limit: limit.into(),
        good,
        check: check.into(),
    }
}

fn said<T: std::fmt::Display>(value: Option<T>) -> String {
    value.map_or("not said".into(), |value| value.to_string())
}

/// Firmware, option bytes, clock, start, stack.
pub fn unit(evidence: &Evidence) -> Vec<Finding> {
    let all = Status::all(evidence);
    let (Some(first), Some(last)) = (all.first(), all.last()) else {
        let check = "supply; umbilical plugged, TX and RX not exchanged, 115200 baud; is the image flashed?";
        return vec![finding(
            "unit",
            "answers",
            "no reply to G_ST".into(),
            "an answer",
            false,
            check,
        )];
    };
    let mut found = Vec::new();
    let mode = first.mode.as_deref();
    found.push(finding(
        "unit",
        "mode",
        format!("{}{}", said(mode), if first.safe { ", SAFE MODE" } else { "" }),
        "WAIT",
        mode == Some("WAIT") && !first.safe,
        "FLIGHT: send G_ME twice, is the lift-off line asserted? SAFE MODE: it started three times without a minute of health",
    ));
    let ours = env!("CARGO_PKG_VERSION");
    let theirs = version(evidence);
    let check = "flash the image of this source: cargo run --release";
    found.push(finding(
        "firmware",
        "version",
        said(theirs),
        ours,
        theirs == Some(ours),
        check,
    ));
    let brown_out = first.brown_out_mv;
    found.push(finding(
        "option bytes",
        "brown-out level",
        said(brown_out.map(|(set, _)| format!("{set} mV"))),
        &said(brown_out.map(|(_, asked)| format!("{asked} mV"))),
        brown_out.is_some_and(|(set, asked)| set >= asked),
        "program BOR_LEV = 00 with the debugger (docs/boards.md): from the factory it is off",
    ));
    found.push(finding(
        "option bytes",
        "read-out protection",
        said(first.read_out.map(|level| format!("level {level}"))),
        "level 1",
        first.read_out == Some(1),
        "level 0 is the bench's: program RDP = 0xBB as the last of the option bytes, then cut the power (docs/threats.md); level 2 has no way back",
    ));
    let clock = first.clock.as_deref();
    found.push(finding(
        "clock",
        "source",
        said(clock),
        "crystal",
        clock == Some("crystal"),
        "the 8 MHz crystal and its two load capacitors: soldered, right value, no bridge at OSC_IN and OSC_OUT",
    ));
    let resets = (first.resets, last.resets);
    found.push(finding(
        "processor",
        "resets during the test",
        said(
            resets
                .1
                .zip(resets.0)
                .map(|(after, before)| after.saturating_sub(before)),
        ),
        "0",
        resets.0.is_some() && resets.0 == resets.1,
        "supply (dips at load), NRST, the watchdog: G_ST says why it started",
    ));
    found.push(finding(
        "supply",
        "dips below 2.9 V since power-on",
        said(last.dips),
        "0",
        last.dips == Some(0),
        "the regulator and its capacitors, the plug and the cable, what else draws from the line when sensors and NAND begin to work",
    ));
    if let Some((used, size)) = last.stack.filter(|(_, size)| *size > 0) {
        let good = f64::from(used) <= limits::STACK * f64::from(size);
        let limit = format!("{:.0} % of {size}", 100.0 * limits::STACK);
        found.push(finding(
            "processor",
            "stack",
            format!("{used} bytes"),
            &limit,
            good,
            "report it with the firmware's version",
        ));
    }
    for missing in &evidence.missing {
        let check = "do it again; the lines that need it are not measured";
        found.push(finding("test", "not seen", missing.clone(), "seen", false, check));
    }
    found
}

/// Identity and self-test of every sensor.
pub fn sensors(evidence: &Evidence) -> Vec<Finding> {
    let results = SENSORS.map(|sensor| self_test(evidence, &sensor.to_string()));
    let dead = |slot: usize| !matches!(results[slot], Some(SelfTest::Passed));
    let i2c = [0, 1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15];
    let all_dead = i2c.into_iter().all(dead);
    let mut found = Vec::new();
    for (slot, sensor) in SENSORS.into_iter().enumerate() {
        let (good, measured) = match &results[slot] {
            Some(SelfTest::Passed) => (true, "passed".into()),
            Some(SelfTest::Failed(why)) => (false, why.clone()),
            None => (false, "not said".into()),
        };
        let plate_dead = [0, 4, 12].into_iter().all(|kind| dead(kind + sensor.plate));
        let check = check_of(slot, &measured, all_dead, plate_dead);
        found.push(finding(
            &sensor.to_string(),
            "identity and self-test",
            measured,
            "passed",
            good,
            &check,
        ));
    }
    found
}

/// What to check of a sensor that failed.
fn check_of(slot: usize, why: &str, all_dead: bool, plate_dead: bool) -> String {
    let plate = SENSORS[slot].plate;
    let number = plate + 1;
    if slot / 4 == 2 {
        let silent = why.contains("read 0x00") || why.contains("read 0xFFFF");
        let what = if silent {
            "answers nothing"
        } else {
            "answers, and is not well"
        };
        return format!(
            "gyro {number} {what}: chip select PC{plate}, SCK, MISO, MOSI, 5 V, solder; was it still in its test?"
        );
    }
    if all_dead {
        return "no I2C part of any plate answers: the multiplexer's supply, address and RESET (PB5), pull-ups on SCL and SDA (PB6, PB7), \
                a part that holds a line low"
            .into();
    }
    if plate_dead {
        return format!(
            "no I2C part of plate {number} answers: its channel SC{plate} and SD{plate} of the multiplexer, its cable, its 3.3 V"
        );
    }
    // As the chip's own driver says it, and as embedded-hal does.
    let missing = why.contains("Nack") || why.contains("NoAcknowledge");
    let identity = why.contains("not this part");
    match slot / 4 {
        1 if missing => {
            "nothing at 0x1E: not soldered, dead, or a clone (QMC5883L, which answers at 0x0D and is not supported)"
                .into()
        }
        1 if identity => "another part answers at 0x1E: a clone or another type; only an HMC5883L says H43".into(),
        0 if missing => "nothing at 0x18: not soldered, dead, or SA0 is high (0x19)".into(),
        0 if identity => "another part answers at 0x18: a LIS331HH says 0x32".into(),
        3 if missing => "nothing at 0x48: not soldered, dead, or ADD0 is not at ground".into(),
        _ => "its solder joints and supply; keep the unit still in its test, and repeat; then replace it".into(),
    }
}

/// Lift-off and micro-gravity.
pub fn lines(evidence: &Evidence) -> Vec<Finding> {
    let all = Status::all(evidence);
    let first = all.first();
    let level = |line: Option<bool>| said(line.map(u8::from));
    let lift_off = first.and_then(|status| status.lift_off);
    let micro_g = first.and_then(|status| status.micro_g);
    let seen = evidence.lift_off_seen;
    let let_go = all.last().and_then(|status| status.lift_off);
    vec![
        finding(
            "lift-off line",
            "at rest",
            level(lift_off),
            "0",
            lift_off == Some(false),
            "PC6 is active low: pull-up missing, bridge to ground, plug of the vehicle in?",
        ),
        finding(
            "lift-off line",
            "asserted",
            match seen {
                Some(true) => "seen".into(),
                Some(false) => "not seen".into(),
                None => "not tried".into(),
            },
            "seen",
            seen == Some(true),
            "PC6 to the connector, the optocoupler and its series resistor; was it asserted?",
        ),
        finding(
            "lift-off line",
            "let go",
            level(let_go),
            "0",
            let_go == Some(false),
            "PC6: pull-up missing, or a bridge to ground",
        ),
        finding(
            "micro-g line",
            "at rest",
            level(micro_g),
            "0",
            micro_g == Some(false),
            "PC7 is active low: pull-up missing, or a bridge to ground",
        ),
    ]
}

/// The recorder: what is wrong with it, bad blocks, written and read back.
pub fn memory(evidence: &Evidence) -> Vec<Finding> {
    let all = Status::all(evidence);
    let (Some(first), Some(last)) = (all.first(), all.last()) else {
        return Vec::new();
    };
    let trouble = all.iter().filter_map(|status| status.recorder.as_deref());
    let is_trouble =
        |line: &&str| !(line.starts_with("last record") || *line == "empty" || line.starts_with("erasing"));
    let said_trouble = evidence
        .said
        .iter()
        .filter_map(|said| said.text.strip_prefix("recorder: "));
    let trouble = trouble.filter(is_trouble).chain(said_trouble).next_back();
    let bus =
        "the NAND: supply, CE#, RE#, WE#, ALE (A17), CLE (A16), R/B#, WP# (PC8) and the eight data lines of the FSMC";
    let mut found = vec![finding(
        "recorder",
        "answers",
        trouble.unwrap_or("yes").into(),
        "yes",
        trouble.is_none() && last.capacity.is_some_and(|pages| pages > 0),
        bus,
    )];
    // By how much a count has grown since the test began.
    let grown = |of: fn(&Status) -> Option<u32>| {
        let (after, before) = of(last).zip(of(first))?;
        Some(after.saturating_sub(before))
    };
    let bad = last.bad_blocks;
    found.push(finding(
        "recorder",
        "bad blocks",
        said(bad),
        &format!("at most {}", limits::BAD_BLOCKS),
        bad.is_some_and(|bad| bad <= limits::BAD_BLOCKS),
        "a worn or a counterfeit chip: replace it; many at once are an address or data line",
    ));
    let written = grown(|status| status.used);
    found.push(finding(
        "recorder",
        "written",
        said(written.map(|pages| format!("{pages} pages"))),
        "25 pages or more",
        written.is_some_and(|pages| pages >= 25),
        bus,
    ));
    let follows = |pair: &[emems::sample::Reading]| pair[1].counter == pair[0].counter.wrapping_add(1);
    let breaks = evidence.dumped.windows(2).filter(|pair| !follows(pair)).count();
    let unreadable = evidence
        .said
        .iter()
        .filter(|said| said.text.contains("cannot be read"))
        .count();
    let read = evidence.dumped.len();
    found.push(finding(
        "recorder",
        "read back",
        format!("{read} packets, {breaks} breaks, {unreadable} pages unreadable"),
        "25 packets or more, 0 breaks, 0 pages",
        read >= 25 && breaks == 0 && unreadable == 0,
        bus,
    ));
    let halves = grown(|status| status.lost_halves);
    found.push(finding(
        "recorder",
        "halves of pages lost",
        said(halves),
        "0",
        halves == Some(0),
        "data lines and supply of the NAND; then the chip",
    ));
    let corrected = grown(|status| status.corrected);
    found.push(finding(
        "recorder",
        "bits corrected",
        said(corrected),
        "at most 1",
        corrected.is_some_and(|bits| bits <= 1),
        "a new chip has next to none: supply and data lines of the NAND; then the chip",
    ));
    found
}
