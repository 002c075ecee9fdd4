//! The e-MEMS attitude sensor unit: sixteen sensors to packets, console and telemetry.
//!
//! Data flows one way:
//!
//! ```text
//! bytes --sensor--> counts --unit::acquire--> Sample --packet--> 156 bytes -> telemetry, umbilical, recorder
//!                   gyro counts --increments--> rotation increments
//! Sample, increments --estimate--> vectors, health, attitude --derived--> derived frame
//! packets, attitude --flight_log--> pages --nand--> chip
//! umbilical bytes --command--> Command --mode--> Mode, Task
//! ```
//!
//! Everything outside [`sensor`], [`nand`], [`flight_log`] and [`mod@unit`] is a function of its arguments: no clock, no I/O,
//! no allocation.
#![no_std]
#![forbid(unsafe_code)]

/// A line for whoever listens with a debug probe: defmt on the board, nothing on a host.
macro_rules! log_line {
    ($text:expr) => {
        #[cfg(target_os = "none")]
        defmt::info!("{=str}", $text);
    };
}

pub mod attitude;
pub mod board;
pub mod budget;
pub mod calibration;
mod checksum;
pub mod command;
pub mod crash;
pub mod derived;
pub mod discrete;
#[cfg(test)]
mod draws;
pub mod estimate;
pub mod faults;
pub mod flight_log;
pub mod geometry;
pub mod health;
pub mod increments;
pub mod kalman;
pub mod mode;
pub mod nand;
mod numbers;
pub mod packet;
pub mod pad;
pub mod quest;
pub mod rail;
pub mod redundancy;
pub mod resume;
pub mod retained;
mod root;
pub mod sample;
mod settings;
pub mod site;
pub mod spin;
pub mod triad;
pub mod unit;

/// The drivers of the parts, a package of their own.
pub use emems_drivers as sensor;

#[cfg(doctest)]
#[doc = include_str!("README.md")]
struct Readme;
