//! Whether something magnetic is there, and whether it is fixed to the plate or stays in the room.
//!
//! In: [`Samples`] and the [`Model`] of calibration and room alone. Out: [`Weighed`].
//!
//! A field that is added turns with the plate (iron, a magnet that is attached), or it stays in n (a magnet in the room, near which the
//! unit comes). Both may come and go: a random walk of one of a few sizes, of which the evidence takes the best. Two models that
//! differ in nothing but the frame in which the walk goes are weighed against each other, and against none. Their evidence is that of
//! predictions, each look at the field predicted from those before it.
//!
//! A field that is added and stays the same in n is another heading, and no model.

use nalgebra::UnitQuaternion;

use crate::{
    parity::plate::{
        filter::{Model, Stay, evidence},
        samples::Samples,
    },
    thresholds::ADDED_NATS,
};

/// [uT/sqrt(s)] how far what is added may wander: nothing, and up to a magnet that is attached within seconds, in steps that the evidence
/// tells apart.
const WANDERS: [f64; 4] = [0.0, 0.3, 1.0, 3.0];

/// \[uT\] of what is added, at the begin: as large as the Earth's field.
const ADDED_UT: f64 = 30.0;

/// \[uT\] and \[s\] of the room along which the attitude is told, and of one in which something is fixed to the plate, which wanders by so much
/// [uT/sqrt(s)]. With them the attitude follows the field less than evidence would have it: a room errs alike for as long as the unit
/// stays where it is, which no walk says, and an attitude that follows it is sure of a wrong heading. Chosen
/// with the recordings of docs/gap/without-reference.md in view, whose NEES that page has.
const WARY: [f64; 2] = [6.0, 2.0];
const WARY_OF_PLATE: [f64; 2] = [10.0, 1.0];
const WARY_WANDER: f64 = 1.0;

/// What is added to the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Added {
    /// Fixed to the plate.
    ToPlate,
    /// Stays in the room.
    ToRoom,
}

/// Evidence over that of nothing being there.
#[derive(Clone, Copy, Debug)]
pub struct Weighed {
    /// \[nats\] of what is fixed to the plate, and of what stays in the room.
    pub gains: [f64; 2],
    /// The best model of each.
    models: [Model; 2],
    nothing: Model,
}

impl Weighed {
    /// Of a log.
    pub fn of(
        samples: &Samples,
        begins: &[usize],
        stays: &[Stay],
        begin: UnitQuaternion<f64>,
        nothing: Model,
        progress: &dyn Fn(f64),
    ) -> Self {
        let of = |model: &Model| evidence(samples, begins, stays, begin, model);
        let without = of(&nothing);
        let to_plate = WANDERS.map(|wander| Model {
            iron: [ADDED_UT, wander],
            ..nothing
        });
        let to_room = WANDERS.map(|wander| Model {
            beside: [ADDED_UT, wander],
            ..nothing
        });
        let mut done = 0.0;
        let mut best = |models: &[Model]| {
            let mut best = (f64::NEG_INFINITY, nothing);
            for model in models {
                let gain = of(model) - without;
                if gain > best.0 {
                    best = (gain, *model);
                }
                done += 1.0;
                progress(done / (2 * WANDERS.len()) as f64);
            }
            best
        };
        let (plate, room) = (best(&to_plate), best(&to_room[1..]));
        Self {
            gains: [plate.0, room.0],
            models: [plate.1, room.1],
            nothing,
        }
    }

    /// Of a log without magnetometers: nothing is there that could be seen.
    pub fn unseen(nothing: Model) -> Self {
        Self {
            gains: [0.0; 2],
            models: [nothing; 2],
            nothing,
        }
    }

    /// Whether something is there.
    pub fn is_there(&self) -> bool {
        self.gains[0].max(self.gains[1]) >= ADDED_NATS
    }

    /// What is there, where the log tells it.
    pub fn told(&self) -> Option<Added> {
        let [plate, room] = self.gains;
        if !self.is_there() || (plate - room).abs() < ADDED_NATS {
            return None;
        }
        Some(if plate > room { Added::ToPlate } else { Added::ToRoom })
    }

    /// The model along which what is added is told.
    pub fn model(&self) -> Model {
        let [plate, room] = self.gains;
        match self.is_there() {
            false => self.nothing,
            true => self.models[usize::from(room > plate)],
        }
    }

    /// The model along which the attitude is told.
    pub fn wary(&self) -> Model {
        match self.told() {
            None if self.is_there() => self.with_iron(),
            Some(Added::ToPlate) => self.with_iron(),
            None | Some(Added::ToRoom) => Model {
                place: [self.nothing.place[0].max(WARY[0]), WARY[1]],
                ..self.nothing
            },
        }
    }

    fn with_iron(&self) -> Model {
        Model {
            iron: [ADDED_UT, WARY_WANDER],
            place: WARY_OF_PLATE,
            ..self.nothing
        }
    }
}
