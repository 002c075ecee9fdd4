//! How far the probabilities of verdicts are to be believed: of the names given at each probability, how many were right.
//!
//! In: a folder of verdicts, one folder a case with verdict.json in it, and a folder with the answers `CASE.json`. Out, as
//! Markdown: each case with its answer and verdict, and a reliability table with its expected calibration error (Naeini,
//! Cooper and Hauskrecht 2015) and Brier score.

use std::{error::Error, fs, path::Path};

use serde_json::Value;

/// Lower ends of the bins of the table: verdicts name nothing below a half.
const BINS: [f64; 5] = [0.0, 0.5, 0.8, 0.95, 0.99];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [verdicts, answers] = arguments.as_slice() else {
        return Err("two folders: of the verdicts, and of the answers".into());
    };
    let mut folders: Vec<_> = fs::read_dir(verdicts)?
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .collect();
    folders.sort();
    println!("| case | ring | SNR | answer | verdict | none of these | shrink, % |\n|---|---|---|---|---|---|---|");
    let mut named: Vec<(f64, bool)> = Vec::new();
    for folder in folders {
        let case = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let read =
            |path: &Path| -> Result<Value, Box<dyn Error>> { Ok(serde_json::from_str(&fs::read_to_string(path)?)?) };
        let verdict = read(&folder.join("verdict.json"))?;
        let kept = read(&Path::new(answers).join(format!("{case}.json")))?;
        let answer = kept.get("answer").unwrap_or(&kept);
        let truth: Vec<&str> = list(&answer["effects"])
            .filter_map(|effect| effect["effect"].as_str())
            .collect();
        let causes: Vec<(&str, f64)> = list(&verdict["causes"])
            .filter_map(|cause| Some((cause["effect"].as_str()?, cause["probability"].as_f64()?)))
            .collect();
        named.extend(causes.iter().map(|(name, p)| (*p, truth.contains(name))));
        let said: Vec<String> = causes.iter().map(|(name, p)| format!("{name} {p:.3}")).collect();
        println!(
            "| {case} | {} | {:.0} | {} | {} | {:.3} | {:.1} |",
            answer["ring"].as_str().unwrap_or("?"),
            answer["snr_marginal"].as_f64().unwrap_or(f64::NAN),
            truth.join(", "),
            said.join(", "),
            verdict["none_of_these"].as_f64().unwrap_or(f64::NAN),
            verdict["shrink"]["percent"].as_f64().unwrap_or(f64::NAN),
        );
    }
    reliability(&named);
    Ok(())
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn reliability(named: &[(f64, bool)]) {
    println!("\n| said with probability | names | mean said | right |\n|---|---|---|---|");
    let mut error = 0.0;
    for (index, from) in BINS.iter().enumerate() {
        let to = BINS.get(index + 1).copied().unwrap_or(f64::INFINITY);
        let bin: Vec<_> = named.iter().filter(|(p, _)| (*from..to).contains(p)).collect();
        if bin.is_empty() {
            continue;
        }
        let count = bin.len() as f64;
        let said = bin.iter().map(|(p, _)| p).sum::<f64>() / count;
        let right = bin.iter().filter(|(_, is_right)| *is_right).count() as f64 / count;
        error += (said - right).abs() * count;
        println!(
            "| {from:.2} to {:.2} | {} | {said:.3} | {right:.3} |",
            to.min(1.0),
            bin.len()
        );
    }
    let count = named.len().max(1) as f64;
    let brier: f64 = named
        .iter()
        .map(|(p, is_right)| (p - f64::from(u8::from(*is_right))).powi(2))
        .sum();
    println!(
        "\n{} names; expected calibration error {:.3}, Brier score {:.3}",
        named.len(),
        error / count,
        brier / count
    );
}
