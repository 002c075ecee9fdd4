//! Slow courses that a model leaves: in one sensor, in all of a kind, as a rotation, a factor, a delay.
//!
//! In: the problem, the model's effects with their parameters, how reference and field err slowly. Out: [`Beside`], and of it for each such
//! discrepancy its [`Posterior`], with the whole model and without one of its effects; and what [`effects`] of the library are worth there.
//! Calibration, field, its gradient and the effects' parameters are open beside it with their prior sigmas; attitude error
//! of the reference, field error and wandering zeros are taken out by [`crate::null::whitening`].
//!
//! Channels that share no state are whitened by themselves, and their normal equations added ([`normal`]).

mod effects;
mod normal;
mod open;

use std::sync::Arc;

use nalgebra::DMatrix;
use twin::predict::{Feel, Kind};

use self::{
    effects::{Asked, asked},
    normal::{Pass, Sums, Tried},
    open::open_columns,
};
use super::{
    binned::{BINS, Binned},
    discrepancy::{Posterior, courses},
    remainder::Setting,
    views::PLAIN,
};
use crate::{
    library::hypotheses::Library,
    null::{model::Model, problem::Problem, wander::felt_b},
};

/// Courses in time: the last has a period of a sixteenth of the log.
const COURSES: usize = 32;

/// Stretches that a course needs.
const BINS_A_COURSE: usize = 4;

/// Where a discrepancy may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Where {
    /// One sensor.
    Sensor(usize),
    /// A vector in b that all of a kind see.
    VectorB(Kind),
    /// A vector in n that all of a kind see.
    VectorN(Kind),
    /// A rotation of all against their reference.
    Rotation,
    /// A factor of all of a kind.
    Factor(Kind),
    /// A delay of all of a kind.
    Delay(Kind),
}

impl Where {
    /// How many numbers it has at an instant.
    fn components(self) -> usize {
        match self {
            Where::VectorB(_) | Where::VectorN(_) | Where::Rotation => 3,
            Where::Sensor(_) | Where::Factor(_) | Where::Delay(_) => 1,
        }
    }

    fn is_in(self, channel: usize, kind: Kind) -> bool {
        match self {
            Where::Sensor(own) => own == channel,
            Where::Rotation => kind != Kind::Thermometer,
            Where::VectorB(own) | Where::VectorN(own) | Where::Factor(own) | Where::Delay(own) => own == kind,
        }
    }
}

/// One of them.
#[derive(Clone, Debug)]
pub struct Slow {
    /// Where.
    pub place: Where,
    /// Its channels.
    pub channels: Vec<usize>,
    /// Standard deviations of a sample, root mean square over its channels, that one physical unit of it is.
    pub sigmas_per_unit: f64,
    /// How large, and how surely.
    pub posterior: Posterior,
}

/// What a channel has.
struct Seen {
    binned: Binned,
    /// What the whole model leaves, and what it leaves without each of its effects and all parts of it.
    residuals: Vec<Vec<f64>>,
    /// What the unit does at each of its samples: the same for all that are read at once.
    feels: Arc<[Feel]>,
    /// Its reading's slope by the instant, and its reading without the zero.
    by_instant: Vec<f64>,
    reading: Vec<f64>,
}

/// What a model leaves, with all that is open beside it marginalised.
pub struct Beside {
    sums: Sums,
    /// Places of slow courses.
    found: Vec<Slow>,
    /// Courses of each.
    count: usize,
    /// Which open parameters are each effect's of the model, with all parts of it ([`Problem::parts`]).
    of_effect: Vec<Vec<usize>>,
    /// Effects of the library, tried after the courses.
    asked: Vec<Asked>,
}

impl Beside {
    /// Of a model; with a library its effects are tried too. `None` where there is no sample.
    pub fn of(problem: &Problem, model: &Model, setting: &Setting, library: Option<&Library>) -> Option<Self> {
        let errors = setting.slow;
        let channels = &problem.twin.unit().channels;
        let rows = problem.fitted_rows();
        let starts_s = problem.twin.starts_s();
        let span_s = [starts_s[*rows.first()?], starts_s[*rows.last()?]];
        let mut seen: Vec<Seen> = Vec::new();
        for channel in 0..channels.len() {
            let frames = &problem.frames;
            let is_as_it = |other: &usize| {
                channels[*other].slot_s == channels[channel].slot_s
                    && frames[*other].series.rows == frames[channel].series.rows
            };
            let feels = (0..channel).find(is_as_it).map(|other| Arc::clone(&seen[other].feels));
            seen.push(see(problem, model, channel, span_s, setting, feels));
        }
        let phases = phases(&seen);
        let count = COURSES.min(phases.1 / BINS_A_COURSE).max(1);
        let open = open_columns(problem, model, errors, &seen);
        let mut found: Vec<Slow> = hypotheses(problem).map(|place| slow(problem, &seen, place)).collect();
        found.retain(|slow| {
            slow.channels
                .iter()
                .any(|channel| !seen[*channel].residuals[0].is_empty())
        });
        let asked = library.map_or_else(Vec::new, asked);
        let of_place = |slow: &Slow| Tried {
            channels: slow.channels.clone(),
            width: count * slow.place.components(),
            of_channel: {
                let (seen, phases, place) = (&seen, &phases.0, slow.place);
                Box::new(move |channel| of_course(problem, &seen[channel], channel, place, phases, count))
            },
        };
        let mut tried: Vec<Tried> = found.iter().map(of_place).collect();
        if let Some(library) = library {
            tried.extend(asked.iter().map(|asked| asked.tried(problem, library, &seen)));
        }
        let pass = Pass {
            problem,
            errors,
            seen: &seen,
            open: &open,
            tried: &tried,
            step_s: (span_s[1] - span_s[0]) / BINS as f64,
        };
        let sums = pass.sums();
        drop(tried);
        Some(Beside {
            sums,
            found,
            count,
            of_effect: open.of_effect,
            asked,
        })
    }

    /// The slow courses, with the whole model or without one of its effects; `about` is the size, in physical units, about which the grid
    /// of sizes is.
    pub fn courses(&self, without: Option<usize>, about: &dyn Fn(&Slow) -> f64) -> Vec<Slow> {
        let dropped = without.map_or(&[][..], |effect| &self.of_effect[effect]);
        let Some(marginal) = self.sums.without(dropped) else {
            return Vec::new();
        };
        let residual = without.map_or(0, |effect| effect + 1);
        let (_, scales) = courses(self.count);
        let mut found = self.found.clone();
        for (at, slow) in found.iter_mut().enumerate() {
            let (information, score) = marginal.of(at, residual);
            let share = (slow.place.components() as f64).sqrt().recip();
            let scales: Vec<f64> = (0..slow.place.components())
                .flat_map(|_| scales.iter().map(|scale| scale * share))
                .collect();
            slow.posterior = Posterior::of(information, &score, &scales, about(slow));
        }
        found
    }
}

impl Beside {
    /// \[nats\] that an effect of the model is worth, with all parts of it.
    pub fn worth(&self, effect: usize) -> f64 {
        let fixed = self.sums.without(&self.of_effect[effect]);
        fixed.map_or(0.0, |fixed| 0.5 * (fixed.energy(effect + 1) - fixed.energy(0)))
    }

    /// \[nats\] that its parameters cost, which were sought within their prior sigmas and found within less (Schwarz 1978).
    pub fn price(&self, effect: usize) -> f64 {
        let both = self.sums.without(&[]).zip(self.sums.without(&self.of_effect[effect]));
        both.map_or(0.0, |(all, fixed)| {
            0.5 * (all.log_determinant() - fixed.log_determinant())
        })
    }
}

/// Of each stretch of the log, how far the courses have run there, 0 to 1, and how many stretches have samples: a course runs over the time
/// that there are samples of.
fn phases(seen: &[Seen]) -> (Vec<f64>, usize) {
    let mut is_there = vec![false; BINS];
    (seen.iter().flat_map(|seen| &seen.binned.bins)).for_each(|bin| is_there[*bin] = true);
    let there = is_there.iter().filter(|is_there| **is_there).count();
    let mut before = 0.0;
    let phases = is_there.iter().map(|is_there| {
        let phase = (before + 0.5) / there as f64;
        before += f64::from(u8::from(*is_there));
        phase
    });
    (phases.collect(), there)
}

/// What a channel has; what the unit does at its samples may be known.
fn see(
    problem: &Problem,
    model: &Model,
    channel: usize,
    span_s: [f64; 2],
    setting: &Setting,
    feels: Option<Arc<[Feel]>>,
) -> Seen {
    let frame = &problem.frames[channel];
    let own = &problem.twin.unit().channels[channel];
    let mut binned = Binned::of(problem, channel, span_s, setting.louder[channel]);
    // What is left once all is fitted tells the noise; what the pass begins with is only about the effects.
    let rest = binned.means(|sample| model.fitted.rest[channel][sample] * frame.weights[sample]);
    let factor = binned.factor(&rest);
    // A sample of a wandering zero says nothing of what is slow: the pass leaves it out.
    let factor = if setting.wandering.contains(&channel) {
        f64::INFINITY
    } else {
        factor
    };
    binned.variances.iter_mut().for_each(|variance| *variance *= factor);
    let predicted = problem.predict(channel, &model.components);
    let rows = &frame.series.rows;
    let left =
        |predicted: &[f64]| binned.means(|sample| frame.series.values[sample] - predicted[rows[sample] as usize]);
    let mut residuals = vec![left(&predicted)];
    residuals.extend((0..model.components.len()).map(|without| {
        let parts = problem.parts(&model.components, without);
        let others = (0..model.components.len()).filter(|at| !parts.contains(at));
        let others: Vec<_> = others.map(|at| model.components[at].clone()).collect();
        left(&problem.predict(channel, &others))
    }));
    let feels = feels.unwrap_or_else(|| {
        let feels = problem.true_twin().feels(channel);
        rows.iter().map(|row| feels[*row as usize]).collect()
    });
    let by_instant = problem.true_twin().by_instant(channel);
    let at = |series: &[f64], zero: f64| rows.iter().map(|row| series[*row as usize] - zero).collect();
    Seen {
        residuals,
        by_instant: at(&by_instant, 0.0),
        reading: (rows.iter())
            .map(|row| {
                let row = *row as usize;
                let reading = predicted[row] - own.bias;
                // Where the reference sees little but its own errors, these are minus the residual: a factor of -1.
                if reading.abs() > PLAIN * problem.instrument.fast_sigma(channel, row) {
                    reading
                } else {
                    0.0
                }
            })
            .collect(),
        feels,
        binned,
    }
}

fn hypotheses(problem: &Problem) -> impl Iterator<Item = Where> {
    let channels = &problem.twin.unit().channels;
    let kinds = [Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer];
    let there: Vec<Kind> = (kinds.into_iter())
        .filter(|kind| channels.iter().filter(|channel| channel.sensor == *kind).count() > 1)
        .collect();
    let rotation = (!there.is_empty()).then_some(Where::Rotation);
    let of_kind = |kind: Kind| {
        [
            Where::VectorB(kind),
            Where::VectorN(kind),
            Where::Factor(kind),
            Where::Delay(kind),
        ]
    };
    (0..channels.len())
        .map(Where::Sensor)
        .chain(there.into_iter().flat_map(of_kind))
        .chain(rotation)
}

/// What a discrepancy of one unit adds to a channel at a sample.
fn design(problem: &Problem, seen: &Seen, channel: usize, place: Where, sample: usize) -> [f64; 3] {
    let own = &problem.twin.unit().channels[channel];
    let feel = &seen.feels[sample];
    match place {
        Where::Sensor(_) => [1.0, 0.0, 0.0],
        Where::VectorB(_) => own.axis_b.into(),
        Where::VectorN(_) => (feel.q_nb * own.axis_b).into(),
        Where::Rotation => own.axis_b.cross(&felt_b(own.sensor, feel)).into(),
        Where::Factor(_) => [seen.reading[sample], 0.0, 0.0],
        Where::Delay(_) => [-seen.by_instant[sample], 0.0, 0.0],
    }
}

/// The columns of a discrepancy at the means of a channel: its components, each with all courses.
fn of_course(
    problem: &Problem,
    seen: &Seen,
    channel: usize,
    place: Where,
    phases: &[f64],
    count: usize,
) -> DMatrix<f64> {
    let (course, scales) = courses(count);
    let components = place.components();
    let share = (components as f64).sqrt().recip();
    let means = |component: usize| {
        seen.binned
            .means(|sample| design(problem, seen, channel, place, sample)[component])
    };
    let designs: Vec<Vec<f64>> = (0..components).map(means).collect();
    DMatrix::from_fn(seen.binned.bins.len(), count * components, |mean, column| {
        let k = column % count;
        share * scales[k] * course(k, phases[seen.binned.bins[mean]]) * designs[column / count][mean]
    })
}

fn slow(problem: &Problem, seen: &[Seen], place: Where) -> Slow {
    let all = problem.twin.unit().channels.iter().enumerate();
    let channels: Vec<usize> = (all.filter(|(channel, own)| place.is_in(*channel, own.sensor)))
        .map(|(channel, _)| channel)
        .collect();
    let (mut energy, mut samples) = (0.0, 0);
    for channel in &channels {
        for (sample, row) in problem.frames[*channel].series.rows.iter().enumerate() {
            let own = design(problem, &seen[*channel], *channel, place, sample);
            let squares: f64 = own.iter().map(|value| value * value).sum();
            energy += squares / problem.sigmas[*channel][*row as usize].powi(2);
            samples += 1;
        }
    }
    Slow {
        place,
        channels,
        sigmas_per_unit: (energy / (samples.max(1) * place.components()) as f64).sqrt(),
        posterior: Posterior {
            log_bayes_factor: 0.0,
            sizes: Vec::new(),
        },
    }
}
