//! Packets that were lost and that nobody counted: field and force have turned further from one row to the next than the gyros turned.
//!
//! In: a log without what its codes tell, and its unit. Out: [`Losses`], and where one lost packet would be seen at all.
//!
//! Without a reference a clock that is late is another motion, and no column of the library tells one from the other. But the motion
//! jumps at the loss: the rates before and after say how far the unit turns in the time that is told, and field and force say how far
//! it did turn. With `theta(T)` the turn of the rates over a time `T` ([`turned`]), and `v` what field or force read,
//!
//! ```text
//! d(T) = v_(k+1) - exp(-theta(T)) v_k
//! ```
//!
//! is small for the true `T`: the cycle, or `n + 1` cycles where `n` packets were lost. How small, the log itself tells: `d` of all
//! its rows, and of all pairs of rows with `n` rows between them, have a law each ([`law`]). So a motion that is quick beside the
//! cycle, or that pushes, has wide laws and shows nothing, and no noise, interpolation or acceleration has to be described.
//!
//! A loss of `n` packets has to win three comparisons. Each packet more is half as likely, which costs `n ln 2`.
//!
//! 1. Against chance. Any row may have it, and it must come by chance in less than [`RARE`] of all logs:
//!
//!    ```text
//!    ln p_n(d((n + 1) cycle)) - n ln 2 - ln p_0(d(cycle)) - ln rows > -ln RARE
//!    ```
//!
//! 2. Against a jump: a field that steps, a blow. A jump may be of any size. Its law `q` is normal, has the shape of `p_0`, and is as wide
//!    as explains this one row best. A loss is believed where a jump is less likely than [`CHANCE`] beside it:
//!
//!    ```text
//!    ln p_n(d((n + 1) cycle)) - n ln 2 - ln q(d(cycle)) > -ln CHANCE
//!    ```
//!
//! 3. Against one row that is off. Across that row the unit has turned as it should. So the loss is also asked of the pair that leaves out
//!    the row before it, and of the pair that leaves out the row after it. In both it must be likelier than no loss and than a jump.
//!
//! Losses that share rows are found one after another, the likelier first.
//!
//! Refuses nothing: a unit without a cycle or without three gyros that span, or with neither field nor force, shows none.

mod law;
mod turned;

use serde::Serialize;
use twin::predict::UnitDescription;

use crate::{
    input::log::Log,
    parity::lost::{
        law::{Law, MOST, about},
        turned::Turned,
    },
    thresholds::{CHANCE, RARE},
};

/// Packets between two rows at most that have a law. Of the unit's cycle they are two seconds, and few motions are a cubic for longer.
const LONGEST: usize = 10;

/// Rows to either side that are taken together, of which the log chooses what shows most: more rows have less noise, and their turn has more
/// error.
const BESIDE: [usize; 4] = [1, 2, 4, 8];

/// Packets that are not there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Loss {
    /// \[s\] start of the last row before them, as the log tells it.
    pub after_s: f64,
    /// How many.
    pub packets: usize,
    /// \[s\] by which all later rows are later than told.
    pub by_s: f64,
    /// Against a jump of any other kind.
    #[serde(skip)]
    pub probability: f64,
}

/// What a log says of packets that were lost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Losses {
    /// In the order of the log.
    pub found: Vec<Loss>,
    /// Share of the rows after which one lost packet would be found; none of a log that has no laws.
    pub shown: Option<f64>,
}

impl Losses {
    /// Of a log.
    pub fn of(log: &Log, unit: &UnitDescription) -> Self {
        let mut own = Self::default();
        let mut later = log.clone();
        while let Some(laws) = Laws::of(&later, unit) {
            own.shown = Some(laws.shown);
            let losses = laws.losses();
            if losses.is_empty() {
                break;
            }
            own.found.extend(losses.into_iter().map(|(row, loss)| Loss {
                after_s: log.start_s[row],
                ..loss
            }));
            // A second one beside the first shows once the first is put back.
            later.start_s.clone_from(&log.start_s);
            put_back(&mut later.start_s, &own.found);
        }
        own.found.sort_by(|one, other| one.after_s.total_cmp(&other.after_s));
        own
    }
}

/// Rows as late as they are, of the times that a log tells.
pub fn put_back(start_s: &mut [f64], losses: &[Loss]) {
    for start_s in start_s {
        let before = losses.iter().filter(|loss| loss.after_s < *start_s);
        *start_s += before.map(|loss| loss.by_s).sum::<f64>();
    }
}

/// The same of spans.
pub fn put_back_spans(spans_s: &mut [(f64, f64)], losses: &[Loss]) {
    for (from_s, to_s) in spans_s {
        put_back(std::slice::from_mut(from_s), losses);
        put_back(std::slice::from_mut(to_s), losses);
    }
}

/// Of some losses, in words.
pub fn told(losses: &[Loss]) -> String {
    let own = |loss: &Loss| {
        let packets = if loss.packets == 1 { "packet" } else { "packets" };
        format!(
            "{} {packets} ({:.1} s) after {:.1} s",
            loss.packets, loss.by_s, loss.after_s
        )
    };
    let told: Vec<String> = losses.iter().map(own).collect();
    format!("{}; all that comes later is put that much later", told.join(", "))
}

/// A log with the law of `d` for every number of packets between two rows.
struct Laws {
    turned: Turned,
    laws: Vec<Law>,
    /// Of each row, how much wider `d` is about it, by its neighbours.
    widths: Vec<Option<f64>>,
    /// Rows beside one that share what is known of it.
    shared: usize,
    cycle_s: f64,
    shown: f64,
}

impl Laws {
    /// With as many rows to either side as show most; none where there is no cycle, no rate, nothing that turns or too few rows.
    fn of(log: &Log, unit: &UnitDescription) -> Option<Self> {
        let all = BESIDE.into_iter().filter_map(|beside| Self::beside(log, unit, beside));
        let mut laws = all.max_by(|one, other| one.shown.total_cmp(&other.shown))?;
        (laws.laws.len()..=LONGEST).try_for_each(|packets| laws.add(packets))?;
        Some(laws)
    }

    fn beside(log: &Log, unit: &UnitDescription, beside: usize) -> Option<Self> {
        let cycle_s = unit.cycle_s?;
        let turned = Turned::of(log, unit, cycle_s, beside)?;
        let own: Vec<_> = (0..turned.rows())
            .map(|row| turned.off(row, row + 1, cycle_s))
            .collect();
        // A mean of so many rows to either side, with a slope.
        let shared = beside;
        let (law, widths) = Law::with_widths(&own, shared)?;
        let mut laws = Self {
            turned,
            laws: vec![law],
            widths,
            shared,
            cycle_s,
            shown: 0.0,
        };
        // What one lost packet shows needs no more.
        (1..=2).try_for_each(|packets| laws.add(packets))?;
        laws.shown = laws.shown();
        Some(laws)
    }

    /// The law of rows with so many between them.
    fn add(&mut self, packets: usize) -> Option<()> {
        let gap = packets + 1;
        let at = |row: usize| {
            let off = self.turned.off(row, row + gap, gap as f64 * self.cycle_s)?;
            Some((off, about(&self.widths, (row, row + gap - 1), self.shared)?))
        };
        let all: Vec<_> = self.some_rows().filter_map(at).collect();
        self.laws.push(self.laws[0].of_others(&all)?);
        Some(())
    }

    /// The odds of so many packets lost between two rows, if the first is told to be so many cycles before the second.
    fn odds(&self, (from, to): (usize, usize), told: usize, packets: usize) -> Option<Odds> {
        let width = about(&self.widths, (from, to - 1), self.shared)?;
        let off = |cycles: usize| self.turned.off(from, to, cycles as f64 * self.cycle_s);
        let law = |cycles: usize| self.laws.get(cycles - 1);
        let lost = law(told + packets)?.ln_density(&off(told + packets)?, width) - packets as f64 * 2f64.ln();
        let off = off(told)?;
        Some(Odds {
            chance: lost - law(told)?.ln_density(&off, width),
            jump: lost - law(told)?.ln_jump(&off),
        })
    }

    /// The odds of so many packets lost between two rows that are so many cycles apart as told, if the rows about them say the same,
    /// whichever of the two is left out.
    fn between(&self, (from, to): (usize, usize), told: usize, packets: usize) -> Option<Odds> {
        let own = self.odds((from, to), told, packets)?;
        let own = Odds {
            chance: own.chance - (self.turned.rows() as f64).ln(),
            ..own
        };
        if !own.is_loss() {
            return None;
        }
        let says_so = |pair| {
            self.odds(pair, told + 1, packets)
                .filter(|odds| odds.chance.min(odds.jump) > 0.0)
        };
        says_so((from.checked_sub(1)?, to))
            .and(says_so((from, to + 1)))
            .and(Some(own))
    }

    /// Those that neither chance nor a jump makes, with their rows, the likeliest first; none that shares rows with a likelier one.
    fn losses(&self) -> Vec<(usize, Loss)> {
        let of_row = |row: usize| {
            let all = (1..LONGEST).filter_map(|packets| Some((packets, self.between((row, row + 1), 1, packets)?)));
            all.max_by(|one, other| one.1.jump.total_cmp(&other.1.jump))
        };
        let rows = 0..self.turned.rows();
        let mut all: Vec<(usize, (usize, Odds))> = rows.filter_map(|row| Some((row, of_row(row)?))).collect();
        all.sort_by(|one, other| other.1.1.jump.total_cmp(&one.1.1.jump));
        let mut losses: Vec<(usize, Loss)> = Vec::new();
        for (row, (packets, odds)) in all {
            let is_apart = |(other, _): &(usize, Loss)| row.abs_diff(*other) > 2 * self.shared + 1;
            if losses.iter().all(is_apart) {
                let loss = Loss {
                    after_s: self.turned.start_s(row),
                    packets,
                    by_s: packets as f64 * self.cycle_s,
                    probability: 1.0 / (1.0 + (-odds.jump).exp()),
                };
                losses.push((row, loss));
            }
        }
        losses
    }

    /// As many as a law needs, from all of the log.
    fn some_rows(&self) -> impl Iterator<Item = usize> {
        let known = |row: &usize| self.widths[*row].is_some();
        let all = self.widths.iter().flatten().count();
        (0..self.turned.rows()).filter(known).step_by(all.div_ceil(MOST).max(1))
    }

    /// What the log would show of one lost packet: a row is left out, and the two beside it are told to be a cycle apart.
    fn shown(&self) -> f64 {
        let rows: Vec<usize> = (self.some_rows())
            .filter(|row| self.odds((*row, *row + 2), 1, 1).is_some())
            .collect();
        let found = rows
            .iter()
            .filter(|row| self.between((**row, **row + 2), 1, 1).is_some());
        found.count() as f64 / rows.len().max(1) as f64
    }
}

/// \[nats\] of a loss, the number of its packets and of the rows paid for.
#[derive(Clone, Copy)]
struct Odds {
    /// Against nothing.
    chance: f64,
    /// Against a jump of any size at this row.
    jump: f64,
}

impl Odds {
    fn is_loss(&self) -> bool {
        self.chance > -RARE.ln() && self.jump > -CHANCE.ln()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;
    use crate::input::log::Series;

    const ROWS: usize = 600;

    /// \[uT\] in n.
    const FIELD_N: Vector3<f64> = Vector3::new(20.0, -7.0, 40.0);

    fn normal(random: &mut Xoshiro256PlusPlus) -> Vector3<f64> {
        Vector3::from_fn(|_, _| StandardNormal.sample(random))
    }

    /// Three gyros and three magnetometers that turn about all axes, at up to `0.4 quick` rad/s about each, the field with so much
    /// noise \[uT\].
    fn turning(quick: f64, noise_ut: f64, seed: u64) -> (Log, UnitDescription) {
        turning_without(&[], ROWS, (quick, noise_ut, seed))
    }

    /// The same of so many rows, with some of them lost and not counted.
    fn turning_without(
        lost: &[usize],
        rows: usize,
        (quick, noise_ut, seed): (f64, f64, u64),
    ) -> (Log, UnitDescription) {
        let mut text = "name = \"x\"\ncycle_s = 0.2\n".to_owned();
        for index in 0..6 {
            let sensor = ["gyro", "magnetometer"][index / 3];
            let axis: Vector3<f64> = Vector3::ith(index % 3, 1.0);
            text += &format!(
                "[[channel]]\nname = \"c{index}\"\nsensor = \"{sensor}\"\ngroup = \"x\"\naxis_b = [{:.1}, {:.1}, {:.1}]\n\
                 lsb = 0.001\nnoise_sigma = 0.01\n",
                axis.x, axis.y, axis.z
            );
        }
        let unit = UnitDescription::read(&text, "unit.toml").expect("a unit");
        let (mut log, mut random) = (Log::empty(6), Xoshiro256PlusPlus::seed_from_u64(seed));
        let rate_b = |t_s: f64| {
            Vector3::new(
                (0.31 * quick * t_s).sin(),
                (0.23 * quick * t_s).cos(),
                (0.17 * quick * t_s + 1.0).sin(),
            ) * 0.4
                * quick
        };
        let mut attitude = Rotation3::identity();
        for row in 0..rows {
            let start_s = 0.2 * row as f64;
            let rate = rate_b(start_s) + 0.005 * normal(&mut random);
            let field = attitude.inverse() * FIELD_N + noise_ut * normal(&mut random);
            if !lost.contains(&row) {
                let kept = log.start_s.len();
                log.begin_row(0.2 * kept as f64);
                for (index, value) in rate.iter().chain(field.iter()).enumerate() {
                    log.channels[index].rows.push(kept as u32);
                    log.channels[index].values.push(*value);
                }
            }
            for step in 0..20 {
                attitude *= Rotation3::new(rate_b(start_s + 0.01 * (f64::from(step) + 0.5)) * 0.01);
            }
        }
        (log, unit)
    }

    /// In how many of forty logs a loss is found, where something else was done to the field. `change` is given the channels of the field, a
    /// row and a step \[uT\].
    fn mistaken(quick: f64, change: impl Fn(&mut [Series], usize, Vector3<f64>)) -> usize {
        let (log, unit) = turning(quick, 0.2, 7);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
        let is_loss = |at: &usize| {
            let mut log = log.clone();
            let by = normal(&mut random).normalize() * (1.0 + 0.2 * *at as f64);
            change(&mut log.channels[3..], 20 + 13 * at, by);
            !Losses::of(&log, &unit).found.is_empty()
        };
        (0..40).filter(is_loss).count()
    }

    #[test]
    fn what_comes_after_a_loss_is_put_back_and_nothing_else_is() {
        let loss = |after_s, packets: usize| Loss {
            after_s,
            packets,
            by_s: 0.2 * packets as f64,
            probability: 1.0,
        };
        let mut spans_s = vec![(0.0, 1.0), (1.0, 1.2), (4.0, 5.0)];
        put_back_spans(&mut spans_s, &[loss(1.0, 1), loss(4.0, 2)]);
        assert_eq!(spans_s, [(0.0, 1.0), (1.0, 1.4), (4.2, 5.6)]);
    }

    /// A law takes every third row of so long a log.
    #[test]
    fn a_loss_is_found_after_any_row_of_a_log_longer_than_a_law_needs() {
        for lost in [2000, 2001, 2002] {
            let (log, unit) = turning_without(&[lost], 2 * MOST + 100, (2.0, 0.2, 7));
            let losses = Losses::of(&log, &unit);
            let found: Vec<_> = losses.found.iter().map(|loss| (loss.after_s, loss.packets)).collect();
            assert_eq!(found, [(0.2 * (lost - 1) as f64, 1)], "{:?}", losses.shown);
        }
    }

    /// Of the logs of the seeds 100 to 159 these have a loss if chance is not asked.
    #[test]
    fn what_noise_makes_is_no_loss() {
        for seed in [100, 109, 119] {
            let (log, unit) = turning(3.0, 5.0, seed);
            assert_eq!(Losses::of(&log, &unit).found, [], "{seed}");
        }
    }

    #[test]
    fn a_field_that_steps_is_no_loss() {
        let mistaken = mistaken(1.0, |field, row, by| {
            for (series, by) in field.iter_mut().zip(by.iter()) {
                series.values[row..].iter_mut().for_each(|value| *value += by);
            }
        });
        assert!(mistaken as f64 <= 40.0 * CHANCE, "{mistaken}");
    }

    #[test]
    fn a_row_that_reads_what_the_next_one_does_is_no_loss() {
        let mistaken = mistaken(5.0, |field, row, _| {
            field.iter_mut().for_each(|own| own.values[row] = own.values[row + 1])
        });
        assert_eq!(mistaken, 0);
    }
}
