//! The table against literal files, good and bad; each refusal by its full text.

use std::io::{Cursor, Write};

use flate2::Compression;
use flate2::write::GzEncoder;

use super::table::Table;

fn read(text: impl Into<Vec<u8>>) -> Result<Table, String> {
    Table::read(Cursor::new(text.into()), "arm.csv", &["a", "b"]).map_err(|error| error.to_string())
}

fn both(text: &str) -> Result<Vec<(f64, f64, f64)>, String> {
    let located = read(text)?.series(["a", "b"]).map_err(|error| error.to_string())?;
    let samples = located.series.t_s().iter().zip(located.series.values());
    Ok(samples.map(|(&t_s, value)| (t_s, value.x, value.y)).collect())
}

fn gzipped(text: &str) -> Vec<u8> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(text.as_bytes()).unwrap();
    gzip.finish().unwrap()
}

#[test]
fn columns_may_stand_in_any_order_among_others() {
    assert_eq!(
        both("b,note,t_s,a\n1,x,0,2\n3,,0.5,4e1\n"),
        Ok(vec![(0.0, 2.0, 1.0), (0.5, 40.0, 3.0)])
    );
}

#[test]
fn spaces_windows_line_ends_and_blank_lines_do_not_matter() {
    assert_eq!(
        both("t_s, a, b\r\n0, 1, 2\r\n\r\n1, 3, 4\r\n"),
        Ok(vec![(0.0, 1.0, 2.0), (1.0, 3.0, 4.0)])
    );
}

#[test]
fn empty_cells_are_no_sample() {
    assert_eq!(
        both("t_s,a,b\n0,1,2\n1,,\n2,3,4\n"),
        Ok(vec![(0.0, 1.0, 2.0), (2.0, 3.0, 4.0)])
    );
}

#[test]
fn a_gzipped_file_is_known_by_its_bytes() {
    let table = read(gzipped("t_s,a,b\n0,1,2\n1,3,4\n")).unwrap();
    assert_eq!(table.series(["a"]).map(|located| located.series.values()[1].x), Ok(3.0));
}

#[test]
fn each_bad_file_is_refused_with_its_place_and_a_remedy() {
    for (text, message) in [
        (
            "",
            "arm.csv: line 1 names no column t_s; name it in the header, which must have t_s",
        ),
        (
            "t_s,a\n0,1\n1,2\n",
            "arm.csv: line 1 names no column b; name it in the header, which must have a,b",
        ),
        (
            "t_s,a,b,a\n0,1,2,3\n",
            "arm.csv: line 1 names column a twice; rename or delete one of them",
        ),
        (
            "t_s,a,b\n0,1,2\n1,three,4\n",
            "arm.csv: line 3, column a: \"three\" is not a number; write one, or leave the cell empty for no sample",
        ),
        (
            "t_s,a,b\n0,1,NaN\n",
            "arm.csv: line 2, column b: \"NaN\" is not finite; leave the cell empty for no sample",
        ),
        (
            "t_s,a,b\n0,-inf,2\n",
            "arm.csv: line 2, column a: \"-inf\" is not finite; leave the cell empty for no sample",
        ),
        (
            "t_s,a,b\n0,1e300,2\n",
            "arm.csv: line 2, column a: \"1e300\" is beyond 1e15; check its unit",
        ),
        (
            "t_s,a,b\n,1,2\n",
            "arm.csv: line 2, column t_s is empty; every line needs its time",
        ),
        (
            "t_s,a,b\n0,1,2\n1,1,2\n1,1,2\n",
            "arm.csv: line 4, column t_s: 1 does not come after 1; sort the lines by time and delete repeats",
        ),
        (
            "t_s,a,b\n0,1,2\n0.5,1,2\n\n0.25,1,2\n",
            "arm.csv: line 5, column t_s: 0.25 does not come after 0.5; sort the lines by time and delete repeats",
        ),
        (
            "t_s,a,b\n0,1,2\n1,2\n",
            "arm.csv: line 3 has 2 cells where the header has 3; complete it or delete it",
        ),
        (
            "t_s,a,b\n0,1,2\n1,,4\n",
            "arm.csv: line 3: a,b are empty in part; fill all of them, or leave all empty for no sample",
        ),
        ("t_s,a,b\n", "arm.csv: 0 lines have a,b; at least 2 are needed"),
        (
            "t_s,a,b\n0,1,2\n1,,\n",
            "arm.csv: 1 lines have a,b; at least 2 are needed",
        ),
    ] {
        assert_eq!(both(text).unwrap_err(), message);
    }
}

#[test]
fn lines_are_counted_alike_whatever_ends_them() {
    for text in [
        "t_s,a,b\n0,1,2\n\n1,x,2\n",
        "t_s,a,b\r\n0,1,2\r\n\r\n1,x,2\r\n",
        "t_s,a,b\n\n0,1,2\n1,x,2",
    ] {
        let message = read(text).unwrap_err();
        assert!(message.starts_with("arm.csv: line 4, column a: \"x\""), "{message}");
    }
}

#[test]
fn a_cut_off_gzip_is_told_from_a_short_file() {
    let whole = gzipped("t_s,a,b\n0,1,2\n1,3,4\n");
    let cut = read(&whole[..whole.len() - 9]).unwrap_err();
    assert_eq!(
        cut,
        "arm.csv: the gzip data ends or breaks after line 3; fetch the file again"
    );
    let header_only = read(&whole[..5]).unwrap_err();
    assert_eq!(
        header_only,
        "arm.csv: the gzip data ends or breaks after line 0; fetch the file again"
    );
}

/// 512 MiB of empty lines in 0.5 MB; members of a gzip file follow each other, so one of 8 MiB is packed once.
#[test]
fn a_gzip_bomb_is_refused_with_what_to_do() {
    let empty = gzipped(&"\n".repeat(8 << 20)).repeat(64);
    let message = read([gzipped("t_s,a,b\n0,1,2\n"), empty].concat()).unwrap_err();
    assert_eq!(
        message,
        "arm.csv: unpacks to more than 200 times its size; if it is a recording, unpack it with gzip -d"
    );
}

#[test]
fn bytes_that_are_no_text_are_refused_by_line_and_cut_short() {
    let mut text = b"t_s,a,b\n0,1,".to_vec();
    text.extend([0xff; 40]);
    let message = read(text).unwrap_err();
    assert!(
        message.starts_with("arm.csv: line 2, column b: \"\u{fffd}"),
        "{message}"
    );
    assert_eq!(message.matches('\u{fffd}').count(), 32);
}

#[test]
fn a_file_without_end_is_refused() {
    /// "t_s,a,b" and then lines 0, 1, 2 ... for ever.
    struct Endless(u64, Cursor<Vec<u8>>);
    impl std::io::Read for Endless {
        fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
            if self.1.position() == self.1.get_ref().len() as u64 {
                self.1 = Cursor::new(format!("{},1,2\n", self.0).into_bytes());
                self.0 += 1;
            }
            self.1.read(into)
        }
    }
    let endless = Endless(0, Cursor::new(b"t_s,a,b\n".to_vec()));
    let message = Table::read(endless, "endless", &["a", "b"]).unwrap_err().to_string();
    assert_eq!(
        message,
        "endless: has more than 2000000 lines or 512000000 bytes, or a line of more than 64 KiB; cut it into pieces"
    );
}

#[test]
fn a_line_without_end_is_refused() {
    let endless = std::io::Read::chain(Cursor::new(b"t_s,a,b\n0,1,2\n0,1,".to_vec()), std::io::repeat(b'7'));
    let message = Table::read(endless, "endless", &["a", "b"]).unwrap_err().to_string();
    assert!(message.starts_with("endless: has more than"), "{message}");
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let error = Table::open(std::path::Path::new("no/such.csv"), &[])
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("no/such.csv: cannot be read (No such file"),
        "{error}"
    );
    assert!(error.ends_with("check its path and permissions"), "{error}");
}
