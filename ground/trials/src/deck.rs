//! What a deal consists of: so many cases of each ring, in an order that is drawn.
//!
//! In: a [`Hand`], numbers as they are asked for. Out: [`Card`]s, each a case to fly.

use crate::{
    disturbance::{self, Disturbance},
    draw::Draw,
};

/// What is wrong with a case, by how much is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Ring {
    /// Nothing but calibration errors.
    R0,
    /// One effect that has a name.
    R1,
    /// A disturbance that has none.
    R3,
    /// Two effects that have names.
    R4,
    /// Three or four effects that have names.
    R6,
    /// One in a recording of a real unit.
    R7,
    /// Nothing but a description that is a little wrong.
    R0m,
    /// Nothing wrong or one effect that has a name, and nobody knows the motion.
    R8,
}

/// How many cases of each ring.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hand {
    /// Nothing wrong.
    pub r0: usize,
    /// One effect.
    pub r1: usize,
    /// Nothing wrong, described a little wrong.
    pub r0m: usize,
    /// A novel disturbance.
    pub r3: usize,
    /// Two effects.
    pub r4: usize,
    /// Three or four effects.
    pub r6: usize,
    /// One effect in a recording of a real unit.
    pub r7: usize,
    /// Nothing wrong or one effect, its motion withheld; a fifth of them rockets.
    pub r8: usize,
    /// Besides, one case of one effect for every one that has a name.
    pub each: bool,
}

/// What is to be dealt.
#[derive(Clone, Copy)]
pub struct Card {
    /// By how much is wrong.
    pub ring: Ring,
    /// What is wrong; drawn from the ring if absent.
    pub given: Option<Disturbance>,
}

impl Hand {
    /// Its cards in an order that is drawn.
    pub fn shuffled(self, draw: &mut Draw) -> Vec<Card> {
        let rings = [
            (Ring::R0, self.r0),
            (Ring::R1, self.r1),
            (Ring::R3, self.r3),
            (Ring::R4, self.r4),
            (Ring::R6, self.r6),
            (Ring::R7, self.r7),
            (Ring::R8, self.r8),
            (Ring::R0m, self.r0m),
        ];
        let drawn = |(ring, count)| vec![Card { ring, given: None }; count];
        let mut deck: Vec<Card> = rings.into_iter().flat_map(drawn).collect();
        if self.each {
            deck.extend(disturbance::named().into_iter().map(|disturbance| Card {
                ring: Ring::R1,
                given: Some(disturbance),
            }));
        }
        for last in (1..deck.len()).rev() {
            deck.swap(last, draw.below(last + 1));
        }
        deck
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dealing_each_deals_every_name_once_beside_what_is_drawn() {
        let hand = Hand {
            r0: 2,
            r1: 1,
            r3: 0,
            r4: 3,
            each: true,
            ..Hand::default()
        };
        let deck = hand.shuffled(&mut Draw::new(7));
        let drawn = deck.iter().filter(|card| card.given.is_none()).map(|card| card.ring);
        let mut rings: Vec<String> = drawn.map(|ring| format!("{ring:?}")).collect();
        rings.sort_unstable();
        assert_eq!(rings, ["R0", "R0", "R1", "R4", "R4", "R4"]);
        let mut every: Vec<&str> = disturbance::named()
            .iter()
            .map(|disturbance| disturbance.name)
            .collect();
        let given: Vec<(Ring, Disturbance)> = (deck.iter())
            .filter_map(|card| Some((card.ring, card.given?)))
            .collect();
        assert!(given.iter().all(|(ring, _)| *ring == Ring::R1));
        let mut dealt: Vec<&str> = given.iter().map(|(_, disturbance)| disturbance.name).collect();
        assert_ne!(dealt, every, "not shuffled");
        dealt.sort_unstable();
        every.sort_unstable();
        assert_eq!(dealt, every);
    }
}
