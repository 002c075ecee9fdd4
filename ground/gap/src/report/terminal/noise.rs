//! The noise of each kind of sensor, declared against seen.

use std::fmt::Write;

use crate::null::noise::Noise;

/// Writes a line for each kind that is not as declared, one for those that are, and one for those of which it cannot be told.
pub fn lines(text: &mut String, noise: &[Noise]) -> std::fmt::Result {
    let (other, usual): (Vec<&Noise>, Vec<&Noise>) = noise.iter().partition(|own| !own.words().is_empty());
    let (hidden, as_declared): (Vec<&Noise>, Vec<&Noise>) = usual.iter().partition(|own| own.is_at_most());
    let mut lines: Vec<String> = other.into_iter().map(line).collect();
    for (said, kinds) in [
        ("as declared", as_declared),
        ("beneath the errors of the reference", hidden),
    ] {
        let kinds: Vec<&str> = kinds.into_iter().map(|own| own.kind.plural()).collect();
        if !kinds.is_empty() {
            lines.push(format!("{said}: {}", kinds.join(", ")));
        }
    }
    for (at, line) in lines.iter().enumerate() {
        writeln!(text, "{:7} {line}", if at == 0 { "NOISE" } else { "" })?;
    }
    Ok(())
}

/// What is not as declared of one kind.
fn line(noise: &Noise) -> String {
    let words = noise.words().into_iter().map(|word| match word {
        "coloured" => format!("coloured, neighbours correlate by {:+.2}", noise.colour),
        "repeated" => format!("{:.1} % of the samples sent twice", 100.0 * noise.repeated),
        _ => word.to_owned(),
    });
    let words: Vec<String> = words.collect();
    format!(
        "{}: {:.2e} {unit} declared, {}{:.2e} seen ({:.2} to {:.2} times): {}",
        noise.kind.plural(),
        noise.declared,
        if noise.is_at_most() { "at most " } else { "" },
        noise.seen,
        noise.range[0],
        noise.range[1],
        words.join("; "),
        unit = noise.kind.unit(),
    )
}
