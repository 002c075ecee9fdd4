//! A log without what was found in it before there is a motion.
//!
//! In: a log, its unit, and [`Finding`]s. Out: the same two, changed in place, so that a motion can be made of what is left.

use twin::predict::UnitDescription;

use crate::{
    input::log::{Log, Series},
    parity::{
        codes::{Finding, alike_at_end, repeated},
        garbled,
        lost::put_back,
    },
};

/// The log without what was found: old samples, faulty channels and the time in which one is stuck are left out, lost bits are rounding;
/// channels look where they do, and what comes after packets that nobody counted is as late as it is.
pub fn taken_out(log: &mut Log, unit: &mut UnitDescription, found: &[Finding]) {
    if found.iter().any(|finding| finding.effect == "packet-corruption") {
        for (channel, spoilt) in garbled::spoilt(log, unit) {
            let series = &mut log.channels[channel];
            *series = series.only(|row| row as u32 != spoilt);
        }
    }
    for look in found.iter().flat_map(|finding| &finding.looks) {
        let own = &mut unit.channels[look.channel];
        (own.axis_b, own.lever_m) = (look.axis_b, look.lever_m);
    }
    for finding in found {
        put_back(&mut log.start_s, &finding.losses);
    }
    let is_of_channels = |finding: &&Finding| {
        finding.looks.is_empty() && finding.losses.is_empty() && finding.effect != "packet-corruption"
    };
    for finding in found.iter().filter(is_of_channels) {
        let repeated = repeated(log, &finding.channels);
        for channel in finding.channels.iter().copied() {
            let own = &mut unit.channels[channel];
            let series = &mut log.channels[channel];
            match (finding.effect, finding.step) {
                (_, Some(step)) => {
                    let coarse = step as f64 * own.lsb;
                    own.noise_sigma = own.noise_sigma.hypot(coarse / 12f64.sqrt());
                    // Cut off instead of rounded, they are off by half a step.
                    own.bias_sigma = own.bias_sigma.hypot(0.5 * coarse);
                }
                ("stale-sample", _) => *series = series.only(|row| repeated.binary_search(&(row as u32)).is_err()),
                ("stuck-channel", _) => {
                    let last = series.rows.len() - alike_at_end(series);
                    series.rows.truncate(last);
                    series.values.truncate(last);
                }
                _ => *series = Series::default(),
            }
        }
    }
}
