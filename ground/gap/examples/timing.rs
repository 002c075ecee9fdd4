//! Timing.
use std::time::Instant;
use gap::{case::Subject, problem::Problem, library::Library};
use twin::effect::Active;
use nalgebra::DVector;
fn main() {
    let case = std::env::args().nth(1).unwrap();
    let subject = Subject::open(std::path::Path::new(&case)).unwrap();
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.accuracy);
    let t = Instant::now();
    let library = Library::new(&problem, &[], &|_| {});
    println!("library {:?}", t.elapsed());
    for h in &library.hypotheses {
        let a: Active = h.active(&DVector::from_element(h.parameters.len(), 1e-4));
        let chs = h.cause.channels(subject.twin.unit());
        let t = Instant::now();
        let _ = subject.twin.channel(chs[0], &[a.clone()]).len();
        let one = t.elapsed();
        let t = Instant::now();
        let _ = subject.twin.jacobian(&[a], 0);
        println!("{:?} one channel {:?} jacobian {:?} params {} channels {}", h.cause, one, t.elapsed(), h.parameters.len(), chs.len());
    }
    let _ = &problem;
}
