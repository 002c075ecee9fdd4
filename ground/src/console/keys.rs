//! What the keys do.
//!
//! In: a key and the [`View`] it is meant for. Out: the changed view, and what the console has to do. Letters belong to
//! the input line; `q`, `?`, digits and signs steer the view only while that line is empty, since every command of the
//! unit begins with `G`.

use std::time::Duration;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::{
    input::Edit,
    view::{Page, View},
};

/// Times over which may be plotted.
const WINDOWS_S: [u64; 5] = [10, 30, 60, 180, 600];

/// Lines PgUp scrolls.
const SCROLL: usize = 5;

/// What the console has to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// End, leaving the terminal as it was.
    Quit,
    /// Send this.
    Send(String),
}

impl View {
    /// Takes a pressed key while the log has `log_lines`.
    pub fn key(&mut self, key: KeyEvent, log_lines: usize) -> Option<Action> {
        let control = key.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT);
        let empty = self.input.text().is_empty();
        match key.code {
            KeyCode::Char('c' | 'd') if key.modifiers == KeyModifiers::CONTROL => return Some(Action::Quit),
            KeyCode::Char(letter) if control && !self.help => {
                if key.modifiers == KeyModifiers::CONTROL
                    && let Some(edit) = edit(letter)
                {
                    self.input.edit(edit);
                }
            }
            // Any key closes the help, and does nothing else: nobody sends what he cannot see.
            _ if self.help => self.help = false,
            KeyCode::Char('q') if empty => return Some(Action::Quit),
            KeyCode::Char('?') if empty => self.help = true,
            KeyCode::Char(plate @ '1'..='4') if empty => self.plate = usize::from(plate as u8 - b'1'),
            KeyCode::Char('+') if empty => self.window = longer(self.window).unwrap_or(self.window),
            KeyCode::Char('-') if empty => self.window = shorter(self.window).unwrap_or(self.window),
            KeyCode::Char(letter) => self.input.push(letter),
            KeyCode::Backspace => self.input.edit(Edit::Backspace),
            KeyCode::Delete => self.input.edit(Edit::Delete),
            KeyCode::Left => self.input.edit(Edit::Left),
            KeyCode::Right => self.input.edit(Edit::Right),
            KeyCode::Home => self.input.edit(Edit::Home),
            KeyCode::End => self.input.edit(Edit::End),
            KeyCode::Esc => self.input.edit(Edit::All),
            KeyCode::Tab => self.input.complete(),
            KeyCode::Up => self.input.older(),
            KeyCode::Down => self.input.newer(),
            KeyCode::Enter => {
                self.scroll = 0;
                return self.input.take().map(Action::Send);
            }
            KeyCode::F(1) => self.help = true,
            KeyCode::F(2) => {
                self.page = match self.page {
                    Page::Table => Page::Plots,
                    Page::Plots => Page::Table,
                }
            }
            KeyCode::F(3) => self.group = self.group.next(),
            KeyCode::F(4) => self.plate = (self.plate + 1) % 4,
            KeyCode::F(5) => self.window = longer(self.window).unwrap_or(Duration::from_secs(WINDOWS_S[0])),
            KeyCode::PageUp => self.scroll = (self.scroll + SCROLL).min(log_lines.saturating_sub(1)),
            KeyCode::PageDown => self.scroll = self.scroll.saturating_sub(SCROLL),
            _ => {}
        }
        None
    }
}

/// What a letter with Ctrl does to the line, as in shells.
fn edit(letter: char) -> Option<Edit> {
    Some(match letter {
        'a' => Edit::Home,
        'b' => Edit::Left,
        'e' => Edit::End,
        'f' => Edit::Right,
        'h' => Edit::Backspace,
        'k' => Edit::ToEnd,
        'u' => Edit::ToHome,
        'w' => Edit::Word,
        _ => return None,
    })
}

fn longer(window: Duration) -> Option<Duration> {
    WINDOWS_S
        .map(Duration::from_secs)
        .into_iter()
        .find(|other| *other > window)
}

fn shorter(window: Duration) -> Option<Duration> {
    WINDOWS_S
        .map(Duration::from_secs)
        .into_iter()
        .rfind(|other| *other < window)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::console::display::Group;

    fn press(view: &mut View, code: KeyCode) -> Option<Action> {
        view.key(KeyEvent::new(code, KeyModifiers::NONE), 12)
    }

    fn type_in(view: &mut View, text: &str) {
        for letter in text.chars() {
            assert_eq!(press(view, KeyCode::Char(letter)), None);
        }
    }

    #[test]
    fn enter_sends_exactly_what_was_typed_and_nothing_else_sends() {
        let mut view = View::default();
        type_in(&mut view, "G_MAq?1+");
        for code in [KeyCode::Up, KeyCode::Down, KeyCode::F(2), KeyCode::PageUp] {
            assert_eq!(press(&mut view, code), None);
        }
        type_in(&mut view, "G_MAq?1+");
        let sent = press(&mut view, KeyCode::Enter);
        assert_eq!(sent, Some(Action::Send("G_MAq?1+G_MAq?1+".into())));
        assert_eq!(press(&mut view, KeyCode::Enter), None, "an empty line sends nothing");
    }

    #[test]
    fn q_quits_on_an_empty_line_and_control_c_always() {
        let mut view = View::default();
        assert_eq!(press(&mut view, KeyCode::Char('q')), Some(Action::Quit));
        type_in(&mut view, "G");
        let control_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(view.key(control_c, 0), Some(Action::Quit));
    }

    #[test]
    fn a_recalled_word_that_is_emptied_with_control_u_is_not_sent() {
        let mut view = View::default();
        type_in(&mut view, "G_DL");
        press(&mut view, KeyCode::Enter);
        press(&mut view, KeyCode::Up);
        let control =
            |view: &mut View, letter| view.key(KeyEvent::new(KeyCode::Char(letter), KeyModifiers::CONTROL), 0);
        assert_eq!(control(&mut view, 'u'), None);
        type_in(&mut view, "XG_M");
        for letter in ['a', 'f'] {
            control(&mut view, letter);
        }
        press(&mut view, KeyCode::Backspace);
        press(&mut view, KeyCode::End);
        type_in(&mut view, "T");
        assert_eq!(press(&mut view, KeyCode::Enter), Some(Action::Send("G_MT".into())));
    }

    #[test]
    fn help_is_closed_by_any_key_which_does_nothing_else() {
        let mut view = View::default();
        type_in(&mut view, "?");
        assert!(view.help);
        assert_eq!(press(&mut view, KeyCode::Char('q')), None);
        assert!(!view.help);
        assert_eq!(view.input.text(), "");
    }

    #[test]
    fn keys_choose_what_is_plotted() {
        let mut view = View::default();
        for code in [
            KeyCode::F(2),
            KeyCode::F(3),
            KeyCode::F(3),
            KeyCode::Char('4'),
            KeyCode::F(4),
        ] {
            press(&mut view, code);
        }
        assert_eq!((view.page, view.group, view.plate), (Page::Plots, Group::Gyros, 0));
        let mut seen = Vec::new();
        for code in "++++-+".chars().map(KeyCode::Char).chain([KeyCode::F(5)]) {
            press(&mut view, code);
            seen.push(view.window.as_secs());
        }
        assert_eq!(seen, [60, 180, 600, 600, 180, 600, 10]);
        type_in(&mut view, "--");
        assert_eq!(view.window.as_secs(), 10);
    }

    #[test]
    fn the_log_scrolls_within_its_lines() {
        let mut view = View::default();
        let mut seen = Vec::new();
        for code in [KeyCode::PageUp, KeyCode::PageUp, KeyCode::PageUp, KeyCode::PageDown] {
            press(&mut view, code);
            seen.push(view.scroll);
        }
        assert_eq!(seen, [5, 10, 11, 6]);
    }
}
