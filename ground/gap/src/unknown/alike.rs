//! Noise that all sensors of a kind have louder than described: the description is off, and not the unit.
//!
//! In: by how much each channel scatters more than described. Out: by how much all of its kind do, which is what the quieter quarter of
//! them has, up to [`NOISE_ALIKE`]. An effect is in some sensors, or is larger in some than in others; what a data sheet or a reference
//! is off by is in all of them. Asked only where the reference is not exact, and of kinds with more sensors than there are axes:
//! of three axes nobody can tell their noise from a motion that was not recorded.

use twin::predict::{Channel, Kind};

use crate::thresholds::NOISE_ALIKE;

/// Axes of a vector.
const AXES: usize = 3;

/// Per channel the factor that its whole kind has, 1 where there is none; `scatter` is that of each channel, `None` of one without samples.
pub fn louder(channels: &[Channel], scatter: impl Fn(usize) -> Option<f64>) -> Vec<f64> {
    let of_kind = |kind: Kind| {
        let own = (0..channels.len()).filter(|channel| channels[*channel].sensor == kind);
        let mut factors: Vec<f64> = own.filter_map(&scatter).collect();
        factors.sort_by(f64::total_cmp);
        match factors.len() {
            0..=AXES => 1.0,
            many => factors[many / 4].clamp(1.0, NOISE_ALIKE),
        }
    };
    channels.iter().map(|channel| of_kind(channel.sensor)).collect()
}

/// Whether noise that is louder in some channels, by these factors, is so in all of their kinds and by no more than a description may be off.
pub fn is_described_too_quiet(channels: &[Channel], louder_by: &[(usize, f64)]) -> bool {
    let factor = |channel: usize| {
        let own = louder_by.iter().find(|(of, _)| *of == channel);
        Some(own.map_or(1.0, |(_, factor)| *factor))
    };
    let alike = louder(channels, factor);
    louder_by
        .iter()
        .all(|(channel, _)| (1.0 + f64::EPSILON..NOISE_ALIKE).contains(&alike[*channel]))
}

#[cfg(test)]
mod tests {
    use twin::predict::{emems, thesis_slot_s};

    use super::*;

    fn of(kind: Kind) -> Vec<usize> {
        let channels = emems(thesis_slot_s).channels;
        (0..channels.len()).filter(|at| channels[*at].sensor == kind).collect()
    }

    #[test]
    fn what_one_plate_has_is_no_noise_of_its_kind() {
        let channels = emems(thesis_slot_s).channels;
        let own = of(Kind::Accelerometer);
        let (plate, all) = (&own[..3], &own[..]);
        let by = |which: &[usize]| which.iter().map(|channel| (*channel, 1.4)).collect::<Vec<_>>();
        assert!(!is_described_too_quiet(&channels, &by(plate)));
        assert!(is_described_too_quiet(&channels, &by(all)));
        let factor = |channel: usize| Some(if plate.contains(&channel) { 3.0 } else { 1.0 });
        assert!(louder(&channels, factor).iter().all(|factor| *factor == 1.0));
    }

    #[test]
    fn more_than_a_description_may_be_off_is_left() {
        let channels = emems(thesis_slot_s).channels;
        let own = of(Kind::Gyro);
        let by: Vec<_> = own.iter().map(|channel| (*channel, 3.0)).collect();
        assert!(!is_described_too_quiet(&channels, &by));
        assert_eq!(louder(&channels, |_| Some(3.0))[own[0]], NOISE_ALIKE);
    }
}
