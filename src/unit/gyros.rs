//! The four gyros: sampled fast between cycles, and once a cycle for the packet.
//!
//! Both share the parts through one lock; a fast sample of all four takes 0.1 ms, so neither waits long. The four are
//! asked one after the other and answer in the same order: the part needs a pause between its frames, and the other
//! three fill it.

use core::cell::Cell;

use embassy_sync::{blocking_mutex::raw::NoopRawMutex, mutex::Mutex};
use embassy_time::{Duration, Instant};
use embedded_hal_async::spi::SpiDevice;

use super::{
    Settings,
    clock::{Clock, after, next_on_grid, now},
    plates::put,
    shared::Shared,
    vote::{Voter, Votes},
};
use crate::{
    board::Board,
    geometry::PLATES,
    health::Health,
    increments::Fast,
    resume::Pulse,
    sample::NOT_READ,
    sensor::{
        Error,
        adis16265::{self, Adis16265, Output, STALL_US, diagnosis::Diagnosis},
    },
};

/// The longest all four may take.
const FAST_LIMIT: Duration = Duration::from_millis(2);

/// Between looks at a running self-test.
const TEST_POLL: Duration = Duration::from_millis(10);

/// Pause between two frames of one part.
const STALL: Duration = Duration::from_micros(STALL_US as u64);

/// The gyros of plates 1 to 4.
pub struct Gyros<'a, SPI> {
    parts: Mutex<NoopRawMutex, [Adis16265<SPI, &'a Clock>; 4]>,
    clock: &'a Clock,
    config: adis16265::Config,
    /// The gyro of each plate is configured and answers.
    answering: Cell<[bool; PLATES]>,
    /// When the last frame outside a fast sample ended.
    last_frame: Cell<Instant>,
    health: Cell<Health>,
}

impl<'a, SPI: SpiDevice<u16>> Gyros<'a, SPI> {
    /// The gyros on their chip selects.
    pub fn new(selects: [SPI; 4], settings: Settings, clock: &'a Clock) -> Self {
        Gyros {
            parts: Mutex::new(selects.map(|select| Adis16265::new(select, clock))),
            clock,
            config: settings.gyro(),
            answering: Cell::default(),
            last_frame: Cell::new(Instant::MIN),
            health: Cell::default(),
        }
    }

    /// Identifies and configures the gyro of a plate.
    pub async fn configure(&self, plate: usize) -> Result<(), Error<SPI::Error>> {
        let configured = self.parts.lock().await[plate].configure(self.config).await;
        self.rest(plate, configured)
    }

    /// Finds a gyro that has lost its settings.
    pub async fn verify(&self, plate: usize) -> Result<(), Error<SPI::Error>> {
        let kept = self.parts.lock().await[plate].verify(self.config).await;
        self.rest(plate, kept)
    }

    /// Lets a gyro test itself; the others are read meanwhile. It is not sampled again before it is configured.
    pub async fn self_test(&self, plate: usize) -> Result<Diagnosis, Error<SPI::Error>> {
        self.answers(plate, false);
        self.parts.lock().await[plate].start_self_test().await?;
        loop {
            self.clock.until(after(TEST_POLL)).await;
            if let Some(diagnosis) = self.parts.lock().await[plate].self_test_result().await? {
                return Ok(diagnosis);
            }
        }
    }

    /// \[counts\] rate and temperature of a plate's gyro.
    pub async fn read(&self, plate: usize) -> Result<(i16, i16), Error<SPI::Error>> {
        let read = self.parts.lock().await[plate].read_rate_and_temperature().await;
        let (rate, temperature) = self.rest(plate, read)?;
        self.note(rate);
        Ok((rate.counts, temperature.counts))
    }

    /// What the gyros reported since it was last asked.
    pub fn take_health(&self) -> Health {
        self.health.take()
    }

    /// \[counts\] rates of all four, and when they were asked for.
    async fn fast(&self) -> (Instant, [i16; 4]) {
        let mut parts = self.parts.lock().await;
        self.clock.until(self.last_frame.get().saturating_add(STALL)).await;
        let asked = now();
        for (plate, (part, answers)) in (0..PLATES).zip(parts.iter_mut().zip(self.answering.get())) {
            if answers {
                let request = part.exchange(adis16265::GYRO_OUT).await;
                let _ = self.settle(plate, request);
            }
        }
        // Four frames are longer than the pause; fewer may not be.
        if self.answering.get().contains(&false) {
            self.clock.until(asked.saturating_add(STALL)).await;
        }
        let mut counts = [NOT_READ; 4];
        // Who answers is asked anew: the request just before checks who answered the last one.
        for (plate, (part, answers)) in (0..PLATES).zip(parts.iter_mut().zip(self.answering.get())) {
            if !answers {
                continue;
            }
            // What is asked for here is taken by the next reading's first frame, which so checks who answers.
            let answer = part.exchange(adis16265::PROD_ID).await;
            // A dead line's word; a live part sends it only when it has nothing new.
            let is_live = |word: &u16| !matches!(*word, 0 | u16::MAX);
            if let Some(word) = self.settle(plate, answer).ok().filter(is_live) {
                let rate = Output::rate(word);
                self.note(rate);
                put(&mut counts, plate, rate.counts);
            }
        }
        (asked, counts)
    }

    fn note(&self, rate: Output) {
        let saturated = rate.counts.unsigned_abs() >= adis16265::RANGE_COUNTS.unsigned_abs();
        let health = self.health.get().with_if(Health::GYRO_ALARM, rate.alarm);
        self.health.set(health.with_if(Health::GYRO_SATURATED, saturated));
    }

    /// As [`Gyros::settle`], after frames outside a fast sample, which will have to pause before its own.
    fn rest<T>(&self, plate: usize, outcome: Result<T, Error<SPI::Error>>) -> Result<T, Error<SPI::Error>> {
        self.last_frame.set(now());
        self.settle(plate, outcome)
    }

    /// Keeps whether the gyro of a plate answers.
    fn settle<T>(&self, plate: usize, outcome: Result<T, Error<SPI::Error>>) -> Result<T, Error<SPI::Error>> {
        self.answers(plate, outcome.is_ok());
        outcome
    }

    fn answers(&self, plate: usize, answering: bool) {
        let mut all = self.answering.get();
        put(&mut all, plate, answering);
        self.answering.set(all);
    }
}

/// Samples fast for ever, and leaves in retained memory that the unit is alive: after a reset it tells when that struck.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, gyros: &Gyros<'_, B::Gyro>, memory: &B::Retained) -> ! {
    let interval = Duration::from_hz(shared.settings.gyro_hz);
    // A cycle starts on the grid of the period and asks the gyros 3 ms later. Three quarters of an interval off the grid
    // the two do not meet, and there is a conversion (3.9 ms) between them: a part that has nothing new may send what a
    // dead line sends.
    let phase = Duration::from_ticks(interval.as_ticks().saturating_mul(3) / 4);
    // Samples that were missed are not made up for: they would all be of now.
    loop {
        let tick = next_on_grid(interval, phase);
        votes.waiting(Voter::Gyros, shared.clock.until(tick)).await;
        let pulse = Pulse {
            at_us: now().as_micros(),
            fed_us: shared.fed_us.get(),
        };
        pulse.keep(memory);
        if let Ok((at, counts)) = shared.clock.within(FAST_LIMIT, gyros.fast()).await {
            shared.integrator.borrow_mut().add(Fast {
                at_us: at.as_micros(),
                counts,
            });
        }
    }
}
