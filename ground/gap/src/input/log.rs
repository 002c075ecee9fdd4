//! What a unit logged: per channel the samples that are there, in physical units, and a count of those that are not.
//!
//! Rows are cycles, found by the packet's counter and never by its place in the file (a lost packet is a hole in time,
//! not a shift of it). A sample is left out when its packet is lost, when the unit says it was not read, and when it
//! stands at the end of its range: a clipped value says no more than "beyond".

/// What the log's reader must know of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its name in packets, headers and verdicts.
    pub name: String,
    /// Physical units a count.
    pub lsb: f64,
    /// What it measures.
    pub sensor: twin::predict::Kind,
    /// Physical units that the description adds.
    pub bias: f64,
    /// Physical units, beyond which it clips.
    pub range: [f64; 2],
    /// Counts at which its code ends, where it has any.
    pub code_range: Option<[i64; 2]>,
    /// Counts it sends instead of a value (the HMC5883L's overflow).
    pub overflow_counts: Option<i16>,
}

impl Column {
    /// Whether a value stands at an end of the channel's range or of its code.
    fn is_clipped(&self, value: f64) -> bool {
        let [mut low, mut high] = self.range;
        if let Some([least, most]) = self.code_range {
            low = low.max(least as f64 * self.lsb);
            high = high.min(most as f64 * self.lsb);
        }
        // A clipped value is rounded to the nearest count, which may lie just inside.
        let margin = if self.code_range.is_some() { 0.5 * self.lsb } else { 0.0 };
        value <= low + margin || value >= high - margin
    }
}

/// Samples that were left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Masked {
    /// The unit says it was not read, or the cell is empty.
    pub missing: usize,
    /// At the end of the range.
    pub clipped: usize,
}

/// One channel's samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Rows of the log, rising.
    pub rows: Vec<u32>,
    /// Physical units, one a row.
    pub values: Vec<f64>,
}

impl Series {
    /// The part of it whose rows are wanted.
    pub fn only(&self, wanted: impl Fn(usize) -> bool) -> Series {
        let kept = self
            .rows
            .iter()
            .zip(&self.values)
            .filter(|(row, _)| wanted(**row as usize));
        let (rows, values) = kept.map(|(row, value)| (*row, *value)).unzip();
        Series { rows, values }
    }
}

/// What happened to the stream, as opposed to its values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stream {
    /// Packets the counter says were sent and that did not come.
    pub lost: u64,
    /// Packets with the counter of the one before.
    pub repeated: u64,
    /// Counters that tell nothing about how much later they are.
    pub jumps: u64,
    /// Stretches of bytes that are no packet.
    pub rejected: u64,
}

/// A whole log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// \[s\] start of each row's cycle, rising.
    pub start_s: Vec<f64>,
    /// In the unit's channel order.
    pub channels: Vec<Series>,
    /// What was left out of each channel.
    pub masked: Vec<Masked>,
    /// What happened to the stream.
    pub stream: Stream,
}

impl Log {
    /// The same without the samples of some channels.
    pub fn without(&self, channels: &[usize]) -> Log {
        let mut others = self.clone();
        for channel in channels {
            others.channels[*channel] = Series::default();
        }
        others
    }

    /// A log without rows for so many channels.
    pub fn empty(channels: usize) -> Self {
        Log {
            start_s: Vec::new(),
            channels: vec![Series::default(); channels],
            masked: vec![Masked::default(); channels],
            stream: Stream::default(),
        }
    }

    /// Begins a row.
    pub fn begin_row(&mut self, start_s: f64) {
        self.start_s.push(start_s);
    }

    /// Puts a value, or its absence, into the row begun last.
    pub fn put(&mut self, channel: usize, column: &Column, value: Option<f64>) {
        let Some(row) = self.start_s.len().checked_sub(1) else {
            return;
        };
        let (Some(series), Some(masked)) = (self.channels.get_mut(channel), self.masked.get_mut(channel)) else {
            return;
        };
        match value {
            None => masked.missing += 1,
            Some(value) if column.is_clipped(value) => masked.clipped += 1,
            Some(value) => {
                series.rows.push(row as u32);
                series.values.push(value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gyro() -> Column {
        Column {
            sensor: twin::predict::Kind::Accelerometer,
            bias: 0.0,
            name: "g1".to_owned(),
            lsb: 0.001,
            range: [-5.0, 5.0],
            code_range: Some([-8192, 8191]),
            overflow_counts: None,
        }
    }

    #[test]
    fn a_value_at_the_end_of_the_range_is_counted_not_kept() {
        let mut log = Log::empty(1);
        for (start_s, value) in [(0.0, Some(4.999)), (0.2, Some(5.0)), (0.4, None), (0.6, Some(-5.0))] {
            log.begin_row(start_s);
            log.put(0, &gyro(), value);
        }
        assert_eq!(log.channels[0].rows, [0]);
        assert_eq!(log.masked[0], Masked { missing: 1, clipped: 2 });
    }

    #[test]
    fn the_end_of_the_code_clips_where_it_comes_before_the_range() {
        let narrow = Column {
            code_range: Some([-2048, 2047]),
            ..gyro()
        };
        let mut log = Log::empty(1);
        log.begin_row(0.0);
        log.put(0, &narrow, Some(2.047));
        assert_eq!(log.masked[0].clipped, 1);
    }
}
