//! How far verdicts are to be believed: every case with its answer, the figures by ring and size, and of the names given at
//! each probability, how many were right.
//!
//! In: pairs of folders, one of verdicts (one folder a case with verdict.json in it) and one with the answers `CASE.json`.
//! Out, as Markdown: a line a case, the figures of [`trials::score`] with their intervals, and a reliability table with its
//! expected calibration error (Naeini, Cooper and Hauskrecht 2015) and Brier score over every name of every ring.

use std::{error::Error, fs, path::Path};

use trials::{
    answer::{Answer, Cause},
    interval::clopper_pearson,
    score::{Judged, Verdict, markdown, table},
};

use serde_json::Value;

/// Lower ends of the bins of the table: verdicts name nothing below a half.
const BINS: [f64; 5] = [0.0, 0.5, 0.8, 0.95, 0.99];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (pairs, []) = arguments.as_chunks::<2>() else {
        return Err("pairs of folders: of the verdicts, and of the answers".into());
    };
    println!("| case | ring | SNR | answer | verdict | none of these | shrink, % |\n|---|---|---|---|---|---|---|");
    let mut judged: Vec<Judged> = Vec::new();
    for [verdicts, answers] in pairs {
        let mut folders: Vec<_> = fs::read_dir(verdicts)?
            .filter_map(Result::ok)
            .map(|entry| entry.path())
            .collect();
        folders.sort();
        for folder in folders {
            let case = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let answer = answer(&Path::new(answers).join(format!("{case}.json")))?;
            let verdict: Verdict = serde_json::from_str(&fs::read_to_string(folder.join("verdict.json"))?)?;
            println!("{}", line(&answer, &verdict));
            judged.push(Judged {
                answer,
                verdict: Some(verdict),
                channels: None,
            });
        }
    }
    println!("\n{}", markdown(&[("diagnosis".into(), table(&judged))]));
    reliability(&judged);
    Ok(())
}

/// An answer as dealt here, or as others keep it; null is not a number.
fn answer(file: &Path) -> Result<Answer, Box<dyn Error>> {
    let kept: Value = serde_json::from_str(&fs::read_to_string(file)?)?;
    let answer = kept.get("answer").unwrap_or(&kept);
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let cause = |effect: &Value| Cause {
        snr_withheld: None,
        effect: text(&effect["effect"]),
        in_library: effect["in_library"].as_bool().unwrap_or(true),
        channels: list(&effect["channels"]).iter().map(text).collect(),
        strength: effect["strength"].as_f64().unwrap_or(f64::NAN),
        snr_marginal: effect["snr_marginal"].as_f64(),
        sizes: Vec::new(),
        attitude_deg: None,
        gap_growth: None,
    };
    Ok(Answer {
        case: text(&answer["case"]),
        attitudes: Vec::new(),
        ring: text(&answer["ring"]),
        seed: answer["seed"].as_u64().unwrap_or_default(),
        effects: list(&answer["effects"]).iter().map(cause).collect(),
        snr_marginal: answer["snr_marginal"].as_f64().unwrap_or(f64::NAN),
        source: None,
    })
}

fn line(answer: &Answer, verdict: &Verdict) -> String {
    let truth: Vec<&str> = answer.effects.iter().map(|cause| cause.effect.as_str()).collect();
    let said: Vec<String> = verdict
        .causes
        .iter()
        .map(|cause| format!("{} {:.3}", cause.effect, cause.probability))
        .collect();
    let percent = verdict.shrink.as_ref().and_then(|shrink| shrink.percent);
    format!(
        "| {} | {} | {:.0} | {} | {} | {:.3} | {:.1} |",
        answer.case,
        answer.ring,
        answer.snr_marginal,
        truth.join(", "),
        said.join(", "),
        verdict.none_of_these,
        percent.unwrap_or(f64::NAN),
    )
}

fn reliability(judged: &[Judged]) {
    let mut named: Vec<(f64, bool)> = Vec::new();
    for judged in judged {
        let is_right = |name: &str| judged.answer.effects.iter().any(|cause| cause.effect == name);
        let causes = judged.verdict.iter().flat_map(|verdict| &verdict.causes);
        named.extend(causes.map(|cause| (cause.probability, is_right(&cause.effect))));
    }
    println!("| said with probability | names | mean said | right | 95 % interval |\n|---|---|---|---|---|");
    let mut error = 0.0;
    for (index, from) in BINS.iter().enumerate() {
        let to = BINS.get(index + 1).copied().unwrap_or(f64::INFINITY);
        let bin: Vec<_> = named.iter().filter(|(p, _)| (*from..to).contains(p)).collect();
        if bin.is_empty() {
            continue;
        }
        let count = bin.len() as f64;
        let said = bin.iter().map(|(p, _)| p).sum::<f64>() / count;
        let hits = bin.iter().filter(|(_, is_right)| *is_right).count();
        let right = hits as f64 / count;
        let (least, most) = clopper_pearson(hits, bin.len());
        error += (said - right).abs() * count;
        println!(
            "| {from:.2} to {:.2} | {} | {said:.3} | {right:.3} | {least:.3} to {most:.3} |",
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
