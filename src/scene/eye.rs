//! Where rays start, if not in one point: the rectangle around the lens, or the plane of an orthographic camera. What medium a ray
//! starts in is told by the camera's position alone, so that no body may begin between there and where a ray starts.

use super::{CameraEntry, Projection, Scene};
use crate::error::{Error, Result};
use crate::geometry::{Side, reaches_into};
use crate::words::short;
use rayon::prelude::*;

/// What counts as touching, over the farthest coordinate.
const GAP: f64 = 1e-6;

/// Refuses a camera whose rays start on both sides of a body's surface.
pub(super) fn refuse_cut(entry: &CameraEntry, scene: &Scene) -> Result<()> {
    let Some([middle, right, up]) = scene.camera.window() else { return Ok(()) };
    let view = right.cross(up).normalize();
    for object in scene.objects.iter().filter(|o| scene.materials[o.material].surface.is_body()) {
        let Some(bounds) = object.mesh.bounds() else { continue };
        let gap = GAP * bounds.farthest().max(middle.abs().max_element());
        let sides =
            [right, up, view * gap].map(|edge| [edge, -edge].map(|edge| Side { at: middle + edge, normal: -edge }));
        let sides = sides.as_flattened();
        let cut = |t: u32| reaches_into(object.mesh.corners(t), sides);
        if !(0..object.mesh.triangles.len() as u32).into_par_iter().any(cut) {
            continue;
        }
        let (at, name) = (&entry.at, &object.name);
        return Err(Error::scene(if matches!(entry.projection, Projection::Orthographic { .. }) {
            format!(
                "{at}: the plane through `camera.position` on which parallel rays start, {} x {} units, passes through object {name:?}: \
                 some would start inside; move `camera.position` back along the view, which changes nothing else in the picture",
                short(2.0 * right.length()),
                short(2.0 * up.length()),
            )
        } else {
            format!(
                "{at}: `camera.aperture` is {}, and so wide a lens reaches through the surface of object {name:?}: some rays would \
                 start inside; take a smaller one, or move `camera.position`",
                short(2.0 * right.length())
            )
        }));
    }
    Ok(())
}
