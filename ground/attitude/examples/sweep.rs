//! Temporary.
use attitude::{
    broad::{self, Mode, TUNE},
    recording,
    score::mean,
};
use emems::kalman::Params;
fn main() {
    let folder = std::path::PathBuf::from("/work/shared/data/broad");
    let all: Vec<_> = broad::files(&folder)
        .unwrap()
        .into_iter()
        .filter(|(n, _)| TUNE.contains(&n.as_str()))
        .map(|(_, p)| recording::read(&p).unwrap())
        .collect();
    let run = |change: &(dyn Fn(&mut Params) + Sync)| {
        let mut out = vec![];
        for mode in [Mode::Full, Mode::FiveHz] {
            let mut replay = broad::replay(mode);
            change(&mut replay.params);
            out.push(mean(&all.iter().map(|r| replay.score(r).unwrap()).collect::<Vec<_>>()));
        }
        format!(
            "{:.3} ({:.2} {:.2})  {:.3} ({:.2} {:.2})",
            out[0].total_deg,
            out[0].heading_deg,
            out[0].inclination_deg,
            out[1].total_deg,
            out[1].heading_deg,
            out[1].inclination_deg
        )
    };
    println!("base {}", run(&|_| {}));
    macro_rules! p { ($($f:tt).+) => { for k in [0.5f32, 2.0] { println!("{:<28} x{k} {}", stringify!($($f).+), run(&|p: &mut Params| p.$($f).+ *= k)); } } }
    p!(angle_noise);
    p!(turn_noise);
    p!(bias_sd);
    p!(bias_walk);
    p!(gyro_matrix_sd);
    p!(gyro_matrix_walk);
    p!(velocity_sd);
    p!(velocity_per_spread_s);
    p!(velocity_rest_sd);
    p!(acc_error);
    p!(heading_sd);
    p!(start_field_sd);
    p!(dip_sd);
    p!(disturbance);
    p!(field_spread);
    p!(gate);
    p!(recovery_s);
    p!(rest.bias_sd);
    p!(iron_sd_ut);
    p!(iron_noise_ut);
    p!(iron_per_spread);
    p!(learn_s);
    p!(delays.gyro_s);
    p!(delays.acc_s);
    p!(delays.mag_s);
    println!(
        "no matrix {}",
        run(&|p| {
            p.gyro_matrix_sd = 0.0;
            p.gyro_matrix_walk = 0.0;
        })
    );
    println!("no iron {}", run(&|p| p.iron_sd_ut = 0.0));
    println!("no rest {}", run(&|p| p.rest.rate = 0.0));
    println!(
        "no delays {}",
        run(&|p| {
            p.delays.gyro_s = 0.0;
            p.delays.acc_s = 0.0;
            p.delays.mag_s = 0.0;
        })
    );
    println!("no earth {}", run(&|p| p.earth_rate_n *= 0.0));
    println!(
        "window 0.5 {}",
        run(&|p| {
            p.window_s = 0.5;
            p.heading_sd *= 1.41;
            p.dip_sd *= 1.41;
        })
    );
    println!(
        "window 2 {}",
        run(&|p| {
            p.window_s = 2.0;
            p.heading_sd /= 1.41;
            p.dip_sd /= 1.41;
        })
    );
}
