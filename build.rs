//! Link arguments of the firmware, and which board file it is built for (`EMEMS_BOARD`, default `obc`).

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-env-changed=EMEMS_BOARD");
    println!("cargo:rustc-check-cfg=cfg(board, values(\"obc\", \"discovery\"))");
    let board = env::var("EMEMS_BOARD").unwrap_or_else(|_| "obc".into());
    println!("cargo:rustc-cfg=board=\"{board}\"");
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
