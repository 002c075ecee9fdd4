//! Step 3, what may be wrong: every effect of the twin's library at every place of this unit, as columns.
//!
//! In: the problem. Out: [`hypotheses::Library`], hypotheses with prior odds, and the inner [`products`] of their columns, each
//! made when it is first asked for.

pub mod column;
pub mod hypotheses;
pub mod products;
