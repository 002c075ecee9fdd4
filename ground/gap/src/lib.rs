//! The gap between the twin and the unit: where it is, which effect makes it, how far it shrinks.
