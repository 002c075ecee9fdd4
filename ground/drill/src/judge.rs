//! What is accepted of a unit that a fault has struck: each function takes a flight and says what the unit did, or why that is
//! not accepted. Figures are those of the catalogue.

use std::collections::BTreeSet;

use emems::{
    board::ResetCause,
    derived::Derived,
    health::Health,
    packet,
    sample::{NOT_READ, Reading},
};
use host_tests::{Flown, MS, S, recorder::logged};
use twin::part::Nanos;

/// What the unit did, or why it is not accepted.
pub type Verdict = Result<String, String>;

fn unless(refused: bool, why: impl FnOnce() -> String) -> Result<(), String> {
    if refused { Err(why()) } else { Ok(()) }
}

/// No packet is missing, none is repeated, nothing else is on the line.
fn unbroken(flown: &Flown) -> Result<(), String> {
    let strange = flown.strange.len();
    unless(strange > flown.report.resets.len(), || {
        format!("{strange} writes that are no whole frame")
    })?;
    let mut pairs = flown.packets.windows(2);
    let gap = pairs.find(|pair| pair[1].1.counter != pair[0].1.counter.wrapping_add(1));
    unless(gap.is_some() && flown.report.resets.is_empty(), || {
        let at = gap.map_or(0, |pair| pair[0].0);
        format!("a packet is missing at {:.1} s", at as f64 * 1e-9)
    })
}

/// A packet every 200 ms, to within so much.
fn within(flown: &Flown, most: Nanos) -> Verdict {
    unbroken(flown)?;
    let worst = flown.periods().iter().map(|period| period.abs_diff(200 * MS)).max();
    let worst = worst.ok_or("no packets")?;
    let said = format!(
        "{} packets, at most {:.1} ms off",
        flown.packets.len(),
        worst as f64 * 1e-6
    );
    if worst > most { Err(said) } else { Ok(said) }
}

/// S2, C5: a packet every 200 ms, to within 2 ms.
pub fn steady(flown: &Flown) -> Verdict {
    unless(!flown.report.resets.is_empty(), || "it was reset".into())?;
    within(flown, 2 * MS)
}

/// The last second has all sixteen sensors.
fn well_at_the_end(flown: &Flown) -> Result<(), String> {
    let last = flown.second(flown.report.flown / S - 1);
    let errors = last.iter().fold(0, |errors, reading| errors | reading.errors.0);
    unless(last.len() < 4 || errors != 0, || {
        format!("in the last second {} packets, errors {errors:04X}", last.len())
    })
}

/// A packet every 200 ms, and all is well at the end.
pub fn steady_and_well(flown: &Flown) -> Verdict {
    let said = steady(flown)?;
    well_at_the_end(flown)?;
    Ok(said)
}

/// U2: jitter of at most 5 ms, no reset, and all is well at the end.
pub fn nearly_steady(flown: &Flown) -> Verdict {
    unless(!flown.report.resets.is_empty(), || "the watchdog bit".into())?;
    let said = within(flown, 5 * MS)?;
    well_at_the_end(flown)?;
    Ok(said)
}

fn has_no_value(reading: &Reading, slot: usize) -> bool {
    let plate = slot % 4;
    match slot / 4 {
        0 => reading.acc_p[plate] == [NOT_READ; 3],
        1 => reading.mag_p[plate] == [NOT_READ; 3],
        2 => reading.gyro[plate] == NOT_READ,
        _ => reading.temperature[plate] == NOT_READ,
    }
}

/// S1, S6, S7, S8: in the fifth second one sensor is marked and has no value, no other is; at the end none. The read that runs
/// out of time may make its packet 17 ms late.
pub fn one_is_marked(flown: &Flown) -> Verdict {
    let said = within(flown, 17 * MS)?;
    for reading in flown.second(4) {
        let errors = reading.errors.0;
        let slot = errors.trailing_zeros() as usize;
        unless(errors.count_ones() != 1 || !has_no_value(&reading, slot), || {
            format!("errors {errors:04X}")
        })?;
    }
    well_at_the_end(flown)?;
    Ok(format!("{said}; marked while it lasts, nothing else"))
}

/// S2: a packet for every cycle, none later than its deadline; from two seconds on in time.
pub fn closed_by_the_deadline(flown: &Flown) -> Verdict {
    unbroken(flown)?;
    let longest = flown.derived.iter().map(|frame| frame.cycle_us).max().unwrap_or(0);
    unless(longest > 190_000, || format!("a cycle of {longest} us"))?;
    let late = flown.packets.windows(2).filter(|pair| pair[0].0 > 5 * S);
    let worst = late
        .map(|pair| (pair[1].0 - pair[0].0).abs_diff(200 * MS))
        .max()
        .unwrap_or(0);
    unless(worst > 2 * MS, || format!("{worst} ns off after two seconds"))?;
    unless(
        flown.packets.iter().any(|(_, reading)| reading.errors.0 & 0x0F00 != 0),
        || "a gyro was lost".into(),
    )?;
    Ok(format!(
        "{} packets, longest cycle {} ms",
        flown.packets.len(),
        longest / 1000
    ))
}

/// S3: at most two packets with an error, and the bus was freed.
pub fn freed_within_two_cycles(flown: &Flown) -> Verdict {
    let said = within(flown, 20 * MS)?;
    // The first packet of a run has magnetometers that have not measured yet.
    let hit = flown
        .packets
        .iter()
        .skip(3)
        .filter(|(_, reading)| reading.errors.0 != 0)
        .count();
    unless(hit > 2, || format!("{hit} packets with errors"))?;
    let freed = flown
        .derived
        .iter()
        .filter(|frame| frame.health.contains(Health::BUS_RECOVERED))
        .count();
    unless(freed == 0, || "nobody freed the bus".into())?;
    well_at_the_end(flown)?;
    Ok(format!("{said}; freed {freed} times, {hit} packets with errors"))
}

/// S4, S5: packets go on, the gyros are read throughout, and all is well at the end where the fault has gone.
pub fn gyros_go_on(flown: &Flown) -> Verdict {
    // The first cycle waits for twelve parts, up to its deadline of 190 ms instead of its 10.
    let said = within(flown, 180 * MS)?;
    unless(
        flown.packets.iter().any(|(_, reading)| reading.errors.0 & 0x0F00 != 0),
        || "a gyro was lost".into(),
    )?;
    Ok(said)
}

/// S5: the same, and all is well at the end.
pub fn gyros_go_on_and_all_come_back(flown: &Flown) -> Verdict {
    let said = gyros_go_on(flown)?;
    well_at_the_end(flown)?;
    Ok(said)
}

/// S13: while two plates answer for each other, no packet is late, and the health of the sensors says that they disagree; afterwards
/// all are believed again.
pub fn disagreement_is_said(flown: &Flown) -> Verdict {
    let said = steady(flown)?;
    let frames = |from_s: u64, to_s: u64| {
        let within = move |frame: &&Derived| (from_s * 1_000_000..to_s * 1_000_000).contains(&frame.start_us);
        flown.derived.iter().filter(within)
    };
    let told = |frame: &&Derived| frame.estimate.sensors.0 != 0;
    let (all, doubted) = (frames(25, 40).count(), frames(25, 40).filter(told).count());
    unless(doubted < all, || {
        format!("{doubted} of {all} frames say that the sensors disagree")
    })?;
    let late = frames(70, 75).filter(told).count();
    unless(late > 0, || {
        format!("{late} frames still doubt the sensors half a minute later")
    })?;
    well_at_the_end(flown)?;
    Ok(format!(
        "{said}; {doubted} of {all} frames say that the sensors disagree"
    ))
}

/// S12: the restart was found and the settings are back.
pub fn configured_again(flown: &Flown) -> Verdict {
    let said = steady(flown)?;
    let found = flown
        .derived
        .iter()
        .filter(|frame| frame.health.contains(Health::RECONFIGURED))
        .count();
    unless(found == 0, || "nobody noticed".into())?;
    well_at_the_end(flown)?;
    Ok(format!("{said}; configured again"))
}

/// \[ns\] from a reset to the first durable record.
const BACK: Nanos = 400 * MS;

/// F8, F9: FLIGHT and recording at the end, and what telemetry sent whole after lift-off is in the log, but for the time after a
/// reset.
pub fn flight_goes_on_and_the_log_is_whole(flown: &Flown) -> Verdict {
    unless(!flown.replied("G_ST FLIGHT task none recording 1"), || {
        format!("{:?}", flown.replies().last())
    })?;
    let chip = flown.nand.clone().ok_or("no chip")?;
    unless(!chip.breaks.is_empty(), || {
        format!("rules of the chip broken: {:?}", chip.breaks)
    })?;
    let kept: BTreeSet<_> = logged(chip).into_iter().map(|(_, packet)| packet).collect();
    let is_kept = |reading: &Reading| kept.contains(&packet::encode(reading));
    let resets = &flown.report.resets;
    let excused = |at: Nanos| resets.iter().any(|(reset, _)| (*reset..*reset + BACK).contains(&at));
    let begun = flown.packets.iter().skip_while(|(_, reading)| !is_kept(reading));
    let lost = begun.filter(|(at, reading)| !is_kept(reading) && !excused(*at) && flown.report.flown - at > 50 * MS);
    let lost = lost.count();
    unless(lost > 0 || kept.is_empty(), || {
        format!("{lost} packets sent and not kept, {} kept", kept.len())
    })?;
    Ok(format!(
        "{} resets, FLIGHT each time, {} records, none lost",
        resets.len(),
        kept.len()
    ))
}

/// U1: the watchdog bites once, and FLIGHT goes on.
pub fn watchdog_bites_and_flight_goes_on(flown: &Flown) -> Verdict {
    let [(at, ResetCause::Watchdog)] = flown.report.resets[..] else {
        return Err(format!("resets {:?}", flown.report.resets));
    };
    let before = flown
        .packets
        .iter()
        .rev()
        .find(|(sent, _)| *sent < at)
        .map_or(0, |(sent, _)| *sent);
    unless(at - before > 1_500 * MS, || {
        format!("{} ms without a packet before the reset", (at - before) / MS)
    })?;
    let said = flight_goes_on_and_the_log_is_whole(flown)?;
    Ok(format!("reset after {} ms; {said}", (at - before) / MS))
}

/// F15, F20: packets go on, the recorder says what is wrong, and records again when it can.
pub fn recorder_says_so_and_comes_back(flown: &Flown) -> Verdict {
    let said = steady(flown)?;
    let lines = flown.replies();
    let why = lines.iter().find(|line| line.starts_with("recorder: "));
    let why = why.ok_or("the recorder says nothing")?;
    let kept: BTreeSet<_> = (logged(flown.nand.clone().ok_or("no chip")?).into_iter())
        .map(|(_, packet)| packet)
        .collect();
    let late = flown.packets.iter().rev().skip(1).take(5);
    let again = late
        .filter(|(_, reading)| kept.contains(&packet::encode(reading)))
        .count();
    unless(again < 5, || {
        format!("{why}; of the last five packets {again} are kept")
    })?;
    Ok(format!("{said}; {why}; records again"))
}

/// F12: the log is whole.
pub fn log_is_whole(flown: &Flown) -> Verdict {
    let said = steady(flown)?;
    let whole = flight_goes_on_and_the_log_is_whole(flown)?;
    Ok(format!("{said}; {whole}"))
}

/// F19: the dump comes to its end, and the log is as it was.
pub fn dump_ends(flown: &Flown) -> Verdict {
    unless(!flown.replied("dump ends at page"), || "the dump never ends".into())?;
    unless(!flown.replied("G_ST WAIT"), || "not in WAIT".into())?;
    Ok(format!(
        "{} resets; asked again, the dump ends",
        flown.report.resets.len()
    ))
}

/// U11: a glitch does not start FLIGHT.
pub fn stays_in_wait(flown: &Flown) -> Verdict {
    unless(!flown.replied("G_ST WAIT") || flown.replied("lift-off: FLIGHT"), || {
        "FLIGHT".into()
    })?;
    steady(flown).map(|said| format!("WAIT; {said}"))
}

/// U11: a line that is asserted on the pad is seen in the status before flight.
pub fn line_is_shown(flown: &Flown) -> Verdict {
    unless(!flown.replied("G_ST lift-off 1"), || {
        "the status does not show it".into()
    })?;
    steady(flown).map(|said| format!("the status says lift-off 1; {said}"))
}

/// U11: without the line the ground starts FLIGHT.
pub fn flight_by_command(flown: &Flown) -> Verdict {
    unless(flown.replied("lift-off: FLIGHT"), || "the line was not lost".into())?;
    unless(!flown.replied("G_ST FLIGHT"), || "no FLIGHT".into())?;
    steady(flown).map(|said| format!("FLIGHT by command; {said}"))
}

/// U12: the line is in the packets, and the attitude goes by the accelerometers: it is as good as before.
pub fn attitude_goes_by_the_norm(flown: &Flown) -> Verdict {
    let said = steady_and_well(flown)?;
    let flagged = flown.packets.iter().filter(|(_, reading)| reading.micro_g).count();
    unless(flagged == 0, || "the packets do not show the line".into())?;
    let known = |from: u64, to: u64| {
        let frames = flown
            .derived
            .iter()
            .filter(move |frame| (from..to).contains(&frame.start_us));
        let (with, all) = frames.fold((0, 0), |(with, all), frame| {
            (with + u32::from(frame.estimate.kept().is_some()), all + 1)
        });
        (with, all)
    };
    let (with, all) = known(14_000_000, u64::MAX);
    unless(with < all || all == 0, || format!("attitude in {with} of {all} frames"))?;
    Ok(format!(
        "{said}; {flagged} packets show the line; attitude in every frame"
    ))
}

/// U14, C9: the console may lose lines; packets do not wait for it, and it answers again.
pub fn console_answers_again(flown: &Flown) -> Verdict {
    let said = steady_and_well(flown)?;
    let last = flown.replies();
    unless(!last.iter().any(|line| line.starts_with("G_VE: ")), || {
        format!("{:?}", last.last())
    })?;
    Ok(format!("{said}; the console answers again"))
}

/// U14: the same, and the status tells how many lines were lost.
pub fn what_was_lost_is_counted(flown: &Flown) -> Verdict {
    let said = console_answers_again(flown)?;
    let lines = flown.replies();
    let lost = lines
        .iter()
        .rev()
        .find_map(|line| line.rsplit_once(" lost ")?.1.parse::<u32>().ok());
    let lost = lost.ok_or("the status does not say how many lines were lost")?;
    unless(lost == 0, || "no line was lost".into())?;
    Ok(format!("{said}; {lost} lines lost and counted"))
}

/// C9: telemetry that is stuck loses its packets, and the recorder has them.
pub fn recorder_has_what_the_line_lost(flown: &Flown) -> Verdict {
    unless(!flown.report.resets.is_empty(), || "it was reset".into())?;
    let counters: BTreeSet<u16> = logged(flown.nand.clone().ok_or("no chip")?)
        .iter()
        .filter_map(|(_, packet)| packet::decode(packet).ok())
        .map(|reading| reading.counter)
        .collect();
    let (first, last) = (
        counters.first().ok_or("no record")?,
        counters.last().ok_or("no record")?,
    );
    let missing = usize::from(last - first) + 1 - counters.len();
    let lost = usize::from(last - first) + 1
        - flown
            .packets
            .iter()
            .filter(|(_, r)| (*first..=*last).contains(&r.counter))
            .count();
    unless(missing > 0, || format!("{missing} records missing"))?;
    unless(!flown.strange.is_empty(), || {
        format!("{} cut frames", flown.strange.len())
    })?;
    well_at_the_end(flown)?;
    Ok(format!("the line lost {lost} packets, the log none"))
}

/// C10: whole frames or none.
pub fn frames_are_whole(flown: &Flown) -> Verdict {
    unless(!flown.report.resets.is_empty(), || "it was reset".into())?;
    unless(!flown.strange.is_empty(), || {
        format!("{} cut frames", flown.strange.len())
    })?;
    let slow = flown.packets.iter().filter(|(at, _)| *at > 4 * S).count();
    unless(slow < 10, || format!("{slow} packets while the line was slow"))?;
    Ok(format!("{slow} packets, each whole"))
}

/// C4: while the line is disturbed no word is heard, the first one after it is, and packets do not notice.
pub fn heard_again(flown: &Flown) -> Verdict {
    let said = steady_and_well(flown)?;
    let lines = flown.replies();
    let answers = lines.iter().filter(|line| line.starts_with("G_VE: ")).count();
    unless(answers != 1, || {
        format!("{answers} of the words were answered, not the last one only")
    })?;
    let noise = lines
        .iter()
        .rev()
        .find_map(|line| line.split_once(" noise ")?.1.split(' ').next()?.parse::<u32>().ok());
    let noise = noise.ok_or("the status does not count what was damaged")?;
    unless(noise < 8, || format!("{noise} bytes counted"))?;
    Ok(format!(
        "{said}; {noise} damaged bytes counted, the first word after them answered"
    ))
}

/// U5: the fourth start without a minute of health reads, sends and records and estimates nothing; a word leads out of it.
pub fn safe_mode_and_out_of_it(flown: &Flown) -> Verdict {
    unless(!flown.replied("SAFE MODE: start"), || "no safe mode".into())?;
    let whole = flight_goes_on_and_the_log_is_whole(flown)?;
    let is_safe = |frame: &&Derived| frame.health.contains(Health::SAFE_MODE);
    let safe: Vec<&Derived> = flown.derived.iter().filter(is_safe).collect();
    unless(
        safe.len() < 20 || safe.iter().any(|frame| frame.estimate.q_nb.is_some()),
        || format!("{} frames of safe mode, or some with an attitude", safe.len()),
    )?;
    unless(!flown.replied("G_XN ok: safe mode left"), || {
        "G_XN does not lead out of it".into()
    })?;
    let last = flown.derived.last().ok_or("no derived frames")?;
    unless(is_safe(&last) || last.estimate.q_nb.is_none(), || {
        "no attitude after it".into()
    })?;
    well_at_the_end(flown)?;
    Ok(format!(
        "{whole}; {} frames in safe mode, then the attitude again",
        safe.len()
    ))
}

/// U10: it is said, and the unit goes on.
pub fn says_that_the_image_changed(flown: &Flown) -> Verdict {
    let lines = flown.replies();
    let line = lines.iter().find(|line| line.starts_with("firmware image CHANGED"));
    let line = line.ok_or("nobody noticed")?;
    Ok(format!("{}; {line}", steady_and_well(flown)?))
}

/// U7, U8: no panic, counters go on, and all is well at the end.
pub fn time_goes_on(flown: &Flown) -> Verdict {
    unbroken(flown)?;
    unless(!flown.report.resets.is_empty(), || {
        format!("resets {:?}", flown.report.resets)
    })?;
    well_at_the_end(flown)?;
    let longest = flown.periods().into_iter().max().unwrap_or(0);
    Ok(format!(
        "{} packets, none missing, longest wait {} ms",
        flown.packets.len(),
        longest / MS
    ))
}

/// U6: it says that its time is less exact, and goes on.
pub fn says_internal_oscillator(flown: &Flown) -> Verdict {
    unless(!flown.replied("clock internal"), || {
        format!("{:?}", flown.replies().last())
    })?;
    well_at_the_end(flown)?;
    Ok("goes on by the internal oscillator and says so".into())
}

/// U9: whatever flips, the unit is in FLIGHT at the end, or a reset is on record.
pub fn no_silent_wrong_mode(flown: &Flown) -> Verdict {
    unless(!flown.replied("G_ST FLIGHT"), || {
        format!("{:?}", flown.replies().last())
    })?;
    unless(
        flown
            .packets
            .last()
            .is_none_or(|(at, _)| flown.report.flown - at > 2 * S),
        || "no packets at the end".into(),
    )?;
    Ok(format!("{} resets, FLIGHT", flown.report.resets.len()))
}
