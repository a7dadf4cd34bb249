//! A mesh in f64 as it is typed or made, on its way into a scene: placed, turned inside out, given smooth normals,
//! moved to the scene's centre.

use std::collections::HashMap;

use super::{CornerUv, Mesh, Normals, Parts};
use crate::math::{Aabb, DAffine3, DVec3, Vec3};

/// What a mesh file or a shape holds, before any transform.
#[derive(Clone, Debug, Default)]
pub struct RawMesh {
    /// Positions as typed.
    pub positions: Vec<DVec3>,
    /// Indices into `positions`, three a triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Normals, where there are any.
    pub normals: Option<RawNormals>,
    /// Texture coordinates, where there are any: one entry for each triangle, `None` of one without.
    pub uv: Option<Vec<Option<CornerUv>>>,
    /// For each vertex a number: of vertices at one place those of one number are one. Empty where all are.
    pub groups: Vec<u32>,
    /// What its file calls its triangles; empty where nobody asks for parts, and after anything that numbers triangles anew.
    pub parts: Parts,
    /// What a user should hear of: what the file has besides, and what is odd about its polygons.
    pub remarks: Vec<String>,
}

/// Normals with indices of their own; a triangle may be without.
#[derive(Clone, Debug, Default)]
pub struct RawNormals {
    /// Unit vectors.
    pub vectors: Vec<DVec3>,
    /// One entry for each triangle of the mesh; `None` shades it with its own normal.
    pub triangles: Vec<Option<[u32; 3]>>,
}

impl RawMesh {
    /// The box around all vertices; `None` without vertices.
    pub fn bounds(&self) -> Option<Aabb> {
        (!self.positions.is_empty()).then(|| Aabb::around(self.positions.iter().copied()))
    }

    /// Triangles that lack normals while others have them.
    pub fn without_normals(&self) -> usize {
        self.normals.as_ref().map_or(0, |n| n.triangles.iter().filter(|t| t.is_none()).count())
    }

    /// Triangles that lack texture coordinates.
    pub fn without_uv(&self) -> usize {
        self.uv.as_ref().map_or(self.triangles.len(), |uv| uv.iter().filter(|t| t.is_none()).count())
    }

    /// All of these as one mesh, each with whether it is closed. Closed ones keep their corners for themselves: where they touch, faces of two
    /// parts lie in each other. Open ones hang together where their corners are at exactly one place, as two half shells do at their rim.
    pub fn joined(parts: Vec<(Self, bool)>) -> Self {
        let mut all = Self::default();
        let shaded = parts.iter().any(|(mesh, _)| mesh.normals.is_some());
        let textured = parts.iter().any(|(mesh, _)| mesh.uv.is_some());
        let (mut normals, mut uv) = (RawNormals::default(), Vec::new());
        for (number, (mesh, closed)) in (1..).zip(parts) {
            let (base, first) = (all.positions.len() as u32, normals.vectors.len() as u32);
            all.groups.extend(vec![if closed { number } else { 0 }; mesh.positions.len()]);
            all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| base + i)));
            all.positions.extend(mesh.positions);
            all.remarks.extend(mesh.remarks);
            match mesh.normals {
                Some(own) => {
                    normals.triangles.extend(own.triangles.iter().map(|t| t.map(|t| t.map(|i| first + i))));
                    normals.vectors.extend(own.vectors);
                }
                None => normals.triangles.resize(all.triangles.len(), None),
            }
            if textured {
                uv.extend(mesh.uv.into_iter().flatten());
                uv.resize(all.triangles.len(), None);
            }
        }
        all.normals = shaded.then_some(normals);
        all.uv = textured.then_some(uv);
        all
    }

    /// Applies `transform`, which must have an inverse. A mirroring map also turns the triangles' winding, so that the outside
    /// stays outside; normals follow the inverse transpose.
    #[must_use]
    pub fn placed(mut self, transform: DAffine3) -> Self {
        let linear = transform.matrix3;
        for p in &mut self.positions {
            *p = transform.transform_point3(*p);
        }
        if let Some(normals) = &mut self.normals {
            let inverse_transpose = linear.inverse().transpose();
            for n in &mut normals.vectors {
                *n = (inverse_transpose * *n).normalize_or_zero();
            }
        }
        if linear.determinant() < 0.0 {
            self.turn_winding();
        }
        self
    }

    /// The same surface with inside and outside exchanged.
    #[must_use]
    pub fn flipped(mut self) -> Self {
        self.turn_winding();
        if let Some(normals) = &mut self.normals {
            normals.vectors.iter_mut().for_each(|n| *n = -*n);
        }
        self
    }

    fn turn_winding(&mut self) {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        if let Some(normals) = &mut self.normals {
            normals.triangles.iter_mut().flatten().for_each(|t| t.swap(1, 2));
        }
        self.uv.iter_mut().flatten().flatten().for_each(|t| t.swap(1, 2));
    }

    /// For each vertex the first one at exactly the same position.
    fn first_at(&self) -> Vec<u32> {
        let mut first_at = HashMap::with_capacity(self.positions.len());
        (0_u32..)
            .zip(&self.positions)
            // + 0.0 makes -0 and 0 one position.
            .map(|(i, p)| *first_at.entry(p.to_array().map(|x| (x + 0.0).to_bits())).or_insert(i))
            .collect()
    }

    /// Triangles whose corners are at positions of no other triangle.
    pub fn sharing_no_corner(&self) -> usize {
        let first_at = self.first_at();
        let mut uses = vec![0_u32; self.positions.len()];
        let corners = |t: &[u32; 3]| t.map(|i| first_at[i as usize] as usize);
        for corner in self.triangles.iter().flat_map(corners) {
            uses[corner] = uses[corner].saturating_add(1);
        }
        self.triangles.iter().filter(|t| corners(t).iter().all(|&corner| uses[corner] == 1)).count()
    }

    /// Normals computed anew: at each position the mean of the normals of the triangles around it, weighted by their
    /// angles there. Vertices at exactly the same position count as one.
    #[must_use]
    pub fn with_smooth_normals(mut self) -> Self {
        let welded = self.first_at();
        let mut vectors = vec![DVec3::ZERO; self.positions.len()];
        for t in &self.triangles {
            let p = t.map(|i| self.positions[i as usize]);
            let n = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
            for corner in 0..3 {
                let (u, v) = (p[(corner + 1) % 3] - p[corner], p[(corner + 2) % 3] - p[corner]);
                vectors[welded[t[corner] as usize] as usize] += n * u.cross(v).length().atan2(u.dot(v));
            }
        }
        vectors.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        let triangles = self.triangles.iter().map(|t| {
            let t = t.map(|i| welded[i as usize]);
            t.iter().all(|&i| vectors[i as usize] != DVec3::ZERO).then_some(t)
        });
        self.normals = Some(RawNormals { triangles: triangles.collect(), vectors });
        self
    }

    /// The mesh relative to `centre`.
    pub fn recentred(&self, centre: DVec3) -> Mesh {
        let mut mesh = Mesh {
            positions: self.positions.iter().map(|p| *p - centre).collect(),
            triangles: self.triangles.clone(),
            groups: self.groups.clone(),
            uv: self.uv.as_ref().map(|uv| uv.iter().map(|t| t.unwrap_or_default()).collect()),
            ..Mesh::default()
        };
        mesh.normals = self.normals.as_ref().map(|normals| {
            let mut vectors: Vec<Vec3> = normals.vectors.iter().map(|n| n.as_vec3().normalize_or(Vec3::Z)).collect();
            let triangles = (0_u32..)
                .zip(&normals.triangles)
                .map(|(t, given)| {
                    given.unwrap_or_else(|| {
                        vectors.push(mesh.geometric_normal(t).normalize_or(Vec3::Z));
                        [vectors.len() as u32 - 1; 3]
                    })
                })
                .collect();
            Normals { vectors, triangles }
        });
        mesh
    }
}
