//! Step 10, the report: the verdict as a file, on a screen, and as a page.
//!
//! In: a finished [`crate::diagnose::Diagnosis`]. Out: `verdict.json` ([`verdict`]), a screen of text ([`terminal`]) and an HTML
//! page with plots ([`page`]). Nothing is decided here.

mod gained;
pub mod page;
mod place_shares;
pub mod plain;
pub mod terminal;
pub mod unit;
pub mod verdict;
