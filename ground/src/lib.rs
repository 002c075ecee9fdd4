//! The ground side as a library.
