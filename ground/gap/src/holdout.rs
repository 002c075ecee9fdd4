//! Step 6, the windows that only judge: does a finished model hold on samples that it has not seen?
//!
//! In: a model that no longer changes, and [`crate::input::hold::Held`], which only this room opens. Out: how far the gap
//! shrinks ([`judge`], [`shrink`]), down the pipeline to calibrated vectors and [`attitude`] ([`stages`]); how strong each
//! effect is there ([`strength`]), apart from what the fit may be off by ([`fit_error`]); how often an event happened again
//! ([`events`], [`recurrences`]); whether what is left is there too ([`leftover`]); and how large what is left of all windows is
//! ([`remainder`]). The [`floor`] is what a perfect twin would leave. The same question asked within the fit windows is [`cross_validation`].

pub mod attitude;
pub mod cross_validation;
pub mod events;
pub mod fit_error;
pub mod floor;
pub mod judge;
pub mod leftover;
pub mod recurrences;
pub mod remainder;
pub mod shrink;
pub mod stages;
pub mod strength;
