//! What several logs say together, as texts and as a page.
//!
//! In: the logs and [`Found`]. Out: the screen and its parts, the page; `verdict.json` by [`verdict`]. What can be seen stands before what
//! was found, and of each name what every log says of it.

mod verdict;

use std::fmt::Write;

use chart::{Block, ChartError};

pub use self::verdict::verdict;
use crate::{
    parity::{name::By, nulls},
    probability::{cause::Sized, outcome::Outcome},
    report::terminal::wrapped,
    thresholds::PARITY_SNR,
    together::{
        cause::{Cause, Share},
        found::Found,
        joint::Apart,
        log::Logged,
        shown::Visible,
    },
};

/// What is not judged.
pub const NO_SHRINK: &str =
    "of several logs together no shrinkage is judged; that of one with a reference: ground gap shrink CASE\n";

/// Parameters that are told of a name.
const SHOWN: usize = 4;

/// All of it.
pub fn screen(logs: &[Logged], found: &Found) -> String {
    let mut out = format!("{} logs of one unit\n", logs.len());
    // Writing to a string cannot fail.
    for (at, log) in logs.iter().enumerate() {
        let how = match (log.has_reference(), found.followed[at]) {
            (true, _) => "with a reference",
            (false, true) => "without a reference: by parity, and about its smoothed motion",
            (false, false) => "without a reference: by parity alone, for its motion did not settle",
        };
        let _ = writeln!(out, "LOG {}   {}, {}: {how}", at + 1, log.path.display(), log.name);
    }
    let (seen, unseen) = split(found);
    let _ = writeln!(out, "SEEN    of usual size, together: {}", seen.join(", "));
    let only: Vec<&str> = (found.visible.iter())
        .filter(|row| is_only_together(row))
        .map(|row| row.together.effect)
        .collect();
    if !only.is_empty() {
        let mut only = only;
        only.dedup();
        let _ = writeln!(out, "        of these by no log alone: {}", only.join(", "));
    }
    let _ = writeln!(out, "UNSEEN  never named from these logs: {}", unseen.join(", "));
    out += &gaps(logs, found);
    out += &why(logs, found);
    let _ = writeln!(out, "NEXT    {}", next(found).trim_end());
    wrapped(&out)
}

/// Effects that can be named from all logs together, and those that cannot.
fn split(found: &Found) -> (Vec<&'static str>, Vec<&'static str>) {
    let mut names: Vec<&'static str> = found.visible.iter().map(|row| row.together.effect).collect();
    names.dedup();
    let is_visible = |name: &&'static str| {
        let mut own = found.visible.iter().filter(|row| row.together.effect == *name);
        own.any(|row| row.together.is_visible)
    };
    names.into_iter().partition(is_visible)
}

/// Whether an effect can be named from all logs and from none of them.
fn is_only_together(row: &Visible) -> bool {
    row.together.is_visible && row.each.iter().all(|snr| *snr < PARITY_SNR)
}

/// The gap of each log.
pub fn gaps(logs: &[Logged], found: &Found) -> String {
    let each = logs.iter().zip(&found.gaps).enumerate();
    let told = each.map(|(at, (_, [before, after]))| {
        let what = if found.causes.is_empty() {
            String::new()
        } else {
            format!(", {after:.3} with the causes in")
        };
        format!("log {} {before:.3}{what}", at + 1)
    });
    format!(
        "GAP     sigma where 1 is noise and calibration alone: {}\n",
        told.collect::<Vec<_>>().join("; ")
    )
}

/// Which effects, how sure, and what each log says of them.
pub fn why(logs: &[Logged], found: &Found) -> String {
    let mut out = String::new();
    for coded in &found.coded {
        let logs: Vec<String> = coded.logs.iter().map(|at| (at + 1).to_string()).collect();
        let _ = writeln!(
            out,
            "CAUSE   {} at {}, by the codes of log {}: {}",
            coded.effect,
            coded.channels.join(" "),
            logs.join(", "),
            coded.what
        );
    }
    for cause in &found.causes {
        out += &cause_lines("CAUSE  ", logs, cause);
    }
    for cause in &found.contradicted {
        out += &cause_lines("AGAINST", logs, cause);
        out += "        not named: the logs contradict each other about it. It is no property of the unit that stays, or one of the logs has \
                something else\n";
    }
    if !found.alternatives.is_empty() {
        let told = found
            .alternatives
            .iter()
            .map(|(name, probability)| format!("{name} {probability:.3}"));
        let _ = writeln!(out, "OR      {}", told.collect::<Vec<_>>().join(", "));
    }
    out + match found.outcome {
        Outcome::Clean => {
            "NO EFFECT is needed for what these logs show; what they cannot show is listed under UNSEEN\n"
        }
        Outcome::Undecided => {
            "UNDECIDED  the first under OR would explain these logs about the smoothed motion, but no held-out window shows it\n"
        }
        Outcome::Named => "LEFT    nothing that stands out of any log once the causes are in\n",
        _ => {
            "LEFT    something that is not explained by what is named: a gap, a calibration that is off by more than its sigmas allow, logs that \
             contradict each other, or a name that the held-out windows refute\n"
        }
    }
}

fn cause_lines(word: &str, logs: &[Logged], cause: &Cause) -> String {
    let by = match cause.by {
        By::Smoothing => ", about the smoothed motions",
        By::Codes | By::Axes | By::Turns | By::Parity => "",
    };
    let held = cause.promise.map_or(String::new(), |promise| {
        format!(
            "; {:.2} +- {:.2} times as strong on the held-out windows",
            promise.factor, promise.sigma
        )
    });
    let mut out = format!(
        "{word} {} at {}, probability {:.3}, {:.1} nats together{by}, ratio {:.1} at usual size{held}\n",
        cause.effect,
        cause.channels.join(" "),
        cause.probability,
        cause.all.gain,
        cause.all.snr
    );
    for line in largest(&cause.all) {
        let _ = writeln!(out, "        {line}");
    }
    for (at, share) in cause.each.iter().enumerate().take(logs.len()) {
        let _ = writeln!(out, "        log {}: {}", at + 1, says(share));
    }
    if !cause.or_at.is_empty() {
        let _ = writeln!(
            out,
            "        or, as likely from these logs, at {}",
            cause.or_at.join(", ")
        );
    }
    let _ = writeln!(out, "        {}", agreement(cause));
    let page = cause.fitted.0.active.cause.effect.page();
    let _ = writeln!(out, "        {}", page.physics);
    let _ = writeln!(out, "        confirm: {}", page.confirm_by);
    out
}

fn size(sized: &Sized) -> String {
    let parameter = &sized.parameter;
    format!(
        "{} {:.4e} +- {:.1e} {}",
        parameter.name, sized.value, sized.sigma, parameter.unit
    )
}

/// The largest parameters, in their sigmas, of which the rest are counted.
fn largest(share: &Share) -> Vec<String> {
    let mut own: Vec<&Sized> = share.parameters.iter().collect();
    let sigmas = |sized: &Sized| (sized.value / sized.sigma.max(f64::MIN_POSITIVE)).abs();
    own.sort_by(|one, other| sigmas(other).total_cmp(&sigmas(one)));
    let mut told: Vec<String> = own.iter().take(SHOWN).map(|sized| size(sized)).collect();
    if own.len() > SHOWN {
        told.push(format!("{} smaller in verdict.json", own.len() - SHOWN));
    }
    told
}

/// What one log says, in words.
fn says(share: &Share) -> String {
    if share.snr < PARITY_SNR {
        return format!("does not show it by itself (ratio {:.1} at usual size)", share.snr);
    }
    format!("{:.1} nats, {}", share.gain, largest(share).join(", "))
}

/// Whether the logs agree, in words.
fn agreement(cause: &Cause) -> String {
    let numbers = |apart: &Apart| {
        format!(
            "chi-square {:.1} at {:.1} degrees of freedom, by chance in {:.2e}, {:.0} % of its size",
            apart.chi_square,
            apart.free,
            apart.chance,
            100.0 * apart.part
        )
    };
    let pair = cause.pair.map_or(String::new(), |(one, other, apart)| {
        format!(
            "; most apart are logs {} and {}: {}",
            one + 1,
            other + 1,
            numbers(&apart)
        )
    });
    match &cause.apart {
        Some(apart) => format!("logs differ by {}{pair}", numbers(apart)),
        None => "one log alone shows it; none contradicts".to_owned(),
    }
}

/// What to do next.
pub fn next(found: &Found) -> String {
    match (found.causes.first(), found.contradicted.first()) {
        (Some(cause), _) => format!("To be sure: {}\n", cause.fitted.0.active.cause.effect.page().confirm_by),
        (None, Some(cause)) => format!(
            "Look at each log by itself: they contradict each other about {}.\n",
            cause.effect
        ),
        (None, None) => format!(
            "What these logs cannot show, a test on the ground would: {}.\n",
            nulls::NULLS[0].settled_by
        ),
    }
}

/// What of each effect can be seen in each log and in all.
pub fn limits(logs: &[Logged], found: &Found) -> String {
    let mut out = format!(
        "signal-to-noise ratio of an effect of usual size, where it is seen best: in each log and in all together;\nfrom \
         {PARITY_SNR:.0} on it may be named\n{:30} {:8}",
        "effect", "place"
    );
    for at in 0..logs.len() {
        let _ = write!(out, " {:>8}", format!("log {}", at + 1));
    }
    let _ = writeln!(out, " {:>9}", "together");
    for row in &found.visible {
        let _ = write!(out, "{:30} {:8}", row.together.effect, row.together.place);
        for snr in &row.each {
            let _ = write!(out, " {snr:8.1}");
        }
        let note = match (row.together.is_visible, is_only_together(row)) {
            (false, _) => "  not seen",
            (true, true) => "  together only",
            (true, false) => "",
        };
        let _ = writeln!(out, " {:9.1}{note}", row.together.snr);
    }
    if logs.iter().all(|log| !log.has_reference()) {
        out += "\n";
        out += &nulls::told();
    }
    out
}

/// The page.
///
/// # Errors
/// When a plot cannot be drawn.
pub fn html(logs: &[Logged], found: &Found) -> Result<String, ChartError> {
    let named: Vec<String> = (found.causes.iter())
        .map(|cause| format!("{} at {}", cause.effect, cause.locality))
        .collect();
    let lead = match found.outcome {
        Outcome::Clean | Outcome::Recalibrate => {
            "The logs agree with each other and with the description of the unit.".to_owned()
        }
        Outcome::Named => format!("The logs say together: {}.", named.join(", and ")),
        Outcome::PartlyNamed => format!(
            "The logs say together: {}, and something that is not known.",
            named.join(", and ")
        ),
        Outcome::Undecided => "The logs show something, but no cause of it is likelier than not.".to_owned(),
        Outcome::Unknown => "The logs show something that no known effect explains in all of them.".to_owned(),
    };
    let mut blocks = vec![Block::Lead(lead), Block::Terminal(screen(logs, found))];
    let causes = found.causes.iter().chain(&found.contradicted);
    for cause in causes {
        blocks.push(Block::Heading(format!(
            "What each log says of {} at {}",
            cause.effect, cause.locality
        )));
        let shares = std::iter::once(("together".to_owned(), &cause.all));
        let each = cause
            .each
            .iter()
            .enumerate()
            .map(|(at, share)| (logs[at].path.display().to_string(), share));
        let row = |(log, share): (String, &Share)| {
            let sizes: Vec<String> = share.parameters.iter().map(size).collect();
            vec![
                log,
                format!("{:.1}", share.snr),
                format!("{:.1}", share.gain),
                sizes.join("; "),
            ]
        };
        blocks.push(Block::Table {
            columns: ["log", "ratio at usual size", "nats", "size"]
                .map(str::to_owned)
                .to_vec(),
            rows: each.chain(shares).map(row).collect(),
        });
    }
    blocks.push(Block::Heading("What each log shows of each effect".to_owned()));
    blocks.push(Block::Terminal(limits(logs, found)));
    let names: Vec<&str> = logs.iter().map(|log| log.name.as_str()).collect();
    Ok(chart::html("Gap of several logs", &names.join(", "), &blocks))
}
