//! Cases that are wrong in one place, and the file and key their errors name.

use std::{fs, path::Path};

use super::Subject;

const CASE: &str = r#"format = "gap-case/1"
name = "small"
kind = "csv"
unit = "unit.toml"
measured = "measured.csv"
motion = "motion.csv"
[environment]
gravity_m_s2 = 9.8
latitude_deg = 0.0
field_n_ut = [20.0, 0.0, 10.0]
[windows]
fit = [[0.0, 3.0]]
hold = [[3.0, 6.0]]
"#;

const UNIT: &str = r#"name = "one gyro"
[[channel]]
name = "gz"
sensor = "gyro"
group = "unit"
axis_b = [0.0, 0.0, 1.0]
lsb = 1.0
noise_sigma = 0.01
bias_sigma = 0.01
range = [-5.0, 5.0]
"#;

/// Six seconds at 10 Hz, one cell empty and one at the end of the range.
fn measured() -> String {
    let row = |k: usize| match k {
        7 => "0.7,\n".to_owned(),
        9 => "0.9,5.0\n".to_owned(),
        _ => format!("{:.1},{:.3}\n", k as f64 / 10.0, 0.001 * (k % 3) as f64),
    };
    format!("t_s,gz\n{}", (0..60).map(row).collect::<String>())
}

fn motion(seconds: usize) -> String {
    let rows = (0..=10 * seconds).map(|k| format!("{:.1},1,0,0,0\n", k as f64 / 10.0));
    format!("t_s,qw,qx,qy,qz\n{}", rows.collect::<String>())
}

/// The case with one file changed.
fn opened(file: &str, text: Option<&str>) -> Result<Subject, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a file");
    put("case.toml", CASE);
    put("unit.toml", UNIT);
    put("measured.csv", &measured());
    put("motion.csv", &motion(6));
    match text {
        Some(text) => put(file, text),
        None => fs::remove_file(folder.path().join(file)).expect("removed"),
    }
    Subject::open(folder.path()).map_err(|error| error.to_string())
}

fn check(file: &str, text: Option<&str>, words: &[&str]) {
    let error = opened(file, text).err().expect("an error");
    for word in words {
        assert!(error.contains(word), "{word:?} is not in {error:?}");
    }
}

#[test]
fn a_whole_case_opens_and_counts_what_it_leaves_out() {
    let subject = opened("case.toml", Some(CASE)).expect("opens");
    assert_eq!(subject.fit.channels[0].rows.len(), 28);
    assert_eq!(subject.held.counts(), [30]);
    assert_eq!((subject.masked[0].missing, subject.masked[0].clipped), (1, 1));
}

#[test]
fn a_missing_file_is_named() {
    for file in ["unit.toml", "measured.csv", "motion.csv"] {
        check(file, None, &[file]);
    }
    let nowhere = Subject::open(Path::new("/nonexistent/case")).err().expect("an error");
    assert!(nowhere.to_string().contains("/nonexistent/case"));
}

#[test]
fn a_wrong_key_is_named_with_its_file() {
    check(
        "case.toml",
        Some(&CASE.replace("gap-case/1", "gap-case/9")),
        &["case.toml", "format"],
    );
    check(
        "case.toml",
        Some(&CASE.replace("kind = \"csv\"\n", "")),
        &["case.toml", "kind"],
    );
    check(
        "case.toml",
        Some(&CASE.replace("latitude_deg = 0.0\n", "")),
        &["environment.latitude_deg", "gyros"],
    );
    check(
        "case.toml",
        Some(&CASE.replace("latitude_deg = 0.0", "latitude_deg = 900.0")),
        &["environment.latitude_deg"],
    );
}

#[test]
fn windows_that_overlap_or_hold_nothing_are_refused() {
    check(
        "case.toml",
        Some(&CASE.replace("[[3.0, 6.0]]", "[[2.0, 6.0]]")),
        &["windows", "overlap"],
    );
    check(
        "case.toml",
        Some(&CASE.replace("[[3.0, 6.0]]", "[]")),
        &["windows.hold", "empty"],
    );
    let without = CASE.split("[windows]").next().unwrap_or_default();
    check("case.toml", Some(without), &["windows", "absent"]);
    check(
        "case.toml",
        Some(&CASE.replace("[[3.0, 6.0]]", "[[30.0, 60.0]]")),
        &["windows.hold", "no sample"],
    );
}

#[test]
fn a_motion_that_ends_before_the_log_is_refused() {
    check("motion.csv", Some(&motion(4)), &["motion.csv", "t_s", "windows"]);
}

#[test]
fn clocks_that_never_meet_are_refused() {
    let later = motion(6)
        .replace("t_s", "T")
        .replace('\n', "\n100")
        .replace("T,", "t_s,");
    let later = later.trim_end_matches("100");
    check(
        "motion.csv",
        Some(later),
        &["motion.csv", "t_s", "runs from 100", "0 %"],
    );
}

#[test]
fn a_channel_that_packets_do_not_have_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a file");
    put("case.toml", &CASE.replace("\"csv\"", "\"packets\""));
    put("unit.toml", &UNIT.replace("[[channel]]", "cycle_s = 0.2\n[[channel]]"));
    put("measured.csv", "");
    put("motion.csv", &motion(6));
    let error = Subject::open(folder.path()).err().expect("an error").to_string();
    assert!(
        error.contains("measured.csv") && error.contains("gz") && error.contains("packets"),
        "{error}"
    );
}

#[test]
fn an_unknown_unit_of_measure_or_key_of_the_unit_is_named() {
    check(
        "unit.toml",
        Some(&UNIT.replace("noise_sigma", "noise_sigma_dps")),
        &["unit.toml", "noise_sigma_dps"],
    );
    check(
        "unit.toml",
        Some(&UNIT.replace("\"gyro\"", "\"barometer\"")),
        &["unit.toml", "barometer"],
    );
}

#[test]
fn channels_and_columns_must_be_the_same() {
    check(
        "measured.csv",
        Some(&measured().replace("t_s,gz", "t_s,gx")),
        &["measured.csv", "gz"],
    );
    check(
        "unit.toml",
        Some(&UNIT.replace("noise_sigma = 0.01", "noise_sigma = -1.0")),
        &["unit.toml", "noise_sigma"],
    );
    check("case.toml", Some(&CASE.replace("\"csv\"", "\"packets\"")), &["cycle_s"]);
}

#[test]
fn a_cell_that_is_no_number_is_named_by_line_and_column() {
    check(
        "measured.csv",
        Some(&measured().replace("0.3,0.000", "0.3,abc")),
        &["measured.csv", "line 5", "gz", "abc"],
    );
    check(
        "measured.csv",
        Some(&measured().replace("0.3,0.000", "0.1,0.000")),
        &["line 5", "t_s"],
    );
}

/// The case with lines added to its environment, and tables to its end.
fn with(environment: &str, tables: &str) -> String {
    CASE.replace("[windows]", &format!("{environment}\n[windows]")) + tables
}

#[test]
fn slow_errors_and_bars_are_read_or_have_the_usual_values() {
    let usual = opened("case.toml", Some(CASE)).expect("opens");
    assert_eq!((usual.bars.attitude_deg, usual.bars.gap_sigma), (0.5, 0.05));
    // What is exact errs by nothing.
    assert_eq!(usual.slow.attitude_sigma_rad, 0.0);
    assert_eq!(
        (usual.slow.field_wander_sigma_ut, usual.slow.field_sigma_ut),
        (0.0, 0.0)
    );
    let room = opened("case.toml", Some(&with("field_sigma_ut = 0.8", ""))).expect("opens");
    assert_eq!(
        (room.slow.field_wander_sigma_ut, room.slow.field_correlation_s),
        (0.15, 10.0)
    );
    assert_eq!(
        (room.slow.field_sigma_ut, room.slow.field_gradient_sigma_ut_m),
        (0.8, None)
    );
    assert_eq!(room.slow.attitude_correlation_s, 20.0);
    let stated = with(
        "field_wander_sigma_ut = 0.4\nfield_correlation_s = 7.0\nfield_gradient_sigma_ut_m = 0.2",
        "[reference]\nattitude_sigma_rad = 0.004\nattitude_correlation_s = 9.0\n[matters]\nattitude_deg = 2.0\ngap_sigma = 0.3\n",
    );
    let stated = opened("case.toml", Some(&stated)).expect("opens");
    let slow = stated.slow;
    assert_eq!((slow.attitude_sigma_rad, slow.attitude_correlation_s), (0.004, 9.0));
    assert_eq!((slow.field_wander_sigma_ut, slow.field_correlation_s), (0.4, 7.0));
    assert_eq!(slow.field_gradient_sigma_ut_m, Some(0.2));
    assert_eq!((stated.bars.attitude_deg, stated.bars.gap_sigma), (2.0, 0.3));
}

#[test]
fn slow_errors_and_bars_that_cannot_be_are_refused_by_name() {
    let of_environment = [
        ("field_wander_sigma_ut", "-0.1"),
        ("field_wander_sigma_ut", "nan"),
        ("field_correlation_s", "0.0"),
        ("field_correlation_s", "inf"),
        ("field_gradient_sigma_ut_m", "1e6"),
    ];
    for (key, value) in of_environment {
        let text = with(&format!("{key} = {value}"), "");
        check(
            "case.toml",
            Some(&text),
            &["case.toml", &format!("environment.{key}"), "must be"],
        );
    }
    let of_tables = [
        ("reference", "attitude_sigma_rad", "4.0"),
        ("reference", "position_sigma_m", "-1.0"),
        ("reference", "attitude_correlation_s", "-20.0"),
        ("matters", "attitude_deg", "0.0"),
        ("matters", "gap_sigma", "nan"),
    ];
    for (table, key, value) in of_tables {
        let text = with("", &format!("[{table}]\n{key} = {value}\n"));
        check(
            "case.toml",
            Some(&text),
            &["case.toml", &format!("{table}.{key}"), "must be"],
        );
    }
}
