//! What can be wrong with a file of numbers, where, and what to do about it.

use thiserror::Error;

/// A file that cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{file}: {fault}")]
pub struct FileError {
    /// The file as it was named.
    pub file: String,
    /// What is wrong with it.
    pub fault: Fault,
}

/// What is wrong. Lines count from 1, which is the header; in a `.gz` they are those of the text inside.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Fault {
    /// The operating system refuses it.
    #[error("cannot be read ({reason}); check its path and permissions")]
    Unreadable {
        /// As the system puts it.
        reason: String,
    },
    /// The gzip stream is cut off or corrupt.
    #[error("the gzip data ends or breaks after line {line}; fetch the file again")]
    DamagedGzip {
        /// The last line that came out whole.
        line: u64,
    },
    /// A line has more or fewer cells than the header.
    #[error("line {line} has {found} cells where the header has {expected}; complete it or delete it")]
    RaggedLine {
        /// Where.
        line: u64,
        /// Cells in the line.
        found: usize,
        /// Cells in the header.
        expected: usize,
    },
    /// A column that must be there is not.
    #[error("line 1 names no column {column}; name it in the header, which must have {needed}")]
    MissingColumn {
        /// Its name.
        column: String,
        /// It and the columns that belong to it.
        needed: String,
    },
    /// A column appears twice.
    #[error("line 1 names column {column} twice; rename or delete one of them")]
    RepeatedColumn {
        /// Its name.
        column: String,
    },
    /// A cell is not a number.
    #[error(
        "line {line}, column {column}: \"{text}\" is not a number; write one, or leave the cell empty for no sample"
    )]
    NotANumber {
        /// Where.
        line: u64,
        /// Where.
        column: String,
        /// The cell, at most its first 32 bytes.
        text: String,
    },
    /// A cell is NaN or infinite.
    #[error("line {line}, column {column}: \"{text}\" is not finite; leave the cell empty for no sample")]
    NotFinite {
        /// Where.
        line: u64,
        /// Where.
        column: String,
        /// The cell, at most its first 32 bytes.
        text: String,
    },
    /// A number that no sensor and no clock gives.
    #[error("line {line}, column {column}: \"{text}\" is beyond {most:e}; check its unit")]
    Beyond {
        /// Where.
        line: u64,
        /// Where.
        column: String,
        /// The cell, at most its first 32 bytes.
        text: String,
        /// The largest magnitude.
        most: f64,
    },
    /// A slope that no number holds.
    #[error("line {line}: its time is too near its neighbours' for a slope; delete one of them")]
    TooSteep {
        /// Where.
        line: u64,
    },
    /// A line without a time.
    #[error("line {line}, column t_s is empty; every line needs its time")]
    NoTime {
        /// Where.
        line: u64,
    },
    /// Time stands still or goes back.
    #[error(
        "line {line}, column t_s: {t_s} does not come after {previous_s}; sort the lines by time and delete repeats"
    )]
    TimeNotIncreasing {
        /// Where.
        line: u64,
        /// \[s\] the time there.
        t_s: f64,
        /// \[s\] the time in the line before.
        previous_s: f64,
    },
    /// Some but not all cells of one vector or quaternion are empty.
    #[error("line {line}: {columns} are empty in part; fill all of them, or leave all empty for no sample")]
    PartlyEmpty {
        /// Where.
        line: u64,
        /// The columns that belong together.
        columns: String,
    },
    /// Nothing to interpolate.
    #[error("{found} lines have {columns}; at least 2 are needed")]
    TooFewSamples {
        /// The columns that belong together.
        columns: String,
        /// Lines in which they are filled.
        found: usize,
    },
    /// More than fits.
    #[error("has more than {rows} lines or {bytes} bytes, or a line of more than 64 KiB; cut it into pieces")]
    TooLong {
        /// Most lines that are read.
        rows: usize,
        /// Most bytes that are read, after decompression.
        bytes: u64,
    },
    /// A gzip file that grows as no recording does.
    #[error("unpacks to more than {ratio} times its size; if it is a recording, unpack it with gzip -d")]
    GzipBomb {
        /// Most unpacked bytes for one of the file.
        ratio: u64,
    },
    /// A quaternion that is no attitude.
    #[error("line {line}: the norm of qw,qx,qy,qz is {norm}; an attitude has norm 1")]
    NotAnAttitude {
        /// Where.
        line: u64,
        /// What it is.
        norm: f64,
    },
    /// Too coarse to tell which way it turned.
    #[error("line {line}: turned by {degrees:.0} deg since the attitude before; record at least every 120 deg")]
    TooCoarse {
        /// Where.
        line: u64,
        /// \[deg\] between the neighbours.
        degrees: f64,
    },
    /// A window that leaves nothing.
    #[error("{from_s} to {to_s} s leaves nothing of it; it lasts from {first_s} to {last_s} s")]
    EmptyWindow {
        /// \[s\] begin of the window.
        from_s: f64,
        /// \[s\] its end.
        to_s: f64,
        /// \[s\] first sample.
        first_s: f64,
        /// \[s\] last sample.
        last_s: f64,
    },
}
