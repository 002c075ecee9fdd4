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
    /// A part holds SDA low until it has seen so many clock pulses; nine after a byte that was cut off at its start.
    SdaHeld(u8),
    /// The bus is held for good (`true`) or released.
    BusStuck(bool),
    /// The controller has sent a STOP out of place, and sends no START again until it is reset (STM32F407 errata ES0182, "Start
    /// cannot be generated after a misplaced Stop").
    StopMisplaced,
    /// The channels of this plate and the next are bridged (`true`): whichever is selected, the parts of both answer, each
    /// address twice.
    Bridged(usize, bool),
    /// The I2C part in this reading-order slot holds SCL low for so long \[ns\] whenever it is called; 0: no longer.
    Stretching(usize, Nanos),
    /// The sensor in this reading-order slot answers random words (`true`) or is itself again.
    Garbage(usize, bool),
    /// It answers as it did first, again and again (`true`), or is itself again.
    Frozen(usize, bool),
    /// The I2C part in this slot does not acknowledge this byte written to it, 0 its address; `None`: it does again.
    Nack(usize, Option<u8>),
    /// The recorder's memory is busy for ever (`true`) or answers again.
    NandDead(bool),
    /// There is no recorder's memory.
    NandAbsent,
    /// So many of a thousand reads of its pages find a wrong bit in each half.
    NandFlips(u32),
    /// The supply falls below what a program needs (`true`) or is back.
    SupplyFailing(bool),
    /// The power goes and comes back: what the recorder's memory was doing tears, in the way of this number, and every
    /// part starts as after switching on.
    PowerCut(usize),
    /// The controller's DMA stands still in mid-transfer and cannot be switched off: whoever waits in place for it to stop
    /// never comes round. A reset frees it.
    DmaHung,
    /// The processor is kept from the unit for so long \[ns\], as by a storm of interrupts. Host board only.
    Busy(Nanos),
    /// The firmware panics: it leaves a crash record and resets itself. Host board only.
    Panic,
    /// The processor runs in a circle the next time it serves this end. Host board only.
    Hang(End),
    /// The unit's clock steps by so much \[us\]. Host board only.
    ClockSteps(i64),
    /// The lift-off line, as the unit finds it.
    LiftOff(Level),
    /// The micro-gravity line.
    MicroG(Level),
    /// The telemetry line takes no byte (`true`) or does again. Host board only.
    TelemetryStuck(bool),
    /// The umbilical takes no byte from the unit (`true`) or does again. Host board only.
    UmbilicalStuck(bool),
    /// A byte on both lines takes so many times as long. Host board only.
    LinesSlow(u32),
    /// The umbilical towards the unit is disturbed (`true`): every byte on it arrives with an error, be it of framing, noise
    /// or overrun.
    UmbilicalNoise(bool),
    /// The umbilical towards the unit is held low (`true`): one frame after the other without a stop bit, as fast as the line
    /// carries them, whatever is said meanwhile.
    UmbilicalBreak(bool),
    /// This bit of the memory that survives a reset flips, counted round it, and a reset follows.
    KeptFlip(u32),
    /// This bit of the RAM flips, counted round it. Emulated board only.
    RamFlip(u32),
    /// This bit of the firmware's image in flash flips, counted round it. Host board only.
    ImageFlip(u32),
    /// The crystal stops. Emulated board only.
    CrystalLost,
    /// The reset pin.
    Reset,
}

/// An end of the processor: what one part of the unit or two serve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum End {
    SensorBus,
    Gyros,
    Telemetry,
    UmbilicalOut,
    UmbilicalIn,
    Discretes,
    Nand,
}

impl End {
    /// Every end.
    pub const ALL: [End; 7] = [
        End::SensorBus,
        End::Gyros,
        End::Telemetry,
        End::UmbilicalOut,
        End::UmbilicalIn,
        End::Discretes,
        End::Nand,
    ];
}

/// What drives one of the vehicle's lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Level {
    /// The vehicle, as the world has it.
    #[default]
    World,
    /// Asserted for good.
    High,
    /// Never asserted: the wire is broken.
    Low,
    /// A contact that opens and closes every so long \[ns\].
    Bouncing(Nanos),
}

impl Level {
    /// The level at `now`, where the world has it at `world`.
    pub fn at(self, now: Nanos, world: bool) -> bool {
        match self {
            Level::World => world,
            Level::High => true,
            Level::Low => false,
            Level::Bouncing(half) => (now / half.max(1)).is_multiple_of(2),
        }
    }
}

/// A fault and when it strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scheduled {
    /// Instant.
    pub at: Nanos,
    /// What happens.
    pub fault: Fault,
}
