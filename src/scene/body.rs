//! The bodies of the world: what every method asks of them, found once when a scene is loaded.

use crate::geometry::{AreaTable, Findings, Mesh};
use crate::math::Aabb;

/// A set of parts with one medium inside: the surface of one object of the scene file, or of several that are one body. Methods keep what they need
/// besides: models and caches, distances and photons. The medium is that of the surface ([`super::Scene::surface`]).
pub struct Body {
    /// Index of its surface in [`super::Scene::objects`].
    pub object: u32,
    /// Names of the objects of the scene file that it is made of.
    pub parts: Vec<String>,
    /// Its box \[unit\].
    pub bounds: Aabb,
    /// Points with equal chance per area of its surface. Places that are kept in f32 are relative to the table's centre, the middle of the box.
    pub table: AreaTable,
    /// Whether its surface encloses a volume and looks outwards: no edge is a rim.
    pub closed: bool,
    /// Way through it along the normal \[unit\], as of the sheet, rod or ball that it is most like; `None` where it encloses nothing.
    pub thickness: Option<f64>,
    /// Mean curvature of that \[1/unit\]: 0 of a sheet, 1/r of a ball.
    pub curvature: Option<f64>,
}

impl Body {
    /// What is behind the surface `mesh`, number `object` in the world, in which `found` is wrong; made of objects of these names. `None` without area.
    pub fn new(object: u32, parts: &[String], mesh: &Mesh, found: &Findings) -> Option<Self> {
        let (bounds, table) = (mesh.bounds()?, AreaTable::new(mesh)?);
        let shape = Shape::of(mesh, found);
        Some(Self {
            object,
            parts: parts.to_vec(),
            bounds,
            table,
            closed: found.volume.is_some_and(|v| v > 0.0),
            thickness: shape.map(|shape| shape.thickness),
            curvature: shape.map(|shape| shape.curvature),
        })
    }

    /// The sheet, rod or ball that it is most like.
    pub(super) fn shape(&self) -> Option<Shape> {
        Some(Shape { thickness: self.thickness?, curvature: self.curvature? })
    }
}

/// The sheet, rod or ball that a closed body is most like, from volume V, area S and the mean M of the curvature over it, all of
/// the mesh itself: 2V/S is the thickness of a sheet, the radius of a rod, two thirds of the radius of a ball, and 2V/S M
/// is 0, 1/2, 2/3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    /// Way through it along the normal \[unit\].
    pub thickness: f64,
    /// Mean curvature [1/unit]: 0 of a sheet, 1/2r of a rod, 1/r of a ball.
    pub curvature: f64,
}

impl Shape {
    /// `None` for a mesh that encloses nothing.
    pub fn of(mesh: &Mesh, found: &Findings) -> Option<Self> {
        let (volume, bend) = (found.volume.filter(|v| *v > 0.0)?, found.bend?);
        let area: f64 = (0..mesh.triangles.len() as u32).map(|t| mesh.area(t)).sum();
        let shortest = mesh.bounds()?.extent().min_element();
        let (sheet, curvature) = (2.0 * volume / area, bend / area);
        // Convex bodies have at most 2/3 [Minkowski].
        let round = (sheet * curvature).clamp(0.0, 2.0 / 3.0);
        let thickness = (sheet / (1.0 - round)).min(shortest);
        thickness.is_finite().then_some(Self { thickness, curvature: round / sheet })
    }
}
