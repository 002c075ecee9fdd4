//! A share of a deal's cases, for one of many machines.
//!
//! In: `K/N` and a sorted list. Out: every `N`th from the `K`th on. Every part knows its cases from the list alone, so that parts need
//! nothing but the file system: a verdict stands beside its case, and a part leaves the hashes of its own under a name of its own.

use std::str::FromStr;

/// Part `number` of `of`, counted from one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    number: usize,
    of: usize,
}

/// The only part there is.
impl Default for Part {
    fn default() -> Self {
        Part { number: 1, of: 1 }
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Part { number, of }),
            _ => Err(format!("{text}: write it like 3/16, from 1/16 to 16/16")),
        }
    }
}

impl Part {
    /// Its share of a list.
    pub fn of_list<T>(self, list: Vec<T>) -> Vec<T> {
        list.into_iter().skip(self.number - 1).step_by(self.of).collect()
    }

    /// The file with the hashes of its verdicts.
    pub fn answered(self) -> String {
        match self.of {
            1 => "answered.json".to_owned(),
            of => format!("answered-{}-of-{of}.json", self.number),
        }
    }

    /// Of such a file's name, all the names that belong to it.
    pub fn siblings(name: &str) -> Option<Vec<String>> {
        if name == Part::default().answered() {
            return Some(vec![name.to_owned()]);
        }
        let numbers = name.strip_prefix("answered-")?.strip_suffix(".json")?;
        let of = numbers.split_once("-of-")?.1.parse().ok()?;
        Some((1..=of).map(|number| Part { number, of }.answered()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_a_list_and_leave_nothing_out() {
        let parts = |of: usize| (1..=of).map(move |number| format!("{number}/{of}").parse::<Part>().expect("a part"));
        for of in [1, 3, 7, 40] {
            let mut all: Vec<usize> = parts(of).flat_map(|part| part.of_list((0..23).collect())).collect();
            all.sort_unstable();
            assert_eq!(all, (0..23).collect::<Vec<_>>());
            let names: Vec<String> = parts(of).map(Part::answered).collect();
            assert_eq!(Part::siblings(&names[0]), Some(names));
        }
    }

    #[test]
    fn what_is_no_part_is_refused() {
        for text in ["", "3", "0/4", "5/4", "a/b", "1/0"] {
            assert!(text.parse::<Part>().is_err(), "{text}");
        }
    }
}
