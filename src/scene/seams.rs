//! Edges of one mesh that leave open where its inside is.

use super::ObstacleKind;
use crate::geometry::Solid;
use crate::words::{counted, percent};

/// A mesh of which more than this share is holes has no inside.
pub(super) const MOSTLY_HOLES: f64 = 0.05;

/// Edges that leave open what is inside.
pub(super) fn seams(solid: &Solid, gap: f64, say: &mut impl FnMut(ObstacleKind, String, &str)) {
    let seams = &solid.seams;
    if seams.repeated > 0 {
        let what = counted(seams.repeated, "triangle repeats another", "triangles repeat another");
        say(ObstacleKind::Faces, what, "--repair removes what is there twice");
    }
    if seams.mixed > 0 {
        let what = format!("faces disagree about the outside along {}", counted(seams.mixed, "edge", "edges"));
        say(ObstacleKind::Faces, what, "--repair turns them");
    }
    if seams.walls > 0 {
        let what = format!(
            "{} to three triangles or more, as walls inside a body or fins on it have them",
            counted(seams.walls, "edge belongs", "edges belong")
        );
        say(ObstacleKind::Walls, what, "remove the faces between the parts");
    }
    let (share, edges) = (percent(seams.hole_share), seams.open);
    if seams.hole_share > MOSTLY_HOLES {
        let what = format!(
            "an open sheet has no inside ({} to one triangle alone; the openings are {share} of its surface)",
            counted(edges, "edge belongs", "edges belong")
        );
        say(
            ObstacleKind::Sheet,
            what,
            "give it a thickness (the key of the object), or close the openings of a solid body",
        );
    } else if edges > 0 {
        let what = counted(edges, "edge is the rim of a hole", "edges are rims of holes");
        say(ObstacleKind::Holes, format!("{what}, {share} of its surface"), "close them");
    }
    if solid.parts.iter().any(|p| p.closed && p.volume.abs() <= gap * p.area && p.area > 0.0) {
        let what = format!("a closed part encloses nothing (thinner than {:.1e} units)", 2.0 * gap);
        say(ObstacleKind::Sheet, what, "give it a thickness");
    }
}
