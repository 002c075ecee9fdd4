//! The Fourier transform, compiled once.
//!
//! In: a length. Out: a transform ready to be repeated. `rustfft` is generic over its numbers and has code for every kind of processor,
//! so each package that plans a transform itself compiles all of that again (the diagnosis took 30 s of processor time longer); whoever
//! needs one takes it from here.

use std::sync::Arc;

use rustfft::FftPlanner;
pub use rustfft::{Fft, num_complex::Complex};

/// The forward transform of so many samples, not scaled.
pub fn forward(length: usize) -> Arc<dyn Fft<f64>> {
    FftPlanner::new().plan_fft_forward(length)
}
