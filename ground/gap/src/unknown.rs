//! Step 5, what is left: is it more than noise and calibration leave, and where is it?
//!
//! In: a finished model. Out: [`adequacy::Leftover`], a probability of as much by chance with the aspects that say otherwise,
//! by logs simulated from the model; [`place::Place`], the shares of the gap by channel, group, octave, regime and time; and
//! [`traces`] of the channels that stand out. [`views`] says what each channel is looked at with. How large it is, and whether that
//! matters, says [`remainder::Remainder`]; whether it is an effect of the library after all, [`recognised`]. What all sensors of a kind
//! scatter more than described is taken off before ([`alike`]).

pub mod adequacy;
pub mod alike;
pub mod binned;
pub mod discrepancy;
pub mod fast;
pub mod octaves;
pub mod place;
pub mod recognised;
pub mod remainder;
pub mod shapley;
pub mod slow;
pub mod traces;
pub mod views;
