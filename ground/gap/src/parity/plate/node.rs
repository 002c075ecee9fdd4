//! What a plate does between two nodes: its gyros integrated, its forces and fields summed in n.
//!
//! In: the [`Samples`] of a node, attitude and gyro calibration at its begin. Out: [`Node`], from which one step of the filter is made.

use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};

use super::samples::Samples;

/// What the gyros are off by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Calibration {
    /// [rad/s]
    pub bias: Vector3<f64>,
    /// Scales and cross axes.
    pub matrix: Matrix3<f64>,
}

/// Steps longer than so many usual ones are gaps: one or two lost samples are on the line between their neighbours.
const GAP_STEPS: f64 = 3.5;

/// Sums over one node, in n by the attitude that the gyros carry on.
pub struct Node {
    /// Body to n at its end.
    pub q_nb: UnitQuaternion<f64>,
    /// \[s\] how long it is.
    pub lasts_s: f64,
    /// [m/s] integral of the specific force.
    pub force_n: Vector3<f64>,
    /// [m/s] integral of the size of the specific force.
    pub pushed: f64,
    /// \[rad\] integral of the size of the rate.
    pub angle: f64,
    /// \[rad\] what it may have turned where samples are missing.
    pub missed: f64,
    /// \[s\] integral of the attitude.
    pub turned: Matrix3<f64>,
    /// \[rad\] integral of the attitude times each rate of b: what a matrix of scales and cross axes turns, row by row of it.
    pub by_matrix: SMatrix<f64, 3, 9>,
    /// Mean field in n \[uT\] with mean attitude and mean change of the field \[uT/s\]; none without a sample.
    pub field: Option<(Vector3<f64>, Matrix3<f64>, Vector3<f64>)>,
}

impl Node {
    /// Of the rate samples `from..to`, of which each lasts until the next, in the usual case for so long \[s\].
    pub fn of(
        samples: &Samples,
        (from, to): (usize, usize),
        begin: UnitQuaternion<f64>,
        Calibration { bias, matrix }: Calibration,
        usual_s: f64,
    ) -> Self {
        let t_s = &samples.rates.t_s;
        let mut node = Self {
            q_nb: begin,
            lasts_s: t_s[to] - t_s[from],
            force_n: Vector3::zeros(),
            pushed: 0.0,
            angle: 0.0,
            missed: 0.0,
            turned: Matrix3::zeros(),
            by_matrix: SMatrix::zeros(),
            field: None,
        };
        let fields = &samples.fields;
        let mut field = fields.t_s.partition_point(|own| *own < t_s[from]);
        let (mut seen, mut sum, mut attitude, mut change) = (0, Vector3::zeros(), Matrix3::zeros(), Vector3::zeros());
        for at in from..to {
            let step_s = t_s[at + 1] - t_s[at];
            // The trapezium rule: rate and force are on the line between two samples.
            let measured = 0.5 * (samples.rates.in_b[at] + samples.rates.in_b[at + 1]);
            let force_b = 0.5 * (samples.forces[at] + samples.forces[at + 1]);
            let rate_b = measured - bias - matrix * measured;
            while field < fields.t_s.len() && fields.t_s[field] < t_s[at + 1] {
                let since_s = fields.t_s[field] - t_s[at];
                let dcm = (node.q_nb * UnitQuaternion::from_scaled_axis(rate_b * since_s)).to_rotation_matrix();
                let own = fields.in_b[field];
                seen += 1;
                sum += dcm * own;
                attitude += dcm.matrix();
                change += dcm * rate_b.cross(&own);
                field += 1;
            }
            let middle = node.q_nb * UnitQuaternion::from_scaled_axis(rate_b * (0.5 * step_s));
            let dcm = *middle.to_rotation_matrix().matrix();
            node.force_n += dcm * force_b * step_s;
            node.pushed += force_b.norm() * step_s;
            node.angle += rate_b.norm() * step_s;
            if step_s > GAP_STEPS * usual_s {
                // As far as the rates at both ends differ, or as they are large: neither says what was between.
                node.missed += rate_b
                    .norm()
                    .max((samples.rates.in_b[at + 1] - samples.rates.in_b[at]).norm())
                    * step_s;
            }
            node.turned += dcm * step_s;
            for row in 0..3 {
                for column in 0..3 {
                    let mut own = node.by_matrix.column_mut(3 * row + column);
                    own += dcm.column(row) * (measured[column] * step_s);
                }
            }
            node.q_nb *= UnitQuaternion::from_scaled_axis(rate_b * step_s);
        }
        if seen > 0 {
            let mean = 1.0 / f64::from(seen);
            node.field = Some((sum * mean, attitude * mean, change * mean));
        }
        node
    }
}
