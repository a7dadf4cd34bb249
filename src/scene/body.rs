//! The bodies of the world: what every method asks of them, found once when a scene is loaded.

use super::energy::Shape;
use super::{Material, Object};
use crate::geometry::AreaTable;
use crate::math::Aabb;
use crate::optics::Medium;
use std::sync::Arc;

/// A set of parts with one medium inside: the surface of one object of the scene file, or of several that are one body. Methods keep what they need
/// besides: models and caches, distances and photons.
pub struct Body {
    /// Index of its surface in [`super::Scene::objects`].
    pub object: u32,
    /// Names of the objects of the scene file that it is made of.
    pub parts: Vec<String>,
    /// What fills it.
    pub medium: Medium,
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
    /// One for each object; `None` where there is no medium behind it, or no area.
    pub fn all(objects: &[Object], materials: &[Material]) -> Vec<Option<Arc<Self>>> {
        let of = |(index, object): (u32, &Object)| {
            let medium = materials[object.material].surface.medium()?;
            let (bounds, table) = (object.mesh.bounds()?, AreaTable::new(&object.mesh)?);
            let shape = Shape::of(object);
            Some(Arc::new(Self {
                object: index,
                parts: object.parts.clone(),
                medium,
                bounds,
                table,
                closed: object.findings.volume.is_some_and(|v| v > 0.0),
                thickness: shape.map(|shape| shape.thickness),
                curvature: shape.map(|shape| shape.curvature),
            }))
        };
        (0..).zip(objects).map(of).collect()
    }

    /// The sheet, rod or ball that it is most like.
    pub(super) fn shape(&self) -> Option<Shape> {
        Some(Shape { thickness: self.thickness?, curvature: self.curvature? })
    }
}
