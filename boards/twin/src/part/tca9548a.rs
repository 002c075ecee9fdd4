//! TCA9548A: the switch between the controller and the plates, with everything behind it.
//!
//! The one target the controller sees: it answers for its own address and passes the rest to the parts on the selected
//! channels. A write reaches every part that acknowledged; what several parts drive at once is the wired AND. A channel
//! is switched at the STOP after the control register was written (datasheet, control register), and the reset line
//! deselects all.

use std::collections::BTreeMap;

use super::{I2cPart, Nanos, signal::Noise};

/// 7-bit address with A2, A1, A0 low.
pub const ADDRESS: u8 = 0x70;

/// What a controller reads where nobody drives the line.
const RELEASED: u8 = 0xFF;

/// A part in its place on a channel, which may be empty or dead.
struct Socket {
    part: Box<dyn I2cPart>,
    silent: bool,
    garbage: bool,
    /// What was read first since it froze, by register and byte after it.
    frozen: Option<BTreeMap<(u8, u32), u8>>,
    /// The byte written to it that it does not acknowledge, 0 its address.
    nack: Option<u8>,
    addressed: bool,
    /// Bytes written since START, the first of them, and bytes read.
    written: u8,
    register: u8,
    read: u32,
    /// \[ns\] how long it holds SCL low when it is called.
    stretch: Nanos,
    scl_held_until: Nanos,
    random: Noise,
    struck: [u64; ILLS.len()],
}

/// What may befall a part here, and how often it did.
const ILLS: [&str; 5] = ["silent", "garbage", "frozen", "nack", "stretch"];

impl Socket {
    fn new(part: Box<dyn I2cPart>, random: Noise) -> Self {
        Socket {
            part,
            silent: false,
            garbage: false,
            frozen: None,
            nack: None,
            addressed: false,
            written: 0,
            register: 0,
            read: 0,
            stretch: 0,
            scl_held_until: 0,
            random,
            struck: [0; ILLS.len()],
        }
    }

    /// START with its address; whether it acknowledges.
    fn start(&mut self, read: bool, now: Nanos) -> bool {
        let refuses = self.nack == Some(0);
        self.struck[0] += u64::from(self.silent);
        self.struck[3] += u64::from(refuses && !self.silent);
        if self.silent || refuses || !self.part.start(read, now) {
            return false;
        }
        self.read = 0;
        if !read {
            self.written = 0;
        }
        if self.stretch > 0 {
            self.scl_held_until = now + self.stretch;
            self.struck[4] += 1;
        }
        true
    }

    fn write(&mut self, byte: u8, now: Nanos) -> bool {
        self.written = self.written.saturating_add(1);
        if self.written == 1 {
            self.register = byte;
        }
        if self.nack == Some(self.written) {
            self.struck[3] += 1;
            return false;
        }
        self.part.write(byte, now)
    }

    fn read(&mut self, now: Nanos) -> u8 {
        let byte = self.part.read(now);
        let place = (self.register, self.read);
        self.read += 1;
        if self.garbage {
            self.struck[1] += 1;
            return self.random.word(self.struck[1]) as u8;
        }
        let Some(frozen) = &mut self.frozen else {
            return byte;
        };
        self.struck[2] += 1;
        *frozen.entry(place).or_insert(byte)
    }
}

/// The switch and its eight channels.
pub struct Tca9548a {
    channels: [Vec<Socket>; 8],
    /// Channels connected now, one bit each.
    connected: u8,
    /// Control register; takes effect at STOP.
    control: u8,
    addressed: bool,
    silent: bool,
    /// Channels whose lines are connected to each other, one bit each; and bytes that two parts drove at once.
    bridged: u8,
    twice: u64,
}

impl Tca9548a {
    /// A switch with `channels[n]` on channel n, powered at time 0: nothing is selected. Channels beyond 7 are left out.
    pub fn new(channels: impl IntoIterator<Item = Vec<Box<dyn I2cPart>>>) -> Self {
        let mut number = 0;
        let mut sockets = channels.into_iter().map(|parts| {
            let socket = |part| {
                number += 1;
                Socket::new(part, Noise::new(number))
            };
            parts.into_iter().map(socket).collect()
        });
        Tca9548a {
            channels: core::array::from_fn(|_| sockets.next().unwrap_or_default()),
            connected: 0,
            control: 0,
            addressed: false,
            silent: false,
            bridged: 0,
            twice: 0,
        }
    }

    /// Channels that are connected, one bit each.
    fn reached(&self) -> u8 {
        match (self.silent, self.connected & self.bridged) {
            (true, _) => 0,
            (_, 0) => self.connected,
            _ => self.connected | self.bridged,
        }
    }

    fn selected(&mut self) -> impl Iterator<Item = &mut Socket> {
        let connected = self.reached();
        self.channels
            .iter_mut()
            .enumerate()
            .filter(move |(channel, _)| connected >> channel & 1 == 1)
            .flat_map(|(_, sockets)| sockets)
    }

    fn addressed(&mut self) -> impl Iterator<Item = &mut Socket> {
        self.selected().filter(|socket| socket.addressed)
    }

    /// START (or repeated START) and an address; `read` is the direction bit. Returns whether anyone acknowledges.
    pub fn start(&mut self, address: u8, read: bool, now: Nanos) -> bool {
        self.addressed = address == ADDRESS && !self.silent;
        let mut acknowledged = self.addressed;
        for socket in self.selected() {
            socket.addressed = socket.part.address() == address && socket.start(read, now);
            acknowledged |= socket.addressed;
        }
        acknowledged
    }

    /// A byte from the controller; returns whether anyone acknowledges.
    pub fn write(&mut self, byte: u8, now: Nanos) -> bool {
        if self.addressed {
            self.control = byte;
        }
        self.addressed()
            .fold(false, |acknowledged, socket| socket.write(byte, now) | acknowledged)
            | self.addressed
    }

    /// A byte for the controller.
    pub fn read(&mut self, now: Nanos) -> u8 {
        let own = if self.addressed { self.control } else { RELEASED };
        let mut drive = 0;
        let line = self.addressed().fold(own, |line, socket| {
            drive += 1;
            line & socket.read(now)
        });
        self.twice += u64::from(self.bridged != 0 && drive > 1);
        line
    }

    /// STOP.
    pub fn stop(&mut self, now: Nanos) {
        for socket in self.addressed() {
            socket.addressed = false;
            socket.part.stop(now);
        }
        self.addressed = false;
        self.connected = self.control;
    }

    /// The reset line is pulled: no channel is selected, the transfer under way is over.
    pub fn reset(&mut self) {
        for socket in self.channels.iter_mut().flatten() {
            socket.addressed = false;
        }
        self.addressed = false;
        self.control = 0;
        self.connected = 0;
    }

    /// Until when a part on a connected channel holds SCL low. A disconnected one does so unseen.
    pub fn scl_held_until(&self) -> Nanos {
        let connected = self.reached();
        (self.channels.iter().enumerate())
            .filter(|(channel, _)| connected >> channel & 1 == 1)
            .flat_map(|(_, sockets)| sockets)
            .map(|socket| socket.scl_held_until)
            .max()
            .unwrap_or(0)
    }

    /// What is on two channels changes places. Channels beyond 7 are left alone.
    pub fn exchange(&mut self, a: usize, b: usize) {
        if a.max(b) < self.channels.len() {
            self.channels.swap(a, b);
        }
    }

    /// Another part in the place of the one at `address` on `channel`.
    pub fn replace(&mut self, channel: usize, address: u8, mut part: impl I2cPart + 'static) {
        if let Some(socket) = self.sockets(channel, address).next() {
            part.power_on(0);
            socket.part = Box::new(part);
        }
    }

    /// The part at `address` on `channel` holds SCL low for `duration` after each time it acknowledges its address.
    pub fn stretch_part(&mut self, channel: usize, address: u8, duration: Nanos) {
        self.sockets(channel, address)
            .for_each(|socket| socket.stretch = duration);
    }

    /// The part at `address` on `channel` answers random bytes, or is itself again.
    pub fn babble_part(&mut self, channel: usize, address: u8, babbling: bool) {
        self.sockets(channel, address)
            .for_each(|socket| socket.garbage = babbling);
    }

    /// The part at `address` on `channel` answers each register as it did first from now on, or is itself again.
    pub fn freeze_part(&mut self, channel: usize, address: u8, frozen: bool) {
        self.sockets(channel, address)
            .for_each(|socket| socket.frozen = frozen.then(BTreeMap::new));
    }

    /// The part at `address` on `channel` does not acknowledge this byte written to it, 0 its address.
    pub fn refuse_part(&mut self, channel: usize, address: u8, byte: Option<u8>) {
        self.sockets(channel, address).for_each(|socket| socket.nack = byte);
    }

    /// The lines of this channel and the next are connected to each other, or no longer.
    pub fn bridge(&mut self, channel: usize, bridged: bool) {
        self.bridged = if bridged { 0b11 << (channel & 7) } else { 0 };
    }

    /// How often faults of its parts did something, by name.
    pub fn struck(&self) -> impl Iterator<Item = (&'static str, u64)> {
        let sockets = self.channels.iter().flatten();
        let of_parts = sockets.flat_map(|socket| ILLS.into_iter().zip(socket.struck));
        of_parts.chain([("bridged", self.twice)])
    }

    fn sockets(&mut self, channel: usize, address: u8) -> impl Iterator<Item = &mut Socket> {
        let sockets = self.channels.get_mut(channel).into_iter().flatten();
        sockets.filter(move |socket| socket.part.address() == address)
    }

    /// The switch is gone (`true`), and all behind it out of reach, or is back, deselected.
    pub fn silence(&mut self, silent: bool) {
        self.reset();
        self.silent = silent;
    }

    /// The part at `address` on `channel` is dead (`true`), or is back with its power-on registers. A place without a
    /// part is left alone.
    pub fn silence_part(&mut self, channel: usize, address: u8, silent: bool, now: Nanos) {
        for socket in self.sockets(channel, address) {
            socket.silent = silent;
            socket.addressed = false;
            if !silent {
                socket.part.power_on(now);
            }
        }
    }

    /// Power returns: no channel is selected, and the parts' registers take their defaults.
    pub fn power_on(&mut self, now: Nanos) {
        self.reset();
        for socket in self.channels.iter_mut().flatten() {
            socket.addressed = false;
            socket.part.power_on(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One register at one address: the last byte written to it.
    struct Register {
        address: u8,
        value: u8,
    }

    impl I2cPart for Register {
        fn address(&self) -> u8 {
            self.address
        }
        fn start(&mut self, _read: bool, _now: Nanos) -> bool {
            true
        }
        fn write(&mut self, byte: u8, _now: Nanos) -> bool {
            self.value = byte;
            true
        }
        fn read(&mut self, _now: Nanos) -> u8 {
            self.value
        }
        fn stop(&mut self, _now: Nanos) {}
        fn power_on(&mut self, _now: Nanos) {
            self.value = 0;
        }
    }

    const A: u8 = 0x18;

    fn tree() -> Tca9548a {
        Tca9548a::new(
            [0x11, 0x22, 0x33].map(|value| vec![Box::new(Register { address: A, value }) as Box<dyn I2cPart>]),
        )
    }

    fn select(mux: &mut Tca9548a, control: u8) {
        assert!(mux.start(ADDRESS, false, 0) && mux.write(control, 0));
        mux.stop(0);
    }

    fn read(mux: &mut Tca9548a, address: u8) -> Option<u8> {
        let byte = mux.start(address, true, 0).then(|| mux.read(0));
        mux.stop(0);
        byte
    }

    #[test]
    fn at_power_on_nothing_is_selected() {
        let mut mux = tree();
        assert_eq!([read(&mut mux, ADDRESS), read(&mut mux, A)], [Some(0x00), None]);
    }

    #[test]
    fn each_channel_leads_to_its_own_parts() {
        let mut mux = tree();
        for (control, value) in [(1, 0x11), (2, 0x22), (4, 0x33)] {
            select(&mut mux, control);
            assert_eq!(
                [read(&mut mux, ADDRESS), read(&mut mux, A)],
                [Some(control), Some(value)]
            );
        }
        assert_eq!(read(&mut mux, 0x19), None);
    }

    #[test]
    fn a_channel_is_switched_at_the_stop() {
        let mut mux = tree();
        assert!(mux.start(ADDRESS, false, 0) && mux.write(1, 0));
        assert!(!mux.start(A, true, 0));
        mux.stop(0);
        assert!(mux.start(A, true, 0));
    }

    #[test]
    fn a_write_reaches_every_selected_part_and_reads_are_a_wired_and() {
        let mut mux = tree();
        select(&mut mux, 3);
        assert_eq!(read(&mut mux, A), Some(0x00));
        assert!(mux.start(A, false, 0) && mux.write(0x5A, 0));
        mux.stop(0);
        for (control, value) in [(1, 0x5A), (2, 0x5A), (4, 0x33)] {
            select(&mut mux, control);
            assert_eq!(read(&mut mux, A), Some(value));
        }
    }

    #[test]
    fn the_reset_line_deselects_in_mid_transfer() {
        let mut mux = tree();
        select(&mut mux, 1);
        assert!(mux.start(A, true, 0));
        mux.reset();
        assert_eq!(mux.read(0), 0xFF);
        mux.stop(0);
        assert_eq!([read(&mut mux, ADDRESS), read(&mut mux, A)], [Some(0x00), None]);
    }

    #[test]
    fn a_silent_part_leaves_the_others_alone_and_comes_back_with_its_defaults() {
        let mut mux = tree();
        select(&mut mux, 1);
        mux.silence_part(0, A, true, 0);
        assert_eq!(read(&mut mux, A), None);
        select(&mut mux, 2);
        assert_eq!(read(&mut mux, A), Some(0x22));
        mux.silence_part(0, A, false, 0);
        mux.silence_part(9, A, true, 0);
        select(&mut mux, 1);
        assert_eq!(read(&mut mux, A), Some(0x00));
    }

    #[test]
    fn a_part_that_is_called_holds_scl_until_it_lets_go_or_its_channel_is_disconnected() {
        let mut mux = tree();
        mux.stretch_part(0, A, 20);
        select(&mut mux, 1);
        assert_eq!(mux.scl_held_until(), 0, "it has not been called yet");
        assert!(mux.start(A, true, 100));
        assert_eq!(mux.scl_held_until(), 120);
        mux.reset();
        assert_eq!(mux.scl_held_until(), 0, "the bus is free, though the part holds on");
        select(&mut mux, 1);
        assert_eq!(mux.scl_held_until(), 120, "and is found holding");
        select(&mut mux, 2);
        assert!(mux.start(A, true, 110));
        assert_eq!(mux.scl_held_until(), 0, "the other plates are not concerned");
    }

    #[test]
    fn a_silent_switch_takes_everything_with_it_and_comes_back_deselected() {
        let mut mux = tree();
        select(&mut mux, 1);
        mux.silence(true);
        assert_eq!([read(&mut mux, ADDRESS), read(&mut mux, A)], [None, None]);
        mux.silence(false);
        assert_eq!([read(&mut mux, ADDRESS), read(&mut mux, A)], [Some(0x00), None]);
    }
}
