//! What no redundancy can show, in words, and the ground test that would.
//!
//! In: nothing but the physics of one body with several sensors. Out: [`NULLS`]. An effect that is the same in every sensor of a
//! kind is another motion, exactly. The columns of those that have one are free in the fit before anything is sought, so that
//! what linearisation and priors leave of them is no evidence; and none of them is ever named by its columns. Lost packets are found
//! without any, by what the motion does at the loss ([`crate::parity::lost`]).

use twin::effect::Locality;

use crate::{
    library::{
        column::Entries,
        hypotheses::{Hypothesis, Library},
    },
    null::problem::Problem,
};

/// [prior sigmas] how large they may be: as large as an effect may be before it stands for something else.
const FREE: f64 = 20.0;

/// Usual size of a scale, as the library has it.
const SCALE: f64 = 0.01;

/// Something that cannot be seen.
#[derive(Clone, Copy, Debug)]
pub struct Null {
    /// In words.
    pub what: &'static str,
    /// Effects of the library that are nothing else where all sensors of a kind share them.
    pub effects: &'static [&'static str],
    /// The cheapest test on the ground that would settle it.
    pub settled_by: &'static str,
}

/// All of them.
pub const NULLS: &[Null] = &[
    Null {
        what: "a delay of all sensors, or of all of one kind, a clock that runs wrong, a packet time that is off: \
            the motion is simply another one",
        effects: &[
            "latency",
            "gyro-latency",
            "accel-latency",
            "mag-latency",
            "gyro-lag",
            "eddy-current",
            "clock-rate",
            "packet-loss",
        ],
        settled_by: "turn the unit on a table whose angle is logged on the unit's clock, or strike it beside a sensor \
            with a clock of its own",
    },
    Null {
        what: "one rotation of all sensors, or of all of one kind, and one of the frame n: mounting, the table's \
            tilt, the field's direction",
        effects: &["mounting", "table-tilt", "field-model"],
        settled_by: "stand the unit on its six faces on a levelled plate, and turn it about each axis of a table",
    },
    Null {
        what: "a scale or a bias that all sensors of a kind share; gravity against the scale of all accelerometers, \
            the size of the field against that of all magnetometers",
        effects: &[
            "gravity-value",
            "earth-rate",
            "gyro-bias",
            "gyro-scale",
            "accel-bias",
            "accel-scale",
            "accel-range",
            "accel-high-pass",
            "hard-iron",
        ],
        settled_by: "rest in two opposite attitudes tells bias and scale of the accelerometers; a full turn of a table, \
            those of the gyros; a site whose field is surveyed, those of the magnetometers",
    },
    Null {
        what: "a lever arm that all accelerometers share: it is the origin of the track",
        effects: &["lever-arm"],
        settled_by: "turn the unit about two axes through a point that is measured",
    },
    Null {
        what: "what a reference does, for there is none",
        effects: &["reference-rate-scale", "reference-lag", "reference-sign"],
        settled_by: "",
    },
];

/// All of them in words, with the test of each.
pub fn told() -> String {
    let mut out = "What no redundancy can show, and what would:\n".to_owned();
    for null in NULLS {
        out += &format!("- {}.\n", null.what);
        if !null.settled_by.is_empty() {
            out += &format!("  Test: {}.\n", null.settled_by);
        }
    }
    out
}

/// The null that a hypothesis belongs to: one sensor's delay or bias among others is none.
pub fn of(hypothesis: &Hypothesis) -> Option<&'static Null> {
    let is_shared = match hypothesis.cause.locality {
        Locality::Unit | Locality::Common => true,
        // What is there or not is the same in each.
        Locality::All => hypothesis.parameters.is_empty(),
        Locality::Group(_) | Locality::Channel(_) => false,
    };
    let own = NULLS.iter().find(|null| null.effects.contains(&hypothesis.effect()));
    own.filter(|_| is_shared)
}

/// Columns of the nulls that hold for the unit as a whole, for a size that leaves them free.
pub fn columns(problem: &Problem, library: &Library) -> Vec<Entries> {
    let is_whole = |hypothesis: &&Hypothesis| {
        // One that begins at some instant has a column for each.
        let variants = hypothesis.cause.effect.variants(&[0.0, 1.0]).len();
        of(hypothesis).is_some() && variants == 1
    };
    let mut places: Vec<usize> = (library.hypotheses.iter())
        .filter(is_whole)
        .flat_map(|hypothesis| hypothesis.small().to_vec())
        .collect();
    places.sort_unstable();
    places.dedup();
    let free = |place: &usize| -> Entries {
        let size = FREE * library.prior_sigmas[*place];
        let column = library.products.column(*place);
        let column = column.iter();
        column.map(|(channel, values)| (*channel, values * size)).collect()
    };
    let scales = library
        .hypotheses
        .iter()
        .filter_map(|hypothesis| scaled(problem, library, hypothesis));
    places.iter().map(free).chain(scales).collect()
}

/// Two scales of all accelerometers together, which the library has no single place for: of what they read, and of their lever arms. A prior
/// that has a motion without acceleration likelier than any is for a smaller one, and these two are how a motion gets smaller.
fn scaled(problem: &Problem, library: &Library, hypothesis: &Hypothesis) -> Option<Entries> {
    let unit = problem.twin.unit();
    let cause = &hypothesis.cause;
    if cause.locality != Locality::All {
        return None;
    }
    // Of one parameter, by how much it changes in both.
    let change = |index: usize| -> Option<f64> {
        match hypothesis.effect() {
            "accel-scale" => Some(1.0),
            "lever-arm" => {
                let channel = *cause.touched_by(index, unit).first()?;
                Some(unit.channels[channel].lever_m[index % 3])
            }
            _ => None,
        }
    };
    let mut sum: Entries = Vec::new();
    for (index, place) in hypothesis.small().iter().enumerate() {
        let change = FREE * SCALE * change(index)?;
        for (channel, values) in library.products.column(*place).iter() {
            match sum.iter_mut().find(|(own, _)| own == channel) {
                Some((_, sum)) => sum.axpy(change, values, 1.0),
                None => sum.push((*channel, values * change)),
            }
        }
    }
    Some(sum)
}
