//! Step 10, the report: the verdict as a file, on a screen, and as a page.
//!
//! In: a finished [`crate::diagnose::Diagnosis`]. Out: `verdict.json` ([`verdict`]), a screen of text ([`terminal`]) and an HTML
//! page with plots ([`page`]). Nothing is decided here.

pub mod page;
pub mod terminal;
pub mod verdict;
