//! The twin under test: the unit on the emulated board or on this computer, moved as the procedure asks.
//!
//! In: a board, defects and faults. Out: the evidence, and the bytes of the umbilical. The motion follows the procedure in virtual time:
//! a pose takes two seconds, a turn eight, each begun a tenth of a second after it was asked for, which no part has looked at yet.

use std::sync::Arc;

use emulated::{Options, toolchain};
use twin::{
    environment::{Environment, World},
    fault::{Planned, schedule},
    host,
    motion::Guided,
    part::Nanos,
    plant::{Plant, Quality, assembly::Defect},
    run::{Bench, Flow, Scheduled},
    truth::TruthSource,
};

use super::{
    evidence::Evidence,
    heard,
    pose::{POSES, TURNS},
    procedure::{Ask, Patience, Procedure},
};
use crate::{console::stream::Stream, fly::board::BoardError};

/// \[s\] after power-on at which the test begins.
const BEGINS_S: f64 = 1.0;
/// \[s\] after which a move begins.
const SOON_S: f64 = 0.1;
const POSE_S: f64 = 2.0;
const TURN_S: f64 = 8.0;
/// \[ns\] by when any test is over: every step at its full patience.
const LONGEST: Nanos = 1_200_000_000_000;

/// What is wrong with the unit.
#[derive(Clone, Debug, PartialEq)]
pub enum Wrong {
    /// In its assembly.
    Defect(Defect),
    /// From or at a time.
    Fault(Planned),
    /// The board lacks its crystal. Emulated board only.
    NoCrystal,
    /// The brown-out level is as from the factory.
    NoBrownOut,
    /// The read-out protection is as from the factory.
    NoReadOut,
}

impl std::str::FromStr for Wrong {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "no-crystal" => Ok(Wrong::NoCrystal),
            "no-brown-out" => Ok(Wrong::NoBrownOut),
            "no-read-out" => Ok(Wrong::NoReadOut),
            _ if text.contains('@') => text
                .parse()
                .map(Wrong::Fault)
                .map_err(|error: twin::fault::BadFault| error.to_string()),
            _ => text.parse().map(Wrong::Defect).map_err(|error: String| {
                format!("{error}; no-crystal no-brown-out no-read-out; or a fault with its time, as silent:a2@0s")
            }),
        }
    }
}

/// What runs the unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Board {
    /// The release image on the emulated board.
    Emulated,
    /// The unit's code on this computer.
    Host,
}

/// What was heard, and the bytes it was heard in.
pub struct Run {
    /// What was heard.
    pub evidence: Evidence,
    /// The umbilical, unit to ground.
    pub bytes: Vec<u8>,
}

/// Runs the test of the unit of a seed.
///
/// # Errors
/// When there is no image, or the emulator gives up.
pub fn run(board: Board, wrong: &[Wrong], seed: u64, tell: &mut dyn FnMut(f64, &str)) -> Result<Run, BoardError> {
    let motion = Guided::default();
    let source: Arc<dyn TruthSource> = Arc::new(World {
        motion: motion.clone(),
        environment: Environment::laboratory(),
    });
    let defects = wrong.iter().filter_map(|wrong| match wrong {
        Wrong::Defect(defect) => Some(*defect),
        _ => None,
    });
    let defects: Vec<Defect> = defects.collect();
    let faults = wrong.iter().filter_map(|wrong| match wrong {
        Wrong::Fault(fault) => Some(*fault),
        _ => None,
    });
    let faults: Vec<Planned> = faults.collect();
    let mut plant = Plant::assembled(source, seed, Quality::NOMINAL, &defects);
    if wrong.contains(&Wrong::NoBrownOut) {
        plant.options.brown_out.set_mv = 0;
    }
    if wrong.contains(&Wrong::NoReadOut) {
        plant.options.read_out = 0;
    }
    let faults: Vec<Scheduled> = schedule(&faults, seed);
    let mut rig = Rig {
        procedure: Procedure::new(Patience::TWIN),
        stream: Stream::default(),
        motion,
        to_say: Vec::new(),
        bytes: Vec::new(),
        tell,
        over: false,
    };
    match board {
        Board::Host => {
            host::fly(plant, emems::unit::Settings::NOMINAL, &faults, LONGEST, &mut rig);
        }
        Board::Emulated => {
            let options = Options {
                no_crystal: wrong.contains(&Wrong::NoCrystal),
                ..Options::default()
            };
            let image = toolchain::build()?;
            emulated::fly_with(&options, &image, plant, &faults, LONGEST, &mut rig)?;
        }
    }
    Ok(Run {
        evidence: rig.procedure.finish(),
        bytes: rig.bytes,
    })
}

struct Rig<'a> {
    procedure: Procedure,
    stream: Stream,
    motion: Guided,
    to_say: Vec<u8>,
    bytes: Vec<u8>,
    tell: &'a mut dyn FnMut(f64, &str),
    over: bool,
}

impl Rig<'_> {
    fn done(&mut self, now_s: f64, ask: Ask) {
        let soon_s = now_s + SOON_S;
        match ask {
            Ask::Say(words) => self.to_say.extend(words.as_bytes()),
            Ask::Pose(pose) => {
                (self.tell)(now_s, POSES[pose].name);
                self.motion.turn_to(soon_s, &POSES[pose].q_tb(), POSE_S);
            }
            Ask::Turn(turn) => {
                (self.tell)(now_s, TURNS[turn].name);
                let axis_b = nalgebra::Unit::new_normalize(TURNS[turn].axis_b());
                self.motion.turn(soon_s, axis_b, std::f64::consts::TAU, TURN_S);
            }
            Ask::LiftOff(level) => {
                (self.tell)(
                    now_s,
                    if level {
                        "lift-off line asserted"
                    } else {
                        "lift-off line let go"
                    },
                );
                self.motion.lift_off(soon_s, level);
            }
            Ask::Tell(text) => (self.tell)(now_s, &text),
            Ask::Done => self.over = true,
        }
    }
}

impl Bench for Rig<'_> {
    fn telemetry(&mut self, _at: Nanos, _bytes: &[u8]) {}

    fn umbilical(&mut self, at: Nanos, bytes: &[u8]) {
        self.bytes.extend(bytes);
        for found in self.stream.read(bytes) {
            self.procedure.heard(1e-9 * at as f64, heard(found.item));
        }
    }

    fn log(&mut self, _at: Nanos, _line: &str) {}

    fn commands(&mut self, _now: Nanos) -> Vec<u8> {
        std::mem::take(&mut self.to_say)
    }

    fn advanced(&mut self, now: Nanos) -> Flow {
        let now_s = 1e-9 * now as f64;
        if now_s >= BEGINS_S {
            for ask in self.procedure.tick(now_s) {
                self.done(now_s, ask);
            }
        }
        if self.over { Flow::Stop } else { Flow::Continue }
    }
}
