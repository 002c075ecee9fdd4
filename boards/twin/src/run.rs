//! A run of the unit as seen from outside: what its lines say, what is said to it, and what befalls it.
//!
//! The host board and the emulated board both run the unit against a [`Bench`], so whoever watches need not know which.

use crate::part::Nanos;

/// Whether a run goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Go on.
    Continue,
    /// End the run now.
    Stop,
}

/// Whoever stands beside the unit: hears both lines, speaks on the umbilical, watches the time.
pub trait Bench {
    /// Bytes that left on the telemetry line; `at` is the instant the last one was complete.
    fn telemetry(&mut self, at: Nanos, bytes: &[u8]);
    /// Bytes that left on the umbilical.
    fn umbilical(&mut self, at: Nanos, bytes: &[u8]);
    /// A decoded log line of the firmware (defmt); the host board has none.
    fn log(&mut self, at: Nanos, line: &str);
    /// Asked for every millisecond of virtual time: bytes to send to the unit on the umbilical from `now` on. The
    /// emulated board asks up to 20 ms ahead of what it has let hear.
    fn commands(&mut self, now: Nanos) -> Vec<u8>;
    /// Told at least every 100 ms of virtual time; decides whether to go on.
    fn advanced(&mut self, now: Nanos) -> Flow;
}

/// Something that befalls the unit during a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The sensor in this reading-order slot stops answering (removed, dead).
    Silent(usize),
    /// It answers again, with its registers at their power-on values.
    Restored(usize),
    /// The multiplexer is gone, and with it all plates' I2C parts.
    MuxSilent(bool),
    /// A part holds SDA low until it has seen nine clock pulses.
    SdaHeld,
    /// The bus is held for good (`true`) or released.
    BusStuck(bool),
    /// The I2C part in this reading-order slot holds SCL low for so long [ns] whenever it is called; 0: no longer.
    Stretching(usize, Nanos),
    /// The gyro of this plate answers noise (`true`) or is itself again.
    GyroGarbage(usize, bool),
    /// The recorder's memory is busy for ever (`true`) or answers again.
    NandDead(bool),
    /// There is no recorder's memory.
    NandAbsent,
    /// The supply falls below what a program needs (`true`) or is back.
    SupplyFailing(bool),
    /// The power goes and comes back: what the recorder's memory was doing tears, in the way of this number, and every
    /// part starts as after switching on.
    PowerCut(usize),
    /// The controller's DMA stands still in mid-transfer and cannot be switched off: whoever waits in place for it to stop
    /// never comes round. A reset frees it.
    DmaHung,
    /// The processor is kept from the unit for so long [ns], as by a storm of interrupts. Host board only.
    Busy(Nanos),
    /// The firmware panics: it leaves a crash record and resets itself. Host board only.
    Panic,
    /// The reset pin.
    Reset,
}

/// A fault and when it strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scheduled {
    /// Instant.
    pub at: Nanos,
    /// What happens.
    pub fault: Fault,
}
