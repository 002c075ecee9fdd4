//! A vibration that is too fast for the reference, by the rows of a log alone.
//!
//! In: a log of physical units before it is thinned, and its unit. Out: [`Fast`], what each channel does above [`FASTER_HZ`], and [`Line`], the
//! frequency at which the accelerometers of a group have a line there, and how large it is in each of them and of the group's gyros.
//!
//! What is faster than a reference is used for needs no prediction, and what is thinned folds it under the reference's errors. The
//! periodogram of each axis (Hann's window) over its level, the median of [`LEVEL`] bins over ln 2, is exponential where there is noise. Summed over
//! `m` axes it is above `x` with the probability `exp(-x) (1 + x + ... + x^(m-1)/(m-1)!)`, and the largest of `n` bins with at most `n`
//! times that. A line stands alone: no bin is half as high that is farther from it than [`WIDTH_HZ`]. Two things on real recordings are high
//! and do not: the comb of a part that sends samples twice, and noise that is loud up to half the rate of the rows.
//!
//! Says nothing of rows that are not even, or too slow; of accelerometers that send codes (the search for effects on the scatter sees all of
//! their samples); and of a line that wanders, or has a harmonic half as high. Samples that are missing are taken for the mean of the others,
//! which makes an amplitude too small by their share and puts as much of what is slow among the fast.

use std::ops::Range;

use nalgebra::DVector;
use twin::{
    fourier::{self, Complex},
    predict::{Kind, UnitDescription},
};

use crate::{input::log::Log, thresholds::RARE};

/// \[Hz\] from which a line is looked for: references are used up to 20 Hz ([`twin::motion::Recorded::used`]), and their smoothing ends a little above.
const FASTER_HZ: f64 = 25.0;

/// \[Hz\] to either side to which a line is blurred by what drives it: motors keep their speed to some parts in a thousand. Lines that were dealt
/// into recordings are within 0.04 Hz.
const WIDTH_HZ: f64 = 0.25;

/// Bins of which the median is the level: known to a twelfth, `1/sqrt(n) / ln 2`.
const LEVEL: usize = 256;

/// Part of a step by which rows may be off an even pace.
const UNEVEN: f64 = 0.25;

/// Steps at most, of rows with gaps between them: two hours at 285 Hz.
const MOST: usize = 1 << 21;

/// What is faster than a reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Fast {
    /// Per channel, its mean square in physical units; none of a channel that sends codes.
    pub mean_squares: Vec<Option<f64>>,
    /// A vibration.
    pub line: Option<Line>,
}

impl Fast {
    /// Of a log; none where its rows are not even, or too slow.
    pub fn of(log: &Log, unit: &UnitDescription) -> Option<Self> {
        let steps = Steps::of(&log.start_s)?;
        let bins = steps.bins(FASTER_HZ)?;
        let spectra = unit.channels.iter().enumerate();
        let spectra = spectra.map(|(channel, own)| own.bits.is_none().then(|| steps.spectrum(log, channel, &bins)));
        let spectra: Vec<Option<Spectrum>> = spectra.collect();
        let mean_square = |own: &Option<Spectrum>| own.as_ref().map(Spectrum::mean_square);
        Some(Self {
            mean_squares: spectra.iter().map(mean_square).collect(),
            line: line(unit, &steps, &bins, &spectra),
        })
    }
}

/// A line in the readings of a group.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// \[Hz\] its frequency, as the rows have it: a faster one is folded to this.
    pub hz: f64,
    /// Sensors that it is in, each with its amplitude and the standard deviation of that, in physical units.
    pub sizes: Vec<(usize, [f64; 2])>,
    /// \[nats\] against chance.
    pub nats: f64,
}

/// The plainest line of a log's accelerometers.
fn line(unit: &UnitDescription, steps: &Steps, bins: &Range<usize>, spectra: &[Option<Spectrum>]) -> Option<Line> {
    let of_group = |group: &str| {
        let own = |kind: Kind| {
            let channels = unit.channels.iter().zip(spectra).enumerate();
            let own = channels.filter(move |(_, (own, _))| own.sensor == kind && own.group == group);
            own.filter_map(|(channel, (_, spectrum))| Some((channel, spectrum.as_ref()?)))
        };
        let accelerometers: Vec<(usize, &Spectrum)> = own(Kind::Accelerometer).collect();
        let sums = accelerometers
            .iter()
            .fold(DVector::zeros(bins.len()), |sums, (_, own)| sums + &own.over_level);
        let (peak, highest) = sums.argmax();
        let near = steps.near(peak, bins.len());
        let is_alone = (0..sums.len()).all(|bin| near.contains(&bin) || 2.0 * sums[bin] < highest);
        let nats = -tail(highest, accelerometers.len()) - (bins.len() as f64).ln();
        (is_alone && nats > -RARE.ln()).then(|| {
            let all = accelerometers.into_iter().chain(own(Kind::Gyro));
            let is_in = |(_, own): &(usize, &Spectrum)| tail(own.over_level[peak], 1) < RARE.ln();
            let size = |(channel, own): (usize, &Spectrum)| (channel, own.amplitude(near.clone()));
            Line {
                hz: (bins.start + peak) as f64 * steps.bin_hz(),
                sizes: all.filter(is_in).map(size).collect(),
                nats,
            }
        })
    };
    let groups = unit.groups();
    let found = groups.iter().filter_map(|group| of_group(group));
    found.max_by(|one, other| one.nats.total_cmp(&other.nats))
}

/// ln of the probability that the sum of so many exponentials of mean 1 is above `x`; that of none is never.
fn tail(x: f64, many: usize) -> f64 {
    let terms = (1..many).scan(1.0, |term, k| {
        *term *= x / k as f64;
        Some(*term)
    });
    if many == 0 {
        0.0
    } else {
        (1.0 + terms.sum::<f64>()).ln() - x
    }
}

/// Rows of an even pace.
struct Steps {
    step_s: f64,
    /// Of each row, how many steps after the first.
    places: Vec<usize>,
    count: usize,
}

/// One channel's.
struct Spectrum {
    /// Power of each bin over the level there.
    over_level: DVector<f64>,
    /// The square of the amplitude of a sine that has the power of the level in one bin.
    level: DVector<f64>,
}

impl Spectrum {
    /// Of all bins together; of a sine they sum to the square of its amplitude.
    fn mean_square(&self) -> f64 {
        0.5 * self.over_level.dot(&self.level)
    }

    /// Amplitude of a line in these bins, and its standard deviation: of `n` exponentials with an energy `e` above them the variance is `n + 2 e`.
    fn amplitude(&self, bins: Range<usize>) -> [f64; 2] {
        let many = bins.len() as f64;
        let energy = bins.clone().map(|bin| self.over_level[bin] - 1.0).sum::<f64>().max(1.0);
        let level = bins.map(|bin| self.level[bin]).sum::<f64>() / many;
        let amplitude = (energy * level).sqrt();
        [amplitude, 0.5 * amplitude * (many + 2.0 * energy).sqrt() / energy]
    }
}

impl Steps {
    fn of(starts_s: &[f64]) -> Option<Self> {
        let mut all: Vec<f64> = starts_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        all.sort_by(f64::total_cmp);
        let median_s = *all.get(all.len() / 2)?;
        let (first_s, last_s) = (*starts_s.first()?, *starts_s.last()?);
        if median_s <= 0.0 || (last_s - first_s) / median_s > MOST as f64 {
            return None;
        }
        // Time stamps are rounded: the pace is that of the whole log.
        let step_s = (last_s - first_s) / ((last_s - first_s) / median_s).round();
        let off = |t_s: &f64| (t_s - first_s) / step_s;
        let is_even = starts_s.iter().all(|t_s| (off(t_s) - off(t_s).round()).abs() < UNEVEN);
        let places: Vec<usize> = starts_s.iter().map(|t_s| off(t_s).round() as usize).collect();
        let count = places.last()? + 1;
        is_even.then_some(Self { step_s, places, count })
    }

    fn bin_hz(&self) -> f64 {
        1.0 / (self.count as f64 * self.step_s)
    }

    /// From a frequency on; none where the rows are too slow for a level above it.
    fn bins(&self, from_hz: f64) -> Option<Range<usize>> {
        let bins = (from_hz / self.bin_hz()).ceil() as usize..self.count / 2;
        (bins.len() >= LEVEL).then_some(bins)
    }

    /// The bins of a line, of so many.
    fn near(&self, peak: usize, bins: usize) -> Range<usize> {
        let width = (WIDTH_HZ / self.bin_hz()).ceil() as usize;
        peak.saturating_sub(width)..(peak + width + 1).min(bins)
    }

    fn spectrum(&self, log: &Log, channel: usize, bins: &Range<usize>) -> Spectrum {
        let series = &log.channels[channel];
        let mean = series.values.iter().sum::<f64>() / series.values.len().max(1) as f64;
        let mut values = vec![Complex::from(0.0); self.count];
        let hann = |at: usize| 0.5 - 0.5 * (std::f64::consts::TAU * at as f64 / self.count as f64).cos();
        for (row, value) in series.rows.iter().zip(&series.values) {
            let at = self.places[*row as usize];
            values[at] = Complex::from(hann(at) * (value - mean));
        }
        fourier::forward(self.count).process(&mut values);
        let power: Vec<f64> = values[bins.clone()].iter().map(|value| value.norm_sqr()).collect();
        let level = |chunk: &[f64]| {
            let mut sorted = chunk.to_vec();
            sorted.sort_by(f64::total_cmp);
            sorted[sorted.len() / 2] / 2f64.ln()
        };
        // The last, shorter stretch has the level of a whole one.
        let last = power.len() - LEVEL;
        let starts = (0..power.len()).step_by(LEVEL).map(|from| from.min(last));
        let levels: Vec<f64> = starts.map(|from| level(&power[from..from + LEVEL])).collect();
        let levels = DVector::from_fn(power.len(), |bin, _| levels[bin / LEVEL].max(f64::MIN_POSITIVE));
        // Of a sine of amplitude `a` both sides of its line have `n a^2/2 sum w^2`, and of Hann's window `sum w^2` is 3 n/8.
        let count = self.count as f64;
        Spectrum {
            over_level: DVector::from_vec(power).component_div(&levels),
            level: levels * (4.0 / (count * 0.375 * count)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    const RATE_HZ: f64 = 250.0;
    const ROWS: u32 = 16_384;
    const NOISE: f64 = 0.06;

    fn found(rate_hz: f64, added: impl Fn(f64) -> f64) -> Option<Line> {
        fast(rate_hz, added)?.line
    }

    /// An accelerometer and a gyro of noise, which have `added` [sigma] of the time \[s\] more; one row in seven is missing for a while.
    fn fast(rate_hz: f64, added: impl Fn(f64) -> f64) -> Option<Fast> {
        let mut text = "name = \"x\"\ncycle_s = 0.004\n".to_owned();
        for (index, sensor) in ["accelerometer", "gyro"]
            .into_iter()
            .flat_map(|one| [one; 3])
            .enumerate()
        {
            text += &format!(
                "[[channel]]\nname = \"c{index}\"\nsensor = \"{sensor}\"\ngroup = \"unit\"\naxis_b = [1.0, 0.0, 0.0]\nlsb = 1.0\n\
                 noise_sigma = {NOISE}\n"
            );
        }
        let unit = UnitDescription::read(&text, "unit.toml").expect("a unit");
        let mut log = Log::empty(6);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        for row in 0..ROWS {
            // As a file rounds them.
            log.start_s.push((f64::from(row) / rate_hz * 1e4).round() / 1e4);
            for (channel, series) in log.channels.iter_mut().enumerate() {
                let noise: f64 = StandardNormal.sample(&mut random);
                if (4000..5000).contains(&row) && row % 7 == 0 {
                    continue;
                }
                let shaken = if channel == 5 {
                    0.0
                } else {
                    added(f64::from(row) / rate_hz)
                };
                series.rows.push(row);
                series.values.push(9.8 + NOISE * (noise + shaken));
            }
        }
        Fast::of(&log, &unit)
    }

    fn sine(hz: f64) -> impl Fn(f64) -> f64 {
        move |t_s| 0.2 * (std::f64::consts::TAU * hz * t_s).sin()
    }

    #[test]
    fn a_line_is_found_with_its_frequency_its_sensors_and_its_size() {
        let line = found(RATE_HZ, sine(82.33)).expect("a line");
        assert!((line.hz - 82.33).abs() < 0.02, "{line:?}");
        let channels: Vec<usize> = line.sizes.iter().map(|(channel, _)| *channel).collect();
        assert_eq!(channels, [0, 1, 2, 3, 4]);
        for (_, [size, sigma]) in &line.sizes {
            assert!(
                (size - 0.2 * NOISE).abs() < 3.0 * sigma && *sigma < 0.1 * size,
                "{line:?}"
            );
        }
    }

    /// Four fifths of white noise at 250 Hz are above 25 Hz, and half the square of a sine's amplitude, wherever it wanders. Of what is slow a
    /// hundredth is there by the rows that are missing.
    #[test]
    fn what_is_fast_has_its_mean_square_and_what_is_slow_has_none() {
        let of = |added: &dyn Fn(f64) -> f64| {
            let fast = fast(RATE_HZ, added).expect("even rows");
            [0, 5].map(|channel| fast.mean_squares[channel].expect("no codes") / NOISE.powi(2))
        };
        let is_near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 0.1;
        let wanders = |t_s: f64| 10.0 * (std::f64::consts::TAU * 82.0 * t_s + 3.0 * (1.7 * t_s).sin()).sin();
        let [with, without] = of(&wanders);
        assert!(is_near(with, 50.8) && is_near(without, 0.8), "{with} {without}");
        let [slow, _] = of(&|t_s| 500.0 * sine(3.0)(t_s));
        assert!(slow < 0.8 + 0.01 * 5_000.0, "{slow}");
    }

    #[test]
    fn noise_has_none_nor_has_what_the_reference_follows() {
        assert_eq!(found(RATE_HZ, |_| 0.0), None);
        assert_eq!(found(RATE_HZ, |t_s| 50.0 * sine(3.0)(t_s)), None);
    }

    #[test]
    fn a_comb_is_no_line() {
        let comb = |t_s: f64| sine(42.9)(t_s) + sine(57.1)(t_s) + sine(85.7)(t_s);
        assert_eq!(found(RATE_HZ, comb), None);
    }

    #[test]
    fn rows_that_are_slow_or_uneven_say_nothing() {
        assert_eq!(found(5.0, sine(1.3)), None);
        let uneven: Vec<f64> = (0..2000)
            .map(|row| 0.004 * (f64::from(row) + 0.4 * f64::from(row % 2)))
            .collect();
        assert!(Steps::of(&uneven).is_none());
        assert!(Steps::of(&[]).is_none() && Steps::of(&[0.0, 0.0]).is_none());
    }
}
