//! A motion whose path and heading are known, whoever made it.
//!
//! In: any [`Motion`] and how long it is followed. Out: [`Followed`]: where its centre is, and how far it has turned about the
//! vertical, whole turns counted. A motion that tells no place has its acceleration integrated from rest, one that tells it is
//! believed. Between the steps of the table the last step is made shorter, by the same rule (Simpson's), so that the path is
//! smooth:
//!
//! ```text
//! p(t+h) = p + h v + h^2/6 (a(t) + 2 a(t+h/2))        v(t+h) = v + h/6 (a(t) + 4 a(t+h/2) + a(t+h))
//! ```

use std::sync::Arc;

use nalgebra::Vector3;
use twin::motion::{Motion, Pose};

/// \[s\] between the entries of the table.
const STEP_S: f64 = 0.01;

/// A motion whose heading is known too.
pub trait Followed: Motion {
    /// \[rad\] turned about the vertical since the start, whole turns counted.
    fn heading_rad(&self, t_s: f64) -> f64;
}

/// Where a followed motion has come to at an entry of the table.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    place_n: Vector3<f64>,
    speed_n: Vector3<f64>,
    heading: f64,
}

impl Entry {
    /// A step further.
    fn after(self, motion: &dyn Motion, t_s: f64, h: f64) -> Entry {
        let [first, middle, last] = [0.0, 0.5, 1.0].map(|part| motion.at(t_s + part * h));
        let turning = |pose: &Pose| (pose.attitude.q_nb * pose.attitude.rate_nb_b).z;
        Entry {
            place_n: self.place_n + h * self.speed_n + h * h / 6.0 * (first.acc_n + 2.0 * middle.acc_n),
            speed_n: self.speed_n + h / 6.0 * (first.acc_n + 4.0 * middle.acc_n + last.acc_n),
            heading: self.heading + h / 6.0 * (turning(&first) + 4.0 * turning(&middle) + turning(&last)),
        }
    }
}

/// Any motion, followed from power-on.
pub struct Follower {
    motion: Arc<dyn Motion>,
    entries: Vec<Entry>,
    tells_place: bool,
}

impl Follower {
    /// Follows a motion for `duration_s`; after that it stands still.
    pub fn new(motion: Arc<dyn Motion>, duration_s: f64) -> Self {
        let steps = (duration_s.max(0.0) / STEP_S).ceil() as usize;
        let mut entries = vec![Entry::default()];
        let mut now = Entry::default();
        let mut tells_place = motion.position_n(0.0) != Vector3::zeros();
        for step in 0..steps {
            let t_s = STEP_S * step as f64;
            tells_place |= motion.position_n(t_s) != Vector3::zeros();
            now = now.after(&*motion, t_s, STEP_S);
            entries.push(now);
        }
        Follower {
            motion,
            entries,
            tells_place,
        }
    }

    fn entry(&self, t_s: f64) -> Entry {
        let at = ((t_s / STEP_S).max(0.0) as usize).min(self.entries.len() - 1);
        let from_s = STEP_S * at as f64;
        match (0.0..STEP_S).contains(&(t_s - from_s)) {
            true => self.entries[at].after(&*self.motion, from_s, t_s - from_s),
            false => self.entries[at],
        }
    }
}

impl Motion for Follower {
    fn at(&self, t_s: f64) -> Pose {
        self.motion.at(t_s)
    }

    fn duration_s(&self) -> Option<f64> {
        self.motion.duration_s()
    }

    fn position_n(&self, t_s: f64) -> Vector3<f64> {
        match self.tells_place {
            true => self.motion.position_n(t_s),
            false => self.entry(t_s).place_n,
        }
    }
}

impl Followed for Follower {
    fn heading_rad(&self, t_s: f64) -> f64 {
        self.entry(t_s).heading
    }
}

#[cfg(test)]
mod tests {
    use twin::motion::{RateTable, Still};

    use super::*;
    use crate::{
        draw::Draw,
        motion::{Style, Wander},
    };

    /// A motion that keeps its place to itself.
    struct Secret(Wander);

    impl Motion for Secret {
        fn at(&self, t_s: f64) -> Pose {
            self.0.at(t_s)
        }
        fn duration_s(&self) -> Option<f64> {
            None
        }
    }

    #[test]
    fn a_place_that_is_not_told_is_integrated() {
        let wander = Wander::draw(Style::Hand, false, 60.0, &mut Draw::new(4));
        let follower = Follower::new(Arc::new(Secret(wander.clone())), 60.0);
        for step in 0..600 {
            let t_s = 0.0917 * f64::from(step);
            let apart = follower.position_n(t_s) - wander.position_n(t_s);
            // Where the envelope has a corner within a step the rule is off by h^2 of the jump in jerk: some 1e-5 m a minute.
            assert!(apart.norm() < 1e-4, "{t_s}: {apart}");
        }
    }

    #[test]
    fn whole_turns_are_counted_and_rest_is_no_turn() {
        let table: Arc<dyn Motion> = Arc::new(RateTable::calibration());
        let end_s = table.duration_s().expect("it ends");
        let follower = Follower::new(table.clone(), end_s);
        let most = (0..(10.0 * end_s) as u32)
            .map(|k| follower.heading_rad(0.1 * f64::from(k)).abs())
            .fold(0.0, f64::max);
        // 200 deg/s for 5 s, and two ramps of a second: 1200 deg.
        assert!((20.0..22.0).contains(&most), "{most}");
        let still = Follower::new(Arc::new(Still::level()), 5.0);
        assert_eq!(still.heading_rad(4.0), 0.0);
    }
}
