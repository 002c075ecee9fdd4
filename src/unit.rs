//! The unit as one future over a [`Board`]: the same code on the STM32F407, on its emulation and on the host.
//!
//! ```text
//! acquire --Cycle--> telemetry, umbilical, record
//!               \--> estimate --Derived--> telemetry, umbilical
//! umbilical --Command--> State <--lift-off-- inputs
//! every part --vote--> watchdog
//! ```
//!
//! The parts are joined, not spawned: tasks cannot be generic, and one future can be polled on a host in virtual time.
//! They share one state, which lives in this future; nothing is global.

mod acquire;
mod calibration;
mod clock;
mod estimate;
mod gyros;
mod image;
mod inputs;
mod plates;
mod rail;
mod record;
mod self_test;
mod shared;
mod site;
mod telemetry;
mod umbilical;
mod vote;

use core::pin::pin;

use embassy_futures::join;

use crate::{
    board::{Board, Parts},
    crash::CrashRecord,
    estimate::Estimator,
    resume::{Resume, Starts},
    sensor::tca9548a::Switch,
};

pub use crate::settings::Settings;
use gyros::Gyros;
pub use shared::LONGEST_LINE;
use shared::{Shared, Start};

/// Runs the unit for ever.
pub async fn run<B: Board>(parts: Parts<B>, settings: Settings) -> ! {
    let memory = parts.retained;
    let starts = Starts::count(&memory);
    let start = Start {
        reset: parts.reset,
        starts,
        resume: Resume::recall(&memory),
        crash: CrashRecord::recall(&memory),
        oscillator: parts.oscillator,
        options: parts.options,
        stack_use: parts.stack_use,
    };
    let shared = Shared::new(settings, start);
    calibration::recall(&shared, &memory);
    rail::recall(&shared, &memory);
    site::recall(&shared, &memory);
    let switch = Switch::new(parts.sensor_bus);
    let gyros = Gyros::new(parts.gyros, settings, &shared.clock);
    let votes = vote::Votes::default();
    let mut estimator = Estimator::of(&Settings {
        site: shared.site(),
        ..settings
    });
    let link = join::join4(
        telemetry::run::<B>(&shared, &votes, parts.telemetry),
        umbilical::send::<B>(&shared, &votes, parts.umbilical_tx),
        umbilical::listen::<B>(&shared, &votes, parts.umbilical_rx, &memory),
        inputs::run::<B>(&shared, &votes, parts.discretes),
    );
    let data = join::join4(
        acquire::run::<B>(&shared, &votes, &switch, &gyros, parts.supply, &memory),
        gyros::run::<B>(&shared, &votes, &gyros, &memory),
        estimate::run::<B>(&shared, &votes, &mut estimator, &memory),
        record::run::<B>(&shared, &votes, parts.nand, &memory),
    );
    let care = join::join3(
        self_test::run::<B>(&shared, &switch, &gyros),
        vote::run::<B>(&shared.clock, &votes, parts.watchdog, &shared.fed_us),
        image::run(&shared, parts.read_image),
    );
    // Every part runs for ever, and says so in its type: the compiler leaves out what would be done after its end.
    let ((never, ..), ..) = shared.clock.drive(pin!(join::join3(link, data, care))).await;
    never
}
