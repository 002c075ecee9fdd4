//! Ring R0m: nothing is wrong, but the description is a little.
//!
//! In: chance. Out: [`Loose`]: how reference, noise, field and calibration really are, and what the case says of them. The reference's
//! attitude errs slowly (a sum of tones whose periods lie about the correlation time, so that it has a rate), sensors are quieter or
//! louder than declared and coloured, iron in the room makes a gradient of up to half of the declared field sigma over the unit, and the
//! sigmas of the calibration are half or twice what they are. A diagnosis must find nothing in it that is worth a name.

use std::{f64::consts::TAU, sync::Arc};

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use twin::{geometry, part::signal::Noise};

use crate::{
    draw::Draw,
    scene::{Scene, changed},
};

/// Tones of a slow error.
const TONES: usize = 12;

/// \[s\] at which coloured noise has its nodes.
const NODE_S: f64 = 0.3;

/// \[m\] from the centre to the plates' magnetometers, about.
const PLATE_M: f64 = 0.05;

/// How loosely a case is described.
#[derive(Clone, Debug)]
pub struct Loose {
    /// \[rad\] of the reference's slow error, and \[s\] over which it stays alike.
    attitude: (f64, f64),
    /// The same as the case has it.
    pub attitude_sigma_rad: f64,
    /// \[s\]
    pub attitude_correlation_s: f64,
    /// Noise as declared over what it is.
    pub noise: f64,
    /// Sigmas of the calibration as declared over what they are.
    pub calibration: f64,
    /// Part of the noise's variance that is added once more, coloured.
    coloured: f64,
    /// \[uT\] how well the field is said to be known.
    pub field_sigma_ut: f64,
    /// Part of that which the gradient makes over the unit.
    gradient: f64,
}

impl Loose {
    /// A draw.
    pub fn draw(draw: &mut Draw) -> Self {
        let (sigma, correlation_s) = (draw.log_uniform(5e-4, 3e-3), draw.log_uniform(5.0, 60.0));
        Loose {
            attitude: (sigma, correlation_s),
            attitude_sigma_rad: sigma * draw.log_uniform(0.67, 1.5),
            attitude_correlation_s: 20.0,
            noise: 1.0 / draw.uniform(0.5, 1.5),
            calibration: if draw.chance(0.5) { 0.5 } else { 2.0 },
            coloured: draw.uniform(0.0, 0.3),
            field_sigma_ut: draw.uniform(0.2, 0.6),
            gradient: draw.uniform(0.0, 0.5),
        }
    }

    /// Makes a scene so.
    pub fn apply(&self, scene: &mut Scene, draw: &mut Draw) {
        let (sigma, correlation_s) = self.attitude;
        let tones: Vec<(Vector3<f64>, f64, f64)> = (0..TONES)
            .map(|_| {
                let size = sigma * (2.0 / TONES as f64).sqrt();
                let period_s = correlation_s * draw.log_uniform(1.0, 6.0);
                (size * draw.vector(), TAU / period_s, draw.uniform(0.0, TAU))
            })
            .collect();
        let record = scene.record.clone();
        scene.record = Arc::new(move |t_s| {
            let (q_nb, place_n) = record(t_s);
            let turn_n: Vector3<f64> = tones
                .iter()
                .map(|(size, rate, phase)| size * (rate * t_s + phase).sin())
                .sum();
            (UnitQuaternion::from_scaled_axis(turn_n) * q_nb, place_n)
        });
        // Free of sources and curl: symmetric and without trace [uT/m].
        let half: Matrix3<f64> = Matrix3::from_fn(|_, _| draw.normal());
        let whole = half + half.transpose();
        let whole = whole - Matrix3::identity() * (whole.trace() / 3.0);
        let gradient_n = whole * (self.gradient * self.field_sigma_ut / PLATE_M / whole.norm());
        let noise = Noise::new(draw.uniform(0.0, 1e15) as u64);
        for plate in 0..geometry::PLATES {
            let (dcm_pb, place_b) = (
                geometry::dcm_bp(plate).transpose(),
                geometry::accelerometer_place_b(plate),
            );
            let (motion, hum) = (scene.motion.clone(), self.hum(&noise, plate, 0.2));
            scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
                let q_nb = motion.at(t).attitude.q_nb;
                let here_n = gradient_n * (motion.position_n(t) + q_nb * place_b);
                field + dcm_pb * (q_nb.inverse() * here_n) + hum(t)
            });
            let hum = self.hum(&noise, 8 + plate, 0.045);
            scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| force + hum(t));
            let hum = self.hum(&noise, 16 + plate, 0.003_44);
            scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| rate + hum(t).x);
        }
    }

    /// Coloured noise of a sensor with this white sigma: normal at nodes, straight between.
    fn hum(&self, noise: &Noise, stream: usize, sigma: f64) -> impl Fn(f64) -> Vector3<f64> + Send + Sync + use<> {
        let size = sigma * self.coloured.sqrt();
        let axes: [Noise; 3] = std::array::from_fn(|axis| noise.stream((4 * stream + axis) as u64));
        move |t_s| {
            let place = (t_s / NODE_S).max(0.0);
            let (node, part) = (place as u64, place.fract());
            Vector3::from_fn(|axis, _| {
                let own = &axes[axis];
                size * (own.normal(node) * (1.0 - part) + own.normal(node + 1) * part)
            })
        }
    }

    /// What case.toml says of reference and field besides.
    pub fn case_toml(&self) -> (String, String) {
        (
            format!("field_sigma_ut = {:.3}\n", self.field_sigma_ut),
            format!(
                "\n[reference]\nattitude_sigma_rad = {:.6}\nattitude_correlation_s = {:.1}\n",
                self.attitude_sigma_rad, self.attitude_correlation_s
            ),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_error_is_as_large_as_drawn_and_nothing_else_of_the_record_changes() {
        let mut draw = Draw::new(8);
        let mut loose = Loose::draw(&mut draw);
        loose.attitude = (2e-3, 10.0);
        let wander = crate::motion::Wander::draw(crate::motion::Style::Table, false, 600.0, &mut draw);
        let mut scene = Scene::new(
            wander,
            twin::environment::Environment::laboratory(),
            &mut draw.stream(1),
        );
        let before = scene.record.clone();
        loose.apply(&mut scene, &mut draw);
        let off = |t_s: f64| (scene.record)(t_s).0 * before(t_s).0.inverse();
        let mean: f64 = (0..6000).map(|k| off(0.1 * f64::from(k)).angle().powi(2)).sum::<f64>() / 6000.0;
        // Three axes of 2 mrad.
        assert!(
            (mean.sqrt() / (2e-3 * 3f64.sqrt()) - 1.0).abs() < 0.4,
            "{}",
            mean.sqrt()
        );
        assert_eq!((scene.record)(3.0).1, before(3.0).1);
        // Slow: in a tenth of a second a small part of it.
        let step = (off(100.1) * off(100.0).inverse()).angle();
        assert!(step < 5e-4, "{step}");
    }
}
