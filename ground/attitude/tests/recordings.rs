//! The filter on real recordings, where they are.

use std::path::Path;

use attitude::broad::{self, REPORT, TUNE, mean_of};

/// The recordings stand beside the project.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/broad");

/// [deg] VQF 2.1.2 with its defaults on the same rates (`ground attitude --recordings --peers`): at every row on those of
/// [`TUNE`] and of [`REPORT`], at 5 Hz, and from a start in motion.
const VQF: [f64; 4] = [2.78, 1.93, 3.85, 4.59];

#[test]
fn it_is_ahead_of_the_best_peer_on_real_recordings() {
    if !Path::new(FOLDER).exists() {
        println!("skipped: no recordings at {FOLDER}");
        return;
    }
    let table = broad::run(FOLDER.as_ref(), |_| {}).expect("recordings");
    let total = |numbers: &[&str], mode| mean_of(&table, numbers, mode).expect("an attitude in each").total_deg;
    let found = [total(&TUNE, 0), total(&REPORT, 0), total(&REPORT, 1), total(&REPORT, 2)];
    println!(
        "tune {:.2}, report {:.2}, at 5 Hz {:.2}, from motion {:.2}",
        found[0], found[1], found[2], found[3]
    );
    for (found, peer) in found.into_iter().zip(VQF) {
        assert!(found < peer, "{found} is not below {peer}");
    }
}
