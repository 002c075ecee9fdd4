//! Slow courses that a model leaves: in one sensor, in all of a kind, as a rotation, a factor, a delay.
//!
//! In: the problem, the model's effects with their parameters, how reference and field err slowly. Out: for each such discrepancy its
//! [`Posterior`]. Calibration, field, its gradient and the effects' parameters are open beside it with their prior sigmas; attitude error
//! of the reference, field error and wandering zeros are taken out by [`crate::null::whitening`].
//!
//! Channels that share no state are whitened by themselves, and their normal equations added.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};
use twin::predict::{Feel, Kind};

use super::remainder::Setting;
use super::{
    binned::{BINS, Binned},
    discrepancy::{Posterior, courses},
};
use crate::{
    input::case::SlowErrors,
    null::{
        model::Model,
        problem::Problem,
        whitening::{Process, Sample, Whitening, places},
    },
};

/// Courses in time: the last has a period of a sixteenth of the log.
const COURSES: usize = 32;

/// Stretches that a course needs.
const BINS_A_COURSE: usize = 4;

/// [unit/sqrt(s)] by which zeros walk where their description says less: accelerometers, gyros, magnetometers (nine recordings of BROAD).
const WALKS: [f64; 3] = [3e-4, 1e-6, 2e-3];

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
    residual: Vec<f64>,
    /// What the unit does at each of its samples.
    feels: Vec<Feel>,
    /// Its reading's slope by the instant, and its reading without the zero.
    by_instant: Vec<f64>,
    reading: Vec<f64>,
}

/// The normal equations of the discrepancies beside what is open.
struct Sums {
    open: DMatrix<f64>,
    pull: DVector<f64>,
    /// Of each discrepancy: with itself, with what is open, with the residual.
    own: Vec<(DMatrix<f64>, DMatrix<f64>, DVector<f64>)>,
}

/// All of a model; `about` is the size, in physical units, about which the grid of sizes is.
pub fn discrepancies(problem: &Problem, model: &Model, setting: &Setting, about: &dyn Fn(&Slow) -> f64) -> Vec<Slow> {
    let errors = setting.slow;
    let channels = &problem.twin.unit().channels;
    let rows = problem.fitted_rows();
    let starts_s = problem.twin.starts_s();
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Vec::new();
    };
    let span_s = [starts_s[*first], starts_s[*last]];
    let seen: Vec<Seen> = (0..channels.len())
        .map(|channel| see(problem, model, channel, span_s, setting))
        .collect();
    // A course runs over the time that there are samples of.
    let mut is_there = vec![false; BINS];
    (seen.iter().flat_map(|seen| &seen.binned.bins)).for_each(|bin| is_there[*bin] = true);
    let there = is_there.iter().filter(|is_there| **is_there).count();
    let mut before = 0.0;
    let phases: Vec<f64> = (is_there.iter())
        .map(|is_there| {
            let phase = (before + 0.5) / there as f64;
            before += f64::from(u8::from(*is_there));
            phase
        })
        .collect();
    let count = COURSES.min(there / BINS_A_COURSE).max(1);
    let open = open_columns(problem, model, errors, &seen);
    let mut found: Vec<Slow> = hypotheses(problem).map(|place| slow(problem, &seen, place)).collect();
    found.retain(|slow| slow.channels.iter().any(|channel| !seen[*channel].residual.is_empty()));
    let mut sums = Sums {
        open: DMatrix::identity(open.len(), open.len()),
        pull: DVector::zeros(open.len()),
        own: (found.iter())
            .map(|slow| {
                let width = count * slow.place.components();
                (
                    DMatrix::zeros(width, width),
                    DMatrix::zeros(open.len(), width),
                    DVector::zeros(width),
                )
            })
            .collect(),
    };
    let step_s = (span_s[1] - span_s[0]) / BINS as f64;
    for set in sets(problem, errors) {
        add(
            problem,
            errors,
            &seen,
            &set,
            &open,
            &found,
            (&phases, count, step_s),
            &mut sums,
        );
    }
    let Some(factor) = Cholesky::new(sums.open) else {
        return Vec::new();
    };
    let (_, scales) = courses(count);
    for (slow, (own, with_open, pull)) in found.iter_mut().zip(sums.own) {
        let solved = factor.solve(&with_open);
        let information = own - with_open.tr_mul(&solved);
        let score = pull - solved.tr_mul(&sums.pull);
        let share = (slow.place.components() as f64).sqrt().recip();
        let scales: Vec<f64> = (0..slow.place.components())
            .flat_map(|_| scales.iter().map(|scale| scale * share))
            .collect();
        slow.posterior = Posterior::of(
            0.5 * (&information + information.transpose()),
            &score,
            &scales,
            about(slow),
        );
    }
    found
}

fn see(problem: &Problem, model: &Model, channel: usize, span_s: [f64; 2], setting: &Setting) -> Seen {
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
    let residual = binned.means(|sample| frame.series.values[sample] - predicted[rows[sample] as usize]);
    let feels = problem.true_twin().feels(channel);
    let by_instant = problem.true_twin().by_instant(channel);
    let at = |series: &[f64], zero: f64| rows.iter().map(|row| series[*row as usize] - zero).collect();
    Seen {
        residual,
        by_instant: at(&by_instant, 0.0),
        reading: at(&predicted, own.bias),
        feels: rows.iter().map(|row| feels[*row as usize]).collect(),
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

fn felt_b(kind: Kind, feel: &Feel) -> Vector3<f64> {
    match kind {
        Kind::Accelerometer => feel.force_b,
        Kind::Gyro => feel.rate_b,
        Kind::Magnetometer => feel.field_b_ut,
        Kind::Thermometer => Vector3::zeros(),
    }
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

/// For each open parameter, per channel that it touches the means of its column, for one prior sigma.
type Open = Vec<Vec<(usize, Vec<f64>)>>;

fn open_columns(problem: &Problem, model: &Model, errors: &SlowErrors, seen: &[Seen]) -> Open {
    let mut open = Open::new();
    for (channel, seen) in seen.iter().enumerate() {
        let rows = &problem.frames[channel].series.rows;
        open.extend((problem.open(channel).iter()).map(|column| {
            let values = &column.entries[0].1;
            vec![(
                channel,
                seen.binned.means(|sample| values[rows[sample] as usize] * column.sigma),
            )]
        }));
    }
    for column in &problem.reference {
        let means = |(channel, values): &(usize, Vec<f64>)| {
            let rows = &problem.frames[*channel].series.rows;
            let binned = &seen[*channel].binned;
            (
                *channel,
                binned.means(|sample| values[rows[sample] as usize] * column.sigma),
            )
        };
        open.push(column.entries.iter().map(means).collect());
    }
    for (at, component) in model.components.iter().enumerate() {
        let parameters = component.active.cause.parameters(problem.twin.unit());
        for (column, parameter) in problem.slopes(&model.components, at).iter().zip(&parameters) {
            let means = |(channel, values): &(usize, DVector<f64>)| {
                let weights = &problem.frames[*channel].weights;
                let of = |sample: usize| values[sample] * weights[sample] * parameter.prior_sigma;
                (*channel, seen[*channel].binned.means(of))
            };
            open.push(column.iter().map(means).collect());
        }
    }
    open.extend(gradient(problem, errors, seen));
    open
}

/// The field's gradient, which is symmetric and has no trace.
fn gradient(problem: &Problem, errors: &SlowErrors, seen: &[Seen]) -> Open {
    let sigma = errors.field_gradient_sigma_ut_m;
    let all = problem.twin.unit().channels.iter().enumerate();
    let magnetometers: Vec<usize> = (all.filter(|(_, own)| own.sensor == Kind::Magnetometer))
        .map(|(channel, _)| channel)
        .collect();
    let Some(middle) = magnetometers
        .first()
        .and_then(|channel| seen[*channel].feels.first())
        .map(|feel| feel.position_n)
    else {
        return Open::new();
    };
    if sigma <= 0.0 {
        return Open::new();
    }
    let parts = [
        [(0, 0, 1.0), (2, 2, -1.0)],
        [(1, 1, 1.0), (2, 2, -1.0)],
        [(0, 1, 1.0), (1, 0, 1.0)],
        [(0, 2, 1.0), (2, 0, 1.0)],
        [(1, 2, 1.0), (2, 1, 1.0)],
    ];
    let column = |part: [(usize, usize, f64); 2]| {
        let mut gradient = Matrix3::zeros();
        part.iter()
            .for_each(|(row, column, value)| gradient[(*row, *column)] = value * sigma);
        let of_channel = |channel: &usize| {
            let (seen, axis_b) = (&seen[*channel], problem.twin.unit().channels[*channel].axis_b);
            let of = |sample: usize| {
                let feel = &seen.feels[sample];
                axis_b.dot(&feel.to_b(gradient * (feel.position_n - middle)))
            };
            (*channel, seen.binned.means(of))
        };
        magnetometers.iter().map(of_channel).collect()
    };
    parts.into_iter().map(column).collect()
}

/// Channels that share a state, together; the others by themselves.
fn sets(problem: &Problem, errors: &SlowErrors) -> Vec<Vec<usize>> {
    let (mut together, mut sets) = (Vec::new(), Vec::new());
    for (channel, own) in problem.twin.unit().channels.iter().enumerate() {
        let is_shared = match own.sensor {
            Kind::Thermometer => false,
            Kind::Magnetometer => errors.attitude_sigma_rad > 0.0 || errors.field_wander_sigma_ut > 0.0,
            Kind::Accelerometer | Kind::Gyro => errors.attitude_sigma_rad > 0.0,
        };
        match is_shared {
            true => together.push(channel),
            false => sets.push(vec![channel]),
        }
    }
    sets.push(together);
    sets.retain(|set| !set.is_empty());
    sets
}

/// Adds the normal equations of one set of channels.
#[allow(clippy::too_many_arguments, reason = "one step of `discrepancies`, cut out of it")]
fn add(
    problem: &Problem,
    errors: &SlowErrors,
    seen: &[Seen],
    set: &[usize],
    open: &Open,
    found: &[Slow],
    (phases, count, step_s): (&[f64], usize, f64),
    sums: &mut Sums,
) {
    let units = &problem.twin.unit().channels;
    // Three axes of the attitude, three of the field, a zero each.
    let mut processes = Vec::new();
    let is_shared = set.len() > 1;
    for _ in 0..3 {
        processes.push(Process::Matern {
            sigma: if is_shared { errors.attitude_sigma_rad } else { 0.0 },
            alike_s: errors.attitude_correlation_s,
        });
    }
    for _ in 0..3 {
        processes.push(Process::Alike {
            sigma: if is_shared { errors.field_wander_sigma_ut } else { 0.0 },
            alike_s: errors.field_correlation_s,
        });
    }
    let walk = |channel: &usize| {
        let own = &units[*channel];
        let least = match own.sensor {
            Kind::Accelerometer => WALKS[0],
            Kind::Gyro => WALKS[1],
            Kind::Magnetometer => WALKS[2],
            Kind::Thermometer => 0.0,
        };
        Process::Walk {
            per_root_s: own.drift_sigma.max(least),
        }
    };
    // States that are zero for ever cost time and say nothing.
    let is_alone = !is_shared;
    if is_alone {
        processes.clear();
    }
    processes.extend(set.iter().map(walk));
    let (at, _) = places(&processes);
    let shared = if is_alone { 0 } else { 6 };
    let mut order: Vec<(usize, usize, usize)> = Vec::new();
    for (place, channel) in set.iter().enumerate() {
        order.extend(
            seen[*channel]
                .binned
                .bins
                .iter()
                .enumerate()
                .map(|(own, bin)| (*bin, place, own)),
        );
    }
    order.sort_unstable();
    // What each sample sees of attitude and field, averaged as it is.
    let rows: Vec<Vec<Vec<f64>>> = set
        .iter()
        .map(|channel| {
            if is_alone {
                Vec::new()
            } else {
                seen_states(problem, &seen[*channel], *channel)
            }
        })
        .collect();
    let samples: Vec<Sample> = (order.iter())
        .map(|(bin, place, own)| {
            let mut sees = vec![(at[shared + place], 1.0)];
            for (of, part) in rows[*place].iter().enumerate() {
                // Angle, rate and field: an angle's rate is its second state.
                let state = match of {
                    0..3 => at[of],
                    3..6 => at[of - 3] + 1,
                    _ => at[of - 3],
                };
                if part[*own] != 0.0 {
                    sees.push((state, part[*own]));
                }
            }
            Sample {
                t_s: *bin as f64 * step_s,
                sees,
                variance: seen[set[*place]].binned.variances[*own],
            }
        })
        .collect();
    let whitening = Whitening::new(&processes, &samples);
    let touching: Vec<usize> = (0..open.len())
        .filter(|at| open[*at].iter().any(|(channel, _)| set.contains(channel)))
        .collect();
    let mut columns = DMatrix::zeros(order.len(), touching.len() + 1);
    for (column, at) in touching.iter().enumerate() {
        let of_place: Vec<Option<&Vec<f64>>> = (set.iter())
            .map(|channel| open[*at].iter().find(|(own, _)| own == channel).map(|(_, means)| means))
            .collect();
        for (row, (_, place, own)) in order.iter().enumerate() {
            columns[(row, column)] = of_place[*place].map_or(0.0, |means| means[*own]);
        }
    }
    for (row, (_, place, own)) in order.iter().enumerate() {
        columns[(row, touching.len())] = seen[set[*place]].residual[*own];
    }
    let white = whitening.whiten(&columns);
    let (white_open, white_residual) = (white.columns(0, touching.len()), white.column(touching.len()));
    let (own, pull) = (white_open.tr_mul(&white_open), white_open.tr_mul(&white_residual));
    for (row, one) in touching.iter().enumerate() {
        sums.pull[*one] += pull[row];
        (touching.iter().enumerate()).for_each(|(column, other)| sums.open[(*one, *other)] += own[(row, column)]);
    }
    let (course, scales) = courses(count);
    for (slow, (own, with_open, pull)) in found.iter().zip(&mut sums.own) {
        if !set.iter().any(|channel| slow.channels.contains(channel)) {
            continue;
        }
        let components = slow.place.components();
        let share = (components as f64).sqrt().recip();
        let mut columns = DMatrix::zeros(order.len(), count * components);
        for (place, channel) in set
            .iter()
            .enumerate()
            .filter(|(_, channel)| slow.channels.contains(channel))
        {
            let seen = &seen[*channel];
            let means: Vec<Vec<f64>> = (0..components)
                .map(|component| {
                    seen.binned
                        .means(|sample| design(problem, seen, *channel, slow.place, sample)[component])
                })
                .collect();
            for (row, (bin, _, own)) in order.iter().enumerate().filter(|(_, (_, other, _))| *other == place) {
                for (component, means) in means.iter().enumerate() {
                    for k in 0..count {
                        columns[(row, component * count + k)] =
                            share * scales[k] * course(k, phases[*bin]) * means[*own];
                    }
                }
            }
        }
        let white = whitening.whiten(&columns);
        *own += white.tr_mul(&white);
        *pull += white.tr_mul(&white_residual);
        let cross = white_open.tr_mul(&white);
        for (row, at) in touching.iter().enumerate() {
            let mut sum = with_open.row_mut(*at);
            sum += cross.row(row);
        }
    }
}

/// Of a channel what it sees of an attitude error about the axes of n, of its rate, and of a field error along them, averaged.
fn seen_states(problem: &Problem, seen: &Seen, channel: usize) -> Vec<Vec<f64>> {
    let own = &problem.twin.unit().channels[channel];
    let state = |of: usize, sample: usize| {
        let feel = &seen.feels[sample];
        let axis_n = feel.q_nb * own.axis_b;
        match (of, own.sensor) {
            // n.C(v + v x phi) for a vector v that stands in n.
            (0..3, Kind::Accelerometer | Kind::Magnetometer) => {
                (feel.q_nb * own.axis_b.cross(&felt_b(own.sensor, feel)))[of]
            }
            (3..6, Kind::Gyro) => axis_n[of - 3],
            (6..9, Kind::Magnetometer) => axis_n[of - 6],
            _ => 0.0,
        }
    };
    (0..9).map(|of| seen.binned.means(|sample| state(of, sample))).collect()
}
