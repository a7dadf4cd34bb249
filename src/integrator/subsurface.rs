//! Translucent surfaces: light gathered from a cache of transmitted-light samples, leaving through the boundary.

use super::direct::lambertian_albedos;
use super::shade::DirectLight;
use super::{CameraRay, Integrator, Part, Tally, View};
use crate::bssrdf::{Exit, Model};
use crate::cache::{CachedSample, Density, Envelope, Filler, Gatherer, PLAIN_SUM, Scratch, Seen, seen};
use crate::error::Result;
use crate::geometry::{AreaTable, SurfacePoint};
use crate::light::{Lights, emitted};
use crate::math::{Rgb, Vec3};
use crate::memory;
use crate::optics::{Medium, reflect, reflectance, transmittance};
use crate::query::{Hit, Ray};
use crate::sampling::{CacheStream, PixelStream, Points};
use crate::scene::{EntrySampling, Estimator, Scene, Spread, Surface};
use std::sync::OnceLock;

/// A cached sample, its columns twice while the tree is built, and its share of the tree.
const BYTES_PER_SAMPLE: u128 = 256;

/// Options of [`Subsurface`].
#[derive(Clone, Copy, Debug)]
pub struct SubsurfaceOptions {
    /// Cached samples per pass and translucent object.
    pub cache_samples: u32,
    /// How the sum over the cache is estimated.
    pub estimator: Estimator,
    /// The largest share of the sum that one node of a `cut` may be wrong by.
    pub cut_error: f32,
    /// How directions of entering light are picked.
    pub entry: EntrySampling,
    /// What numbers pick the points on the surface.
    pub points: Points,
    /// How the points are spread over the surface.
    pub spread: Spread,
    /// Whether smooth surfaces mirror lights and environment.
    pub specular: bool,
    /// Samples of each kind of light per diffuse point.
    pub light_samples: u32,
    /// Seed of the render.
    pub seed: u64,
}

/// L_o = T21 Σ S_d L_t / M + specular reflection, over a cache refilled each pass. Light passes between points of one
/// object only; what enters is direct light.
pub struct Subsurface {
    options: SubsurfaceOptions,
    light: DirectLight,
    albedo: Vec<Rgb>,
    /// One for each object; `None` where it is not translucent or has no area.
    bodies: Vec<Option<Body>>,
    /// Where each body's samples are spent; known with the first pass.
    densities: OnceLock<Vec<Density>>,
}

/// A translucent object.
struct Body {
    medium: Medium,
    model: Model,
    envelope: Envelope,
    table: AreaTable,
    stream: CacheStream,
}

impl Subsurface {
    /// Tables for the translucent objects of `scene`, and for no others.
    ///
    /// # Errors
    /// A translucent material whose model does not exist for its medium.
    pub fn new(scene: &Scene, options: SubsurfaceOptions) -> Result<Self> {
        let translucent =
            |o: &crate::scene::Object| matches!(scene.materials[o.material].surface, Surface::Translucent(_));
        let samples = scene.objects.iter().filter(|o| translucent(o)).count() as u64 * u64::from(options.cache_samples);
        let what = format!("the cache of {samples} samples a pass");
        let needed = u128::from(samples) * BYTES_PER_SAMPLE;
        memory::require(needed, memory::available(), &what, "ask for fewer by `method.cache_samples`")?;
        let body = |(index, object): (usize, &crate::scene::Object)| {
            let Surface::Translucent(t) = &scene.materials[object.material].surface else { return Ok(None) };
            let Some(table) = AreaTable::new(&object.mesh) else { return Ok(None) };
            let stream = CacheStream::new(options.points, options.seed, index as u64);
            let model = t.build()?;
            let envelope = Envelope::new(&model, &t.medium);
            Ok(Some(Body { medium: t.medium, model, envelope, table, stream }))
        };
        Ok(Self {
            options,
            light: DirectLight { lights: Lights::new(scene), samples: options.light_samples },
            albedo: lambertian_albedos(scene)?,
            bodies: scene.objects.iter().enumerate().map(body).collect::<Result<_>>()?,
            densities: OnceLock::new(),
        })
    }

    /// What fills the cache of object number `object`.
    fn filler<'a>(&'a self, view: View<'a>, object: usize, body: &'a Body, density: &'a Density) -> Filler<'a> {
        Filler {
            scene: view.scene,
            rays: view.rays,
            lights: &self.light.lights,
            object: object as u32,
            table: &body.table,
            model: &body.model,
            eta: body.medium.eta,
            sampling: self.options.entry,
            stream: &body.stream,
            density,
        }
    }

    /// Where each body's samples are spent. A function of scene and seed: the same for any pass that asks first.
    fn densities(&self, view: View<'_>) -> Vec<Density> {
        // With directions by the cosine most trials would miss the lights.
        if self.options.spread == Spread::Area || self.options.entry == EntrySampling::Cosine {
            return self.bodies.iter().map(|_| Density::even()).collect();
        }
        let even = Density::even();
        let density = |(object, (body, seen)): (usize, (&Option<Body>, Vec<Seen>))| {
            let Some(body) = body else { return Density::even() };
            let stream = CacheStream::new(self.options.points, !self.options.seed, object as u64);
            let filler = Filler { stream: &stream, ..self.filler(view, object, body, &even) };
            Density::seen(&filler, &body.envelope, &seen)
        };
        self.bodies.iter().zip(seen(view.scene, view.rays)).enumerate().map(density).collect()
    }

    /// What leaves through the surface at each translucent hit; exits of one object are gathered together.
    fn inside(
        &self,
        view: View<'_>,
        pass: &[Option<Gatherer>],
        rays: &[CameraRay],
        hits: &[Option<Hit>],
        tally: &mut Tally,
    ) -> Vec<Rgb> {
        let mut inside = vec![Rgb::BLACK; rays.len()];
        let object = |i: usize| hits[i].as_ref().map(|hit| hit.mesh as usize).filter(|&o| self.bodies[o].is_some());
        let mut translucent: Vec<(usize, usize)> = (0..rays.len()).filter_map(|i| Some((object(i)?, i))).collect();
        translucent.sort_unstable();
        let (mut scratch, mut found) = (Scratch::default(), Vec::new());
        for group in translucent.chunk_by(|a, b| a.0 == b.0) {
            let (Some(body), Some(gatherer)) = (&self.bodies[group[0].0], &pass[group[0].0]) else { continue };
            let exit = |&(_, i): &(usize, usize)| {
                let (w, hit) = (-rays[i].ray.direction, hits[i].as_ref()?);
                let at = view.point(hit, rays[i].ray.direction);
                Some(Exit { x: at.x, n: at.normal_seen_from(w), w })
            };
            let exits: Vec<Exit> = group.iter().filter_map(exit).collect();
            let keys: Vec<u64> = group.iter().map(|&(_, i)| rays[i].stream.key()).collect();
            gatherer.gather((&body.model, &body.envelope), &exits, &keys, &mut scratch, &mut tally.gather, &mut found);
            for ((&(_, i), exit), &sum) in group.iter().zip(&exits).zip(&found) {
                inside[i] = sum * transmittance(body.medium.eta, exit.n.dot(exit.w));
            }
        }
        inside
    }

    fn shade(&self, view: View<'_>, ray: &CameraRay, hit: &Hit, inside: Rgb, tally: &mut Tally) -> Rgb {
        let at = view.point(hit, ray.ray.direction);
        let mut stream = ray.stream;
        let object = hit.mesh as usize;
        let Some(body) = &self.bodies[object] else {
            return emitted(view.scene, hit, ray.ray.direction)
                + self.light.reflected(view, &at, self.albedo[object], &mut stream, tally);
        };
        if !self.options.specular {
            return inside;
        }
        let w = -ray.ray.direction;
        let n = at.normal_seen_from(w);
        inside + self.mirrored(view, &at, reflect(w, n), &mut stream, tally) * reflectance(body.medium.eta, n.dot(w))
    }

    fn tree_part(&self, name: &str) -> Part {
        let part = format!("sample tree of `{name}`");
        match self.options.estimator {
            Estimator::Cut if self.options.cache_samples as usize > PLAIN_SUM => {
                Part::built(part, format!("each pass, where more than {PLAIN_SUM} samples carry light"))
            }
            Estimator::Cut => Part::left_out(part, format!("up to {PLAIN_SUM} samples the plain sum is faster")),
            other => Part::left_out(part, format!("the estimator `{}` sums over the samples", other.name())),
        }
    }

    /// Radiance from the mirrored `direction`: lights, environment, and other surfaces as Lambertian ones.
    fn mirrored(
        &self,
        view: View<'_>,
        at: &SurfacePoint,
        direction: Vec3,
        stream: &mut PixelStream,
        tally: &mut Tally,
    ) -> Rgb {
        tally.rays.bounce += 1;
        match view.rays.closest(&Ray::new(at.leave(direction), direction)) {
            None => self.light.lights.environment(),
            Some(hit) => {
                let there = view.point(&hit, direction);
                emitted(view.scene, &hit, direction)
                    + self.light.reflected(view, &there, self.albedo[hit.mesh as usize], stream, tally)
            }
        }
    }
}

impl Integrator for Subsurface {
    type Pass = Vec<Option<Gatherer>>;

    fn begin_pass(&self, view: View<'_>, pass: u32, tally: &mut Tally) -> Self::Pass {
        let densities = self.densities.get_or_init(|| self.densities(view));
        let fill = |(object, body): (usize, &Option<Body>)| {
            let body = body.as_ref()?;
            let filler = self.filler(view, object, body, &densities[object]);
            let count = self.options.cache_samples;
            let mut cache = filler.fill(u64::from(pass) * u64::from(count), count, &mut tally.rays);
            let all = cache.lit.len();
            cache.lit.retain(CachedSample::is_finite);
            tally.gather.non_finite += (all - cache.lit.len()) as u64;
            tally.gather.samples += u64::from(count);
            tally.gather.lit += cache.lit.len() as u64;
            Some(Gatherer::new(self.options.estimator, cache, &body.model, self.options.cut_error))
        };
        self.bodies.iter().enumerate().map(fill).collect()
    }

    fn radiance(&self, view: View<'_>, pass: &Self::Pass, rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        let hits = view.camera_hits(rays, tally);
        let inside = self.inside(view, pass, rays, &hits, tally);
        for (((ray, hit), inside), out) in rays.iter().zip(&hits).zip(inside).zip(out) {
            *out = match hit {
                None => self.light.lights.environment(),
                Some(hit) => self.shade(view, ray, hit, inside, tally),
            };
        }
    }

    fn shares_tiles(&self) -> bool {
        self.options.estimator == Estimator::Cut
    }

    fn parts(&self, scene: &Scene) -> Vec<Part> {
        let mut parts = self.light.parts(scene);
        parts.push(match self.options.entry {
            EntrySampling::Light => Part::built("any-hit rays for entering light", "no hit point is needed"),
            EntrySampling::Cosine => {
                Part::built("nearest-hit rays for entering light", "a cosine-sampled direction must find what shines")
            }
        });
        if self.bodies.iter().all(Option::is_none) {
            parts.push(Part::left_out("area tables and sample cache", "no translucent material"));
        }
        for (object, body) in scene.objects.iter().zip(&self.bodies) {
            let Some(body) = body else { continue };
            let name = &object.name;
            let bytes = self.options.cache_samples as usize * size_of::<crate::cache::CachedSample>();
            parts.push(Part::built(
                format!("sample cache of `{name}`"),
                format!(
                    "{} samples a pass ({:.1} MB), {} triangles",
                    self.options.cache_samples,
                    bytes as f64 / 1e6,
                    body.table.len()
                ),
            ));
            parts.push(self.tree_part(name));
            parts.push(if body.medium.is_grey() {
                Part::left_out(format!("colour of `{name}`"), "a grey medium: S_d is evaluated in one channel")
            } else {
                Part::built(format!("colour of `{name}`"), "S_d is evaluated in three channels")
            });
        }
        parts.push(if self.options.specular {
            Part::built("specular reflection", "nearest-hit rays")
        } else {
            Part::left_out("specular reflection", "switched off")
        });
        parts
    }
}
