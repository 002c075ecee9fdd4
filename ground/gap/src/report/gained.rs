//! What the shrink of a held-out gap came to, in words that can be true.
//!
//! In: the gap before and after, the floor, the percentage of the way with its interval, and what the true effect could gain.
//! Out: words. A percentage is of what lies above the floor. Where that is next to nothing it is a division by chance, so
//! sigmas are said instead; beyond the floor it is all of the way.

/// \[%\] width of an interval beyond which its percentage says nothing: all that there is.
const WIDEST: f64 = 100.0;

/// \[%\] a ceiling below which there is nothing to have a share of.
const LEAST_CEILING: f64 = 1.0;

/// In words: `97.5 % [95.2, 100.0] of at most 100.0 %`, or the sigmas gained.
pub fn gained(sigmas: [f64; 2], percent: f64, interval: [f64; 2], ceiling: Option<f64>) -> String {
    let [low, high] = interval;
    let nothing = ceiling.is_some_and(|ceiling| ceiling < LEAST_CEILING);
    // Not the contrary comparison: what is no number says nothing either.
    let says_something = high - low <= WIDEST && percent.is_finite() && low <= 100.0 && high >= -WIDEST;
    if nothing || !says_something {
        let [before, after] = sigmas;
        return match before - after {
            gain if gain >= 0.0005 => format!("{gain:.3} sigma less; too near the floor for a percentage"),
            gain if gain <= -0.0005 => format!("{:.3} sigma more", -gain),
            _ => "no change".into(),
        };
    }
    let ceiling = ceiling.map_or(String::new(), |ceiling| format!(" of at most {ceiling:.1} %"));
    if percent > 100.0 {
        return format!(
            "all of the way to the floor [{low:.1} %, {:.1} %]{ceiling}",
            high.min(100.0)
        );
    }
    format!("{percent:.1} % [{low:.1}, {high:.1}]{ceiling}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentage_is_said_only_of_something() {
        let said = |percent, interval, ceiling| gained([1.362, 0.996], percent, interval, ceiling);
        assert_eq!(
            said(97.5, [95.2, 100.0], Some(100.0)),
            "97.5 % [95.2, 100.0] of at most 100.0 %"
        );
        assert_eq!(
            said(0.0, [941.3, 1526.3], Some(0.0)),
            "0.366 sigma less; too near the floor for a percentage"
        );
        assert_eq!(
            said(157.2, [145.4, 176.7], Some(100.0)),
            "0.366 sigma less; too near the floor for a percentage"
        );
        assert_eq!(
            said(104.0, [98.0, 108.0], Some(100.0)),
            "all of the way to the floor [98.0 %, 100.0 %] of at most 100.0 %"
        );
        assert_eq!(gained([1.0, 1.0], f64::NAN, [f64::NAN; 2], None), "no change");
        assert_eq!(gained([1.026, 1.086], 0.0, [0.0, 500.0], None), "0.060 sigma more");
    }
}
