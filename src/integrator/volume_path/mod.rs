//! Paths through a scene and through homogeneous media behind smooth or rough boundaries: the truth that the models of `bssrdf` approach,
//! and all that is between bodies for the methods that have those models.
//! Read first: `camera.rs` (a path through the scene), `interior.rs` (inside one body), then `connect.rs` (what makes it fast).

mod camera;
mod cells;
#[cfg(test)]
mod checks;
mod clear;
mod connect;
mod draws;
mod emission;
mod facets;
mod glass;
mod interior;
mod jumps;
mod lines;
mod modelled;
#[cfg(test)]
mod near_checks;
mod nesting;
mod pencil;
mod photons;
mod seen;
mod sight;
mod spectrum;
mod through;
mod windows;

use super::shade::DirectLight;
use super::{CameraRay, Integrator, KnownLights, Part, View};
use crate::error::{Error, Result};
use crate::geometry::{Clearance, SurfacePoint};
use crate::light::{Lights, emitted};
use crate::math::{Rgb, Vec3};
use crate::optics::Medium;
use crate::query::Hit;
use crate::sampling::PixelStream;
use crate::scene::{Contacts, Obstacle, ObstacleKind, Orders, Scene, Surface, default_photons};
use crate::surface::Bsdf;
use crate::tally::{Cause, Tally};
use crate::words::short;
use camera::CameraPath;
use cells::Cells;
pub(super) use connect::Scratch;
pub(super) use draws::PathSampler;
use interior::Interior;
pub use interior::MOST_SURFACES;
use lines::Lines;
pub(super) use modelled::Modelled;
use nesting::{Entry, Stack};
pub use pencil::Left;
use photons::Source;
use seen::{both_parts, enter};
use spectrum::Spectrum;
use std::sync::Arc;
use through::RefractedNee;
pub(super) use windows::{Out, Windows};

/// Options of [`VolumePath`].
#[derive(Clone, Copy, Debug)]
pub struct VolumePathOptions {
    /// How often the light may have been scattered in media.
    pub orders: Orders,
    /// Photons traced from area lights and suns into each body in a pass; 0 for none.
    pub photons: u32,
    /// Whether the camera sees mirror images on bodies.
    pub specular: bool,
    /// Seed of the render.
    pub seed: u64,
}

impl Default for VolumePathOptions {
    /// Photons for a picture of 512x512 pixels.
    fn default() -> Self {
        Self { orders: Orders::All, photons: default_photons([512; 2]), specular: true, seed: 0 }
    }
}

/// Unbiased light transport: Lambertian surfaces, lamps, environment, and homogeneous media with Henyey-Greenstein
/// scattering inside closed meshes with a dielectric boundary, smooth or rough.
pub struct VolumePath {
    options: VolumePathOptions,
    light: DirectLight,
    /// One for each object; `None` where it is not translucent.
    bodies: Vec<Option<Interior>>,
    throughs: Vec<Option<RefractedNee>>,
    sources: Vec<Option<Source>>,
    /// Chance that a path goes on for light other than that of lamps and suns on the body itself, once photons have that.
    persistence: f32,
    /// The bodies that the camera stands in.
    camera_in: Stack,
    /// Whether lights are asked for over lines through boundaries of matched bodies.
    matched: bool,
    /// Whether this is [`Self::once`].
    once: bool,
    /// One for each object; for bodies whose light a model has.
    modelled: Vec<Option<Modelled>>,
    /// One for each object; what stands for the surface of a body that paths do not enter.
    stand_ins: Vec<Option<Arc<dyn Bsdf>>>,
    /// Surfaces over which a path goes on, at most.
    bounces: u32,
}

/// Cubes along the longest side of the tables of distances.
const CLEARANCE_CELLS: u32 = 128;
/// Cubes that are enough for a mean free path.
const CUBES_PER_PATH: f64 = 4.0;
/// Connections reach this many mean free paths (by the mean extinction of the channels).
const REACH: f32 = 3.0;

/// Light that a path asks a model for.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// Index of the body.
    pub object: u32,
    /// Where it leaves, its normals towards `w`.
    pub at: SurfacePoint,
    /// Unit direction in which it leaves.
    pub w: Vec3,
    /// What the path makes of a radiance there, under the boundary.
    pub weight: Rgb,
    /// Numbers of its own.
    pub stream: PixelStream,
    /// Whether the camera sees it over other surfaces.
    pub later: bool,
}

impl VolumePath {
    /// Tables for the translucent objects of `scene`, and for no others.
    ///
    /// # Errors
    /// What [`super::traceable`] finds: meshes without an inside, lamps and cameras in surfaces.
    pub fn new(scene: &Scene, options: VolumePathOptions) -> Result<Self> {
        let refusals: Vec<String> = scene.obstacles().iter().filter_map(Obstacle::refusal).collect();
        if !refusals.is_empty() {
            return Err(Error::scene(refusals.join("\n")));
        }
        for (i, object) in scene.objects.iter().enumerate().filter(|(i, _)| scene.nests().meets[*i]) {
            let Some(inside) = &scene.surface(i as u32).inside else { continue };
            let kinds =
                [(inside.rough.is_some(), "rough", "roughness = 0"), (inside.tint.is_some(), "tinted", "no `tint`")];
            if let Some((_, kind, without)) = kinds.into_iter().find(|(is, ..)| *is) {
                return Err(Error::scene(format!(
                    "the boundary of `{}` is {kind} and meets another body: `volume_path` knows {kind} boundaries of bodies that stand alone; \
                     move them apart, or take {without}",
                    object.name
                )));
            }
        }
        let lights = Lights::new(scene);
        let bodies: Vec<Option<Interior>> =
            (0..scene.objects.len()).map(|i| interior(scene, i, CLEARANCE_CELLS).map(matched)).collect();
        let multiple = matches!(options.orders, Orders::All | Orders::Multiple);
        let shines = lights.has_emitters() || lights.has_suns();
        let source = |body: &Option<Interior>| {
            let body = body.as_ref().filter(|_| multiple && options.photons > 0 && shines)?;
            let reach = REACH / body.medium.sigma_t.mean();
            let alone = body.medium.albedo.max() > 0.0 && !body.nested && !body.matched && body.rough.is_none();
            let world = scene.body(body.object).filter(|_| alone)?;
            Some(Source::new(world, options.photons, reach, options.seed))
        };
        let sources = bodies.iter().map(source).collect();
        let diffuse = scene.objects.iter().any(|o| scene.materials[o.material].surface.is_opaque());
        let least: f32 = if diffuse { 0.5 } else { 0.25 };
        // Of an environment, what is beside suns is met by paths that go on.
        let beside = if lights.has_environment() { lights.share_beside_suns() } else { 0.0 };
        let persistence = beside.sqrt().max(least);
        Ok(Self {
            throughs: throughs(scene, &lights, &bodies),
            light: DirectLight { lights, samples: 1 },
            sources,
            persistence,
            matched: bodies.iter().flatten().any(|body| body.matched),
            bodies,
            camera_in: Stack::of(scene.camera_in(), scene.nests()),
            ..Self::surfaces(scene, options)
        })
    }

    /// Paths over opaque surfaces, which end where they come to a body.
    pub(super) fn surfaces(scene: &Scene, options: VolumePathOptions) -> Self {
        let each = 0..scene.objects.len();
        Self {
            options,
            light: DirectLight { lights: Lights::new(scene), samples: 1 },
            bodies: each.clone().map(|_| None).collect(),
            throughs: each.clone().map(|_| None).collect(),
            sources: each.clone().map(|_| None).collect(),
            persistence: 1.0,
            camera_in: Stack::default(),
            matched: false,
            once: false,
            modelled: vec![None; each.len()],
            stand_ins: vec![None; each.len()],
            bounces: MOST_SURFACES,
        }
    }

    /// What to say of `scene` before it is rendered: light that may not be found.
    pub fn warnings(&self, scene: &Scene) -> Vec<String> {
        // Behind a stand-in is nothing.
        // Lights are asked for there.
        let asks = |body: &Interior| body.matched || body.rough.is_some();
        let asked = |object: usize| self.bodies[object].as_ref().is_some_and(asks);
        let passes = |object: usize| self.stand_ins[object].is_none() && !asked(object);
        let lights = &self.light.lights;
        [clear::warning(scene, lights, passes), clear::never_met(scene, lights, passes)].into_iter().flatten().collect()
    }

    /// What the camera sees at `hit`, but for what is asked of models, which is added to `scratch`.
    pub(super) fn shade(
        &self,
        view: View<'_>,
        pass: &[Option<Cells>],
        ray: &CameraRay,
        scratch: &mut Scratch,
        tally: &mut Tally,
        hit: &Hit,
    ) -> Rgb {
        let direction = ray.ray.direction;
        let mut path = self.path(view, pass, ray.stream, scratch, tally);
        match (&self.bodies[hit.mesh as usize], view.scene.surface(hit.mesh)) {
            _ if self.modelled[hit.mesh as usize].is_some() => path.seen(hit, direction),
            (Some(_), _) => both_parts(&mut path, hit, direction),
            (None, Surface { emission: Some(_), .. }) => {
                path.radiance = self.of_order_0(emitted(view.scene, hit, direction))
            }
            _ => path.resume(hit, direction),
        }
        path.radiance
    }

    /// What a camera in a medium sees: radiance over η², so that a white furnace is white in there too.
    fn shade_inside<'a>(
        &'a self,
        view: View<'a>,
        pass: &'a [Option<Cells>],
        ray: &CameraRay,
        scratch: &'a mut Scratch,
        tally: &'a mut Tally,
        body: &'a Interior,
    ) -> Rgb {
        let mut path = self.path(view, pass, ray.stream, scratch, tally);
        let entry = Entry { stack: self.camera_in.clone(), ..Entry::alone(body) };
        if let Some(out) = path.through(entry, ray.ray.origin, ray.ray.direction) {
            path.trace(out);
        }
        path.radiance
    }

    /// A path that has not left the camera yet.
    fn path<'a>(
        &'a self,
        view: View<'a>,
        photons: &'a [Option<Cells>],
        mut stream: PixelStream,
        scratch: &'a mut Scratch,
        tally: &'a mut Tally,
    ) -> CameraPath<'a> {
        let own = stream;
        let ([a, b], [c, d]) = (stream.next_2d(), stream.next_2d());
        let ([e, f], [g, h]) = (stream.next_2d(), stream.next_2d());
        let draws = PathSampler::new(&[a, b, c, d], stream.key());
        let coins = draws.fork_with(&[e, f, g, h], 0);
        self.path_by((draws, coins, own), (view, photons), scratch, tally)
    }

    /// The same by given numbers: of the path, of its connections, of what it asks models for.
    fn path_by<'a>(
        &'a self,
        (mut draws, coins, stream): (PathSampler, PathSampler, PixelStream),
        (view, photons): (View<'a>, &'a [Option<Cells>]),
        scratch: &'a mut Scratch,
        tally: &'a mut Tally,
    ) -> CameraPath<'a> {
        CameraPath {
            method: self,
            view,
            photons,
            scratch,
            tally,
            coins,
            spectrum: Spectrum::new(Rgb::WHITE, draws.number()),
            draws,
            stream,
            asked: 0,
            branches: 0,
            direct: 1.0,
            other: 1.0,
            order: 0,
            sight: None,
            flown: 0.0,
            stepped: false,
            left: None,
            radiance: Rgb::BLACK,
        }
    }

    /// What a model of orders 2 and higher leaves out, for the objects that `wanted` names; see `single.rs`. Holes of
    /// meshes and objects in one another are no fault here.
    pub(super) fn once(scene: &Scene, wanted: impl Fn(usize) -> bool, seed: u64) -> Self {
        let options = VolumePathOptions { orders: Orders::Single, photons: 0, specular: false, seed };
        let surfaces = Self::surfaces(scene, options);
        let bodies = endless(scene, 1, wanted);
        Self { throughs: throughs(scene, &surfaces.light.lights, &bodies), bodies, once: true, ..surfaces }
    }

    /// Radiance of light that was scattered once in the body at `hit`, and comes to it straight from lamps and environment.
    pub(super) fn scattered_once(&self, view: View<'_>, ray: &CameraRay, hit: &Hit, tally: &mut Tally) -> Rgb {
        let Some(body) = &self.bodies[hit.mesh as usize] else { return Rgb::BLACK };
        let mut scratch = Scratch::default();
        let mut path = self.path(view, &[], ray.stream.split(0, 1), &mut scratch, tally);
        if let Some(out) = enter(&mut path, Entry::alone(body), hit, ray.ray.direction) {
            path.meet_light(&out);
        }
        path.radiance
    }

    /// Lines to lights.
    fn lines<'a>(&'a self, view: View<'a>) -> Lines<'a> {
        Lines { view, bodies: &self.bodies, matched: self.matched }
    }

    /// How lamps and suns are asked for at collisions in `body`.
    fn through(&self, body: &Interior) -> Option<&RefractedNee> {
        self.throughs[body.object as usize].as_ref()
    }

    /// Whether a path of [`Self::once`] can find no more light once lamps have been asked for.
    fn points_are_all(&self, body: &Interior) -> bool {
        let lamps = || self.through(body).is_some_and(|t| t.all_alone);
        self.once && !self.light.lights.shine_from_afar() && lamps()
    }

    fn of_order_0(&self, light: Rgb) -> Rgb {
        if self.options.orders.contains(0) { light } else { Rgb::BLACK }
    }
}

/// What paths need of the body of object number `index`, where it is one.
fn interior(scene: &Scene, index: usize, cells: u32) -> Option<Interior> {
    let (object, body) = (&scene.objects[index], scene.body(index as u32)?);
    let medium = scene.surface(body.object).medium()?;
    let clear = scene.surface(body.object).clear.as_ref();
    // Where a mean free path is many cubes long, fewer do.
    let side = body.bounds.extent().max_element() * f64::from(medium.sigma_t().max());
    let enough = (CUBES_PER_PATH * side).ceil().max(16.0);
    let cells = if clear.is_some() { 1 } else { cells.min(enough as u32) };
    let meshes = scene.objects.iter().map(|o| &o.mesh);
    let clearance = Clearance::new(meshes, body.bounds, cells);
    let interior = match clear {
        Some(clear) => {
            let void = Medium { sigma_a: Rgb::BLACK, ..medium };
            Interior { absorbs: Some(clear.sigma_a), ..Interior::new(body.object, &void, clearance) }
        }
        None => Interior::new(body.object, &medium, clearance),
    };
    let of = |o: &&Obstacle| o.objects.len() == 1 && o.objects[0] == object.name;
    let leak = scene.obstacles().iter().filter(of).find_map(|o| match o.kind {
        ObstacleKind::Sheet | ObstacleKind::Holes => Some(Cause::Hole),
        ObstacleKind::Faces | ObstacleKind::Walls | ObstacleKind::Turned => Some(Cause::WrongSide),
        ObstacleKind::Blemish => Some(Cause::Blemish),
        _ => None,
    });
    let leak = leak.unwrap_or(Cause::Rounding);
    let (nests, contacts) = (scene.nests(), scene.nests().contacts[index].clone());
    let inside = scene.surface(body.object).inside.as_ref();
    let (rough, tint) = (inside.and_then(|t| t.rough.clone()), inside.and_then(|t| t.tint.clone()));
    Some(Interior { leak, rough, tint, nested: clear.is_some() || nests.meets[index], contacts, ..interior })
}

/// With lines through its boundary where that does not refract.
fn matched(body: Interior) -> Interior {
    Interior { matched: body.eta == 1.0, ..body }
}

/// The bodies that `wanted` names. Holes of meshes and objects in one another are no fault: the models beside know nothing of them either.
fn endless(scene: &Scene, cells: u32, wanted: impl Fn(usize) -> bool) -> Vec<Option<Interior>> {
    let lone = |interior: Interior| {
        let union = scene.union(interior.object).cloned();
        // Where its own parts lie in each other is no face of another body.
        let contacts = if union.is_some() { Contacts::new() } else { interior.contacts };
        Interior { endless: true, nested: false, union, contacts, ..interior }
    };
    let of = |i| if wanted(i) { interior(scene, i, cells).map(lone) } else { None };
    (0..scene.objects.len()).map(of).collect()
}

/// How lamps and suns are asked for in each of the bodies that scatter.
fn throughs(scene: &Scene, lights: &Lights, bodies: &[Option<Interior>]) -> Vec<Option<RefractedNee>> {
    let of = |body: &Option<Interior>| {
        let body =
            body.as_ref().filter(|body| body.medium.albedo.max() > 0.0 && !body.matched && body.rough.is_none())?;
        RefractedNee::new(scene, lights, body.object, body.eta, body.phase.g as f32)
    };
    bodies.iter().map(of).collect()
}

impl Integrator for VolumePath {
    type Pass = Vec<Option<Cells>>;

    fn begin_pass(&self, view: View<'_>, pass: u32, tally: &mut Tally) -> Self::Pass {
        let fill = |(source, body): (&Option<Source>, &Option<Interior>)| {
            let (source, body) = (source.as_ref()?, body.as_ref()?);
            let cells = source.trace(view, body, &self.light.lights, pass, tally)?;
            tally.walk.photons += u64::from(source.count);
            Some(cells)
        };
        self.sources.iter().zip(&self.bodies).map(fill).collect()
    }

    fn radiance(&self, view: View<'_>, pass: &Self::Pass, rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        let mut scratch = Scratch::default();
        if let Some(body) = self.camera_in.top().and_then(|o| self.bodies[o as usize].as_ref()) {
            for (ray, out) in rays.iter().zip(out) {
                *out = self.shade_inside(view, pass, ray, &mut scratch, tally, body);
            }
            return;
        }
        let hits = super::camera_hits(view, rays, tally);
        for ((ray, hit), out) in rays.iter().zip(&hits).zip(out) {
            *out = match hit {
                None => self.of_order_0(self.light.lights.environment(ray.ray.direction)),
                Some(hit) => self.shade(view, pass, ray, &mut scratch, tally, hit),
            };
        }
    }

    fn pass_bytes(&self, view: View<'_>) -> u64 {
        let of = |(body, source): (&Option<Interior>, &Option<Source>)| {
            Some(source.as_ref()?.bytes(view, body.as_ref()?, &self.light.lights))
        };
        self.bodies.iter().zip(&self.sources).filter_map(of).sum()
    }

    fn lights(&self, scene: &Scene) -> KnownLights {
        KnownLights::met(scene, &self.light.lights)
    }

    fn parts(&self, scene: &Scene) -> Vec<Part> {
        let mut parts = self.light.parts(scene);
        for (object, (body, source)) in scene.objects.iter().zip(self.bodies.iter().zip(&self.sources)) {
            if body.is_none() {
                continue;
            }
            let name = &object.name;
            parts.push(Part::built(format!("distances in `{name}`"), "flights far from any surface need no ray"));
            parts.push(match source {
                Some(source) => Part::built(
                    format!("photons in `{name}`"),
                    format!(
                        "{} a pass, joined to paths from the camera within {} units",
                        source.count,
                        short(source.reach.into())
                    ),
                ),
                None if !self.light.lights.has_emitters() && !self.light.lights.has_suns() => {
                    let why = "no area light, no sun in a picture: paths meet all light by themselves";
                    Part::left_out(format!("photons in `{name}`"), why)
                }
                None if body.as_ref().is_some_and(|b| b.matched) => {
                    let why = "it does not refract: lights are asked for over straight lines through its boundary";
                    Part::left_out(format!("photons in `{name}`"), why)
                }
                None if body.as_ref().is_some_and(|b| b.rough.is_some()) => {
                    let why = "its boundary is rough: lights are asked for where paths come to it";
                    Part::left_out(format!("photons in `{name}`"), why)
                }
                None if body.as_ref().is_some_and(|b| b.nested) => {
                    let why = "it is clear, or meets other bodies: paths meet lamps by themselves";
                    Part::left_out(format!("photons in `{name}`"), why)
                }
                None => Part::left_out(format!("photons in `{name}`"), "switched off, or nothing for them to do"),
            });
        }
        if self.bodies.iter().all(Option::is_none) {
            parts.push(Part::left_out("media", "no translucent material"));
        }
        parts
    }
}
