//! Which gyro the vectors contradict.

extern crate std;

use nalgebra::UnitQuaternion;
use std::vec::Vec;

use super::V;

/// Directions of the start carried along by each of four rates.
#[derive(Default)]
pub(crate) struct VectorRateModel {
    start: [Option<(V, f64)>; 2],
    turned: [UnitQuaternion<f64>; 4],
    rates: Vec<[V; 4]>,
    elapsed_s: f64,
}

impl VectorRateModel {
    fn begin(&mut self, directions: [Option<(V, f64)>; 2]) {
        (self.start, self.turned, self.elapsed_s) = (directions, Default::default(), 0.0);
    }

    pub(crate) fn pause(&mut self) {
        self.rates.clear();
    }

    pub(crate) fn step(
        &mut self,
        (noise, bias): (f64, f64),
        rates: Option<[V; 4]>,
        dt_s: Option<f64>,
        directions: [Option<(V, f64)>; 2],
    ) -> Option<usize> {
        let (Some(now), Some(dt_s), false) = (rates, dt_s, self.rates.is_empty()) else {
            self.rates = rates.into_iter().collect();
            self.begin(directions);
            return None;
        };
        self.rates.push(now);
        let of_last: Vec<[V; 4]> = self.rates.iter().rev().take(3).copied().collect();
        self.elapsed_s += dt_s;
        for k in 0..4 {
            let mean = match of_last[..] {
                // Adams and Moulton, third order.
                [now, before, earlier] => (now[k] * 5.0 + before[k] * 8.0 - earlier[k]) / 12.0,
                _ => (of_last[0][k] + of_last[1][k]) / 2.0,
            };
            self.turned[k] *= UnitQuaternion::from_scaled_axis(mean * dt_s);
        }
        let mut costs: Vec<(f64, usize)> = (0..4)
            .map(|k| {
                let of_one = self.start.iter().zip(directions).map(|(start, now)| {
                    let (Some((start, before)), Some((now, after))) = (start, now) else {
                        return 0.0;
                    };
                    let variance =
                        before + after + (bias * self.elapsed_s).powi(2) + 2.7 * noise.powi(2) * dt_s * self.elapsed_s;
                    (now - self.turned[k].inverse() * start).norm_squared() / (2.0 * variance)
                });
                (of_one.sum(), k)
            })
            .collect();
        costs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let is_one = costs[0].0 < 12.0 && costs[1].0 > costs[0].0 + 8.0;
        let guilty = (self.elapsed_s >= 2.0 && is_one).then_some(costs[0].1);
        if self.elapsed_s >= 10.0 || guilty.is_some() {
            self.begin(directions);
        }
        guilty
    }
}
