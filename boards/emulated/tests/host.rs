//! The image on the emulated board and the unit on the host board, in the same world: the same packets.

#[allow(dead_code, reason = "each test file uses its own share of the bench")]
mod bench;

use bench::{MS, Tape, image};
use emems::{packet::PACKET_BYTES, sample::NO_SLOT, unit::Settings};
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

/// Packets that differ between image and host, by number, each with the first byte that differs.
fn differing(motion: &str, duration: Nanos) -> (usize, Vec<(usize, usize)>) {
    let image = on_image(motion, duration, &[]);
    let host = on_host(motion, duration, &[]);
    let bytes = |tape: &Tape| tape.telemetry.iter().map(|(_, byte)| *byte).collect::<Vec<u8>>();
    let (image, host) = (bytes(&image), bytes(&host));
    assert_eq!(image.len(), host.len(), "{motion}");
    let pairs = image.chunks(PACKET_BYTES).zip(host.chunks(PACKET_BYTES)).enumerate();
    let places = pairs.filter_map(|(number, (image, host))| {
        let at = image.iter().zip(host).position(|(image, host)| image != host)?;
        Some((number, at))
    });
    (image.len() / PACKET_BYTES, places.collect())
}

/// A gyro converts every 488 us, and once in twenty packets the image asks for one just after a conversion that the
/// host asks for just before: the two boards' instants agree to some microseconds, not to none.
#[test]
fn host_run_and_image_emit_the_same_packets_but_for_a_conversion_of_a_gyro() {
    /// Bytes of the gyros' values (Tab. A.3).
    const GYROS: std::ops::Range<usize> = 105..121;
    for (motion, duration) in [("tumble", 60_000 * MS), ("rotation-1", 30_000 * MS)] {
        let (packets, places) = differing(motion, duration);
        assert!(places.len() * 20 <= packets, "{motion}: {places:?} of {packets}");
        assert!(places.iter().all(|(_, at)| GYROS.contains(at)), "{motion}: {places:?}");
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
