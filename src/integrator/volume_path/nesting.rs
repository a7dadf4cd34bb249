//! Bodies in one another: which of them is at a place, and paths through them from where light enters the first to where it leaves the
//! last.
//!
//! A path keeps the bodies around it, each with how often its surface was crossed inwards more than outwards, so that overlapping
//! parts of one mesh are one body. Of the bodies around a place the strongest is there ([`crate::scene::Nests::rank`]). A surface that
//! changes nothing about that is no boundary and is passed; at a boundary the indices of the two media that are really on its sides
//! count. What is around a path changes only where light passes.
//!
//! Faces that lie in each other are crossed at once, by a table: rays could not tell which comes first.

use super::draws::PathSampler;
use super::interior::{
    Edge, Interior, MOST_SURFACES, ROULETTE_BELOW, Straight, Turn, WalkExit, WalkObserver, reflected, russian_roulette,
};
use super::spectrum::Spectrum;
use crate::geometry::SurfacePoint;
use crate::integrator::View;
use crate::math::{DVec3, Vec3};
use crate::query::{Hit, Ray};
use crate::scene::Nests;
use crate::surface::{Boundary, Bsdf};
use crate::tally::{Cause, WalkTally};
use std::sync::Arc;

/// The bodies around a place, from the weakest to the strongest, each with the number of times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stack(Vec<(u32, u32)>);

/// An object, and +1 where light goes in, -1 where it comes out.
type Crossed = (u32, i32);

impl Stack {
    /// Of bodies in any order.
    pub fn of(around: &[(u32, u32)], nests: &Nests) -> Self {
        let mut list = around.to_vec();
        list.sort_by_key(|(object, _)| nests.rank[*object as usize]);
        Self(list)
    }

    /// One body alone, once.
    pub fn only(object: u32) -> Self {
        Self(vec![(object, 1)])
    }

    /// The body that is there; `None` in air.
    pub fn top(&self) -> Option<u32> {
        self.0.last().map(|(object, _)| *object)
    }

    fn holds(&self, object: u32) -> bool {
        self.0.iter().any(|(other, _)| *other == object)
    }

    /// Whether there is this body alone, once.
    fn is_only(&self, object: u32) -> bool {
        self.0[..] == [(object, 1)]
    }

    /// After these crossings; `None` where a body is left that is not around.
    pub fn crossed(&self, turns: &[Crossed], nests: &Nests) -> Option<Self> {
        let mut list = self.0.clone();
        for (k, &(object, _)) in turns.iter().enumerate() {
            if turns[..k].iter().any(|(other, _)| *other == object) {
                continue;
            }
            let turn: i32 = turns.iter().filter(|(other, _)| *other == object).map(|(_, turn)| turn).sum();
            match list.iter().position(|(other, _)| *other == object) {
                Some(place) => {
                    list[place].1 = list[place].1.checked_add_signed(turn)?;
                    if list[place].1 == 0 {
                        list.remove(place);
                    }
                }
                None if turn == 0 => {}
                None => {
                    let count = u32::try_from(turn).ok()?;
                    let rank = |object: u32| nests.rank[object as usize];
                    let place = list.partition_point(|(other, _)| rank(*other) < rank(object));
                    list.insert(place, (object, count));
                }
            }
        }
        Some(Self(list))
    }
}

/// Where light may go through surfaces, of one or more bodies at once.
pub struct Faces {
    pub turns: Vec<Crossed>,
    /// Rays start this far away at least [unit]; 0 where one face is crossed alone.
    pub margin: f64,
}

/// The surfaces that light along `w`, with `stack` around it, meets at `hit`: its own first, then those that lie in it. At the rim of
/// those rounding decides; there only a body that is around can be left.
pub fn faces(view: View<'_>, stack: &Stack, body: &Interior, hit: &Hit, at: &SurfacePoint, w: Vec3) -> Faces {
    let turn = |n: Vec3| if n.dot(w) < 0.0 { 1 } else { -1 };
    let mut turns = vec![(hit.mesh, turn(at.n_geometric))];
    let Some(partners) = body.contacts.get(&hit.triangle) else { return Faces { turns, margin: 0.0 } };
    let gap = view.scene.nests().gap;
    // Of a part's triangles one counts, on whose edge soever the place may be.
    let mut seen: Vec<(u32, u32)> = Vec::new();
    for partner in partners {
        let mesh = &view.scene.objects[partner.object as usize].mesh;
        let key = (partner.object, partner.part);
        if seen.contains(&key) {
            continue;
        }
        let (inside, turn) =
            (within(mesh.corners(partner.triangle), at.x), turn(mesh.geometric_normal(partner.triangle)));
        let around = turn < 0 && stack.holds(partner.object);
        let rim = if around { -gap } else { RIM * if turn > 0 { -gap } else { gap } };
        if inside >= rim {
            seen.push(key);
            turns.push((partner.object, turn));
        }
    }
    let own = view.scene.objects[hit.mesh as usize].mesh.corners(hit.triangle);
    if turns.len() > 1 && turns[0].1 < 0 && !stack.holds(hit.mesh) && within(own, at.x) <= gap {
        turns.remove(0);
    }
    Faces { turns, margin: 2.0 * gap }
}

/// Share of the gap within which rounding puts a place beside the edge of a triangle.
const RIM: f64 = 1.0 / 32.0;

/// How far a place in the plane of a triangle is inside it [unit]; below 0 outside.
fn within(corners: [DVec3; 3], x: DVec3) -> f64 {
    let [a, b, c] = corners;
    let n = (b - a).cross(c - a).normalize_or_zero();
    let inside = |[from, to]: [DVec3; 2]| n.cross(to - from).normalize_or_zero().dot(x - from);
    [[a, b], [b, c], [c, a]].map(inside).into_iter().fold(f64::INFINITY, f64::min)
}

/// A way into bodies from outside all.
pub struct Entry<'a> {
    /// The body that light comes into.
    pub body: &'a Interior,
    /// The bodies around it then; of one that meets no other nothing.
    pub stack: Stack,
    /// Rays start this far away at least [unit].
    pub margin: f64,
    /// The object and the triangle that it leads through.
    pub through: Option<(u32, u32)>,
}

impl<'a> Entry<'a> {
    /// Into a body that meets no other.
    pub fn alone(body: &'a Interior) -> Self {
        Self { body, stack: Stack::default(), margin: 0.0, through: None }
    }

    /// Into `body` at `hit` along `w`, and into others whose faces lie there; `None` where rays cannot tell.
    pub fn at(view: View<'_>, bodies: &'a [Option<Interior>], body: &'a Interior, hit: &Hit, w: Vec3) -> Option<Self> {
        if !body.nested {
            return Some(Self::alone(body));
        }
        let at = view.scene.objects[hit.mesh as usize].mesh.point(hit.triangle, hit.u, hit.v);
        let faces = faces(view, &Stack::default(), body, hit, &at, w);
        let stack = Stack::default().crossed(&faces.turns, view.scene.nests())?;
        let body = bodies[stack.top()? as usize].as_ref()?;
        Some(Self { body, stack, margin: faces.margin, through: Some((hit.mesh, hit.triangle)) })
    }
}

/// Who watches a path through bodies: makes a [`WalkObserver`] for the body that the path is in; `lit` says whether lamps may be asked for
/// at collisions there.
pub trait Guide {
    /// For `body`, and what is `around` the path.
    fn watch<'a>(&'a mut self, body: &'a Interior, around: &'a Stack, lit: bool) -> impl WalkObserver + 'a;

    /// How paths meet the body of object number `object`.
    fn meets(&self, object: u32) -> Meets;
}

/// How paths in bodies meet another body.
pub enum Meets {
    /// They enter it.
    Enters,
    /// As an opaque surface: what stands for a body, or else the surface itself.
    Opaque(Option<Arc<dyn Bsdf>>),
    /// They end, and are counted.
    Ends,
}

/// The bodies around a path, and the object and triangle that it has just left.
type Around = (Stack, Option<(u32, u32)>);

/// What a flight ends at.
enum Met {
    Collision(DVec3),
    Surface(Hit),
    Lost,
}

/// As [`Interior::flight`], but for any surface.
fn flight(view: View<'_>, body: &Interior, from: DVec3, w: Vec3, distance: f32, tally: &mut WalkTally) -> Met {
    let end = || from + w.as_dvec3() * f64::from(distance);
    if distance < body.clearance.at(from) {
        tally.clear += 1;
        return Met::Collision(end());
    }
    tally.rays += 1;
    match view.rays.closest(&Ray { t_max: distance, ..Ray::new(from, w) }) {
        Some(hit) => Met::Surface(hit),
        None if distance.is_finite() && body.clearance.at(end()) >= 0.0 => Met::Collision(end()),
        None => Met::Lost,
    }
}

/// Follows light from `from` along `w`, with `stack` around it and the triangle `last` behind it, until it is outside all bodies, and tells the body that it left; `None` where
/// it is absorbed, ended by a watch, or lost. As [`Interior::walk`], from body to body.
pub fn walk<'a>(
    view: View<'_>,
    bodies: &'a [Option<Interior>],
    ((mut stack, mut last), mut from, mut w): (Around, DVec3, Vec3),
    spectrum: &mut Spectrum,
    draws: &mut PathSampler,
    guide: &mut impl Guide,
    tally: &mut WalkTally,
) -> Option<(&'a Interior, WalkExit)> {
    let nests = view.scene.nests();
    let body_of = |stack: &Stack| bodies[stack.top()? as usize].as_ref();
    let mut body = body_of(&stack)?;
    tally.walks += 1;
    let whole = spectrum.value(&body.medium).max();
    // Phase function at the last collision, if nothing lay between; what is left of a flight that went through no boundary.
    let (mut phase, mut ahead): (Option<f32>, Option<f32>) = (None, None);
    let (mut collisions, mut surfaces) = (0_u32, 0_u32);
    loop {
        let distance = ahead.take().unwrap_or_else(|| spectrum.distance(&body.medium, draws.number()));
        let hit = match flight(view, body, from, w, distance, tally) {
            Met::Collision(x) => {
                tally.collisions += 1;
                (collisions, surfaces) = (collisions + 1, 0);
                spectrum.collide(distance);
                let edge = phase.map(|phase| Edge { length: distance, phase });
                let lit = stack.is_only(body.object);
                if !guide.watch(body, &stack, lit).collision(x, w, edge, spectrum, draws) {
                    return None;
                }
                if collisions % body.patience == 0 && !goes_on(body, whole, spectrum, draws) {
                    return None;
                }
                let next = body.scatter(w, draws);
                let into = body.phase(w, next);
                guide.watch(body, &stack, lit).turned(Turn::Scattered(x, into));
                phase = Some(into);
                (from, w, last) = (x, next, None);
                continue;
            }
            Met::Surface(hit) => hit,
            Met::Lost => {
                tally.losses.add(body.object, body.leak);
                return None;
            }
        };
        spectrum.fly(hit.t);
        if let Some(sigma_a) = body.absorbs {
            spectrum.scale(sigma_a.map(|s| (-s * hit.t).exp()));
        }
        surfaces += 1;
        if surfaces >= MOST_SURFACES {
            tally.losses.add(body.object, Cause::Endless);
            return None;
        }
        // Light in clear bodies has no collisions to end it at.
        if surfaces % SURFACES_BETWEEN_LOOKS == 0 && !goes_on(body, whole, spectrum, draws) {
            return None;
        }
        let object = &view.scene.objects[hit.mesh as usize];
        let at = object.mesh.point(hit.triangle, hit.u, hit.v);
        if last.replace((hit.mesh, hit.triangle)) == Some((hit.mesh, hit.triangle)) {
            // No line meets a plane twice: the start of the ray was rounded to its wrong side, as at needles.
            from = SurfacePoint { error: 2.0 * at.error, ..at }.leave(w);
            guide.watch(body, &stack, false).turned(Turn::None(hit.t));
            ahead = Some((distance - hit.t).max(0.0));
            continue;
        }
        let surface = view.scene.surface(hit.mesh);
        let met = match if surface.is_body() { guide.meets(hit.mesh) } else { Meets::Opaque(None) } {
            Meets::Opaque(_) if surface.emission.is_some() => {
                guide.watch(body, &stack, false).lamp(&hit, w, spectrum);
                return None;
            }
            Meets::Opaque(stand_in) => {
                let at = at.facing(-w);
                let bsdf: &dyn Bsdf = stand_in.as_deref().unwrap_or(&*surface.bsdf);
                let watch = &mut guide.watch(body, &stack, false);
                w = reflected((&at, w), bsdf, (&body.medium, spectrum), draws, watch)?;
                (from, phase) = (at.leave(w), None);
                continue;
            }
            Meets::Ends => {
                tally.losses.add(body.object, Cause::OtherMedium);
                return None;
            }
            Meets::Enters => bodies[hit.mesh as usize].as_ref().map(|other| faces(view, &stack, other, &hit, &at, w)),
        };
        let beyond = met.and_then(|faces| Some((stack.crossed(&faces.turns, nests)?, faces)));
        let Some((after, faces)) = beyond else {
            tally.losses.add(body.object, body.leak);
            return None;
        };
        let at = SurfacePoint { error: at.error.max(faces.margin), ..at };
        if after.top() == stack.top() {
            // In a stronger body, or of parts of one body.
            guide.watch(body, &stack, false).turned(Turn::None(hit.t));
            (from, stack, phase) = (at.leave(w), after, None);
            ahead = Some((distance - hit.t).max(0.0));
            continue;
        }
        let next = body_of(&after);
        let matched = body.matched && next.is_none_or(|b| b.matched);
        let eta = ratio(&at, w, body.eta, next.map_or(1.0, |b| b.eta));
        let to = if matched { w } else { Boundary { eta }.sample(&at, -w, [draws.number(), 0.0, 0.0])?.wi };
        let turn = if matched { Turn::None(hit.t) } else { Turn::Bent };
        guide.watch(body, &stack, false).turned(turn);
        let cosines = [w.dot(at.n_geometric), to.dot(at.n_geometric)];
        if cosines[0] * cosines[1] <= 0.0 {
            (w, phase) = (to, None);
            from = at.leave(w);
            continue;
        }
        spectrum.leave(&body.medium);
        let Some(next) = next else {
            // Lamps are asked for over such lines: see `Guide`.
            let asked = stack.is_only(body.object) && faces.margin == 0.0;
            let straight = phase.filter(|_| asked).map(|phase| Straight { from, phase, length: hit.t, cosines });
            return Some((body, WalkExit { at, w: to, straight }));
        };
        (from, w, phase) = (at.leave(to), to, None);
        (body, stack) = (next, after);
    }
}

/// In clear bodies.
const SURFACES_BETWEEN_LOOKS: u32 = 8;

/// Roulette by what is left of the weight that a path came with.
fn goes_on(body: &Interior, whole: f32, spectrum: &mut Spectrum, draws: &mut PathSampler) -> bool {
    russian_roulette(spectrum.value(&body.medium).max() / whole / ROULETTE_BELOW, spectrum, draws)
}

/// n behind the face over n before it, where light along `w` comes from a medium of index `here` into one of index `there`.
fn ratio(at: &SurfacePoint, w: Vec3, here: f32, there: f32) -> f32 {
    if at.n_geometric.dot(w) < 0.0 { there / here } else { here / there }
}
