//! A long flight with faults that arrive at random: `ground drill day`, and `--long` after the catalogue.
//!
//! In: a board, a seed, seconds. Out: how many faults struck, and what the unit did. Faults of every kind that the board can make
//! come one after the other, 5 to 60 s apart, each for up to 20 s; every ten minutes the ground leads out of safe mode, and every two
//! hours it reads nothing out, erases the log and begins to record anew.
//!
//! Accepted is a flight in which
//!
//! - no packet is missing but while a reset or a stuck telemetry line excuses it;
//! - packets come every 200 ms, to 2 ms where nothing befalls the unit, so that time does not drift; and while something does,
//!   no later than the deadline of a cycle allows;
//! - at the end, a minute after the last fault, all sensors are read, there is an attitude, the console answers, the recorder
//!   takes packets, and no queue holds anything back: a packet comes as soon after its cycle as at the beginning;
//! - the image's stack is at most three fifths of its place, asked every ten minutes and at the end. The mark begins anew with each
//!   start. All other memory of the unit is static, and the host board has no stack of the unit's.

use host_tests::{Flown, MS, S, recorder::draws, world};
use twin::{
    fault::{Planned, SENSOR_NAMES},
    part::Nanos,
    plant::Plant,
};

use crate::{
    campaign::Told,
    flight::{Board, flown},
};

/// \[s\] between what the ground does.
const LEAVES_SAFE_MODE_S: u64 = 600;
const BEGINS_ANEW_S: u64 = 7_200;
/// \[s\] at the end without faults: what was excluded is believed again, and a start is healthy.
const QUIET_S: u64 = 90;
/// \[ns\] a packet after a reset: the watchdog's second, the gyros' start, two cycles.
const BACK: Nanos = 2_500 * MS;
/// \[ns\] beyond its period a packet may be while something befalls the unit: the deadline of a cycle that takes 10 ms otherwise.
const LATE: Nanos = 185 * MS;

/// Of its place the stack may take at most this many hundredths: what no flight has met yet needs the rest.
const STACK_PER_CENT: u64 = 60;

/// Faults that befall a sensor, an I2C sensor, the unit for a while, and the unit once.
const OF_SENSORS: [&str; 3] = ["silent", "garbage", "frozen"];
const OF_I2C: [(&str, &str); 2] = [("nack", "=0"), ("stretch", "")];
const LASTING: [&str; 12] = [
    "mux-silent",
    "bus-stuck",
    "bridged:2",
    "nand-dead",
    "nand-flips",
    "supply",
    "lift-off:bouncing",
    "micro-g:high",
    "telemetry-stuck",
    "umbilical-stuck",
    "umbilical-noise",
    "umbilical-break",
];
const AT_ONCE: [&str; 16] = [
    "sda-held",
    "stop-misplaced",
    "power-cut",
    "reset",
    "panic",
    "dma-hung",
    "busy=3",
    "kept-flip",
    "image-flip",
    "hang:sensors",
    "hang:gyros",
    "hang:telemetry",
    "hang:umbilical-out",
    "hang:umbilical-in",
    "hang:lines",
    "hang:nand",
];
/// Of those, what ends in a reset.
const RESETS: [&str; 5] = ["power-cut", "reset", "panic", "dma-hung", "kept-flip"];

/// A fault of the plan.
struct Arriving {
    planned: Planned,
    /// In the words of a plan.
    text: String,
    /// \[ns\] from when to when it may be felt.
    felt: (Nanos, Nanos),
    excuses: bool,
}

/// What befalls the unit of a board whose faults have this letter ([`twin::fault::Word::places`]).
fn arriving(letter: char, seed: u64, until_s: u64) -> Vec<Arriving> {
    let mut draw = draws(seed, 86);
    let (mut plan, mut at_ms) = (Vec::new(), 10_000);
    while at_ms < until_s * 1000 {
        let lasts_ms = 500 + draw(19_500);
        let sensor = |draw: &mut dyn FnMut(u64) -> u64| SENSOR_NAMES[draw(16) as usize];
        let (text, is_lasting) = match draw(5) {
            0 => (format!("{}:{}", OF_SENSORS[draw(3) as usize], sensor(&mut draw)), true),
            1 => {
                let part = ["a", "m", "t"][draw(3) as usize];
                let (word, amount) = OF_I2C[draw(2) as usize];
                (format!("{word}:{part}{}{amount}", 1 + draw(4)), true)
            }
            2 => (LASTING[draw(12) as usize].to_string(), true),
            _ => (AT_ONCE[draw(16) as usize].to_string(), false),
        };
        let ends_ms = at_ms + if is_lasting { lasts_ms } else { 0 };
        let when = if is_lasting {
            format!("{at_ms}ms..{ends_ms}ms")
        } else {
            format!("{at_ms}ms")
        };
        let written = format!("{text}@{when}");
        let planned: Planned = written.parse().unwrap_or_else(|error| panic!("the plan: {error}"));
        if !planned.word.places.contains(letter) {
            continue;
        }
        let is_reset = RESETS.contains(&text.as_str()) || text.starts_with("hang");
        let is_stuck = text == "telemetry-stuck";
        let after = if is_reset { BACK } else { 400 * MS };
        plan.push(Arriving {
            planned,
            text: written,
            felt: (at_ms * MS, ends_ms * MS + after),
            excuses: is_reset || is_stuck,
        });
        at_ms = ends_ms + 5_000 + draw(55_000);
    }
    plan
}

/// Flies so long.
pub fn fly(board: &Board<'_>, seed: u64, seconds: u64) -> Told {
    let plan = arriving(board.letter(), seed, seconds.saturating_sub(QUIET_S));
    let (mut strokes, mut said) = (Vec::new(), Vec::new());
    let mut say = |at: Nanos, words: &[u8]| said.push((at, words.to_vec()));
    for (n, arriving) in plan.iter().enumerate() {
        strokes.extend(arriving.planned.strokes(seed + n as u64));
        if arriving.text.contains("umbilical-") {
            // The part that sends hangs, or finds its line stuck, when it has something to send.
            say(arriving.felt.0 + MS, b"G_VE");
        }
    }
    say(S, b"G_MVG_MV");
    say(2 * S, b"G_MGG_MG");
    for at_s in (LEAVES_SAFE_MODE_S..seconds - QUIET_S).step_by(LEAVES_SAFE_MODE_S as usize) {
        say(at_s * S, b"G_ST");
        say((at_s + 1) * S, b"G_XN");
    }
    for at_s in (BEGINS_ANEW_S..seconds - QUIET_S).step_by(BEGINS_ANEW_S as usize) {
        say((at_s + 1) * S, b"G_MEG_ME");
        say((at_s + 2) * S, b"G_MAG_CA");
        say((at_s + 30) * S, b"G_MVG_MVG_MGG_MG");
    }
    let end = seconds * S;
    // Derived frames of a day would fill the memory; those of the end are enough.
    say(end - 60 * S, b"G_XNG_MVG_MVG_MGG_MG");
    say(end - 5 * S, b"G_DL");
    say(end - 2 * S, b"G_ST");
    said.sort_by_key(|(at, _)| *at);
    match flown(board, Plant::new(world("still"), seed), strokes, said, end) {
        Ok(flown) => Told {
            struck: flown.report.struck.values().sum(),
            did: judged(&plan, &flown),
        },
        Err(why) => Told {
            struck: 0,
            did: Err(why),
        },
    }
}

fn judged(plan: &[Arriving], flown: &Flown) -> Result<String, String> {
    let second = |at: Nanos| at as f64 * 1e-9;
    let felt = |from: Nanos, to: Nanos| plan.iter().any(|fault| fault.felt.0 < to && from < fault.felt.1);
    let excused = |from: Nanos, to: Nanos| {
        plan.iter()
            .any(|fault| fault.excuses && fault.felt.0 < to && from < fault.felt.1)
    };
    let (mut quiet, mut worst) = (0_u64, 0);
    for pair in flown.packets.windows(2) {
        let [(before, one), (after, next)] = [pair[0], pair[1]];
        let period = after - before;
        let at = second(before);
        if next.counter != one.counter.wrapping_add(1) && !excused(before, after) {
            return Err(format!(
                "packets {} and {} follow each other at {at:.1} s",
                one.counter, next.counter
            ));
        }
        if excused(before, after) {
            continue;
        }
        let off = period.abs_diff(200 * MS);
        if felt(before.saturating_sub(S), after + S) {
            if off > LATE {
                let last = plan.iter().rev().find(|fault| fault.felt.0 < after);
                let last = last.map_or("no fault", |fault| &fault.text);
                return Err(format!("a period of {} ms at {at:.1} s, after {last}", period / MS));
            }
        } else if off > 2 * MS {
            return Err(format!(
                "a period of {} ms at {at:.1} s, where nothing befell the unit",
                period / MS
            ));
        } else {
            (quiet, worst) = (quiet + 1, worst.max(off));
        }
    }
    let named: std::collections::BTreeSet<&str> = plan.iter().map(|fault| fault.planned.word.name).collect();
    let never: Vec<&str> = named
        .into_iter()
        .filter(|name| !flown.report.struck.contains_key(name))
        .collect();
    if !never.is_empty() {
        return Err(format!("{} never struck", never.join(", ")));
    }
    let last = flown.second(flown.report.flown / S - 1);
    let is_well = last.len() >= 4 && last.iter().all(|reading| reading.errors.0 == 0);
    let frame = flown.derived.last().ok_or("no derived frames at the end")?;
    if !is_well || frame.estimate.q_nb.is_none() {
        return Err(format!(
            "at the end errors {:04X?}, attitude {:?}",
            last.last().map(|r| r.errors),
            frame.estimate.q_nb
        ));
    }
    let replies = flown.replies();
    let state = replies.iter().rfind(|reply| reply.contains(" task "));
    if !state.is_some_and(|reply| reply.contains("G_ST FLIGHT task none recording 1")) {
        return Err(format!("at the end {state:?}"));
    }
    let stack = stack(&replies).ok_or("no status tells of the stack")?;
    Ok(format!(
        "{} faults in {:.1} h, {} resets; {} packets, none missing without excuse; {quiet} periods undisturbed, at most {:.1} us off; {}all \
         well at the end",
        plan.len(),
        flown.report.flown as f64 / 3600e9,
        flown.report.resets.len(),
        flown.packets.len(),
        worst as f64 * 1e-3,
        stack?
    ))
}

/// The most that a status said of the stack, or that it is too much; nothing where the board has none. `None`: no status came.
fn stack(replies: &[String]) -> Option<Result<String, String>> {
    let used = |reply: &String| {
        let (_, rest) = reply.split_once(" stack ")?;
        let (used, rest) = rest.split_once(" of ")?;
        let (size, _) = rest.split_once(" bytes")?;
        Some((used.parse::<u64>().ok()?, size.parse::<u64>().ok()?))
    };
    let (used, size) = replies.iter().filter_map(used).max()?;
    Some(match size {
        0 => Ok(String::new()),
        _ if used * 100 > size * STACK_PER_CENT => Err(format!("{used} of {size} bytes of stack")),
        _ => Ok(format!("stack at most {used} of {size} bytes; ")),
    })
}

#[cfg(test)]
mod tests {
    use host_tests::Flight;

    use super::*;

    /// A word that strikes nothing on the host would stand in the plan of a day in name only: a line that bounced a whole number of times
    /// between two looks of the unit did.
    #[test]
    fn every_fault_that_may_arrive_strikes() {
        let sensors = OF_SENSORS.map(|word| format!("{word}:a1@3s..5s"));
        let i2c = OF_I2C.map(|(word, amount)| format!("{word}:a1{amount}@3s..5s"));
        let lasting = LASTING.map(|word| format!("{word}@3s..5s"));
        let once = AT_ONCE.map(|word| format!("{word}@3s"));
        for text in sensors.into_iter().chain(i2c).chain(lasting).chain(once) {
            let planned: Planned = text.parse().unwrap_or_else(|error| panic!("{error}"));
            let said = vec![
                (S, b"G_MVG_MV".to_vec()),
                (2 * S, b"G_MGG_MG".to_vec()),
                (3 * S + MS, b"G_VE".to_vec()),
            ];
            let plant = Plant::new(world("still"), 1);
            let flown = flown(&Board::Host, plant, planned.strokes(1), said, 8 * S).expect("flies");
            let struck = flown.report.struck.get(planned.word.name);
            assert!(
                struck.is_some_and(|times| *times > 0),
                "{text}: {:?}",
                flown.report.struck
            );
        }
    }

    /// The largest of a flight counts, and three fifths are the most.
    #[test]
    fn a_stack_that_grows_is_found() {
        let said = |used: &[u64]| -> Vec<String> {
            let reply = |used: &u64| format!("G_ST clock crystal stack {used} of 1000 bytes brown-out 2700 mV");
            used.iter().map(reply).collect()
        };
        assert_eq!(stack(&[]), None);
        assert_eq!(
            stack(&said(&[300, 600, 20])),
            Some(Ok("stack at most 600 of 1000 bytes; ".into()))
        );
        assert_eq!(
            stack(&said(&[300, 601, 20])),
            Some(Err("601 of 1000 bytes of stack".into()))
        );
    }

    /// What is not excused is found.
    #[test]
    fn a_packet_that_is_missing_without_excuse_is_found() {
        let mut flown = Flight::ideal(world("still")).fly(5 * S);
        assert!(
            judged(&[], &flown).is_err_and(|why| why.contains("derived")),
            "nothing else is amiss"
        );
        flown.packets.remove(10);
        assert!(judged(&[], &flown).is_err_and(|why| why.contains("follow each other")));
    }
}
