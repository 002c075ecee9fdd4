//! A flight's estimation made again from what was sent.
//!
//! In: the packets and derived frames of a flight. Out: the cycles whose frame is not, bit for bit, what is made of it again.

use emems::{
    derived::{self, Derived},
    estimate::Estimate,
    sample::Sample,
};

use crate::Flown;

/// Those cycles, by their counters; `estimate` is given each frame and its cycle in their order.
pub fn differing(flown: &Flown, mut estimate: impl FnMut(&Derived, &Sample) -> Estimate) -> Vec<u16> {
    let mut differing = Vec::new();
    for frame in &flown.derived {
        let packet = flown.packets.iter().find(|(_, packet)| packet.counter == frame.counter);
        let sample = Sample {
            reading: packet.expect("its packet").1,
            start_us: frame.start_us,
            slots_us: frame.slots_us,
        };
        let again = Derived {
            estimate: estimate(frame, &sample),
            ..*frame
        };
        if derived::encode(frame) != derived::encode(&again) {
            differing.push(frame.counter);
        }
    }
    differing
}
