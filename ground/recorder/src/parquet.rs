//! Records as a Parquet file, which pandas, polars and the like read with types and empty cells as they are.
//!
//! In: records in order. Out: the columns of [`table::columns`], integers as INT64, numbers as DOUBLE, words as UTF-8
//! strings, all optional (Apache Parquet format 2). Memory does not grow with the number of records: a row group of
//! [`GROUP`] is held at a time. Bits (`health`, `errors`, `sensors`) are integers here, not hexadecimal.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::Path,
    sync::Arc,
};

use emems::flight_log::record::{Entry, Key};
use parquet::{
    basic::{LogicalType, Repetition, Type as Physical},
    data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type},
    errors::ParquetError,
    file::{properties::WriterProperties, writer::SerializedFileWriter},
    schema::types::{Type, TypePtr},
};

use crate::table::{self, Kind, Value};

/// Records of a row group: some 15 MB while it is made.
const GROUP: usize = 8192;

/// Writes these records to a file.
///
/// # Errors
/// When the file cannot be written.
pub fn create<'a>(path: &Path, records: impl Iterator<Item = (&'a Key, &'a Entry)>, si: bool) -> io::Result<()> {
    write(BufWriter::new(File::create(path)?), records, si)
}

/// Writes these records.
///
/// # Errors
/// When the output cannot be written.
pub fn write<'a>(
    out: impl Write + Send,
    records: impl Iterator<Item = (&'a Key, &'a Entry)>,
    si: bool,
) -> io::Result<()> {
    try_write(out, records, si).map_err(io::Error::other)
}

fn try_write<'a>(
    out: impl Write + Send,
    mut records: impl Iterator<Item = (&'a Key, &'a Entry)>,
    si: bool,
) -> Result<(), ParquetError> {
    let columns = table::columns(si);
    let fields = columns.iter().map(field).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("record").with_fields(fields).build()?;
    let properties = WriterProperties::builder().build();
    let mut writer = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    loop {
        let rows: Vec<Vec<Option<Value>>> = (records.by_ref().take(GROUP))
            .map(|(key, entry)| table::values(*key, entry, si))
            .collect();
        if rows.is_empty() {
            break;
        }
        let mut group = writer.next_row_group()?;
        for (index, (_, kind)) in columns.iter().enumerate() {
            let cells = || rows.iter().map(|row| row.get(index).copied().flatten());
            // 1: there is a value; 0: there is none.
            let levels: Vec<i16> = cells().map(|cell| i16::from(cell.is_some())).collect();
            let Some(mut column) = group.next_column()? else { break };
            match kind {
                Kind::Integer => {
                    let values: Vec<i64> = cells().flatten().filter_map(integer).collect();
                    column.typed::<Int64Type>().write_batch(&values, Some(&levels), None)?;
                }
                Kind::Number => {
                    let values: Vec<f64> = cells().flatten().filter_map(number).collect();
                    column.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
                }
                Kind::Word => {
                    let values: Vec<ByteArray> = cells().flatten().filter_map(word).collect();
                    column
                        .typed::<ByteArrayType>()
                        .write_batch(&values, Some(&levels), None)?;
                }
            }
            column.close()?;
        }
        group.close()?;
    }
    writer.close()?;
    Ok(())
}

fn field((name, kind): &(String, Kind)) -> Result<TypePtr, ParquetError> {
    let (physical, logical) = match kind {
        Kind::Integer => (Physical::INT64, None),
        Kind::Number => (Physical::DOUBLE, None),
        Kind::Word => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()
        .map(Arc::new)
}

fn integer(value: Value) -> Option<i64> {
    match value {
        // 63 bits of microseconds are 292,000 years.
        Value::Whole(value) => i64::try_from(value).ok(),
        Value::Bits(bits, _) => Some(bits.into()),
        Value::Counts(counts) => Some(counts.into()),
        Value::Fixed(..) | Value::Real(_) | Value::Word(_) => None,
    }
}

fn number(value: Value) -> Option<f64> {
    match value {
        Value::Fixed(value, _) => Some(value),
        Value::Real(value) => Some(value.into()),
        Value::Whole(_) | Value::Bits(..) | Value::Counts(_) | Value::Word(_) => None,
    }
}

fn word(value: Value) -> Option<ByteArray> {
    match value {
        Value::Word(word) => Some(word.into()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use emems::{
        health::Health,
        packet,
        sample::{NO_SLOT, Reading, SENSOR_COUNT},
    };
    use parquet::{
        file::reader::{FileReader, SerializedFileReader},
        record::Field,
    };

    use super::*;

    fn records(count: u32) -> Vec<(Key, Entry)> {
        let record = |seq| {
            let mut reading = Reading::unread(seq as u16);
            reading.acc_p[0] = [-315, 0, 1];
            let key = Key { epoch: 1, boot: 2, seq };
            let entry = Entry {
                start_us: 200_000 * u64::from(seq),
                packet: packet::encode(&reading),
                slots_us: [NO_SLOT; SENSOR_COUNT],
                flight: seq % 2 == 0,
                health: Health(0x8000_0001),
                estimate: None,
            };
            (key, entry)
        };
        (1..=count).map(record).collect()
    }

    /// Every row as its cells.
    fn read_back(records: &[(Key, Entry)], si: bool) -> Vec<Vec<(String, Field)>> {
        let place = tempfile::tempdir().expect("temporary folder");
        let path = place.path().join("log.parquet");
        create(&path, records.iter().map(|(key, entry)| (key, entry)), si).expect("written");
        let reader = SerializedFileReader::new(File::open(&path).expect("file")).expect("a Parquet file");
        let rows = reader.get_row_iter(None).expect("rows");
        rows.map(|row| row.expect("a row").into_columns()).collect()
    }

    fn cell<'a>(row: &'a [(String, Field)], name: &str) -> &'a Field {
        &row.iter().find(|(other, _)| other == name).expect("a column").1
    }

    #[test]
    fn a_file_reads_back_with_its_types_and_its_empty_cells() {
        let rows = read_back(&records(2), true);
        assert_eq!(rows[0].len(), table::columns(true).len());
        assert_eq!(cell(&rows[1], "seq"), &Field::Long(2));
        assert_eq!(cell(&rows[1], "t_s"), &Field::Double(0.4));
        assert_eq!(cell(&rows[0], "mode"), &Field::Str("WAIT".into()));
        assert_eq!(cell(&rows[0], "health"), &Field::Long(0x8000_0001));
        let Field::Double(force) = cell(&rows[0], "a1x") else {
            panic!("a number");
        };
        assert!((force + 9.267_284).abs() < 1e-6, "{force}");
        assert_eq!(cell(&rows[0], "m1x"), &Field::Null);
        assert_eq!(cell(&rows[0], "q0"), &Field::Null);
        assert_eq!(cell(&read_back(&records(1), false)[0], "a1x"), &Field::Long(-315));
    }

    #[test]
    fn more_records_than_a_row_group_are_all_there_and_none_is_a_file_too() {
        let count = GROUP as u32 + 3;
        let rows = read_back(&records(count), false);
        let seqs: Vec<_> = rows.iter().map(|row| cell(row, "seq").clone()).collect();
        assert_eq!(seqs, (1..=i64::from(count)).map(Field::Long).collect::<Vec<_>>());
        assert_eq!(read_back(&[], true).len(), 0);
    }
}
