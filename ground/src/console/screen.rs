//! The console on a terminal: the loop between the line, the keys and the screen.
//!
//! In: a session and the terminal. Out: whatever the user types goes to the unit, whatever the unit says to the screen.
//! The terminal is given back as it was, also after a panic ([`ratatui::try_init`] hooks it).

use std::{
    io,
    time::{Duration, Instant},
};

use ratatui::{
    DefaultTerminal,
    crossterm::event::{self, Event},
};

use super::{
    keys::Action,
    line::Line,
    session::Session,
    view::{self, View},
};

/// Time between two frames without a key.
const FRAME: Duration = Duration::from_millis(100);

/// Longest wait for the line before the keys are asked.
const WAIT: Duration = Duration::from_millis(20);

/// Shows the session until the user quits.
///
/// # Errors
/// When the terminal fails.
pub fn run(session: &mut Session<impl Line>) -> io::Result<()> {
    let mut terminal = ratatui::try_init()?;
    let result = until_quit(&mut terminal, session);
    ratatui::try_restore()?;
    result
}

fn until_quit(terminal: &mut DefaultTerminal, session: &mut Session<impl Line>) -> io::Result<()> {
    let mut view = View::default();
    loop {
        terminal.draw(|frame| view::draw(frame, &session.model, &view))?;
        let next_frame = Instant::now() + FRAME;
        let mut touched = false;
        while !touched && Instant::now() < next_frame {
            session.hear(WAIT);
            while event::poll(Duration::ZERO)? {
                touched = true;
                let Event::Key(key) = event::read()? else { continue };
                if !key.is_press() {
                    continue;
                }
                match view.key(key, session.model.log.len()) {
                    Some(Action::Quit) => return Ok(()),
                    Some(Action::Send(word)) if session.typed(&word) => return Ok(()),
                    Some(Action::Send(_)) => {}
                    None => {}
                }
            }
        }
    }
}
