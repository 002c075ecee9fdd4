//! One case gives one verdict, to the last digit, on however many cores it is asked.

use std::path::Path;

use gap::{diagnose::diagnose, input::case::Subject, report::verdict::Verdict};

/// What is said of a case by so many threads.
fn said(case: &str, threads: usize) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(case);
    let subject = Subject::open(&folder).expect("opens");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let diagnosis = pool.expect("threads").install(|| diagnose(&subject, &[], &|_, _| ()));
    let verdict = Verdict::new(&subject, &diagnosis, diagnosis.advice(&subject));
    serde_json::to_string(&verdict).expect("is finite")
}

fn check(case: &str) {
    let alone = said(case, 1);
    [2, 3]
        .into_iter()
        .for_each(|threads| assert_eq!(said(case, threads), alone));
}

#[test]
fn a_table_is_judged_alike_on_one_core_and_on_several() {
    check("../../data/cases/siqueira-table-7-4");
}

/// What takes more than six seconds of a core.
mod long {
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn packets_are_judged_alike_on_one_core_and_on_several() {
        super::check("tests/golden/quantised");
    }
}
