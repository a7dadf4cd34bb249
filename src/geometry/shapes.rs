//! Simple shapes as triangles, for lights, floors and furnaces.

use super::{CornerUv, RawMesh, RawNormals};
use crate::math::DVec3;

/// A parallelogram with corners `centre` ± `edge_u` ± `edge_v`, both half edges; its outside is the side that
/// `edge_u` x `edge_v` points to.
pub fn rectangle(centre: DVec3, edge_u: DVec3, edge_v: DVec3) -> RawMesh {
    RawMesh {
        positions: vec![
            centre - edge_u - edge_v,
            centre + edge_u - edge_v,
            centre + edge_u + edge_v,
            centre - edge_u + edge_v,
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..RawMesh::default()
    }
}

/// Texture coordinates of [`rectangle`]: u from 0 to 1 along `edge_u`, v along `edge_v`.
pub fn rectangle_uv() -> Vec<Option<CornerUv>> {
    vec![Some([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), Some([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]])]
}

/// A sphere of `rings` bands from pole to pole (along y) and `segments` around, rings >= 2, segments >= 3, with the
/// sphere's own normals. The vertices lie on the sphere, the triangles a little inside.
pub fn sphere(centre: DVec3, radius: f64, rings: u32, segments: u32) -> RawMesh {
    debug_assert!(rings >= 2 && segments >= 3);
    let mut vectors = vec![DVec3::Y];
    for i in 1..rings {
        let (s, c) = (std::f64::consts::PI * f64::from(i) / f64::from(rings)).sin_cos();
        vectors.extend((0..segments).map(|j| {
            let (sin_phi, cos_phi) = (std::f64::consts::TAU * f64::from(j) / f64::from(segments)).sin_cos();
            DVec3::new(s * cos_phi, c, s * sin_phi)
        }));
    }
    vectors.push(DVec3::NEG_Y);
    let (last, at) = (vectors.len() as u32 - 1, |i: u32, j: u32| 1 + (i - 1) * segments + j % segments);
    let mut triangles = Vec::with_capacity(2 * (rings as usize - 1) * segments as usize);
    for j in 0..segments {
        triangles.push([0, at(1, j + 1), at(1, j)]);
        for i in 1..rings - 1 {
            triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
        }
        triangles.push([last, at(rings - 1, j), at(rings - 1, j + 1)]);
    }
    RawMesh {
        positions: vectors.iter().map(|n| centre + *n * radius).collect(),
        normals: Some(RawNormals { triangles: triangles.iter().copied().map(Some).collect(), vectors }),
        triangles,
        ..RawMesh::default()
    }
}

/// Texture coordinates of [`sphere`] with as many `rings` and `segments`: longitude to the right as seen from outside, 0 and 1 at
/// -z, 1/2 at +z, and latitude from 0 at -y to 1 at +y. Where no edge lies at -z, triangles there reach a little beyond 0 or 1.
pub fn sphere_uv(rings: u32, segments: u32) -> Vec<Option<CornerUv>> {
    let longitude = |j: f64| 0.75 - j / f64::from(segments);
    let mut out = Vec::with_capacity(2 * (rings as usize - 1) * segments as usize);
    for j in 0..segments {
        let middle = longitude(f64::from(j) + 0.5);
        let u = |k: f64| (longitude(f64::from(j) + k) - middle.floor()) as f32;
        let at = |i: u32, k: f64| [u(k), (1.0 - f64::from(i) / f64::from(rings)) as f32];
        out.push(Some([at(0, 0.5), at(1, 1.0), at(1, 0.0)]));
        for i in 1..rings - 1 {
            out.push(Some([at(i, 0.0), at(i, 1.0), at(i + 1, 1.0)]));
            out.push(Some([at(i, 0.0), at(i + 1, 1.0), at(i + 1, 0.0)]));
        }
        out.push(Some([at(rings, 0.5), at(rings - 1, 0.0), at(rings - 1, 1.0)]));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Enclosed volume by the divergence theorem: positive if the winding is outward.
    fn volume(mesh: &RawMesh) -> f64 {
        let corner = |i: u32| mesh.positions[i as usize];
        mesh.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
    }

    #[test]
    fn a_sphere_is_closed_outward_and_nears_its_volume() {
        let ideal = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
        let mut last = 1.0;
        for n in [8, 16, 32, 64] {
            let mesh = sphere(DVec3::ZERO, 2.0, n, 2 * n);
            let missing = 1.0 - volume(&mesh) / ideal;
            assert!(missing > 0.0 && missing < 0.3 * last, "{n}: {missing}");
            last = missing;
            let single = mesh.recentred(DVec3::ZERO);
            for t in 0..single.triangles.len() as u32 {
                assert!(single.area(t) > 0.0);
                let p = single.point(t, 0.3, 0.3);
                assert!(p.n.dot(p.n_geometric) > 0.8 && p.n.dot(p.x.as_vec3().normalize()) > 0.999);
            }
        }
        assert!((volume(&sphere(DVec3::splat(5.0), 2.0, 64, 128)) / ideal - 1.0).abs() < 0.01);
        assert!((volume(&sphere(DVec3::ZERO, 2.0, 2, 3))) > 0.0);
    }

    /// At each corner the coordinates are longitude and latitude of its place, and all of them from 0 to 1.
    #[test]
    fn coordinates_of_a_sphere_are_longitude_and_latitude() {
        for (rings, segments) in [(8, 16), (2, 3), (5, 7)] {
            let (mesh, uv) = (sphere(DVec3::ZERO, 2.0, rings, segments), sphere_uv(rings, segments));
            assert_eq!(uv.len(), mesh.triangles.len());
            for (triangle, uv) in mesh.triangles.iter().zip(uv.into_iter().flatten()) {
                for (i, [u, v]) in triangle.iter().zip(uv) {
                    let [u, v] = [u, v].map(f64::from);
                    let (latitude, longitude) = ((v - 0.5) * std::f64::consts::PI, (u - 0.5) * std::f64::consts::TAU);
                    let at =
                        DVec3::new(latitude.cos() * longitude.sin(), latitude.sin(), latitude.cos() * longitude.cos());
                    assert!((at * 2.0).distance(mesh.positions[*i as usize]) < 1e-5, "{u} {v}");
                    let beyond = if segments % 4 == 0 { 1e-6 } else { 0.5 / f64::from(segments) };
                    assert!(u >= -beyond && u <= 1.0 + beyond, "{u}");
                }
            }
        }
    }

    #[test]
    fn a_rectangle_faces_u_cross_v() {
        let mesh = rectangle(DVec3::new(1.0, 2.0, 3.0), DVec3::X * 2.0, DVec3::Y).recentred(DVec3::ZERO);
        assert_eq!(mesh.area(0) + mesh.area(1), 8.0);
        assert_eq!([mesh.geometric_normal(0), mesh.geometric_normal(1)], [crate::math::Vec3::Z; 2]);
    }
}
