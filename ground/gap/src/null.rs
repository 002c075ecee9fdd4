//! Step 2, nothing wrong: what calibration, noise and reference alone would leave of the fit windows.
//!
//! In: the twin, the fit windows and the reference. Out: [`problem::Problem`], residuals and columns of every channel in units of
//! its noise, and on it a linear Gaussian fit ([`joint`]) of what the [`calibration`] and the reference leave open: normal
//! equations with the calibration marginalised ([`normal`]), their [`evidence`], and the finished [`model`]. A [`misfit`] that
//! looks like noise is told from noise by how long it stays alike. An effect that comes and goes is on in an [`interval`].
//! What errs slowly, alike in several channels ([`wander`]), is taken out by one Kalman pass over a residual and every column
//! ([`whitening`]). Where the reference is not exact the search is made in the [`colour`] of what is left ([`tint`]). What an effect is worth [`beyond`] that, the field's [`gradient`] and the [`point`] whose position is told says whether
//! reference and field may have done it. What of the [`noise`] is not as declared is said beside the verdict.
//!
//! With thousands of samples any error of 0.1 % is significant. That is why the calibration is marginalised everywhere: none of
//! what it leaves open is an effect.

pub mod beyond;
pub mod calibration;
pub mod colour;
pub mod evidence;
pub mod gradient;
pub mod interval;
pub mod joint;
pub mod misfit;
pub mod model;
pub mod noise;
pub mod normal;
pub mod point;
pub mod problem;
pub mod tint;
pub mod wander;
pub mod whitening;
