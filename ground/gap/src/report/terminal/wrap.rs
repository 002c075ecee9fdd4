//! Lines of a screen.

/// Columns of a screen.
const WIDTH: usize = 118;

/// Longer lines go on in the next, indented.
pub fn wrapped(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let mut width = 0;
        for (at, word) in line.split(' ').enumerate() {
            let length = word.chars().count();
            if at > 0 && width + 1 + length > WIDTH {
                out.push_str("\n        ");
                width = 8;
            } else if at > 0 {
                out.push(' ');
                width += 1;
            }
            out.push_str(word);
            width += length;
        }
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_go_on_indented_and_lose_no_word() {
        let line = format!("NEXT    {}", "word ".repeat(60));
        let found = wrapped(&line);
        assert!(found.lines().all(|line| line.chars().count() <= WIDTH), "{found}");
        assert_eq!(found.matches("word").count(), 60);
        assert!(
            found
                .lines()
                .nth(1)
                .is_some_and(|line| line.starts_with("        word"))
        );
    }
}
