//! The plant as a controller finds it: register conversations over the whole tree.

use nalgebra::Vector3;

use super::*;
use crate::part::SpiPart;

mod agreement;

const MS: Nanos = 1_000_000;
const G: f64 = 9.80665;
/// All parts have started and settled.
const SETTLED: Nanos = 1_000 * MS;

/// A world in which nothing changes.
struct Constant(Truth);

impl TruthSource for Constant {
    fn at(&self, _t_s: f64) -> Truth {
        self.0
    }
    fn duration_s(&self) -> Option<f64> {
        None
    }
}

/// A world that swings.
struct Swing;

impl TruthSource for Swing {
    fn at(&self, t_s: f64) -> Truth {
        Truth {
            rate_b: Vector3::new(t_s.sin(), (2.0 * t_s).cos(), (3.0 * t_s).sin()),
            force_b: Vector3::new(3.0 * t_s.cos(), t_s.sin(), -G),
            lift_off: t_s >= 2.0,
            micro_g: t_s >= 3.0,
            ..LEVEL
        }
    }
    fn duration_s(&self) -> Option<f64> {
        None
    }
}

/// Still and level at 35 degC.
const LEVEL: Truth = Truth {
    rate_b: Vector3::new(0.0, 0.0, 0.0),
    rate_dot_b: Vector3::new(0.0, 0.0, 0.0),
    force_b: Vector3::new(0.0, 0.0, -G),
    field_b_ut: Vector3::new(20.0, -6.0, -12.0),
    temperature_c: 35.0,
    lift_off: false,
    micro_g: false,
};

fn ideal(truth: Truth) -> Plant {
    configured(Plant::ideal(Arc::new(Constant(truth))))
}

/// Accelerometers at 400 Hz and 6 g, magnetometers at 75 Hz and gain 1090.
fn configured(mut plant: Plant) -> Plant {
    select(&mut plant, 0x0F, 0);
    write(&mut plant, 0x18, &[0x20, 0x37], 0);
    write(&mut plant, 0x1E, &[0x00, 0x18, 0x20, 0x00], 0);
    plant
}

fn select(plant: &mut Plant, control: u8, now: Nanos) {
    write(plant, 0x70, &[control], now);
}

fn write(plant: &mut Plant, address: u8, bytes: &[u8], now: Nanos) {
    assert!(plant.i2c.start(address, false, now));
    assert!(bytes.iter().all(|&byte| plant.i2c.write(byte, now)));
    plant.i2c.stop(now);
}

fn read<const N: usize>(plant: &mut Plant, plate: usize, address: u8, register: u8, now: Nanos) -> Option<[u8; N]> {
    select(plant, 1 << plate, now);
    let answers = plant.i2c.start(address, false, now) && plant.i2c.write(register, now);
    let bytes = (answers && plant.i2c.start(address, true, now)).then(|| core::array::from_fn(|_| plant.i2c.read(now)));
    plant.i2c.stop(now);
    bytes
}

fn acc(plant: &mut Plant, plate: usize, now: Nanos) -> Option<[i16; 3]> {
    let bytes: [u8; 6] = read(plant, plate, 0x18, 0xA8, now)?;
    Some([0, 2, 4].map(|i| i16::from_le_bytes([bytes[i], bytes[i + 1]]) >> 4))
}

fn frame(plant: &mut Plant, plate: usize, word: u16, now: Nanos) -> u16 {
    let gyro = &mut plant.gyro[plate];
    gyro.select(now);
    let answer = gyro.transfer(word, now);
    gyro.deselect(now);
    answer
}

fn ask_gyro(plant: &mut Plant, plate: usize, word: u16, now: Nanos) -> u16 {
    frame(plant, plate, word, now);
    frame(plant, plate, 0x0000, now + 10_000)
}

fn rate(plant: &mut Plant, plate: usize, now: Nanos) -> i16 {
    (ask_gyro(plant, plate, 0x0400, now) << 2) as i16 >> 2
}

fn all<T>(plant: &mut Plant, one: impl Fn(&mut Plant, usize) -> T) -> [T; PLATES] {
    core::array::from_fn(|plate| one(plant, plate))
}

#[test]
fn a_plant_can_go_to_another_thread() {
    fn is_send<T: Send>(_: &T) {}
    is_send(&ideal(LEVEL));
}

/// Gravity at Euler angles 10, -20, 30 deg, in counts of 3 mg, computed apart from this code.
#[test]
fn at_rest_each_plate_feels_its_share_of_gravity() {
    let force_b = Vector3::new(-3.354071838545, -1.600209049241, -9.075236488550);
    let mut plant = ideal(Truth { force_b, ..LEVEL });
    let golden = [[-257, 54, -206], [-296, -126, -88], [-326, 72, 1], [114, -54, 308]];
    assert_eq!(
        all(&mut plant, |plant, plate| acc(plant, plate, SETTLED)),
        golden.map(Some)
    );
}

/// n.w for w = (0.1, -0.2, 0.3) rad/s over 0.07326 deg/s, computed apart from this code.
#[test]
fn each_gyro_feels_the_rate_about_its_own_axis() {
    let rate_b = Vector3::new(0.1, -0.2, 0.3);
    let mut plant = ideal(Truth { rate_b, ..LEVEL });
    assert_eq!(
        all(&mut plant, |plant, plate| rate(plant, plate, SETTLED)),
        [-148, 91, -166, 235]
    );
}

#[test]
fn magnetometers_and_thermometers_feel_their_plate() {
    let mut plant = ideal(LEVEL);
    let mut mag = |plate| {
        let bytes: [u8; 6] = read(&mut plant, plate, 0x1E, 0x03, SETTLED).unwrap();
        [0, 4, 2].map(|i| i16::from_be_bytes([bytes[i], bytes[i + 1]]))
    };
    assert_eq!([mag(0), mag(3)], [[-193, 65, 165], [-218, -65, 131]]);
    // 35 degC: 560 sixteenths, 69 counts above 25 degC.
    assert_eq!(
        all(&mut plant, |plant, plate| read(plant, plate, 0x48, 0x00, SETTLED)),
        [Some([0x23, 0x00]); 4]
    );
    assert_eq!(
        all(&mut plant, |plant, plate| ask_gyro(plant, plate, 0x0C00, SETTLED)),
        [0x8045; 4]
    );
}

#[test]
fn off_centre_accelerometers_feel_the_rotation() {
    // Plate 4 is at (-16, -9, 38) mm: 100/s2 outwards, then 100 rad/s2 across; x and z of its frame are reversed.
    let [free, rate_b, rate_dot_b] = [[0.0; 3], [0.0, 0.0, 10.0], [0.0, 0.0, 100.0]].map(Vector3::from);
    let spinning = Truth {
        force_b: free,
        rate_b,
        ..LEVEL
    };
    assert_eq!(acc(&mut ideal(spinning), 3, SETTLED), Some([-54, 31, 0]));
    let starting = Truth {
        force_b: free,
        rate_dot_b,
        ..LEVEL
    };
    assert_eq!(acc(&mut ideal(starting), 3, SETTLED), Some([-31, -54, 0]));
}

#[test]
fn the_noise_is_nominal() {
    const COUNT: u64 = 20_000;
    let mut plant = configured(Plant::new(Arc::new(Constant(LEVEL)), 7));
    let mut of = |one: &dyn Fn(&mut Plant, Nanos) -> f64| {
        let samples: Vec<f64> = (0..COUNT).map(|k| one(&mut plant, SETTLED + k * 5 * MS)).collect();
        let mean = samples.iter().sum::<f64>() / COUNT as f64;
        (samples.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / COUNT as f64).sqrt()
    };
    // Rounding adds a twelfth of a count squared; five standard errors of a standard deviation.
    let expect = |sigma: f64, found: f64| {
        let sigma = (sigma.powi(2) + 1.0 / 12.0).sqrt();
        assert!(
            (found / sigma - 1.0).abs() < 5.0 / (2.0 * COUNT as f64).sqrt(),
            "{found} for {sigma}"
        );
    };
    expect(
        0.045 / 0.02941995,
        of(&|plant, now| f64::from(acc(plant, 1, now).unwrap()[2])),
    );
    expect(
        0.00344 / 0.001278628210,
        of(&|plant, now| f64::from(rate(plant, 2, now))),
    );
}

#[test]
fn the_reading_pattern_changes_no_value_and_the_seed_changes_all() {
    let plant = |seed| configured(Plant::new(Arc::new(Swing), seed));
    let (mut seldom, mut often, mut other) = (plant(1), plant(1), plant(2));
    let mut differs = 0;
    for cycle in 0..50 {
        let now = SETTLED + cycle * 200 * MS;
        for early in (1..40).rev() {
            rate(&mut often, 0, now - early * 4 * MS);
            acc(&mut often, 0, now - early * 4 * MS);
        }
        let at = |plant: &mut Plant| (acc(plant, 0, now), rate(plant, 0, now));
        let expected = at(&mut seldom);
        assert_eq!(at(&mut often), expected);
        differs += u32::from(at(&mut other) != expected);
    }
    assert!(differs > 45);
}

#[test]
fn the_lines_follow_the_truth() {
    let mut plant = Plant::ideal(Arc::new(Swing));
    let lines = [1_999, 2_000, 3_000].map(|ms| plant.discretes(ms * MS));
    assert_eq!(lines, [(false, false), (true, false), (true, true)]);
}

#[test]
fn a_silent_sensor_leaves_the_other_fifteen_alone() {
    for slot in 0..SENSORS.len() {
        let mut plant = ideal(LEVEL);
        plant.apply(Fault::Silent(slot), SETTLED);
        let answers = |plant: &mut Plant| -> Vec<bool> {
            let i2c = |plant: &mut Plant, address| {
                all(plant, |plant, plate| {
                    read::<1>(plant, plate, address, 0, SETTLED).is_some()
                })
            };
            let gyros = all(plant, |plant, plate| {
                ask_gyro(plant, plate, 0x5600, SETTLED + MS) == 0x3F89
            });
            [i2c(plant, 0x18), i2c(plant, 0x1E), gyros, i2c(plant, 0x48)].concat()
        };
        let expected: Vec<bool> = (0..SENSORS.len()).map(|other| other != slot).collect();
        assert_eq!(answers(&mut plant), expected);
    }
}

#[test]
fn a_restored_sensor_has_been_power_cycled() {
    let mut plant = ideal(LEVEL);
    plant.apply(Fault::Silent(0), SETTLED);
    plant.apply(Fault::Restored(0), SETTLED);
    assert_eq!(read(&mut plant, 0, 0x18, 0x20, SETTLED), Some([0x07]));
    plant.apply(Fault::Silent(8), SETTLED);
    assert_eq!(ask_gyro(&mut plant, 0, 0x5600, SETTLED), 0x0000);
    plant.apply(Fault::Restored(8), SETTLED);
    assert_eq!(ask_gyro(&mut plant, 0, 0x5600, SETTLED + 219 * MS), 0x0000);
    assert_eq!(ask_gyro(&mut plant, 0, 0x5600, SETTLED + 221 * MS), 0x3F89);
}

#[test]
fn without_the_switch_no_plate_answers_but_the_gyros_do() {
    let mut plant = ideal(LEVEL);
    plant.apply(Fault::MuxSilent(true), SETTLED);
    assert!(
        [0x70, 0x18, 0x1E, 0x48]
            .iter()
            .all(|&address| !plant.i2c.start(address, false, SETTLED))
    );
    assert_eq!(ask_gyro(&mut plant, 0, 0x5600, SETTLED), 0x3F89);
    plant.apply(Fault::MuxSilent(false), SETTLED);
    assert!(acc(&mut plant, 0, SETTLED).is_some());
}

#[test]
fn a_held_sda_is_freed_by_nine_pulses_and_a_stuck_one_by_nothing() {
    let mut plant = ideal(LEVEL);
    plant.apply(Fault::SdaHeld(9), SETTLED);
    for _ in 0..9 {
        assert!(plant.sda_held() && !plant.i2c.start(0x70, false, SETTLED));
        plant.clock_pulse();
    }
    assert!(!plant.sda_held());
    assert!(acc(&mut plant, 0, SETTLED).is_some());

    plant.apply(Fault::BusStuck(true), SETTLED);
    (0..20).for_each(|_| plant.clock_pulse());
    assert!(plant.sda_held());
    plant.apply(Fault::BusStuck(false), SETTLED);
    assert!(acc(&mut plant, 0, SETTLED).is_some());
}

#[test]
fn a_babbling_gyro_answers_the_same_noise_in_every_run_and_keeps_its_settings() {
    let babble = || {
        let mut plant = ideal(LEVEL);
        plant.apply(Fault::Garbage(9, true), SETTLED);
        let words: Vec<u16> = (0..8)
            .map(|i| ask_gyro(&mut plant, 1, 0x5600, SETTLED + i * MS))
            .collect();
        plant.apply(Fault::Garbage(9, false), SETTLED);
        assert_eq!(ask_gyro(&mut plant, 1, 0x5600, SETTLED + 20 * MS), 0x3F89);
        words
    };
    let words = babble();
    assert_eq!(words, babble());
    assert!(words.iter().all(|&word| word != 0x3F89) && words.windows(2).all(|pair| pair[0] != pair[1]));
}

#[test]
fn a_fault_of_a_part_that_is_not_there_does_nothing() {
    let mut plant = ideal(LEVEL);
    for fault in [
        Fault::Silent(16),
        Fault::Restored(99),
        Fault::Garbage(16, true),
        Fault::Reset,
    ] {
        plant.apply(fault, SETTLED);
    }
    assert!(
        all(&mut plant, |plant, plate| acc(plant, plate, SETTLED))
            .iter()
            .all(Option::is_some)
    );
}
