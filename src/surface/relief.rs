//! Normals by a picture: what is finer than triangles, as it reflects.

use super::Texture;
use crate::geometry::SurfacePoint;
use crate::math::Vec3;
use std::sync::Arc;

/// Shading normals bent by a picture; triangles, and with them what is hidden and where light enters, stay where they are.
#[derive(Clone, Debug)]
pub enum Relief {
    /// A normal map: x along u, y along v, z along the normal, each from -1 at 0 to 1 at 1, x and y times the number.
    Normals(Arc<Texture>, f32),
    /// Heights above the surface, the red channel times the number \[unit\].
    Heights(Arc<Texture>, f32),
}

impl Relief {
    /// The point with its shading normal bent. `tangents` are its derivatives by both texture coordinates [unit]; where there are none, or the bent normal
    /// would lie below the triangle, it stays as it is.
    pub fn bend(&self, at: SurfacePoint, tangents: Option<[Vec3; 2]>) -> SurfacePoint {
        let Some([along_u, along_v]) = tangents else { return at };
        let n = at.n;
        let bent = match self {
            Self::Normals(map, strength) => {
                let t = (along_u - n * n.dot(along_u)).normalize_or_zero();
                let b = n.cross(t);
                let b = if b.dot(along_v) < 0.0 { -b } else { b };
                let [x, y, z] = map.at(at.uv).0.map(|c| 2.0 * c - 1.0);
                t * (x * strength) + b * (y * strength) + n * z
            }
            Self::Heights(map, height) => {
                let [du, dv] = map.slope(at.uv).map(|s| s * height);
                // Of the plane across n, as the interpolated surface is.
                let [u, v] = [along_u, along_v].map(|d| d - n * n.dot(d));
                let up = (u + n * du).cross(v + n * dv);
                if up.dot(n) < 0.0 { -up } else { up }
            }
        };
        match bent.try_normalize() {
            Some(bent) if bent.dot(at.n_geometric) > 0.0 => SurfacePoint { n: bent, ..at },
            _ => at,
        }
    }

    /// The picture.
    pub fn texture(&self) -> &Arc<Texture> {
        match self {
            Self::Normals(map, _) | Self::Heights(map, _) => map,
        }
    }

    /// What `check` says of it.
    pub fn text(&self) -> String {
        match self {
            Self::Normals(map, strength) => format!("normals by {} times {strength}", map.text()),
            Self::Heights(map, height) => format!("heights by {} up to {height} units", map.text()),
        }
    }
}
