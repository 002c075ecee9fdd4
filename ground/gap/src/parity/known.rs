//! What is known of a motion that nobody recorded: `[motion_known]` of `case.toml`.
//!
//! In: the case. Out: [`Known`], which the smoother takes in as rows once its motion has settled without them ([`Known::is_something`]
//! tells whether there is anything). Each is first held against the motion that the log alone tells; what does not fit is
//! not used, and said.
//!
//! | file | is | is refused when |
//! |---|---|---|
//! | [`track`] (by [`ties`]) | positions that a receiver or a radar saw, on a clock of their own | it has too few fixes of this log, or its fixes are off by more than their sigmas |
//! | [`instants`] | attitudes at some instants, in `case.toml` itself | each that is further off than its sigmas and the log's allow |
//! | [`simulated`] | the trajectory that was simulated before the flight, on the log's clock | it is further off than it is distrusted |

pub mod instants;
pub mod simulated;
pub mod ties;
pub mod track;

use crate::{
    input::case::{CaseError, Opened},
    parity::{
        known::{instants::Instants, simulated::Simulated, track::Fixes},
        phases::Stretch,
    },
};

/// What is known.
#[derive(Clone, Debug, Default)]
pub struct Known {
    /// Of the track.
    pub track: Option<Fixes>,
    /// Of attitudes at some instants.
    pub attitudes: Instants,
    /// Of the trajectory that was simulated.
    pub simulated: Option<Simulated>,
}

impl Known {
    /// Of a case whose log has these phases.
    ///
    /// # Errors
    /// When a file of it cannot be read.
    pub fn open(opened: &Opened, phases: &[Stretch]) -> Result<Self, CaseError> {
        let known = &opened.text.motion_known;
        let track = known.track.as_ref().map(|name| Fixes::open(&opened.path(name)));
        let simulated =
            (known.simulated.as_ref()).map(|name| Simulated::open(&opened.path(name), &known.distrust, phases));
        Ok(Self {
            attitudes: Instants::of(&known.attitudes(&opened.file)?),
            track: track.transpose()?,
            simulated: simulated.transpose()?,
        })
    }

    /// Whether anything is.
    pub fn is_something(&self) -> bool {
        self.track.is_some() || self.simulated.is_some() || !self.attitudes.all.is_empty()
    }
}
