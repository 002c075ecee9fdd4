//! `ground`: the one host program.

fn main() {}
