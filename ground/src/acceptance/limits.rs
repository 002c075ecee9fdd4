//! What a good unit keeps: the data sheets' figures, and what is allowed beyond them.
//!
//! A data sheet's typical figure is about one standard deviation of many parts. Noise may be twice the typical, offsets two or
//! three times; where a sheet gives a maximum, that is the limit. What a hand that turns the unit adds is stated beside it.

/// [m/s2] noise of a sample: 650 ug/rtHz in 50 Hz (LIS331HH data sheet, Table 3, An).
pub const ACC_NOISE: f64 = 0.045;
/// \[uT\] 2 mG (HMC5883L data sheet, specifications, resolution).
pub const MAG_NOISE_UT: f64 = 0.2;
/// [rad/s] 0.044 deg/s/rtHz in the 20 Hz of the unit's filter (ADIS16265 data sheet, Table 1, rate noise density).
pub const GYRO_NOISE: f64 = 0.003_44;
/// Noise at most, in parts of the above.
pub const NOISE_FACTOR: f64 = 2.0;

/// \[mg\] zero-g level: 70 typical (LIS331HH data sheet, Table 3, TyOff), twice that.
pub const ACC_OFFSET_MG: f64 = 140.0;
/// \[1\] sensitivity: 2.7 to 3.3 mg a digit (the same, So).
pub const ACC_SCALE: f64 = 0.1;
/// \[uT\] offset of a magnetometer: the weakest field on Earth (IGRF-13: 22 uT, South Atlantic). More is a magnet.
pub const MAG_OFFSET_UT: f64 = 22.0;
/// \[1\] of a magnetometer beside the mean of the four: as much as the bench believes of a scale (`calibrate`, 20 %).
pub const MAG_SCALE: f64 = 0.2;
/// [deg/s] bias at rest: initial error 3 (ADIS16265 data sheet, Table 1, one sigma), three times that.
pub const GYRO_BIAS_DEG_S: f64 = 9.0;
/// \[1\] sensitivity: 1 % at most (the same, initial tolerance), and 2 % of a turn that a hand ends 7 deg off.
pub const GYRO_SCALE: f64 = 0.03;
/// \[deg\] an axis off its nominal direction: as the bench believes (`calibrate`, 5 deg).
pub const AXIS_DEG: f64 = 5.0;
/// \[degC\] a thermometer beside the median of the four: 2 each at most (TMP102 data sheet, accuracy), both ways.
pub const TEMPERATURE_C: f64 = 4.0;
/// \[degC\] the thermometer in a gyro beside that median: no accuracy is given, and the part warms itself.
pub const GYRO_TEMPERATURE_C: f64 = 15.0;

/// \[s\] between two packets.
pub const PERIOD_S: f64 = 0.2;
/// \[1\] of the mean period: 50 ppm of the crystal, 100 of this computer's, and 16 ms of an adapter over the minute and a half.
/// The internal oscillator is off by 1 % (10,000 ppm) at room temperature (STM32F407 data sheet, Table 38).
pub const PERIOD_PPM: f64 = 500.0;
/// \[s\] arrival off the straight line: USB adapters hold bytes for 16 ms (FTDI, latency timer), and 4 ms for this computer.
pub const JITTER_S: f64 = 0.020;
/// \[us\] of the unit's cycle for one accelerometer: what the lines need at 400 kHz with the parts and pull-ups of the reference
/// design, read off derived frames of a good unit (host board: 324).
pub const READ_US: f64 = 324.0;
/// The same at most, in parts of it: pull-ups that are too weak stretch every bit.
pub const READ_FACTOR: f64 = 1.25;
/// Blocks of 4096 that may be bad when new (K9F1208 data sheet, valid blocks: 4026 at least).
pub const BAD_BLOCKS: u32 = 70;
/// Share of the stack that may be used.
pub const STACK: f64 = 0.9;
