//! The reader of recordings, plain and gzipped: it refuses, or gives a truth that is finite at every instant.
use std::io::Cursor;

use twin::{recording::Recording, truth::TruthSource};

/// The target.
pub fn recording(bytes: &[u8]) {
    let Ok(recording) = Recording::read(Cursor::new(bytes.to_vec()), "fuzz.csv") else {
        return;
    };
    let duration_s = recording.duration_s().expect("a recording ends");
    assert!(duration_s.is_finite() && duration_s >= 0.0);
    for t_s in [-1.0, 0.0, 0.3 * duration_s, duration_s, duration_s + 1.0] {
        let truth = recording.at(t_s);
        for vector in [truth.rate_b, truth.rate_dot_b, truth.force_b, truth.field_b_ut] {
            assert!(vector.iter().all(|value| value.is_finite()), "{vector} at {t_s} s");
        }
        assert!(truth.temperature_c.is_finite());
    }
}
