//! The findings on a screen.
//!
//! In: [`Findings`]. Out: text. What can be seen stands before what was found, so that a silence is read as what it is.

use std::fmt::Write;

use crate::{
    input::windows::Span,
    parity::{
        chips,
        findings::{Findings, Place},
        flight::Flight,
        name::{By, Name},
        nulls::{self, NULLS},
        smooth::told::Told,
        visible::Row,
    },
    probability::outcome::Outcome,
    report::{terminal::wrapped, unit::behind},
    thresholds::PARITY_SNR,
};

/// Channels that are said to stand out.
const SHOWN: usize = 6;

/// All of it.
pub fn screen(flight: &Flight, findings: &Findings, told: &Told) -> String {
    let text = &flight.opened.text;
    let mut out = format!("{}  {}\n", text.name, text.about);
    // Writing to a string cannot fail.
    let [gyros, accelerometers, magnetometers, thermometers] = findings.free;
    let thinned = if flight.thinned > 1 {
        format!(", one of {} kept", flight.thinned)
    } else {
        String::new()
    };
    let _ = writeln!(
        out,
        "PARITY  no reference: only what the sensors say against each other, {} packets of the fit windows{thinned}; \
         degrees of freedom a packet: gyros {gyros:.1}, accelerometers {accelerometers:.1}, magnetometers {magnetometers:.1}, \
         thermometers {thermometers:.1}",
        findings.rows
    );
    out += &parted(flight);
    out += &unturned(flight);
    out += &made_without(flight, findings);
    out += &flight.phases_line();
    out += &seen_and_not(findings);
    out += &lost_packets(findings);
    let _ = writeln!(
        out,
        "GAP     {:.3} sigma where 1 is noise and calibration alone",
        findings.gap[0]
    );
    out += &chips::text::lines(&findings.chips);
    out += &places(findings);
    out += &why(flight, findings);
    let _ = writeln!(out, "{}", told.line());
    out += &told.known_lines(&flight.known);
    let _ = writeln!(out, "NEXT    {}", next(findings).trim_end());
    wrapped(&out)
}

/// The part that would bend the motion, in a line.
fn made_without(flight: &Flight, findings: &Findings) -> String {
    match flight.names(&findings.bending).join(" ") {
        names if names.is_empty() => String::new(),
        names => format!(
            "WITHOUT  {names}: with them no motion fits all sensors, and without them all others agree; the motion is made of the others, \
             and these are judged about it\n"
        ),
    }
}

/// Packets that were left out because nobody knows how fast the unit turned, in a line.
fn unturned(flight: &Flight) -> String {
    match flight.unturned {
        0 => String::new(),
        rows => format!(
            "LEFT OUT  {rows} packets of the fit windows in or beside which gyros stand at their stops: nobody knows how fast the unit \
             turned, and nothing is linear about a guess\n"
        ),
    }
}

/// How the log was parted where its file does not say it, or says it in pieces, in a line.
fn parted(flight: &Flight) -> String {
    let Some(windows) = &flight.windows else {
        return String::new();
    };
    let why = match flight.opened.text.windows {
        None => "none in case.toml",
        Some(_) => "those of case.toml are in pieces, and no motion is smoothed across what lies between",
    };
    if windows.hold().is_empty() {
        return format!("WINDOWS {why}; the log is too short to be parted: nothing judges what is named\n");
    }
    let spans = |spans: &[Span]| {
        let spans: Vec<String> = (spans.iter())
            .map(|span| format!("{:.1} to {:.1}", span.from, span.to))
            .collect();
        spans.join(", ")
    };
    format!(
        "WINDOWS {why}; parted in the middle: fitted {} s, held out {} s\n",
        spans(windows.fit()),
        spans(windows.hold())
    )
}

/// Which effects can be named from this log and which cannot, in two lines.
fn seen_and_not(findings: &Findings) -> String {
    let (seen, unseen) = effects(&findings.visible);
    format!(
        "SEEN    of usual size, by parity or about the smoothed motion: {}\nUNSEEN  never named from this log: {}\n",
        seen.join(", "),
        unseen.join(", ")
    )
}

/// How often packets that nobody counted would be found, in a line.
fn lost_packets(findings: &Findings) -> String {
    match findings.loss_shown {
        None => String::new(),
        Some(share) => format!(
            "COUNT   one packet that is lost and not counted would be found after {:.0} % of the packets, by how far field and force turn \
             to the next\n",
            100.0 * share
        ),
    }
}

/// Effects that can be named somewhere, and those that cannot anywhere.
pub fn effects(rows: &[Row]) -> (Vec<&'static str>, Vec<&'static str>) {
    let mut names: Vec<&'static str> = rows.iter().map(|row| row.effect).collect();
    names.dedup();
    names
        .into_iter()
        .partition(|name| rows.iter().any(|row| row.effect == *name && row.is_visible))
}

/// Where the gap is.
pub fn places(findings: &Findings) -> String {
    let mut channels: Vec<&Place> = findings.channels.iter().filter(|own| own.stands_out).collect();
    channels.sort_by(|one, other| other.gap.total_cmp(&one.gap));
    let told: Vec<String> = channels
        .iter()
        .take(SHOWN)
        .map(|own| format!("{} {:.2}", own.name, own.gap))
        .collect();
    match told.is_empty() {
        true => "WHERE   no channel stands out\n".to_owned(),
        false => format!("WHERE   sigma of what the others do not explain: {}\n", told.join(", ")),
    }
}

/// Which effects, and how sure.
pub fn why(flight: &Flight, findings: &Findings) -> String {
    let mut out = String::new();
    for name in &findings.names {
        let _ = writeln!(
            out,
            "CAUSE   {} at {}, probability {:.3}{}",
            name.effect,
            match name.losses.is_empty() {
                true => flight.names(&name.channels).join(" "),
                false => "all channels".to_owned(),
            },
            name.probability,
            evidence(name)
        );
        let _ = writeln!(out, "        {}", name.physics);
        for sized in &name.parameters {
            let parameter = &sized.parameter;
            let _ = writeln!(
                out,
                "        {} {:.4e} +- {:.1e}{}",
                parameter.name,
                sized.value,
                sized.sigma,
                behind(parameter.unit)
            );
        }
        if !name.or_at.is_empty() {
            let _ = writeln!(out, "        or, as likely from this log, at {}", name.or_at.join(", "));
        }
        if let Some(alone) = &name.alone {
            let _ = writeln!(out, "        {}", alone.told());
        }
        if let Some(which) = &name.which {
            let _ = writeln!(out, "        which: {which}");
        }
        let _ = writeln!(out, "        confirm: {}", name.confirm_by);
    }
    if !findings.alternatives.is_empty() {
        let told = findings
            .alternatives
            .iter()
            .map(|(name, probability)| format!("{name} {probability:.3}"));
        let _ = writeln!(out, "OR      {}", told.collect::<Vec<_>>().join(", "));
    }
    let left = match findings.outcome {
        Outcome::Clean => format!(
            "NO EFFECT is needed for what parity shows; what it cannot show is listed under UNSEEN{}",
            match flight.unturned {
                0 => "",
                // An effect that shows nowhere else was not looked for.
                _ => ", and of the packets that were LEFT OUT nothing is said",
            }
        ),
        Outcome::Undecided => {
            "UNDECIDED  the first under OR would explain this log about the smoothed motion, but no held-out window shows it".to_owned()
        }
        Outcome::Named => format!("LEFT    {:.3} sigma once the causes are in", findings.gap[1]),
        _ => format!(
            "LEFT    {:.3} sigma; not explained by what is named: the gap, a calibration that is off by more than its sigmas \
             allow, or an effect that explained it here and that the held-out windows refute. An effect outside the library, one of a kind that is listed under UNSEEN and is far above its usual size, \
             or a motion too quick for the packets",
            findings.gap[1]
        ),
    };
    out + &left + "\n"
}

fn evidence(name: &Name) -> String {
    match (name.gain, name.snr) {
        (Some(gain), Some([usual, found])) => {
            let by = match name.by {
                By::Smoothing => ", about the smoothed motion",
                By::Codes | By::Axes | By::Turns | By::Parity => "",
            };
            let held = name.promise.map_or(String::new(), |promise| {
                format!(
                    "; {:.2} +- {:.2} times as strong on the held-out windows",
                    promise.factor, promise.sigma
                )
            });
            format!(
                ", {gain:.1} nats{by}, signal-to-noise ratio {found:.1} at this size and {usual:.1} at the usual{held}"
            )
        }
        _ if name.by == By::Axes => ", by what each packet reads as a whole".to_owned(),
        _ if name.by == By::Turns => ", by how far field and force turn from one packet to the next".to_owned(),
        _ => ", by the codes alone".to_owned(),
    }
}

/// What to do next.
pub fn next(findings: &Findings) -> String {
    match findings.names.first() {
        Some(name) => format!("To be sure: {}\n", name.confirm_by),
        None => format!(
            "What this log cannot show, a test on the ground would: {}.\n",
            NULLS[0].settled_by
        ),
    }
}

/// What of each effect can be seen, and what cannot and why.
pub fn visibility(findings: &Findings) -> String {
    let mut out = format!(
        "signal-to-noise ratio of an effect of usual size, where it is seen best:\nwith the motion known, by parity, the \
         share that remains, and about the smoothed motion; from {PARITY_SNR:.0} on it may be named\n\
         {:30} {:8} {:>10} {:>8} {:>6} {:>9}\n",
        "effect", "place", "reference", "parity", "share", "smoothed"
    );
    for row in &findings.visible {
        let (effect, place) = (row.effect, row.place);
        let note = if row.is_visible { "" } else { "  not seen" };
        let smoothed = row.smoothed.map_or("-".to_owned(), |snr| format!("{snr:.1}"));
        let _ = writeln!(
            out,
            "{effect:30} {place:8} {:10.1} {:8.1} {:6.2} {smoothed:>9}{note}",
            row.with_reference,
            row.snr,
            row.share()
        );
    }
    out += "\n";
    out += &lost_packets(findings);
    out += &nulls::told();
    out
}
