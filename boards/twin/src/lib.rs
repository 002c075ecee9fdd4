//! The twin: physical truth, the parts at register level, and the host board on which the unit runs in virtual time.

pub mod geometry;
pub mod environment;
pub mod motion;
pub mod part;
pub mod plant;
pub mod run;
pub mod truth;
