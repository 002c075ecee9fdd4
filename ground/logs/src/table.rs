//! Decoded packets as CSV: in counts, in nominal SI, and what derived frames add.
//!
//! In: parts of a [`StreamEntry`](crate::digest::StreamEntry). Out: header and rows, without line ends. Time is packet number times
//! cycle; the cell of a value that was not read is empty, in SI also that of a code which says nothing of how much it was. The SI
//! table is the measured CSV of a gap case: `t_s`, then one column a channel.

use std::fmt::Write;

use emems::{
    derived::Derived,
    increments::{Force, forces::READINGS},
    sample::{NO_SLOT, NOT_READ, Reading},
};

use packets::channel::{self, CHANNELS};

/// Header of the table in counts.
pub fn counts_header() -> String {
    format!("t_s,counter,errors,lift_off,micro_g,{}", names())
}

/// A packet's row in counts; `errors` in hexadecimal as in the packet.
pub fn counts_row(t_s: f64, reading: &Reading) -> String {
    let mut row = format!(
        "{t_s:.3},{},{:04X},{},{}",
        reading.counter,
        reading.errors.0,
        u8::from(reading.lift_off),
        u8::from(reading.micro_g)
    );
    for value in channel::counts(reading) {
        row.push(',');
        if let Some(value) = value {
            push(&mut row, format_args!("{value}"));
        }
    }
    row
}

/// Header of the table in nominal SI.
pub fn si_header() -> String {
    format!("t_s,{}", names())
}

/// A packet's row in nominal SI: m/s2, uT, rad/s, degC.
pub fn si_row(t_s: f64, reading: &Reading) -> String {
    let mut row = format!("{t_s:.3}");
    for (channel, value) in CHANNELS.iter().zip(channel::counts(reading)) {
        row.push(',');
        if let Some(value) = value {
            let decimals = channel.quantity.decimals();
            if let Some(si) = channel.quantity.meant(value) {
                push(&mut row, format_args!("{si:.decimals$}"));
            }
        }
    }
    row
}

/// Header of the table of derived frames. Slots are named by the sensor's first channel, without its axis.
pub fn derived_header() -> String {
    let mut header = String::from("counter,start_us,mode,health,cycle_us");
    for name in SLOT_NAMES {
        push(&mut header, format_args!(",slot_{name}_us"));
    }
    header.push_str(",covered_us,end_us,angle_x_rad,angle_y_rad,angle_z_rad");
    for plate in 1..=4 {
        push(
            &mut header,
            format_args!(",g{plate}_integral_counts_s,g{plate}_least,g{plate}_most,g{plate}_count"),
        );
    }
    for reading in 1..=READINGS {
        push(
            &mut header,
            format_args!(
                ",force{reading}_covered_us,force{reading}_after_us,force{reading}_angle_x_rad,\
                 force{reading}_angle_y_rad,force{reading}_angle_z_rad"
            ),
        );
        for plate in 1..=4 {
            for axis in ["x", "y", "z"] {
                push(&mut header, format_args!(",force{reading}_a{plate}{axis}"));
            }
        }
    }
    header.push_str(ESTIMATE_HEADER);
    // How the unit started; empty in frames that do not say it.
    header.push_str(",reset,starts,crash");
    header
}

/// Columns of the estimate: vectors in b, covariance about the axes of n.
const ESTIMATE_HEADER: &str = ",estimate_us,force_x,force_y,force_z,field_x_ut,field_y_ut,field_z_ut,rate_x,rate_y,\
    rate_z,sensors,triad_w,triad_x,triad_y,triad_z,q_w,q_x,q_y,q_z,p_nn,p_ne,p_nd,p_ee,p_ed,p_dd,bias_x,bias_y,bias_z,\
    bias_sd_x,bias_sd_y,bias_sd_z";

/// A derived frame's row.
pub fn derived_row(derived: &Derived) -> String {
    let mut row = format!(
        "{},{},{},{:08X},{}",
        derived.counter,
        derived.start_us,
        derived.mode.name(),
        derived.health.0,
        derived.cycle_us
    );
    for slot_us in derived.slots_us {
        row.push(',');
        if slot_us != NO_SLOT {
            push(&mut row, format_args!("{slot_us}"));
        }
    }
    let increments = &derived.increments;
    push(
        &mut row,
        format_args!(",{},{}", increments.covered_us, increments.end_us),
    );
    for angle in increments.angle_b {
        push(&mut row, format_args!(",{angle}"));
    }
    for gyro in increments.gyro {
        push(&mut row, format_args!(",{}", gyro.integral_counts_s));
        for extreme in [gyro.least, gyro.most] {
            row.push(',');
            if extreme != NOT_READ {
                push(&mut row, format_args!("{extreme}"));
            }
        }
        push(&mut row, format_args!(",{}", gyro.count));
    }
    for force in &increments.forces {
        push_force(&mut row, force);
    }
    push_estimate(&mut row, derived);
    match derived.start {
        Some(start) => push(&mut row, format_args!(",{:?},{}", start.reset, start.starts)),
        None => row.push_str(",,"),
    }
    row.push(',');
    if let Some(crash) = derived.start.and_then(|start| start.crash) {
        push(&mut row, format_args!("{crash:?}"));
    }
    row
}

/// A reading of the accelerometers between two cycles; empty cells where there was none.
fn push_force(row: &mut String, force: &Force) {
    if force.is_none() {
        row.push_str(&",".repeat(5));
    } else {
        push(row, format_args!(",{},{}", force.covered_us, force.after_us));
        for angle in force.angle_b {
            push(row, format_args!(",{angle}"));
        }
    }
    for counts in force.acc_p.as_flattened() {
        row.push(',');
        if *counts != NOT_READ {
            push(row, format_args!("{counts}"));
        }
    }
}

fn push_estimate(row: &mut String, derived: &Derived) {
    let estimate = &derived.estimate;
    push(row, format_args!(",{}", derived.estimate_us));
    for value in [estimate.force_b, estimate.field_b_ut, estimate.rate_b].as_flattened() {
        push(row, format_args!(",{value}"));
    }
    push(row, format_args!(",{:08X}", estimate.sensors.0));
    for attitude in [estimate.triad_nb, estimate.q_nb] {
        for part in 0..4 {
            row.push(',');
            if let Some(attitude) = attitude {
                push(row, format_args!("{}", attitude[part]));
            }
        }
    }
    let rest = [estimate.bias_b, estimate.bias_sd];
    for value in estimate.covariance_n.iter().chain(rest.as_flattened()) {
        push(row, format_args!(",{value}"));
    }
}

/// Short names of the sensors in reading order, as channels begin and as the command line takes them.
pub const SLOT_NAMES: [&str; 16] = [
    "a1", "a2", "a3", "a4", "m1", "m2", "m3", "m4", "g1", "g2", "g3", "g4", "t1", "t2", "t3", "t4",
];

fn names() -> String {
    CHANNELS.map(|channel| channel.name).join(",")
}

/// Writing to a string cannot fail.
fn push(row: &mut String, text: std::fmt::Arguments<'_>) {
    let _ = row.write_fmt(text);
}

#[cfg(test)]
mod tests {
    use emems::{board::ResetCause, crash::CrashCause, derived::Start, health::Health, increments::Increments, packet};

    use super::*;

    const GOLDEN: &[u8] = b"@00010000FEC50002FF9EFEB5FFFCFF81FEBF000AFF8400020001015D0078FFDDFF2EFF4C003CFFA1008CFFB50021FFF400CDFF8AFFFD089BF71D0008000CFFFC0000000701900191018F019211#";

    fn golden() -> Reading {
        packet::decode(GOLDEN).expect("golden frame")
    }

    #[test]
    fn the_golden_frame_in_counts() {
        assert!(counts_header().starts_with("t_s,counter,errors,lift_off,micro_g,a1x,a1y,a1z,a2x,"));
        assert_eq!(
            counts_row(0.2, &golden()),
            "0.200,1,0000,1,1,-315,2,-98,-331,-4,-127,-321,10,-124,2,1,349,120,-35,-210,-180,60,-95,140,-75,33,\
             -12,205,-118,-3,2203,-2275,8,12,-4,0,7,400,401,399,402"
        );
    }

    #[test]
    fn the_golden_frame_in_si() {
        assert!(si_header().ends_with("g4,tg1,tg2,tg3,tg4,t1,t2,t3,t4"));
        assert_eq!(
            si_row(0.2, &golden()),
            "0.200,-9.26728,0.05884,-2.88316,-9.73800,-0.11768,-3.73633,-9.44380,0.29420,-3.64807,0.05884,0.02942,\
             10.26756,11.009,-3.211,-19.266,-16.514,5.505,-8.716,12.844,-6.881,3.028,-1.101,18.807,-10.826,-0.003836,\
             2.816818,-2.908879,0.010229,26.7436,24.4188,25.0000,26.0171,25.0000,25.0625,24.9375,25.1250"
        );
    }

    #[test]
    fn a_value_that_was_not_read_is_an_empty_cell() {
        let mut reading = golden();
        (reading.acc_p[0], reading.errors.0) = ([NOT_READ; 3], 1);
        assert!(counts_row(0.2, &reading).starts_with("0.200,1,0001,1,1,,,,-331,"));
        assert!(si_row(0.2, &reading).starts_with("0.200,,,,-9.73800,"));
        reading.acc_p[0] = [0x7FFF, 2047, 0];
        assert!(
            si_row(0.2, &reading).starts_with("0.200,,60.22264,0.00000,"),
            "no part gives 964 m/s2"
        );
    }

    #[test]
    fn rows_have_as_many_cells_as_their_header() {
        let derived = Derived {
            counter: 1,
            start_us: 200_000,
            health: Health(0x80),
            cycle_us: 3_700,
            increments: Increments {
                forces: [
                    Force {
                        acc_p: [[7; 3]; 4],
                        ..Force::NONE
                    },
                    Force::NONE,
                ],
                ..Increments::NONE
            },
            ..Derived::NONE
        };
        let check = |header: String, row: String| assert_eq!(header.matches(',').count(), row.matches(',').count());
        check(counts_header(), counts_row(0.0, &golden()));
        check(si_header(), si_row(0.0, &golden()));
        check(derived_header(), derived_row(&derived));
        assert!(derived_row(&derived).starts_with("1,200000,WAIT,00000080,3700,,,"));
        assert!(derived_row(&derived).ends_with(",,,"));
        let crashed = Derived {
            start: Some(Start {
                reset: ResetCause::Software,
                crash: Some(CrashCause::Panic),
                starts: 2,
            }),
            ..derived
        };
        check(derived_header(), derived_row(&crashed));
        assert!(derived_row(&crashed).ends_with(",Software,2,Panic"));
    }
}
