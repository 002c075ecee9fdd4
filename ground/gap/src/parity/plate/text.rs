//! The findings of one plate on a screen.

use std::fmt::Write;

use twin::{effect::by_name, predict::Kind};

use crate::{
    parity::smooth::told::rests_words,
    parity::{
        flight::Flight,
        nulls::NULLS,
        plate::{
            CAN_BE_NAMED, Findings,
            attitude::attitude,
            filter::At,
            magnets::Added,
            shaken::{Knock, Line},
        },
    },
    probability::outcome::Outcome,
    report::terminal::wrapped,
    thresholds::ADDED_NATS,
};

/// To a tenth, and nothing without a sign.
fn tenth(value: f64) -> f64 {
    (10.0 * value).round() / 10.0 + 0.0
}

/// All of it.
pub fn screen(flight: &Flight, findings: &Findings) -> String {
    let text = &flight.opened.text;
    let mut out = format!("{}  {}\n", text.name, text.about);
    let (count, step_s) = findings.samples;
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "PARITY  empty: one plate has as many sensors as a motion has unknowns. What follows rests on the whole log, {count} samples at \
         {:.0} Hz from {:.1} to {:.1} s; windows are not used: gyros carry the attitude, gravity and field hold it",
        1.0 / step_s,
        tenth(findings.span_s.0),
        tenth(findings.span_s.1)
    );
    let _ = writeln!(
        out,
        "SEEN    {}\nUNSEEN  never named from this log: any other effect. What all sensors of a kind share is another motion, and one plate's \
         share all: {}",
        CAN_BE_NAMED.join(", "),
        nulls().join("; ")
    );
    out += &flight.phases_line();
    if !findings.is_begun_at_rest {
        out += "BEGIN   the log does not begin at rest: its first attitude is a guess of 30 deg, and zeros of the gyros are found on the way\n";
    }
    out += &places(findings);
    out += &why(flight, findings);
    let _ = writeln!(out, "{}", attitude_line(findings));
    if flight.known.is_something() {
        out += "KNOWN   not used: a track, a simulated trajectory or an attitude at an instant holds the motion of a unit with parity only\n";
    }
    let _ = writeln!(out, "NEXT    {}", next(flight, findings));
    wrapped(&out)
}

fn nulls() -> Vec<&'static str> {
    NULLS
        .iter()
        .filter(|null| !null.settled_by.is_empty())
        .map(|null| null.what)
        .collect()
}

/// What was looked at, and how it stands.
pub fn places(findings: &Findings) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "KNOCKS  {}", knocks(&findings.knocks));
    let lines = findings.lines.iter().zip([Kind::Accelerometer, Kind::Gyro]);
    let told: Vec<String> = lines
        .filter_map(|(own, kind)| own.as_ref().map(|own| line(own, kind)))
        .collect();
    let _ = writeln!(
        out,
        "LINES   {}",
        if told.is_empty() {
            "the log is too short or too slow to show any".to_owned()
        } else {
            told.join("; ")
        }
    );
    let [plate, room] = findings.weighed.gains;
    match (findings.sensors.has_field(), findings.is_about_a_place()) {
        (false, _) => out += "FIELD   no magnetometers: the heading counts from the begin, and no magnet can be seen\n",
        (true, false) => {
            out += "FIELD   not judged: the velocity does not stay within what a unit has that stays about a place; the log of a flight needs its \
                    phases, a track or a reference\n";
        }
        (true, true) => {
            let _ = writeln!(
                out,
                "FIELD   off by {:.2} sigma with calibration and room alone, {:.2} along the best model; evidence over nothing: fixed to the plate \
                 {plate:+.0} nats, in the room {room:+.0}, named from {ADDED_NATS:.0} on",
                findings.gap[0], findings.gap[1]
            );
        }
    }
    out
}

/// Which effects, and what of each was seen.
pub fn why(flight: &Flight, findings: &Findings) -> String {
    let mut out = String::new();
    for name in findings.names(flight) {
        let _ = writeln!(
            out,
            "CAUSE   {} at {}: {}",
            name.effect,
            name.channels.join(" "),
            name.seen
        );
        if let Some(effect) = by_name(name.effect) {
            let page = effect.page();
            let _ = writeln!(out, "        {}\n        confirm: {}", page.physics, page.confirm_by);
        }
    }
    if !findings.untold().is_empty() {
        let _ = writeln!(
            out,
            "OR      {}: something magnetic is there, and this motion does not tell whether it turns with the plate",
            findings.untold().join(" or ")
        );
    }
    out += match findings.outcome(flight) {
        Outcome::Clean => {
            "NO EFFECT is needed for what one plate can show; what it cannot show is listed under UNSEEN\n"
        }
        Outcome::Named => "",
        Outcome::Undecided => "UNDECIDED  see OR\n",
        _ if findings.is_about_a_place() => {
            "LEFT    the field is off by more than any of these makes: a magnet that moves by itself, currents, a part that fails\n"
        }
        _ => "LEFT    the motion is not one about a place; only what is too quick for a body was looked for\n",
    };
    out
}

/// How many there are and the largest.
pub fn knocks(knocks: &[Knock]) -> String {
    match knocks.iter().max_by(|one, other| one.size.total_cmp(&other.size)) {
        None => "none".to_owned(),
        Some(largest) => format!(
            "{}, from {:.1} to {:.1} s, the largest at {:.1} s with a second difference of {:.0} m/s2",
            knocks.len(),
            knocks[0].t_s,
            knocks[knocks.len() - 1].t_s,
            largest.t_s,
            largest.size
        ),
    }
}

/// Where it is and how large.
pub fn line(line: &Line, kind: Kind) -> String {
    let (what, unit) = match kind {
        Kind::Gyro => ("gyros", "rad/s"),
        _ => ("accelerometers", "m/s2"),
    };
    format!(
        "{what} {:.1} Hz (as sampled), {:.2e} {unit}, {:.1} times the power beside it",
        line.hz, line.amplitude, line.over
    )
}

/// How large it is, and when.
pub fn added(added: Added, nodes: &[At]) -> String {
    let (of, frame): (fn(&At) -> nalgebra::Vector3<f64>, _) = match added {
        Added::ToPlate => (At::iron, "b"),
        Added::ToRoom => (At::beside, "north, east, down"),
    };
    let Some(largest) = nodes
        .iter()
        .max_by(|one, other| of(one).norm().total_cmp(&of(other).norm()))
    else {
        return String::new();
    };
    let most = of(largest);
    let mut beyond = nodes.iter().filter(|at| of(at).norm() > 0.5 * most.norm());
    let first_s = beyond.next().map_or(largest.t_s, |at| at.t_s);
    let last_s = beyond.next_back().map_or(first_s, |at| at.t_s);
    format!(
        "{:.1} uT at {:.0} s, in {frame} ({:.1}, {:.1}, {:.1}); more than half of that between {first_s:.0} and {last_s:.0} s",
        most.norm(),
        largest.t_s,
        most.x,
        most.y,
        most.z
    )
}

fn attitude_line(findings: &Findings) -> String {
    let told = attitude(findings);
    if told.attitudes.is_empty() {
        return "ATTITUDE  none is told: the velocity does not stay within what a unit has that stays about a place, so gravity does not hold \
                the attitude; no attitude.csv is written"
            .to_owned();
    }
    let norms = told.attitudes.iter().map(|own| own.sigmas_b_deg.norm());
    let mean = (norms.map(|norm| norm * norm).sum::<f64>() / told.attitudes.len() as f64).sqrt();
    let heading = if findings.sensors.has_field() {
        ""
    } else {
        ", heading from that of the begin"
    };
    format!(
        "ATTITUDE  smoothed over the whole log, in attitude.csv: known to {mean:.2} deg (one sigma, all axes{heading}); {}",
        rests_words(told.rests.len())
    )
}

/// What to do next.
pub fn next(flight: &Flight, findings: &Findings) -> String {
    let first = findings.names(flight).into_iter().next();
    match first.and_then(|name| by_name(name.effect)) {
        Some(effect) => format!("To be sure: {}", effect.page().confirm_by),
        None => format!(
            "What this log cannot show, a test on the ground would: {}.",
            NULLS[0].settled_by
        ),
    }
}

/// One sentence.
pub fn lead(flight: &Flight, findings: &Findings) -> String {
    let names = findings.names(flight);
    let named: Vec<&str> = names.iter().map(|name| name.effect).collect();
    let said = match (findings.outcome(flight), named.is_empty()) {
        (Outcome::Clean, _) => "Nothing that one plate can show is there".to_owned(),
        (_, false) => format!("Seen: {}", named.join(", and ")),
        (Outcome::Undecided, _) => {
            "Something magnetic is there; whether it turns with the plate, this motion does not tell".to_owned()
        }
        _ => "What one plate shows is not explained".to_owned(),
    };
    format!("{said}. One plate has no parity: what all its sensors share cannot be seen without a reference.")
}
