//! Square roots for thresholds and variances: in f32 alone, within a millionth.
//!
//! In: a number above zero. Out: its root, or the reciprocal of it. A first guess by the exponent (the float's bits, halved
//! and negated) is within 3.5 %; each step of Newton's method squares that and takes half as much again, always to the same
//! side, so that constants a little larger than his halve what two steps leave: then rounding is as large (L. V. Moroz,
//! C. J. Walczyk, A. Hrynchyshyn, V. Holimath, J. L. Cieslinski, "Fast calculation of inverse square root with the use of
//! magic constant", Appl. Math. Comput. 316, 2018). A root of `libm` is exact and takes fifty instructions on the
//! target, this one seventeen, seventy times a cycle. What is estimated goes through `libm`; a threshold or a variance does not notice
//! a millionth. The processor's own root is exact in one instruction, but stable Rust reaches it by `unsafe` only, which this crate
//! forbids; and nothing here depends on the processor, so that host and unit have the same bits.
//!
//! Zero and what is below have the root zero, and zero for its reciprocal too; infinity has the root infinity. NaN stays NaN.

/// Error of a root, relative.
#[cfg(test)]
const RELATIVE: f32 = 1e-6;

/// Bits of the guess, and the constants of the two steps.
const GUESS: u32 = 0x5F37_6908;
const STEPS: [f32; 2] = [1.500_878_9, 1.500_000_6];

/// `1 / sqrt(x)`.
pub(crate) fn reciprocal_root(x: f32) -> f32 {
    // NaN goes on.
    if x <= 0.0 || x > f32::MAX {
        return 0.0;
    }
    let half = 0.5 * x;
    let guess = f32::from_bits(GUESS.wrapping_sub(x.to_bits() >> 1));
    STEPS
        .into_iter()
        .fold(guess, |guess, of_step| guess * (of_step - half * guess * guess))
}

/// `sqrt(x)`.
pub(crate) fn root(x: f32) -> f32 {
    if x > f32::MAX { x } else { x * reciprocal_root(x) }
}

#[cfg(test)]
mod tests {
    use nalgebra::ComplexField;

    use super::*;

    #[test]
    fn roots_are_those_of_libm_to_a_millionth() {
        for exponent in -60..60 {
            for part in 0..64 {
                let x = (1.0 + part as f32 / 64.0) * ComplexField::powi(2.0_f32, exponent);
                let exact = ComplexField::sqrt(x);
                assert!((root(x) / exact - 1.0).abs() < RELATIVE, "{x}");
                assert!((reciprocal_root(x) * exact - 1.0).abs() < RELATIVE, "{x}");
            }
        }
    }

    #[test]
    fn zero_infinity_and_nan_are_what_they_should_be() {
        for x in [0.0, -0.0, -1.0] {
            assert_eq!((root(x), reciprocal_root(x)), (0.0, 0.0));
        }
        assert!(root(f32::NAN).is_nan());
        assert_eq!(
            (root(f32::INFINITY), reciprocal_root(f32::INFINITY)),
            (f32::INFINITY, 0.0)
        );
        assert!((root(f32::MAX) / ComplexField::sqrt(f32::MAX) - 1.0).abs() < RELATIVE);
    }
}
