//! Quaternions x, y, z, w of length 1.

/// A rotation about one of the axes, radians.
pub(crate) fn about(axis: usize, angle_rad: f64) -> [f64; 4] {
    let (sin, cos) = (angle_rad / 2.0).sin_cos();
    let mut quaternion = [0.0, 0.0, 0.0, cos];
    quaternion[axis] = sin;
    quaternion
}

/// The rotation `b`, and `a` after it.
pub(crate) fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// A vector after a rotation.
pub(crate) fn turned(quaternion: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let [qx, qy, qz, qw] = quaternion;
    let [x, y, z, _] = product(product(quaternion, [x, y, z, 0.0]), [-qx, -qy, -qz, qw]);
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn rotations_follow_each_other() {
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(turned(about(2, FRAC_PI_2), [1.0, 0.0, 5.0]), [0.0, 1.0, 5.0]));
        let both = product(about(0, FRAC_PI_2), about(2, FRAC_PI_2));
        assert!(near(turned(both, [1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]));
    }
}
