//! What stands in the way of knowing which medium is where: bodies in one another, surfaces that touch, meshes without an inside, lamps
//! and cameras in media. Read first: [`Obstacle`] and [`Found::new`]; docs/robustness.md has the table.

use super::insides::{Found, Nests, Partner};
use super::seams::{MOSTLY_HOLES, seams};
use super::{Object, Obstacle, ObstacleKind, Scene};
use crate::geometry::{Contact, Mesh, Part, RawMesh, Seek, Solid, Union, lying, meeting, mended};
use crate::math::{Aabb, DVec3};
use crate::words::{self, counted, either, percent};
use std::collections::HashSet;
use std::sync::Arc;

/// Surfaces closer than this many of the distances that rays start away from a surface are as good as in one place.
const OFFSETS: f64 = 2.0;
/// The least share of the largest coordinate, whatever rays are traced in: contacts are found in f64.
const LEAST_GAP: f64 = 1e-12;
/// Less than this share of a surface at fault is traced with a warning; so are parts smaller than this share. About as many paths are
/// lost there.
const MINOR: f64 = 1e-3;
/// Less than this is not said beforehand: what is lost there is counted.
const LEAST: f64 = 1e-4;

/// After so many pairs of objects that meet, only those are looked at of which one has not met any yet: in a heap of thousands every pair
/// may.
const MOST_MEETINGS: usize = 1000;

impl Scene {
    /// What stands in the way of knowing which medium is where, for every translucent object; looked for when it is first asked.
    pub fn obstacles(&self) -> &[Obstacle] {
        &self.insides.0.get_or_init(|| Found::new(self)).obstacles
    }

    /// The bodies that the camera stands in, each with how often its surface is around it.
    pub fn camera_in(&self) -> &[(u32, u32)] {
        &self.insides.0.get_or_init(|| Found::new(self)).camera_in
    }

    /// What bounds the body of object number `object`, where its parts overlap, touch or lie in one another; `None` where all of its surface does, and
    /// where some part is open.
    pub fn union(&self, object: u32) -> Option<&Arc<Union>> {
        let unions = &self.insides.0.get_or_init(|| Found::new(self)).unions;
        unions.get(object as usize)?.as_ref()
    }

    /// Which body is where bodies overlap or touch.
    pub fn nests(&self) -> &Nests {
        &self.insides.0.get_or_init(|| Found::new(self)).nests
    }
}

/// An object with its solid: what is looked at.
struct Shell<'a> {
    index: u32,
    object: &'a Object,
    kind: Role,
    solid: Solid,
    bounds: Aabb,
    /// The gap that its surface needs, as a share of the largest coordinate.
    share: f64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Medium,
    Lamp,
    Opaque,
}

impl Found {
    /// Looks at every translucent object, alone and with all that comes near it; at nothing else.
    pub(super) fn new(scene: &Scene) -> Self {
        let role = |o: &Object| match &scene.materials[o.material].surface {
            surface if surface.is_body() => Role::Medium,
            surface if surface.shines() => Role::Lamp,
            _ => Role::Opaque,
        };
        let all: Vec<_> =
            (0_u32..).zip(&scene.objects).filter_map(|(i, o)| Some((i, o, role(o), o.mesh.bounds()?))).collect();
        let share = scene.objects.iter().map(|o| OFFSETS * o.mesh.precision.error(1.0)).fold(LEAST_GAP, f64::max);
        let near = |a: &Aabb, b: &Aabb| a.is_near(b, gap(share, a, b));
        // Pairs whose boxes come near each other, one of them of a medium; along the axis sorted by.
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by(|&a, &b| all[a].3.lower.x.total_cmp(&all[b].3.lower.x));
        let (mut pairs, mut wanted) = (Vec::new(), vec![false; all.len()]);
        for (place, &i) in order.iter().enumerate() {
            wanted[i] |= all[i].2 == Role::Medium;
            for &j in &order[place + 1..] {
                if all[j].3.lower.x > all[i].3.upper.x + gap(share, &all[i].3, &all[j].3) {
                    break;
                }
                let medium = [i, j].iter().any(|&k| all[k].2 == Role::Medium);
                if medium && near(&all[i].3, &all[j].3) {
                    (wanted[i], wanted[j]) = (true, true);
                    let first =
                        if all[i].2 == Role::Medium && (all[j].2 != Role::Medium || i < j) { (i, j) } else { (j, i) };
                    pairs.push(first);
                }
            }
        }
        pairs.sort_unstable();
        let bodies: Vec<Option<Shell<'_>>> = all
            .into_iter()
            .zip(wanted)
            .map(|((index, object, kind, bounds), wanted)| {
                wanted.then(|| Shell { index, object, kind, solid: Solid::new(&object.mesh), bounds, share })
            })
            .collect();
        let nests = Nests { meets: vec![false; scene.objects.len()], ..ranks(scene, &bodies) };
        let mut found = Self { nests, ..Self::default() };
        for body in bodies.iter().flatten().filter(|b| b.kind == Role::Medium) {
            let before = found.obstacles.len();
            let solid = alone(scene, body, &mut found.obstacles);
            found.look_from(scene, body, solid);
            let own = &mut found.obstacles[before..];
            found.nests.meets[body.index as usize] = own.iter().any(|o| o.overlaps());
            // As paths would have it: not where some look inwards with nothing around them.
            if body.solid.parts.iter().all(|p| p.closed) && own.iter().all(|o| o.refusal().is_none()) {
                own.iter_mut().for_each(|o| o.united = o.overlaps());
            }
        }
        let (mut meet, mut meets) = (0, vec![false; bodies.len()]);
        for (i, j) in pairs {
            let (Some(a), Some(b)) = (&bodies[i], &bodies[j]) else { continue };
            if meet > MOST_MEETINGS && meets[i] && meets[j] {
                if b.kind == Role::Medium {
                    found.join(a, b);
                }
            } else if let Some(obstacle) = pair(scene, a, b, &found.nests) {
                (meet, meets[i], meets[j]) = (meet + 1, true, true);
                if obstacle.overlaps() {
                    found.join(a, b);
                }
                found.obstacles.push(obstacle);
            }
        }
        for body in bodies.iter().flatten().filter(|b| b.solid.parts.len() > 1) {
            if found.nests.meets[body.index as usize] {
                found.join(body, body);
            }
        }
        let scatters = scene.objects.iter().filter(|o| scene.materials[o.material].surface.is_translucent());
        let scatters: HashSet<&str> = scatters.map(|o| o.name.as_str()).collect();
        found
            .obstacles
            .iter_mut()
            .for_each(|o| o.clear = !o.objects.iter().any(|name| scatters.contains(name.as_str())));
        found.unions.resize_with(scene.objects.len(), || None);
        for body in bodies.into_iter().flatten() {
            let united = |o: &Obstacle| o.united && o.objects[0] == body.object.name;
            if found.obstacles.iter().any(united) {
                let (gap, count) = (gap(share, &body.bounds, &body.bounds), body.object.mesh.triangles.len());
                found.unions[body.index as usize] = Some(Arc::new(Union::new(body.solid, count, gap)));
            }
        }
        found
    }

    /// Two bodies that meet, or one that meets itself: which of their faces lie in each other.
    fn join(&mut self, a: &Shell<'_>, b: &Shell<'_>) {
        let gap = gap(a.share, &a.bounds, &b.bounds);
        let nests = &mut self.nests;
        (nests.meets[a.index as usize], nests.meets[b.index as usize]) = (true, true);
        for pair in lying(&a.solid, &b.solid, gap).unwrap_or_default() {
            nests.gap = nests.gap.max(gap);
            for (one, other, k) in [(a, b, 0), (b, a, 1)] {
                let [own, there] = [pair.triangles[k], pair.triangles[1 - k]];
                let partner = Partner { object: other.index, part: pair.parts[1 - k], triangle: there };
                nests.contacts[one.index as usize].entry(own).or_default().push(partner);
            }
        }
    }

    /// Whether the camera is in a body.
    fn look_from(&mut self, scene: &Scene, body: &Shell<'_>, solid: bool) {
        let camera = scene.camera.origin;
        let gap = gap(body.share, &body.bounds, &Aabb::around([camera]));
        let obstacle = |kind, what: String, remedy: String| Obstacle {
            kind,
            objects: vec![body.object.name.clone()],
            at: body.object.at.clone(),
            what,
            remedy,
            said: false,
            clear: false,
            united: false,
        };
        let name = &body.object.name;
        if body.solid.is_near(camera, gap) {
            let what = format!("the camera stands in the surface of object {name:?}");
            self.obstacles.push(obstacle(
                ObstacleKind::CameraTouching,
                what,
                format!("move it by more than {gap:.1e} units"),
            ));
        } else if solid && let Some(winding) = body.solid.winding(camera, |_| true).filter(|w| *w != 0) {
            self.camera_in.push((body.index, winding.unsigned_abs()));
            let what = format!("the camera stands inside object {name:?}");
            self.obstacles.push(obstacle(ObstacleKind::CameraInside, what, String::new()));
        }
    }
}

/// The order of bodies; no contacts yet.
fn ranks(scene: &Scene, bodies: &[Option<Shell<'_>>]) -> Nests {
    let media = bodies.iter().flatten().filter(|b| b.kind == Role::Medium);
    let mut order: Vec<(i32, f64, u32)> =
        media.map(|b| (b.object.priority, -b.object.mesh.volume(), b.index)).collect();
    order.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut nests = Nests { rank: vec![0; scene.objects.len()], ..Nests::default() };
    nests.contacts.resize_with(scene.objects.len(), Default::default);
    (0..).zip(order).for_each(|(rank, (.., index))| nests.rank[index as usize] = rank);
    nests
}

/// Distance [unit] below which surfaces within the two boxes are as good as in one place.
fn gap(share: f64, a: &Aabb, b: &Aabb) -> f64 {
    share * a.farthest().max(b.farthest())
}

/// A place in the file's coordinates; `gap` is what counts as one place.
fn near(scene: &Scene, contact: &Contact, gap: f64) -> String {
    let least = gap.max(LEAST_GAP * scene.centre.abs().max_element());
    format!("near {}", words::place((contact.at + scene.centre).to_array(), least))
}

const TURN: &str = "set flip = true, or --repair turns them";
const TURN_BACK: &str = "leave out flip = true, or --repair turns them";

/// What is wrong with one medium's mesh by itself; whether it has an inside.
fn alone(scene: &Scene, body: &Shell<'_>, out: &mut Vec<Obstacle>) -> bool {
    let (solid, name) = (&body.solid, &body.object.name);
    let gap = gap(body.share, &body.bounds, &body.bounds);
    let mut say = |kind, what: String, remedy: &str| {
        out.push(Obstacle {
            kind,
            objects: vec![name.clone()],
            at: body.object.at.clone(),
            // A remark on the mesh says the same.
            said: match kind {
                ObstacleKind::Faces | ObstacleKind::Holes | ObstacleKind::Unwelded => true,
                ObstacleKind::Turned => body.object.findings.inside_out(),
                _ => false,
            },
            united: false,
            what: format!("object {name:?}: {what}"),
            clear: false,
            remedy: if remedy == TURN && body.object.flipped { TURN_BACK.into() } else { remedy.into() },
        });
    };
    let area: f64 = solid.parts.iter().map(|p| p.area).sum();
    if area == 0.0 {
        return false;
    }
    if body.object.findings.seam.is_some() && solid.seams.hole_share > MOSTLY_HOLES {
        let edges = counted(solid.seams.open, "edge belongs", "edges belong");
        let what = format!("its triangles do not share their corners, which lie close together ({edges} to one alone)");
        say(ObstacleKind::Unwelded, what, "--repair welds them");
        seams(&Solid::new(&welded(&body.object.mesh)), gap, &mut say);
        return false;
    }
    seams(solid, gap, &mut say);
    if !solid.is_convex(gap) {
        // Of parts that were declared each counts, however small.
        let minor = if body.object.parts.len() > 1 { 0.0 } else { MINOR };
        meets_itself(scene, solid, (gap, minor), &mut say);
    }
    solid.seams.hole_share <= MOSTLY_HOLES
}

/// The mesh as --repair would have it.
fn welded(mesh: &Mesh) -> Mesh {
    let (positions, triangles) = (mesh.positions.clone(), mesh.triangles.clone());
    mended(RawMesh { positions, triangles, ..RawMesh::default() }).0.recentred(DVec3::ZERO)
}

/// Parts in one another, and a part that passes through itself.
fn meets_itself(
    scene: &Scene,
    solid: &Solid,
    (gap, minor): (f64, f64),
    say: &mut impl FnMut(ObstacleKind, String, &str),
) {
    let parts = &solid.parts;
    let area: f64 = parts.iter().map(|p| p.area).sum();
    let large = |i: u32| parts[i as usize].area > minor * area;
    let found = meeting(solid, solid, gap, Seek::Crossing, |[a, b]| a != b && large(a) && large(b));
    let all = parts.len();
    let union = "make one surface of them (a union), or cut one out of the other";
    // How often the surface is around a place tells nothing with open parts, and with some that look inwards.
    let counts = parts.iter().all(|p| p.closed && p.volume > 0.0);
    let countable = |kind| if counts { kind } else { ObstacleKind::Uncounted };
    if let Some(c) = &found.crossing {
        let what = format!("two of its {all} parts overlap: they pass through each other {}", near(scene, c, gap));
        return say(countable(ObstacleKind::Crossing), what, union);
    }
    if let Some(c) = &found.touching {
        let what = format!("two of its {all} parts touch: faces lie in each other {}", near(scene, c, gap));
        let remedy = format!("join them without the faces between, or leave a gap of at least {gap:.1e} units");
        say(countable(ObstacleKind::Touching), what, &remedy);
    }
    if found.unfinished {
        let what = format!("too many faces of its {all} parts are in one place to look at all");
        say(ObstacleKind::Unknown, what, "");
    }
    parts_in_parts(solid, (gap, minor), say);
    if let Some(c) = &found.minor {
        let share = solid.hidden_share().max(found.minor_area / area);
        if share < LEAST {
            return;
        }
        let (kind, remedy) = if share > MINOR {
            (ObstacleKind::Crossing, "make one surface of it (a union with itself), or pull it apart")
        } else {
            (ObstacleKind::Blemish, "a union with itself mends that")
        };
        let what = format!(
            "its surface meets itself {}, and maybe elsewhere; {} of it lies inside it",
            near(scene, c, gap),
            percent(share)
        );
        say(kind, what, remedy);
    }
}

/// Parts inside others: right as cavities, and as bodies in cavities.
fn parts_in_parts(solid: &Solid, (gap, minor): (f64, f64), say: &mut impl FnMut(ObstacleKind, String, &str)) {
    let parts = &solid.parts;
    let area: f64 = parts.iter().map(|p| p.area).sum();
    let [mut nested, mut open, mut turned] = [(0_usize, 0.0); 3];
    for (i, part) in parts.iter().enumerate() {
        let around = |(j, other): (usize, &Part)| {
            j != i
                && other.closed
                && other.bounds.contains(part.bounds.lower)
                && other.bounds.contains(part.bounds.upper)
        };
        if part.area == 0.0 || part.closed && part.volume.abs() <= gap * part.area {
            continue;
        }
        let others = |j: u32| j as usize != i && parts[j as usize].closed;
        let is_within = parts.iter().enumerate().any(around);
        let outside = if is_within { solid.winding(solid.point_of(i), others).unwrap_or(0) } else { 0 };
        let sum = match (part.closed, part.volume > 0.0, outside) {
            (true, true, 0) | (true, false, 1) | (false, _, 0) => continue,
            (false, ..) => &mut open,
            (true, true, _) => &mut nested,
            (true, false, _) => &mut turned,
        };
        *sum = (sum.0 + 1, sum.1 + part.area);
    }
    let all = parts.len();
    let cavity = "remove them, or make them cavities: closed, their faces turned inwards";
    let inside = [
        (
            ObstacleKind::Nested,
            nested,
            ["lies inside another part, and looks outwards", "lie inside another part, and look outwards"],
        ),
        (
            ObstacleKind::Uncounted,
            open,
            ["is open and lies inside a closed one", "are open and lie inside a closed one"],
        ),
    ];
    for (kind, (count, part), [one, many]) in inside {
        let kind = if part > minor * area { kind } else { ObstacleKind::Blemish };
        if count > 0 {
            say(kind, format!("{count} of its {all} parts {}", either(count, one, many)), cavity);
        }
    }
    if turned.0 > 0 {
        let kind = if turned.1 > MINOR * area { ObstacleKind::Turned } else { ObstacleKind::Blemish };
        let (n, look) = (
            turned.0,
            either(turned.0, "looks inwards with nothing around it", "look inwards with nothing around them"),
        );
        let what = if all == 1 { "its faces look inwards".into() } else { format!("{n} of its {all} parts {look}") };
        say(kind, what, TURN);
    }
}

/// What is wrong with a medium `a` and another object.
fn pair(scene: &Scene, a: &Shell<'_>, b: &Shell<'_>, nests: &Nests) -> Option<Obstacle> {
    let gap = gap(a.share, &a.bounds, &b.bounds);
    let (one, other) = (&a.object.name, &b.object.name);
    let obstacle = |kind, what: String, remedy: String| {
        let (objects, at) = (vec![one.clone(), other.clone()], b.object.at.clone());
        Some(Obstacle { kind, objects, at, what, remedy, said: false, clear: false, united: false })
    };
    let seek = if b.kind == Role::Opaque { Seek::Touching } else { Seek::Crossing };
    let found = meeting(&a.solid, &b.solid, gap, seek, |_| true);
    let apart = format!("leave a gap of at least {gap:.1e} units");
    match b.kind {
        Role::Opaque => {
            let c = found.touching?;
            let what = format!(
                "a face of object {other:?} lies in one of the translucent object {one:?} {}",
                near(scene, &c, gap)
            );
            obstacle(ObstacleKind::OpaqueTouching, what, apart)
        }
        Role::Lamp => {
            if let Some(c) = found.touching {
                let what = format!(
                    "a face of lamp {other:?} lies in one of the translucent object {one:?} {}",
                    near(scene, &c, gap)
                );
                return obstacle(ObstacleKind::LampTouching, what, apart);
            }
            let how = if found.crossing.is_some() {
                "partly inside"
            } else if a.solid.holds(&b.solid) {
                "inside"
            } else {
                return None;
            };
            let what = format!("lamp {other:?} lies {how} object {one:?}");
            obstacle(ObstacleKind::LampInside, what, String::new())
        }
        Role::Medium => {
            let union = "move them apart, cut one out of the other and leave a gap, or make one mesh of both (a union)";
            if let Some(c) = found.crossing {
                let what = format!(
                    "{} {one:?} and {other:?} overlap: they pass through each other {}",
                    kinds(scene, a, b),
                    near(scene, &c, gap)
                );
                return obstacle(ObstacleKind::Crossing, what, union.into());
            }
            if let Some(c) = found.touching {
                let what = format!(
                    "{} {one:?} and {other:?} touch: faces lie in each other {}",
                    kinds(scene, a, b),
                    near(scene, &c, gap)
                );
                let remedy = format!("{apart}, or join them into one mesh without the faces between");
                return obstacle(ObstacleKind::Touching, what, remedy);
            }
            let (outer, inner) = match (a.solid.holds(&b.solid), b.solid.holds(&a.solid)) {
                (true, _) => (a, b),
                (_, true) => (b, a),
                _ if found.unfinished => {
                    let what = format!(
                        "{} {one:?} and {other:?} have too many faces in one place to look at all",
                        kinds(scene, a, b)
                    );
                    return obstacle(ObstacleKind::Unknown, what, String::new());
                }
                _ => return None,
            };
            let (outside, inside) = (&outer.object.name, &inner.object.name);
            let what =
                format!("{} {one:?} and {other:?} overlap: {inside:?} lies inside {outside:?}", kinds(scene, a, b));
            let hidden = nests.rank[inner.index as usize] < nests.rank[outer.index as usize];
            if hidden && outer.solid.holds_all(&inner.solid) {
                let remedy = format!("give {inside:?} a priority above {}", outer.object.priority);
                return obstacle(ObstacleKind::Hidden, what, remedy);
            }
            obstacle(ObstacleKind::Nested, what, union.into())
        }
    }
}

/// What two bodies are.
fn kinds(scene: &Scene, a: &Shell<'_>, b: &Shell<'_>) -> &'static str {
    let translucent = |body: &Shell<'_>| scene.surface(body.index).is_translucent();
    if translucent(a) && translucent(b) { "the translucent objects" } else { "the bodies" }
}
