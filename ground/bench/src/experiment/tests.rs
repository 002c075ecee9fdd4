use std::path::Path;

use super::*;

const SITE: Site = Site {
    gravity_m_s2: 9.7864,
    latitude_rad: -0.4051,
    outer_azimuth_rad: None,
};

fn read(kind: Excitation, text: &str) -> Result<Experiment, TableError> {
    read_of(&|_| false, kind, text)
}

/// Of a unit whose description has these channels.
fn read_of(has: &dyn Fn(&str) -> bool, kind: Excitation, text: &str) -> Result<Experiment, TableError> {
    let table = Table::parse(Path::new("run.csv"), text.as_bytes())?;
    let layout = Layout {
        kind,
        mount: Mount::EMEMS,
        site: SITE,
        channels: &[],
        has,
        units: Units::default(),
        limit: &|_| 8191.0,
    };
    Experiment::read(&table, &layout)
}

#[test]
fn degrees_and_radians_are_told_by_the_columns_name() {
    let degrees = read(
        Excitation::Rate,
        "seq;wx_deg_s;wy_deg_s;wz_deg_s;g1;g1_sigma\na;180;0;0;1;1\nb;0;0;90;2;1\n",
    )
    .expect("deg");
    assert!((degrees.trials[0].excitation_b.x - std::f64::consts::PI).abs() < 1e-15);
    assert_eq!(
        (degrees.trials[1].label.as_str(), degrees.channels.as_slice()),
        ("b", ["g1".to_string()].as_slice())
    );
}

#[test]
fn without_sigmas_the_units_description_says_which_columns_are_channels() {
    let gyros = |name: &str| name.starts_with('g');
    let bare = "wx_rad_s,wy_rad_s,wz_rad_s,t1,g1\n1,2,3,25,5\n2,2,3,25,6\n";
    let found = read_of(&gyros, Excitation::Rate, bare).expect("one gyro");
    assert_eq!(found.channels, ["g1"]);
    // Where some columns have a sigma, those are meant.
    let beside = bare
        .replace("t1,g1", "g2,g1,g1_sigma")
        .replace("25,5", "25,5,1")
        .replace("25,6", "25,6,1");
    assert_eq!(
        read_of(&gyros, Excitation::Rate, &beside).expect("one").channels,
        ["g1"]
    );
}

#[test]
fn angles_give_the_excitation_and_claims_are_kept_beside_it() {
    let text = "inner_deg,outer_deg,turning,rate_deg_s,wx_deg_s,wy_deg_s,wz_deg_s,g1,g1_n\n0,180,inner,200,0,0,-200,5,9\n0,0,outer,200,0,200,0,6,9\n";
    let found = read(Excitation::Rate, text).expect("angles");
    assert!((found.trials[0].excitation_b.z - 200_f64.to_radians()).abs() < 1e-12);
    assert!((found.trials[0].claimed_b.expect("claim").z + 200_f64.to_radians()).abs() < 1e-12);
}

#[test]
fn saturated_and_empty_cells_are_left_out_and_said() {
    let found = read(
        Excitation::Force,
        "inner_deg,outer_deg,a1x,a1x_n\n0,0,-300,9\n0,90,8191,9\n90,0,,9\n90,45,7,9\n",
    )
    .expect("read");
    assert_eq!(
        found.trials.iter().map(|trial| trial.values[0]).collect::<Vec<_>>(),
        [Some(-300.0), None, None, Some(7.0)]
    );
    assert_eq!(found.remarks.len(), 2);
    assert!(
        found.remarks[0].starts_with("line 3, a1x: 8191 is at the end"),
        "{:?}",
        found.remarks
    );
}

#[test]
fn what_is_missing_is_named() {
    for (text, why) in [
        ("seq,g1,g1_n\n1,5,9\n", "does not say what the unit felt"),
        ("wx_rad_s,wy_rad_s,g1,g1_n\n1,2,5,9\n", "has not all of wx_rad_s"),
        (
            "wx_deg_s,wy_rad_s,wz_deg_s,g1,g1_n\n1,2,3,5,9\n",
            "has not all of wx_rad_s",
        ),
        (
            "wx_rad_s,wy_rad_s,wz_rad_s,wx_deg_s,wy_deg_s,wz_deg_s,g1,g1_n\n1,0,0,57,0,0,5,9\n",
            "in two units",
        ),
        ("wx_rad_s,wy_rad_s,wz_rad_s,g1\n1,2,3,5\n", "which columns are channels"),
        (
            "wx_rad_s,wy_rad_s,wz_rad_s,g1,g1_n\n1,2,,5,9\n",
            "line 2, column wz_rad_s: is empty",
        ),
        (
            "wx_rad_s,wy_rad_s,wz_rad_s,g1,g1_n\n1,2,3,5,9\n1,0,3,5,9\n",
            "column g1: never changes",
        ),
        (
            "inner_deg,outer_deg,turning,rate_deg_s,g1,g1_n\n0,0,up,5,5,9\n",
            "names no axis",
        ),
    ] {
        let error = read(Excitation::Rate, text).expect_err("refused").to_string();
        assert!(error.contains(why), "{error}");
    }
}
