//! The bench: calibrates the unit and measures its noise.
