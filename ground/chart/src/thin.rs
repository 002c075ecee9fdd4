//! Points thinned to what can be seen, without losing a peak.
//!
//! In: the marks of a layer, and where values are drawn on the axes. Out: [`Point`]s in the order of x, at most two a stretch
//! and one break. Where there are more points than `2 * stretches`, each stretch of equally many points gives its least and its
//! most, in the order they came, at the first and the middle x of the stretch; so layers that were sampled together stay on the same x.
//! A stretch that holds a break ends with one.

use crate::{Marks, Panel};

/// Stretches of a layer in a plot that zooms: sixteen minutes of flight, packet for packet.
pub const LIVE: usize = 2_400;

/// Stretches of a layer in a picture: a point to half a unit of its width.
pub const PICTURE: usize = 500;

/// A point in drawing units; `low` and `high` are the same for lines and dots, and NaN for a break.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub x: f64,
    pub low: f64,
    pub high: f64,
}

impl Point {
    fn is_break(&self) -> bool {
        !(self.low.is_finite() && self.high.is_finite())
    }
}

/// Points of marks that have values, in drawing units; a point that cannot be drawn is a break.
pub fn points(marks: &Marks, panel: &Panel) -> Vec<Point> {
    let mut last = f64::NAN;
    let mut place = |x: f64, low: f64, high: f64| {
        let at = panel.x.place(x);
        let point = Point {
            x: if at.is_finite() { at } else { last },
            low: if at.is_finite() { panel.y.place(low) } else { f64::NAN },
            high: panel.y.place(high),
        };
        last = point.x;
        point
    };
    let all: Vec<Point> = match marks {
        Marks::Line(points) | Marks::Dashes(points) | Marks::Dots(points) => {
            points.iter().map(|(x, y)| place(*x, *y, *y)).collect()
        }
        Marks::Bars(points) => points.iter().map(|(x, y)| place(*x, y.min(0.0), y.max(0.0))).collect(),
        Marks::Band(points) | Marks::Whiskers(points) => {
            points.iter().map(|(x, low, high)| place(*x, *low, *high)).collect()
        }
        Marks::Spans(_) | Marks::Strip(_) | Marks::Instants(_) => Vec::new(),
    };
    // Breaks before the first point have no place.
    let mut all: Vec<Point> = all.into_iter().filter(|point| point.x.is_finite()).collect();
    if matches!(marks, Marks::Dots(_) | Marks::Whiskers(_) | Marks::Bars(_)) {
        all.sort_by(|one, other| one.x.total_cmp(&other.x));
    }
    all
}

/// The same, at most two points and a break in each of `stretches`. A band has one point a stretch.
pub fn thinned(points: Vec<Point>, stretches: usize) -> Vec<Point> {
    if points.len() <= 2 * stretches {
        return points;
    }
    let length = points.len().div_ceil(stretches);
    points.chunks(length).flat_map(stretch).collect()
}

fn stretch(part: &[Point]) -> impl Iterator<Item = Point> {
    let drawn = || part.iter().enumerate().filter(|(_, point)| !point.is_break());
    let least = drawn().min_by(|(_, one), (_, other)| one.low.total_cmp(&other.low));
    let most = drawn().max_by(|(_, one), (_, other)| one.high.total_cmp(&other.high));
    let [first_x, middle_x] = [part[0].x, part[part.len() / 2].x];
    let kept = match (least, most) {
        (Some((_, least)), Some((_, most))) if least.low < least.high || most.low < most.high => {
            // A band, whiskers or bars.
            [Some((middle_x, least.low, most.high)), None]
        }
        (Some((at, least)), Some((later, most))) => {
            let [one, other] = if at <= later { [least, most] } else { [most, least] };
            [
                Some((first_x, one.low, one.high)),
                Some((middle_x, other.low, other.high)),
            ]
        }
        _ => [None, None],
    };
    let broken = part
        .iter()
        .any(Point::is_break)
        .then(|| (part[part.len() - 1].x, f64::NAN, f64::NAN));
    (kept.into_iter().chain([broken]).flatten()).map(|(x, low, high)| Point { x, low, high })
}

/// Whether lines can go through: from left to right.
pub fn goes_back(points: &[Point]) -> Option<usize> {
    points
        .windows(2)
        .position(|pair| pair[1].x < pair[0].x)
        .map(|at| at + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(values: impl IntoIterator<Item = f64>) -> Vec<Point> {
        let each = values.into_iter().enumerate();
        each.map(|(k, y)| Point {
            x: k as f64,
            low: y,
            high: y,
        })
        .collect()
    }

    #[test]
    fn a_peak_among_a_million_stays_and_so_does_a_gap() {
        let mut all = line((0..1_000_000).map(|k| f64::from(k % 7)));
        all[654_321].low = 1e3;
        all[654_321].high = 1e3;
        for point in &mut all[300_000..310_000] {
            point.low = f64::NAN;
        }
        let kept = thinned(all, LIVE);
        assert!(kept.len() <= 3 * LIVE, "{}", kept.len());
        let peak = kept.iter().find(|point| point.high == 1e3).expect("the peak");
        assert!((peak.x - 654_321.0).abs() < 1_000_000.0 / LIVE as f64);
        assert!(
            kept.iter()
                .any(|point| point.is_break() && (300_000.0..311_000.0).contains(&point.x))
        );
        assert!(
            !kept
                .iter()
                .any(|point| !point.is_break() && (300_500.0..309_500.0).contains(&point.x))
        );
        assert_eq!(goes_back(&kept), None);
    }

    #[test]
    fn layers_sampled_together_stay_on_the_same_x() {
        let x = |points: Vec<Point>| points.iter().map(|point| point.x).collect::<Vec<_>>();
        let one = x(thinned(line((0..50_000).map(f64::from)), 100));
        let other = x(thinned(line((0..50_000).map(|k| -f64::from(k % 13))), 100));
        assert_eq!(one, other);
    }

    #[test]
    fn few_points_are_left_as_they_are() {
        let few = line([1.0, f64::NAN, 3.0]);
        assert_eq!(thinned(few.clone(), 500).len(), few.len());
    }
}
