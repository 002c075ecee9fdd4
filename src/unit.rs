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
mod telemetry;
mod umbilical;
mod vote;

use core::pin::pin;

use embassy_futures::join;

use crate::{
    board::{Board, Parts},
    crash::CrashRecord,
    estimate::{Estimator, Site},
    resume::{Resume, Starts},
    sensor::{adis16265, hmc5883l, lis331hh, tca9548a::Switch},
};

use gyros::Gyros;
pub use shared::LONGEST_LINE;
use shared::{Shared, Start};

/// What a laboratory may choose without touching the code.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// \[ms\] from packet to packet, 20 to 1000. Short: more packets, less idle time. The thesis has 200.
    pub period_ms: u64,
    /// \[Hz\] fast samples of the gyros, 1 to 250. High: less aliasing and coning error, more work.
    pub gyro_hz: u64,
    /// Full scale of the accelerometers. Large: survives the boost unclipped. Small: finer counts.
    pub acceleration: lis331hh::FullScale,
    /// Gain of the magnetometers.
    pub field: hmc5883l::Gain,
    /// Range of the gyros.
    pub rate: adis16265::Range,
    /// Where the unit is.
    pub site: Site,
    /// Which unit this is, at most 16 letters: every boot in the log begins with it.
    pub unit: &'static str,
    /// Which set of calibration parameters belongs to it, at most 16 letters; empty for none.
    pub calibration: &'static str,
}

impl Settings {
    /// The thesis' unit: 5 Hz, 3 mg, a 1090th of a gauss and 0.07326 deg/s a count, in the laboratory.
    pub const NOMINAL: Settings = Settings {
        period_ms: 200,
        gyro_hz: 100,
        acceleration: lis331hh::FullScale::G6,
        field: hmc5883l::Gain::PerGauss1090,
        rate: adis16265::Range::DegPerS320,
        site: Site::LABORATORY,
        unit: match option_env!("EMEMS_UNIT") {
            Some(unit) => unit,
            None => "EM",
        },
        calibration: "",
    };

    /// The accelerometers': as many samples a second as cycles, or 50.
    fn accelerometer(&self) -> lis331hh::Config {
        let rate = if self.period_ms < 40 {
            lis331hh::Rate::Hz100
        } else {
            lis331hh::Rate::Hz50
        };
        lis331hh::Config {
            full_scale: self.acceleration,
            rate,
        }
    }

    /// The magnetometers': they measure when they are asked. The rate is the one to which their delay is the same by their own clock.
    fn magnetometer(&self) -> hmc5883l::Config {
        hmc5883l::Config {
            gain: self.field,
            rate: hmc5883l::Rate::Hz75,
            average: hmc5883l::Average::Of1,
            mode: hmc5883l::Mode::Asked,
        }
    }

    /// The gyros'.
    fn gyro(&self) -> adis16265::Config {
        adis16265::Config {
            range: self.rate,
            ..adis16265::Config::default()
        }
    }
}

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
    let switch = Switch::new(parts.sensor_bus);
    let gyros = Gyros::new(parts.gyros, settings, &shared.clock);
    let votes = vote::Votes::default();
    let mut estimator = Estimator::of(&settings);
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
