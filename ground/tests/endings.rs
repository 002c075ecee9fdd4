//! How the program ends: exit codes, closed pipes, full disks, and what it says of itself.

use std::process::{Command, Output, Stdio};

fn ground(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ground"));
    command.args(words);
    command
}

fn run(words: &[&str]) -> Output {
    ground(words).output().expect("the program runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn bad_input_is_code_2_with_the_reason_and_no_output() {
    let place = tempfile::tempdir().expect("temporary folder");
    let file = |name: &str, bytes: &[u8]| {
        let path = place.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path.display().to_string()
    };
    let page = file("page.html", b"<!doctype html><p>404");
    let have = file("have.csv", b"have");
    for words in [
        &["decode", &page][..],
        &["recover", &page, "--table", &have],
        &["attitude", &page],
        &["decode", &page, "--no-such-option"],
        &["fly", "--image", &page],
        &["fly", "--image", &page, "--host"],
        &["fly", "--host", "--unit", &page],
        &["fly", "--host", "--with", "gyro-scale@z9"],
        &["acceptance", &page],
        &["effects", "no-such-effect"],
    ] {
        let output = run(words);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {}", said(&output));
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{words:?}");
    }
    assert_eq!(std::fs::read(&have).expect("there"), b"have");
    let rows: String = (0..40)
        .map(|k| format!("{},0,0,0,0,0,-1.0,20,0,40\n", 0.1 * f64::from(k)))
        .collect();
    let log = file(
        "g.csv",
        format!("t_s,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z,mag_x,mag_y,mag_z\n{rows}").as_bytes(),
    );
    let output = run(&["attitude", &log]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("--forces g"), "{}", said(&output));
    assert!(
        !said(&run(&["attitude", &log, "--forces", "g"])).contains("--forces"),
        "what was said is believed"
    );
}

#[test]
fn a_case_that_cannot_be_made_leaves_no_half_of_one() {
    let place = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| place.path().join(name).display().to_string();
    let flights = path("flights");
    let words = [
        "fly",
        "--host",
        "--motion",
        "tumble",
        "--duration",
        "20s",
        "--out",
        &flights,
    ];
    assert!(run(&words).status.success());
    let of = |name: &str| path(&format!("flights/tumble-1/{name}"));
    let (log, motion, unit, out) = (of("packets.txt"), of("motion.csv"), of("unit.toml"), path("case"));
    std::fs::write(path("page.html"), "<!doctype html><p>404").expect("written");
    let new = |reference: &str| {
        let words = ["--log", &log, "--unit", &unit, "--reference", reference, "--out", &out];
        run(&[&["case", "new", "--latitude-deg=-23.2"][..], &words].concat())
    };
    let refused = new(&path("page.html"));
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
    assert!(!std::path::Path::new(&out).exists(), "half a case");
    // Nor is one that is there touched.
    std::fs::create_dir(&out).expect("made");
    std::fs::write(path("case/mine"), "mine").expect("written");
    let refused = new(&motion);
    assert!(said(&refused).contains("is there already"), "{}", said(&refused));
    assert_eq!(std::fs::read(path("case/mine")).expect("there"), b"mine");
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "there is no /dev/full")]
fn a_closed_pipe_ends_quietly_and_a_full_disk_with_an_error() {
    for words in [&["sources"][..], &["completions", "bash"]] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let closed = ground(words)
            .stdout(writer)
            .stderr(Stdio::piped())
            .output()
            .expect("runs");
        assert_eq!(
            (closed.status.code(), said(&closed)),
            (Some(0), String::new()),
            "{words:?}"
        );
        let full = std::fs::OpenOptions::new()
            .write(true)
            .open("/dev/full")
            .expect("a full disk");
        let full = ground(words)
            .stdout(full)
            .stderr(Stdio::piped())
            .output()
            .expect("runs");
        assert_eq!(full.status.code(), Some(1), "{words:?}");
        let why = said(&full);
        assert!(
            why.starts_with("error: ") && !why.contains("panicked"),
            "{words:?}: {why}"
        );
    }
}

#[test]
fn it_says_its_commit_its_codes_and_its_words() {
    let version = String::from_utf8_lossy(&run(&["--version"]).stdout).into_owned();
    assert!(
        version.starts_with(concat!("ground ", env!("CARGO_PKG_VERSION"))),
        "{version}"
    );
    let help = String::from_utf8_lossy(&run(&["--help"]).stdout).into_owned();
    assert!(help.contains("Exit codes: 0 good; 1 not good"), "{help}");
    let script = String::from_utf8_lossy(&run(&["completions", "bash"]).stdout).into_owned();
    assert!(script.contains("multi-position"));
    let place = tempfile::tempdir().expect("temporary folder");
    let folder = place.path().display().to_string();
    let quiet = run(&["man", &folder, "--quiet"]);
    assert!(quiet.status.success() && quiet.stdout.is_empty());
    assert!(place.path().join("ground-calibrate-ellipsoid.1").exists());
}

#[test]
fn what_prints_a_report_speaks_json_too() {
    let place = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| place.path().join(name).display().to_string();
    let json = |words: &[&str]| -> serde_json::Value {
        let output = run(words);
        assert!(output.status.success(), "{words:?}: {}", said(&output));
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{words:?}: {error}"))
    };
    let flown = json(&[
        "fly",
        "--host",
        "--motion",
        "still",
        "--duration",
        "5s",
        "--out",
        &path("flights"),
        "--json",
    ]);
    assert!(
        flown["summary"].as_object().is_some_and(|rows| rows.len() > 5),
        "{flown}"
    );
    assert!(std::path::Path::new(flown["page"].as_str().expect("a page")).is_file());
    let checked = run(&["case", "check", &path("flights"), "--json", "--quiet"]);
    assert_eq!(checked.status.code(), Some(1), "{}", said(&checked));
    let checked: serde_json::Value = serde_json::from_slice(&checked.stdout).expect("JSON of what is missing");
    assert_eq!(
        (&checked["whole"], &checked["points"][0]["mark"]),
        (&false.into(), &"missing".into()),
        "{checked}"
    );
    let effects = json(&["effects", "hard-iron", "--json", "--quiet"]);
    assert_eq!(effects[0]["name"], "hard-iron");
    assert_eq!(effects[0]["size"][0]["unit"], "uT", "{effects}");
    let size = json(&["size", env!("CARGO_BIN_EXE_ground"), "--json"]);
    assert_eq!(
        size["flash"].as_u64().expect("flash"),
        size["text"].as_u64().unwrap_or(0) + size["data"].as_u64().unwrap_or(0)
    );
    let sources = json(&["sources", "--json", "--quiet"]);
    let rocket = sources
        .as_array()
        .and_then(|all| all.iter().find(|one| one["name"] == "rocket"));
    assert_eq!(
        rocket.map(|rocket| &rocket["duration_s"]),
        Some(&600.0.into()),
        "{sources}"
    );
    let folder = std::path::Path::new(flown["page"].as_str().expect("a page")).parent();
    let folder = folder.and_then(|folder| folder.to_str()).expect("its folder");
    let both = json(&["compare", folder, folder, "--page", &path("both.html"), "--json"]);
    assert_eq!(
        both["figures"][0],
        serde_json::json!({"name": "packets", "a": "24", "b": "24"}),
        "{both}"
    );
    let drill = json(&["drill", "C6", "--json"]);
    assert_eq!(
        (&drill["rows"][0]["row"], &drill["not accepted"]),
        (&"C6".into(), &0.into()),
        "{drill}"
    );
    std::fs::write(path("scale.csv"), "rate,output\n-1,-2\n0,0\n1,2\n2,4.001\n").expect("written");
    let drift = json(&[
        "calibrate",
        "drift",
        "--scale",
        &path("scale.csv"),
        "--out",
        &path("drift"),
        "--json",
    ]);
    assert_eq!(
        (&drift["tests"][0]["test"], &drift["good"]),
        (&"Scale factor".into(), &true.into()),
        "{drift}"
    );
    let refused = run(&["recover", "nowhere.bin", "--json"]);
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
    assert!(said(&refused).contains("--table"));
}
