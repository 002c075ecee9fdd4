//! What the rows of a log say by themselves, as causes.
//!
//! In: what was asked of the rows before they were thinned ([`crate::input`]). Out: [`Cause`]s, whose shares are still energies. Nothing of a model is in
//! them: what a name explains otherwise and what is left say nothing against them.

use twin::effect::Page;

use crate::{
    input::{case::Subject, faster::Line, repeats::Repeats, stops::Stop},
    probability::cause::{Cause, Sized, named, parameter},
    thresholds::{SUSPICIOUS, TEMPERATURE},
};

/// The effect of samples that were sent twice, which rows alone show.
pub const STALE: &str = "stale-sample";

/// The effect of a line, which they show too.
pub const VIBRATION: &str = "vibration";

/// The effect of gyros that stop before the end of their range.
const STOPPED: &str = "gyro-saturation";

/// All of them.
pub fn causes_of_rows(subject: &Subject) -> Vec<Cause> {
    let twice = subject.repeats.iter().flatten();
    let twice = twice.filter_map(|repeats| cause_of_repeats(subject, repeats));
    let line = subject.fast.iter().filter_map(|fast| fast.line.as_ref());
    let shaken = line.filter_map(|line| cause_of_line(subject, line));
    twice
        .chain(shaken)
        .chain(cause_of_stops(subject, &subject.stops))
        .collect()
}

/// One on this evidence \[nats\] against chance, of so many times its largest size.
fn cause(subject: &Subject, page: &'static Page, channels: Vec<usize>, nats: f64, excess: f64) -> Cause {
    Cause {
        effect: page.name,
        locality: subject.names(channels.iter().copied()).join(" "),
        channels,
        probability: named(nats / TEMPERATURE, excess),
        of_any: 1.0,
        gain: nats,
        explained: 2.0 * nats,
        parameters: Vec::new(),
        share: 2.0 * nats,
        when: "throughout".to_owned(),
        which: None,
        confirm_by: page.confirm_by,
        physics: page.physics,
        is_suspicious: excess > SUSPICIOUS,
    }
}

/// Parts that send samples twice.
fn cause_of_repeats(subject: &Subject, repeats: &Repeats) -> Option<Cause> {
    let page = twin::effect::by_name(STALE)?.page();
    let symbol = page.parameters.first()?;
    let excess = repeats.share / symbol.prior_sigma / page.largest;
    Some(Cause {
        parameters: vec![Sized {
            parameter: parameter(symbol, symbol.name.to_owned()),
            value: repeats.share,
            sigma: repeats.sigma,
        }],
        which: Some("all its axes repeat the row before together, oftener than by chance".to_owned()),
        ..cause(subject, page, repeats.channels.clone(), repeats.nats, excess)
    })
}

/// A vibration.
fn cause_of_line(subject: &Subject, line: &Line) -> Option<Cause> {
    let page = twin::effect::by_name(VIBRATION)?.page();
    let symbol = page.parameters.first()?;
    let channels: Vec<usize> = line.sizes.iter().map(|(channel, _)| *channel).collect();
    let size = |(channel, size): &(usize, [f64; 2])| {
        let own = &subject.twin.unit().channels[*channel];
        let [value, sigma] = size.map(|size| size / own.sigma());
        Sized {
            parameter: parameter(symbol, format!("{}_{}", symbol.name, own.name)),
            value,
            sigma,
        }
    };
    let parameters: Vec<Sized> = line.sizes.iter().map(size).collect();
    let sizes = parameters.iter().map(|sized| sized.value / symbol.prior_sigma);
    let excess = sizes.fold(0.0, f64::max) / page.largest;
    Some(Cause {
        parameters,
        which: Some(format!(
            "a line at {:.2} Hz, or folded to it, which the reference is too slow for",
            line.hz
        )),
        ..cause(subject, page, channels, line.nats, excess)
    })
}

/// Gyros that stop.
fn cause_of_stops(subject: &Subject, stops: &[Stop]) -> Option<Cause> {
    let page = twin::effect::by_name(STOPPED)?.page();
    let nats: f64 = stops.iter().map(|stop| stop.nats).sum();
    let mut channels: Vec<usize> = stops.iter().map(|stop| stop.channel).collect();
    channels.dedup();
    let told = |stop: &Stop| format!("{} at {:.4} rad/s", subject.names([stop.channel]).join(""), stop.at);
    let which: Vec<String> = stops.iter().map(told).collect();
    (!stops.is_empty()).then(|| Cause {
        when: "at the largest rates".to_owned(),
        which: Some(which.join(", ")),
        ..cause(subject, page, channels, nats, 0.0)
    })
}
