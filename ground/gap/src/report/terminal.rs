//! The verdict on one screen.

mod causes;
mod noise;
mod place;
mod shrink;
mod wrap;

use std::fmt::Write;

use statrs::distribution::{ChiSquared, ContinuousCDF};

pub use place::{places, when};
pub use shrink::shrink;
pub use wrap::wrapped;

use crate::{
    diagnose::Diagnosis,
    input::case::Subject,
    report::{gained::gained, unit::behind},
    thresholds::{CHANCE, MOST_OF_A_GAP, RARE},
};

/// Detection limits that are printed.
const LIMITS: usize = 4;

/// The whole screen.
pub fn screen(subject: &Subject, diagnosis: &Diagnosis, next_experiment: &str) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut text, subject, diagnosis, next_experiment);
    wrapped(&text)
}

/// How large each effect could be and not be seen.
pub fn limits(diagnosis: &Diagnosis) -> String {
    let mut text =
        String::from("a marginal signal-to-noise ratio of 5 on this log, at the place where it shows least\n");
    let (seen, unseen): (Vec<_>, Vec<_>) = diagnosis.limits.iter().partition(|limit| limit.size.is_finite());
    for limit in seen {
        let _ = writeln!(
            text,
            "{:30} {:10.3e} {:12} {} at {} ({:.2} of its usual size)",
            limit.effect, limit.size, limit.unit, limit.parameter, limit.locality, limit.priors
        );
    }
    if !unseen.is_empty() {
        let names: Vec<&str> = unseen.iter().map(|limit| limit.effect).collect();
        let _ = writeln!(
            text,
            "nothing on this log excites, somewhere at least: {}",
            names.join(", ")
        );
    }
    wrapped(&text)
}

/// Which effect, how sure, and what else it may be.
pub fn why(subject: &Subject, diagnosis: &Diagnosis) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = gross(&mut text, subject, diagnosis).and_then(|()| causes::write(&mut text, subject, diagnosis));
    for (effect, key) in &diagnosis.keys {
        let _ = writeln!(
            text,
            "        {effect} predicts blocks it was not fitted on by {:.1} +- {:.1} nats better",
            key.gain, key.error
        );
    }
    for promised in &diagnosis.promises {
        let strength = promised.promise.map_or("in none of".into(), |promise| {
            format!("{:.2} +- {:.2} times as strong on", promise.factor, promise.sigma)
        });
        let _ = writeln!(text, "        {} is {strength} the held-out windows", promised.effect);
    }
    text
}

/// What was put right in a table, and channels that no effect helps.
fn gross(text: &mut String, subject: &Subject, diagnosis: &Diagnosis) -> std::fmt::Result {
    let gross = &subject.gross;
    for one in &gross.contradicted {
        let reading = one
            .reading
            .map_or("left out: no exchange of axes or signs agrees".to_owned(), |reading| {
                format!("read as {}", reading.words())
            });
        writeln!(text, "COMMAND {} contradicts the data; {reading}", one.seq)?;
    }
    for rows in &gross.otherwise {
        let rows: Vec<String> = rows.iter().map(f64::to_string).collect();
        writeln!(
            text,
            "        or, as well supported, these are wrong: {}",
            rows.join(", ")
        )?;
    }
    if !gross.wiring.is_empty() {
        writeln!(text, "WIRING  {}", gross.wiring)?;
        let inverted = subject.names(gross.inverted.iter().copied());
        writeln!(
            text,
            "        {} other readings fit as well; inverted in all of the simplest: {}",
            gross.as_good,
            inverted.join(" ")
        )?;
    }
    for (channel, repeat) in unexplained(subject, diagnosis) {
        let name = &subject.twin.unit().channels[channel].name;
        writeln!(
            text,
            "LEFT    {name}: scale drift or none of these; held out {:.1} sigma, repeats of a command differ by {:.2} %",
            diagnosis.shrink.channels[channel].after,
            100.0 * repeat
        )?;
    }
    Ok(())
}

/// Channels of a table whose held-out gap remains and that no cause helps beyond recalibration, with the change between
/// repeats.
fn unexplained(subject: &Subject, diagnosis: &Diagnosis) -> Vec<(usize, f64)> {
    let channels = diagnosis.shrink.channels.len() as f64;
    let is_left = |channel: usize| {
        let own = &diagnosis.shrink.channels[channel];
        by_noise(own.samples, own.after) * channels < RARE && own.after > MOST_OF_A_GAP * own.recalibrated
    };
    let repeats = subject.gross.repeats.iter().filter(|repeat| is_left(repeat.channel));
    repeats.map(|repeat| (repeat.channel, repeat.change)).collect()
}

/// Probability that noise alone leaves such a gap \[sigma\], or a larger one, of so many samples: their squares have a chi-square law.
fn by_noise(samples: usize, gap: f64) -> f64 {
    let samples = samples as f64;
    ChiSquared::new(samples).map_or(1.0, |law| law.sf(samples * gap * gap))
}

fn write(text: &mut String, subject: &Subject, diagnosis: &Diagnosis, next_experiment: &str) -> std::fmt::Result {
    writeln!(text, "{}  {}", subject.opened.text.name, subject.opened.text.about)?;
    writeln!(
        text,
        "GAP     {:.3} sigma where 1 is perfect; calibration and noise alone: p {:.3}{}",
        diagnosis.gap,
        diagnosis.gate.p,
        if diagnosis.gate.p > CHANCE && !diagnosis.causes.is_empty() {
            ", on the whole; what is named below stands out on its own"
        } else {
            ""
        }
    )?;
    let (missing, clipped) = subject
        .masked
        .iter()
        .fold((0, 0), |sum, one| (sum.0 + one.missing, sum.1 + one.clipped));
    let stream = subject.stream;
    let rows = match subject.thinned {
        1 => "every row".to_owned(),
        thinned => format!("one row in {thinned}"),
    };
    writeln!(
        text,
        "DATA    lost packets {}, repeated {}, not packets {}; samples missing {missing}, clipped {clipped}, unseen by the reference {}; {rows} used",
        stream.lost, stream.repeated, stream.rejected, subject.unseen
    )?;
    noise::lines(text, &diagnosis.noise)?;
    place::line(text, diagnosis)?;
    gross(text, subject, diagnosis)?;
    causes::write(text, subject, diagnosis)?;
    if !causes::is_clean(diagnosis) {
        held_out(text, subject, diagnosis)?;
    }
    if diagnosis.causes.is_empty() {
        let weakest: Vec<String> = diagnosis
            .limits
            .iter()
            .rev()
            .take(LIMITS)
            .map(|limit| format!("{} {:.2e}{}", limit.effect, limit.size, behind(limit.unit)))
            .collect();
        writeln!(
            text,
            "LIMITS  would be seen from: {}; all with `limits`",
            weakest.join(", ")
        )?;
        let hidden = diagnosis.limits.iter().filter(|limit| limit.priors > 1.0).count();
        if hidden > 0 {
            writeln!(
                text,
                "        too weak to decide on {hidden} of {} effects: at their usual size they would not show",
                diagnosis.limits.len()
            )?;
        }
    }
    writeln!(text, "NEXT    {next_experiment}")
}

/// The held-out gap in three lines: channels, attitude, what got worse.
fn held_out(text: &mut String, subject: &Subject, diagnosis: &Diagnosis) -> std::fmt::Result {
    let shrink = &diagnosis.shrink;
    writeln!(
        text,
        "SHRINK  held out: {:.3} -> {:.3} sigma (recalibrated {:.3}, floor {:.3}); {}",
        shrink.before,
        shrink.after,
        shrink.recalibrated,
        shrink.floor,
        gained(
            [shrink.before, shrink.after],
            shrink.percent,
            shrink.interval_percent,
            diagnosis.ceiling_percent
        )
    )?;
    if shrink.after < shrink.floor {
        writeln!(
            text,
            "        below the floor: the log is quieter than its description says, or the effect takes up some of its noise"
        )?;
    }
    for stage in diagnosis.stages.iter().filter(|stage| stage.unit == "deg") {
        let corrected = stage
            .corrected
            .map_or(String::new(), |error| format!("; by the calibration set {error:.3}"));
        // A reader looks for the gain first; where there is none, the filter's other errors are larger than the effect's.
        let gains = if stage.after < stage.before { "" } else { "; no gain" };
        writeln!(
            text,
            "        {}: {:.3} -> {:.3} deg (floor {:.3}){gains}{corrected}",
            stage.name, stage.before, stage.after, stage.floor
        )?;
    }
    let units = &subject.twin.unit().channels;
    let worse: Vec<&str> = units
        .iter()
        .zip(&shrink.channels)
        .filter(|(_, own)| own.is_worse())
        .map(|(channel, _)| channel.name.as_str())
        .collect();
    if !worse.is_empty() {
        writeln!(text, "        worse: {}", worse.join(" "))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chi-square tables: of eight degrees of freedom 15.51 is exceeded with 0.05, and 26.12 with 0.001.
    #[test]
    fn a_gap_is_noise_as_often_as_the_table_of_its_samples_says() {
        for (energy, probability) in [(15.51, 0.05), (26.12, 1e-3)] {
            assert!((by_noise(8, f64::sqrt(energy / 8.0)) / probability - 1.0).abs() < 0.01);
        }
        assert!((by_noise(0, 9.0) - 1.0).abs() < f64::EPSILON, "no samples show nothing");
    }
}
