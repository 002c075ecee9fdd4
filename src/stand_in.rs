//! A stand-in for `emems::unit::run` until it exists: exercises every part of a board, twice a second... once each 200 ms.

use embassy_futures::join::join;
use embassy_time::{Duration, Ticker, with_timeout};
use embedded_hal_async::i2c::I2c;
use embedded_hal_async::spi::SpiDevice;
use embedded_io_async::{Read, Write};
use emems::board::{Board, Discretes, Parts, RecoverBus, Retained, Watchdog};
use emems::packet;
use emems::sample::Reading;

/// Runs for ever.
pub async fn run<B: Board>(mut parts: Parts<B>) {
    defmt::info!("started after {}", parts.reset);
    let mut resume = parts.retained.resume().unwrap_or_default();
    if let Some(crash) = parts.retained.take_crash() {
        defmt::warn!("crashed: {} at {=u32:#x} cfsr {=u32:#x} {=str}", crash.cause, crash.at, crash.cfsr, crash.place.as_str());
    }
    resume.resets += 1;
    let mut ticker = Ticker::every(Duration::from_millis(200));
    let unit = async {
        loop {
            let mut reading = Reading::unread(resume.next_counter);
            let mut id = [0];
            let read = async {
                parts.sensor_bus.write(0x70, &[1]).await?;
                parts.sensor_bus.write_read(0x18, &[0x0F], &mut id).await
            };
            match with_timeout(Duration::from_millis(16), read).await {
                Ok(Ok(())) => reading.errors.remove(0),
                Ok(Err(_)) => {}
                Err(_) => {
                    let idle = parts.sensor_bus.recover().await;
                    defmt::warn!("bus recovered: {=bool}", idle);
                }
            }
            reading.acc_p[0][0] = id[0].into();
            for _ in 0..20 {
                for (plate, gyro) in parts.gyros.iter_mut().enumerate() {
                    let mut word = [0x0400];
                    if gyro.transfer_in_place(&mut word).await.is_ok() {
                        reading.gyro[plate] = word[0] as i16;
                    }
                }
            }
            reading.lift_off = parts.discretes.lift_off();
            reading.micro_g = parts.discretes.micro_g();
            let _ = parts.telemetry.write_all(&packet::encode(&reading)).await;
            let _ = parts.telemetry.flush().await;
            resume.next_counter = resume.next_counter.wrapping_add(1);
            parts.retained.keep(&resume);
            parts.watchdog.feed();
            ticker.next().await;
        }
    };
    let umbilical = async {
        let mut bytes = [0; 16];
        loop {
            match parts.umbilical_rx.read(&mut bytes).await {
                Ok(count) => {
                    let bytes = &bytes[..count];
                    if bytes == b"PANIC" {
                        panic!("asked to");
                    }
                    let _ = parts.umbilical_tx.write_all(bytes).await;
                }
                Err(_) => defmt::warn!("umbilical: bytes lost"),
            }
        }
    };
    let _: ((), ()) = join(unit, umbilical).await;
}
