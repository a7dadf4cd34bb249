//! An orthonormal frame about a normal.

use glam::Vec3;

/// Two unit tangents and a unit normal, right-handed: `tangent` x `bitangent` = `normal`.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    tangent: Vec3,
    bitangent: Vec3,
    normal: Vec3,
}

impl Frame {
    /// A frame whose third axis is the unit vector `normal`; free of branches and of singular directions
    /// [Duff et al. 2017, listing 3].
    #[inline]
    pub fn about(normal: Vec3) -> Self {
        let sign = 1.0_f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// The vector with coordinates `local` in this frame (z along the normal).
    #[inline]
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        self.tangent * local.x + self.bitangent * local.y + self.normal * local.z
    }
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
            let f = Frame::about(n);
            let (t, b) = (f.to_world(Vec3::X), f.to_world(Vec3::Y));
            assert!((t.cross(b) - n).length() < 1e-6, "{n}");
            assert!(t.dot(b).abs() < 1e-6 && (t.length() - 1.0).abs() < 1e-6, "{n}");
        }
    }
}
