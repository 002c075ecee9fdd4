//! The console on a terminal: the loop between the line, the keys and the screen.
//!
//! In: a session and the terminal. Out: whatever the user types goes to the unit, whatever the unit says to the screen.
//! The terminal is given back as it was, also after a panic ([`ratatui::try_init`] hooks it). One that went away ends the console as
//! the user would.

#[cfg(unix)]
use std::os::fd::AsFd;
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
    if is_gone() {
        // There is nothing to give back, and nobody to tell; dropped, the terminal would try to.
        std::mem::forget(terminal);
        return Ok(());
    }
    ratatui::try_restore()?;
    result
}

/// Whether the terminal went away: its window was closed, or the connection to it broke. crossterm reads such a one without end.
fn is_gone() -> bool {
    #[cfg(unix)]
    return is_hung_up(io::stdin());
    #[cfg(not(unix))]
    return false;
}

/// Whether nobody is at the other end any more.
#[cfg(unix)]
fn is_hung_up(end: impl AsFd) -> bool {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let mut asked = [PollFd::new(&end, PollFlags::empty())];
    let answered = poll(&mut asked, Some(&Timespec::default()));
    answered.is_ok() && asked[0].revents().intersects(PollFlags::HUP | PollFlags::ERR)
}

fn until_quit(terminal: &mut DefaultTerminal, session: &mut Session<impl Line>) -> io::Result<()> {
    let mut view = View::default();
    while !is_gone() {
        terminal.draw(|frame| view::draw(frame, &session.model, &view))?;
        let next_frame = Instant::now() + FRAME;
        let mut touched = false;
        while !touched && Instant::now() < next_frame {
            session.hear(WAIT);
            while !is_gone() && event::poll(Duration::ZERO)? {
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
    Ok(())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn an_end_whose_other_is_closed_is_hung_up() {
        let (read, write) = io::pipe().expect("a pipe");
        assert!(!is_hung_up(&read));
        drop(write);
        assert!(is_hung_up(&read));
    }
}
