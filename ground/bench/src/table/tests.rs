use super::*;

fn parse(bytes: &[u8]) -> Result<Table, TableError> {
    Table::parse(Path::new("log.csv"), bytes)
}

fn numbers(table: &Table) -> Vec<Vec<Option<f64>>> {
    let number = |row, column| table.number(row, column).expect("number");
    let read = |row| (0..table.columns.len()).map(|column| number(row, column)).collect();
    table.rows.iter().map(read).collect()
}

#[test]
fn points_and_commas_give_the_same_numbers() {
    let point = parse(b"g1,g2\n0.5,-2e-3\n3,\n").expect("points");
    let comma = parse(b"g1;g2\r\n0,5;-2e-3\r\n3;\r\n").expect("commas");
    assert_eq!(numbers(&point), numbers(&comma));
    assert_eq!(numbers(&point), [[Some(0.5), Some(-2e-3)], [Some(3.0), None]]);
}

#[test]
fn a_labview_file_says_its_own_separators() {
    let text = b"LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\n***End_of_Header***\t\nChannels\t1\n\
        ***End_of_Header***\t\nX_Value\tg1\tComment\n0,000000\t-3,5\n0,100000\t1234\tpasso\n";
    let table = parse(text).expect("lvm");
    assert_eq!(table.columns, ["X_Value", "g1", "Comment"]);
    assert_eq!(table.required(&table.rows[0], 1), Ok(-3.5));
    assert_eq!((table.rows[1].line, table.required(&table.rows[1], 0)), (9, Ok(0.1)));
}

#[test]
fn latin_1_names_are_read() {
    let table = parse(b"posi\xE7\xE3o;giro (\xB0/s)\n1;200,5\n").expect("latin-1");
    assert_eq!(table.columns, ["posição", "giro (°/s)"]);
}

#[test]
fn a_decimal_comma_between_separating_commas_is_refused_with_its_line() {
    let error = parse(b"g1,g2\n0,5,1\n").expect_err("ambiguous");
    assert_eq!(error.line, 2);
    assert!(error.to_string().contains("decimal commas"), "{error}");
}

#[test]
fn mixed_marks_and_thousands_are_refused_with_line_and_column() {
    let mixed = parse(b"g1;g2\n0,5;1\n0,7;1.5\n").expect_err("mixed");
    assert_eq!((mixed.line, mixed.column.as_str()), (3, "g2"));
    let table = parse(b"g1;g2\n0,5;1.234,5\n").expect("read on demand");
    let error = table.required(&table.rows[0], 1).expect_err("thousands");
    assert_eq!((error.line, error.column.as_str()), (2, "g2"));
}

#[test]
fn headless_ragged_and_doubly_named_files_are_refused() {
    for (bytes, why) in [
        (b"".as_slice(), "no line of column names"),
        (b"1;2\n3;4\n", "must name the columns"),
        (b"a;A\n1;2\n", "two columns"),
        (b"a;b\n1;2;3\n", "has 3 cells"),
        (b"a;b\n1\n", "has 1 cells"),
    ] {
        let error = parse(bytes).expect_err("refused").to_string();
        assert!(error.contains(why), "{error}");
    }
}

#[test]
fn any_bytes_are_read_or_refused() {
    for seed in 0_u32..300 {
        let mix = |k: u32| {
            (seed
                .wrapping_mul(2_654_435_761)
                .rotate_left(k % 31)
                .wrapping_add(k * 97)) as u8
        };
        let bytes: Vec<u8> = (0..200).map(|k| if k % 7 == 0 { b'\n' } else { mix(k) }).collect();
        if let Ok(table) = parse(&bytes) {
            for row in &table.rows {
                assert_eq!(row.cells.len(), table.columns.len());
                for column in 0..table.columns.len() {
                    let _ = table.number(row, column);
                }
            }
        }
    }
}

#[test]
fn quoted_cells_are_read_as_spreadsheets_write_them() {
    let table = parse(b"\"seq\";\"g1; mean\";\"g \"\"2\"\"\"\n\"pos 1; up\";\"0,5\";-2\n").expect("quoted");
    assert_eq!(table.columns, ["seq", "g1; mean", "g \"2\""]);
    assert_eq!(table.rows[0].cells[0], "pos 1; up");
    assert_eq!(
        (table.required(&table.rows[0], 1), table.required(&table.rows[0], 2)),
        (Ok(0.5), Ok(-2.0))
    );
    // Decimal commas between separating commas can only be told where they are quoted.
    let commas = parse(b"g1,g2\n\"0,5\",\"-1,25\"\n3,4\n").expect("quoted commas");
    assert_eq!(numbers(&commas), [[Some(0.5), Some(-1.25)], [Some(3.0), Some(4.0)]]);
}

#[test]
fn a_quote_that_does_not_end_is_refused_with_its_line() {
    let error = parse(b"a;b\n1;2\n\"3;4\n5\";6\n").expect_err("open");
    assert_eq!(error.line, 3);
    assert!(error.why.contains("quoted"), "{error}");
}
