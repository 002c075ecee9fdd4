//! Timing.
use gap::{case::Subject, problem::Problem};
use std::time::Instant;
use twin::effect::{Active, Cause, LIBRARY, Nature};
fn main() {
    let case = std::env::args().nth(1).unwrap();
    let subject = Subject::open(std::path::Path::new(&case)).unwrap();
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.accuracy);
    let unit = subject.twin.unit();
    for e in LIBRARY {
        if e.page().nature != Nature::Smooth {
            continue;
        }
        let t = Instant::now();
        let mut n = 0;
        let mut p = 0;
        let (ls, vs) = (e.localities(unit), e.variants(subject.twin.starts_s()));
        for l in &ls {
            for v in &vs {
                let cause = Cause {
                    effect: *e,
                    locality: l.clone(),
                    variant: *v,
                };
                let k = cause.parameters(unit).len();
                n += 1;
                p += k;
                if l.to_string() == "all" {
                    continue;
                }
                let _ = subject.twin.jacobian(
                    &[Active {
                        theta: vec![0.0; k],
                        cause,
                    }],
                    0,
                );
            }
        }
        println!(
            "{:28} {:4} hyps {:4} params {:3} loc {:3} var {:?}",
            e.page().name,
            n,
            p,
            ls.len(),
            vs.len(),
            t.elapsed()
        );
    }
    let _ = &problem;
}
