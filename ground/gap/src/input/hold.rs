//! The samples of the hold windows, locked away.
//!
//! In: what [`crate::input::windows`] parts off. Out: how many there are, and to [`crate::holdout::judge`], which judges
//! finished models, what they are. No fit reaches them: `tests/verdicts/rooms.rs` finds whoever else opens them.

use core::fmt;

use crate::input::log::Series;

/// Samples of the hold windows.
#[derive(Clone)]
pub struct Held {
    channels: Vec<Series>,
}

/// How many samples, not which: a derived form would print them.
impl fmt::Debug for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Held")
            .field("counts", &self.counts())
            .finish_non_exhaustive()
    }
}

impl Held {
    /// Takes the samples over.
    pub(crate) fn new(channels: Vec<Series>) -> Self {
        Held { channels }
    }

    /// Samples of each channel: how many, not which.
    pub fn counts(&self) -> Vec<usize> {
        self.channels.iter().map(|series| series.rows.len()).collect()
    }

    /// The samples. Only [`crate::holdout::judge`] may ask for them.
    pub(crate) fn samples(&self) -> &[Series] {
        &self.channels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printing_the_held_samples_prints_none() {
        let series = Series {
            rows: vec![3, 4],
            values: vec![0.123456, 7.5],
        };
        let text = format!("{:?}", Held::new(vec![series]));
        assert!(
            text.contains('2') && !text.contains("7.5") && !text.contains("0.123"),
            "{text}"
        );
    }
}
