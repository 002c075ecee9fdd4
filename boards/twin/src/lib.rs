//! The twin: physical truth, the parts at register level, and the host board on which the unit runs in virtual time.
//!
//! ```
//! use twin::effect::{LIBRARY, by_name};
//!
//! let page = by_name("lever-arm").expect("in the library").page();
//! println!("{}: {} Confirm: {}", page.name, page.physics, page.confirm_by);
//! assert!(LIBRARY.iter().all(|effect| !effect.page().equation.is_empty()));
//! ```

pub mod channel;
pub mod effect;
pub mod environment;
pub mod fault;
pub mod fourier;
pub mod geometry;
pub mod host;
pub mod keys;
pub mod kinematics;
pub mod motion;
pub mod part;
pub mod plant;
pub mod predict;
pub mod recording;
pub mod run;
pub mod truth;
