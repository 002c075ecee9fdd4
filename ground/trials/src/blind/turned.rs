//! How far off an attitude is that a diagnosis leaves beside its verdict.
//!
//! In: `attitude.csv` of a case (`t_s,qw,qx,qy,qz` first), and true attitudes. Out: root mean square of the turn between both, in degrees, at the true ones'
//! instants, each beside the row that is nearest in time; none where there is no such file, or none of its rows is within a cycle of any.

use std::{fs, path::Path};

use nalgebra::{Quaternion, UnitQuaternion};

use crate::flight::CYCLE_S;

/// \[deg\] of a case's folder.
pub fn error_deg(case: &Path, truth: &[[f64; 5]]) -> Option<f64> {
    let text = fs::read_to_string(case.join("attitude.csv")).ok()?;
    let rows: Vec<[f64; 5]> = text.lines().filter_map(row).collect();
    let off = truth.iter().filter_map(|truth| {
        let near = rows
            .iter()
            .min_by(|one, other| (one[0] - truth[0]).abs().total_cmp(&(other[0] - truth[0]).abs()))?;
        let is_near = (near[0] - truth[0]).abs() < 0.5 * CYCLE_S;
        is_near.then(|| turn(near).angle_to(&turn(truth)).to_degrees().powi(2))
    });
    let off: Vec<f64> = off.collect();
    (!off.is_empty()).then(|| (off.iter().sum::<f64>() / off.len() as f64).sqrt())
}

fn turn([_, w, x, y, z]: &[f64; 5]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(*w, *x, *y, *z))
}

/// The first five numbers of a line; none of a heading.
fn row(line: &str) -> Option<[f64; 5]> {
    let mut numbers = line.split(',').map(|cell| cell.trim().parse::<f64>().ok());
    let mut row = [0.0; 5];
    for own in &mut row {
        *own = numbers.next()??;
    }
    Some(row)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_of_two_degrees_is_off_by_two_degrees_and_no_file_is_off_by_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let half = 1f64.to_radians();
        let truth = [[5.0, 1.0, 0.0, 0.0, 0.0], [900.0, 1.0, 0.0, 0.0, 0.0]];
        assert_eq!(error_deg(folder.path(), &truth), None);
        let text = format!(
            "t_s,qw,qx,qy,qz,sx_deg\n5.0,{},{},0,0,0.1\n5.2,0,1,0,0,0.1\n",
            half.cos(),
            half.sin()
        );
        fs::write(folder.path().join("attitude.csv"), text).expect("a file");
        let off = error_deg(folder.path(), &truth).expect("a row is near");
        assert!((off - 2.0).abs() < 1e-9, "{off}");
    }
}
