//! How the curve of a temperature coefficient bends: no zero and no scale moves quite in proportion.
//!
//! In: the distance from the temperature of the calibration, and the bend `c`, per degC. Out: `h(d) = d (1 + c d)`, the first
//! two terms of any curve. The bend is a value of the effect and no parameter of its fit: one, for a kind of part.

/// [1/degC] the bends between which values are possible (estimate: calibrated to straight lines, such parts keep some tenths of
/// the whole shift over 20 degC).
pub(super) const RANGE: [f64; 3] = [-LARGEST, 0.0, LARGEST];

const LARGEST: f64 = 0.02;

/// \[degC\] that count as this distance from the temperature of the calibration.
pub(super) fn bent(away_c: f64, bend: f64) -> f64 {
    away_c * (1.0 + bend.clamp(-LARGEST, LARGEST) * away_c)
}

/// In words; nothing of a straight line.
pub(super) fn told(bend: f64) -> Option<String> {
    (100.0 * bend.abs() >= 0.05).then(|| format!("bending by {:+.1} % a degree", 100.0 * bend))
}
