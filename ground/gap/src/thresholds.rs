//! Every threshold that decides what is said: with its unit, what a larger and a smaller one do, and where it comes from.
//!
//! Steps of an iteration, sizes of a simulation, seeds and widths of a page decide nothing and stand where they are used. A
//! threshold that is fitted names the cases; one that is only assumed says so, and is the first to be questioned. What follows from one in
//! the list is computed from it and is not listed.

use statrs::function::erf::erfc_inv;

/// Where a threshold comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provenance {
    /// It follows from something.
    Derived(&'static str),
    /// Any value near would do, and this one is usual.
    Convention(&'static str),
    /// It was read off cases.
    Fitted(&'static str),
    /// It was chosen, for this reason, and never checked against cases.
    Assumed(&'static str),
}

/// A threshold as it is listed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold {
    /// Its name in the code.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// The unit of that.
    pub unit: &'static str,
    /// What it decides.
    pub what: &'static str,
    /// What a larger one does.
    pub larger: &'static str,
    /// What a smaller one does.
    pub smaller: &'static str,
    /// Where it comes from.
    pub provenance: Provenance,
}

macro_rules! thresholds {
    ($(#[doc = $what:literal] $name:ident: $kind:ty = $value:expr, in $unit:literal, larger: $larger:literal, smaller: $smaller:literal, $from:ident($why:literal);)*) => {
        $(#[doc = $what] pub const $name: $kind = $value;)*

        /// All of them, in the order of the steps.
        #[allow(clippy::unnecessary_cast, reason = "counts and numbers stand in one list")]
        pub const ALL: &[Threshold] = &[$(Threshold {
            name: stringify!($name),
            value: ($value) as f64,
            unit: $unit,
            what: $what,
            larger: $larger,
            smaller: $smaller,
            provenance: Provenance::$from($why),
        }),*];
    };
}

thresholds! {
    // Step 2, nothing wrong
    /// Time over which the error of a reference, or of a field that is not uniform, stays alike.
    REFERENCE_CORRELATION_S: f64 = 1.0, in "s",
        larger: "samples weigh less; slow effects hide behind the reference",
        smaller: "errors of the reference are taken for effects",
        Assumed("a hand moves half a metre in it");
    /// Mean variance of a sample, reference included, beyond which its scatter says nothing of the sensor.
    REFERENCE_LIMITED: f64 = 2.0, in "variances of the sensor",
        larger: "scatter that is the reference's is taken for an effect",
        smaller: "effects on the scatter are not looked for",
        Derived("the reference then errs more than the sensor scatters");
    /// Factor of the variance up to which nothing is taken for misfit.
    MISFIT_CALM: f64 = 1.2, in "variances",
        larger: "a misfit makes everything significant",
        smaller: "white noise is taken for a misfit",
        Derived("white noise of three thousand samples stays within it");
    /// Excess kurtosis of a sensor's noise: up to it, and down to half of it below a Gaussian's, scatter may be louder noise.
    NOISE_TAILS: f64 = 1.0, in "excess kurtosis",
        larger: "rare unknown events are taken for louder noise",
        smaller: "louder noise is called an unknown effect",
        Derived("a Student law of ten degrees of freedom, as simulated logs have it");
    /// Factor up to which noise that all sensors of a kind have alike is what the description is off by, beside a reference that is not exact.
    NOISE_ALIKE: f64 = 1.5, in "declared sigmas",
        larger: "what is unknown in all sensors of a kind is taken for noise",
        smaller: "units whose noise is described too quiet raise alarms",
        Convention("data sheets give typical noise; healthy units of ring R0m are described so far off");
    // Step 1, input
    /// Attitude error from which what is not explained matters, where the case does not say.
    MATTERS_DEG: f64 = 0.5, in "deg",
        larger: "unknown effects are called clean",
        smaller: "errors of a reference are called unknown effects",
        Convention("what a magnetometer and a level give in a room");
    /// Growth of the gap from which what is not explained matters, in the channels that it is in, where the case does not say.
    MATTERS_SIGMA: f64 = 0.05, in "sigma",
        larger: "unknown effects are called clean",
        smaller: "misfits that change nothing are called unknown effects",
        Convention("a twentieth of the noise");
    // Step 4, search
    /// Effects on readings at once.
    MOST_EFFECTS: usize = 5, in "effects",
        larger: "slower; patchworks for an unknown effect",
        smaller: "true sets of many are cut",
        Fitted("no answer with more was right on the dealt cases");
    /// Probability from which an effect, or the unknown, is named. It is also how far a name is believed of which held-out windows or parity show too little.
    SAID: f64 = 0.5, in "probability",
        larger: "fewer names, fewer of them wrong",
        smaller: "more names, more of them wrong",
        Convention("likelier than not");
    /// Probability of what chance does once in a thousand. What it does less often is not chance: then a window is not at rest, a slow course is no walk, a motion that is told is another flight's, and a difference of two chips is told.
    SELDOM: f64 = 1e-3, in "probability",
        larger: "rests, walks, tracks and simulated trajectories that are right are refused; differences of chips that are chance are told",
        smaller: "another slow effect is called a walk, and another flight's motion bends this one; small differences of chips are not told",
        Convention("one in a thousand: what is wrongly refused is said");
    /// Probability of what chance does in one log of ten thousand. What it does less often is not chance: then rows tell by themselves of old samples, damage, a line or lost packets, a calibration counts as dragged, and a channel of a table has a gap left. More events than chance makes so seldom are not looked for.
    RARE: f64 = 1e-4, in "probability",
        larger: "chance is taken for old samples, damage, vibration and gaps of tables; many events are cut",
        smaller: "few old samples, little damage and weak vibrations are not found; a dragged calibration hides its effect; fewer channels of tables are reported as left",
        Convention("one in ten thousand");
    /// Gain over that of the strongest effect at which a second one is as likely what the first one's law leaves over.
    REMAINDER: f64 = 0.005, in "part of the strongest gain",
        larger: "weak second effects are not named",
        smaller: "remainders of a strong effect get names",
        Assumed("what a law that is a little off leaves over");
    /// Causes in the channels of one of them that are believed at once where they leave something; more together are then a patchwork for one effect the library does not have.
    MOST_CAUSES: usize = 3, in "effects",
        larger: "patchworks are believed",
        smaller: "true sets are withdrawn where something small is left",
        Assumed("more together are rather a patchwork for one effect that the library does not have");
    /// Part from which an effect counts among the causes, of all gains, and a channel among a cause's, of its energy.
    COUNTED_PART: f64 = 0.02, in "part",
        larger: "small effects do not count towards a patchwork; fewer channels are named",
        smaller: "remainders count towards one; more channels are named",
        Assumed("what the laws of the others leave");
    /// Evidence is raised to one over this before it becomes a probability ([`crate::null::evidence`]).
    TEMPERATURE: f64 = 2.0, in "1",
        larger: "probabilities nearer to even",
        smaller: "over-confident probabilities",
        Assumed("a guess; docs/gap/trials.md says how far it holds");
    /// Probability from which an alternative is listed.
    LISTED: f64 = 0.005, in "probability",
        larger: "shorter lists",
        smaller: "longer lists",
        Convention("half a percent");
    /// The least part that counts. Each half of a stretch has to bring it of what is explained, and so has an effect that is to be seen coming and going beside others. Each third of the time has to bring it of what a periodic effect would be there, and to hold it of an even share. A calibration has to leave it of an effect that it does not imitate. A cross axis of a chip is told from this part of an angle that matters.
    LEAST_PART: f64 = 0.1, in "part",
        larger: "short strong parts and uneven effects are taken for steady ones",
        smaller: "one blow makes a stretch, and what another law leaves over gets one; iron far beyond a zero's sigma has no name",
        Assumed("an even effect has half or a third, and what another effect's law leaves is not the same at all times either");
    /// Samples from which a walk is told from anything else.
    WALK_FEWEST: usize = 100, in "samples",
        larger: "walks of short logs are missed",
        smaller: "rows of a table are called a walk",
        Convention("tables have fewer rows");
    /// What the tails of a reference's errors gain over normal scatter.
    REFERENCE_TAILS: f64 = 0.0468, in "nats a sample",
        larger: "outliers of the unit are taken for the reference's",
        smaller: "outliers of the reference get names",
        Derived("entropy of a Student law of five degrees, the heaviest tails on BROAD's recordings between blows: 1.4189 - 1.3721");
    /// Gain from which an effect on the scatter may come out best with a calibration of its own.
    SCATTER_NEAR: f64 = 0.2, in "part of the best gain",
        larger: "rivals are not tried",
        smaller: "slower",
        Assumed("what a calibration of its own may bring");
    /// Correlation of neighbouring residuals from which a misfit is no white noise.
    COLOURED: f64 = 0.2, in "correlation",
        larger: "louder noise swallows effects the library does not have",
        smaller: "louder noise is refused where a little is left",
        Assumed("a misfit that is plainly coloured");
    // Step 5, what is left
    /// Size from which an aspect of what is left is listed, and several channels together are looked at again.
    STANDS_OUT: f64 = 3.0, in "standard deviations",
        larger: "shorter lists; weak common effects on the scatter are not looked at",
        smaller: "longer lists; slower",
        Convention("three sigma, 4.5 nats, below any price");
    /// Probability up to which chance is believed. It decides whether there is a gap, whether an effect is added (three nats beyond its price), whether a rival is listed, whether two effects are confused, and what share of the cells named may be wrong. As sigmas, which are two, it decides what scatter is looked at twice and what slow remainder may be the reference's.
    CHANCE: f64 = 0.05, in "probability",
        larger: "wrong effects are added; errors of a reference are called unknown effects; more cells, more of them chance; shares of weak gaps are not printed; smaller sets",
        smaller: "weak effects are not found; unknown effects are taken for the reference's; fewer cells; shares of noise are printed; larger sets",
        Convention("one in twenty");
    /// Of the mean inside a passage, what the mean outside it must stay below.
    PASSAGE_QUIET: f64 = 0.5, in "part",
        larger: "gaps that only vary get a time",
        smaller: "passages are missed",
        Assumed("less is a gap that varies");
    /// Share that is most of a gap. The channels that are looked at, or named for an unexplained gap, hold it together. An effect that leaves more of a recalibrated gap is no help.
    MOST_OF_A_GAP: f64 = 0.8, in "share",
        larger: "more channels are named, and fewer reported as left",
        smaller: "fewer channels are named, and more reported as left",
        Convention("four fifths");
    /// Part of a reference's fast variance that it may have more than its record says.
    REFERENCE_KNOWN: f64 = 0.5, in "part",
        larger: "fast unknown effects are taken for the reference's",
        smaller: "fast errors of a reference are called unknown effects",
        Assumed("what an octave above says of the one below varied by a third between kinds and sessions of BROAD");
    /// Time over which a filter adds up the error of a rate.
    FILTER_S: f64 = 10.0, in "s",
        larger: "small errors of gyros matter",
        smaller: "fewer do",
        Assumed("what the filter of the unit takes to come back to gravity and field");
    // Step 6, hold
    /// Share of an effect's energy in one block from which it counts as an event, which other blocks cannot predict.
    EVENT: f64 = 0.5, in "share",
        larger: "events are held to other blocks",
        smaller: "effects escape cross-validation",
        Convention("most of it");
    /// How well a gap is known. A gap that exceeds its floor by less has no percentage. An effect and recalibration that differ by less, as a part of the gap, shrink it alike.
    GAP_KNOWN: f64 = 0.01, in "sigma, and part of the gap",
        larger: "small gaps have no percentage; effects that recalibration beats are kept",
        smaller: "percentages of nothing; effects as good as recalibration are withdrawn",
        Derived("1/sqrt(2 n) of five thousand samples");
    /// Difference of an effect's held-out strength from one that a true effect may show.
    STRENGTH_TOLERATED: f64 = 0.25, in "1",
        larger: "wrong laws pass",
        smaller: "true effects are doubted on another motion",
        Assumed("the calibration fitted beside it is not exact on another motion, and a real law is only nearly the library's");
    /// Standard deviation of that strength above which the held-out windows confirm nothing.
    STRENGTH_SHOWN: f64 = 0.5, in "1",
        larger: "windows that hardly show an effect confirm it",
        smaller: "weak hold windows confirm nothing",
        Convention("half of what is asked");
    // Step 7, how sure
    /// Size from which an engineer should look twice.
    SUSPICIOUS: f64 = 0.25, in "part of the largest size",
        larger: "fewer warnings",
        smaller: "more warnings",
        Convention("five times the usual of an effect whose largest is twenty");
    /// Prior probability that a unit has something the library does not, beside what is named.
    UNKNOWN_PRIOR: f64 = 0.05, in "probability",
        larger: "more alarms beside names",
        smaller: "stand-ins are believed",
        Assumed("one unit in twenty");
    /// Evidence at which a name is as likely wrong as right. An effect, or a gap, that is on in one stretch of time, or periodically, must gain as much over one that is always on, beyond the price of having looked.
    DOUBTED: f64 = 10.0, in "nats",
        larger: "weak true names are lost; what comes and goes is taken for steady",
        smaller: "weak wrong names are said; what is steady is cut to a stretch",
        Fitted("wrong names of the dealt cases had 8 to 26 nats; an effect of ratio 8 has 32 before its prior odds (docs/gap/trials.md)");
    /// What an effect that does not matter must be worth beside a reference's errors to be as likely said as not.
    CERTAIN: f64 = 32.0, in "nats",
        larger: "plain small effects get no names",
        smaller: "what every real recording has gets names",
        Derived("an effect of ratio 8, the least that a name is asked for, is worth 8 x 8 / 2; healthy recordings have up to 23, and two effects that take each other back 34");
    /// Step that multiplies those odds by e.
    DOUBT_STEP: f64 = 3.0, in "nats",
        larger: "a softer threshold",
        smaller: "a harder one",
        Fitted("the same names");
    /// Energy left over that explained at which a name is as likely wrong as right.
    UNLIKE: f64 = 0.05, in "part",
        larger: "stand-ins are believed",
        smaller: "effects that differ a little from their law are doubted",
        Assumed("a law that is a little off leaves a few parts in a hundred");
    /// Share of the time that counts as a regime.
    REGIME_TIME: f64 = 0.3, in "share",
        larger: "vague regimes",
        smaller: "narrow regimes",
        Convention("a third");
    // Step 9, advice
    /// Marginal signal-to-noise ratio that counts as seen.
    SEEN_SNR: f64 = 5.0, in "1",
        larger: "more conservative limits",
        smaller: "limits that are not kept",
        Convention("five sigma");
    /// Distance at which two effects count as told apart.
    TOLD_APART: f64 = 11.0, in "nats",
        larger: "more experiments are advised",
        smaller: "fewer",
        Derived("Q(sqrt(11/2)): 1 % errors");
    // Step 10, report
    // A log without a reference
    /// Signal-to-noise ratio at usual size from which an effect may be named without a reference, by parity or about the smoothed motion.
    PARITY_SNR: f64 = 3.0, in "1",
        larger: "small effects of one plate are not named",
        smaller: "what the noise of a smoothed motion makes of columns gets names",
        Assumed("the design note's prototype gave columns of noise less; healthy logs of ten motions named nothing");
    /// Gap without a reference beyond which noise, calibration and what is named are not enough.
    PARITY_GAP: f64 = 1.05, in "sigma",
        larger: "unknown effects are called clean",
        smaller: "motions too quick for the packets are called unknown effects",
        Convention("the gate of a smoothed motion that came near enough; healthy logs lie within 0.99 and 1.01");
    /// Degrees of freedom a packet, thermometers left out, below which there is no parity.
    PARITY_FREE: f64 = 0.5, in "degrees of freedom a packet",
        larger: "units with little redundancy are refused",
        smaller: "one plate is judged by its thermometers",
        Derived("one plate has none, two have three or more");
    /// Second difference of the specific force from which on it is a knock.
    KNOCK_M_S2: f64 = 50.0, in "m/s^2",
        larger: "light taps are not counted",
        smaller: "a unit that is put down is knocked",
        Fitted("recordings by hand at 286 Hz (BROAD): 39 at most of fourteen that nobody knocked, 129 the median of 22 taps with a finger");
    /// Knocks that a log may have before they are a name.
    KNOCKS: usize = 2, in "knocks",
        larger: "a few blows are not named",
        smaller: "a unit that is put down hard once is said to be struck",
        Assumed("a log has a begin and an end, and the unit is put down at both");
    /// Power of a spectral line over its stronger side from which on it is a vibration.
    LINE_OVER: f64 = 4.0, in "1",
        larger: "weak vibrations are not named",
        smaller: "what a hand does above 15 Hz is called a vibration",
        Fitted("24 recordings by hand (BROAD): 2.3 at most without one, 6.2 at least with one; about their geometric mean");
    /// Evidence from which on something is said to be added to the field of one plate, and to be in one frame and not the other.
    ADDED_NATS: f64 = 30.0, in "nats",
        larger: "weak magnets are not named, or not told from those in the room",
        smaller: "a room whose field is told too uniform has magnets",
        Fitted("24 recordings by hand (BROAD): 9 at most without a magnet, of a constant iron of 4 uT; 935 at least with one, the frames 65 apart");
    /// Mean square of what the field of one plate is off by along the best model, beyond which nothing known explains it.
    FIELD_MISFIT: f64 = 2.0, in "variances",
        larger: "what no magnet does is called a magnet",
        smaller: "a magnet that is attached in an instant is called unknown",
        Fitted("24 recordings by hand (BROAD): 1.2 at most along the best model");
    /// Mean square of what the velocity of one plate is off by, beyond which the unit does not stay about a place.
    VELOCITY_MISFIT: f64 = 1.0, in "variances",
        larger: "gravity is sought in a thrust",
        smaller: "a quick hand is called a flight",
        Derived("a velocity within its sigma has one; 24 recordings by hand (BROAD) have 0.3 at most");
}

/// \[nats\] that an effect must bring beyond its prior odds, on readings or on the scatter, and must be able to bring in other blocks that
/// are to say anything of it: a wrong one is added as seldom as [`CHANCE`] (three nats; odds of twenty).
pub fn effect_margin() -> f64 {
    -CHANCE.ln()
}

/// \[standard deviations\] that a normal number is off, to either side, with this probability.
pub fn sigmas(probability: f64) -> f64 {
    std::f64::consts::SQRT_2 * erfc_inv(probability)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fewer is better: whoever adds one takes another out.
    const MOST: usize = 49;

    #[test]
    fn a_normal_number_is_as_far_off_as_tables_say() {
        for (probability, off) in [(CHANCE, 1.960), (SELDOM, 3.291), (RARE, 3.891)] {
            assert!((sigmas(probability) - off).abs() < 1e-3, "{probability}");
        }
    }

    #[test]
    fn every_threshold_is_listed_whole_and_once() {
        for (at, threshold) in ALL.iter().enumerate() {
            let (Provenance::Derived(why)
            | Provenance::Convention(why)
            | Provenance::Fitted(why)
            | Provenance::Assumed(why)) = threshold.provenance;
            println!(
                "{:24} {:8} {:24} {:?}",
                threshold.name, threshold.value, threshold.unit, threshold.provenance
            );
            let texts = [threshold.unit, threshold.what, threshold.larger, threshold.smaller, why];
            assert!(texts.iter().all(|text| !text.trim().is_empty()), "{}", threshold.name);
            assert!(
                threshold.value > 0.0 && threshold.value.is_finite(),
                "{}",
                threshold.name
            );
            let is_again = |other: &Threshold| other.name == threshold.name || other.what == threshold.what;
            assert!(!ALL[..at].iter().any(is_again), "{} is listed twice", threshold.name);
        }
        assert!(ALL.len() <= MOST, "{} thresholds", ALL.len());
    }
}
