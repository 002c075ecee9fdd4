//! The key that was meant, where a TOML file has one that there is not.
//!
//! In: the parser's complaint, which names the unknown key and those it expected. Out: the same complaint with the expected key
//! that is nearest (Jaro and Winkler's similarity, at least 0.8), or as it was.

/// Similarity from which a word is taken for a misspelling.
const MISSPELT: f64 = 0.8;

/// The complaint, with what was meant.
pub fn meant(complaint: &str) -> String {
    nearest(complaint).map_or_else(|| complaint.to_owned(), |key| format!("{complaint}; is {key} meant?"))
}

fn nearest(complaint: &str) -> Option<&str> {
    let (_, after) = complaint.split_once("unknown field `")?;
    let (unknown, expected) = after.split_once('`')?;
    // Every other piece between backticks is a key.
    let known = expected.split('`').skip(1).step_by(2);
    let near = known.map(|key| (strsim::jaro_winkler(unknown, key), key));
    near.filter(|(near, _)| *near >= MISSPELT)
        .max_by(|one, other| one.0.total_cmp(&other.0))
        .map(|(_, key)| key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_key_is_told_with_the_nearest_and_a_strange_one_as_it_is() {
        let complaint = "unknown field `noise_sigmas`, expected one of `bias_sigma`, `noise_sigma`, `lsb`";
        assert!(meant(complaint).ends_with("`lsb`; is noise_sigma meant?"));
        let strange = "unknown field `colour`, expected `bias` or `lsb`";
        assert_eq!(meant(strange), strange);
        assert_eq!(meant("missing field `name`"), "missing field `name`");
    }
}
