//! The filter on real recordings, where they are.

use std::path::Path;

use attitude::broad::{self, REPORT, TUNE, mean_of};

/// The recordings stand beside the project.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/broad");

/// [deg] VQF 2.1.2 with its defaults on the same recordings: at every row on those of [`TUNE`] and of [`REPORT`], and
/// from a start in motion.
const VQF: [f64; 3] = [2.80, 1.92, 5.8];

#[test]
fn it_is_ahead_of_the_best_peer_on_real_recordings() {
    if !Path::new(FOLDER).exists() {
        println!("skipped: no recordings at {FOLDER}");
        return;
    }
    let table = broad::run(FOLDER.as_ref(), |_| {}).expect("recordings");
    let total = |numbers: &[&str], mode| mean_of(&table, numbers, mode).expect("an attitude in each").total_deg;
    let found = [total(&TUNE, 0), total(&REPORT, 0), total(&REPORT, 2)];
    println!(
        "tune {:.2}, report {:.2}, report from motion {:.2}; 5 Hz {:.2}, {:.2}",
        found[0],
        found[1],
        found[2],
        total(&TUNE, 1),
        total(&REPORT, 1)
    );
    for (found, peer) in found.into_iter().zip(VQF) {
        assert!(found < peer, "{found} is not below {peer}");
    }
}
