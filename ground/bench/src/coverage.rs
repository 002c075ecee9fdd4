//! How much of the sphere a triad was turned through.
//!
//! In: directions. Out: how many fell into each of 6 by 8 cells of equal area (six bands of equal height, eight of
//! longitude), the share of cells with at least one, and where the empty ones lie. The fit itself says by its sigmas
//! what the gaps cost; the map says where to go next.

use nalgebra::Vector3;

/// Bands of equal height, from +z to -z.
pub const BANDS: usize = 6;
/// Sectors of equal longitude, from +x through +y.
pub const SECTORS: usize = 8;

/// Below this share of the cells the sphere counts as not covered: 26 evenly spread positions reach half.
pub const ENOUGH: f64 = 0.4;

/// Points in each cell.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// `counts[band][sector]`.
    pub counts: [[usize; SECTORS]; BANDS],
}

impl Coverage {
    /// Of some directions, of any length but zero.
    pub fn of(directions: impl IntoIterator<Item = Vector3<f64>>) -> Self {
        let mut coverage = Coverage::default();
        for way in directions {
            let Some(way) = way.try_normalize(0.0) else { continue };
            let band = ((1.0 - way.z) / 2.0 * BANDS as f64) as usize;
            let turn = way.y.atan2(way.x).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
            let sector = (turn * SECTORS as f64) as usize;
            coverage.counts[band.min(BANDS - 1)][sector.min(SECTORS - 1)] += 1;
        }
        coverage
    }

    /// Share of cells with a point in them.
    pub fn share(&self) -> f64 {
        let full = self.counts.iter().flatten().filter(|&&count| count > 0).count();
        full as f64 / (BANDS * SECTORS) as f64
    }

    /// Half-spaces with less than half their share of points, in words: `+x`, `-z`.
    pub fn missing(&self) -> Vec<&'static str> {
        let all: usize = self.counts.iter().flatten().sum();
        let centre = |band: usize, sector: usize| {
            let z = 1.0 - (band as f64 + 0.5) * 2.0 / BANDS as f64;
            let (sin, cos) = ((sector as f64 + 0.5) * std::f64::consts::TAU / SECTORS as f64).sin_cos();
            let level = (1.0 - z * z).sqrt();
            Vector3::new(level * cos, level * sin, z)
        };
        let ways = [
            ("+x", 0, 1.0),
            ("-x", 0, -1.0),
            ("+y", 1, 1.0),
            ("-y", 1, -1.0),
            ("+z", 2, 1.0),
            ("-z", 2, -1.0),
        ];
        let within = |axis: usize, sign: f64| -> usize {
            let cells = self
                .counts
                .iter()
                .enumerate()
                .flat_map(|(band, row)| row.iter().enumerate().map(move |cell| (band, cell)));
            cells
                .filter(|(band, (sector, _))| centre(*band, *sector)[axis] * sign > 0.0)
                .map(|(_, (_, count))| count)
                .sum()
        };
        ways.into_iter()
            .filter(|&(_, axis, sign)| 4 * within(axis, sign) < all)
            .map(|(name, ..)| name)
            .collect()
    }

    /// As shades: the fullest cell is dark.
    pub fn map(&self) -> chart::Map {
        let most = self.counts.iter().flatten().max().copied().unwrap_or(0).max(1) as f64;
        let band = |k: usize| format!("z {:+.1}", 1.0 - (k as f64 + 0.5) * 2.0 / BANDS as f64);
        let share = |count: &usize| if *count == 0 { f64::NAN } else { *count as f64 / most };
        chart::Map {
            rows: (0..BANDS).map(band).collect(),
            columns: (0..SECTORS)
                .map(|k| format!("{}°", (2 * k + 1) * 180 / SECTORS))
                .collect(),
            values: self.counts.iter().map(|row| row.iter().map(share).collect()).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evenly_spread_points_cover_all_and_miss_nothing() {
        // Fibonacci sphere.
        let way = |k: u32| {
            let z = 1.0 - (f64::from(k) + 0.5) / 250.0;
            let (sin, cos) = (f64::from(k) * 2.399_963).sin_cos();
            Vector3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z) * 7.0
        };
        let coverage = Coverage::of((0..500).map(way));
        assert_eq!((coverage.share(), coverage.missing()), (1.0, Vec::new()));
    }

    #[test]
    fn a_cap_is_seen_as_one() {
        let way = |k: u32| Vector3::new(0.3 * f64::from(k).cos(), 0.3 * f64::from(k).sin(), -1.0);
        let coverage = Coverage::of((0..100).map(way));
        assert!(coverage.share() < ENOUGH);
        assert_eq!(coverage.missing(), ["+z"]);
        assert_eq!(coverage.counts[..5].iter().flatten().sum::<usize>(), 0);
    }
}
