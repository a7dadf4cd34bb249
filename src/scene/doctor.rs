//! What is wrong with the objects' meshes, and what marmor does about it.

use super::{Object, Surface};
use crate::geometry::Seam;

/// A finding about an object's mesh, in words.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Remark {
    /// What was found and what marmor does about it.
    pub text: String,
    /// Whether the picture suffers: then a render says it too.
    pub warns: bool,
}

/// Vertices lie on a grid: a step of more than this share of the object's size shows.
pub(super) const COARSE: f64 = 1e-4;

/// What there is to say about `object` with this surface; nothing if its mesh is sound.
pub(super) fn remarks(object: &Object, surface: &Surface) -> Vec<Remark> {
    let (found, mut remarks) = (&object.findings, Vec::new());
    let mut say = |warns: bool, text: String| remarks.push(Remark { text, warns });
    let all = found.triangles;
    let translucent = matches!(surface, Surface::Translucent(_));
    let emissive = matches!(surface, Surface::Emissive { .. });
    let one_sided = translucent || matches!(surface, Surface::Emissive { two_sided: false, .. });
    if emissive && found.zero_area == all {
        say(true, format!("all {all} triangles have no area: it sends out no light"));
    } else if found.zero_area > 0 {
        say(true, format!("{} of {all} triangles have no area; rays and samples pass them by", found.zero_area));
    }
    if found.duplicates > 0 {
        let n = found.duplicates;
        let (warns, effect) = match (translucent, emissive) {
            (true, _) => (true, "the light that enters there counts twice; --repair removes them"),
            (_, true) => (true, "the light they send counts twice; --repair removes them"),
            _ => (false, "harmless: rays meet one of them"),
        };
        say(warns, format!("{n} of {all} triangles repeat another: {effect}"));
    }
    if found.mixed_edges > 0 {
        let n = found.mixed_edges;
        let effect = if one_sided {
            "some faces look the wrong way and stay dark; --repair turns them"
        } else {
            "some faces look the wrong way: harmless, both sides are alike"
        };
        say(one_sided, format!("faces disagree about the outside along {n} edges: {effect}"));
    }
    if let Some(volume) = found.volume.filter(|_| found.inside_out()) {
        let effect = match (translucent, one_sided) {
            (true, _) => "light enters from outside only, so it stays dark",
            (_, true) => "it shines inwards",
            _ => "harmless, both sides are alike",
        };
        let remedy = match (one_sided, object.flipped) {
            (true, true) => "; leave out flip = true, or --repair turns it",
            (true, false) => "; set flip = true, or --repair turns it",
            _ => "",
        };
        say(one_sided, format!("its faces look inwards (volume {volume:.4e} unit³): {effect}{remedy}"));
    }
    if let Some(seam) = found.seam {
        let Seam { within, share, corners, closed } = seam;
        let effect = if translucent { "so the body is not closed" } else { "harmless: nothing is inside" };
        say(
            translucent,
            format!(
                "{closed} of {} edges that belong to one triangle alone run along another such edge within {within:.1e} units \
                 ({share:.0e} of its size): {corners} corners that should be one with others are not, {effect}; --repair welds them",
                found.open_edges
            ),
        );
    }
    let holes = found.open_edges - found.seam.map_or(0, |seam| seam.closed);
    // Walls and lamps are sheets: nothing is inside.
    if holes > 0 && translucent {
        say(
            true,
            format!(
                "{holes} edges belong to one triangle alone, the rims of holes: the surface is rendered as it is, as if the \
                 medium ended at the rim; close the holes for a solid body"
            ),
        );
    }
    if found.non_manifold_edges > 0 {
        say(
            false,
            format!(
                "{} edges belong to more than two triangles: harmless to surfaces; what is inside is not defined there",
                found.non_manifold_edges
            ),
        );
    }
    if let Some((lo, hi)) = object.mesh.bounds() {
        let farthest = lo.abs().max(hi.abs()).max_element();
        let (size, step) = ((hi - lo).length(), farthest * f64::EPSILON);
        if size > 0.0 && step > COARSE * size {
            say(
                true,
                format!(
                    "it is {size:.4e} units large and {farthest:.4e} units from the middle of the scene: even double \
                     precision puts its vertices on steps of {step:.1e} units; bring it nearer"
                ),
            );
        }
    }
    remarks
}
