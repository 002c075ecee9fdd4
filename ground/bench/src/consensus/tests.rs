use super::*;

const AXES: [[f64; 3]; 4] = [
    [-0.95, 0.0, -0.32],
    [0.47, -0.82, -0.32],
    [0.47, 0.82, -0.32],
    [0.0, 0.0, 1.0],
];

/// What a tetrahedron of gyros puts out.
fn claim(claimed: [f64; 3], real: [f64; 3]) -> Claim {
    let real = Vector3::from(real);
    Claim {
        excitation_b: claimed.into(),
        values: AXES
            .iter()
            .map(|axis| 13.6 * Vector3::from(*axis).dot(&real) - 5.0)
            .collect(),
    }
}

fn honest() -> Vec<Claim> {
    let w = 200.0;
    let ways = [
        [w, 0.0, 0.0],
        [0.0, w, 0.0],
        [0.0, 0.0, w],
        [0.0, 0.8 * w, 0.6 * w],
        [0.6 * w, 0.0, 0.8 * w],
    ];
    ways.iter()
        .flat_map(|&way| [claim(way, way), claim(way.map(|c| -c), way.map(|c| -c))])
        .collect()
}

#[test]
fn an_honest_table_has_none() {
    assert_eq!(contradictions(&honest()).contradictions, []);
}

#[test]
fn a_turned_sign_and_exchanged_axes_are_found_and_read() {
    let mut claims = honest();
    claims.push(claim([0.0, 160.0, 120.0], [0.0, 160.0, -120.0]));
    claims.push(claim([200.0, 0.0, 100.0], [200.0, 100.0, 0.0]));
    let found = contradictions(&claims);
    let rows: Vec<usize> = found.contradictions.iter().map(|one| one.row).collect();
    assert_eq!(rows, [10, 11]);
    assert_eq!(found.contradictions[0].reading.expect("sign").words(), "(+x, +y, -z)");
    assert_eq!(found.contradictions[1].reading.expect("axes").words(), "(+x, +z, +y)");
    assert!((found.contradictions[1].found_b.expect("rate") - Vector3::new(200.0, 100.0, 0.0)).norm() < 1e-6);
    assert!(found.alternatives.is_empty());
}

#[test]
fn a_wrong_number_is_found_though_no_reading_explains_it() {
    let mut claims = honest();
    claims.push(claim([0.0, -173.2, -173.2], [0.0, -173.2, -100.0]));
    let found = contradictions(&claims);
    assert_eq!(found.contradictions.len(), 1);
    assert_eq!(
        (found.contradictions[0].row, found.contradictions[0].reading),
        (10, None)
    );
}

#[test]
fn where_rows_stand_against_rows_both_are_named() {
    // Only two rows know x, and they disagree about its sign.
    let mut claims: Vec<Claim> = honest()
        .into_iter()
        .filter(|claim| claim.excitation_b.x == 0.0)
        .collect();
    claims.push(claim([200.0, 0.0, 0.0], [200.0, 0.0, 0.0]));
    claims.push(claim([-200.0, 0.0, 0.0], [200.0, 0.0, 0.0]));
    let found = contradictions(&claims);
    let blamed: Vec<usize> = found.contradictions.iter().map(|one| one.row).collect();
    assert_eq!((blamed, found.alternatives), (vec![7], vec![vec![6]]));
}
