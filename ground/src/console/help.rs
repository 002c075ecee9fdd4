//! The help that covers the screen: keys, and the unit's commands as its own table has them.

use emems::command::COMMANDS;
use ratatui::{
    Frame,
    layout::{Constraint, Flex, Layout},
    text::Line,
    widgets::{Block, Clear, Paragraph},
};

use super::input;

const KEYS: [(&str, &str); 6] = [
    ("Enter", "send the line as typed; the unit asks what needs confirming"),
    (
        "Tab Esc",
        "complete, again for the next;  empty the line (Ctrl-A E B F U K W too)",
    ),
    ("Up Down", "words sent before;  PgUp PgDn: the log"),
    ("F2 F3", "table or four plots;  group of the plot beside the table"),
    ("F4 F5", "plate;  seconds of the plots  (on an empty line: 1-4, + -)"),
    ("q Ctrl-C", "quit (q: on an empty line);  F1 or ?: this help"),
];

/// Draws the help over the frame.
pub fn draw(frame: &mut Frame) {
    let row = |(left, right): (&str, &str)| Line::from(format!(" {left:9}  {right}"));
    let commands = COMMANDS.iter().map(|entry| row((input::word(entry), entry.meaning)));
    let lines: Vec<_> = KEYS.into_iter().map(row).chain(commands).collect();
    let height = Constraint::Length(lines.len() as u16 + 2);
    let [area] = Layout::vertical([height]).flex(Flex::Center).areas(frame.area());
    let [area] = Layout::horizontal([Constraint::Length(76)])
        .flex(Flex::Center)
        .areas(area);
    frame.render_widget(Clear, area);
    frame.render_widget(
        Paragraph::new(lines).block(Block::bordered().title(" keys and commands (any key closes) ")),
        area,
    );
}
