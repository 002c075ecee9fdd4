//! What of verdict.json is scored, and how it is read.
//!
//! In: the file. Out: the names it says, the set it declares, the probability it gives a name. Unknown fields are passed
//! over, so any tool that writes the keys below can be scored.

use std::collections::BTreeMap;

use serde::Deserialize;

/// What of verdict.json is scored; unknown fields are passed over.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Verdict {
    /// How large it is.
    pub gap: Gap,
    /// Causes, the likeliest first; none when the twin needs nothing or nothing is named.
    pub causes: Vec<Named>,
    /// Other names with their probability.
    pub alternatives: Vec<Named>,
    /// Sets that this motion cannot tell apart.
    pub indistinguishable: Vec<Vec<String>>,
    /// Probability that something outside the library is needed.
    pub none_of_these: f64,
    /// What became of the gap on the hold window.
    pub shrink: Option<Shrink>,
    /// In a word: `clean`, `recalibrate`, `named`, `partly-named`, `undecided`, `unknown`.
    pub outcome: Option<String>,
    /// What is left beneath what is named.
    pub remainder: Option<Remainder>,
    /// What it says it can see, of a case whose motion is withheld.
    pub visible: Vec<Visible>,
    /// What became of the motion there.
    pub attitude: Option<Attitude>,
}

/// What a log shows of an effect of usual size.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Visible {
    /// The effect.
    pub effect: String,
    /// `one` of its kind, `each`, what is `common` to all, the `unit`.
    pub place: String,
    /// Ratio with the motion known.
    pub with_reference: f64,
    /// Ratio in each packet by itself.
    pub by_parity: f64,
}

/// A motion that was sought.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Attitude {
    /// Whether it says that it was found.
    pub is_settled: bool,
    /// \[deg\] one sigma, all axes.
    pub sigma_deg: Option<f64>,
    /// \[deg\] how far off it is, root mean square; none where nothing was held against it. What a verdict says of it counts for nothing.
    pub error_deg: Option<f64>,
}

/// What is left beneath what is named.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Remainder {
    /// Probability that it is there.
    pub present: f64,
    /// Probability that it is there and larger than what the case cares about.
    pub matters: f64,
    /// Where.
    pub channels: Vec<String>,
    /// How large, in sigma of a sample of those.
    pub sigma: Within,
    /// \[deg\] how large, as attitude.
    pub attitude_deg: Option<Within>,
}

/// A size with its interval.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Within {
    /// The middle.
    pub value: f64,
    /// 5 % and 95 %.
    pub interval_90: [f64; 2],
}

/// The gap in sigma.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default)]
pub struct Gap {
    /// What a perfect twin would leave.
    pub floor: f64,
}

impl Default for Gap {
    fn default() -> Self {
        Gap { floor: 1.0 }
    }
}

/// A name with its probability.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Named {
    /// The effect.
    pub effect: String,
    /// Where.
    pub channels: Vec<String>,
    /// How sure.
    pub probability: f64,
    /// How large, by name.
    pub parameters: BTreeMap<String, Stated>,
}

/// A size as stated.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Stated {
    /// In its unit.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// Shrinkage on the hold window.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Shrink {
    /// Before, in sigma.
    pub hold_before: Option<f64>,
    /// After.
    pub hold_after: Option<f64>,
    /// Of the gap above its floor.
    pub percent: Option<f64>,
}

/// Names are said from this probability on.
const SAID_FROM: f64 = 0.5;

/// Alternatives from this probability on belong to the declared set, which holds at most [`LARGEST_SET`] names.
const IN_SET: f64 = 0.05;
pub(super) const LARGEST_SET: usize = 3;

impl Verdict {
    pub(super) fn said(&self) -> impl Iterator<Item = &Named> {
        self.causes.iter().filter(|cause| cause.probability >= SAID_FROM)
    }

    pub(super) fn is_unknown(&self) -> bool {
        self.none_of_these >= SAID_FROM
    }

    pub(super) fn declared(&self) -> Vec<&str> {
        let mut set: Vec<&str> = self.causes.iter().take(1).map(|cause| cause.effect.as_str()).collect();
        for group in &self.indistinguishable {
            if set.first().is_some_and(|first| group.iter().any(|name| name == first)) {
                set.extend(group.iter().map(String::as_str));
            }
        }
        set.extend(
            self.alternatives
                .iter()
                .filter(|named| named.probability >= IN_SET)
                .map(|named| named.effect.as_str()),
        );
        let mut distinct: Vec<&str> = Vec::new();
        for name in set {
            if !distinct.contains(&name) {
                distinct.push(name);
            }
        }
        distinct
    }

    /// The likeliest names that together have this probability, "none of these" among them as `None`.
    pub(super) fn credible(&self, probability: f64) -> Vec<Option<&str>> {
        let named = self.causes.iter().chain(&self.alternatives);
        let mut ranked: Vec<(Option<&str>, f64)> = named
            .map(|named| (Some(named.effect.as_str()), named.probability))
            .chain([(None, self.none_of_these)])
            .collect();
        ranked.sort_by(|one, other| other.1.total_cmp(&one.1));
        let mut before = 0.0;
        let needed = ranked.into_iter().take_while(|(_, own)| {
            let is_needed = before < probability;
            before += own;
            is_needed
        });
        needed.map(|(name, _)| name).collect()
    }

    pub(super) fn probability_of(&self, name: &str) -> f64 {
        let all = self.causes.iter().chain(&self.alternatives);
        all.filter(|named| named.effect == name)
            .map(|named| named.probability)
            .fold(0.0, f64::max)
    }
}
