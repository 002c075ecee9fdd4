//! An axis: its label, its scale, its limits, and what its ticks say.
//!
//! In: an [`Axis`] and the values on it. Out: a range in drawing units (the value, or its decimal logarithm) and tick
//! texts. Logarithms are drawn on a linear axis with ticks at whole powers, so that one kind of chart serves both.

use std::ops::Range;

/// How values stand on an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By decimal logarithm; values of zero and below are left out.
    Logarithmic,
}

/// An axis of a panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Quantity and unit, "time \[s\]".
    pub label: String,
    /// How values stand on it.
    pub scale: Scale,
    /// Least and most shown, in values; `None` for what the layers need.
    pub limits: Option<(f64, f64)>,
    /// What stands at 1, 2, 3 and so on instead of numbers; empty for numbers.
    pub names: Vec<String>,
    /// As a y axis: alike in all panels of the figure whose y axis is shared and has the same label.
    pub is_shared: bool,
    /// Length that it has at least: values that hardly change are not blown up beyond it.
    pub least_span: f64,
}

impl Axis {
    /// A linear axis that fits its values.
    pub fn linear(label: impl Into<String>) -> Self {
        Axis {
            label: label.into(),
            ..Axis::default()
        }
    }

    /// A logarithmic axis that fits its values.
    pub fn logarithmic(label: impl Into<String>) -> Self {
        Axis {
            scale: Scale::Logarithmic,
            ..Axis::linear(label)
        }
    }

    /// An axis of things that have names instead of values: the first stands at 1.
    pub fn named(label: impl Into<String>, names: impl IntoIterator<Item = String>) -> Self {
        let names: Vec<String> = names.into_iter().collect();
        Axis {
            limits: Some((0.4, names.len() as f64 + 0.6)),
            names,
            ..Axis::linear(label)
        }
    }

    /// The same axis, alike in all panels of the figure that share it.
    #[must_use]
    pub fn shared(self) -> Self {
        Axis {
            is_shared: true,
            ..self
        }
    }

    /// The same axis, never shorter than `span`.
    #[must_use]
    pub fn at_least(self, span: f64) -> Self {
        Axis {
            least_span: span,
            ..self
        }
    }

    /// The same axis from `least` to `most`.
    #[must_use]
    pub fn between(self, least: f64, most: f64) -> Self {
        Axis {
            limits: Some((least, most)),
            ..self
        }
    }

    /// Where a value is drawn; not finite for one that cannot be.
    pub(crate) fn place(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Logarithmic if value > 0.0 => value.log10(),
            Scale::Logarithmic => f64::NAN,
        }
    }

    /// What is shown, in drawing units, given where values are drawn; `air` is the share left free at both ends.
    pub(crate) fn range(&self, places: impl Iterator<Item = f64>, air: f64) -> Range<f64> {
        let limits = (self.limits.map(|(least, most)| (self.place(least), self.place(most))))
            .filter(|(least, most)| least.is_finite() && most.is_finite() && least < most);
        if let Some((least, most)) = limits {
            return least..most;
        }
        let (least, most) = places
            .filter(|place| place.is_finite())
            .fold((f64::MAX, f64::MIN), |(least, most), place| {
                (least.min(place), most.max(place))
            });
        if least > most {
            return 0.0..1.0;
        }
        // A flat line is drawn in the middle of a span that its own size suggests.
        let flat = match self.scale {
            Scale::Linear => (1e-3 * least.abs().max(most.abs())).max(1e-12),
            Scale::Logarithmic => 0.5,
        };
        let span = (most - least).max(flat).max(self.least_span);
        let middle = 0.5 * (least + most);
        middle - (0.5 + air) * span..middle + (0.5 + air) * span
    }

    /// Where ticks stand in a range: some `count` round values, whole powers, or names.
    pub(crate) fn ticks(&self, range: &Range<f64>, count: usize) -> Vec<f64> {
        let span = range.end - range.start;
        let step = match self.scale {
            _ if !self.names.is_empty() => 1.0,
            Scale::Logarithmic if span >= 1.0 => (span / count as f64).ceil().max(1.0),
            _ => round_step(span / count.max(1) as f64),
        };
        let first = (range.start / step - 1e-9).ceil();
        let last = (range.end / step + 1e-9).floor();
        if !(last - first).is_finite() || last - first > 100.0 {
            return Vec::new();
        }
        let each = (0..=(last - first).max(-1.0) as i64).map(|k| (first + k as f64) * step);
        each.filter(|_| last >= first).collect()
    }

    /// The text of a tick.
    pub(crate) fn tick(&self, place: f64, range: &Range<f64>) -> String {
        let span = range.end - range.start;
        if !self.names.is_empty() {
            let name = self.names.get((place.round() - 1.0).max(0.0) as usize);
            return name.filter(|_| place > 0.5).cloned().unwrap_or_default();
        }
        match self.scale {
            Scale::Linear => tidy(place, range),
            Scale::Logarithmic if (place - place.round()).abs() < 1e-6 => power(place.round()),
            Scale::Logarithmic if span < 1.0 => tidy(10f64.powf(place), &(0.0..10f64.powf(place))),
            Scale::Logarithmic => String::new(),
        }
    }
}

/// The round step (1, 2 or 5 by a power of ten) that is not less than some length.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|step| step * power >= least * (1.0 - 1e-9));
    step.unwrap_or(10.0) * power
}

/// A power of ten as people write it: plain where that is short.
fn power(exponent: f64) -> String {
    match exponent as i32 {
        0 => "1".into(),
        1 => "10".into(),
        2 => "100".into(),
        -1 => "0.1".into(),
        -2 => "0.01".into(),
        exponent => format!("1e{exponent}"),
    }
}

/// A value with no more decimals than its axis needs; very large and very small axes in powers of ten.
pub fn tidy(value: f64, range: &Range<f64>) -> String {
    let span = range.end - range.start;
    let most = range.start.abs().max(range.end.abs());
    if !(1e-4..1e6).contains(&most) && most > 0.0 {
        if value.abs() < 1e-9 * most {
            return "0".into();
        }
        let digits = (most.log10().floor() - span.log10().floor() + 1.0).clamp(0.0, 6.0) as usize;
        return format!("{value:.digits$e}");
    }
    let decimals = (1.0 - span.log10()).ceil().clamp(0.0, 8.0) as usize;
    let text = format!("{value:.decimals$}");
    // Rounding may leave "-0".
    match text.trim_start_matches(['-', '0', '.']) {
        "" => "0".into(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_the_decimals_their_axis_needs() {
        let axis = Axis::linear("");
        let check = |value, range: Range<f64>, text: &str| assert_eq!(axis.tick(value, &range), text);
        check(20.0, 0.0..400.0, "20");
        check(-0.5, -1.0..1.0, "-0.5");
        check(0.0125, 0.0..0.05, "0.013");
        check(-1e-9, -1.5..1.5, "0");
        check(2e-6, 0.0..4e-6, "2.0e-6");
    }

    #[test]
    fn a_logarithmic_axis_has_whole_powers() {
        let axis = Axis::logarithmic("");
        assert_eq!(axis.tick(-3.0, &(-4.0..0.0)), "1e-3");
        assert_eq!(axis.tick(-2.5, &(-4.0..0.0)), "");
        assert_eq!(axis.place(100.0), 2.0);
        assert!(axis.place(0.0).is_nan());
    }

    #[test]
    fn ticks_stand_at_round_values_powers_and_names() {
        assert_eq!(Axis::linear("").ticks(&(-0.3..4.2), 5), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(Axis::linear("").ticks(&(0.0..1e-3), 3), [0.0, 5e-4, 1e-3]);
        assert_eq!(Axis::logarithmic("").ticks(&(-2.5..1.2), 5), [-2.0, -1.0, 0.0, 1.0]);
        let named = Axis::named("", ["a1", "m1"].map(str::to_string));
        let range = named.range([].into_iter(), 0.0);
        let texts: Vec<String> = named
            .ticks(&range, 5)
            .iter()
            .map(|at| named.tick(*at, &range))
            .collect();
        assert_eq!(texts, ["a1", "m1"]);
        assert!(Axis::linear("").ticks(&(0.0..f64::NAN), 5).is_empty());
    }

    #[test]
    fn limits_win_unless_they_are_none() {
        let range = |axis: Axis| axis.range([1.0, 3.0].into_iter(), 0.0);
        assert_eq!(range(Axis::linear("")), 1.0..3.0);
        assert_eq!(range(Axis::linear("").between(0.0, 9.0)), 0.0..9.0);
        assert_eq!(range(Axis::linear("").between(9.0, 0.0)), 1.0..3.0);
        assert_eq!(range(Axis::linear("").between(f64::NAN, 1.0)), 1.0..3.0);
    }
}
