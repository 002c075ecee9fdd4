//! Every sensor against its own stimulus, one after the other, when the console asks.
//!
//! The sensor under test is not read for packets: its error bit is set meanwhile. All others go on.

use core::fmt::Display;

use embassy_time::Duration;

use super::{clock::TimedOut, gyros::Gyros, shared::Shared};
use crate::{
    board::Board,
    mode::Mode,
    sample::{Kind, SENSORS, Sensor},
    sensor::{
        adis16265::diagnosis::Flag,
        hmc5883l::{Hmc5883l, self_test::Bias},
        lis331hh::Lis331hh,
        tca9548a::Switch,
    },
};

/// [ms] the longest test of one sensor.
const LIMIT_MS: u64 = 600;

/// Tests whenever asked.
pub async fn run<B: Board>(shared: &Shared, switch: &Switch<B::SensorBus>, gyros: &Gyros<'_, B::Gyro>) {
    loop {
        shared.self_test_ordered.wait().await;
        let mut passed = 0;
        for (slot, sensor) in SENSORS.into_iter().enumerate() {
            if shared.state.borrow().mode == Mode::Flight {
                break;
            }
            shared.testing.set(Some(slot));
            passed += u8::from(test::<B>(shared, switch, gyros, sensor).await);
            shared.testing.set(None);
        }
        shared
            .tell(format_args!("G_AT done: {passed} of {} passed", SENSORS.len()))
            .await;
    }
}

async fn test<B: Board>(
    shared: &Shared,
    switch: &Switch<B::SensorBus>,
    gyros: &Gyros<'_, B::Gyro>,
    sensor: Sensor,
) -> bool {
    let limit = Duration::from_millis(LIMIT_MS);
    let channel = switch.channel(sensor.plate as u8);
    let mut delay = &shared.clock;
    match sensor.kind {
        Kind::Accelerometer => {
            let mut part = Lis331hh::new(channel);
            let test = part.self_test(shared.settings.accelerometer(), &mut delay);
            report(shared, sensor, shared.clock.within(limit, test).await).await
        }
        Kind::Magnetometer => {
            let mut part = Hmc5883l::new(channel);
            let test = part.self_test(shared.settings.magnetometer(), Bias::Positive, &mut delay);
            report(shared, sensor, shared.clock.within(limit, test).await).await
        }
        Kind::Gyro => {
            let outcome = shared.clock.within(limit, gyros.self_test(sensor.plate)).await;
            if let Ok(Ok(diagnosis)) = outcome
                && diagnosis.contains(Flag::SelfTest)
            {
                shared.tell(format_args!("G_AT {sensor} failed: {diagnosis}")).await;
                return false;
            }
            report(shared, sensor, outcome).await
        }
        Kind::Thermometer => {
            let mut part = crate::sensor::tmp102::Tmp102::new(channel);
            report(shared, sensor, shared.clock.within(limit, part.probe()).await).await
        }
    }
}

async fn report<T, E: Display>(shared: &Shared, sensor: Sensor, outcome: Result<Result<T, E>, TimedOut>) -> bool {
    match &outcome {
        Ok(Ok(_)) => shared.tell(format_args!("G_AT {sensor} ok")).await,
        Ok(Err(error)) => shared.tell(format_args!("G_AT {sensor} failed: {error}")).await,
        Err(TimedOut) => {
            shared
                .tell(format_args!("G_AT {sensor} failed: no answer in time"))
                .await
        }
    }
    matches!(outcome, Ok(Ok(_)))
}
