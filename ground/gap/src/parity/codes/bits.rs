//! A bit that is always set, or never.
//!
//! In: a log and its unit. Out: a [`Finding`] for each channel that has such a bit.
//!
//! A signal that goes from one block of `2^(k+1)` codes to another has bit `k` set at one end or the other as it comes: where it
//! goes slowly both are passed, where it jumps the odds are even. So a healthy bit stays the same through `n` such changes with
//! probability `2^-n` at most. Bits that never change because those above them do not either say nothing, and lost low bits are
//! a step ([`super::lost_bits`]).
//!
//! A bit that is set where it should not be moves a code by up to `2^k`, which no calibration and no motion follows: such a
//! channel says nothing else.

use twin::predict::{Channel, UnitDescription};

use super::{Finding, LEAST, code, sends_codes};
use crate::{
    input::log::{Log, Series},
    thresholds::RARE,
};

/// Channels with a bit that never changes.
pub fn stuck(log: &Log, unit: &UnitDescription, steps: &[Option<i64>]) -> Vec<Finding> {
    let channels = unit.channels.iter().zip(&log.channels).enumerate();
    let whole = channels.filter(|(index, _)| steps[*index].is_none());
    let found = whole.filter_map(|(index, (channel, series))| {
        let what = of_channel(channel, series, unit.channels.len())?;
        Some(Finding {
            effect: "bit-fault",
            channels: vec![index],
            what,
            step: None,
            looks: Vec::new(),
            losses: Vec::new(),
        })
    });
    found.collect()
}

/// Which bit, in words.
fn of_channel(channel: &Channel, series: &Series, channels: usize) -> Option<String> {
    let bits = channel
        .bits
        .filter(|_| sends_codes(channel) && series.values.len() >= LEAST)?;
    let codes: Vec<i64> = series.values.iter().map(|value| code(channel, *value)).collect();
    let (all, any) = codes.iter().fold((!0, 0), |(all, any), code| (all & code, any | code));
    // The highest is the sign's.
    (0..bits.saturating_sub(1)).find_map(|bit| {
        let is_set = all >> bit & 1 == 1;
        if !is_set && any >> bit & 1 == 1 {
            return None;
        }
        let is_other = |pair: &&[i64]| pair[0] >> (bit + 1) != pair[1] >> (bit + 1);
        let changes = codes.windows(2).filter(is_other).count();
        let looked_at = (channels * bits as usize) as f64;
        let is_beyond = looked_at * 0.5_f64.powi(changes as i32) < RARE;
        is_beyond.then(|| {
            let always = i64::from(is_set);
            format!("bit {bit} is always {always}, while those above it changed {changes} times")
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    /// What is found in twelve bits of a signal that swings by so many codes in ten seconds, with a noise of two.
    fn found(swing: f64, made: impl Fn(i64) -> i64) -> Option<String> {
        let text = "name = \"x\"\n[[channel]]\nname = \"a\"\nsensor = \"accelerometer\"\ngroup = \"p\"\naxis_b = [1.0, 0.0, 0.0]\n\
                    lsb = 0.5\nnoise_sigma = 1.0\nbits = 12\n";
        let unit = UnitDescription::read(text, "unit.toml").expect("a unit");
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let value = |row: u32| {
            let noise: f64 = StandardNormal.sample(&mut random);
            let signal = 11.0 + swing * (0.02 * f64::from(row) * core::f64::consts::TAU).sin() + 2.0 * noise;
            0.5 * made(signal.round() as i64) as f64
        };
        let series = Series {
            values: (0..1500).map(value).collect(),
            rows: (0..1500).collect(),
        };
        of_channel(&unit.channels[0], &series, 28)
    }

    #[test]
    fn a_healthy_signal_has_no_bit_that_stays_while_those_above_it_change() {
        for swing in [0.0, 3.0, 83.0, 1500.0] {
            assert_eq!(found(swing, |code| code), None, "{swing}");
        }
    }

    #[test]
    fn a_bit_that_is_always_set_or_never_is_found_where_the_signal_passes_it() {
        for bit in 3..7 {
            let set = found(83.0, |code| code | 1 << bit).expect("found");
            assert!(set.starts_with(&format!("bit {bit} is always 1,")), "{set}");
            let clear = found(83.0, |code| code & !(1 << bit)).expect("found");
            assert!(clear.starts_with(&format!("bit {bit} is always 0,")), "{clear}");
        }
        // It is set anyway, and no code tells.
        assert_eq!(found(3.0, |code| code | 1 << 9), None);
    }
}
