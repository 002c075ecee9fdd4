//! Tables 6.1 to 6.4 of Marinho (2017): what of them can be reproduced, and why the rest cannot.

mod seeds;

use bench::ellipsoid::{Convention, Ellipsoid, shape};
use nalgebra::Vector3;
use rand_distr::{Distribution, Normal, UnitSphere};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

#[test]
fn golden_ellipsoids_come_back_in_both_conventions() {
    let rad = f64::to_radians;
    let large = [1.05, 0.93, 1.12, 25.0, -40.0, 60.0, rad(3.0), rad(-2.0), rad(1.5)];
    let printed = [
        1.0855,
        1.034,
        1.0529,
        199.9729,
        80.5599,
        -110.4864,
        rad(0.0514),
        rad(0.0488),
        rad(-0.0033),
    ];
    for (name, nine) in [("large", large), ("table6_1", printed)] {
        for (ending, convention) in [("std", Convention::Standard), ("thesis", Convention::Thesis)] {
            let table = seeds::table(&format!("golden/002_mvsec_golden_{name}_{ending}.csv"));
            let points: Vec<_> = seeds::numbers(&table, &["vx", "vy", "vz"])
                .iter()
                .map(|v| Vector3::new(v[0], v[1], v[2]))
                .collect();
            let found = Ellipsoid::fit(&points, 230.0).expect("fit");
            for (k, (found, truth)) in found.nine(convention).values.iter().zip(nine).enumerate() {
                // Points have nine decimals of 230.
                assert!((found - truth).abs() < 1e-8, "{name} {ending} {k}: {found} {truth}");
            }
            assert!((found.shape - shape(&nine, convention)).amax() < 1e-10);
        }
    }
}

#[test]
fn sigmas_of_table_6_1_have_the_ratio_of_a_field_near_500() {
    // 230 directions all over the sphere, as the caption says. The printed sigmas are in the ratio 181/0.5 (x0 to a),
    // 154/0.5 (y0 to b), 120/0.3 (z0 to c); for even directions it is 0.7 R (seed A.5), so R was 440 to 570, not 1.
    let printed = [1.0855, 1.034, 1.0529, 199.9729, 80.5599, -110.4864, 0.0, 0.0, 0.0];
    let mut random = Xoshiro256PlusPlus::seed_from_u64(61);
    let normal = Normal::new(0.0, 3.8).expect("sigma");
    let points: Vec<_> = (0..230)
        .map(|_| {
            let way: [f64; 3] = UnitSphere.sample(&mut random);
            let noise = Vector3::from_fn(|_, _| normal.sample(&mut random));
            shape(&printed, Convention::Thesis) * Vector3::from(way) * 500.0
                + Vector3::new(199.97, 80.56, -110.49)
                + noise
        })
        .collect();
    let nine = Ellipsoid::fit(&points, 500.0).expect("fit").nine(Convention::Thesis);
    for (k, ratio) in [362.0, 308.0, 401.0].into_iter().enumerate() {
        let found = nine.sigmas[3 + k] / nine.sigmas[k];
        assert!((found / ratio - 1.0).abs() < 0.3, "{found} {ratio}");
    }
    // The values themselves need the 230 points, which are not in the thesis; the sigmas' size is within a factor of
    // two for 3.8 units of noise.
    assert!(nine.sigmas[3] > 0.1 && nine.sigmas[3] < 1.0, "{:?}", nine.sigmas);
}

#[test]
fn tables_6_2_to_6_4_follow_from_the_platforms_angles() {
    // Specific force in e after turning frame b: about y_b by +-30 deg, about x_b by 35 deg; g = 9.8 (Table 6.2).
    let rest_b = Vector3::new(0.0, 0.0, -9.8);
    let turn = |axis: Vector3<f64>, deg: f64| nalgebra::Rotation3::new(axis * -f64::to_radians(deg));
    let e = |b: Vector3<f64>| Vector3::new(b.z, b.y, b.x);
    let exact = |found: Vector3<f64>, x: f64, y: f64, z: f64| (e(found) - Vector3::new(x, y, z)).amax() < 1e-8;
    assert!(exact(turn(Vector3::y(), 30.0) * rest_b, -8.487_048_957, 0.0, 4.9));
    assert!(exact(turn(Vector3::y(), -30.0) * rest_b, -8.487_048_957, 0.0, -4.9));
    assert!(exact(
        turn(Vector3::x(), 35.0) * rest_b,
        -8.027_690_034,
        -5.621_049_076,
        0.0
    ));
    // Table 6.4: heading does not matter, then 35 deg about y_b (B), then 45 deg about x_b (C). The printed y_e of C,
    // -6.92, takes 9.8 instead of 8.0277 and gives a norm of 10.56.
    let b = turn(Vector3::y(), 35.0) * rest_b;
    assert!(exact(b, -8.027_690_034, 0.0, 5.621_049_076));
    let c = turn(Vector3::x(), 45.0) * b;
    assert!(exact(c, -5.676_434_060, -5.676_434_060, 5.621_049_076));
    let printed = Vector3::new(-5.67_f64, -6.92, 5.62);
    assert!((printed.norm() - 10.56).abs() < 0.01 && (c.norm() - 9.8).abs() < 1e-9);
    // Table 6.3 is a table of signs: positive about y_e takes gravity as positive pitch does, which is test A above.
}
