//! Cases with known answers, of `data/`.

use std::path::{Path, PathBuf};

use gap::{diagnose::diagnose, input::case::Subject};

/// The folder of a case.
fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data").join(name)
}

fn check(name: &str, effect: Option<&str>) {
    let subject = Subject::open(&data("practice").join(name)).expect("opens");
    let diagnosis = diagnose(&subject, &[], &|_, _| {});
    let named: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect).collect();
    assert_eq!(named, effect.into_iter().collect::<Vec<_>>(), "{name}");
    assert!(diagnosis.none_of_these < 0.5, "{name}: {}", diagnosis.none_of_these);
    if effect.is_some() {
        assert!(
            diagnosis.shrink.percent > 90.0,
            "{name}: {:?}",
            diagnosis.shrink.percent
        );
    }
}

#[test]
fn a_healthy_unit_is_given_no_cause() {
    check("P12", None);
}

/// Sixteen sequences on a rate table, as printed (thesis 000, tables 7.3 and 7.4).
#[test]
fn a_printed_table_yields_its_wrong_commands_its_inverted_gyro_and_the_sagnac_sine() {
    let subject = Subject::open(&data("cases/siqueira-table-7-4")).expect("opens");
    let wrong: Vec<f64> = subject.gross.contradicted.iter().map(|one| one.seq).collect();
    assert_eq!(wrong, [7.0, 8.0, 11.0, 12.0, 15.0]);
    assert_eq!(subject.names(subject.gross.inverted.iter().copied()), ["sd04"]);
    let diagnosis = diagnose(&subject, &[], &|_, _| {});
    assert_eq!(
        diagnosis.causes.first().map(|cause| cause.effect),
        Some("gyro-sine-response")
    );
    let screen = gap::report::terminal::screen(&subject, &diagnosis, "");
    assert!(screen.contains("lme02: scale drift or none of these"), "{screen}");
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_displaced_unit_on_a_centrifuge_is_named() {
        check("P13", Some("lever-arm"));
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn low_bits_cut_off_are_named() {
        check("P02", Some("coarse-quantisation"));
    }
}
