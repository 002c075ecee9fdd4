//! Shares of a total among players that overlap: the Shapley value, which for explained variance is LMG (Lindeman, Merenda
//! and Gold 1980; Groemping, J. Stat. Softw. 17(1), 2006).
//!
//! In: how many players, and the value of every set of them. Out: a share each, which add up to the value of all less that
//! of none: what a player adds, averaged over all orders in which they may come.
//!
//! Costs a value for each set, so few players: [`MOST`].

/// Players at most: 32 sets for five, 1024 for ten.
pub const MOST: usize = 10;

/// The shares; `value` is asked for each set once, bit `k` for player `k`. Players beyond [`MOST`] get nothing.
pub fn shares(players: usize, value: impl FnMut(u32) -> f64) -> Vec<f64> {
    let counted = players.min(MOST);
    let values: Vec<f64> = (0..1u32 << counted).map(value).collect();
    // |S|! (n - |S| - 1)! / n!, of a set that lacks the player.
    let mut weights = vec![1.0 / counted.max(1) as f64; counted];
    for size in 1..counted {
        weights[size] = weights[size - 1] * size as f64 / (counted - size) as f64;
    }
    let share = |player: usize| -> f64 {
        let without = (0..values.len()).filter(|set| set >> player & 1 == 0);
        without
            .map(|set| weights[set.count_ones() as usize] * (values[set | 1 << player] - values[set]))
            .sum()
    };
    let mut shares: Vec<f64> = (0..counted).map(share).collect();
    shares.resize(players, 0.0);
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a handful of sums.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn the_glove_game_is_the_textbooks() {
        // One left glove (player 0), two right ones: a pair is worth one. 2/3, 1/6, 1/6 (Shapley 1953).
        let found = shares(3, |set| f64::from(u8::from(set & 1 == 1 && set > 1)));
        for (found, expected) in found.iter().zip([2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0]) {
            assert!((found - expected).abs() < ROUNDING, "{found} {expected}");
        }
    }

    #[test]
    fn shares_add_up_to_the_whole() {
        let value = |set: u32| (f64::from(set) * 0.37).sin() + f64::from(set.count_ones());
        let sum: f64 = shares(5, value).iter().sum();
        assert!((sum - (value(31) - value(0))).abs() < ROUNDING);
    }

    #[test]
    fn nobody_shares_nothing() {
        assert!(shares(0, |_| 1.0).is_empty());
    }
}
