//! Calibration applied: counts of every sensor to SI along its own sense axis.
//!
//! In: a [`Reading`](crate::sample::Reading), the temperatures, and a parameter [`Set`]. Out: [`Measured`], what each of
//! the 28 axes measured along itself. Every axis of every sensor has the same model, whatever found its parameters,
//!
//! ```text
//! counts = sensitivity . v_b + bias(T) + noise          sensitivity = axis_b / scale
//! value  = scale (1 + k dT) (counts - b0 - b1 dT - b2 dT^2) = axis_b . v_b        dT = T - reference
//! ```
//!
//! and what gathers twelve such values, or four, into a vector is [`redundancy`](crate::redundancy). The thesis' three
//! methods (chapter 4) differ in where the rows of sensitivity come from; see [`method`]:
//!
//! - MT: datasheet scale along the nominal axis, no bias.
//! - LMS EC: rows and biases by least squares from known rates or poses (Eqs 4.13 to 4.18, 4.33 to 4.38). The printed
//!   scale factors of Eqs 4.21 and 4.40 are reciprocals of what Eqs 4.13 and 4.33 define, and their biases are divided by
//!   them; Eq 4.39 is for gravity, Eq 4.41 for specific force. Here: counts per unit of specific force, bias in counts.
//! - MV SEC: nine-parameter ellipsoid, `v = T B + v0` (Eq 4.43), `T` lower triangular, in the plate's axes.
//!
//! A set is compiled in ([`Set::compiled_in`]) or loaded ([`Set::load`], [`load`]); one that is corrupt, ill-conditioned, for other
//! ranges or of another unit is refused with the reason, and whoever loads it stays with the set it had.

mod apply;
mod axis;
mod bytes;
mod channel;
mod check;
mod compiled;
pub mod load;
pub mod method;
mod set;
mod temperature;
#[cfg(test)]
mod tests;

pub use apply::Measured;
pub use axis::{Axis, Uncertainty};
pub use bytes::ENCODED_BYTES;
pub use channel::{CHANNELS, Channel, Channels};
pub use check::Refusal;
pub use set::{Identity, Method, Ranges, Set};
pub use temperature::Temperatures;
