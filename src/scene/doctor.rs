//! What is wrong with the objects' meshes, and what marmor does about it.

use super::{Object, ObstacleKind, Scene, Surface};
use crate::geometry::Seam;
use crate::words::{counted, either, short};

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

impl Scene {
    /// What there is to say about the mesh of one of [`Self::objects`]; nothing if it is sound.
    pub fn remarks(&self, object: &Object) -> Vec<Remark> {
        let mut remarks = remarks(object, &self.materials[object.material].surface);
        // Of sheets and walls their obstacles say it all.
        if object.findings.open_edges > 0 && self.has(object, ObstacleKind::Sheet) {
            remarks.retain(|r| !r.text.contains("rims of holes"));
        }
        if object.findings.non_manifold_edges > 0 && self.has(object, ObstacleKind::Walls) {
            remarks.retain(|r| !r.text.contains("more than two triangles"));
        }
        // A lamp around the camera is meant to shine inwards.
        let shines = self.materials[object.material].surface.shines();
        if shines && object.mesh.bounds().is_some_and(|bounds| bounds.contains(self.camera.origin)) {
            remarks.retain(|r| !r.text.contains("it shines inwards"));
        }
        remarks
    }
}

/// What there is to say about `object` with this surface; nothing if its mesh is sound.
fn remarks(object: &Object, surface: &Surface) -> Vec<Remark> {
    let (found, mut remarks) = (&object.findings, Vec::new());
    let mut say = |warns: bool, text: String| remarks.push(Remark { text, warns });
    let all = counted(found.triangles, "triangle", "triangles");
    let translucent = surface.is_translucent();
    let emissive = surface.emission.is_some();
    let one_sided = translucent || surface.emission.is_some_and(|e| !e.two_sided);
    if emissive && found.zero_area == found.triangles {
        let have = if found.triangles == 1 { "its one triangle has".into() } else { format!("all {all} have") };
        say(true, format!("{have} no area: it sends out no light"));
    } else if found.zero_area > 0 {
        let n = found.zero_area;
        let (have, them) = (either(n, "has", "have"), either(n, "it", "them"));
        say(true, format!("{n} of {all} {have} no area; rays and samples pass {them} by"));
    }
    if found.duplicates > 0 {
        let n = found.duplicates;
        let (warns, effect) = match (translucent, emissive) {
            (true, _) => (true, "the light that enters there counts twice; --repair removes what is there twice"),
            (_, true) => (true, "the light sent from there counts twice; --repair removes what is there twice"),
            _ => (false, "harmless: rays meet the one or the other"),
        };
        say(warns, format!("{n} of {all} {} another: {effect}", either(n, "repeats", "repeat")));
    }
    if found.mixed_edges > 0 {
        let n = counted(found.mixed_edges, "edge", "edges");
        let effect = if one_sided {
            "some faces look the wrong way and stay dark; --repair turns them"
        } else {
            "some faces look the wrong way: harmless, both sides are alike"
        };
        say(one_sided, format!("faces disagree about the outside along {n}: {effect}"));
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
        say(one_sided, format!("its faces look inwards (volume {} unit³): {effect}{remedy}", short(volume)));
    }
    if let Some(seam) = found.seam {
        let Seam { within, share, corners, closed } = seam;
        let effect = if translucent { "so the body is not closed" } else { "harmless: nothing is inside" };
        say(
            translucent,
            format!(
                "{closed} of {} to one triangle alone {} along another such edge within {within:.1e} units ({share:.0e} of \
                 its size): {} one with others {} not, {effect}; --repair welds {}",
                counted(found.open_edges, "edge that belongs", "edges that belong"),
                either(closed, "runs", "run"),
                counted(corners, "corner that should be", "corners that should be"),
                either(corners, "is", "are"),
                either(corners, "it", "them")
            ),
        );
    }
    let holes = found.open_edges - found.seam.map_or(0, |seam| seam.closed);
    // Walls and lamps are sheets: nothing is inside.
    if holes > 0 && translucent {
        say(
            true,
            format!(
                "{} to one triangle alone, the rims of holes: the surface is rendered as it is, as if the medium ended at \
                 the rim, and paths of `volume_path` that come there are lost and counted; close the holes for a solid body",
                counted(holes, "edge belongs", "edges belong")
            ),
        );
    }
    if found.non_manifold_edges > 0 {
        say(
            false,
            format!(
                "{} to more than two triangles: harmless to surfaces; what is inside is not defined there",
                counted(found.non_manifold_edges, "edge belongs", "edges belong")
            ),
        );
    }
    if let Some(bounds) = object.mesh.bounds() {
        let farthest = bounds.farthest();
        let (size, step) = (bounds.extent().length(), farthest * f64::EPSILON);
        if size > 0.0 && step > COARSE * size {
            say(
                true,
                format!(
                    "it is {} units large and {} units from the middle of the scene: even double \
                     precision puts its vertices on steps of {step:.1e} units; bring it nearer",
                    short(size),
                    short(farthest)
                ),
            );
        }
    }
    remarks
}
