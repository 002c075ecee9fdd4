//! The commands as a laboratory uses them: files in, report, set, page and unit file out.

mod seeds;

use std::path::Path;

use bench::{
    allan::{self, AllanError},
    calibrate::{self, CalibrateError},
    calibration,
    design::command as design,
    set::Set,
};
use clap::{Args, FromArgMatches};

/// Words as on the command line; blanks separate.
fn parse<T: Args + FromArgMatches>(words: &str) -> T {
    let command = T::augment_args(clap::Command::new("test").no_binary_name(true));
    let matches = command.try_get_matches_from(words.split(' ')).expect("words");
    T::from_arg_matches(&matches).expect("arguments")
}

fn calibrate(words: &str) -> Result<(), CalibrateError> {
    calibrate::run(&parse(words))
}

fn calibration(words: &str) -> Result<(), CalibrateError> {
    calibration::run(&parse(words))
}

fn write(place: &Path, name: &str, bytes: &[u8]) -> String {
    let file = place.join(name);
    std::fs::write(&file, bytes).expect("write");
    file.display().to_string()
}

const UNIT: &str = "name = \"two\"\ncycle_s = 0.2\n\
    [[channel]]\nname = \"g1\"\nsensor = \"gyro\"\naxis_b = [0.6, 0.0, 0.8]\nlsb = 0.00125\nnoise_sigma = 0.003\nrange = [-5.6, 5.6]\n\
    [[channel]]\nname = \"g2\"\nsensor = \"gyro\"\naxis_b = [0.0, 1.0, 0.0]\nlsb = 0.00125\nnoise_sigma = 0.003\nrange = [-5.6, 5.6]\n\
    [[channel]]\nname = \"g3\"\nsensor = \"gyro\"\naxis_b = [1.0, 0.0, 0.0]\nlsb = 0.00125\nnoise_sigma = 0.003\nrange = [-5.6, 5.6]\n";

/// A plan's rows with what three gyros of 800 counts per rad/s put out, as a Brazilian spreadsheet would write them.
fn filled(plan: &str, bias: f64) -> Vec<u8> {
    let axes = [[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]];
    let mut text = "posi\u{e7}\u{e3}o;seq;inner_deg;outer_deg;turning;rate_deg_s;g1;g2;g3\r\n".to_string();
    for (k, line) in plan.lines().skip(1).enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |k: usize| cells[k].parse::<f64>().expect("number");
        let (sin, cos) = number(1).to_radians().sin_cos();
        let axis_b = if cells[3] == "inner" {
            [0.0, 0.0, 1.0]
        } else {
            [sin, cos, 0.0]
        };
        let rate = number(4).to_radians();
        let ripple = |channel: usize| ((7 * k + 3 * channel) as f64).sin();
        let output = |channel: usize| {
            let along: f64 = (0..3).map(|axis| axes[channel][axis] * axis_b[axis]).sum();
            format!("{:.3}", 800.0 * along * rate + bias + ripple(channel)).replace('.', ",")
        };
        let cells: Vec<String> = cells.iter().map(|cell| cell.replace('.', ",")).collect();
        text += &format!("x;{};{};{};{}\r\n", cells.join(";"), output(0), output(1), output(2));
    }
    // Latin-1.
    text.chars()
        .map(|letter| u8::try_from(u32::from(letter)).expect("Latin-1"))
        .collect()
}

#[test]
fn plan_run_calibrate_compare_and_hand_to_the_twin() {
    let place = tempfile::tempdir().expect("temporary folder");
    let unit = write(place.path(), "unit.toml", UNIT.as_bytes());
    let path = |name: &str| place.path().join(name).display().to_string();
    let plan = path("plan.csv");
    design::run(&parse(&format!("gyros --unit {unit} --minutes 30 --out {plan}"))).expect("plan");
    let plan = std::fs::read_to_string(plan).expect("plan");
    for (name, bias) in [("monday", -12.5), ("friday", -9.5)] {
        let run = write(place.path(), &format!("{name}.csv"), &filled(&plan, bias));
        let (set, page) = (path(&format!("{name}.toml")), path(&format!("{name}.html")));
        let words =
            format!("rate-table {run} --channels g1,g2,g3 --unit {unit} --set {set} --page {page} --part ADIS16265");
        calibrate(&words).expect("good");
        assert!(std::fs::read_to_string(page).expect("page").contains("<svg"));
    }
    let monday = Set::parse(&std::fs::read_to_string(path("monday.toml")).expect("set")).expect("set");
    assert_eq!(monday.channels.len(), 3);
    assert!((monday.channels[0].sensitivity().norm() - 800.0).abs() < 0.2);
    assert!((monday.channels[0].bias_counts[0] + 12.5).abs() < 0.5);
    assert_eq!(
        (monday.sources[0].file.as_str(), monday.sources[0].sha256.len()),
        ("monday.csv", 64)
    );
    // Three counts of bias are many sigmas, so comparing says so; comparing with itself does not.
    let differs = calibration(&format!("diff {} {}", path("monday.toml"), path("friday.toml")));
    assert!(matches!(differs, Err(CalibrateError::NotGood)));
    calibration(&format!("diff {0} {0}", path("monday.toml"))).expect("the same");
    calibration(&format!(
        "unit {} --unit {unit} --out {}",
        path("monday.toml"),
        path("twin.toml")
    ))
    .expect("unit");
    let twin: toml::Table = std::fs::read_to_string(path("twin.toml"))
        .expect("unit")
        .parse()
        .expect("toml");
    let lsb = twin["channel"][1]["lsb"].as_float().expect("lsb");
    assert!((800.0 * lsb - 1.0).abs() < 1e-3);
}

#[test]
fn a_wrong_sign_in_the_table_never_becomes_a_quiet_matrix() {
    let place = tempfile::tempdir().expect("temporary folder");
    let unit = write(place.path(), "unit.toml", UNIT.as_bytes());
    let plan = place.path().join("plan.csv").display().to_string();
    design::run(&parse(&format!("gyros --unit {unit} --minutes 30 --out {plan}"))).expect("plan");
    let plan = std::fs::read_to_string(&plan).expect("plan");
    let turned = plan.replacen(",200.000", ",-200.000", 1);
    // Filled in with what the gyros said at the right sign.
    let honest = String::from_utf8_lossy(&filled(&plan, 0.0)).into_owned();
    let wrong = String::from_utf8_lossy(&filled(&turned, 0.0)).into_owned();
    let line = 1;
    let mut lines: Vec<&str> = honest.lines().collect();
    let outputs = lines[line].rsplitn(4, ';').take(3).collect::<Vec<_>>();
    let claim = wrong
        .lines()
        .nth(line)
        .expect("line")
        .rsplitn(4, ';')
        .last()
        .expect("claim")
        .to_string();
    let merged = format!("{claim};{};{};{}", outputs[2], outputs[1], outputs[0]);
    lines[line] = &merged;
    let run = write(place.path(), "run.csv", lines.join("\n").as_bytes());
    for way in ["leave-out", "correct", "keep"] {
        let words = format!("rate-table {run} --channels g1,g2,g3 --contradicted {way}");
        assert!(matches!(calibrate(&words), Err(CalibrateError::NotGood)), "{way}");
    }
}

#[test]
fn table_7_4_is_called_not_good_from_its_file() {
    let [table, unit] = ["table.csv", "unit.toml"].map(|name| seeds::file("cases/siqueira-table-7-4").join(name));
    let words = format!(
        "rate-table {} --unit {} --mount siqueira --contradicted correct",
        table.display(),
        unit.display()
    );
    assert!(matches!(calibrate(&words), Err(CalibrateError::NotGood)));
}

#[test]
fn what_cannot_be_read_is_named() {
    let place = tempfile::tempdir().expect("temporary folder");
    let flat = write(
        place.path(),
        "flat.csv",
        b"wx_deg_s,wy_deg_s,wz_deg_s,g1,g1_n\n1,0,0,5,9\n-1,0,0,6,9\n0,1,0,7,9\n0,-1,0,8,9\n0,0,0,8,9\n",
    );
    let error = calibrate(&format!("rate-table {flat}")).expect_err("no z").to_string();
    assert!(
        error.contains("flat.csv, column g1: not determined: excitation along z is missing"),
        "{error}"
    );
    let log = write(place.path(), "log.csv", b"m1x,m1y,m1z\n1,2,3\n4,5,6\n");
    let error = calibrate(&format!("ellipsoid {log} --channels m1x,m1y,m1z --strength 23"))
        .expect_err("few")
        .to_string();
    assert!(
        error.contains("log.csv: nine parameters need at least ten points"),
        "{error}"
    );
    let error = calibrate(&format!("rate-table {}/none.csv", place.path().display()))
        .expect_err("none")
        .to_string();
    assert!(error.contains("none.csv: cannot be read"), "{error}");
}

#[test]
fn every_hold_of_a_recorded_log_is_found_once_and_no_movement_is_taken_for_one() {
    let (log, motion) = (
        seeds::file("practice/P14/measured.txt.gz"),
        seeds::table("motion/positions-26.csv.gz"),
    );
    let names: Vec<String> = ["a1x", "a1y", "a1z", "a2x", "a4z", "g1", "g2", "g3", "g4"]
        .map(String::from)
        .to_vec();
    let (samples, _) = bench::log::samples(&log, &names).expect("packets");
    let found = bench::stretches::still(&samples, 20);
    let attitude = seeds::numbers(&motion, &["qw", "qx", "qy", "qz"]);
    // Motion at 100 Hz, packets at 5.
    let turned_deg = |a: usize, b: usize| {
        let end = attitude.len() - 1;
        let (a, b) = (&attitude[(20 * a).min(end)], &attitude[(20 * b).min(end)]);
        let dot: f64 = (0..4).map(|k| a[k] * b[k]).sum();
        2.0 * dot.abs().min(1.0).acos().to_degrees()
    };
    for stretch in &found {
        for cycle in stretch.from..stretch.to {
            let turned_deg = turned_deg(stretch.from, cycle);
            assert!(
                turned_deg < 0.5,
                "cycles {}..{} turn by {turned_deg} deg",
                stretch.from,
                stretch.to
            );
        }
    }
    let (mut holds, mut from) = (0, 0);
    for cycle in 0..samples.len() {
        if turned_deg(cycle, cycle + 1) > 0.05 || cycle + 1 == samples.len() {
            if cycle - from >= 30 {
                holds += 1;
                let within = |stretch: &&bench::stretches::Stretch| stretch.from < cycle && stretch.to > from;
                assert_eq!(found.iter().filter(within).count(), 1, "hold of cycles {from}..{cycle}");
            }
            from = cycle + 1;
        }
    }
    assert_eq!(holds, 39, "26 positions, and those after the rolling");
}

#[test]
fn a_record_that_moves_is_not_good_and_one_at_rest_is() {
    let place = tempfile::tempdir().expect("temporary folder");
    // A fixed sequence that looks like noise: fractions of the multiples of the golden ratio, three to a sample.
    let noise = |k: usize| -> f64 {
        let fraction = |n: usize| (n as f64 * 0.618_033_988_749_895).fract() - 0.5;
        fraction(7 * k + 1) + fraction(13 * k * k + 5) + fraction(31 * k * k * k % 99_991)
    };
    let table = |name: &str, also: &dyn Fn(f64) -> f64| {
        let rows: String = (0..2000)
            .map(|k| format!("{}\n", noise(k) + also(0.2 * k as f64)))
            .collect();
        write(place.path(), name, format!("g1\n{rows}").as_bytes())
    };
    let out = place.path().join("report").display().to_string();
    let run = |file: &str| allan::run(&parse(&format!("{file} --rate-hz 5 --out {out}")));
    assert!(run(&table("rest.csv", &|_| 0.0)).is_ok());
    let moves = table("moves.csv", &|t_s| 10.0 * (t_s / 3.0).sin());
    assert!(matches!(run(&moves), Err(AllanError::NotGood)));
    let page = std::fs::read_to_string(place.path().join("report/index.html")).expect("a page all the same");
    assert!(page.contains("the record moves") && page.contains("(sample "));
}
