//! Trials of the gap diagnosis: cases whose effect is withheld, dealt from the unit itself, and their scoring.
//!
//! The unit is flown on the host board with register-level parts while something disturbs what the parts see, the stream
//! they end in, or the truth instrument's record. Physics here is written on its own: this package uses neither the
//! effect library nor the prediction that the diagnosis uses, so that an error in those is not repeated in the test.
//! Or it is put into a healthy recording of a real unit, row by row ([`injected`]).
//! It meets the diagnosis in files only: a case folder one way, verdict.json the other.

pub mod answer;
pub mod blind;
pub mod command;
pub mod deal;
pub mod deck;
pub mod disturbance;
pub mod draw;
pub mod flight;
pub mod followed;
pub mod injected;
pub mod interval;
mod loose;
pub mod motion;
pub mod reliability;
pub mod scene;
pub mod score;
mod sensitivity;
mod strength;
pub mod strike;
mod unit;
