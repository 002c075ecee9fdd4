//! The firmware: the unit on the board it was built for.
#![cfg_attr(target_os = "none", no_std, no_main)]

// A line a board.
#[cfg(target_os = "none")]
#[cfg_attr(board = "obc", path = "../boards/obc.rs")]
#[cfg_attr(board = "discovery", path = "../boards/discovery.rs")]
mod board;

#[cfg(target_os = "none")]
#[embassy_executor::main]
async fn main(_spawner: embassy_executor::Spawner) {
    emems::unit::run(board::init(), emems::unit::Settings::NOMINAL).await
}

/// Cargo builds this wherever it builds the library's package.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("This is the firmware of a board: cargo build --release --target thumbv7em-none-eabihf");
}
