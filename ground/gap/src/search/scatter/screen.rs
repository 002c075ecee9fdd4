//! Whether a channel scatters otherwise than described, and how: what a search for effects on the scatter looks at first.

use twin::{effect::View, predict::Kind};

use crate::{
    null::calibration::instant_sigma_s,
    thresholds::{CHANCE, COLOURED, STANDS_OUT, sigmas},
};

/// [standard deviations] how far energy, tails and neighbours of a residual are from the nominal.
pub type Oddness = [f64; 3];

/// Whether one of some channels does not scatter as described. Only such are looked at closely, which costs a thousand
/// likelihoods: no effect that leaves energy, tails and neighbours alone would gain its price.
pub fn is_odd(channels: &[Oddness]) -> bool {
    channels.iter().flatten().any(|own| own.abs() > sigmas(CHANCE))
}

/// Whether all of them scatter otherwise the same way.
pub fn are_odd(channels: &[Oddness]) -> bool {
    let root = (channels.len().max(1) as f64).sqrt();
    let together = |aspect: usize| channels.iter().map(|own| own[aspect]).sum::<f64>() / root;
    (0..3).any(|aspect| together(aspect).abs() > STANDS_OUT)
}

/// How a channel's residual differs from the nominal.
pub fn oddness(view: &View) -> Oddness {
    let sigma = view.channel.sigma();
    let standard: Vec<f64> = view.residuals().map(|(_, residual)| residual / sigma).collect();
    let samples = standard.len().max(1) as f64;
    let moment = |power: i32| standard.iter().map(|value| value.powi(power)).sum::<f64>() / samples;
    let alike = standard.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / samples;
    let root = samples.sqrt();
    [
        (moment(2) - 1.0) * root / 2f64.sqrt(),
        (moment(4) - 3.0) * root / 96f64.sqrt(),
        alike * root,
    ]
}

/// [robust standard deviations] to which residuals are cut before neighbours are compared: a blow rings for a few samples,
/// and these must not make the rest of the log look alike.
const CUT: f64 = 2.0;

/// Median of the absolute value of a standard normal variable.
const MEDIAN_OF_NORMAL: f64 = 0.6745;

/// \[nats\] what a part's own clock explains of a log.
pub fn own_clock(view: &View) -> f64 {
    let sigma_s = instant_sigma_s(view.channel);
    let is_said = view.channel.bits.is_some() || view.channel.instant_sigma_s.is_some();
    let is_polled = is_said && view.channel.sensor != Kind::Thermometer;
    let jitter = twin::effect::by_name("sampling-jitter").filter(|_| is_polled && sigma_s > 0.0);
    jitter.map_or(0.0, |jitter| {
        (jitter.log_likelihood(&[sigma_s], 0.0, &[*view]) - view.nominal()).max(0.0)
    })
}

/// Stretches of a log whose energies are compared: of 16 each has samples enough, and the phases of a flight differ.
const STRETCHES: usize = 16;

/// \[nats\] one steady log in a thousand is refused.
const REFUSED: f64 = 6.9;

/// Whether residuals scatter more in some stretches of the log than in others. A sensor's own noise does not: what comes and goes
/// with a flight's phases is no other level of it. The sum of the squares of the stretches' energies about their mean, in their
/// own sigmas (by the residuals' fourth moment), is chi-squared; its tail by Laurent and Massart 2000:
/// `P(chi2_k > k + 2 sqrt(k x) + 2 x) <= exp(-x)`.
pub fn is_unsteady(view: &View) -> bool {
    let squares: Vec<f64> = view.residuals().map(|(_, residual)| residual * residual).collect();
    let samples = squares.len() as f64;
    let mean = squares.iter().sum::<f64>() / samples;
    let variance = squares.iter().map(|square| (square - mean).powi(2)).sum::<f64>() / samples;
    let length = squares.len().div_ceil(STRETCHES);
    if length == 0 || variance <= 0.0 {
        return false;
    }
    let stretches = squares.chunks(length);
    let freedom = stretches.len() as f64 - 1.0;
    let about = |stretch: &[f64]| {
        let count = stretch.len() as f64;
        count * (stretch.iter().sum::<f64>() / count - mean).powi(2) / variance
    };
    stretches.map(about).sum::<f64>() > freedom + 2.0 * (freedom * REFUSED).sqrt() + 2.0 * REFUSED
}

/// Samples whose median says how loud a log is there: that is known to a seventh, and a blow, which rings for a few samples, is not heard.
const STRETCH: usize = 64;

/// Per sample, how much louder residuals are about it than on the whole, and nothing where they are quieter: by the medians of their
/// absolute values, of which a few that are far off are no part.
pub fn louder_by_stretch(residuals: &[f64]) -> Vec<f64> {
    if residuals.len() < 2 * STRETCH {
        return vec![1.0; residuals.len()];
    }
    let whole = median(residuals).max(f64::MIN_POSITIVE);
    let last = residuals.len() - STRETCH;
    let about = |sample: usize| {
        let from = sample.saturating_sub(STRETCH / 2).min(last);
        (median(&residuals[from..from + STRETCH]) / whole).max(1.0)
    };
    (0..residuals.len()).map(about).collect()
}

fn median(of: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = of.iter().map(|value| value.abs()).collect();
    let middle = sizes.len() / 2;
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Whether neighbouring residuals are alike.
pub fn is_coloured(view: &View) -> bool {
    let mut rest: Vec<f64> = view.residuals().map(|(_, residual)| residual).collect();
    let mut sizes: Vec<f64> = rest.iter().map(|value| value.abs()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return false;
    }
    let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
    let most = (CUT * median / MEDIAN_OF_NORMAL).max(f64::MIN_POSITIVE);
    rest.iter_mut().for_each(|value| *value = value.clamp(-most, most));
    let energy: f64 = rest.iter().map(|value| value * value).sum();
    let alike: f64 = rest.windows(2).map(|pair| pair[0] * pair[1]).sum();
    alike > COLOURED * energy
}

#[cfg(test)]
mod tests {
    use twin::{part::signal::Noise, predict::UnitDescription};

    use super::*;

    /// Whether noise of this size, sample by sample, is unsteady.
    fn unsteady(seed: u64, size: impl Fn(usize) -> f64) -> bool {
        const SAMPLES: usize = 3000;
        let unit = UnitDescription::open("../../data/unit-emems.toml".as_ref()).expect("a unit");
        let noise = Noise::new(seed);
        let measured: Vec<f64> = (0..SAMPLES).map(|k| size(k) * noise.normal(k as u64)).collect();
        is_unsteady(&View {
            channel: &unit.channels[0],
            t_s: &[0.0; SAMPLES],
            predicted: &[0.0; SAMPLES],
            measured: &measured,
            step: 0.0,
        })
    }

    #[test]
    fn a_louder_time_is_heard_and_a_blow_is_not() {
        let noise = Noise::new(3);
        let of = |k: usize| {
            let louder = if (1000..1600).contains(&k) { 5.0 } else { 1.0 };
            let blow = if (400..406).contains(&k) { 30.0 } else { 0.0 };
            louder * noise.normal(k as u64) + blow
        };
        let residuals: Vec<f64> = (0..3000).map(of).collect();
        let louder = louder_by_stretch(&residuals);
        assert!(louder[300..500].iter().all(|louder| *louder < 1.6), "a blow");
        // The median of all is of the quiet time, which four fifths of it are.
        let middle = louder[1032..1568].iter().sum::<f64>() / 536.0;
        assert!((3.5..5.5).contains(&middle), "{middle}");
        assert!(louder.iter().all(|louder| *louder >= 1.0));
        assert_eq!(louder_by_stretch(&residuals[..100]), vec![1.0; 100]);
    }

    #[test]
    fn noise_that_comes_and_goes_is_no_level() {
        assert!((0..100).all(|seed| !unsteady(seed, |_| 3.0)), "steady");
        assert!(
            (0..100).all(|seed| !unsteady(seed, |k| if k % 50 == 0 { 9.0 } else { 1.0 })),
            "heavy tails"
        );
        assert!(
            (0..100).all(|seed| unsteady(seed, |k| if k > 2000 { 2.0 } else { 1.0 })),
            "a louder third"
        );
    }
}
