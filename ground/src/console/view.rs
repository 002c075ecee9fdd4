//! The screen, given what is known and how the user looks at it.
//!
//! In: a [`Model`] and a [`View`]. Out: one drawn frame, for any size of terminal; laid out for 100 x 30, usable at
//! 80 x 24. Top to bottom: three lines of state and two of attitude, the sensors (table and plot, or four plots), the log, the input line,
//! and a line of help that shows what the typed letters may become.

use std::time::Duration;

use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Style, Stylize},
    text::Line,
    widgets::{Block, Borders, Paragraph},
};

use super::{
    display::{GROUPS, Group},
    help,
    input::{self, Input},
    model::{LogLine, Model, Source},
    plot, state, table,
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
    // On a small terminal a fresh reply comes before the table's last rows.
    let beside = frame.area().height.saturating_sub(state::LINES + 2);
    let reply = match view.scroll {
        0 => reply_rows(model, frame.area().width).min(beside.into()) as u16,
        _ => 0,
    };
    let log = match view.page {
        Page::Table => Constraint::Min(2.max(reply)),
        Page::Plots => Constraint::Length(5),
    };
    let body = match view.page {
        Page::Table => Constraint::Length(table::HEIGHT.min(beside.saturating_sub(2.max(reply)))),
        Page::Plots => Constraint::Min(8),
    };
    let one = Constraint::Length(1);
    let mut lines = state::lines(model);
    if view.page == Page::Table {
        // On a small terminal the table and two lines of log come before the attitude.
        let most = frame.area().height.saturating_sub(table::HEIGHT + 4).max(state::LINES);
        lines.truncate(usize::from(if reply > 2 { state::LINES } else { most }));
    }
    let [state, body, log, input, hint] =
        Layout::vertical([Constraint::Length(lines.len() as u16), body, log, one, one]).areas(frame.area());
    frame.render_widget(Paragraph::new(lines), state);
    draw_body(frame, body, model, view);
    draw_log(frame, log, model, view.scroll);
    frame.render_widget(Paragraph::new(input_line(&view.input)).bold(), input);
    frame.render_widget(Paragraph::new(hint_text(&view.input)).dim(), hint);
    if view.help {
        help::draw(frame);
    }
}

/// The line with its cursor: an underscore at its end, the letter itself reversed elsewhere.
fn input_line(input: &Input) -> Line<'static> {
    let (before, after) = input.text().split_at(input.cursor());
    match after.split_at_checked(1) {
        None => Line::from(format!("> {before}_")),
        Some((at, rest)) => Line::from(vec![
            format!("> {before}").into(),
            at.to_owned().reversed(),
            rest.to_owned().into(),
        ]),
    }
}

/// Time for which a reply that is longer than the log has rows is shown over the table.
const REPLY_SHOWN: Duration = Duration::from_secs(20);

/// Rows that the last word and all that came after it take, while it is fresh.
fn reply_rows(model: &Model, width: u16) -> usize {
    let unasked = |line: &&LogLine| line.source != Source::Sent;
    let after = model.log.iter().rev().take_while(unasked).count();
    let asked = model.log.len().checked_sub(after + 1).and_then(|at| model.log.get(at));
    let fresh = |line: &LogLine| model.now.saturating_sub(line.at) < REPLY_SHOWN;
    let shown = match asked {
        Some(asked) if fresh(asked) => after + 1,
        // What the console answers itself has no word before it.
        _ => {
            let answers = model.log.iter().rev();
            answers
                .take_while(|line| line.source == Source::Console && fresh(line))
                .count()
        }
    };
    let lines = model.log.iter().rev().take(shown);
    lines.map(|line| log_rows(line, width).len()).sum()
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

fn draw_log(frame: &mut Frame, area: Rect, model: &Model, scroll: usize) {
    let area = if area.height > 2 && usize::from(area.height) > reply_rows(model, area.width) {
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
    let lines = model.log.range(end.saturating_sub(rows)..end);
    let mut lines: Vec<Line> = lines.flat_map(|line| log_rows(line, area.width)).collect();
    lines.drain(..lines.len().saturating_sub(rows));
    frame.render_widget(Paragraph::new(lines), area);
}

/// A line of the log.
pub fn log_line(line: &LogLine) -> Line<'static> {
    let (before, style) = before_text(line);
    Line::styled(before + &line.text, style)
}

/// Columns of a log line's time and mark.
const BEFORE_TEXT: usize = 12;

fn before_text(line: &LogLine) -> (String, Style) {
    let (mark, style) = match line.source {
        Source::Unit => ("<", Style::new()),
        Source::Sent => (">", Style::new().fg(Color::Cyan)),
        Source::Console => ("*", Style::new().fg(Color::Yellow)),
        Source::Unread => ("!", Style::new().fg(Color::Red)),
    };
    (format!("{:9.2} {mark} ", line.at.as_secs_f64()), style)
}

/// A line of the log, in as many rows as it takes; the later ones begin under the first one's text.
fn log_rows(line: &LogLine, width: u16) -> Vec<Line<'static>> {
    let (before, style) = before_text(line);
    let mut rows = vec![before];
    // A terminal too narrow for any text shows a letter a row.
    let room = usize::from(width).saturating_sub(BEFORE_TEXT).max(1);
    let mut taken = 0;
    for (at, word) in line.text.split(' ').enumerate() {
        let letters: Vec<char> = word.chars().collect();
        let gap = usize::from(at > 0);
        if taken > 0 && taken + gap + letters.len() > room {
            rows.push(" ".repeat(BEFORE_TEXT));
            taken = 0;
        } else if let Some(row) = rows.last_mut() {
            row.extend(std::iter::repeat_n(' ', gap));
            taken += gap;
        }
        for part in letters.chunks(room) {
            if taken + part.len() > room {
                rows.push(" ".repeat(BEFORE_TEXT));
                taken = 0;
            }
            if let Some(row) = rows.last_mut() {
                row.extend(part);
            }
            taken += part.len();
        }
    }
    rows.into_iter().map(|row| Line::styled(row, style)).collect()
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

#[cfg(test)]
mod tests {
    use emems::{packet, sample::Reading};
    use ratatui::{Terminal, backend::TestBackend};

    use super::*;
    use crate::console::{
        model::Link,
        stream::{Found, Item, Stream},
    };

    const GOLDEN: &[u8] = b"@00018020FEC50002FF9EFEB5FFFCFF81FEBF000AFF8400020001015D0078FFDDFF2EFF4C003CFFA1008CFFB50021FFF400CDFF8AFFFD089BF71D0008000CFFFC0000000701900191018F019211#";

    /// The golden packet, but with failed sensors mag 2 and temp 4, heard as the sixth of a second.
    fn model() -> Model {
        let mut model = Model::new("/dev/ttyUSB0", "pad.log");
        model.link = Link::Plugged;
        model.recorded_bytes = 12_345;
        let cycle = Duration::from_millis(200);
        for counter in 0..6 {
            let mut reading = packet::decode(GOLDEN).unwrap();
            reading.counter = counter;
            let packet = packet::encode(&reading);
            for found in Stream::default().read(&packet) {
                model.found(cycle * counter.into(), found);
            }
        }
        let reply = Item::Reply("G_ST WAIT task G_MT recording 0 derived 0".into());
        model.found(Duration::from_secs(1), Found { at: 0, item: reply });
        model.now = Duration::from_secs(1);
        model
    }

    fn screen(model: &Model, view: &View, width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        let frame = terminal.draw(|frame| draw(frame, model, view)).unwrap();
        let cells: Vec<_> = frame.buffer.content().iter().map(|cell| cell.symbol()).collect();
        cells
            .chunks(width.into())
            .map(|row| row.concat().trim_end().to_owned())
            .collect()
    }

    #[test]
    fn at_80_by_24_the_state_all_sensors_and_the_input_line_are_seen() {
        let screen = screen(&model(), &View::default(), 80, 24);
        assert_eq!(
            screen[..6],
            [
                " /dev/ttyUSB0  plugged  mode WAIT  lift-off YES  micro-g YES",
                " packet 0005 5.00/s  total 6  missed 0  unread 0  errors 8020: mag 2, temp 4",
                " 12.3 kB recorded in pad.log",
                "       x cnt y cnt z cnt       x       y       z   unit",
                "acc 1   -315     2   -98   -9.27    0.06   -2.88 m/s²",
                "acc 2   -331    -4  -127   -9.74   -0.12   -3.74 m/s²",
            ]
        );
        assert_eq!(screen[9], "mag 2   -180    60   -95  -16.51    5.50   -8.72 FAILED");
        assert_eq!(screen[13], "gyro 2  2203          -4  161.39           24.42 °/s °C");
        assert_eq!(screen[19], "temp 4   402               25.12                 FAILED");
        assert_eq!(
            screen[20..],
            ["     1.00 < G_ST WAIT task G_MT recording 0 derived 0", "", "> _", KEYS]
        );
    }

    #[test]
    fn a_wide_screen_has_a_plot_beside_the_table_and_f2_shows_four() {
        let mut view = View {
            group: Group::Gyros,
            plate: 3,
            ..View::default()
        };
        let table = screen(&model(), &view, 100, 30);
        assert!(table[3].contains("z   unit    gyros [°/s] 1 2 3 4 "), "{}", table[3]);
        assert!(table.iter().any(|row| row.contains("temp 1   400")));
        view.page = Page::Plots;
        let plots = screen(&model(), &view, 100, 30).join("\n");
        for title in [
            "accelerometer 4 [m/s²] x y z",
            "magnetometer 4 [µT]",
            "gyros [°/s]",
            "temperatures [°C]",
        ] {
            assert!(plots.contains(title), "{title}\n{plots}");
        }
    }

    #[test]
    fn at_80_by_24_the_whole_reply_to_a_command_is_seen() {
        let mut model = model();
        model.sent(Duration::from_secs(1), "G_HE");
        let view = View::default();
        for k in 0..18 {
            let item = Item::Reply(format!("G_HE word {k}"));
            model.found(Duration::from_secs(1), Found { at: 0, item });
        }
        let rows = screen(&model, &view, 80, 24);
        assert!(
            rows[3].ends_with("> G_HE") && rows[21].ends_with("word 17"),
            "{rows:#?}"
        );
        assert_eq!(rows[22], "> _");
        model.now = Duration::from_secs(60);
        assert!(
            screen(&model, &view, 80, 24)[3].contains("x cnt"),
            "the table comes back"
        );
    }

    #[test]
    fn a_reply_longer_than_the_screen_is_wide_goes_on_in_the_next_row() {
        let mut model = model();
        model.sent(Duration::from_secs(1), "G_ST");
        let status = "G_ST clock crystal stack 9000 of 65536 bytes brown-out 2700 mV of 2700 image 0123ABCD";
        let item = Item::Reply(status.into());
        model.found(Duration::from_secs(1), Found { at: 0, item });
        let rows = screen(&model, &View::default(), 80, 24);
        assert!(rows[19].ends_with("> G_ST"), "{rows:#?}");
        assert!(rows[20].ends_with("brown-out 2700 mV of"), "{rows:#?}");
        assert_eq!(rows[21], "            2700 image 0123ABCD");
        // A word without a gap is cut where the row ends, at any width.
        let line = |text: &str| LogLine {
            at: Duration::ZERO,
            source: Source::Unit,
            text: text.into(),
        };
        let whole = "x".repeat(100);
        for width in 0..120 {
            let rows = log_rows(&line(&whole), width);
            let letters: usize = rows.iter().map(|row| row.to_string().matches('x').count()).sum();
            assert_eq!(letters, 100, "{width}");
            assert!(
                rows.iter().all(|row| row.width() <= usize::from(width.max(13))),
                "{width}"
            );
        }
    }

    #[test]
    fn nothing_heard_yet_says_what_to_do() {
        let screen = screen(&Model::new("pad", "pad.log"), &View::default(), 80, 24);
        assert_eq!(screen[0], " pad  ...  mode ? (G_ST asks)  lift-off ?  micro-g ?");
        assert_eq!(screen[1], " no packet yet: G_MT, sent twice, asks for them in WAIT");
        assert!(screen[4].starts_with("acc 1     --"));
    }

    #[test]
    fn a_lost_unit_and_a_lost_recording_are_seen_at_once() {
        let mut model = model();
        model.link = Link::Unplugged("Broken pipe; waiting for it".into());
        model.now = Duration::from_secs(9);
        let lost = screen(&model, &View::default(), 80, 24);
        assert!(lost[0].contains("UNPLUGGED") && lost[1].contains(" stopped "));
        assert_eq!(lost[2], " Broken pipe; waiting for it");
        model.recording_failure = Some("RECORDING FAILED: disk full".into());
        assert_eq!(
            screen(&model, &View::default(), 80, 24)[2],
            " RECORDING FAILED: disk full"
        );
    }

    #[test]
    fn the_last_line_says_what_the_typed_letters_may_become() {
        let hint = |typed: &str| {
            let mut view = View::default();
            typed.chars().for_each(|letter| view.input.push(letter));
            screen(&model(), &view, 80, 24)[23].clone()
        };
        assert_eq!(hint("G_MT"), " G_MT WAIT: packets to the umbilical (send twice)");
        assert_eq!(hint("G_MA"), " G_MA WAIT: erase the recorder (then G_CA)");
        assert!(hint("G_M").starts_with(" G_MV  G_ME  G_MT  G_MA "));
        assert!(hint("hello").contains("no command"));
    }

    #[test]
    fn no_size_of_terminal_and_no_reading_panics() {
        let mut model = model();
        model.found(
            Duration::from_secs(1),
            Found {
                at: 0,
                item: Item::Packet(Box::new(Reading::unread(9))),
            },
        );
        for (width, height) in [(1, 1), (20, 5), (57, 18), (300, 90)] {
            for (page, help, scroll) in [
                (Page::Table, false, 99),
                (Page::Plots, false, 0),
                (Page::Table, true, 0),
            ] {
                let view = View {
                    page,
                    help,
                    scroll,
                    ..View::default()
                };
                screen(&model, &view, width, height);
            }
        }
    }
}
