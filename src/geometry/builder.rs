//! Faces over numbered vertices, as PLY, STL and glTF have them, on their way to a [`RawMesh`].

use super::odd_polygons::OddPolygons;
use super::parts::{Label, Labelled};
use super::polygon::triangulate;
use super::{CornerUv, RawMesh};
use crate::math::DVec3;

/// The vertices of a file; a list but the first may end before it: later vertices have none then.
#[derive(Default)]
pub(super) struct Vertices {
    /// Finite.
    pub positions: Vec<DVec3>,
    /// Unit vectors, or 0.
    pub normals: Vec<DVec3>,
    /// (u, v), v upwards; what is not finite counts as missing.
    pub uv: Vec<[f32; 2]>,
}

/// Takes faces one by one. Vertices that no face has are left out, the others are in the order of their first use, as `tobj` has
/// them: a mesh is the same from every format.
pub(super) struct Builder {
    pub vertices: Vertices,
    /// For each vertex its number in the mesh; [`UNUSED`] where it has none yet.
    numbers: Vec<u32>,
    mesh: RawMesh,
    labelled: Labelled,
    odd: OddPolygons,
    corners: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

const UNUSED: u32 = u32::MAX;

impl Builder {
    /// With `uv` texture coordinates are kept; `place` tells where a polygon stands, before a number: "in line".
    pub(super) fn new(uv: bool, place: &'static str) -> Self {
        let mesh = RawMesh { uv: uv.then(Vec::new), ..RawMesh::default() };
        let (corners, triangles) = (Vec::new(), Vec::new());
        Self {
            vertices: Vertices::default(),
            numbers: Vec::new(),
            mesh,
            labelled: Labelled::default(),
            odd: OddPolygons::new(place),
            corners,
            triangles,
        }
    }

    /// Triangles so far.
    pub(super) fn count(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// What the next faces are called.
    pub(super) fn label(&mut self, label: Label) {
        self.labelled.change(|next| *next = label);
    }

    /// A face of three corners or more, which are there, at place number `place`; `uv` of its corners, or else its vertices' own.
    pub(super) fn face(&mut self, corners: &[u32], uv: Option<&[[f32; 2]]>, place: usize) {
        self.numbers.resize(self.vertices.positions.len(), UNUSED);
        for &corner in corners {
            let (corner, next) = (corner as usize, self.mesh.positions.len() as u32);
            if self.numbers[corner] != UNUSED {
                continue;
            }
            self.numbers[corner] = next;
            self.mesh.positions.push(self.vertices.positions[corner]);
            if let Some(n) = self.vertices.normals.get(corner) {
                let normals = self.mesh.normals.get_or_insert_default();
                normals.vectors.resize(next as usize, DVec3::ZERO);
                normals.vectors.push(*n);
            }
        }
        self.triangles.clear();
        if corners.len() == 3 {
            self.triangles.push([0, 1, 2]);
        } else {
            self.corners.clear();
            self.corners.extend(corners.iter().map(|&i| self.vertices.positions[i as usize]));
            let shape = triangulate(&self.corners, &mut self.triangles);
            self.odd.count(shape, place);
        }
        let before = self.mesh.triangles.len();
        self.labelled.face(before);
        let number = |i: u32| self.numbers[corners[i as usize] as usize];
        self.mesh.triangles.extend(self.triangles.iter().map(|t| t.map(number)));
        if let Some(normals) = &mut self.mesh.normals {
            // Of faces before the first that has some.
            normals.triangles.resize(before, None);
            let has = |i: &u32| normals.vectors.get(*i as usize).is_some_and(|n| *n != DVec3::ZERO);
            let shaded = self.mesh.triangles[before..].iter().map(|t| t.iter().all(has).then_some(*t));
            normals.triangles.extend(shaded);
        }
        if let Some(all) = &mut self.mesh.uv {
            let at = |i: u32| {
                let uv = match uv {
                    Some(uv) => uv.get(i as usize),
                    None => self.vertices.uv.get(corners[i as usize] as usize),
                };
                uv.copied().filter(|uv| uv.iter().all(|x| x.is_finite()))
            };
            let of = |t: &[u32; 3]| -> Option<CornerUv> { Some([at(t[0])?, at(t[1])?, at(t[2])?]) };
            all.extend(self.triangles.iter().map(of));
        }
    }

    /// The mesh, with what is odd about its polygons among its remarks.
    pub(super) fn finish(mut self) -> RawMesh {
        drop(self.vertices);
        drop(self.numbers);
        // Lists that grew may have twice the place that they need.
        self.mesh.positions.shrink_to_fit();
        self.mesh.triangles.shrink_to_fit();
        if let Some(normals) = &mut self.mesh.normals {
            normals.vectors.shrink_to_fit();
            normals.triangles.shrink_to_fit();
        }
        self.mesh.remarks.extend(self.odd.remarks());
        self.mesh.parts = self.labelled.into_parts();
        if self.mesh.uv.as_ref().is_some_and(|uv| uv.iter().all(Option::is_none)) {
            self.mesh.uv = None;
        }
        self.mesh
    }
}
