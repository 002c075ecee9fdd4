//! The firmware: the unit on the board it was built for.
#![no_std]
#![no_main]

#[cfg(not(any(board = "obc", board = "discovery")))]
compile_error!("EMEMS_BOARD names no board: `obc` and `discovery` are in boards/");

#[cfg_attr(board = "obc", path = "../boards/obc.rs")]
#[cfg_attr(board = "discovery", path = "../boards/discovery.rs")]
mod board;

use emems::unit::{self, Settings};

#[embassy_executor::main]
async fn main(_spawner: embassy_executor::Spawner) {
    unit::run(board::init(), Settings::NOMINAL).await
}
