//! The image on the emulated board and the unit on the host board, in the same world: the same packets.

#[allow(dead_code, reason = "each test file uses its own share of the bench")]
mod bench;

use bench::{MS, Tape, image};
use emems::{sample::NO_SLOT, unit::Settings};
use twin::{host, part::Nanos, plant::Plant};

/// [us] how far apart the two boards may take the same sensor: the host's timing is that of a line and a constant.
const SLOT_TOLERANCE_US: u32 = 12;

fn plant(motion: &str) -> Plant {
    Plant::new(bench::world(motion), 7)
}

fn on_image(motion: &str, duration: Nanos, script: &[(Nanos, Vec<u8>)]) -> Tape {
    let mut tape = Tape {
        script: script.to_vec(),
        ..Tape::default()
    };
    emulated::fly(image(), plant(motion), &[], duration, &mut tape).expect("the image flies");
    tape
}

fn on_host(motion: &str, duration: Nanos, script: &[(Nanos, Vec<u8>)]) -> Tape {
    let mut tape = Tape {
        script: script.to_vec(),
        ..Tape::default()
    };
    host::fly(plant(motion), Settings::NOMINAL, &[], duration, &mut tape);
    tape
}

#[test]
fn host_run_and_image_emit_the_same_packets_byte_for_byte() {
    for (motion, duration) in [("tumble", 60_000 * MS), ("rotation-1", 30_000 * MS)] {
        let image = on_image(motion, duration, &[]);
        let host = on_host(motion, duration, &[]);
        let bytes = |tape: &Tape| tape.telemetry.iter().map(|(_, byte)| *byte).collect::<Vec<u8>>();
        let (image, host) = (bytes(&image), bytes(&host));
        let differ = image.iter().zip(&host).position(|(image, host)| image != host);
        let place = differ.map(|at| (at / 156, at % 156));
        assert_eq!(
            place,
            None,
            "{motion}: packet and byte; of {} and {} bytes",
            image.len(),
            host.len()
        );
        assert_eq!(image.len(), host.len(), "{motion}");
    }
}

#[test]
fn both_boards_take_each_sensor_at_the_same_time() {
    let script = [(MS, b"G_DL".to_vec())];
    let image = on_image("still", 4_000 * MS, &script);
    let host = on_host("still", 4_000 * MS, &script);
    let (image, host) = (image.derived(), host.derived());
    assert!(image.len() > 10 && image.len() == host.len());
    for (image, host) in image.iter().zip(&host).skip(2) {
        assert_eq!(image.start_us.abs_diff(host.start_us), 0);
        for (image_us, host_us) in image.slots_us.iter().zip(host.slots_us) {
            assert!(
                *image_us != NO_SLOT && image_us.abs_diff(host_us) <= SLOT_TOLERANCE_US,
                "{image_us} {host_us}"
            );
        }
    }
}
