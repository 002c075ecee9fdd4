//! Step 4, what explains the log best: effects on readings, and at most one on how they scatter.
//!
//! In: the problem and its library; nothing held out. Out: [`explanation::Explanation`]. [`readings`] searches the library
//! forwards, fits the best candidates exactly ([`gauss_newton`]), gives each the time in which it is on ([`once`],
//! [`periodic`], by [`interval_sums`]) and says how likely each is by evidence ([`odds`]); beside a reference that errs, [`in_colour`] of what is left. [`scatter`] judges what changes the
//! noise; a gyro's walk ([`bias_walk`]) opens a state of its own; a channel that scatters otherwise is [`recalibrated`]. What
//! simpler methods would name is in [`baseline`].

pub mod baseline;
pub mod between;
pub mod bias_walk;
pub mod explanation;
pub mod gauss_newton;
pub mod in_colour;
pub mod interval_sums;
pub mod odds;
pub mod once;
pub mod periodic;
pub mod readings;
pub mod recalibrated;
pub mod scatter;
pub mod walked;
