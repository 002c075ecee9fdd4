//! What scalars take off the covariance, two at a time.
//!
//! In: what a scalar saw, `p = P h'` and `s = h p + r`. Out: blocks of `P` without `k u' + u k'`, with the gain `k = p/s` and
//! `u = p - k s/2` ([`super::Covariance::update`]). Most of the work is to bring elements from memory and back; for two
//! scalars together that is done once, and what belongs to a column is brought once for four rows. Every element has the
//! same operations in the same order as if the second scalar came after the first.

use super::state::State;

/// What a scalar saw of the covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    /// `p = P h'`.
    pub column: State,
    /// `s = h P h' + r`.
    pub variance: f32,
}

/// `k` and `u` of the first scalar at a state, and those of the second.
pub(super) type Pull = [f32; 4];

impl Seen {
    /// Takes nothing off.
    pub const NOTHING: Seen = Seen {
        column: State::ZERO,
        variance: 1.0,
    };

    /// `k` and `u`.
    pub fn pulls(&self) -> [State; 2] {
        let mut gain = State::ZERO;
        gain.add(&self.column, 1.0 / self.variance);
        let mut rest = self.column;
        rest.add(&gain, -0.5 * self.variance);
        [gain, rest]
    }
}

/// Those of two scalars, state by state.
pub(super) fn interleaved<const N: usize>(k: &[f32; N], u: &[f32; N], k_2: &[f32; N], u_2: &[f32; N]) -> [Pull; N] {
    core::array::from_fn(|n| [k[n], u[n], k_2[n], u_2[n]])
}

/// Off rows.
pub(super) fn take_off<const N: usize>(rows: &mut [[f32; N]], of_rows: &[Pull], of_columns: &[Pull; N]) {
    for (row, of_row) in rows.iter_mut().zip(of_rows) {
        for (element, of_column) in row.iter_mut().zip(of_columns) {
            *element = less(*element, of_row, of_column);
        }
    }
}

/// Off four rows, from a column on.
#[inline(never)]
pub(super) fn take_off_four<const N: usize>(
    [a, b, c, d]: &mut [[f32; N]; 4],
    [of_a, of_b, of_c, of_d]: [Pull; 4],
    of_columns: &[Pull; N],
    from: usize,
) {
    for column in from..N {
        let of_column = &of_columns[column];
        a[column] = less(a[column], &of_a, of_column);
        b[column] = less(b[column], &of_b, of_column);
        c[column] = less(c[column], &of_c, of_column);
        d[column] = less(d[column], &of_d, of_column);
    }
}

fn less(element: f32, [k, u, k_2, u_2]: &Pull, [x, y, x_2, y_2]: &Pull) -> f32 {
    element - k * y - u * x - k_2 * y_2 - u_2 * x_2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kalman::{Params, covariance::Covariance, state::VELOCITY};

    #[test]
    fn two_at_once_are_one_after_the_other_to_the_bit() {
        let seen = |covariance: &Covariance, k: usize| Seen {
            column: covariance.of_driven(k),
            variance: covariance.of_driven(k).driven[k] + 0.1,
        };
        // Begun with a column that ties all states together.
        let mut covariance = Covariance::new(&Params::ROOM);
        let tie = Seen {
            column: State {
                driven: [0.1, -0.2, 0.3, 0.01, -0.02],
                drivers: core::array::from_fn(|k| 1e-4 * (k as f32 - 5.0)),
            },
            variance: 7.0,
        };
        covariance.update(&tie, &Seen::NOTHING);
        let [first, second] = [seen(&covariance, 0), seen(&covariance, VELOCITY)];
        let mut one_by_one = covariance.clone();
        one_by_one.update(&first, &Seen::NOTHING);
        one_by_one.update(&second, &Seen::NOTHING);
        covariance.update(&first, &second);
        assert_eq!(covariance, one_by_one);
        let matrix = covariance.matrix();
        assert_eq!(matrix, matrix.transpose());
    }
}
