//! A unit behind a number.

/// With the space before it; nothing of a pure number, whose unit is written `1` in files.
pub fn behind(unit: &str) -> String {
    match unit {
        "1" => String::new(),
        unit => format!(" {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pure_number_has_none() {
        assert_eq!([behind("1"), behind("m/s2")], ["", " m/s2"]);
    }
}
