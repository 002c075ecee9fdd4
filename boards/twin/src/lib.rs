//! The twin: physical truth, the parts at register level, and the host board on which the unit runs in virtual time.

pub mod channel;
pub mod effect;
pub mod environment;
pub mod fault;
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
