//! WAIT and FLIGHT, and what survives a reset of them.

/// The unit's mode (thesis: ESPERA, VOO; App. A.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Mode {
    /// On the pad: everything may be asked for.
    #[default]
    Wait,
    /// In flight: recording may be started, nothing may be erased.
    Flight,
}

/// What the unit was doing when a reset struck.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Resume {
    /// Mode to return to.
    pub mode: Mode,
    /// Whether packets were being recorded.
    pub recording: bool,
    /// Counter of the next packet.
    pub next_counter: u16,
    /// Resets since power-on.
    pub resets: u16,
}
