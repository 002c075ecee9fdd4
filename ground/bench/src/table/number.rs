//! One number, with a decimal point or a decimal comma.
//!
//! In: a cell's text. Out: its value, or `None`. Separators of thousands are refused: `1.234` and `1,234` would mean
//! two things each.

/// The mark between units and tenths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decimal {
    /// `0.5`
    Point,
    /// `0,5`
    Comma,
    /// Either, to tell numbers from words.
    Either,
}

impl Decimal {
    /// How messages call it.
    pub fn name(self) -> &'static str {
        match self {
            Decimal::Point => "point",
            Decimal::Comma => "comma",
            Decimal::Either => "point or comma",
        }
    }
}

/// The value of a number.
pub fn parse(text: &str, decimal: Decimal) -> Option<f64> {
    // Typesetters' minus (U+2212) comes with tables copied from documents.
    let text = text.trim().replace('\u{2212}', "-");
    let plain = text
        .chars()
        .all(|letter| letter.is_ascii_digit() || matches!(letter, '+' | '-' | '.' | ',' | 'e' | 'E'));
    let marks = text.matches(['.', ',']).count();
    if !plain || marks > 1 || !text.contains(|letter: char| letter.is_ascii_digit()) {
        return None;
    }
    match decimal {
        Decimal::Point if text.contains(',') => None,
        Decimal::Comma if text.contains('.') => None,
        _ => text.replace(',', ".").parse().ok(),
    }
}

/// The mark a number has; `None` for a whole number.
pub fn marked(text: &str) -> Option<Decimal> {
    match (text.contains('.'), text.contains(',')) {
        (true, false) => Some(Decimal::Point),
        (false, true) => Some(Decimal::Comma),
        _ => None,
    }
}
