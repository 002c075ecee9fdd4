//! How far two calibration sets are apart, in sigma.
//!
//! In: an earlier and a later set. Out: for every channel both have, the change of scale, bias (at the later set's
//! reference temperature) and axis, each over the sigma both sets give it, and the Mahalanobis distance of all its
//! parameters where both have the same ones. Channels only one of them has are named.

use nalgebra::{DMatrix, DVector, Vector3};

use super::{Entry, Set};

/// A change and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Later minus earlier.
    pub change: f64,
    /// Sigma of the change, from both covariances.
    pub sigma: f64,
}

/// The change of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// The channel.
    pub channel: String,
    /// Relative change of scale.
    pub scale: Change,
    /// Change of bias \[counts\].
    pub bias: Change,
    /// Angle between the axes \[rad\]; its sigma is that of a turn about one axis.
    pub axis_rad: Change,
    /// Mahalanobis distance of all parameters and their number; `None` where the sets model temperature differently or
    /// a covariance is singular.
    pub distance: Option<(f64, usize)>,
}

/// What two sets say differently.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diff {
    /// Channels of both.
    pub moved: Vec<Moved>,
    /// Channels of the earlier set only.
    pub gone: Vec<String>,
    /// Channels of the later set only.
    pub come: Vec<String>,
}

impl Change {
    /// The change in sigmas.
    pub fn sigmas(&self) -> f64 {
        if self.change == 0.0 {
            0.0
        } else {
            self.change / self.sigma
        }
    }
}

/// Compares two sets.
pub fn diff(earlier: &Set, later: &Set) -> Diff {
    let find = |set: &Set, name: &str| set.channels.iter().find(|entry| entry.name == name).cloned();
    let mut diff = Diff::default();
    for old in &earlier.channels {
        match find(later, &old.name) {
            Some(new) => diff.moved.push(moved(old, &new)),
            None => diff.gone.push(old.name.clone()),
        }
    }
    let new = later
        .channels
        .iter()
        .filter(|entry| find(earlier, &entry.name).is_none());
    diff.come = new.map(|entry| entry.name.clone()).collect();
    diff
}

fn moved(old: &Entry, new: &Entry) -> Moved {
    let (a, b) = (old.sensitivity(), new.sensitivity());
    let (p, q) = (old.covariance(), new.covariance());
    let along = |s: &Vector3<f64>, p: &DMatrix<f64>| {
        let axis = s.normalize();
        let block = p.fixed_view::<3, 3>(0, 0).into_owned();
        let scale = axis.dot(&(block * axis));
        (scale, (block.trace() - scale).max(0.0) / 2.0)
    };
    let ((scale_p, across_p), (scale_q, across_q)) = (along(&a, &p), along(&b, &q));
    let t = match (old.reference_c, new.reference_c) {
        (Some(old_c), Some(new_c)) => new_c - old_c,
        _ => 0.0,
    };
    let powers = DVector::from_fn(old.bias_counts.len(), |k, _| t.powi(k as i32));
    let bias = old
        .bias_counts
        .iter()
        .zip(&powers)
        .map(|(c, power)| c * power)
        .sum::<f64>();
    let block = p.view((3, 3), (powers.len(), powers.len()));
    let bias_variance = powers.dot(&(block * &powers)) + q[(3, 3)];
    let same = old.parameters().len() == new.parameters().len() && t == 0.0;
    let distance = same.then(|| {
        let change = DVector::from_vec(new.parameters()) - DVector::from_vec(old.parameters());
        let inverse = (p + q).cholesky()?;
        Some((change.dot(&inverse.solve(&change)).sqrt(), change.len()))
    });
    Moved {
        channel: new.name.clone(),
        scale: Change {
            change: b.norm() / a.norm() - 1.0,
            sigma: (scale_p / a.norm_squared() + scale_q / b.norm_squared()).sqrt(),
        },
        bias: Change {
            change: new.bias_counts[0] - bias,
            sigma: bias_variance.sqrt(),
        },
        axis_rad: Change {
            change: a.cross(&b).norm().atan2(a.dot(&b)),
            sigma: (across_p / a.norm_squared() + across_q / b.norm_squared()).sqrt(),
        },
        distance: distance.flatten(),
    }
}
