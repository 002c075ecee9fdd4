//! The image on the emulated board and the unit on the host board, in the same world: the same packets, byte for byte.

#[allow(dead_code, reason = "each test file uses its own share of the bench")]
mod bench;

use std::{cell::RefCell, rc::Rc, sync::OnceLock};

use bench::{MS, Tape, image};
use emems::{packet::PACKET_BYTES, sample::NO_SLOT, unit::Settings};
use twin::{host, part::Nanos, plant::Plant};

/// \[us\] how far apart the two boards may take the same sensor: the host's timing is that of a line and a constant, and both
/// wait for whole microseconds, sixteen sensors one after another.
const SLOT_TOLERANCE_US: u32 = 8;
/// \[ns\] how far apart a gyro may be asked, and a packet sent.
const CLOCK_TOLERANCE_NS: Nanos = 5_000;

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
fn host_run_and_image_emit_the_same_packets_of_a_minute_of_tumble() {
    the_same_packets("tumble", 60_000 * MS);
}

#[test]
fn host_run_and_image_emit_the_same_packets_of_half_a_minute_of_a_turn() {
    the_same_packets("rotation-1", 30_000 * MS);
}

fn the_same_packets(motion: &str, duration: Nanos) {
    let bytes = |tape: Tape| tape.telemetry.into_iter().map(|(_, byte)| byte).collect::<Vec<u8>>();
    let image = bytes(on_image(motion, duration, &[]));
    let host = bytes(on_host(motion, duration, &[]));
    assert_eq!(image.len(), host.len(), "{motion}");
    let packets = image.chunks(PACKET_BYTES).zip(host.chunks(PACKET_BYTES)).enumerate();
    let differing: Vec<usize> = packets
        .filter(|(_, (image, host))| image != host)
        .map(|(number, _)| number)
        .collect();
    assert!(
        differing.is_empty(),
        "{motion}: packets {differing:?} differ; the timing tests below say why"
    );
}

/// \[ns\] when each gyro's latest frame ended, in the image and on the host, flown for `duration`.
fn latest_frames(duration: Nanos) -> [(Nanos, Nanos); 4] {
    let options = emulated::Options::default();
    let flown = emulated::flight::fly_keeping(&options, image(), plant("still"), &[], duration, &mut Tape::default());
    let (_, on_image) = flown.expect("the image flies");
    let on_host = Rc::new(RefCell::new(plant("still")));
    host::fly_around(&on_host, Settings::NOMINAL, &[], duration, &mut Tape::default());
    let (on_image, on_host) = (on_image.lock(), on_host.borrow());
    std::array::from_fn(|plate| (on_image.gyro[plate].latest_frame(), on_host.gyro[plate].latest_frame()))
}

// A gyro converts every 3.9 ms of its own time. Asked just before that on one board and just after it on the other it answers with
// another conversion, so the instants are compared where the parts see them: a packet's bytes are late by what is done before them.
#[test]
fn both_boards_ask_the_gyros_at_the_same_time() {
    // After a fast sample, and after a cycle.
    for duration in [349 * MS, 356 * MS] {
        for (plate, (image, host)) in latest_frames(duration).into_iter().enumerate() {
            assert!(
                duration - image < 3 * MS && image.abs_diff(host) <= CLOCK_TOLERANCE_NS,
                "gyro {}: its frame before {duration} ns ends at {image} ns on the image, at {host} ns on the host: \
                 twin::host::timing::BOOT or SPI_OVERHEAD is not this image's",
                plate + 1
            );
        }
    }
}

/// Four seconds at rest with derived frames, on the image and on the host.
fn both() -> &'static [Tape; 2] {
    static BOTH: OnceLock<[Tape; 2]> = OnceLock::new();
    BOTH.get_or_init(|| {
        let script = [(MS, b"G_DL".to_vec())];
        [on_image, on_host].map(|on| on("still", 4_000 * MS, &script))
    })
}

#[test]
fn both_boards_send_at_the_same_time() {
    let [image, host] = both().each_ref().map(|tape| tape.packets()[0].0);
    assert!(
        image.abs_diff(host) <= CLOCK_TOLERANCE_NS,
        "the first packet is out at {image} ns on the image, at {host} ns on the host: \
         twin::host::timing::UART_START is not this image's, if the gyros are asked at the same time"
    );
}

#[test]
fn both_boards_take_each_sensor_at_the_same_time() {
    let [image, host] = both().each_ref().map(Tape::derived);
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
