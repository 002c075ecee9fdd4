//! What the unit says of itself, read from its lines.
//!
//! In: lines of `G_ST`, `G_VE`, `G_AT` (`src/unit/umbilical.rs`, `src/unit/self_test.rs`). Out: their numbers; `None` where a line is missing
//! or says something else.

use super::evidence::Evidence;

/// One answer to `G_ST`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// WAIT or FLIGHT.
    pub mode: Option<String>,
    /// Safe mode is on.
    pub safe: bool,
    /// Derived frames are on.
    pub derived: Option<bool>,
    /// The lift-off line.
    pub lift_off: Option<bool>,
    /// The micro-gravity line.
    pub micro_g: Option<bool>,
    /// Bytes passed over or damaged on the way to the unit.
    pub noise: Option<u32>,
    /// Pages of the log in use.
    pub used: Option<u32>,
    /// Pages there are.
    pub capacity: Option<u32>,
    /// Blocks that cannot be used.
    pub bad_blocks: Option<u32>,
    /// Bits that were wrong and put right.
    pub corrected: Option<u32>,
    /// Halves of pages that could not be.
    pub lost_halves: Option<u32>,
    /// The line on the newest record, or on what is wrong.
    pub recorder: Option<String>,
    /// Why it started.
    pub started: Option<String>,
    /// Resets since power-on.
    pub resets: Option<u32>,
    /// crystal or internal.
    pub clock: Option<String>,
    /// Stack used and there, in bytes.
    pub stack: Option<(u32, u32)>,
    /// \[mV\] brown-out level set and asked for.
    pub brown_out_mv: Option<(u32, u32)>,
    /// Level of the read-out protection.
    pub read_out: Option<u32>,
    /// Dips of the supply since power-on.
    pub dips: Option<u32>,
}

impl Status {
    /// Every answer in the evidence, the oldest first.
    pub fn all(evidence: &Evidence) -> Vec<Status> {
        let mut all = Vec::new();
        for said in &evidence.said {
            let Some(rest) = said.text.strip_prefix("G_ST ") else {
                continue;
            };
            if rest.starts_with("WAIT") || rest.starts_with("FLIGHT") {
                all.push(Status::default());
            }
            if let Some(status) = all.last_mut() {
                status.take(rest);
            }
        }
        all
    }

    fn take(&mut self, line: &str) {
        let number = |word: &str| after(line, word).and_then(|text| text.parse().ok());
        let flag = |word: &str| number(word).map(|number: u32| number == 1);
        match line.split(' ').next() {
            Some(mode @ ("WAIT" | "FLIGHT")) => {
                self.mode = Some(mode.into());
                self.safe = line.contains("SAFE MODE");
                self.derived = flag("derived");
            }
            Some("lift-off") => {
                self.lift_off = flag("lift-off");
                self.micro_g = flag("micro-g");
                self.noise = number("noise");
            }
            Some("recorder") if line.contains(" bad blocks") => {
                self.used = number("recorder");
                self.capacity = number("of");
                self.bad_blocks = before(line, "bad blocks");
                self.corrected = before(line, "bits corrected");
                self.lost_halves = before(line, "halves lost");
            }
            Some("recorder:") => self.recorder = line.strip_prefix("recorder: ").map(Into::into),
            Some("started") => {
                self.started = after(line, "started").map(Into::into);
                self.resets = number("resets");
            }
            Some("clock") => {
                self.clock = after(line, "clock").map(Into::into);
                let words: Vec<&str> = line.split_whitespace().collect();
                let number = |word: &str, ahead: usize| {
                    let at = words.iter().position(|known| *known == word)?;
                    words.get(at + ahead)?.parse().ok()
                };
                self.stack = number("stack", 1).zip(number("stack", 3));
                self.brown_out_mv = number("brown-out", 1).zip(number("brown-out", 4));
                self.read_out = number("read-out", 1);
                self.dips = number("dips", 1);
            }
            _ => {}
        }
    }
}

/// The word after some words.
fn after<'a>(line: &'a str, words: &str) -> Option<&'a str> {
    let at = line.find(words)? + words.len();
    let word = line.get(at..)?.split_whitespace().next()?;
    Some(word.trim_end_matches([',', ';', ':']))
}

/// The number before some words.
fn before(line: &str, words: &str) -> Option<u32> {
    line.get(..line.find(words)?)?
        .split_whitespace()
        .next_back()?
        .parse()
        .ok()
}

/// How a sensor's own test ended: what the unit says after its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SelfTest {
    /// It passed.
    Passed,
    /// Why it did not.
    Failed(String),
}

/// The newest self-test of a sensor, named as the unit names it ("accelerometer 1").
pub fn self_test(evidence: &Evidence, sensor: &str) -> Option<SelfTest> {
    let mut lines = evidence.said.iter().rev();
    lines.find_map(|said| {
        let rest = said.text.strip_prefix("G_AT ")?.strip_prefix(sensor)?;
        match rest {
            " ok" => Some(SelfTest::Passed),
            _ => rest.strip_prefix(" failed: ").map(|why| SelfTest::Failed(why.into())),
        }
    })
}

/// The firmware's version.
pub fn version(evidence: &Evidence) -> Option<&str> {
    let lines = evidence.said.iter();
    lines
        .into_iter()
        .find_map(|said| said.text.strip_prefix("G_VE: e-MEMS "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acceptance::evidence::{Said, Stage};

    fn evidence(lines: &[&str]) -> Evidence {
        let said = |text: &&str| Said {
            at_s: 0.0,
            stage: Stage::Talk,
            text: (*text).into(),
        };
        Evidence {
            said: lines.iter().map(said).collect(),
            ..Evidence::default()
        }
    }

    #[test]
    fn every_number_of_a_status_is_read() {
        let all = Status::all(&evidence(&[
            "G_ST WAIT task G_MT recording 0 derived 1 SAFE MODE",
            "G_ST lift-off 0 micro-g 1 errors 0000 noise 3 lost 0",
            "G_ST recorder 12 of 130816 pages, 4 bad blocks, 5 bits corrected, 6 halves lost, 436 min left",
            "G_ST recorder: empty",
            "G_ST started PowerOn resets 2 up 17 s, starts without a minute of health 1",
            "G_ST clock crystal stack 9000 of 24000 bytes brown-out 2700 mV of 2700 read-out 1 dips 7",
        ]));
        let expected = Status {
            mode: Some("WAIT".into()),
            safe: true,
            derived: Some(true),
            lift_off: Some(false),
            micro_g: Some(true),
            noise: Some(3),
            used: Some(12),
            capacity: Some(130_816),
            bad_blocks: Some(4),
            corrected: Some(5),
            lost_halves: Some(6),
            recorder: Some("empty".into()),
            started: Some("PowerOn".into()),
            resets: Some(2),
            clock: Some("crystal".into()),
            stack: Some((9000, 24_000)),
            brown_out_mv: Some((2700, 2700)),
            read_out: Some(1),
            dips: Some(7),
        };
        assert_eq!(all, [expected]);
    }

    #[test]
    fn the_newest_self_test_counts() {
        let said = evidence(&[
            "G_AT gyro 1 failed: no answer in time",
            "G_AT gyro 1 ok",
            "G_AT gyro 2 failed: self-test failed",
        ]);
        assert_eq!(self_test(&said, "gyro 1"), Some(SelfTest::Passed));
        assert_eq!(
            self_test(&said, "gyro 2"),
            Some(SelfTest::Failed("self-test failed".into()))
        );
        assert_eq!(self_test(&said, "gyro 3"), None);
    }
}
