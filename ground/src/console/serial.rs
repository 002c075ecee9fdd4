//! The umbilical on a serial port: 115200 baud, 8 data bits, no parity, 1 stop bit.
//!
//! In: a port's name. Out: a [`Line`] that survives unplugging: whatever goes wrong with the port, it is closed and
//! tried again every second, also when it was not there at the start.

use std::{
    io::{self, Read, Write},
    time::{Duration, Instant},
};

use serialport::{DataBits, FlowControl, Parity, SerialPort, StopBits};

use super::line::{Heard, Line};

/// The umbilical's rate.
pub const BAUD: u32 = 115_200;

/// Time between two looks for an absent port.
const RETRY: Duration = Duration::from_secs(1);

/// More than the unit says in one wait at [`BAUD`].
const PIECE_BYTES: usize = 4096;

/// A serial port that may be absent.
pub struct SerialLine {
    name: String,
    opened: Instant,
    retry: Duration,
    port: Port,
}

enum Port {
    /// Never looked for.
    Unknown,
    Open(Box<dyn SerialPort>),
    /// Not to be looked for before this time.
    Absent {
        until: Duration,
    },
}

impl SerialLine {
    /// A line on the port called `name`, which need not be there yet.
    pub fn new(name: &str) -> Self {
        SerialLine {
            name: name.to_owned(),
            opened: Instant::now(),
            retry: RETRY,
            port: Port::Unknown,
        }
    }

    fn look(&mut self, wait: Duration) -> Heard {
        let builder = serialport::new(&self.name, BAUD)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .timeout(wait);
        match builder.open() {
            Ok(port) => {
                self.port = Port::Open(port);
                Heard::Plugged
            }
            Err(error) => {
                let first = matches!(self.port, Port::Unknown);
                let told = self.lost();
                if first { Heard::Unplugged(advice(&error)) } else { told }
            }
        }
    }

    fn lost(&mut self) -> Heard {
        self.port = Port::Absent {
            until: self.now() + self.retry,
        };
        Heard::Silence
    }
}

impl Line for SerialLine {
    fn name(&self) -> &str {
        &self.name
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn hear(&mut self, wait: Duration) -> Heard {
        let now = self.now();
        let port = match &mut self.port {
            Port::Open(port) => port,
            Port::Absent { until } if now < *until => {
                std::thread::sleep(wait.min(*until - now));
                return Heard::Silence;
            }
            Port::Unknown | Port::Absent { .. } => return self.look(wait),
        };
        let mut piece = [0; PIECE_BYTES];
        let read = port
            .set_timeout(wait)
            .map_err(io::Error::from)
            .and_then(|()| port.read(&mut piece));
        match read {
            // A read that is ready and empty is how a vanished device ends.
            Ok(0) => {
                self.lost();
                Heard::Unplugged("the port closed".into())
            }
            Ok(length) => Heard::Bytes {
                at: self.now(),
                bytes: piece.into_iter().take(length).collect(),
            },
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                Heard::Silence
            }
            Err(error) => {
                self.lost();
                Heard::Unplugged(error.to_string())
            }
        }
    }

    fn say(&mut self, bytes: &[u8]) -> io::Result<()> {
        let Port::Open(port) = &mut self.port else {
            return Err(io::Error::new(io::ErrorKind::NotConnected, "unplugged"));
        };
        port.write_all(bytes)
    }
}

/// What the system says, and what to do about it.
fn advice(error: &serialport::Error) -> String {
    let ports = serialport::available_ports().unwrap_or_default();
    let names: Vec<_> = ports.into_iter().map(|port| port.port_name).collect();
    let present = if names.is_empty() {
        "none".into()
    } else {
        names.join(", ")
    };
    match error.kind() {
        serialport::ErrorKind::Io(io::ErrorKind::PermissionDenied) => {
            format!("{error}: your user may not open it (on Linux: join the group dialout)")
        }
        _ => format!("{error}; waiting for it; ports present: {present}"),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use serialport::TTYPort;

    use super::*;

    /// Longest wait for a pseudo-terminal to pass a byte on: ends early when it does.
    const PATIENCE: Duration = Duration::from_secs(5);

    #[test]
    fn an_absent_port_is_waited_for_used_lost_and_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("umbilical");
        let mut line = SerialLine {
            retry: Duration::ZERO,
            ..SerialLine::new(&path.to_string_lossy())
        };
        assert!(matches!(line.hear(PATIENCE), Heard::Unplugged(why) if why.contains("waiting for it")));
        assert_eq!(line.hear(PATIENCE), Heard::Silence, "told once");
        assert!(line.say(b"G_ST").is_err());

        for words in [b"G_ST", b"G_VE"] {
            let (mut unit, ours) = TTYPort::pair().unwrap();
            symlink(ours.name().unwrap(), &path).unwrap();
            drop(ours);
            assert_eq!(line.hear(PATIENCE), Heard::Plugged);
            unit.write_all(b">ok\r\n").unwrap();
            assert!(matches!(line.hear(PATIENCE), Heard::Bytes { bytes, .. } if bytes.starts_with(b">")));
            line.say(words).unwrap();
            let mut heard = [0; 4];
            unit.set_timeout(PATIENCE).unwrap();
            unit.read_exact(&mut heard).unwrap();
            assert_eq!(&heard, words);

            std::fs::remove_file(&path).unwrap();
            drop(unit);
            let lost =
                std::iter::repeat_with(|| line.hear(PATIENCE)).find(|heard| !matches!(heard, Heard::Bytes { .. }));
            assert!(matches!(lost, Some(Heard::Unplugged(_))), "{lost:?}");
            assert_eq!(line.hear(PATIENCE), Heard::Silence);
        }
    }
}
