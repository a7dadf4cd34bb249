//! An orthonormal frame about a normal.

use glam::{Mat3, Vec3};

/// A right-handed orthonormal frame with the unit vector `normal` as its third axis: times a vector in its coordinates it is
/// that vector in the world. Without branches and singular directions [Duff et al. 2017].
#[inline]
pub fn frame(normal: Vec3) -> Mat3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    Mat3::from_cols(tangent, bitangent, normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_orthonormal_and_right_handed_for_every_octant_and_pole() {
        let mut normals = vec![Vec3::Z, -Vec3::Z, Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y];
        for i in 0..8 {
            let s = |bit: i32| if i >> bit & 1 == 0 { 1.0 } else { -1.0 };
            normals.push(Vec3::new(0.3 * s(0), 0.5 * s(1), 1e-4 * s(2)).normalize());
        }
        for n in normals {
            let f = frame(n);
            assert!((f * f.transpose()).abs_diff_eq(Mat3::IDENTITY, 1e-6) && f.determinant() > 0.0, "{n}");
            assert_eq!(f * Vec3::Z, n);
        }
    }
}
