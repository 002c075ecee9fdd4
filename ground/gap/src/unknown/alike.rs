//! Noise that all sensors of a kind have louder than described: the description is off, and not the unit.
//!
//! In: by how much each channel scatters more than described. Out: by how much its whole kind does, which is what the quietest of
//! them has, up to [`NOISE_ALIKE`]. An effect is in some sensors, or is larger in some than in others; what a data sheet or a reference
//! is off by is in all of them. Asked only where the reference is not exact, and of kinds with more sensors than there are axes:
//! of three axes nobody can tell their noise from a motion that was not recorded. It is one factor for all frequencies: of noise that is alike from
//! sample to sample by 0.3 the slow octaves stand out as before.

use twin::predict::{Channel, Kind};

use crate::thresholds::{MISFIT_CALM, NOISE_ALIKE};

/// Axes of a vector.
const AXES: usize = 3;

/// Per channel the factor of its sigma that its whole kind has, 1 where there is none; `scatter` is that of each channel, `None` of one without
/// samples.
pub fn louder(channels: &[Channel], scatter: impl Fn(usize) -> Option<f64>) -> Vec<f64> {
    let of_kind = |kind: Kind| {
        let own = (0..channels.len()).filter(|channel| channels[*channel].sensor == kind);
        let factors: Vec<f64> = own.filter_map(&scatter).collect();
        match factors.len() {
            0..=AXES => 1.0,
            _ => factors.into_iter().fold(NOISE_ALIKE, f64::min).max(1.0),
        }
    };
    channels.iter().map(|channel| of_kind(channel.sensor)).collect()
}

/// Whether noise that is louder in these channels by these factors is louder in every sensor of their kinds, and none of these channels is louder
/// than its kind by more than chance.
pub fn is_described_too_quiet(channels: &[Channel], louder_by: &[(usize, f64)]) -> bool {
    let factor = |channel: usize| {
        let own = louder_by.iter().find(|(of, _)| *of == channel);
        Some(own.map_or(1.0, |(_, factor)| *factor))
    };
    let alike = louder(channels, factor);
    let is_alike = |(channel, factor): &(usize, f64)| {
        let of_kind = alike[*channel];
        of_kind > 1.0 && (factor / of_kind).powi(2) <= MISFIT_CALM
    };
    louder_by.iter().all(is_alike)
}

#[cfg(test)]
mod tests {
    use twin::predict::{emems, thesis_slot_s};

    use super::*;

    /// The channels of the thesis' unit, and which are of this kind.
    fn of(kind: Kind) -> (Vec<Channel>, Vec<usize>) {
        let channels = emems(thesis_slot_s).channels;
        let own = (0..channels.len()).filter(|at| channels[*at].sensor == kind).collect();
        (channels, own)
    }

    fn by(factor: f64, which: &[usize]) -> Vec<(usize, f64)> {
        which.iter().map(|channel| (*channel, factor)).collect()
    }

    #[test]
    fn what_all_have_is_the_descriptions_and_what_some_have_is_not() {
        for kind in [Kind::Accelerometer, Kind::Gyro] {
            let (channels, own) = of(kind);
            assert!(is_described_too_quiet(&channels, &by(1.4, &own)));
            for some in [&own[..1], &own[1..]] {
                assert!(!is_described_too_quiet(&channels, &by(1.4, some)));
                let factor = |channel: usize| Some(if some.contains(&channel) { 1.4 } else { 1.0 });
                assert!(louder(&channels, factor).iter().all(|factor| *factor == 1.0));
            }
        }
    }

    #[test]
    fn what_one_has_beyond_the_others_is_its_own() {
        let (channels, own) = of(Kind::Gyro);
        let mut louder_by = by(1.2, &own);
        louder_by[2].1 = 1.5;
        assert!(!is_described_too_quiet(&channels, &louder_by));
    }

    #[test]
    fn more_than_a_description_may_be_off_is_left() {
        let (channels, own) = of(Kind::Gyro);
        assert!(!is_described_too_quiet(&channels, &by(3.0, &own)));
        assert_eq!(louder(&channels, |_| Some(3.0))[own[0]], NOISE_ALIKE);
    }
}
