//! Attitude from a log: the methods on recorded data, beside a reference and beside peers.
