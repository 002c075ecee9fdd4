//! Link arguments of the firmware, which board of `boards/` it is built for (`EMEMS_BOARD`, default `obc`), and the calibration set
//! it starts with (`EMEMS_CALIBRATION`, a file of `ground calibration apply --out`; nominal without). Refuses a board without a
//! file there.

use std::{env, fs, path::Path};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-env-changed=EMEMS_BOARD");
    board();
    calibration();
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        println!(
            "cargo:rustc-link-search={}",
            env::var("CARGO_MANIFEST_DIR").expect("set by cargo")
        );
        for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x", "--icf=all"] {
            println!("cargo:rustc-link-arg-bins={argument}");
        }
    }
}

/// Says for which board `src/main.rs` is compiled: one of the files of `boards/`. A new one is asked for by another `EMEMS_BOARD`.
fn board() {
    let files = fs::read_dir("boards").expect("boards/ is there").flatten();
    let mut boards: Vec<String> = files
        .filter_map(|file| Some(file.file_name().to_str()?.strip_suffix(".rs")?.to_owned()))
        .collect();
    boards.sort();
    println!(
        "cargo:rustc-check-cfg=cfg(board, values(\"{}\"))",
        boards.join("\", \"")
    );
    let board = env::var("EMEMS_BOARD").unwrap_or_else(|_| "obc".into());
    assert!(
        boards.contains(&board),
        "EMEMS_BOARD={board}: boards/ has {}",
        boards.join(", ")
    );
    println!("cargo:rustc-cfg=board=\"{board}\"");
}

/// Puts the bytes of the set where `src/calibration/compiled.rs` takes them from; none for no set.
fn calibration() {
    println!("cargo:rerun-if-env-changed=EMEMS_CALIBRATION");
    let bytes = env::var_os("EMEMS_CALIBRATION").map_or_else(Vec::new, |file| {
        println!("cargo:rerun-if-changed={}", Path::new(&file).display());
        fs::read(&file).unwrap_or_else(|error| panic!("EMEMS_CALIBRATION={}: {error}", Path::new(&file).display()))
    });
    let folder = env::var_os("OUT_DIR").expect("set by cargo");
    fs::write(Path::new(&folder).join("calibration.bin"), bytes).expect("OUT_DIR can be written");
}
