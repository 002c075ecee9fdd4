//! What this log can show of each effect, before anything is sought in it.
//!
//! In: every hypothesis with its information by parity and with the motion known. Out: a [`Row`] for each effect and each kind of
//! place: the signal-to-noise ratio that an effect of plausible size has on the whole, `sqrt(sum sigma_i^2 G_ii)` over its
//! parameters with their prior sigmas, with a reference and without one, where it is seen best; and the share that remains.
//!
//! Below [`PARITY_SNR`] an effect is never named.

use twin::effect::Locality;

use crate::{
    library::hypotheses::Hypothesis,
    parity::{nulls, search::Seen},
    thresholds::PARITY_SNR,
};

/// Of an effect at a kind of place.
#[derive(Clone, Debug)]
pub struct Row {
    /// Which.
    pub effect: &'static str,
    /// `one` of them, `each` its own, all in `common`, the `unit`.
    pub place: &'static str,
    /// With the motion known.
    pub with_reference: f64,
    /// By parity.
    pub snr: f64,
    /// About the smoothed motion; none where that did not settle.
    pub smoothed: Option<f64>,
    /// Whether it may be named.
    pub is_visible: bool,
}

impl Row {
    /// Share of the ratio that remains.
    pub fn share(&self) -> f64 {
        if self.with_reference > 0.0 {
            self.snr / self.with_reference
        } else {
            0.0
        }
    }
}

/// The table, in the order of the library.
pub fn table(hypotheses: &[Hypothesis], seen: &[Seen]) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for one in seen {
        let hypothesis = &hypotheses[one.hypothesis];
        let (effect, place) = (hypothesis.effect(), kind(&hypothesis.cause.locality));
        let row = Row {
            effect,
            place,
            with_reference: one.with_reference,
            snr: one.snr,
            smoothed: None,
            is_visible: may_be_named(hypothesis, one.snr),
        };
        match rows.iter_mut().find(|row| (row.effect, row.place) == (effect, place)) {
            Some(known) if known.snr < row.snr => *known = row,
            Some(_) => {}
            None => rows.push(row),
        }
    }
    rows
}

/// Adds what is seen about the smoothed motion.
pub fn add(rows: &mut [Row], smoothed: &[Row]) {
    for row in rows {
        let own = smoothed
            .iter()
            .find(|own| (own.effect, own.place) == (row.effect, row.place));
        if let Some(own) = own {
            row.smoothed = Some(own.snr);
            row.is_visible |= own.is_visible;
        }
    }
}

/// Lost packets have a column that another motion has too; the turn between two packets shows them all the same.
pub fn add_loss(rows: &mut [Row], shown: Option<f64>) {
    let own = rows.iter_mut().filter(|row| row.effect == "packet-loss");
    own.for_each(|row| row.is_visible = shown.is_some_and(|share| share > 0.0));
}

/// Whether a hypothesis of this ratio may be named at all.
pub fn may_be_named(hypothesis: &Hypothesis, snr: f64) -> bool {
    snr >= PARITY_SNR && nulls::of(hypothesis).is_none()
}

/// The kind of a place.
pub fn kind(locality: &Locality) -> &'static str {
    match locality {
        Locality::Unit => "unit",
        Locality::Common => "common",
        Locality::All => "each",
        Locality::Group(_) | Locality::Channel(_) => "one",
    }
}
