//! How far a flight is: a bar on a terminal, a line every tenth of the way elsewhere.
//!
//! In: virtual time and packets. Out: text on standard error. The only reader of the wall clock in a flight, so it also
//! paces one that is to fly in real time.

use std::{
    io::{self, IsTerminal},
    thread,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use twin::part::Nanos;

/// Parts of the way after which a line is printed where there is no bar.
const LINES: u64 = 10;

/// Whether and how progress is shown.
enum Shown {
    Not,
    Bar(ProgressBar),
    Lines(u64),
}

/// The progress of one flight.
pub struct Progress {
    shown: Shown,
    duration: Duration,
    real_time: bool,
    started: Instant,
}

impl Progress {
    /// At take-off. `quiet` shows nothing, for a screen that belongs to someone else.
    pub fn start(duration: Duration, real_time: bool, quiet: bool) -> Self {
        let shown = if quiet {
            Shown::Not
        } else if io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(Some(millis(duration)), ProgressDrawTarget::stderr());
            match ProgressStyle::with_template("{bar:40.cyan/238} {percent:>3} %  {msg}  {eta} left") {
                Ok(style) => Shown::Bar(bar.with_style(style.progress_chars("━━─"))),
                Err(_) => Shown::Lines(0),
            }
        } else {
            Shown::Lines(0)
        };
        Progress {
            shown,
            duration,
            real_time,
            started: Instant::now(),
        }
    }

    /// The flight is at `now`; in real time, waits until the wall clock is there too.
    pub fn advanced(&mut self, now: Nanos, packets: u64) {
        let flown = Duration::from_nanos(now);
        let text = format!("{:.1} s flown, {packets} packets", flown.as_secs_f64());
        match &mut self.shown {
            Shown::Not => {}
            Shown::Bar(bar) => {
                bar.set_message(text);
                bar.set_position(millis(flown));
            }
            Shown::Lines(printed) => {
                let part = LINES.saturating_mul(millis(flown)) / millis(self.duration).max(1);
                if part > *printed {
                    *printed = part;
                    eprintln!("{text}");
                }
            }
        }
        if self.real_time {
            thread::sleep(flown.saturating_sub(self.started.elapsed()));
        }
    }

    /// Takes the bar away; returns the wall time since take-off.
    pub fn finish(self) -> Duration {
        if let Shown::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
        self.started.elapsed()
    }
}

fn millis(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}
