//! The course of an acceptance test, as a machine that knows neither port nor clock.
//!
//! In: what the unit said and the time. Out: [`Ask`]s: words for the unit, and what is to be done with it by whoever holds it, a
//! person or the twin. What is heard is kept as [`Evidence`]; whether it is good is for [`super::judge`].
//!
//! A word is repeated when it is not answered. A pose counts when the unit rests and at least two plates feel it; a turn when it
//! has moved and rests again. What does not come within the [`Patience`] is noted as missing, and the test goes on.
//!
//! Refuses a unit that does not answer, and one in FLIGHT, which it might disturb.

use std::collections::VecDeque;

use emems::{derived::Derived, sample::Reading};

use super::{
    evidence::{Evidence, Frame, Packet, STILL_PACKETS, Said, Stage, Stretch, forces_b, is_still},
    pose::{POSES, Seen, TURNS, seen},
    status::Status,
};
use packets::channel::GYRO_LSB;

/// What is heard.
#[derive(Clone, Debug)]
pub enum Heard {
    /// A packet.
    Packet(Box<Reading>),
    /// A derived frame.
    Derived(Box<Derived>),
    /// A line.
    Line(String),
    /// Bytes that are none of these.
    Unread,
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ask {
    /// To the unit.
    Say(String),
    /// A pose.
    Pose(usize),
    /// A turn.
    Turn(usize),
    /// The lift-off line: asserted or not.
    LiftOff(bool),
    /// To be told to whoever watches.
    Tell(String),
    /// It is over.
    Done,
}

/// How long is waited.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// \[s\] for a pose or a turn.
    pub move_s: f64,
    /// \[s\] for the lift-off line.
    pub line_s: f64,
}

impl Patience {
    /// Of the twin, which moves at once.
    pub const TWIN: Patience = Patience {
        move_s: 30.0,
        line_s: 4.0,
    };
    /// Of a person with a unit in the hand.
    pub const PERSON: Patience = Patience {
        move_s: 180.0,
        line_s: 60.0,
    };
}

/// \[s\] after which a word is said again.
const ANSWER_S: f64 = 2.0;
/// How often.
const TRIES: u32 = 4;
/// \[s\] the sixteen self-tests take, at most 0.6 each, and something.
const SELF_TEST_S: f64 = 15.0;
/// \[s\] after which a sensor that was tested is configured and read again: some cycles.
const SETTLES_S: f64 = 2.0;
/// \[s\] at rest: 150 packets, of which a standard deviation is known to 6 %.
const REST_S: f64 = 30.0;
/// \[s\] the recorder writes: 25 records and more.
const RECORD_S: f64 = 6.0;
/// \[s\] a dump of these takes, at most.
const DUMP_S: f64 = 30.0;
/// [deg/s] a unit that turns.
const TURNS_DEG_S: f64 = 15.0;

#[derive(Clone, Debug)]
enum Step {
    /// A word, the beginning of what answers it, and how long that may take in all \[s\].
    Word(&'static str, &'static str, f64),
    /// A word until the status says that the lift-off line has this level.
    LineIs(bool),
    Settle(usize),
    Rest,
    Turn(usize),
    LiftOff(bool),
    /// By words, if the line has not done it.
    Flight,
    /// Nothing, for so long \[s\].
    Wait(f64),
    Dump,
    End,
}

/// The course.
const STEPS: &[Step] = &[
    Step::Word("G_ST", "G_ST clock", 8.0),
    Step::Word("G_VE", "G_VE", 8.0),
    Step::Word("G_DL", "G_DL", 8.0),
    Step::Word("G_MTG_MT", "G_MT ok", 8.0),
    Step::Settle(0),
    Step::Word("G_AT", "G_AT done", SELF_TEST_S),
    Step::Wait(SETTLES_S),
    Step::Rest,
    Step::Settle(1),
    Step::Settle(2),
    Step::Settle(3),
    Step::Settle(4),
    Step::Settle(5),
    Step::Settle(0),
    Step::Turn(0),
    Step::Turn(1),
    Step::Turn(2),
    Step::Turn(3),
    Step::Turn(4),
    Step::Turn(5),
    Step::Word("G_ST", "G_ST clock", 8.0),
    Step::LiftOff(true),
    Step::Flight,
    Step::Wait(RECORD_S),
    Step::LiftOff(false),
    Step::LineIs(false),
    Step::Word("G_MEG_ME", "G_ME ok", 8.0),
    Step::Word("G_ST", "G_ST clock", 8.0),
    Step::Dump,
    Step::Word("G_ST", "G_ST clock", 8.0),
    Step::End,
];

/// The running test.
pub struct Procedure {
    patience: Patience,
    evidence: Evidence,
    stage: Stage,
    /// Place in [`STEPS`], when it began \[s\], and how often its word was said.
    step: usize,
    began_s: Option<f64>,
    tries: u32,
    /// How many lines had been said when the word was.
    said_before: usize,
    newest: VecDeque<Reading>,
    newest_s: VecDeque<f64>,
    /// \[counts\] gyros at rest.
    at_rest: [f64; 4],
    moved: bool,
    told: Option<Seen>,
    over: bool,
}

impl Procedure {
    /// Before it begins.
    pub fn new(patience: Patience) -> Self {
        Procedure {
            patience,
            evidence: Evidence::default(),
            stage: Stage::Talk,
            step: 0,
            began_s: None,
            tries: 0,
            said_before: 0,
            newest: VecDeque::new(),
            newest_s: VecDeque::new(),
            at_rest: [0.0; 4],
            moved: false,
            told: None,
            over: false,
        }
    }

    /// How far it is: steps done, and all.
    pub fn progress(&self) -> (usize, usize) {
        (self.step, STEPS.len())
    }

    /// What was heard.
    pub fn finish(self) -> Evidence {
        self.evidence
    }

    /// Takes something that was whole at `at_s`.
    pub fn heard(&mut self, at_s: f64, heard: Heard) {
        let stage = self.stage;
        match heard {
            Heard::Packet(reading) if stage == Stage::Memory => self.evidence.dumped.push(*reading),
            Heard::Packet(reading) => {
                let rate = |plate: usize| f64::from(reading.gyro[plate]) - self.at_rest[plate];
                let read = (0..4).filter(|plate| reading.gyro[*plate] != emems::sample::NOT_READ);
                let norm = read.map(|plate| rate(plate).powi(2)).sum::<f64>().sqrt();
                self.moved |= norm * GYRO_LSB.to_degrees() > TURNS_DEG_S;
                self.newest.push_back(*reading);
                self.newest_s.push_back(at_s);
                if self.newest.len() > STILL_PACKETS {
                    self.newest.pop_front();
                    self.newest_s.pop_front();
                }
                self.evidence.packets.push(Packet {
                    at_s,
                    stage,
                    reading: *reading,
                });
            }
            Heard::Derived(derived) => self.evidence.frames.push(Frame { at_s, stage, derived }),
            Heard::Line(text) => self.evidence.said.push(Said { at_s, stage, text }),
            // A dump's frames are for another reader.
            Heard::Unread if stage == Stage::Memory => {}
            Heard::Unread => self.evidence.unread += 1,
        }
    }

    /// What is to be done now.
    pub fn tick(&mut self, now_s: f64) -> Vec<Ask> {
        let mut asks = Vec::new();
        while !self.over {
            let Some(step) = STEPS.get(self.step) else { break };
            let Some(began_s) = self.began_s else {
                self.began_s = Some(now_s);
                self.begin(step, &mut asks);
                continue;
            };
            if !self.is_over(step, now_s, now_s - began_s, &mut asks) {
                break;
            }
            self.step += 1;
            self.began_s = None;
            (self.tries, self.told) = (0, None);
        }
        asks
    }

    fn begin(&mut self, step: &Step, asks: &mut Vec<Ask>) {
        self.said_before = self.evidence.said.len();
        match step {
            Step::Word(word, ..) => {
                self.stage = match *word {
                    "G_AT" => Stage::SelfTest,
                    _ => Stage::Talk,
                };
                self.say(word, asks);
            }
            Step::Settle(pose) => {
                self.stage = Stage::Pose(*pose);
                self.forget();
                asks.push(Ask::Pose(*pose));
            }
            Step::Rest => {
                self.stage = Stage::Rest;
                self.forget();
                asks.push(Ask::Tell(format!("leave it alone for {REST_S:.0} s")));
            }
            Step::Turn(turn) => {
                self.stage = Stage::Turn(*turn);
                self.forget();
                asks.push(Ask::Turn(*turn));
            }
            Step::LiftOff(level) => {
                self.stage = Stage::Talk;
                asks.push(Ask::LiftOff(*level));
            }
            Step::LineIs(_) => self.say("G_ST", asks),
            Step::Wait(_) => self.stage = Stage::Talk,
            Step::Flight | Step::End => {}
            Step::Dump => {
                let (from, to) = self.written();
                // Where nothing was written there is nothing to read.
                if to > from {
                    self.stage = Stage::Memory;
                    self.say(&format!("G_LR{from:06X}{:06X}", to - from), asks);
                }
            }
        }
    }

    /// Pages of the log before and after the recorder was asked to write.
    fn written(&self) -> (u32, u32) {
        let used = Status::all(&self.evidence).into_iter().filter_map(|status| status.used);
        let used: Vec<u32> = used.collect();
        let to = used.last().copied().unwrap_or_default();
        (used.first().copied().unwrap_or_default().min(to), to)
    }

    fn say(&mut self, word: &str, asks: &mut Vec<Ask>) {
        self.tries += 1;
        asks.push(Ask::Say(format!("{word}\r\n")));
    }

    fn forget(&mut self) {
        self.newest.clear();
        self.newest_s.clear();
        self.moved = false;
    }

    fn answered(&self, begins: &str) -> bool {
        let lines = self.evidence.said.iter().skip(self.said_before);
        lines.into_iter().any(|said| said.text.starts_with(begins))
    }

    fn missing(&mut self, what: String) -> bool {
        self.evidence.missing.push(what);
        true
    }

    /// Whether a step that began so long ago is over.
    fn is_over(&mut self, step: &Step, now_s: f64, for_s: f64, asks: &mut Vec<Ask>) -> bool {
        match step {
            Step::Word(word, answer, within_s) => {
                if self.answered(answer) {
                    return self.word_answered(asks);
                }
                if for_s >= *within_s {
                    if self.step == 0 {
                        self.over = true;
                        asks.push(Ask::Done);
                    }
                    return self.missing(format!("no answer to {word}"));
                }
                // A self-test that runs is not to be begun anew.
                let is_long = *within_s >= SELF_TEST_S;
                if for_s >= ANSWER_S * f64::from(self.tries)
                    && self.tries < TRIES
                    && !(is_long && self.answered("G_AT"))
                {
                    self.say(word, asks);
                }
                false
            }
            Step::Settle(pose) => self.is_settled(*pose, now_s, for_s, asks),
            Step::Rest => {
                let over = for_s >= REST_S;
                if over {
                    self.keep(Stage::Rest, now_s - for_s, now_s);
                }
                over
            }
            Step::Turn(turn) => {
                if for_s >= self.patience.move_s {
                    return self.missing(format!("the turn {}", TURNS[*turn].name));
                }
                let over = self.moved && is_still(&self.newest);
                if over {
                    self.keep(Stage::Turn(*turn), now_s - for_s, now_s);
                }
                over
            }
            Step::LiftOff(true) => {
                let seen = self.answered("mode FLIGHT");
                let over = seen || for_s >= self.patience.line_s;
                if over {
                    self.evidence.lift_off_seen = Some(seen);
                }
                over
            }
            Step::LiftOff(false) => true,
            Step::LineIs(level) => {
                let newest = Status::all(&self.evidence).pop();
                if newest.is_some_and(|status| status.lift_off == Some(*level)) && self.answered("G_ST clock") {
                    return true;
                }
                if for_s >= self.patience.line_s {
                    return self.missing("the lift-off line, let go".into());
                }
                if for_s >= ANSWER_S * f64::from(self.tries) {
                    self.said_before = self.evidence.said.len();
                    self.say("G_ST", asks);
                }
                false
            }
            Step::Flight => {
                if self.evidence.lift_off_seen == Some(false) {
                    asks.push(Ask::Say("G_MVG_MVG_MGG_MG\r\n".into()));
                }
                true
            }
            Step::Wait(wait_s) => for_s >= *wait_s,
            Step::Dump => {
                let over = self.tries == 0 || self.answered("dump ends");
                if over || for_s >= DUMP_S {
                    self.stage = Stage::Talk;
                }
                over || (for_s >= DUMP_S && self.missing("the end of the recorder's dump".into()))
            }
            Step::End => {
                let derived = Status::all(&self.evidence).first().and_then(|status| status.derived);
                if derived == Some(false) {
                    asks.push(Ask::Say("G_DX\r\n".into()));
                }
                asks.push(Ask::Done);
                self.over = true;
                true
            }
        }
    }

    fn word_answered(&mut self, asks: &mut Vec<Ask>) -> bool {
        let first = Status::all(&self.evidence).pop();
        if self.step == 0 && first.is_some_and(|status| status.mode.as_deref() == Some("FLIGHT")) {
            self.missing("mode WAIT: the unit is in FLIGHT; G_ME twice leaves it".into());
            self.over = true;
            asks.push(Ask::Done);
        }
        true
    }

    fn is_settled(&mut self, pose: usize, now_s: f64, for_s: f64, asks: &mut Vec<Ask>) -> bool {
        if for_s >= self.patience.move_s {
            return self.missing(format!("the pose {}", POSES[pose].name));
        }
        if !is_still(&self.newest) {
            return false;
        }
        let forces = self.newest.back().map(forces_b).unwrap_or_default();
        match seen(pose, &forces) {
            Seen::Right => {
                let from_s = self.newest_s.front().copied().unwrap_or(now_s);
                self.keep(Stage::Pose(pose), from_s, now_s);
                for plate in 0..4 {
                    let read = self.newest.iter().map(|reading| reading.gyro[plate]);
                    let read: Vec<f64> = read.filter(|v| *v != emems::sample::NOT_READ).map(f64::from).collect();
                    self.at_rest[plate] = read.iter().sum::<f64>() / read.len().max(1) as f64;
                }
                true
            }
            other => {
                if let Seen::Other(other) = other
                    && self.told != Some(Seen::Other(other))
                {
                    let text = format!("that is {}; {}", POSES[other].name, POSES[pose].ask);
                    asks.push(Ask::Tell(text));
                }
                self.told = Some(other);
                false
            }
        }
    }

    fn keep(&mut self, stage: Stage, from_s: f64, to_s: f64) {
        self.evidence.stretches.push(Stretch { stage, from_s, to_s });
    }
}
