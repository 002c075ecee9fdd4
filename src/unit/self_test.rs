//! Every sensor against its own stimulus, one after the other, when the console asks.
//!
//! The sensor under test is not read for packets: its error bit is set meanwhile. All others go on. A test that is cut off
//! frees the bus, and one that keeps the others from it is cut off.

use core::fmt::Display;

use embassy_futures::select::{Either, select};
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

/// \[ms\] the longest test of one sensor.
const LIMIT_MS: u64 = 600;

/// How a test ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Passed,
    Failed,
    TimedOut,
}

/// Tests whenever asked.
pub async fn run<B: Board>(shared: &Shared, switch: &Switch<B::SensorBus>, gyros: &Gyros<'_, B::Gyro>) -> ! {
    loop {
        shared.self_test_ordered.wait().await;
        let mut passed = 0_u8;
        for (slot, sensor) in SENSORS.into_iter().enumerate() {
            if shared.state.get().mode == Mode::Flight {
                break;
            }
            shared.testing.set(Some(slot));
            let outcome = test::<B>(shared, switch, gyros, sensor).await;
            if outcome == Outcome::TimedOut && sensor.kind != Kind::Gyro {
                // Left in the middle of a transfer, the bus never frees itself.
                switch.recover().await;
            }
            shared.testing.set(None);
            passed = passed.saturating_add(u8::from(outcome == Outcome::Passed));
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
) -> Outcome {
    let limit = Duration::from_millis(LIMIT_MS);
    shared.bus_wanted.reset();
    let channel = switch.channel(sensor.plate as u8);
    let mut delay = &shared.clock;
    match sensor.kind {
        Kind::Accelerometer => {
            let mut part = Lis331hh::new(channel);
            let test = part.self_test(shared.settings.accelerometer(), &mut delay);
            report(
                shared,
                sensor,
                unless_stuck(shared, shared.clock.within(limit, test)).await,
            )
            .await
        }
        Kind::Magnetometer => {
            let mut part = Hmc5883l::new(channel);
            let test = part.self_test(shared.settings.magnetometer(), Bias::Positive, &mut delay);
            report(
                shared,
                sensor,
                unless_stuck(shared, shared.clock.within(limit, test)).await,
            )
            .await
        }
        Kind::Gyro => {
            let outcome = shared.clock.within(limit, gyros.self_test(sensor.plate)).await;
            if let Ok(Ok(diagnosis)) = outcome
                && diagnosis.contains(Flag::SelfTest)
            {
                shared.tell(format_args!("G_AT {sensor} failed: {diagnosis}")).await;
                return Outcome::Failed;
            }
            report(shared, sensor, outcome).await
        }
        Kind::Thermometer => {
            let mut part = crate::sensor::tmp102::Tmp102::new(channel);
            report(
                shared,
                sensor,
                unless_stuck(shared, shared.clock.within(limit, part.probe())).await,
            )
            .await
        }
    }
}

/// What `test` gives, unless somebody else waits for the bus in vain: then it is this test that holds it.
async fn unless_stuck<T>(shared: &Shared, test: impl Future<Output = Result<T, TimedOut>>) -> Result<T, TimedOut> {
    match select(test, shared.bus_wanted.wait()).await {
        Either::First(outcome) => outcome,
        Either::Second(()) => Err(TimedOut),
    }
}

async fn report<T, E: Display>(shared: &Shared, sensor: Sensor, outcome: Result<Result<T, E>, TimedOut>) -> Outcome {
    match &outcome {
        Ok(Ok(_)) => {
            shared.tell(format_args!("G_AT {sensor} ok")).await;
            Outcome::Passed
        }
        Ok(Err(error)) => {
            shared.tell(format_args!("G_AT {sensor} failed: {error}")).await;
            Outcome::Failed
        }
        Err(TimedOut) => {
            shared
                .tell(format_args!("G_AT {sensor} failed: no answer in time"))
                .await;
            Outcome::TimedOut
        }
    }
}
