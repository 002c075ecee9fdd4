use gap::{attribute::attribute, case::Subject, library::Library, problem::Problem};
use std::time::Instant;
fn main() {
    for case in std::env::args().skip(1) {
        let t = Instant::now();
        let subject = match Subject::open(std::path::Path::new(&case)) {
            Ok(s) => s,
            Err(e) => {
                println!("{case}: {e}");
                continue;
            }
        };
        let t1 = t.elapsed();
        let problem = Problem::new(&subject.twin, &subject.fit, &subject.accuracy);
        let mut library = Library::new(&problem, &[], &|_| {});
        let t2 = t.elapsed();
        let found = attribute(&problem, &mut library, &|_| {});
        println!(
            "== {case}: open {t1:?}, library {} columns {} hyps {t2:?}, attribute {:?}",
            library.products.len(),
            library.hypotheses.len(),
            t.elapsed()
        );
        for c in &found.chosen {
            let h = &library.hypotheses[c.hypothesis];
            println!("  {:?} gain {:.1}", h.cause, c.gain);
            for (p, (v, s)) in h
                .parameters
                .iter()
                .zip(c.theta.iter().zip(c.covariance.diagonal().iter()))
                .take(6)
            {
                println!("     {} = {:.4e} +- {:.1e} {}", p.name, v, s.sqrt(), p.unit);
            }
            for (r, g) in c.rivals.iter().take(4) {
                println!("     rival {:?} {:.1}", library.hypotheses[*r].cause, g);
            }
        }
        if found.chosen.is_empty() {
            let mut order: Vec<usize> = (0..found.alone.len()).collect();
            order.sort_by(|a, b| found.alone[*b].total_cmp(&found.alone[*a]));
            for i in order.iter().take(3) {
                println!("  alone {:?} {:.1}", library.hypotheses[*i].cause, found.alone[*i]);
            }
        }
    }
}
