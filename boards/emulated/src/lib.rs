//! The unmodified firmware image on an emulated STM32F4, with the twin's parts on its buses.
//!
//! ```text
//! cargo build --toolchain::build--> ELF --flight::fly--> stand (STM32F427 + wires + chips + twin::plant) --> Bench, Report
//! ```
//!
//! [rigless](https://docs.rs/rigless) executes the ELF's own instructions against register-level models of the
//! peripherals. It has no F407; the F427 stands in, which has the same peripherals at the same addresses and more
//! memory (RM0090 covers both), so an image that overflows the F407 is caught by its linker script only.
//! Time is instruction count at 168 million a second: no wait states, no bus contention, no FPU latency.

mod chips;
mod covers;
pub mod flight;
pub mod image;
mod rtt;
mod stand;
mod thumb;
pub mod toolchain;
mod wires;

pub use chips::SharedPlant;
pub use covers::Covers;
pub use flight::{Error, Options, Report, fly, fly_with};
pub use image::Image;
