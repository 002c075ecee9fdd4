//! A log through the filter: what it estimated, step by step, and how it fared.
//!
//! In: the cycles of a unit, for the estimation that flies, or steps of a nine-axis recording, for its filter alone. Out:
//! [`Flight`], with TRIAD beside the filter, every innovation, and against a reference the mean, standard deviation and
//! root mean square of the error about each axis of b, as chapter 6 of the thesis has them.
//!
//! A reference may have another rate or start later: it is interpolated where it has samples on both sides within a step,
//! and what it does not cover is not scored.

use std::collections::BTreeMap;

use emems::{
    attitude::{euler, from_parts},
    derived::{self, Derived},
    estimate::Estimator,
    kalman::{Filter, Innovation, Outcome, Params, Quantity, Step},
    rail::Rail,
    sample::NO_SLOT,
    site::{self, Site},
    triad::{Sighting, triad},
};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::{
    cycles::Cycle,
    recording::{Row, attitude_at},
    score::{Rmse, Score},
    whiteness::Check,
};

/// What the unit's estimation took of what a launch crew told it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Taken {
    /// \[us\] when, by the unit's clock.
    pub at_us: u64,
    /// What it took.
    pub told: CrewWord,
}

/// What a launch crew tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrewWord {
    /// A launch rail, which the attitude took after a cycle.
    Rail(Rail),
    /// A launch site, with which the estimation began afresh before a cycle.
    Site(site::Told),
}

impl Taken {
    /// Whether it was taken before the cycle that began at `start_us`.
    fn is_before(&self, start_us: u64) -> bool {
        match self.told {
            CrewWord::Rail(_) => self.at_us < start_us,
            CrewWord::Site(_) => self.at_us <= start_us,
        }
    }
}

/// One step's estimate.
#[derive(Clone, Debug)]
pub struct EstimatedStep {
    /// \[s\] time of the step.
    pub t_s: f64,
    /// The filter's attitude.
    pub q_nb: UnitQuaternion<f64>,
    /// TRIAD's, from this step's vectors alone, and when they were sampled \[s\].
    pub triad_nb: Option<(f64, UnitQuaternion<f64>)>,
    /// \[rad2\] covariance of the attitude's error as a rotation vector in n.
    pub covariance_n: Matrix3<f64>,
    /// [rad/s] gyro bias.
    pub bias_b: Vector3<f64>,
    /// [m/s2] specific force, if it was sampled.
    pub force_b: Option<Vector3<f64>>,
    /// \[uT\] field, if it was sampled.
    pub field_b_ut: Option<Vector3<f64>>,
    /// What was compared in it.
    pub innovations: Vec<Innovation>,
}

/// A log, estimated.
#[derive(Clone, Debug, Default)]
pub struct Flight {
    /// Every step with an attitude.
    pub estimates: Vec<EstimatedStep>,
    /// Steps refused, by reason.
    pub refused: BTreeMap<String, usize>,
    /// \[s\] when the attitude was found afresh.
    pub aligned_s: Vec<f64>,
    /// Cycles that are, bit for bit, what the unit sent, and those that are not.
    pub replayed: [usize; 2],
    /// Launch rails that the attitude took, and those that it did not: there was no attitude, or they contradict it.
    pub rails: [usize; 2],
    /// Launch sites with which the estimation began afresh.
    pub sites: usize,
}

/// Errors against a reference.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// \[deg\] mean error about each axis of b.
    pub mean_deg: Vector3<f64>,
    /// \[deg\] its standard deviation.
    pub sd_deg: Vector3<f64>,
    /// Root mean squares.
    pub rmse: Rmse,
    /// Root mean squares of TRIAD alone, where it has an attitude.
    pub triad: Option<Rmse>,
    /// Samples compared.
    pub count: usize,
}

impl Flight {
    /// Estimates a nine-axis recording.
    pub fn of(params: Params, steps: impl IntoIterator<Item = Step>) -> Self {
        let mut filter = Filter::new(params);
        let mut flight = Flight::default();
        for step in steps {
            let outcome = filter.step(&step);
            let t_s = step.at_us as f64 * 1e-6;
            flight.note(t_s, &outcome);
            if filter.aligned {
                let [force_b, field_b_ut] =
                    [step.acc, step.mag].map(|sampled| sampled.map(|sampled| sampled.value_b.cast()));
                flight.estimates.push(EstimatedStep {
                    t_s,
                    q_nb: filter.attitude().cast(),
                    triad_nb: alone(&step).map(|q_nb| (t_s, q_nb)),
                    covariance_n: filter.attitude_covariance_n().cast(),
                    bias_b: filter.bias_b.cast(),
                    force_b,
                    field_b_ut,
                    innovations: outcome.innovations.to_vec(),
                });
            }
        }
        flight
    }

    /// Estimates a unit's log as the unit does, with the launch rails and sites that it took, each before the cycle that follows. The
    /// estimator is one at the site that is compiled in.
    pub fn of_unit<'a>(
        mut estimator: Estimator,
        compiled_in: &Site,
        cycles: impl IntoIterator<Item = &'a Cycle>,
        taken: &[Taken],
    ) -> Self {
        let mut flight = Flight::default();
        let mut taken = taken.iter().peekable();
        for cycle in cycles {
            while let Some(next) = taken.next_if(|next| next.is_before(cycle.sample.start_us)) {
                match next.told {
                    CrewWord::Rail(rail) => {
                        let met = estimator.know_nose(&rail.nose(), true);
                        flight.rails[usize::from(met != Some(Ok(())))] += 1;
                    }
                    CrewWord::Site(site) => {
                        estimator.begin_at(&site.site(compiled_in));
                        flight.sites += 1;
                    }
                }
            }
            let (estimate, outcome) = estimator.step_in_full(&cycle.sample, &cycle.increments);
            if let Some(sent) = &cycle.sent {
                let again = Derived { estimate, ..**sent };
                flight.replayed[usize::from(derived::encode(sent) != derived::encode(&again))] += 1;
            }
            flight.note(cycle.increments.end_us as f64 * 1e-6, &outcome);
            let innovations = outcome.innovations.to_vec();
            flight
                .estimates
                .extend(EstimatedStep::of(cycle, &estimate, innovations));
        }
        flight
    }

    fn note(&mut self, t_s: f64, outcome: &Outcome) {
        if let Some(refusal) = outcome.refusal {
            *self.refused.entry(format!("{refusal:?}")).or_default() += 1;
        }
        if outcome.aligned {
            self.aligned_s.push(t_s);
        }
    }

    /// With its times moved by `by_s` \[s\].
    pub fn shifted(mut self, by_s: f64) -> Self {
        for t_s in self
            .estimates
            .iter_mut()
            .map(|estimate| &mut estimate.t_s)
            .chain(&mut self.aligned_s)
        {
            *t_s += by_s;
        }
        for (triad_s, _) in self
            .estimates
            .iter_mut()
            .filter_map(|estimate| estimate.triad_nb.as_mut())
        {
            *triad_s += by_s;
        }
        self
    }

    /// Normalised residuals of a quantity in the order they came, accepted ones only: the gate's tail is not theirs.
    pub fn residuals(&self, quantity: Quantity) -> Vec<f64> {
        let all = self.estimates.iter().flat_map(|estimate| &estimate.innovations);
        all.filter(|record| record.quantity == quantity && record.accepted)
            .map(|record| f64::from(record.residual) / f64::from(record.variance).sqrt())
            .collect()
    }

    /// Size, whiteness and shape of each quantity's innovations.
    pub fn checks(&self) -> Vec<(Quantity, Check)> {
        use Quantity::*;
        let all = [Bias, Velocity, FieldEast, FieldMeridian];
        all.into_iter()
            .filter_map(|quantity| Some((quantity, Check::of(&self.residuals(quantity))?)))
            .collect()
    }

    /// Against the rows of a reference; `None` where they never meet.
    pub fn compare(&self, reference: &[Row]) -> Option<Comparison> {
        let (mut score, mut triad) = (Score::default(), Score::default());
        let mut errors: Vec<Vector3<f64>> = Vec::new();
        for pair in self.estimates.windows(2) {
            let (estimate, step_s) = (&pair[1], pair[1].t_s - pair[0].t_s);
            if let Some(reference_nb) = attitude_at(reference, estimate.t_s, step_s) {
                score.add(&estimate.q_nb, &reference_nb);
                errors.push((reference_nb.inverse() * estimate.q_nb).scaled_axis());
            }
            if let Some((t_s, triad_nb)) = estimate.triad_nb
                && let Some(reference_nb) = attitude_at(reference, t_s, step_s)
            {
                triad.add(&triad_nb, &reference_nb);
            }
        }
        let count = errors.len();
        let mean = errors.iter().sum::<Vector3<f64>>() / count as f64;
        let square = errors
            .iter()
            .map(|error| (error - mean).map(|part| part * part))
            .sum::<Vector3<f64>>();
        Some(Comparison {
            mean_deg: mean.map(f64::to_degrees),
            sd_deg: (square / count as f64).map(|variance| variance.sqrt().to_degrees()),
            rmse: score.rmse()?,
            triad: triad.rmse(),
            count,
        })
    }
}

impl EstimatedStep {
    /// What the unit made of a cycle; `None` without an attitude.
    pub fn of(cycle: &Cycle, estimate: &emems::estimate::Estimate, innovations: Vec<Innovation>) -> Option<Self> {
        let q_nb = estimate.q_nb.and_then(from_parts)?;
        let triad_nb = estimate.triad_nb.and_then(from_parts);
        let [nn, ne, nd, ee, ed, dd] = estimate.covariance_n.map(f64::from);
        let vector = |parts: [f32; 3]| Some(Vector3::from(parts.map(f64::from)));
        Some(EstimatedStep {
            t_s: cycle.increments.end_us as f64 * 1e-6,
            q_nb: q_nb.cast(),
            triad_nb: triad_nb.map(|q_nb| (vectors_s(cycle), q_nb.cast())),
            covariance_n: Matrix3::new(nn, ne, nd, ne, ee, ed, nd, ed, dd),
            bias_b: Vector3::from(estimate.bias_b.map(f64::from)),
            force_b: vector(estimate.force_b),
            field_b_ut: vector(estimate.field_b_ut),
            innovations,
        })
    }

    /// \[deg\] roll, pitch, yaw.
    pub fn euler_deg(&self) -> [f64; 3] {
        euler_deg(&self.q_nb)
    }

    /// \[rad\] standard deviation of the attitude about north, east and down.
    pub fn sd_n(&self) -> Vector3<f64> {
        self.covariance_n.diagonal().map(|variance| variance.max(0.0).sqrt())
    }

    /// \[deg\] standard deviation of roll, pitch and yaw. A small rotation `a` in n turns them by
    /// `roll = (a_N cos yaw + a_E sin yaw)/cos pitch`, `pitch = a_E cos yaw - a_N sin yaw` and
    /// `yaw = a_D + roll sin pitch`; near the vertical roll and yaw grow beyond all bounds, and are cut at half a turn.
    pub fn euler_sd_deg(&self) -> [f64; 3] {
        let [_, pitch, yaw] = self.euler_deg().map(f64::to_radians);
        let (sin, cos) = yaw.sin_cos();
        let roll_row = Vector3::new(cos, sin, 0.0) / pitch.cos().max(f64::MIN_POSITIVE);
        let yaw_row = Vector3::z() + roll_row * pitch.sin();
        [roll_row, Vector3::new(-sin, cos, 0.0), yaw_row].map(|row| {
            let variance = row.dot(&(self.covariance_n * row));
            variance.max(0.0).sqrt().to_degrees().min(180.0)
        })
    }
}

/// \[deg\] roll, pitch, yaw.
pub fn euler_deg(q_nb: &UnitQuaternion<f64>) -> [f64; 3] {
    let euler = euler(&q_nb.cast());
    [euler.roll, euler.pitch, euler.yaw].map(|angle| f64::from(angle).to_degrees())
}

/// \[s\] when a cycle's vectors were sampled: between its accelerometers and its magnetometers.
fn vectors_s(cycle: &Cycle) -> f64 {
    let slots = cycle.sample.slots_us[..8].iter().filter(|slot| **slot != NO_SLOT);
    let (count, sum) = slots.fold((0, 0), |(count, sum), slot| (count + 1, sum + u64::from(*slot)));
    (cycle.sample.start_us + u64::checked_div(sum, count).unwrap_or_default()) as f64 * 1e-6
}

/// TRIAD on one step's vectors, north being magnetic.
fn alone(step: &Step) -> Option<UnitQuaternion<f64>> {
    let sighting = |seen_b, known_n| Sighting {
        seen_b,
        known_n,
        seen_sd: 0.01,
        known_sd: 0.0,
    };
    let down = sighting(-step.acc?.value_b, Vector3::z());
    Some(
        triad(&down, &sighting(step.mag?.value_b, Vector3::x()))
            .ok()?
            .q_nb
            .cast(),
    )
}
