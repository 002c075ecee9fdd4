//! Drivers, one part a file: bytes on a bus to counts. Registers are named as in the datasheets.
