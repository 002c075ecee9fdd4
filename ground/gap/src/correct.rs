//! Step 8, what the unit can correct: a calibration set made of the causes.
//!
//! In: the twin and the effects that were found. Out: [`correction::Correction`], or nothing where no cause can be corrected.

pub mod correction;
