//! How near the smoothed attitude of cases comes to their reference: `cargo run --example smooth -- FOLDER...`.
//!
//! In: folders of cases that have a motion. The smoother does not open it; it is what the result is held against. Out: a line each.

use std::{path::Path, time::Instant};

use gap::{
    input::{case::Subject, reference::Reference},
    null::problem::Problem,
    parity::{
        course::Course,
        flight::Flight,
        smooth::{self, About, Smoothed},
        space::Space,
    },
};

fn main() {
    for folder in std::env::args().skip(1) {
        match of(Path::new(&folder)) {
            Ok(line) => println!("{folder}: {line}"),
            Err(error) => println!("{folder}: {error}"),
        }
    }
}

fn of(folder: &Path) -> Result<String, Box<dyn std::error::Error>> {
    let flight = Flight::open(folder)?;
    let began = Instant::now();
    let (course, start) = Course::of(&flight.log, &flight.unit, &flight.environment);
    let about = About {
        log: &flight.log,
        unit: &flight.unit,
        environment: &flight.environment,
        course: &course,
        start: &start,
    };
    let mut smoothed = Smoothed::of(&about, flight.rests(&flight.log, &flight.unit, &[]), &|_| ())?;
    if smoothed.is_settled() {
        smoothed.hold(&flight.known, &about, &|_| ())?;
    }
    let stepped = began.elapsed().as_secs_f64();
    let twin = smoothed.twin(&flight.log, &flight.unit, &flight.environment)?;
    let (fit, reference) = (smooth::fit(&flight.log), Reference::default());
    let problem = Problem::new(&twin, &fit, &reference);
    let motion = smoothed.smoothing(&problem, &course, &start);
    let space = Space::new(&problem, &motion, Vec::new());
    let residual = space.project_residual(
        problem.residuals(&[]).into_iter().enumerate().collect(),
        &motion.prior(),
    );
    let kept = space.kept(&residual);
    let (energy, free) = kept.iter().fold((0.0, 0.0), |(e, f), own| (e + own.0, f + own.1));
    let kinds = [
        twin::predict::Kind::Gyro,
        twin::predict::Kind::Accelerometer,
        twin::predict::Kind::Magnetometer,
    ];
    let by_kind: Vec<String> = kinds
        .iter()
        .map(|kind| {
            let own = (0..kept.len()).filter(|c| flight.unit.channels[*c].sensor == *kind);
            let (e, f) = own.fold((0.0, 0.0), |(e, f), c| (e + kept[c].0, f + kept[c].1));
            format!("{:.3} ({:.0})", (e / f).sqrt(), f)
        })
        .collect();
    let subject = Subject::open(folder)?;
    let starts = subject.twin.starts_s();
    let feels = subject.twin.feels(0);
    let slot = flight.unit.channels[0].slot_s;
    let pairs: Vec<_> = (starts.iter().zip(&feels))
        .filter(|(t_s, _)| flight.log.start_s.iter().any(|own| (own - **t_s).abs() < 1e-6))
        .step_by(5)
        .collect();
    let instants: Vec<f64> = pairs.iter().map(|(t_s, _)| *t_s + slot).collect();
    let covariances = smooth::covariances(&space, &motion, space.open_parts(), &instants);
    let (mut square, mut nees, mut stated, mut worst) = (0.0, 0.0, 0.0, 0.0_f64);
    for (((_, feel), t_s), covariance) in pairs.iter().zip(&instants).zip(&covariances) {
        let error = (smoothed.trajectory.attitude(*t_s).inverse() * feel.q_nb).scaled_axis();
        square += error.norm_squared();
        worst = worst.max(error.norm());
        stated += covariance.trace();
        nees += covariance
            .try_inverse()
            .map_or(f64::NAN, |inverse| error.dot(&(inverse * error)))
            / 3.0;
    }
    let n = pairs.len() as f64;
    if std::env::var_os("COURSE").is_some() {
        for (((_, feel), t_s), covariance) in pairs.iter().zip(&instants).zip(&covariances).step_by(4) {
            let error = (smoothed.trajectory.attitude(*t_s).inverse() * feel.q_nb).scaled_axis();
            let e = error.map(f64::to_degrees);
            println!(
                "   {t_s:.2} {:.3} {:.3} {:.3} w {:.1?} said {:.3}",
                e.x,
                e.y,
                e.z,
                [0, 1, 2].map(|axis| feel.rate_b[axis].to_degrees()),
                covariance.trace().sqrt().to_degrees()
            );
        }
    }
    Ok(format!(
        "turns {:.4?} settled {} rests {:?} gap {:.4} [{}] error {:.3} deg, worst {:.3}, said {:.3}, NEES {:.2}; {stepped:.1} s, {:.1} s in all",
        smoothed.turns,
        smoothed.is_settled(),
        smoothed
            .rests
            .iter()
            .map(|(a, b)| (a.round(), b.round()))
            .collect::<Vec<_>>(),
        (energy / free).sqrt(),
        by_kind.join(" "),
        (square / n).sqrt().to_degrees(),
        worst.to_degrees(),
        (stated / n).sqrt().to_degrees(),
        nees / n,
        began.elapsed().as_secs_f64(),
    ))
}
