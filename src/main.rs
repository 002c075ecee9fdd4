//! The firmware: the unit on the board it was built for.
#![no_std]
#![no_main]
