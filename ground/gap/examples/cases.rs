//! Diagnoses the cases given, a few lines each, with the seconds each took, and leaves a verdict.json in the folder that
//! `VERDICTS` names, one folder a case: for looking at many at once. What `WITHHOLD` names is left out of the library, with
//! its siblings.
use std::{error::Error, fs, path::Path, time::Instant};

use gap::{diagnose::diagnose, input::case::Subject, report::verdict::Verdict};

fn main() -> Result<(), Box<dyn Error>> {
    let withheld = std::env::var("WITHHOLD").unwrap_or_default();
    let withheld = twin::effect::kin(&withheld).into_iter().map(str::to_owned);
    let withheld: Vec<String> = withheld.collect();
    for case in std::env::args().skip(1) {
        let t = Instant::now();
        let subject = match Subject::open(Path::new(&case)) {
            Ok(subject) => subject,
            Err(error) => {
                println!("{case}: {error}");
                continue;
            }
        };
        let d = diagnose(&subject, &withheld, &|_, _| {});
        if let Ok(folder) = std::env::var("VERDICTS") {
            let name = Path::new(&case).file_name().unwrap_or_default();
            let folder = Path::new(&folder).join(name);
            let verdict = Verdict::new(&subject, &d, String::new());
            let text = serde_json::to_string_pretty(&verdict).unwrap_or_default();
            let written = fs::create_dir_all(&folder).and_then(|()| fs::write(folder.join("verdict.json"), text));
            if let Err(error) = written {
                println!("{}: {error}", folder.display());
            }
        }
        println!(
            "== {case} {:.1?} gap {:.3} gate p {:.3} ({:.1}) none {:.3} left p {:.3} ({:.1}) shrink {:.4}/{:.4}/{:.4} floor {:.4} {:.1} % {:.0?} withdrawn {:?}",
            t.elapsed(),
            d.gap,
            d.gate.p,
            d.gate.log_tail,
            d.none_of_these,
            d.leftover.p,
            d.leftover.log_tail,
            d.shrink.before,
            d.shrink.recalibrated,
            d.shrink.after,
            d.shrink.floor,
            d.shrink.percent,
            d.shrink.interval_percent,
            d.withdrawn
        );
        let left = &d.remainder;
        println!(
            "   {}: {} {:.3?} {} sigma {:.2} deg {:.2?} present {:.3} (ln BF {:.1}) matters {:.3}",
            d.outcome.word(),
            left.what,
            left.size,
            left.unit,
            left.sigma[1],
            left.attitude_deg,
            left.present,
            left.log_bayes_factor,
            left.matters
        );
        for c in &d.causes {
            println!(
                "   {} at {} P {:.3} gain {:.0} share {:.2} {} {}",
                c.effect,
                c.locality,
                c.probability,
                c.gain,
                c.share,
                c.when,
                if c.is_suspicious { "SUSPICIOUS" } else { "" }
            );
        }
        println!(
            "   alternatives {:?} indistinguishable {:?}",
            d.alternatives.iter().take(4).collect::<Vec<_>>(),
            d.indistinguishable
        );
        for held in &d.promises {
            let strength = held.promise.map_or("not there".into(), |promise| {
                format!("{:.2} +- {:.2}", promise.factor, promise.sigma)
            });
            println!("   held out: {} {strength}", held.effect);
        }
        for a in d.leftover.aspects.iter().take(3) {
            println!("   left: {} {:.1}", a.what, a.size);
        }
    }
    Ok(())
}
