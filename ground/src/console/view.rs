//! The screen, given what is known and how the user looks at it.
//!
//! In: a [`Model`] and a [`View`]. Out: one drawn frame, for any size of terminal; laid out for 100 x 30, usable at
//! 80 x 24. Top to bottom: three lines of state, the sensors (table and plot, or four plots), the log, the input line,
//! and a line of help that shows what the typed letters may become.

use std::time::Duration;

use emems::mode::Mode;
use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Modifier, Style, Stylize},
    text::{Line, Span},
    widgets::{Block, Borders, Paragraph},
};

use super::{
    display::{GROUPS, Group, size},
    help,
    input::{self, Input},
    model::{Link, LogLine, Model, Source, failed_names},
    plot, table,
};

/// Which sensors fill the middle of the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Page {
    /// The table, and a plot beside it where there is room.
    #[default]
    Table,
    /// Four plots.
    Plots,
}

/// How the user looks at the model.
pub struct View {
    /// Table or plots.
    pub page: Page,
    /// Group of the plot beside the table.
    pub group: Group,
    /// Plate of the plots, 0 to 3.
    pub plate: usize,
    /// Time over which is plotted.
    pub window: Duration,
    /// Lines the log is scrolled back.
    pub scroll: usize,
    /// The help covers the screen.
    pub help: bool,
    /// The input line.
    pub input: Input,
}

impl Default for View {
    fn default() -> Self {
        View {
            page: Page::default(),
            group: Group::Accelerometers,
            plate: 0,
            window: Duration::from_secs(30),
            scroll: 0,
            help: false,
            input: Input::default(),
        }
    }
}

const KEYS: &str = " F1 help  F2 plots  F3 group  F4 plate  F5 window  Tab complete  q quit";

/// Narrowest terminal with a plot beside the table.
const WIDE: u16 = table::WIDTH + 32;

/// Draws a frame.
pub fn draw(frame: &mut Frame, model: &Model, view: &View) {
    let log = match view.page {
        Page::Table => Constraint::Min(2),
        Page::Plots => Constraint::Length(5),
    };
    let body = match view.page {
        Page::Table => Constraint::Length(table::HEIGHT),
        Page::Plots => Constraint::Min(8),
    };
    let one = Constraint::Length(1);
    let [state, body, log, input, hint] =
        Layout::vertical([Constraint::Length(3), body, log, one, one]).areas(frame.area());
    frame.render_widget(Paragraph::new(state_lines(model)), state);
    draw_body(frame, body, model, view);
    draw_log(frame, log, model, view.scroll);
    frame.render_widget(Paragraph::new(format!("> {}_", view.input.text())).bold(), input);
    frame.render_widget(Paragraph::new(hint_text(&view.input)).dim(), hint);
    if view.help {
        help::draw(frame);
    }
}

fn draw_body(frame: &mut Frame, area: Rect, model: &Model, view: &View) {
    let plot = |frame: &mut Frame, area, group| plot::draw(frame, area, model, group, view.plate, view.window);
    match view.page {
        Page::Table if area.width < WIDE => frame.render_widget(table::table(model), area),
        Page::Table => {
            let [left, right] = Layout::horizontal([Constraint::Length(table::WIDTH), Constraint::Min(0)]).areas(area);
            frame.render_widget(table::table(model), left);
            plot(frame, right, view.group);
        }
        Page::Plots => {
            let half = [Constraint::Fill(1), Constraint::Fill(1)];
            let rows: [Rect; 2] = Layout::vertical(half).areas(area);
            let areas = rows
                .into_iter()
                .flat_map(|row| Layout::horizontal(half).spacing(1).areas::<2>(row));
            for (area, group) in areas.zip(GROUPS) {
                plot(frame, area, group);
            }
        }
    }
}

fn state_lines(model: &Model) -> Vec<Line<'static>> {
    vec![unit_line(model), packet_line(model), alarm_line(model)]
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
        return Line::from(" no packet yet: G_MT asks for them in WAIT").yellow();
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

fn draw_log(frame: &mut Frame, area: Rect, model: &Model, scroll: usize) {
    let area = if area.height > 2 {
        let title = if scroll > 0 {
            " log, scrolled back: PgDn "
        } else {
            " log "
        };
        let block = Block::new().borders(Borders::TOP).title(title);
        let inner = block.inner(area);
        frame.render_widget(block, area);
        inner
    } else {
        area
    };
    let rows = usize::from(area.height);
    let end = model.log.len().saturating_sub(scroll).max(rows.min(model.log.len()));
    let lines = model.log.range(end.saturating_sub(rows)..end).map(log_line);
    frame.render_widget(Paragraph::new(lines.collect::<Vec<_>>()), area);
}

/// A line of the log.
pub fn log_line(line: &LogLine) -> Line<'static> {
    let (mark, style) = match line.source {
        Source::Unit => ("<", Style::new()),
        Source::Sent => (">", Style::new().fg(Color::Cyan)),
        Source::Console => ("*", Style::new().fg(Color::Yellow)),
        Source::Unread => ("!", Style::new().fg(Color::Red)),
    };
    Line::styled(format!("{:9.2} {mark} {}", line.at.as_secs_f64(), line.text), style)
}

fn hint_text(input: &Input) -> String {
    let candidates = input.candidates();
    let described = candidates
        .iter()
        .map(|entry| format!("{} {}", input::word(entry), entry.meaning));
    match candidates.len() {
        0 if input.text().is_empty() => KEYS.into(),
        0 => " no command of the unit begins so; it is sent as typed".into(),
        1..=3 => format!(" {}", described.collect::<Vec<_>>().join("  |  ")),
        _ => format!(
            " {}",
            candidates.into_iter().map(input::word).collect::<Vec<_>>().join("  ")
        ),
    }
}
