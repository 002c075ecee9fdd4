//! What a typed line is: words of the unit, or something for the console itself.
//!
//! In: a line. Out: a [`Typed`]. The unit's own listener judges: what it would take goes to it as typed, what it would pass
//! over in silence (`help`, `g_st`, a slip) is answered here, because nothing else would. `!` before a line sends it whatever
//! it is.

use emems::command::{COMMANDS, Heard, Parser, WORD_BYTES, digits_of};

use super::input;

/// What a line is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Typed {
    /// For the unit, as it stands.
    Send(String),
    /// For the console: the answer.
    Answer(Vec<String>),
    /// To end.
    Quit,
}

/// Judges a line without blanks around it.
pub fn typed(line: &str) -> Typed {
    if let Some(raw) = line.strip_prefix('!') {
        return Typed::Send(raw.trim().into());
    }
    match line.to_ascii_lowercase().as_str() {
        "help" | "h" | "?" => return Typed::Answer(help()),
        "quit" | "exit" | "q" => return Typed::Quit,
        _ => {}
    }
    match refusal(line) {
        None => Typed::Send(line.into()),
        Some(why) => Typed::Answer(vec![format!(
            "{line} was not sent: {why}; !{line} sends it all the same"
        )]),
    }
}

/// Why the unit would pass over a line, or some of it.
fn refusal(line: &str) -> Option<String> {
    let mut parser = Parser::default();
    let mut commands = 0;
    for byte in line.bytes() {
        match parser.hear(byte, 0) {
            Some(Heard::Command(_)) => commands += 1,
            Some(Heard::BadDigit { word, digit, .. }) => {
                let word = String::from_utf8_lossy(&word).into_owned();
                return Some(format!(
                    "digit {} after {word} is no upper-case hexadecimal one",
                    digit + 1
                ));
            }
            Some(Heard::Unknown(_)) => return Some(unknown(line)),
            None => {}
        }
    }
    if parser.passed_over > 0 || commands == 0 {
        return Some(unknown(line));
    }
    // A half word at the end would wait for letters of the next one: whole words alone are as many as were heard.
    let mut again = Parser::default();
    let mut last = 0;
    for (at, byte) in line.bytes().enumerate() {
        if again.hear(byte, 0).is_some() {
            last = at + 1;
        }
    }
    let rest = line.get(last..).unwrap_or_default().trim();
    (!rest.is_empty()).then(|| format!("{rest} at its end is half a word"))
}

fn unknown(line: &str) -> String {
    let words = || COMMANDS.iter().map(input::word);
    if let Some(word) = words().find(|word| line.starts_with(word)) {
        let taking = COMMANDS.iter().find(|entry| input::word(entry) == word);
        return match taking.map(|entry| entry.command) {
            Some(command) if digits_of(command) > 0 => {
                format!("{word} takes {} hexadecimal digits", digits_of(command))
            }
            _ => format!("what follows {word} is no word"),
        };
    }
    let begun = line.get(..WORD_BYTES).unwrap_or_default();
    let of_case: Vec<&str> = words().filter(|word| begun.eq_ignore_ascii_case(word)).collect();
    match of_case.as_slice() {
        [] => "the unit has no such word; help lists them".into(),
        words => format!("case counts, the unit knows {}", words.join(" and ")),
    }
}

fn help() -> Vec<String> {
    let row = |entry: &emems::command::Entry| format!("{}  {}", input::word(entry), entry.meaning);
    COMMANDS
        .iter()
        .map(row)
        .chain(["quit  leaves the console".into()])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(line: &str) -> String {
        match typed(line) {
            Typed::Answer(lines) => lines.join("\n"),
            other => panic!("{line}: {other:?}"),
        }
    }

    #[test]
    fn every_word_of_the_unit_is_sent_as_typed() {
        for entry in &COMMANDS {
            let word = input::word(entry);
            let line = match word {
                "G_LR" => "G_LR00000A0000FF".to_string(),
                "G_CW" => "G_CW0001DEADBEEF".to_string(),
                "G_RA" => "G_RA1B5821340503".to_string(),
                "G_SI" => "G_SI2634FF18F7DDFC84020A400F00".to_string(),
                word => word.to_string(),
            };
            assert_eq!(typed(&line), Typed::Send(line.clone()), "{word}");
        }
        assert_eq!(typed("G_MV G_MV"), Typed::Send("G_MV G_MV".into()));
        assert_eq!(typed("!anything"), Typed::Send("anything".into()));
    }

    #[test]
    fn what_the_unit_would_pass_over_is_answered_here() {
        assert!(answer("help").contains("G_ST  status"));
        assert!(answer("g_st").contains("case counts, the unit knows G_ST"));
        assert!(answer("g_mt").contains("G_MT and G_Mt"));
        assert!(answer("status").contains("no such word"));
        assert!(answer("G_XX").contains("no such word"));
        assert!(answer("G_LR00000a0000FF").contains("digit 6 after G_LR"));
        assert!(answer("G_LR").contains("G_LR takes 12 hexadecimal digits"));
        assert!(answer("G_SI2634").contains("G_SI takes 26 hexadecimal digits"));
        assert!(answer("G_ST G_").contains("half a word"));
        assert!(answer("G_MTx").contains("what follows G_MT"));
        assert_eq!((typed("quit"), typed("EXIT")), (Typed::Quit, Typed::Quit));
    }
}
