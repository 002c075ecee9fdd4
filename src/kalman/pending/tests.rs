//! The scalars of a window, two or four at a time, against one after the other.

use super::*;
use crate::{draws::Draws, kalman::Params};

#[test]
fn however_many_scalars_there_are_all_are_taken_off() {
    for pace in [Pace::Small, Pace::Large] {
        for count in 0..=INNOVATIONS {
            let mut draws = Draws::of(count as u64);
            let mut pending = Pending::nothing();
            pending.passage.velocity_sd = 0.5;
            for seen in &mut pending.seen {
                let column = State {
                    driven: core::array::from_fn(|_: usize| draws.within(-0.3, 0.3)),
                    drivers: core::array::from_fn(|_: usize| draws.within(-0.01, 0.01)),
                };
                *seen = Seen { column, variance: 2.0 };
            }
            (pending.scalars, pending.stage) = (count, Stage::Passage);
            let (mut found, mut expected) = (Covariance::new(&Params::ROOM), Covariance::new(&Params::ROOM));
            // The passage is one in which nothing happened, the velocity's columns those of the covariance.
            for axis in 0..2 {
                pending.velocity[axis] = expected.of_driven(3 + axis);
            }
            let mut stages = 0;
            while !pending.is_done() {
                pending.work(&mut found, pace);
                stages += 1;
            }
            for seen in &pending.seen[..count] {
                expected.update(seen, &Seen::NOTHING);
            }
            assert_eq!(found.matrix(), expected.matrix(), "{pace:?} {count}");
            let expected = match pace {
                Pace::Small => 1 + count.div_ceil(2),
                // The passage is as much work as two.
                Pace::Large => 1 + count.saturating_sub(2).div_ceil(4),
            };
            assert_eq!(stages, expected, "{pace:?} {count}");
        }
    }
}
