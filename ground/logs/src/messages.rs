//! A flight as messages: one MCAP file, which Foxglove and PlotJuggler open without an importer (mcap.dev/spec).
//!
//! In: [`StreamEntry`]s with their times, lines of the log. Out: topics in JSON, each with its schema:
//!
//! | topic | schema | what |
//! |---|---|---|
//! | `/packet` | `emems.Packet` | counter, error identifier, lift-off, micro-gravity |
//! | `/counts`, `/si` | `emems.Counts`, `emems.Si` | a number a channel, as in counts.csv and si.csv; one that was not read is left out |
//! | `/estimate` | `emems.Estimate` | calibrated vectors in b, sigma of attitude and bias, mode, health |
//! | `/attitude`, `/triad` | `foxglove.FrameTransform` | frame `b` (`b_triad`) in `n`, north-east-down, at its own instant |
//! | `/frames` | `foxglove.FrameTransform` | `n` in `enu`, so that a display whose z is up shows the unit upright; once |
//! | `/log` | `foxglove.Log` | what the log says, and what is missing or broken in the stream |
//!
//! Times are nanoseconds, as in the tables: a packet's number times the cycle; a line of a flight's log has the time since power-on.
//! The schemas `foxglove.*` are those of
//! docs.foxglove.dev/docs/sdk/schemas, by name.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufWriter},
    path::Path,
};

use emems::{derived::Derived, increments::Increments, sample::Reading};
use mcap::{WriteOptions, Writer, records::MessageHeader};
use packets::channel::{self, CHANNELS};
use serde_json::{Map, Value, json};

use crate::digest::StreamEntry;

/// Foxglove's numbers of a log line's level.
const INFO: u8 = 2;
const WARNING: u8 = 3;

/// The axes north-east-down in east-north-up, scalar first: half a turn about the line between north and east.
const NED_IN_ENU: [f64; 4] = [
    0.0,
    std::f64::consts::FRAC_1_SQRT_2,
    std::f64::consts::FRAC_1_SQRT_2,
    0.0,
];

/// A file being written.
pub struct Messages {
    writer: Writer<BufWriter<File>>,
    topics: BTreeMap<&'static str, Topic>,
    /// Number and counter of the latest packet, which says the number of a derived frame.
    latest: Option<(u64, u16)>,
}

struct Topic {
    channel: u16,
    sequence: u32,
}

impl Messages {
    /// Begins a file that must not exist yet.
    ///
    /// # Errors
    /// When it cannot be written; so below.
    pub fn create(path: &Path) -> io::Result<Self> {
        let file = BufWriter::new(File::create_new(path)?);
        let writer = WriteOptions::new()
            .compression(None)
            .profile("")
            .library(concat!("ground ", env!("CARGO_PKG_VERSION")))
            .create(file)
            .map_err(io::Error::other)?;
        let mut messages = Messages {
            writer,
            topics: BTreeMap::new(),
            latest: None,
        };
        messages.put("/frames", 0.0, transform(0.0, "enu", "n", NED_IN_ENU))?;
        Ok(messages)
    }

    /// What was found in the telemetry; `remark` is what is to be said of it.
    pub fn entry(&mut self, entry: &StreamEntry, cycle_s: f64, remark: Option<&str>) -> io::Result<()> {
        match entry {
            StreamEntry::Packet { number, reading, .. } => {
                self.latest = Some((*number, reading.counter));
                self.packet(*number as f64 * cycle_s, reading)?;
            }
            StreamEntry::Derived(derived) => self.estimate(self.number(derived) as f64 * cycle_s, derived)?,
            StreamEntry::Line { .. } | StreamEntry::Reject(_) => {}
        }
        match remark {
            Some(remark) => {
                let t_s = self.latest.map_or(0.0, |(number, _)| number as f64 * cycle_s);
                let level = if matches!(entry, StreamEntry::Line { .. }) {
                    INFO
                } else {
                    WARNING
                };
                self.line(t_s, level, remark)
            }
            None => Ok(()),
        }
    }

    /// A line of the log.
    pub fn log(&mut self, t_s: f64, line: &str) -> io::Result<()> {
        self.line(t_s, INFO, line)
    }

    /// Writes index and end.
    pub fn finish(mut self) -> io::Result<()> {
        self.writer.finish().map(drop).map_err(io::Error::other)
    }

    /// Of the packet that a derived frame belongs to: at most half the counter's range from the latest.
    fn number(&self, derived: &Derived) -> u64 {
        let Some((number, counter)) = self.latest else {
            return derived.counter.into();
        };
        let ahead = derived.counter.wrapping_sub(counter).cast_signed();
        number.saturating_add_signed(ahead.into())
    }

    fn packet(&mut self, t_s: f64, reading: &Reading) -> io::Result<()> {
        let packet = json!({
            "counter": reading.counter,
            "errors": reading.errors.0,
            "lift_off": reading.lift_off,
            "micro_g": reading.micro_g,
        });
        self.put("/packet", t_s, packet)?;
        let counts = channel::counts(reading);
        let values = |of: &dyn Fn(usize, i16) -> Option<Value>| -> Map<String, Value> {
            let value = |k: usize| Some((CHANNELS[k].name.to_owned(), of(k, counts[k]?)?));
            (0..CHANNELS.len()).filter_map(value).collect()
        };
        let (in_counts, in_si) = (
            values(&|_, counts| Some(counts.into())),
            values(&|k, counts| CHANNELS[k].quantity.meant(counts).map(Value::from)),
        );
        self.put("/counts", t_s, in_counts.into())?;
        self.put("/si", t_s, in_si.into())
    }

    fn estimate(&mut self, t_s: f64, derived: &Derived) -> io::Result<()> {
        let estimate = &derived.estimate;
        let [nn, _, _, ee, _, dd] = estimate.covariance_n;
        let sigma_deg = |variance: f32| f64::from(variance).max(0.0).sqrt().to_degrees();
        let message = json!({
            "mode": derived.mode.name(),
            "health": derived.health.0,
            "cycle_us": derived.cycle_us,
            "force_b": xyz(estimate.force_b),
            "field_b_ut": xyz(estimate.field_b_ut),
            "rate_b": xyz(estimate.rate_b),
            "attitude_sigma_n_deg": { "n": sigma_deg(nn), "e": sigma_deg(ee), "d": sigma_deg(dd) },
            "bias_b": xyz(estimate.bias_b),
            "bias_sigma_b": xyz(estimate.bias_sd),
        });
        self.put("/estimate", t_s, message)?;
        let at_s = t_s + 1e-6 * since_start_us(derived.start_us, &derived.increments);
        if let Some(q_nb) = estimate.q_nb {
            self.put("/attitude", at_s, transform(at_s, "n", "b", q_nb.map(f64::from)))?;
        }
        if let Some(triad_nb) = estimate.triad_nb {
            self.put("/triad", t_s, transform(t_s, "n", "b_triad", triad_nb.map(f64::from)))?;
        }
        Ok(())
    }

    fn line(&mut self, t_s: f64, level: u8, line: &str) -> io::Result<()> {
        let message = json!({
            "timestamp": timestamp(t_s), "level": level, "message": line, "name": "e-mems", "file": "", "line": 0,
        });
        self.put("/log", t_s, message)
    }

    fn put(&mut self, topic: &'static str, t_s: f64, message: Value) -> io::Result<()> {
        let known = match self.topics.get_mut(topic) {
            Some(known) => known,
            None => {
                let (name, schema) = schema(topic);
                let schema = serde_json::to_vec(&schema)?;
                let schema = self
                    .writer
                    .add_schema(name, "jsonschema", &schema)
                    .map_err(io::Error::other)?;
                let channel = self
                    .writer
                    .add_channel(schema, topic, "json", &BTreeMap::new())
                    .map_err(io::Error::other)?;
                self.topics.entry(topic).or_insert(Topic { channel, sequence: 0 })
            }
        };
        let header = MessageHeader {
            channel_id: known.channel,
            sequence: known.sequence,
            log_time: nanoseconds(t_s),
            publish_time: nanoseconds(t_s),
        };
        known.sequence = known.sequence.wrapping_add(1);
        self.writer
            .write_to_known_channel(&header, &serde_json::to_vec(&message)?)
            .map_err(io::Error::other)
    }
}

/// \[us\] when the filter's attitude is meant, after the cycle's start.
fn since_start_us(start_us: u64, increments: &Increments) -> f64 {
    increments.end_us as f64 - start_us as f64
}

/// Times before 0, of a log line before the first packet, are 0.
fn nanoseconds(t_s: f64) -> u64 {
    (1e9 * t_s).round() as u64
}

fn timestamp(t_s: f64) -> Value {
    const A_SECOND: u64 = 1_000_000_000;
    let nanoseconds = nanoseconds(t_s);
    json!({ "sec": nanoseconds / A_SECOND, "nsec": nanoseconds % A_SECOND })
}

fn xyz(vector: [f32; 3]) -> Value {
    let [x, y, z] = vector;
    json!({ "x": x, "y": y, "z": z })
}

/// The child's axes in the parent's; scalar first.
fn transform(t_s: f64, parent: &str, child: &str, [w, x, y, z]: [f64; 4]) -> Value {
    json!({
        "timestamp": timestamp(t_s),
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": { "x": 0.0, "y": 0.0, "z": 0.0 },
        "rotation": { "x": x, "y": y, "z": z, "w": w },
    })
}

/// A topic's schema: its name and what a reader may expect.
fn schema(topic: &str) -> (&'static str, Value) {
    let number = |what: &str| json!({ "type": "number", "description": what });
    let integer = |what: &str| json!({ "type": "integer", "description": what });
    let text = |what: &str| json!({ "type": "string", "description": what });
    let object = |parts: &[(&str, Value)]| {
        let parts: Map<String, Value> = parts
            .iter()
            .map(|(name, part)| ((*name).to_owned(), part.clone()))
            .collect();
        json!({ "type": "object", "properties": parts })
    };
    let vector = |names: [&str; 3], what: &str| object(&names.map(|name| (name, number(what))));
    let in_b = |what: &str| vector(["x", "y", "z"], what);
    let time = object(&[("sec", integer("s")), ("nsec", integer("ns"))]);
    let channels = |unit: fn(usize) -> &'static str| {
        let part = |k: usize| (CHANNELS[k].name, number(unit(k)));
        object(&(0..CHANNELS.len()).map(part).collect::<Vec<_>>())
    };
    match topic {
        "/packet" => (
            "emems.Packet",
            object(&[
                ("counter", integer("number of the cycle, modulo 65,536")),
                ("errors", integer("error identifier: bit k is the k-th sensor read")),
                ("lift_off", json!({ "type": "boolean" })),
                ("micro_g", json!({ "type": "boolean" })),
            ]),
        ),
        "/counts" => ("emems.Counts", channels(|_| "counts")),
        "/si" => ("emems.Si", channels(|k| CHANNELS[k].quantity.unit())),
        "/estimate" => (
            "emems.Estimate",
            object(&[
                ("mode", text("mode of the unit")),
                ("health", integer("bits; see the derived frame")),
                (
                    "cycle_us",
                    integer("us from the start of the cycle to the closing of its packet"),
                ),
                ("force_b", in_b("m/s²")),
                ("field_b_ut", in_b("µT")),
                ("rate_b", in_b("rad/s")),
                (
                    "attitude_sigma_n_deg",
                    vector(["n", "e", "d"], "deg, one sigma about the axes of n"),
                ),
                ("bias_b", in_b("rad/s")),
                ("bias_sigma_b", in_b("rad/s, one sigma")),
            ]),
        ),
        "/log" => (
            "foxglove.Log",
            object(&[
                ("timestamp", time),
                ("level", integer("2 info, 3 warning")),
                ("message", text("the line")),
                ("name", text("who says it")),
                ("file", text("")),
                ("line", integer("")),
            ]),
        ),
        _ => (
            "foxglove.FrameTransform",
            object(&[
                ("timestamp", time),
                ("parent_frame_id", text("frame whose axes it is given in")),
                ("child_frame_id", text("frame that is turned")),
                ("translation", in_b("m")),
                (
                    "rotation",
                    object(&["x", "y", "z", "w"].map(|name| (name, number("quaternion, child to parent")))),
                ),
            ]),
        ),
    }
}

#[cfg(test)]
mod tests {
    use emems::packet::encode;

    use super::*;
    use crate::digest::Digest;

    #[test]
    fn what_is_written_is_read_again_with_its_times() {
        let place = tempfile::tempdir().expect("temporary folder");
        let file = place.path().join("flight.mcap");
        let mut messages = Messages::create(&file).expect("created");
        let mut seven = Reading::unread(7);
        seven.gyro[2] = -5;
        let entries = Digest::default().push(None, &[encode(&seven), encode(&Reading::unread(9))].concat());
        for entry in &entries {
            messages.entry(entry, 0.2, Some("said")).expect("written");
        }
        messages.log(-1.0, "before all").expect("written");
        messages.finish().expect("finished");
        let bytes = std::fs::read(&file).expect("there");
        let read: Vec<(String, u64, Value)> = mcap::MessageStream::new(&bytes)
            .expect("MCAP")
            .map(|message| message.expect("a message"))
            .map(|message| {
                let value = serde_json::from_slice(&message.data).expect("JSON");
                (message.channel.topic.clone(), message.log_time, value)
            })
            .collect();
        let of = |topic: &str| read.iter().filter(|(found, ..)| found == topic).collect::<Vec<_>>();
        let [first, second] = of("/si")[..] else {
            panic!("{read:?}")
        };
        assert_eq!((first.1, second.1), (1_400_000_000, 1_800_000_000));
        assert!((first.2["g3"].as_f64().expect("a number") + 5.0 * channel::GYRO_LSB).abs() < 1e-12);
        assert_eq!(second.2, json!({}), "what was not read is left out");
        assert_eq!(of("/counts")[0].2, json!({ "g3": -5 }));
        assert_eq!(of("/log").len(), 3);
        assert_eq!(of("/log")[2].1, 0);
        let schemas = mcap::Summary::read(&bytes)
            .expect("a summary")
            .expect("an index")
            .schemas;
        assert!(schemas.values().any(|schema| schema.name == "foxglove.FrameTransform"));
    }

    /// A vector's components in east-north-up from those in n, by the transform that is written.
    #[test]
    fn down_is_down_and_north_is_north_in_a_display() {
        let [w, i, j, k] = NED_IN_ENU;
        let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
        let [x, y, z] = [nalgebra::Vector3::x(), nalgebra::Vector3::y(), nalgebra::Vector3::z()];
        assert!((q * x - y).norm() < 1e-12 && (q * y - x).norm() < 1e-12 && (q * z + z).norm() < 1e-12);
    }
}
