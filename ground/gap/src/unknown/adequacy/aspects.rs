//! Everything that is looked at in a residual: a list of sums of squares.
//!
//! In: the [`View`]s of all channels, the named effects' [`Suspect`]s and a fit. Out: one sum of squares an aspect, with its
//! name. A test that looks at many shapes at once sees none of them well, so each suspicion has a sum of its own. Of a
//! channel, and of all channels of a kind together, for what is small in each of twelve is large in all: its energy; slow
//! shapes in time; shapes in time and motion together ([`super::shapes`]); the motion itself; neighbouring samples alike
//! (Ljung and Box 1978); noise that comes and goes, neighbouring squares alike (McLeod and Li 1983); a tone
//! ([`super::spectrum`]); heavy tails; the size of the fitted calibration, without which an unknown effect hides in the
//! calibration; steps between levels of one quantity, which a wrong law leaves; codes that do not come ([`super::codes`]).
//! Of a part, each frequency in all its axes. Of all channels together: the energy of a stretch of time, and noise that
//! comes and goes in all of a kind; the same vector in all sensors of a kind, along any axes or one, and in single samples;
//! the same factor, as of a supply they share; the same small rotation in all sensors, which a loose mount or a reference
//! that slips leaves and no single channel shows; what is open of each channel and was found along one line in several
//! ([`super::calibrations`]). Of a named effect: whether it is as strong everywhere as its law says ([`super::uniformity`]),
//! and if it is one on the scatter, whether waves of each length have the energy that it claims, and outliers the size and
//! the distance from the sample before, no more and no less: a law of outliers "anywhere in the range" would else stand for
//! any, values that are sent again among them; and whether channels that scatter each by itself go one way
//! ([`super::courses`]).

use nalgebra::{DMatrix, Vector1};

use super::{
    calibrations::Shared,
    common::Common,
    courses,
    label::{Label, OF_CALIBRATION, name_of},
    shapes::{BINS, Shapes},
    spectrum::{Spectrum, strongest},
    sums::{Bursts, alike, between_levels, mean_logarithm, outliers, squares, tails},
    uniformity::{Strength, Suspect},
    view::{LEVELLED, STRETCHES, View, place},
};
use crate::{null::joint::Fitted, unknown::octaves};

/// [units of noise] within which a sample is where the one before was: what is sent again is as near as a calibration is right,
/// and how near that is says nothing.
const NEAR: f64 = 1.2;

/// Stretches in which vectors, factors and rotations common to sensors are sought: of seconds, and of a minute.
const COMMON: [usize; 2] = [60, 12];

/// Stretches in which the noise of a kind of sensor comes and goes: of seconds.
const BURSTS: [usize; 2] = [150, 60];

/// What is looked at in each channel, before the levels.
const OF_CHANNEL: [&str; 9] = [
    "more energy than noise",
    "a slow shape in time",
    "a shape in time or motion",
    "goes with the motion",
    "neighbouring samples alike",
    "noise that comes and goes",
    "a tone",
    "outliers",
    OF_CALIBRATION,
];

/// Those of [`OF_CHANNEL`] that look at nothing but how a sample scatters. Where the reference errs more than the sensor
/// scatters, and is itself known to a third, they would find the reference.
const OF_SCATTER: [usize; 4] = [0, 4, 5, 7];

/// Of them all, levels included.
const EACH: usize = OF_CHANNEL.len() + LEVELLED.len();

/// The views made ready for sums.
pub struct Sights<'a> {
    views: &'a [View],
    /// The channels that an effect on the scatter is in.
    scattered: &'a [usize],
    shapes: Vec<Shapes>,
    spectra: Vec<Spectrum>,
    vectors: Vec<Vec<Common<3>>>,
    /// Of each kind, in single samples.
    jolts: Vec<Common<3>>,
    factors: Vec<Vec<Common<1>>>,
    turns: Vec<Common<3>>,
    shared: Vec<Shared>,
    strengths: Vec<Strength>,
}

impl<'a> Sights<'a> {
    /// Of all channels, and of the effects that a model names: on readings, and on the scatter of some channels.
    pub fn new(views: &'a [View], suspects: &[Suspect], scattered: &'a [usize]) -> Self {
        let vector = |kind: usize, stretches: usize| {
            Common::new(
                views,
                stretches,
                |view, _| view.axis_b,
                |index| views[index].kind == kind,
            )
        };
        let jolts = |kind: usize| Common::of_samples(views, |view, _| view.axis_b, |index| views[index].kind == kind);
        let factor = |kind: usize, stretches: usize| {
            let felt = |view: &View, row: usize| Vector1::new(view.felt[row]);
            Common::new(views, stretches, felt, |index| views[index].kind == kind)
        };
        let turned = |view: &View, row: usize| view.turned.fixed_view::<1, 3>(row, 0).transpose();
        Sights {
            views,
            scattered,
            shapes: views.iter().map(Shapes::new).collect(),
            spectra: views.iter().map(|view| Spectrum::new(view.phase.len())).collect(),
            vectors: (0..kinds(views))
                .map(|kind| COMMON.map(|stretches| vector(kind, stretches)).into())
                .collect(),
            jolts: (0..kinds(views)).map(jolts).collect(),
            factors: (0..kinds(views))
                .map(|kind| COMMON.map(|stretches| factor(kind, stretches)).into())
                .collect(),
            turns: COMMON
                .map(|stretches| Common::new(views, stretches, turned, |_| true))
                .into(),
            shared: Shared::all(views, kinds(views)),
            strengths: suspects
                .iter()
                .flat_map(|suspect| Strength::all(views, suspect))
                .collect(),
        }
    }

    /// What each entry of [`Sights::sums`] is, and then the rarity of the codes of each channel that has such.
    pub fn labels(&self) -> Vec<Label> {
        let mut labels = Vec::new();
        let each = |name: &str| -> Vec<String> {
            let of_channel = OF_CHANNEL.iter().map(|what| format!("{name}: {what}"));
            let levelled = LEVELLED.iter().map(|what| format!("{name}: steps with {what}"));
            of_channel.chain(levelled).collect()
        };
        for (index, view) in self.views.iter().enumerate() {
            labels.extend(each(&view.name).into_iter().map(|what| Label::of(what, vec![index])));
        }
        for kind in 0..kinds(self.views) {
            let name = name_of(kind);
            let mut of_kind = each(&format!("{name} together"));
            of_kind.extend(["x", "y", "z"].map(|axis| format!("{name}: a common vector along {axis}")));
            of_kind.extend(COMMON.iter().flat_map(|stretches| {
                ["", " along one axis"].map(|way| format!("{name}: a common vector{way} in stretches of 1/{stretches}"))
            }));
            of_kind.push(format!("{name}: outliers along a common vector"));
            of_kind.extend(COMMON.map(|stretches| format!("{name}: a common factor in stretches of 1/{stretches}")));
            of_kind.extend((0..STRETCHES).map(|stretch| format!("{name}: stretch {} of {STRETCHES}", stretch + 1)));
            of_kind.extend(BURSTS.map(|stretches| format!("{name}: noise that comes and goes in 1/{stretches}")));
            labels.extend(of_kind.into_iter().map(|what| Label::of(what, self.of_kind(kind))));
        }
        labels.extend(self.parts().map(|part| {
            let channels: Vec<usize> = self.of_part(part).collect();
            let names: Vec<&str> = channels
                .iter()
                .map(|channel| self.views[*channel].name.as_str())
                .collect();
            Label::of(format!("{}: one frequency", names.join(" ")), channels)
        }));
        labels.extend(COMMON.iter().flat_map(|stretches| {
            ["", " about one axis"].map(|way| {
                let what = format!("all sensors: a common rotation{way} in stretches of 1/{stretches}");
                Label::of(what, (0..self.views.len()).collect())
            })
        }));
        labels.extend((self.shared.iter()).map(|shared| Label::of(shared.what.clone(), shared.channels().collect())));
        labels.extend(self.strengths.iter().map(|strength| Label {
            effect: Some(strength.effect.clone()),
            ..Label::of(strength.what.clone(), strength.channels.clone())
        }));
        for channel in self.scattered {
            let view = &self.views[*channel];
            let sizes = format!("{}: outliers have not the size that is claimed", view.name);
            labels.push(Label {
                may_be_none: true,
                ..Label::of(sizes, vec![*channel]).claimed()
            });
            labels.extend(waves(view.phase.len()).into_iter().map(|length| {
                let what = format!(
                    "{}: waves of {length} samples have not the energy that is claimed",
                    view.name
                );
                Label::of(what, vec![*channel]).claimed()
            }));
        }
        labels.extend(
            self.scattered_kinds()
                .map(|kind| Label::of(format!("{} go one way together", name_of(kind)), self.of_kind(kind))),
        );
        labels.extend(["the size", "the distance from the sample before"].map(|what| {
            let what = format!("outliers together have not {what} that is claimed");
            Label {
                may_be_none: true,
                ..Label::of(what, self.scattered.to_vec()).claimed()
            }
        }));
        let sends_codes = |(_, view): &(usize, &View)| view.codes.is_some();
        labels.extend(self.views.iter().enumerate().filter(sends_codes).map(|(index, view)| {
            let what = format!("{}: bits that are set too often or too seldom", view.name);
            Label::of(what, vec![index])
        }));
        labels
    }

    /// The channels of a kind.
    fn of_kind(&self, kind: usize) -> Vec<usize> {
        (0..self.views.len())
            .filter(|index| self.views[*index].kind == kind)
            .collect()
    }

    /// The parts that there are.
    fn parts(&self) -> impl Iterator<Item = usize> {
        (0..self.views.len()).filter(|index| self.views[*index].part == *index)
    }

    /// The channels of one.
    fn of_part(&self, part: usize) -> impl Iterator<Item = usize> {
        (0..self.views.len()).filter(move |index| self.views[*index].part == part)
    }

    /// Kinds of the channels that an effect on the scatter is in.
    fn scattered_kinds(&self) -> impl Iterator<Item = usize> {
        let is_in = |kind: &usize| self.scattered.iter().any(|channel| self.views[*channel].kind == *kind);
        (0..kinds(self.views)).filter(is_in)
    }

    /// The sums of squares, in that order.
    pub fn sums(&self, fitted: &Fitted) -> Vec<f64> {
        let kinds = kinds(self.views);
        let mut sums = Vec::new();
        let mut together = vec![[0.0; EACH]; kinds];
        let mut common = vec![DMatrix::zeros(BINS, 3); kinds];
        let mut stretches = vec![[0.0; STRETCHES]; kinds];
        let mut bursts: Vec<_> = (0..kinds).map(|_| BURSTS.map(Bursts::new)).collect();
        let mut powers = Vec::new();
        for (index, (view, shapes)) in self.views.iter().zip(&self.shapes).enumerate() {
            let rest = &fitted.rest[index];
            let values = rest.as_slice();
            let binned = shapes.binned(rest);
            let along = shapes.along(rest, &binned);
            let transform = self.spectra[index].of(values);
            powers.push(transform.powers());
            let squares = squares(values);
            let mut own = vec![
                rest.norm_squared(),
                along.slow,
                along.any,
                along.motion,
                alike(values),
                alike(&squares),
                transform.plainness(),
                tails(values),
                fitted.nuisance[index].norm_squared(),
            ];
            own.extend(view.levels.iter().map(|levels| between_levels(levels, values)));
            if view.is_limited {
                OF_SCATTER.iter().for_each(|at| own[*at] = 0.0);
            }
            (together[view.kind].iter_mut().zip(&own)).for_each(|(all, own)| *all += own);
            sums.extend(own);
            common[view.kind] += &binned * view.axis_b.transpose();
            if view.is_limited {
                continue;
            }
            for (phase, value) in view.phase.iter().zip(values) {
                stretches[view.kind][place(*phase, STRETCHES)] += value * value;
            }
            (bursts[view.kind].iter_mut()).for_each(|bursts| bursts.add(&view.phase, &squares));
        }
        for kind in 0..kinds {
            sums.extend(together[kind]);
            sums.extend(common[kind].column_iter().map(|column| column.norm_squared()));
            sums.extend(self.vectors[kind].iter().flat_map(|vector| vector.sums(fitted)));
            sums.push(self.jolts[kind].tails(fitted));
            sums.extend(self.factors[kind].iter().map(|factor| factor.sum(fitted)));
            sums.extend(stretches[kind]);
            sums.extend(bursts[kind].iter().map(Bursts::sum));
        }
        sums.extend(
            self.parts()
                .map(|part| strongest(self.of_part(part).map(|channel| &powers[channel]))),
        );
        sums.extend(self.turns.iter().flat_map(|turn| turn.sums(fitted)));
        sums.extend(self.shared.iter().map(|shared| shared.sum(fitted)));
        sums.extend(self.strengths.iter().map(|strength| strength.sum(fitted)));
        let (mut sizes, mut distances) = (Vec::new(), Vec::new());
        for channel in self.scattered {
            let rest = fitted.rest[*channel].as_slice();
            let own = outliers(rest).map(|at| rest[at].abs());
            sums.push(mean_logarithm(own.clone()));
            sizes.extend(own);
            let read = |at: usize| self.views[*channel].predicted[at] + rest[at];
            let away = |at: usize| (read(at) - read(at - 1)).abs().max(NEAR);
            distances.extend(outliers(rest).filter(|at| *at > 0).map(away));
            sums.extend(octaves::energies(rest));
        }
        for kind in self.scattered_kinds() {
            let own = self
                .scattered
                .iter()
                .filter(|channel| self.views[**channel].kind == kind);
            let slow = own.map(|channel| (self.views[*channel].phase.as_slice(), fitted.rest[*channel].as_slice()));
            sums.push(courses::alike(slow));
        }
        sums.extend([sizes, distances].map(|values| mean_logarithm(values.into_iter())));
        sums
    }
}

/// The views of channels that send codes.
pub fn coded(views: &[View]) -> impl Iterator<Item = &View> {
    views.iter().filter(|view| view.codes.is_some())
}

/// Number of kinds in the views.
fn kinds(views: &[View]) -> usize {
    views.iter().map(|view| view.kind + 1).max().unwrap_or(0)
}

/// How long the waves are, in samples, of each of the [`octaves`] of so long a series.
fn waves(count: usize) -> Vec<String> {
    let octaves = octaves::energies(&vec![0.0; count]).len();
    let length = |octave: usize| match 1 << (octave + 1) {
        shortest if octave + 1 == octaves => format!("{shortest} or more"),
        shortest => format!("{shortest} to {}", 2 * shortest),
    };
    (0..octaves).map(length).collect()
}
