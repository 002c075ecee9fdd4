//! A run of the unit on the host board, watched from a [`Bench`].

use std::{cell::RefCell, pin::pin, rc::Rc};

use embassy_time::Instant;
use emems::{
    board::ResetCause,
    crash::{CrashCause, CrashRecord},
    unit::{self, Settings},
};

use super::{
    board::{Ends, parts},
    clock,
    timing::BOOT,
};
use crate::{
    fault::Struck,
    part::Nanos,
    plant::Plant,
    run::{Bench, Fault, Flow, Scheduled},
};

/// \[ns\] how often the bench is asked for commands.
const STEP: Nanos = 20_000_000;

/// \[ns\] the independent watchdog's nominal time.
const WATCHDOG: Nanos = 1_000_000_000;

/// What a host run says of itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HostReport {
    /// \[ns\] virtual time flown.
    pub flown: Nanos,
    /// Resets and when they struck.
    pub resets: Vec<(Nanos, ResetCause)>,
    /// How often each fault did something, by its name.
    pub struck: Struck,
}

/// Flies the unit from power-on for `duration`, or until the bench says stop.
pub fn fly(
    plant: Plant,
    settings: Settings,
    faults: &[Scheduled],
    duration: Nanos,
    bench: &mut dyn Bench,
) -> HostReport {
    fly_around(&Rc::new(RefCell::new(plant)), settings, faults, duration, bench)
}

/// The same around a plant that is looked at afterwards.
pub fn fly_around(
    plant: &Rc<RefCell<Plant>>,
    settings: Settings,
    faults: &[Scheduled],
    duration: Nanos,
    bench: &mut dyn Bench,
) -> HostReport {
    let ends = Ends::default();
    ends.plight.flash();
    let mut report = HostReport::default();
    let mut faults: Vec<Scheduled> = faults.to_vec();
    faults.sort_by_key(|scheduled| std::cmp::Reverse(scheduled.at));
    let mut cause = ResetCause::PowerOn;
    let mut now = 0;
    while now < duration {
        clock::start(now + BOOT);
        ends.fed.0.set(now + BOOT);
        ends.plight.reset();
        let mut unit = pin!(unit::run(parts(plant, &ends, cause), settings));
        let reset = loop {
            let fault = faults.last().map_or(duration, |scheduled| scheduled.at).max(now);
            let until = (now + STEP).min(fault).min(duration);
            // What strikes at this very start does so before the unit runs.
            if until > now {
                let _ = clock::advance(unit.as_mut(), until);
            }
            now = until;
            hear(&ends, bench);
            ends.spoken.borrow_mut().extend(bench.commands(now));
            if bench.advanced(now) == Flow::Stop {
                return told(report, now, &ends, plant);
            }
            let mut struck = None;
            while faults.last().is_some_and(|scheduled| scheduled.at <= now) {
                match faults.pop().map(|scheduled| scheduled.fault) {
                    Some(Fault::Reset) => {
                        ends.plight.strike("reset");
                        struck = Some(ResetCause::Pin);
                    }
                    Some(Fault::Panic) => {
                        ends.plight.strike("panic");
                        let uptime_us = Instant::now().as_micros();
                        let crash = CrashRecord::new(CrashCause::Panic, 123, 0, 0, uptime_us, "src/unit/twin.rs");
                        crash.keep(&ends.kept);
                        struck = Some(ResetCause::Software);
                    }
                    Some(Fault::KeptFlip(bit)) => {
                        ends.plight.strike("kept-flip");
                        ends.kept.flip(bit);
                        struck = Some(ResetCause::Pin);
                    }
                    Some(cut @ Fault::PowerCut(_)) => {
                        ends.plight.strike("power-cut");
                        plant.borrow_mut().apply(cut, now);
                        ends.kept.lose();
                        struck = Some(ResetCause::PowerOn);
                    }
                    Some(fault) if !ends.plight.apply(fault) => plant.borrow_mut().apply(fault, now),
                    _ => {}
                }
            }
            if now.saturating_sub(ends.fed.0.get()) > WATCHDOG {
                struck = Some(ResetCause::Watchdog);
            }
            if now >= duration || struck.is_some() {
                break struck;
            }
        };
        if let Some(reset) = reset {
            plant.borrow_mut().nand.protect(true, now);
            report.resets.push((now, reset));
            cause = reset;
        }
    }
    told(report, now, &ends, plant)
}

fn told(mut report: HostReport, now: Nanos, ends: &Ends, plant: &RefCell<Plant>) -> HostReport {
    report.flown = now;
    report.struck = plant.borrow().struck();
    report.struck.extend(ends.plight.struck());
    report
}

fn hear(ends: &Ends, bench: &mut dyn Bench) {
    for (at, bytes) in ends.telemetry.borrow_mut().drain(..) {
        bench.telemetry(at, &bytes);
    }
    for (at, bytes) in ends.umbilical.borrow_mut().drain(..) {
        bench.umbilical(at, &bytes);
    }
}
