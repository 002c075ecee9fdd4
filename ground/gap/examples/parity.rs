//! What parity says of many cases, a line each: `cargo run --example parity -- FOLDER...`.
//!
//! In: folders of cases; a motion that is there is not looked at. Out: gap, names, and how long it took.

use std::{path::Path, time::Instant};

use gap::parity::{findings::Findings, flight::Flight};

fn main() {
    for folder in std::env::args().skip(1) {
        let began = Instant::now();
        let found = Flight::open(Path::new(&folder)).and_then(|flight| Findings::of(&flight, &[], &|_, _| ()));
        let seconds = began.elapsed().as_secs_f64();
        match found {
            Err(error) => println!("{folder}: {error}"),
            Ok(findings) => {
                let names = findings.names.iter().map(|name| {
                    let [usual, found] = name.snr.unwrap_or_default();
                    let gain = name.gain.unwrap_or_default();
                    let (effect, at, p) = (name.effect, &name.locality, name.probability);
                    format!(
                        "{effect} by {:?} at {at} p {p:.2} ({gain:.1} nats, ratio {found:.1}, usual {usual:.1})",
                        name.by
                    )
                });
                let others = findings.alternatives.iter().map(|(name, p)| format!("{name} {p:.2}"));
                println!(
                    "{folder}: {} gap {:.3} -> {:.3}; free {:.1?}; [{}] or [{}]; {seconds:.1} s",
                    findings.outcome.word(),
                    findings.gap[0],
                    findings.gap[1],
                    findings.free,
                    names.collect::<Vec<_>>().join("; "),
                    others.collect::<Vec<_>>().join(", "),
                );
                if std::env::var_os("TABLE").is_some() {
                    for row in &findings.visible {
                        println!(
                            "  {} {} {:.1} {:.1} {:.2}",
                            row.effect,
                            row.place,
                            row.with_reference,
                            row.snr,
                            row.share()
                        );
                    }
                }
            }
        }
    }
}
