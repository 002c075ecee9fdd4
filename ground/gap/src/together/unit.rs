//! Whether cases are of one unit, as it is described.
//!
//! In: cases. Out: nothing, or the first field in which two descriptions differ, with the files. Descriptions are compared value by value as
//! they are read, so that comments, order and defaults that are written out make no difference. `slot_s` may differ: it says how a
//! log was read.

use std::path::{Path, PathBuf};

use toml::Value;
use twin::predict::UnitDescription;

use crate::input::case::{CaseError, Kind, Opened};

/// Field that is the log's and not the unit's.
const OF_LOG: &str = "slot_s";

/// Checks that all are of the unit of the first.
///
/// # Errors
/// When a case cannot be read, is a table, or is of another unit.
pub fn check(cases: &[PathBuf]) -> Result<(), CaseError> {
    let mut first: Option<(PathBuf, Value)> = None;
    for case in cases {
        let (file, own) = described(case)?;
        let Some((known_file, known)) = &first else {
            first = Some((file, own));
            continue;
        };
        if let Some((field, [is, other])) = difference(&own, known, &[]) {
            let problem = format!(
                "is {is}, and {other} in {}: logs that are diagnosed together are of one unit as it is described; give those of another \
                 unit by themselves, or the same description to both",
                known_file.display()
            );
            return Err(CaseError::key(&file, field, problem));
        }
    }
    Ok(())
}

/// The file that describes a case's unit, and what it says.
fn described(case: &Path) -> Result<(PathBuf, Value), CaseError> {
    let opened = Opened::open(case)?;
    if opened.text.kind == Kind::Table {
        let problem = "is \"table\"; only logs are diagnosed together: ground gap CASE";
        return Err(CaseError::key(&opened.file, "kind", problem));
    }
    let file = opened.path(&opened.text.unit);
    let text = UnitDescription::open(&file)?.text();
    let value = text.parse::<toml::Table>().map_err(|error| {
        let problem = format!("cannot be compared with that of another log: {}", error.message());
        CaseError::key(&file, "unit", problem)
    })?;
    Ok((file, Value::Table(value)))
}

/// The first field in which two differ, and what it is in each.
fn difference(one: &Value, other: &Value, path: &[String]) -> Option<(String, [String; 2])> {
    let told = |value: Option<&Value>| value.map_or_else(|| "absent".to_owned(), Value::to_string);
    let below = |name: String| [path, &[name]].concat();
    match (one, other) {
        (Value::Table(own), Value::Table(others)) => {
            let names = own.keys().chain(others.keys().filter(|name| !own.contains_key(*name)));
            let mut names = names.filter(|name| *name != OF_LOG);
            names.find_map(|name| match (own.get(name), others.get(name)) {
                (Some(own), Some(other)) => difference(own, other, &below(name.clone())),
                (own, other) => Some((below(name.clone()).join("."), [told(own), told(other)])),
            })
        }
        (Value::Array(own), Value::Array(others)) if own.iter().all(Value::is_table) && own.len() == others.len() => {
            let named =
                |(at, value): (usize, &Value)| value.get("name").map_or(at.to_string(), |name| name.to_string());
            let mut pairs = own.iter().zip(others).enumerate();
            pairs.find_map(|(at, (own, other))| difference(own, other, &below(named((at, own)))))
        }
        (Value::Array(own), Value::Array(others)) if own.iter().all(Value::is_table) => {
            let counts = [own, others].map(|all| format!("{} entries", all.len()));
            Some((path.join("."), counts))
        }
        _ => (one != other).then(|| (path.join("."), [told(Some(one)), told(Some(other))])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Value {
        Value::Table(text.parse().expect("toml"))
    }

    #[test]
    fn a_field_that_differs_is_named_with_its_channel_and_a_slot_may_differ() {
        let unit = "name = \"u\"\n[[channel]]\nname = \"g1\"\nscale = 1.0\nslot_s = 0.01\n";
        let other = unit.replace("1.0", "1.002");
        let (field, values) = difference(&value(&other), &value(unit), &[]).expect("a difference");
        assert_eq!(field, "channel.\"g1\".scale");
        assert_eq!(values, ["1.002", "1.0"]);
        let slot = unit.replace("0.01", "0.02");
        assert_eq!(difference(&value(&slot), &value(unit), &[]), None);
        let more = format!("{unit}bits = 12\n");
        let (field, values) = difference(&value(unit), &value(&more), &[]).expect("a difference");
        assert_eq!((field.as_str(), values[0].as_str()), ("channel.\"g1\".bits", "absent"));
    }
}
