//! One read cycle of all sixteen sensors every period, in the order of [`SENSORS`]; the packet always closes.
//!
//! A sensor that answers is read within its share of the cycle ([`Budget`]); one that does not acknowledge, twice in it. One
//! that fails is marked in the error identifier and from then on probed cheaply, once a cycle, until it answers and is configured
//! again. A read that ran out of time has left the bus in the middle of a transfer: the bus is freed at once, since it never
//! frees itself. Who held it is not known: the sensor that was being read is first read once more in the next cycle as it is.
//!
//! Magnetometers measure when they are asked, each [`ASKED`] before it is read: so it is known when each saw the field, which at
//! three turns a second turns by a degree in a millisecond. One whose question runs out of time is not read in that cycle, since it
//! would stretch the clock once more; a second such question in a row loses it.
//!
//! A quarter of the period after a cycle began, when it is estimated, one sensor in turn has its settings verified: a part that
//! browned out by itself answers as before, but with its power-on settings (fault S12). Between two cycles the accelerometers are read some times more,
//! for the estimation alone ([`forces`]). What fails then is left out and nothing is concluded from it: the next cycle will see.

use core::fmt::Display;

use embassy_time::{Duration, Instant};

use super::{
    clock::{TimedOut, after, next_on_grid, now},
    gyros::Gyros,
    plates::{Plates, Taken, put},
    shared::{Cycle, Shared},
    vote::{Voter, Votes},
};
use crate::{
    board::{Board, ResetCause, Supply as _},
    budget::Budget,
    geometry::PLATES,
    health::Health,
    increments::forces::{self, READINGS},
    packet,
    resume::{Resume, Starts},
    sample::{Kind, NO_SLOT, NOT_READ, Reading, SENSOR_COUNT, SENSORS, Sample, Sensor},
    sensor::tca9548a::Switch,
};

/// \[ms\] after power-on until the gyros answer (ADIS16265 data sheet, Table 1: 220 ms).
const GYRO_START_MS: u64 = 250;

/// From the question to a magnetometer to its being read. It measures for 6 ms (HMC5883L data sheet, operating modes), and its set is then
/// as old as the mean of those that it makes by its own clock, half of 13.3 ms: one delay is true of both
/// ([`crate::kalman::Delays`]).
const ASKED: Duration = Duration::from_micros(12_700);

/// \[us\] from a sensor's read to the next one's where all before it answer, as the slot times of a derived frame have it.
const READ_US: u64 = 300;

/// A question that comes later has no answer yet when the magnetometer is read. One that comes late, after a part that had to be cut
/// off, gives a set that is so much younger.
const LATE: Duration = Duration::from_millis(6);

/// Cycles closed until then make a start a healthy one: the count of those that were not begins anew.
const HEALTHY: Instant = Instant::from_secs(60);

/// What is known of a sensor.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Standing {
    /// It failed, or was never configured.
    Lost,
    /// It was asked to measure and ran out of time: this cycle does not read it, which would hold its plate once more.
    Unasked,
    /// It ran out of time once: its next fresh sample is good.
    Doubted,
    /// Configured; its next fresh sample is its first good one.
    Configured,
    /// It gives samples.
    Reading,
}

/// A sensor and its place in the reading order.
type Slot = (usize, Sensor);

/// All of them.
fn slots() -> impl Iterator<Item = Slot> + Clone {
    (0..SENSOR_COUNT).zip(SENSORS.iter().copied())
}

/// Reads for ever.
pub async fn run<B: Board>(
    shared: &Shared,
    votes: &Votes,
    switch: &Switch<B::SensorBus>,
    gyros: &Gyros<'_, B::Gyro>,
    supply: B::Supply,
    memory: &B::Retained,
) -> ! {
    let period = Duration::from_millis(shared.settings.period_ms);
    let mut acquisition = Acquisition::<B> {
        shared,
        switch,
        plates: Plates::new(switch, shared.settings),
        gyros,
        budget: Budget::of_period(period.as_micros()),
        standing: [Standing::Lost; SENSOR_COUNT],
        health: Health::default(),
    };
    if shared.start.reset == ResetCause::PowerOn {
        let started = shared.clock.until(Instant::from_millis(GYRO_START_MS));
        votes.waiting(Voter::Acquire, started).await;
    }
    // The gyros first: what they do not see of a reset in flight is missing in the attitude.
    for first in [true, false] {
        let is_due = |slot: &Slot| (slot.1.kind == Kind::Gyro) == first;
        for slot in slots().filter(is_due) {
            acquisition
                .configure(slot, acquisition.budget.limit_us(0, 0, false))
                .await;
        }
    }
    let resume = shared.start.resume.unwrap_or_default();
    let mut counter = resume.next_counter;
    let close = Duration::from_micros(acquisition.budget.close_us);
    // The first set of a magnetometer after its configuration is withheld: a cycle that is not sent takes it.
    let mut start = next_on_grid(period / 4, Duration::MIN);
    votes.waiting(Voter::Acquire, shared.clock.until(start)).await;
    acquisition.cycle(counter, start).await;
    start = start.saturating_add(period / 4);
    let limit_us = acquisition.budget.limit_us(0, 0, true);
    let mut to_verify = slots().cycle();
    let mut healthy = false;
    loop {
        acquisition.ask_fields(votes, start, limit_us).await;
        votes.waiting(Voter::Acquire, shared.clock.until(start)).await;
        let cycle = acquisition.cycle(counter, start).await;
        votes
            .waiting(Voter::Acquire, shared.clock.until(start.saturating_add(close)))
            .await;
        counter = counter.wrapping_add(1);
        shared.publish_cycle(cycle);
        shared.mend();
        let state = shared.state.get();
        let dips = resume.dips.saturating_add(supply.dips());
        shared.supply_dips.set(dips);
        let resume = Resume {
            mode: state.mode,
            recording: state.recording,
            derived: state.derived,
            awaits_log: state.awaits_log,
            next_counter: counter,
            dips,
        };
        resume.keep(memory);
        if !healthy && start >= HEALTHY {
            healthy = true;
            let starts = Starts {
                without_health: 0,
                ..shared.start.starts
            };
            starts.keep(memory);
        }
        start = start.saturating_add(period);
        // Not at once: through a spin the estimation of this cycle takes milliseconds in one piece, and what a part answers meanwhile
        // would be heard after its time.
        let estimated = start.saturating_sub(period / 4 * 3);
        votes.waiting(Voter::Acquire, shared.clock.until(estimated)).await;
        if after(Duration::from_micros(limit_us.saturating_mul(2))) < start
            && let Some(slot) = to_verify.next()
        {
            acquisition.verify(slot, limit_us).await;
        }
        if period >= Duration::from_millis(forces::SHORTEST_PERIOD_MS) {
            let apart = period / (READINGS as u32 + 1);
            for reading in (1..=READINGS as u64).rev() {
                let before = Duration::from_ticks(apart.as_ticks().saturating_mul(reading));
                let at = start.saturating_sub(before);
                // A cycle with silent sensors may have taken longer.
                if now() <= at {
                    votes.waiting(Voter::Acquire, shared.clock.until(at)).await;
                    acquisition.read_forces(counter, limit_us).await;
                }
            }
        }
    }
}

struct Acquisition<'a, 'c, B: Board> {
    shared: &'a Shared,
    switch: &'a Switch<B::SensorBus>,
    plates: Plates<'a, B::SensorBus>,
    gyros: &'a Gyros<'c, B::Gyro>,
    budget: Budget,
    standing: [Standing; SENSOR_COUNT],
    health: Health,
}

impl<B: Board> Acquisition<'_, '_, B> {
    /// One read cycle.
    async fn cycle(&mut self, counter: u16, start: Instant) -> Cycle {
        let mut reading = Reading::unread(counter);
        let mut slots_us = [NO_SLOT; SENSOR_COUNT];
        let mut waiting = SENSOR_COUNT as u64;
        for (slot, slot_us) in slots().zip(&mut slots_us) {
            let (number, _) = slot;
            let elapsed_us = now().saturating_duration_since(start).as_micros();
            waiting = waiting.saturating_sub(1);
            let lost = self.standing(number) == Standing::Lost;
            let failed = lost || self.standing(number) == Standing::Doubted;
            let limit_us = self.budget.limit_us(elapsed_us, waiting, failed);
            if self.shared.testing.get() == Some(number) {
                // Its output is not of this world; it is configured again when the test is over.
                self.stand(number, Standing::Lost);
            } else if limit_us == 0 {
                self.health = self.health.with(Health::DEADLINE);
            } else if lost {
                self.configure(slot, limit_us).await;
            } else if self.standing(number) == Standing::Unasked {
                self.stand(number, Standing::Doubted);
            } else if self.read(slot, limit_us, &mut reading).await {
                *slot_us = elapsed_us as u32;
                reading.errors.remove(number);
            }
        }
        (reading.lift_off, reading.micro_g) = self.shared.discretes.get();
        Cycle {
            sample: Sample {
                reading,
                start_us: start.as_micros(),
                slots_us,
            },
            packet: packet::encode(&reading),
            increments: self.shared.integrator.borrow_mut().take(),
            health: core::mem::take(&mut self.health).with(self.gyros.take_health()),
            cycle_us: now().saturating_duration_since(start).as_micros() as u32,
        }
    }

    /// Reads a sensor into the reading; whether it gave a good sample.
    async fn read(&mut self, slot: Slot, limit_us: u64, reading: &mut Reading) -> bool {
        let limit = Duration::from_micros(limit_us);
        let (number, sensor) = slot;
        if sensor.kind == Kind::Gyro {
            let taken = self.shared.clock.within(limit, self.gyros.read(sensor.plate)).await;
            let Some((rate, temperature)) = self.settle(slot, taken).await else {
                return false;
            };
            self.stand(number, Standing::Reading);
            put(&mut reading.gyro, sensor.plate, rate);
            put(&mut reading.gyro_temperature, sensor.plate, temperature);
            return true;
        }
        let (until, mut is_repeated) = (after(limit), false);
        let taken = loop {
            let taken = self.shared.clock.by(until, self.plates.read(sensor)).await;
            // A byte that one disturbance has spoilt is sent again; a part that is gone does not acknowledge that either.
            if is_repeated || !matches!(taken, Ok(Err(_))) {
                break taken;
            }
            is_repeated = true;
        };
        let is_doubted = taken.is_err() && self.standing(number) == Standing::Reading;
        let Some(taken): Option<Taken> = self.settle(slot, taken).await else {
            if is_doubted {
                self.stand(number, Standing::Doubted);
            }
            return false;
        };
        if self.standing(number) != Standing::Reading && !taken.fresh {
            return false;
        }
        self.stand(number, Standing::Reading);
        self.health = self.health.with_if(Health::MAGNETOMETER_OVERFLOW, taken.overflow);
        taken.put(sensor, reading);
        true
    }

    /// Reads the accelerometers that answer before the cycle with this counter, each within `limit_us`.
    async fn read_forces(&mut self, counter: u16, limit_us: u64) {
        let limit = Duration::from_micros(limit_us);
        let mut acc_p = [[NOT_READ; 3]; PLATES];
        let (mut sum_us, mut sensors) = (0, 0);
        for (number, sensor) in slots() {
            let is_known = self.standing(number) == Standing::Reading && self.shared.testing.get() != Some(number);
            if sensor.kind != Kind::Accelerometer || !is_known {
                continue;
            }
            let asked = now();
            match self.shared.clock.within(limit, self.plates.read(sensor)).await {
                Ok(Ok(taken)) if taken.fresh => {
                    put(&mut acc_p, sensor.plate, taken.counts);
                    sum_us = asked.as_micros().saturating_add(sum_us);
                    sensors = u64::saturating_add(sensors, 1);
                }
                Ok(_) => {}
                Err(TimedOut) => {
                    self.recover().await;
                    break;
                }
            }
        }
        if let Some(at_us) = u64::checked_div(sum_us, sensors) {
            let force = self.shared.integrator.borrow_mut().force(at_us, acc_p);
            force
                .into_iter()
                .for_each(|force| self.shared.force.signal((counter, force)));
        }
    }

    /// Asks the magnetometers that answer for what the cycle of this start reads. One that could not be asked has nothing new for it.
    async fn ask_fields(&mut self, votes: &Votes, start: Instant, limit_us: u64) {
        for (number, sensor) in slots() {
            let standing = self.standing(number);
            let is_known = standing != Standing::Lost && self.shared.testing.get() != Some(number);
            if sensor.kind != Kind::Magnetometer || !is_known {
                continue;
            }
            let slot = Duration::from_micros(READ_US.saturating_mul(number as u64));
            let at = start.saturating_add(slot).saturating_sub(ASKED);
            let mut is_asked = false;
            if now() <= at.saturating_add(LATE) {
                votes.waiting(Voter::Acquire, self.shared.clock.until(at)).await;
                let until = after(Duration::from_micros(limit_us));
                // A byte that one disturbance has spoilt is sent again, as in a read.
                for _ in 0..2 {
                    let Some(asking) = self.plates.ask_field(sensor.plate) else {
                        break;
                    };
                    match self.shared.clock.by(until, asking).await {
                        Ok(Ok(())) => is_asked = true,
                        Ok(Err(_)) => continue,
                        Err(TimedOut) if standing == Standing::Doubted => self.abandon((number, sensor)).await,
                        Err(TimedOut) => {
                            self.stand(number, Standing::Unasked);
                            self.recover().await;
                        }
                    }
                    break;
                }
            }
            if !is_asked && self.standing(number) == Standing::Reading {
                self.stand(number, Standing::Configured);
            }
        }
    }

    /// Identifies and configures a sensor that is lost.
    async fn configure(&mut self, slot: Slot, limit_us: u64) {
        let limit = Duration::from_micros(limit_us);
        let (number, sensor) = slot;
        let known = match sensor.kind {
            Kind::Gyro => {
                let done = self
                    .shared
                    .clock
                    .within(limit, self.gyros.configure(sensor.plate))
                    .await;
                self.settle(slot, done).await.is_some()
            }
            _ => {
                let done = self.shared.clock.within(limit, self.plates.configure(sensor)).await;
                self.settle(slot, done).await.is_some()
            }
        };
        if known {
            self.stand(number, Standing::Configured);
        }
    }

    /// Compares a sensor's settings with what was written.
    async fn verify(&mut self, slot: Slot, limit_us: u64) {
        let limit = Duration::from_micros(limit_us);
        let (number, sensor) = slot;
        if self.standing(number) == Standing::Lost || self.shared.testing.get() == Some(number) {
            return;
        }
        let kept = match sensor.kind {
            Kind::Gyro => {
                let kept = self.shared.clock.within(limit, self.gyros.verify(sensor.plate)).await;
                self.settle(slot, kept).await.is_some()
            }
            _ => {
                let kept = self.shared.clock.within(limit, self.plates.verify(sensor)).await;
                self.settle(slot, kept).await.is_some()
            }
        };
        if !kept {
            self.health = self.health.with(Health::RECONFIGURED);
            self.configure(slot, limit_us).await;
        }
    }

    /// The value, if there is one; otherwise the sensor is lost, and after a timeout the bus is freed.
    async fn settle<T, E: Display>(&mut self, slot: Slot, outcome: Result<Result<T, E>, TimedOut>) -> Option<T> {
        match outcome {
            Ok(Ok(value)) => return Some(value),
            Ok(Err(error)) => self.lose(slot, &error),
            Err(TimedOut) => self.abandon(slot).await,
        }
        None
    }

    /// A sensor that was cut off in the middle of a transfer.
    async fn abandon(&mut self, slot: Slot) {
        self.lose(slot, &"no answer in time");
        if slot.1.kind != Kind::Gyro {
            self.recover().await;
        }
    }

    /// Frees the bus. Where a transfer still holds it, that is a self-test's, which is cut off then.
    async fn recover(&mut self) {
        self.health = self.health.with(Health::BUS_RECOVERED);
        if self.switch.is_held() {
            self.shared.bus_wanted.signal(());
        }
        self.switch.recover().await;
    }

    /// What is known of the sensor at this place of the reading order.
    fn standing(&self, number: usize) -> Standing {
        self.standing.get(number).copied().unwrap_or(Standing::Lost)
    }

    fn stand(&mut self, number: usize, standing: Standing) {
        put(&mut self.standing, number, standing);
    }

    fn lose(&mut self, (number, sensor): Slot, why: &dyn Display) {
        if self.standing(number) != Standing::Lost {
            self.stand(number, Standing::Lost);
            self.shared.say(format_args!("{sensor} lost: {why}"));
        }
    }
}
