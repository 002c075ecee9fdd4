//! The console without a screen, for pipes and files.
//!
//! In: a session, and words from standard input, one a line. Out: one line for each thing said, as the log has it, and
//! while packets come one line of state a second of the line's time. It ends with the run or when nobody reads it.

use std::{
    io::{self, BufRead, Write},
    sync::mpsc::{self, Receiver},
    thread,
    time::Duration,
};

use super::{
    line::Line,
    model::Link,
    session::Session,
    state::{packet_line, unit_line},
    view::log_line,
};

/// Longest wait for the line before the words are asked.
const WAIT: Duration = Duration::from_millis(20);

/// Time between two lines of state.
const PERIOD: Duration = Duration::from_secs(1);

/// Prints the session until the run ends or nobody reads any more.
///
/// # Errors
/// When printing fails for another reason.
pub fn run(session: &mut Session<impl Line>) -> io::Result<()> {
    let words = words_typed();
    let mut next_state = Duration::ZERO;
    while session.model.link != Link::Ended {
        match step(session, &words, &mut next_state, &mut io::stdout().lock()) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => break,
            printed => printed?,
        }
    }
    Ok(())
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

fn step(
    session: &mut Session<impl Line>,
    words: &Receiver<String>,
    next_state: &mut Duration,
    out: &mut impl Write,
) -> io::Result<()> {
    // First the line: it may be opened here, and words piped in are there at once.
    session.hear(WAIT);
    for word in words.try_iter().filter(|word| !word.trim().is_empty()) {
        session.send(word.trim());
    }
    let model = &mut session.model;
    for line in model.log.drain(..) {
        writeln!(out, "{}", log_line(&line))?;
    }
    if model.reading.is_some() && model.now >= *next_state {
        *next_state = model.now + PERIOD;
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
        let mut next_state = Duration::ZERO;
        for _ in 0..13 {
            step(&mut session, &words, &mut next_state, &mut out).unwrap();
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
}
