//! The twin against logs made elsewhere, with their answers: healthy ones are explained to their noise, and an effect comes
//! out as large as it was put in.

mod support;

use support::{Case, Fit, case, fit};
use twin::effect::{Active, Cause, Locality, by_name};

fn active(case: &Case, name: &str, locality: Locality) -> Active {
    let cause = Cause {
        effect: by_name(name).unwrap(),
        locality,
        variant: 0.0,
    };
    let theta = vec![0.0; cause.parameters(case.twin.unit()).len()];
    Active { cause, theta }
}

/// Fits one effect to the channels it touches.
fn fitted(case: &Case, name: &str, locality: Locality) -> Fit {
    let active = active(case, name, locality);
    let channels = active.cause.channels(case.twin.unit());
    let fit = fit(case, &[active], &channels);
    println!(
        "{name}: {:?} +- {:?}; {} -> {}",
        fit.theta, fit.sigma, fit.before, fit.after
    );
    fit
}

#[test]
fn a_healthy_log_is_explained_to_its_noise() {
    let cases = [
        ("P06", "flight-b", [26.0, -8.9, -4.1]),
        ("P12", "hand-a", [16.8, -6.8, -14.4]),
    ];
    for (name, motion, field_n_ut) in cases {
        let Some(case) = case(name, motion, field_n_ut) else {
            return;
        };
        for channel in 0..case.twin.unit().channels.len() {
            let fit = fit(&case, &[], &[channel]);
            let channel = &case.twin.unit().channels[channel].name;
            println!("{name} {channel}: {:.3} -> {:.4}", fit.before, fit.after);
        }
    }
}

#[test]
fn the_lever_arm_comes_out_of_the_centrifuge() {
    let Some(case) = case("P13", "arm-a", [15.1, -4.3, -17.6]) else {
        return;
    };
    fitted(&case, "lever-arm", Locality::Common);
}
