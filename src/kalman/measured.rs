//! What a window measured, from when it closes until the state is corrected by it.

use nalgebra::Vector3;

use super::{
    field::Compared,
    field_sums::{FieldSums, MeanField},
    state::State,
    window::Means,
};

/// What a window measured.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    pub means: Means,
    /// [rad/s] the bias that rest shows, in b.
    pub bias_b: Option<Vector3<f32>>,
    /// The field, ...
    pub sums: FieldSums,
    /// ... its mean without the iron, ...
    pub field: Option<MeanField>,
    /// ... and against the reference.
    pub compared: Option<Compared>,
    /// `P h'` at the start of the window for what a mean over it sees about each axis of n.
    pub seen: [State; 3],
    /// Whether what says something of the attitude was accepted.
    pub velocity_accepted: Option<bool>,
    pub field_accepted: Option<bool>,
}

impl Measured {
    /// Before the first window.
    pub fn nothing() -> Self {
        Measured {
            means: Means::default(),
            bias_b: None,
            sums: FieldSums::NONE,
            field: None,
            compared: None,
            seen: [State::ZERO; 3],
            velocity_accepted: None,
            field_accepted: None,
        }
    }
}
