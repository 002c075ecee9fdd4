//! The plant and the fast prediction: one truth, two ways to a count, and no more than the rounding between them.
//!
//! The parts convert by their own clocks, and a read finds the last conversion; the prediction is asked for that instant.

use super::*;
use crate::channel::UnitDescription;
use crate::environment::{Environment, World};
use crate::motion::{Motion, RateTable, RotationTest, SoundingRocket, Still, Tumble};
use crate::part::signal::ConversionClock;
use crate::predict::{Scene, Twin, emems};

/// \[counts\] half a count of rounding, and the parts' own low-pass: it takes its input as straight between conversions, which is
/// off by h^2 u''/12, 0.03 counts where the rocket spins at three turns a second.
const ROUNDING: f64 = 0.5 + 0.03;

/// \[ns\] between conversions as [`configured`] sets them: 400, 75, 256 and 4 Hz.
const ACCELEROMETER_NS: u64 = 2_500_000;
const MAGNETOMETER_NS: u64 = 13_333_333;
const GYRO_NS: u64 = 3_906_250;
const THERMOMETER_NS: u64 = 250_000_000;

/// The clock of a part of the ideal plant.
fn clock<const N: usize>(period_ns: u64, of: Spread, stream: Noise) -> ConversionClock {
    let specimen: Specimen<N> = Quality::IDEAL.draw(of, stream);
    ConversionClock::paced(period_ns, specimen.pace)
}

/// Largest difference \[counts\] between what the plant's registers say and the prediction, over all 36 channels.
fn worst<M: Motion + Clone + 'static>(motion: M, environment: Environment, from_s: f64, to_s: f64) -> f64 {
    let scene = Scene::new(&motion, &environment, from_s - 5.0, to_s + 5.0, 0.002);
    let mut plant = configured(Plant::ideal(Arc::new(World { motion, environment })));
    let seeds = Noise::new(0);
    let unit = emems(|_| 0.0);
    let mut worst: f64 = 0.0;
    for plate in 0..PLATES {
        let (i2c, spi) = (seeds.stream(plate as u64), seeds.stream((PLATES + plate) as u64));
        let clocks = [
            clock::<3>(ACCELEROMETER_NS, ACCELEROMETER, i2c.stream(0)),
            clock::<3>(MAGNETOMETER_NS, MAGNETOMETER, i2c.stream(1)),
            clock::<1>(GYRO_NS, GYRO, spi.stream(0)),
            clock::<1>(THERMOMETER_NS, THERMOMETER, i2c.stream(2)),
        ];
        let reads: Vec<Nanos> = (0..)
            .map(|k| (from_s * 1e9) as Nanos + k * 97 * MS)
            .take_while(|now| *now < (to_s * 1e9) as Nanos)
            .collect();
        let number = plate + 1;
        // Chip by chip: its channels, its clock, its counts at each read.
        let mut check = |names: Vec<String>, clock: ConversionClock, counts: Vec<Vec<i16>>| {
            let channels = names
                .iter()
                .map(|name| unit.channels[unit.channel(name).unwrap()].clone())
                .collect();
            let chip = UnitDescription {
                channels,
                ..unit.clone()
            };
            let instants_s = reads
                .iter()
                .map(|&now| clock.instant_ns(clock.latest(now)) as f64 * 1e-9)
                .collect();
            let twin = Twin::new(chip, environment, scene.clone(), instants_s).unwrap();
            for (axis, predicted) in twin.predict(&[]).into_iter().enumerate() {
                for (predicted, counts) in predicted.iter().zip(&counts) {
                    let off = (predicted / twin.unit().channels[axis].lsb - f64::from(counts[axis])).abs();
                    worst = worst.max(off);
                }
            }
        };
        let axes = |letter: &str| ["x", "y", "z"].map(|axis| format!("{letter}{number}{axis}")).to_vec();
        let forces = reads
            .iter()
            .map(|&now| acc(&mut plant, plate, now).unwrap().to_vec())
            .collect();
        check(axes("a"), clocks[0], forces);
        let fields = reads.iter().map(|&now| {
            let bytes: [u8; 6] = read(&mut plant, plate, 0x1E, 0x03, now).unwrap();
            [0, 4, 2].map(|i| i16::from_be_bytes([bytes[i], bytes[i + 1]])).to_vec()
        });
        check(axes("m"), clocks[1], fields.collect());
        let turning = reads.iter().map(|&now| {
            // Each frame answers the one before it.
            frame(&mut plant, plate, 0x0400, now);
            let turns = frame(&mut plant, plate, 0x0C00, now + 10_000);
            let warmth = frame(&mut plant, plate, 0x0000, now + 20_000);
            vec![(turns << 2) as i16 >> 2, (warmth << 4) as i16 >> 4]
        });
        check(
            vec![format!("g{number}"), format!("tg{number}")],
            clocks[2],
            turning.collect(),
        );
        let outside = reads.iter().map(|&now| {
            let bytes: [u8; 2] = read(&mut plant, plate, 0x48, 0x00, now).unwrap();
            vec![i16::from_be_bytes(bytes) >> 4]
        });
        check(vec![format!("t{number}")], clocks[3], outside.collect());
    }
    worst
}

#[test]
fn registers_and_prediction_agree_within_half_a_count_on_every_motion() {
    let laboratory = Environment::laboratory();
    let alcantara = Environment::alcantara();
    let rocket = SoundingRocket::new(30.0, alcantara.gravity);
    let found = [
        ("still", worst(Still::level(), laboratory, 2.0, 6.0)),
        ("tumble", worst(Tumble::new(), laboratory, 12.0, 32.0)),
        ("rotation 2", worst(RotationTest::second(), laboratory, 10.0, 30.0)),
        ("rate table", worst(RateTable::calibration(), laboratory, 10.0, 40.0)),
        ("boost", worst(rocket.clone(), alcantara, 29.0, 36.0)),
        ("coast", worst(rocket, alcantara, 70.0, 85.0)),
    ];
    for (motion, worst) in found {
        println!("{motion}: {worst:.4} counts");
        assert!(worst < ROUNDING, "{motion}: {worst} counts");
        // All of the count is used: the comparison is of rounded values with exact ones.
        assert!(worst > 0.4, "{motion}: {worst} counts");
    }
}
