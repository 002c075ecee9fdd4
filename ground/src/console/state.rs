//! Three lines of state: the unit, its packets, and the recording or what is wrong with it or the line. Two more once the
//! unit has said something of its attitude (G_DL).
//!
//! In: a [`Model`]. Out: styled lines, also printed without style where there is no screen. Colour only repeats what
//! the words say: green is well, yellow wants attention, red is wrong.

use emems::mode::Mode;
use ratatui::{
    style::{Color, Modifier, Style, Stylize},
    text::{Line, Span},
};

use super::{
    attitude,
    display::{failed_names, size},
    model::{Link, Model},
};

/// Lines of it without an attitude.
pub const LINES: u16 = 3;

/// All of it.
pub fn lines(model: &Model) -> Vec<Line<'static>> {
    let estimate = model.estimate.iter().flat_map(attitude::lines).map(Line::from);
    [unit_line(model), packet_line(model), alarm_line(model)]
        .into_iter()
        .chain(estimate)
        .collect()
}

/// The unit's state in one line.
pub fn unit_line(model: &Model) -> Line<'static> {
    let link = match &model.link {
        Link::Unknown => "...".yellow(),
        Link::Plugged => "plugged".green(),
        Link::Unplugged(_) => "UNPLUGGED".white().on_red(),
        Link::Ended => "ENDED".yellow(),
    };
    let mode = match model.mode {
        None => "? (G_ST asks)".yellow(),
        Some(Mode::Wait) => Mode::Wait.name().green().bold(),
        Some(Mode::Flight) => Mode::Flight.name().black().on_yellow(),
    };
    let (lift_off, micro_g) = match model.reading {
        Some(reading) => (flag(reading.lift_off), flag(reading.micro_g)),
        None => ("?".into(), "?".into()),
    };
    Line::from(vec![
        format!(" {}  ", model.line).bold(),
        link,
        "  mode ".into(),
        mode,
        "  lift-off ".into(),
        lift_off,
        "  micro-g ".into(),
        micro_g,
    ])
}

fn flag(asserted: bool) -> Span<'static> {
    if asserted {
        "YES".black().on_yellow()
    } else {
        "no".into()
    }
}

/// The packets in one line.
pub fn packet_line(model: &Model) -> Line<'static> {
    let Some(reading) = model.reading else {
        return Line::from(" no packet yet: G_MT, sent twice, asks for them in WAIT").yellow();
    };
    let rate = match model.history.rate_hz() {
        _ if !model.receiving() => " stopped".yellow(),
        Some(rate) => format!(" {rate:.2}/s").into(),
        None => " ".into(),
    };
    let count = |name: &str, count: u64| {
        let span = Span::from(format!("  {name} {count}"));
        if count > 0 { span.yellow() } else { span }
    };
    let derived = match model.tally.derived {
        0 => "".into(),
        derived => Span::from(format!("  derived {derived}")),
    };
    let errors = match reading.errors.0 {
        0 => "  errors 0000: none".green(),
        word => format!("  errors {word:04X}: {}", failed_names(reading.errors))
            .red()
            .bold(),
    };
    Line::from(vec![
        format!(" packet {:04X}", reading.counter).into(),
        rate,
        format!("  total {}", model.tally.packets).into(),
        count("missed", model.tally.missed),
        count("unread", model.tally.unread),
        derived,
        errors,
    ])
}

fn alarm_line(model: &Model) -> Line<'static> {
    let alarm = Style::new()
        .fg(Color::White)
        .bg(Color::Red)
        .add_modifier(Modifier::BOLD);
    let kept = size(model.recorded_bytes);
    match (&model.recording_failure, &model.link) {
        (Some(why), _) => Line::styled(format!(" {why}"), alarm),
        (None, Link::Unplugged(why)) => Line::styled(format!(" {why}"), Style::new().fg(Color::Red)),
        _ => Line::from(format!(" {kept} recorded in {}", model.recording)),
    }
}
