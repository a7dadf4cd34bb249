//! What may stand in the way of a method, and what is said of it.

use super::options::MethodName;

/// Kinds of obstacles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ObstacleKind {
    /// Two media at one place: surfaces pass through each other.
    Crossing,
    /// Two media at one place: one inside the other.
    Nested,
    /// A body inside a stronger one.
    Hidden,
    /// Surfaces that lie in each other over an area.
    Touching,
    /// A mesh whose triangles do not share their corners, which lie close together.
    Unwelded,
    /// A surface without an inside.
    Sheet,
    /// Parts of a mesh that pass through each other, some of them open or looking inwards; an open part in a closed one.
    Uncounted,
    /// A mesh with holes.
    Holes,
    /// Little of a surface passes through itself or lies inside.
    Blemish,
    /// Faces that disagree about where inside is, or repeat others.
    Faces,
    /// Parts whose faces look inwards.
    Turned,
    /// Faces inside a body, between parts that share their edges.
    Walls,
    /// A lamp inside a body, wholly or partly.
    LampInside,
    /// A lamp in a face of a body.
    LampTouching,
    /// An opaque surface in a face of a body.
    OpaqueTouching,
    /// The camera inside a body.
    CameraInside,
    /// The camera in the surface of a body.
    CameraTouching,
    /// Too many faces in one place to look at.
    Unknown,
}

/// Something that a method may not be able to render, with its names, numbers and the remedy.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Obstacle {
    /// Which kind.
    pub kind: ObstacleKind,
    /// Names of the objects, bodies first.
    pub objects: Vec<String>,
    /// Where it stands in the scene file.
    pub at: String,
    /// What was found.
    pub what: String,
    /// What can be done.
    pub remedy: String,
    /// Whether a remark on the mesh says it already.
    pub(super) said: bool,
    /// Whether no medium of it scatters.
    #[serde(skip)]
    pub(super) clear: bool,
    /// Whether these are closed parts of one body, of which every method takes the union.
    #[serde(skip)]
    pub(super) united: bool,
}

impl Obstacle {
    /// Whether bodies, or parts of one, are in one place.
    pub(super) fn overlaps(&self) -> bool {
        use ObstacleKind::*;
        matches!(self.kind, Crossing | Nested | Hidden | Touching)
    }

    /// Whether `volume_path` refuses the scene for it, and why.
    pub fn refusal(&self) -> Option<String> {
        use ObstacleKind::*;
        let why = match self.kind {
            Unwelded | Sheet | Uncounted | Faces | Walls | Turned => "`volume_path` needs an inside",
            LampTouching | CameraTouching => "`volume_path` cannot tell whether that is inside",
            Crossing | Nested | Hidden | Touching | Holes | Blemish | LampInside | OpaqueTouching | CameraInside
            | Unknown => return None,
        };
        Some(self.sentence(why))
    }

    /// What `method` gets wrong for it, if it renders all the same and no other warning says so.
    pub fn warning(&self, method: MethodName) -> Option<String> {
        use ObstacleKind::*;
        let effect = match (method, self.kind) {
            (MethodName::AmbientOcclusion | MethodName::Direct, _) => return None,
            (MethodName::Path, _) if !self.clear => return None,
            (MethodName::Path | MethodName::Subsurface, _) if self.clear => match self.kind {
                Unwelded | Sheet | Uncounted | Faces | Walls | Turned => "light that enters it is lost, and counted",
                Holes | Blemish => "paths that come there are lost, and counted",
                Hidden => "nothing of it is seen",
                OpaqueTouching => "light may pass there from one side to the other",
                Unknown => "what is inside is not known there",
                LampTouching => "whether its light enters there is left to rounding",
                CameraTouching => "whether it is inside is left to rounding",
                Crossing | Nested | Touching | LampInside | CameraInside => return None,
            },
            (_, OpaqueTouching) => "light may pass there from one side to the other",
            (_, Unknown) => "what is inside is not known there",
            _ if self.said || self.united => return None,
            (MethodName::VolumePath, Hidden) => "nothing of it is seen",
            (MethodName::VolumePath, Blemish) => "paths that come there are lost, and counted",
            (MethodName::VolumePath, _) | (_, Blemish) => return None,
            (_, Crossing | Nested | Hidden) => {
                "`subsurface` lights each surface by itself: what lies inside takes no light, and light does not pass from one to the \
                 other; take --method volume_path"
            }
            (_, Touching) => {
                "`subsurface` lets no light pass between them, and the faces that touch stay dark or not by chance; take \
                 --method volume_path"
            }
            (_, Unwelded | Holes | Sheet | Uncounted) => {
                "`subsurface` takes it for the skin of a thick body: what enters on one side does not leave on the other"
            }
            (_, Faces | Walls | Turned) => "`subsurface` lights each face as if the outside were before it",
            (_, LampInside) => {
                "`subsurface` takes light from outside alone, as if that lamp were off; take --method volume_path"
            }
            (_, LampTouching) => "whether its light enters there is left to rounding",
            (_, CameraInside) => "`subsurface` shows bodies from outside alone: black; take --method volume_path",
            (_, CameraTouching) => "whether it is inside is left to rounding",
        };
        Some(self.sentence(effect))
    }

    fn sentence(&self, why: &str) -> String {
        let remedy = if self.remedy.is_empty() { String::new() } else { format!("; {}", self.remedy) };
        format!("{}: {}: {why}{remedy}", self.at, self.what)
    }
}
