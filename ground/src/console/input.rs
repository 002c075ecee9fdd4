//! The input line: letters to a word, with completion of the unit's commands and a memory of what was sent.
//!
//! In: editing steps. Out: the text, the commands it may become, and the word to send. Nothing is ever completed or
//! sent unless asked for, and case is kept as typed: `G_MT` and `G_Mt` are different words.

use emems::command::{COMMANDS, Entry};

/// The input line.
#[derive(Default)]
pub struct Input {
    /// ASCII only, so that bytes are letters.
    text: String,
    /// Letters before the cursor.
    cursor: usize,
    /// What was sent, oldest first.
    sent: Vec<String>,
    /// Which of `sent` is shown.
    recalled: Option<usize>,
    /// What was typed before completion, and which candidate is shown.
    completing: Option<(String, usize)>,
}

impl Input {
    /// The line as it stands.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Adds a letter; only printable ASCII, the unit knows no other.
    pub fn push(&mut self, letter: char) {
        if letter.is_ascii_graphic() || letter == ' ' {
            self.text.insert(self.cursor, letter);
            self.cursor += 1;
            self.edited();
        }
    }

    /// Letters before the cursor.
    pub fn cursor(&self) -> usize {
        self.cursor
    }

    /// Edits the line or moves in it.
    pub fn edit(&mut self, edit: Edit) {
        let (cursor, end) = (self.cursor, self.text.len());
        // A word begins after a blank.
        let word = || self.text[..cursor].trim_end().rfind(' ').map_or(0, |blank| blank + 1);
        let (removed, to) = match edit {
            Edit::Left => (0..0, cursor.saturating_sub(1)),
            Edit::Right => (0..0, (cursor + 1).min(end)),
            Edit::Home => (0..0, 0),
            Edit::End => (0..0, end),
            Edit::Backspace => (cursor.saturating_sub(1)..cursor, cursor.saturating_sub(1)),
            Edit::Delete => (cursor..(cursor + 1).min(end), cursor),
            Edit::ToHome => (0..cursor, 0),
            Edit::ToEnd => (cursor..end, cursor),
            Edit::Word => (word()..cursor, word()),
            Edit::All => (0..end, 0),
        };
        if !removed.is_empty() || edit == Edit::All {
            self.text.replace_range(removed, "");
            self.edited();
        }
        self.cursor = to;
    }

    /// The commands the typed text may become.
    pub fn candidates(&self) -> Vec<&'static Entry> {
        let typed = self.completing.as_ref().map_or(self.text.as_str(), |(typed, _)| typed);
        candidates(typed)
    }

    /// Puts the next candidate in place of the typed text.
    pub fn complete(&mut self) {
        let (typed, next) = match self.completing.take() {
            Some((typed, shown)) => (typed, shown + 1),
            None => (self.text.clone(), 0),
        };
        let candidates = candidates(&typed);
        let Some(entry) = candidates.get(next % candidates.len().max(1)) else {
            return;
        };
        self.text = word(entry).to_owned();
        self.cursor = self.text.len();
        self.completing = (candidates.len() > 1).then_some((typed, next));
    }

    /// Shows the word sent before the one shown.
    pub fn older(&mut self) {
        let newest = self.sent.len().checked_sub(1);
        self.recall(self.recalled.map_or(newest, |shown| Some(shown.saturating_sub(1))));
    }

    /// Shows the word sent after the one shown; after the newest, an empty line.
    pub fn newer(&mut self) {
        self.recall(self.recalled.map(|shown| shown + 1));
    }

    /// The word to send, if there is one; the line is empty after.
    pub fn take(&mut self) -> Option<String> {
        let word = self.text.trim().to_owned();
        self.edit(Edit::All);
        if word.is_empty() {
            return None;
        }
        if self.sent.last() != Some(&word) {
            self.sent.push(word.clone());
        }
        Some(word)
    }

    fn edited(&mut self) {
        self.recalled = None;
        self.completing = None;
    }

    fn recall(&mut self, which: Option<usize>) {
        let Some(which) = which else { return };
        self.edit(Edit::All);
        if let Some(word) = self.sent.get(which) {
            self.text.clone_from(word);
            self.cursor = self.text.len();
            self.recalled = Some(which);
        }
    }
}

/// A key's work on the line, as shells have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edit {
    /// A letter to the left.
    Left,
    /// A letter to the right.
    Right,
    /// To the beginning (Ctrl-A).
    Home,
    /// To the end (Ctrl-E).
    End,
    /// Takes the letter before the cursor away.
    Backspace,
    /// Takes the letter at the cursor away.
    Delete,
    /// All before the cursor (Ctrl-U).
    ToHome,
    /// All from the cursor on (Ctrl-K).
    ToEnd,
    /// The word before the cursor (Ctrl-W).
    Word,
    /// The whole line.
    All,
}

/// A command's word as text.
pub fn word(entry: &Entry) -> &'static str {
    std::str::from_utf8(entry.word).unwrap_or_default()
}

/// Commands that begin as typed; if none does, those that do apart from case.
fn candidates(typed: &str) -> Vec<&'static Entry> {
    if typed.is_empty() {
        return Vec::new();
    }
    let exact: Vec<_> = COMMANDS.iter().filter(|entry| word(entry).starts_with(typed)).collect();
    if !exact.is_empty() {
        return exact;
    }
    let begins = |entry: &&Entry| {
        word(entry)
            .get(..typed.len())
            .is_some_and(|start| start.eq_ignore_ascii_case(typed))
    };
    COMMANDS.iter().filter(begins).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(text: &str) -> Input {
        let mut input = Input::default();
        text.chars().for_each(|letter| input.push(letter));
        input
    }

    fn words(input: &Input) -> Vec<&'static str> {
        input.candidates().into_iter().map(word).collect()
    }

    #[test]
    fn candidates_begin_as_typed_and_case_counts() {
        assert_eq!(words(&typed("G_MT")), ["G_MT"]);
        assert_eq!(words(&typed("G_Mt")), ["G_Mt"]);
        assert_eq!(words(&typed("g_mt")), ["G_MT", "G_Mt"]);
        assert_eq!(words(&typed("")), [""; 0]);
        assert_eq!(words(&typed("G_MTx")), [""; 0]);
    }

    #[test]
    fn completion_goes_round_the_candidates() {
        let mut input = typed("g_mt");
        let mut seen = Vec::new();
        for _ in 0..3 {
            input.complete();
            seen.push(input.text().to_owned());
        }
        assert_eq!(seen, ["G_MT", "G_Mt", "G_MT"]);
        let mut none = typed("hello");
        none.complete();
        assert_eq!(none.text(), "hello");
    }

    #[test]
    fn editing_after_completion_starts_from_the_completed_word() {
        let mut input = typed("g_s");
        input.complete();
        input.edit(Edit::Backspace);
        assert_eq!(input.text(), "G_S");
        assert_eq!(words(&input), ["G_SI", "G_ST"]);
    }

    #[test]
    fn what_was_sent_can_be_recalled() {
        let mut input = Input::default();
        input.older();
        assert_eq!(input.text(), "");
        for word in ["G_ST", "G_MT", "G_MT"] {
            word.chars().for_each(|letter| input.push(letter));
            assert_eq!(input.take().as_deref(), Some(word));
        }
        let mut seen = Vec::new();
        for step in [Input::older, Input::older, Input::older, Input::newer, Input::newer] {
            step(&mut input);
            seen.push(input.text().to_owned());
        }
        assert_eq!(seen, ["G_MT", "G_ST", "G_ST", "G_MT", ""]);
    }

    #[test]
    fn the_line_is_edited_where_the_cursor_is() {
        let mut input = typed("G_DL G_ST");
        let mut check = |edits: &[Edit], text: &str, cursor: usize| {
            edits.iter().for_each(|edit| input.edit(*edit));
            assert_eq!((input.text(), input.cursor()), (text, cursor), "{edits:?}");
        };
        check(&[Edit::Word], "G_DL ", 5);
        check(&[Edit::Home, Edit::Right, Edit::Delete], "GDL ", 1);
        check(&[Edit::Left, Edit::Left, Edit::End, Edit::Backspace], "GDL", 3);
        check(&[Edit::Left, Edit::ToHome], "L", 0);
        check(&[Edit::ToEnd, Edit::Backspace, Edit::Delete, Edit::Right], "", 0);
        "G_MT".chars().for_each(|letter| input.push(letter));
        input.edit(Edit::Home);
        input.push('!');
        assert_eq!(input.text(), "!G_MT");
    }

    #[test]
    fn blanks_and_control_letters_send_nothing() {
        let mut input = typed("  \r\n\u{1b}µ");
        assert_eq!(input.text(), "  ");
        assert_eq!(input.take(), None);
    }
}
