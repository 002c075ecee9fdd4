//! What a log may leave although nothing is wrong, and what is too small to care about.
//!
//! In: the optional keys of `case.toml`. Out: [`SlowErrors`], how the reference and the field err slowly, and [`Bars`], the sizes
//! from which something that is not explained matters. A reference or a field that is stated as exact errs by nothing. Where a key
//! is absent, it is what a marker system and a room were found to do (recordings of BROAD, session B and C: an attitude error of
//! 1.3 to 3 mrad that stays alike over 4 to 35 s, a field error of 0.1 to 0.2 uT over 1 to 20 s beside a gradient of 1 to 2 uT/m). How large a
//! gradient may be that nobody states follows from the field's sigma ([`crate::null::gradient`]).
//!
//! Refuses, naming the key: sigmas below zero, correlation times and bars that are not above zero, and values beyond any use.

use super::{CaseError, CaseFile, Opened};
use crate::thresholds::{MATTERS_DEG, MATTERS_SIGMA};

/// \[s\] over which an attitude error stays alike: fits were 4 to 41, 15 in the middle.
const ATTITUDE_CORRELATION_S: f64 = 20.0;

/// \[uT\] and \[s\] of a field error beside a gradient, and of one that has to hold the gradient too.
const FIELD: [(f64, f64); 2] = [(0.15, 10.0), (0.3, 25.0)];

/// \[s\] a longer correlation time is a constant in any log.
const LONGEST_S: f64 = 1e6;

/// How reference and field err slowly; zero sigmas for exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlowErrors {
    /// \[rad\] attitude of the reference, each axis.
    pub attitude_sigma_rad: f64,
    /// \[s\] over which it stays alike (Matern 3/2).
    pub attitude_correlation_s: f64,
    /// \[uT\] how much the field changes during the log, each axis.
    pub field_wander_sigma_ut: f64,
    /// \[s\] over which that stays alike (Ornstein-Uhlenbeck).
    pub field_correlation_s: f64,
    /// \[uT\] how well it is known, each axis.
    pub field_sigma_ut: f64,
    /// [uT/m] how much it changes with the place, each component; where nobody states it, as much as its sigma lets it.
    pub field_gradient_sigma_ut_m: Option<f64>,
}

/// Sizes from which what is not explained matters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bars {
    /// \[deg\] of attitude.
    pub attitude_deg: f64,
    /// \[sigma\] by which the gap grows: by a slow course in the channels that it is in, by what is fast in its sensor.
    pub gap_sigma: f64,
}

/// Of an opened case.
pub(super) fn allowance(opened: &Opened) -> Result<(SlowErrors, Bars), CaseError> {
    let CaseFile {
        environment,
        reference,
        matters,
        ..
    } = &opened.text;
    let is_sigma = |value: f64| (0.0..1000.0).contains(&value);
    let is_time = |value: f64| value > 0.0 && value <= LONGEST_S;
    let sigma = |value: Option<f64>| value.is_none_or(is_sigma);
    let time = |value: Option<f64>| value.is_none_or(is_time);
    const TIME: &str = "must be in seconds, above 0 and at most a million; leave it out for the usual";
    let checks = [
        (
            "reference.attitude_sigma_rad",
            (0.0..=1.0).contains(&reference.attitude_sigma_rad),
            "must be in radians, 0 (exact) to 1",
        ),
        (
            "reference.position_sigma_m",
            is_sigma(reference.position_sigma_m),
            "must be in metres, 0 (exact) to 1000",
        ),
        (
            "reference.attitude_correlation_s",
            time(reference.attitude_correlation_s),
            TIME,
        ),
        (
            "environment.field_wander_sigma_ut",
            sigma(environment.field_wander_sigma_ut),
            "must be in microtesla, 0 (none) to 1000",
        ),
        (
            "environment.field_correlation_s",
            time(environment.field_correlation_s),
            TIME,
        ),
        (
            "environment.field_gradient_sigma_ut_m",
            sigma(environment.field_gradient_sigma_ut_m),
            "must be in microtesla a metre, 0 (none) to 1000",
        ),
        (
            "matters.attitude_deg",
            matters.attitude_deg.is_none_or(|deg| deg > 0.0 && deg <= 180.0),
            "must be in degrees, above 0 and at most 180",
        ),
        (
            "matters.gap_sigma",
            matters.gap_sigma.is_none_or(|sigma| sigma > 0.0 && sigma <= 1000.0),
            "must be in sigma of the gap, above 0 and at most 1000",
        ),
    ];
    if let Some((key, _, problem)) = checks.iter().find(|(_, holds, _)| !holds) {
        return Err(CaseError::key(&opened.file, *key, *problem));
    }
    let gradient = environment.field_gradient_sigma_ut_m;
    let (wander_ut, alike_s) = FIELD[usize::from(gradient == Some(0.0))];
    let slow = SlowErrors {
        attitude_sigma_rad: reference.attitude_sigma_rad,
        attitude_correlation_s: reference.attitude_correlation_s.unwrap_or(ATTITUDE_CORRELATION_S),
        // What is known of the field bounds what it may do unseen.
        field_wander_sigma_ut: (environment.field_wander_sigma_ut).unwrap_or(wander_ut.min(environment.field_sigma_ut)),
        field_correlation_s: environment.field_correlation_s.unwrap_or(alike_s),
        field_sigma_ut: environment.field_sigma_ut,
        field_gradient_sigma_ut_m: gradient,
    };
    let bars = Bars {
        attitude_deg: matters.attitude_deg.unwrap_or(MATTERS_DEG),
        gap_sigma: matters.gap_sigma.unwrap_or(MATTERS_SIGMA),
    };
    Ok((slow, bars))
}
