//! Wahba's problem: TRIAD as a product of two bases, and the best attitude by singular values.
//!
//! F. L. Markley, "Attitude determination using vector observations and the singular value decomposition", J. Astronaut.
//! Sci. 36(3), 1988: with `B = sum a_i w_i v_i' = U S V'` the matrix that takes n to b is
//! `U diag(1, 1, det U det V) V'`.

use nalgebra::{Matrix3, Vector3};

/// Matrix that takes n to b, from two directions seen in b and known in n.
pub fn triad(seen_b: [Vector3<f64>; 2], known_n: [Vector3<f64>; 2]) -> Matrix3<f64> {
    let basis = |v: [Vector3<f64>; 2]| {
        let first = v[0].normalize();
        let second = v[0].cross(&v[1]).normalize();
        Matrix3::from_columns(&[first, second, first.cross(&second)])
    };
    basis(seen_b) * basis(known_n).transpose()
}

/// The same from any number of them, with their weights.
pub fn best(seen: &[(Vector3<f64>, Vector3<f64>, f64)]) -> Matrix3<f64> {
    let b: Matrix3<f64> = seen
        .iter()
        .map(|(w, v, weight)| w.normalize() * v.normalize().transpose() * *weight)
        .sum();
    let svd = b.svd(true, true);
    let (u, v_t) = (svd.u.expect("asked for"), svd.v_t.expect("asked for"));
    let handed = Vector3::new(1.0, 1.0, u.determinant() * v_t.determinant());
    u * Matrix3::from_diagonal(&handed) * v_t
}
