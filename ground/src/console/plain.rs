//! The console without a screen, for pipes and files.
//!
//! In: a session, and words from standard input, one a line. Out: one line for each thing said, as the log has it, and
//! while packets come one line of state a second of the line's time. It ends with the run, when nobody reads it, at the word
//! `quit`, and after the end of the input once the last word was answered.

use std::{
    io::{self, BufRead, Write},
    sync::mpsc::{self, Receiver, TryRecvError},
    thread,
    time::{Duration, Instant},
};

use super::{
    Error,
    line::Line,
    model::{Link, Source},
    session::Session,
    state::{packet_line, unit_line},
    view::log_line,
};

/// Longest wait for the line before the words are asked.
const WAIT: Duration = Duration::from_millis(20);

/// Time between two lines of state.
const PERIOD: Duration = Duration::from_secs(1);

/// Longest wait for the reply to the last word: the unit answers within a cycle, and a port may take a second to open.
const REPLY: Duration = Duration::from_secs(2);

/// Prints the session until the run ends, the input ends or nobody reads any more; after the input listens for `listen`, or
/// until the last word was answered.
///
/// # Errors
/// When the last word was not answered, or printing fails for another reason than a closed pipe.
pub fn run(session: &mut Session<impl Line>, listen: Option<Duration>) -> Result<(), Error> {
    let words = words_typed();
    let mut plain = Plain::default();
    while session.model.link != Link::Ended {
        match plain.step(session, &words, &mut io::stdout().lock()) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
            printed => printed?,
        }
        if plain.quit {
            return Ok(());
        }
        if let Some(ended) = plain.over(listen, session.model.now, Instant::now()) {
            return ended;
        }
    }
    Ok(())
}

/// What was printed and sent so far.
#[derive(Default)]
struct Plain {
    next_state: Duration,
    /// The last word sent that nobody has answered yet.
    unanswered: Option<String>,
    quit: bool,
    /// When the input ended, on the line's clock and on ours: a line whose unit is silent has no clock.
    ended: Option<(Duration, Instant)>,
}

impl Plain {
    /// Whether all is said after the end of the input, and how it went.
    fn over(&self, listen: Option<Duration>, now: Duration, clock: Instant) -> Option<Result<(), Error>> {
        let (ended, ended_at) = self.ended?;
        match (listen, &self.unanswered) {
            (Some(listen), _) => (now.saturating_sub(ended) >= listen).then_some(Ok(())),
            (None, None) => Some(Ok(())),
            (None, Some(word)) => (clock.duration_since(ended_at) >= REPLY).then(|| {
                Err(Error::Silent {
                    word: word.clone(),
                    wait: REPLY,
                })
            }),
        }
    }
}

/// Lines of standard input, read where waiting for them delays nothing else.
fn words_typed() -> Receiver<String> {
    let (to_console, words) = mpsc::channel();
    thread::spawn(move || {
        for word in io::stdin().lock().lines() {
            let Ok(word) = word else { break };
            if to_console.send(word).is_err() {
                break;
            }
        }
    });
    words
}

impl Plain {
    fn step(
        &mut self,
        session: &mut Session<impl Line>,
        words: &Receiver<String>,
        out: &mut impl Write,
    ) -> io::Result<()> {
        // First the line: it may be opened here, and words piped in are there at once.
        session.hear(WAIT);
        while self.ended.is_none() && !self.quit {
            match words.try_recv() {
                Ok(word) if word.trim().is_empty() => {}
                Ok(word) => self.quit = session.typed(word.trim()),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => self.ended = Some((session.model.now, Instant::now())),
            }
        }
        let model = &mut session.model;
        for line in model.log.drain(..) {
            match line.source {
                Source::Sent => self.unanswered = Some(line.text.clone()),
                Source::Unit => self.unanswered = None,
                Source::Console | Source::Unread => {}
            }
            writeln!(out, "{}", log_line(&line))?;
        }
        if model.reading.is_some() && model.now >= self.next_state {
            self.next_state = model.now + PERIOD;
            writeln!(
                out,
                "{:9.2} ={} {}",
                model.now.as_secs_f64(),
                unit_line(model),
                packet_line(model)
            )?;
        }
        out.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use emems::{packet::encode, sample::Reading};

    use super::*;
    use crate::console::{line::channel, recording::Recording};

    #[test]
    fn replies_are_printed_at_once_and_the_state_once_a_second() {
        let folder = tempfile::tempdir().unwrap();
        let (line, unit) = channel("flying");
        let recording = Recording::open(&folder.path().join("pad.log"), "flying", SystemTime::UNIX_EPOCH).unwrap();
        let mut session = Session::new(line, recording);
        let (typed, words) = mpsc::channel();
        typed.send("G_ST\r".into()).unwrap();
        typed.send(" ".into()).unwrap();
        unit.plug(Duration::ZERO).unwrap();
        unit.send(Duration::from_millis(10), b">G_MT ok: WAIT\r\n").unwrap();
        for cycle in 1..=11_u64 {
            let packet = encode(&Reading::unread(cycle as u16));
            unit.send(Duration::from_millis(200 * cycle), &packet).unwrap();
        }
        let mut out = Vec::new();
        let mut plain = Plain::default();
        for _ in 0..13 {
            plain.step(&mut session, &words, &mut out).unwrap();
        }
        assert_eq!(unit.commands(), b"G_ST\r\n");
        let out = String::from_utf8(out).unwrap();
        let lines: Vec<_> = out.lines().map(str::trim).collect();
        assert_eq!(lines[..3], ["0.00 * plugged", "0.00 > G_ST", "0.01 < G_MT ok: WAIT"]);
        let state = "flying  plugged  mode WAIT  lift-off no  micro-g no  packet";
        let errors = "errors FFFF: acc 1-4, mag 1-4, gyro 1-4, temp 1-4";
        assert_eq!(
            lines[3..],
            [
                format!("0.20 = {state} 0001   total 1  missed 0  unread 0  {errors}"),
                format!("1.20 = {state} 0006 5.00/s  total 6  missed 0  unread 0  {errors}"),
                format!("2.20 = {state} 000B 5.00/s  total 11  missed 0  unread 0  {errors}"),
            ]
        );
    }

    #[test]
    fn after_the_input_it_ends_with_the_reply_or_says_that_there_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let (line, unit) = channel("flying");
        let recording = Recording::open(&folder.path().join("pad.log"), "flying", SystemTime::UNIX_EPOCH).unwrap();
        let mut session = Session::new(line, recording);
        let (typed, words) = mpsc::channel();
        typed.send("G_ST".into()).unwrap();
        drop(typed);
        let mut plain = Plain::default();
        let mut out = Vec::new();
        for _ in 0..2 {
            plain.step(&mut session, &words, &mut out).unwrap();
        }
        let (now, clock) = (session.model.now, Instant::now());
        assert!(plain.over(None, now, clock).is_none(), "the reply is waited for");
        assert!(
            matches!(plain.over(None, now, clock + REPLY), Some(Err(Error::Silent { word, .. })) if word == "G_ST")
        );
        unit.send(Duration::from_millis(10), b">G_ST WAIT\r\n").unwrap();
        plain.step(&mut session, &words, &mut out).unwrap();
        assert!(matches!(plain.over(None, session.model.now, clock), Some(Ok(()))));
        let listen = Some(Duration::from_secs(1));
        assert!(plain.over(listen, session.model.now, clock).is_none());
        assert!(matches!(
            plain.over(listen, Duration::from_secs(2), clock),
            Some(Ok(()))
        ));
    }
}
