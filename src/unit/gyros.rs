//! The four gyros: sampled fast between cycles, and once a cycle for the packet.
//!
//! Both share the parts through one lock; a fast sample of all four takes 0.1 ms, so neither waits long. The four are
//! asked one after the other and answer in the same order: the part needs a pause between its frames, and the other
//! three fill it.

use core::cell::Cell;

use embassy_sync::{blocking_mutex::raw::NoopRawMutex, mutex::Mutex};
use embassy_time::{Delay, Duration, Instant, Ticker, Timer, with_timeout};
use embedded_hal_async::spi::SpiDevice;

use super::{
    Settings,
    shared::Shared,
    vote::{Voter, Votes},
};
use crate::{
    board::Board,
    derived::Health,
    increments::Fast,
    sample::NOT_READ,
    sensor::{
        Error,
        adis16265::{self, Adis16265, Output, STALL_US},
    },
};

/// [ms] the longest all four may take.
const FAST_LIMIT_MS: u64 = 2;

/// Pause between two frames of one part.
const STALL: Duration = Duration::from_micros(STALL_US as u64);

/// [counts] a rate beyond the range; 320 deg/s are 4368 counts (ADIS16265 data sheet, Table 1: initial range).
const SATURATED_COUNTS: u16 = 4368;

/// The gyros of plates 1 to 4.
pub struct Gyros<SPI> {
    parts: Mutex<NoopRawMutex, [Adis16265<SPI, Delay>; 4]>,
    config: adis16265::Config,
    /// Bit set: the gyro of that plate is configured and answers.
    answering: Cell<u8>,
    /// When the last frame outside a fast sample ended.
    last_frame: Cell<Instant>,
    health: Cell<Health>,
}

impl<SPI: SpiDevice<u16>> Gyros<SPI> {
    /// The gyros on their chip selects.
    pub fn new(selects: [SPI; 4], settings: Settings) -> Self {
        Gyros {
            parts: Mutex::new(selects.map(|select| Adis16265::new(select, Delay))),
            config: settings.gyro(),
            answering: Cell::new(0),
            last_frame: Cell::new(Instant::MIN),
            health: Cell::default(),
        }
    }

    /// Identifies and configures the gyro of a plate.
    pub async fn configure(&self, plate: usize) -> Result<(), Error<SPI::Error>> {
        let configured = self.parts.lock().await[plate].configure(self.config).await;
        self.settle(plate, configured)
    }

    /// Finds a gyro that has lost its settings.
    pub async fn verify(&self, plate: usize) -> Result<(), Error<SPI::Error>> {
        let kept = self.parts.lock().await[plate].verify(self.config).await;
        self.settle(plate, kept)
    }

    /// Tests a gyro with its own stimulus, as far as it can.
    pub async fn self_test(&self, plate: usize) -> Result<(), Error<SPI::Error>> {
        let tested = self.parts.lock().await[plate].verify(self.config).await; // SELFTEST
        self.settle(plate, tested)
    }

    /// [counts] rate and temperature of a plate's gyro.
    pub async fn read(&self, plate: usize) -> Result<(i16, i16), Error<SPI::Error>> {
        let read = self.parts.lock().await[plate].read_rate_and_temperature().await;
        let (rate, temperature) = self.settle(plate, read)?;
        self.note(rate);
        Ok((rate.counts, temperature.counts))
    }

    /// What the gyros reported since it was last asked.
    pub fn take_health(&self) -> Health {
        self.health.take()
    }

    /// [counts] rates of all four, and when they were asked for.
    async fn fast(&self) -> (Instant, [i16; 4]) {
        let mut parts = self.parts.lock().await;
        let answering = self.answering.get();
        let is_answering = |plate: &usize| answering >> plate & 1 == 1;
        Timer::at(self.last_frame.get() + STALL).await;
        let asked = Instant::now();
        for plate in (0..4).filter(is_answering) {
            let request = parts[plate].request(adis16265::GYRO_OUT).await;
            let _ = self.settle(plate, request);
        }
        // Four frames are longer than the pause; fewer may not be.
        Timer::at(asked + STALL).await;
        let mut counts = [NOT_READ; 4];
        for plate in (0..4).filter(is_answering) {
            let answer = parts[plate].exchange(adis16265::GYRO_OUT).await;
            // A dead line's word; a live part sends it only when it has nothing new.
            let is_live = |word: &u16| !matches!(*word, 0 | u16::MAX);
            if let Some(word) = self.settle(plate, answer).ok().filter(is_live) {
                let rate = Output::rate(word);
                self.note(rate);
                counts[plate] = rate.counts;
            }
        }
        self.last_frame.set(Instant::now());
        (asked, counts)
    }

    fn note(&self, rate: Output) {
        let saturated = rate.counts.unsigned_abs() >= SATURATED_COUNTS;
        let health = self.health.get().with_if(Health::GYRO_ALARM, rate.alarm);
        self.health.set(health.with_if(Health::GYRO_SATURATED, saturated));
    }

    /// Keeps whether the gyro of a plate answers.
    fn settle<T>(&self, plate: usize, outcome: Result<T, Error<SPI::Error>>) -> Result<T, Error<SPI::Error>> {
        let others = self.answering.get() & !(1 << plate);
        self.answering.set(others | u8::from(outcome.is_ok()) << plate);
        self.last_frame.set(Instant::now());
        outcome
    }
}

/// Samples fast for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, gyros: &Gyros<B::Gyro>) {
    let interval = Duration::from_hz(shared.settings.gyro_hz);
    let mut ticks = Ticker::every(interval);
    loop {
        votes.cast(Voter::Gyros);
        ticks.next().await;
        if let Ok((at, counts)) = with_timeout(Duration::from_millis(FAST_LIMIT_MS), gyros.fast()).await {
            shared.integrator.borrow_mut().add(Fast {
                at_us: at.as_micros(),
                counts,
            });
        }
    }
}
