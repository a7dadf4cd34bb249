//! Translucent surfaces: light gathered from a cache of transmitted-light samples, leaving through the boundary.

use super::direct::lambertian_albedos;
use super::shade::DirectLight;
use super::single::Single;
use super::{CameraRay, Integrator, KnownLights, Part, Tally, View};
use crate::bssrdf::{Bssrdf, Exit, Partition};
use crate::cache::{
    CachedSample, Clock, Density, Envelope, Filler, Gatherer, NearField, PLAIN_SUM, Scratch, Seen, Survey, Tuning, seen,
};
use crate::error::Result;
use crate::geometry::{AreaTable, SurfacePoint};
use crate::light::{Lights, emitted};
use crate::math::{DVec3, Rgb, Vec3};
use crate::memory;
use crate::optics::{Medium, reflect, reflectance, transmittance};
use crate::query::{Hit, Ray};
use crate::sampling::{CacheStream, PixelStream, Points, Turn};
use crate::scene::{EntrySampling, Estimator, Scene, Spread, Surface};
use std::sync::OnceLock;

/// A cached sample, its columns twice while the tree is built, and its share of the tree.
const BYTES_PER_SAMPLE: u128 = 256;

/// What a sample was measured to take of that, with 2 million of them.
const TAKEN_PER_SAMPLE: u64 = 180;

/// Options of [`Subsurface`].
#[derive(Clone, Copy, Debug)]
pub struct SubsurfaceOptions {
    /// Cached samples per pass and translucent object.
    pub cache_samples: u32,
    /// How the sum over the cache is estimated.
    pub estimator: Estimator,
    /// The largest share of the sum that one node of a `cut` may be wrong by; by the noise of the cache if absent.
    pub cut_error: Option<f32>,
    /// How directions of entering light are picked.
    pub entry: EntrySampling,
    /// What numbers pick the points on the surface.
    pub points: Points,
    /// How the points are spread over the surface.
    pub spread: Spread,
    /// Whether smooth surfaces mirror lights and environment.
    pub specular: bool,
    /// Whether light scattered once is added to models that leave it out.
    pub single: bool,
    /// Samples of each kind of light per diffuse point.
    pub light_samples: u32,
    /// Seed of the render.
    pub seed: u64,
}

impl Default for SubsurfaceOptions {
    fn default() -> Self {
        let estimator = Estimator::Cut;
        Self {
            cache_samples: estimator.default_samples(),
            estimator,
            cut_error: None,
            entry: EntrySampling::Light,
            points: Points::Sobol,
            spread: Spread::Seen,
            specular: true,
            single: true,
            light_samples: 1,
            seed: 0,
        }
    }
}

/// L_o = T21 Σ S_d L_t / M + specular reflection, over a cache refilled each pass. Light passes between points of one
/// object only; what enters is direct light.
pub struct Subsurface {
    options: SubsurfaceOptions,
    light: DirectLight,
    albedo: Vec<Rgb>,
    /// One for each object; `None` where it is not translucent or has no area.
    bodies: Vec<Option<Body>>,
    /// Light scattered once, where a model leaves it out.
    single: Option<Single>,
    /// What is known of each body with the first pass.
    plans: OnceLock<Vec<Plan>>,
}

/// A sum over the cached samples whose relative variance would be above this, if they were independent, gets a near field.
const NOISY: f64 = 1.0 / 8.0;
/// Radius of the near field in distances between cached samples.
const NEAR_RADIUS: f32 = 3.0;
/// Relative variance that the cache may add to a near field: the fewest samples that keep to it are taken.
const FAR_NOISE: f64 = 2e-3;
/// Where the cache adds less than this, the near field is made smaller.
const FAR_NOTHING: f64 = 1e-5;
/// A cache beside a near field has at least so many samples.
const FEWEST: u32 = 4096;
/// Sums below this share of what is typical for the object are held to the accuracy of one of this size.
const DARK: f32 = 0.1;
/// A cut whose nodes may be wrong by a share e adds a relative variance of about 0.001 e: with this factor a third of the
/// cache's.
const CUT_SHARE: f64 = 300.0;
/// The finest cut.
const FINEST: f64 = 0.01;
/// The coarsest cut.
const COARSEST: f64 = 0.2;

/// How a body's light is gathered.
struct Plan {
    survey: Survey,
}

/// A translucent object.
struct Body {
    medium: Medium,
    model: Box<dyn Bssrdf>,
    envelope: Envelope,
    table: AreaTable,
    /// Of even passes and of odd ones.
    streams: [CacheStream; Turn::STREAMS],
    cosine_share: f32,
    /// For media whose light does not come as far as the next sample of the cache.
    near: Option<NearField>,
    /// Cached samples a pass.
    samples: u32,
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
        let lights = Lights::new(scene);
        let body = |(index, object): (usize, &crate::scene::Object)| {
            let Surface::Translucent(t) = &scene.materials[object.material].surface else { return Ok(None) };
            let Some(table) = AreaTable::new(&object.mesh) else { return Ok(None) };
            let stream = |seed| CacheStream::new(options.points, seed, index as u64);
            let model = t.build()?;
            let envelope = Envelope::new(&*model, &t.medium);
            let streams = Turn::seeds(options.seed).map(stream);
            let cosine_share = object.mesh.bounds().map_or(0.0, |bounds| lights.cosine_share(bounds));
            let (near, samples) = near_field(&envelope, table.area(), &options);
            Ok(Some(Body { medium: t.medium, model, envelope, table, streams, cosine_share, near, samples }))
        };
        let bodies = scene.objects.iter().enumerate().map(body).collect::<Result<_>>()?;
        Ok(Self {
            options,
            light: DirectLight { lights, samples: options.light_samples },
            albedo: lambertian_albedos(scene)?,
            bodies,
            single: if options.single { Single::new(scene, options.seed)? } else { None },
            plans: OnceLock::new(),
        })
    }

    /// Number of bodies with a near field.
    pub fn near_fields(&self) -> usize {
        self.bodies.iter().flatten().filter(|body| body.near.is_some()).count()
    }

    /// What fills the cache of object number `object`.
    fn filler<'a>(
        &'a self,
        view: View<'a>,
        object: usize,
        body: &'a Body,
        stream: &'a CacheStream,
        density: &'a Density,
    ) -> Filler<'a> {
        Filler {
            scene: view.scene,
            rays: view.rays,
            lights: &self.light.lights,
            object: object as u32,
            table: &body.table,
            model: &*body.model,
            eta: body.medium.eta,
            sampling: self.options.entry,
            cosine_share: body.cosine_share,
            stream,
            density,
        }
    }

    /// What is known of each body before its first pass. A function of scene and seed: the same for any pass that asks first.
    fn plans(&self, view: View<'_>) -> Vec<Plan> {
        // With directions by the cosine most trials would miss the lights.
        let blind = self.options.entry == EntrySampling::Cosine || self.options.estimator == Estimator::Notes;
        let mut points = if blind { Vec::new() } else { seen(view.scene, view.rays) };
        points.resize(self.bodies.len(), Vec::new());
        let even = Density::even();
        let plan = |(object, (body, seen)): (usize, (&Option<Body>, Vec<Seen>))| {
            let Some(body) = body.as_ref().filter(|_| !seen.is_empty()) else {
                return Plan { survey: Survey::none() };
            };
            let stream = CacheStream::new(self.options.points, !self.options.seed, object as u64);
            let filler = self.filler(view, object, body, &stream, &even);
            let survey = Survey::new(&filler, &body.envelope, &seen, self.options.spread, body.samples);
            Plan { survey }
        };
        self.bodies.iter().zip(points).enumerate().map(plan).collect()
    }

    /// How fine the sums of pass number `pass` are.
    fn tuning(&self, body: &Body, plan: &Plan, pass: u32) -> Tuning {
        let passes = f64::from(pass) + 1.0;
        let noise2 = plan.survey.noise2(passes * f64::from(body.samples));
        // Draws of a cut are new in each pass, and average as its number; the cache's stream goes on and averages faster.
        let error = self.options.cut_error.unwrap_or((CUT_SHARE * passes * noise2).clamp(FINEST, COARSEST) as f32);
        Tuning {
            error,
            floor: DARK * plan.survey.typical,
            partition: body.near.as_ref().map_or(Partition::NONE, |near| near.rest),
        }
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
                let x = (at.x - body.table.centre()).as_vec3();
                Some((Exit { x, n: at.normal_seen_from(w), w }, at.x))
            };
            let (exits, places): (Vec<Exit>, Vec<DVec3>) = group.iter().filter_map(exit).unzip();
            let keys: Vec<u64> = group.iter().map(|&(_, i)| rays[i].stream.key()).collect();
            let kernel = (&*body.model, &body.envelope);
            Clock::time(&mut tally.clock.gather, || {
                gatherer.gather(kernel, &exits, &keys, &mut scratch, &mut tally.gather, &mut found);
            });
            if let Some(near) = &body.near {
                let even = Density::even();
                let filler = self.filler(view, group[0].0, body, &body.streams[0], &even);
                let streams: Vec<PixelStream> = group.iter().map(|&(_, i)| rays[i].stream).collect();
                let tally = (&mut tally.rays, &mut tally.gather, &mut tally.clock);
                near.add(&filler, (&exits, &places), &streams, tally, &mut found);
            }
            for ((&(_, i), exit), &sum) in group.iter().zip(&exits).zip(&found) {
                inside[i] = sum * transmittance(body.medium.eta, exit.n.dot(exit.w));
                if let (Some(single), Some(hit)) = (&self.single, &hits[i]) {
                    inside[i] += single.radiance(view, &rays[i], hit, tally);
                }
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

    fn tree_part(&self, name: &str, body: &Body) -> Part {
        let part = format!("sample tree of `{name}`");
        match self.options.estimator {
            Estimator::Cut if body.samples as usize > PLAIN_SUM => {
                Part::built(part, format!("each pass, where more than {PLAIN_SUM} samples carry light"))
            }
            Estimator::Cut => Part::left_out(part, format!("up to {PLAIN_SUM} samples the plain sum is faster")),
            other => Part::left_out(part, format!("the estimator `{}` sums over the samples", other.name())),
        }
    }

    fn near_part(&self, name: &str, body: &Body) -> Part {
        let part = format!("near field of `{name}`");
        match (&body.near, self.options.estimator) {
            (Some(near), _) => Part::built(
                part,
                format!(
                    "light within {:.3} is sampled for each exit, {} samples serve for the rest",
                    near.radius(),
                    body.samples
                ),
            ),
            (None, Estimator::Notes | Estimator::Thinned) => {
                Part::left_out(part, "the lecture's law takes the cache alone")
            }
            (None, _) => Part::left_out(part, "light comes farther than from one cached sample to the next"),
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
            None => self.light.lights.environment(direction),
            Some(hit) => {
                let there = view.point(&hit, direction);
                emitted(view.scene, &hit, direction)
                    + self.light.reflected(view, &there, self.albedo[hit.mesh as usize], stream, tally)
            }
        }
    }
}

/// The near field of a body of `area` [unit²], where its medium needs one, and how many samples its cache then has.
fn near_field(envelope: &Envelope, area: f64, options: &SubsurfaceOptions) -> (Option<NearField>, u32) {
    let most = options.cache_samples;
    let split = matches!(options.estimator, Estimator::All | Estimator::Cut | Estimator::Cluster);
    let apart2 = |samples: u32| area / f64::from(samples.max(1));
    let noise = |samples, part| apart2(samples) * envelope.variance_per_area(part);
    if !split || options.entry == EntrySampling::Cosine || noise(most, Partition::NONE) <= NOISY {
        return (None, most);
    }
    let radius = |samples| NEAR_RADIUS * apart2(samples).sqrt() as f32;
    let mut samples = FEWEST.min(most);
    while samples < most && noise(samples, Partition::beyond(radius(samples))) > FAR_NOISE {
        samples = samples.saturating_mul(2).min(most);
    }
    // Short lines meet fewer surfaces that do not matter.
    let mut radius = radius(samples);
    while noise(samples, Partition::beyond(0.7 * radius)) <= FAR_NOTHING {
        radius *= 0.7;
    }
    (Some(NearField::new(envelope, radius)), samples)
}

impl Integrator for Subsurface {
    type Pass = Vec<Option<Gatherer>>;

    fn begin_pass(&self, view: View<'_>, pass: u32, tally: &mut Tally) -> Self::Pass {
        let plans = Clock::time(&mut tally.clock.survey, || self.plans.get_or_init(|| self.plans(view)));
        let turn = Turn::of(self.options.seed, pass);
        let fill = |(object, body): (usize, &Option<Body>)| {
            let body = body.as_ref()?;
            let density = &plans[object].survey.density;
            let filler = self.filler(view, object, body, &body.streams[turn.stream], density);
            let count = body.samples;
            let first = u64::from(turn.number) * u64::from(count);
            let mut cache = Clock::time(&mut tally.clock.fill, || filler.fill(first, count, &mut tally.rays));
            let all = cache.lit.len();
            cache.lit.retain(CachedSample::is_finite);
            tally.gather.non_finite += (all - cache.lit.len()) as u64;
            tally.gather.samples += u64::from(count);
            tally.gather.lit += cache.lit.len() as u64;
            let tuning = self.tuning(body, &plans[object], pass);
            let ready = || Gatherer::new(self.options.estimator, cache, &*body.model, tuning);
            Some(Clock::time(&mut tally.clock.tree, ready))
        };
        self.bodies.iter().enumerate().map(fill).collect()
    }

    fn radiance(&self, view: View<'_>, pass: &Self::Pass, rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        let hits = view.camera_hits(rays, tally);
        let inside = self.inside(view, pass, rays, &hits, tally);
        for (((ray, hit), inside), out) in rays.iter().zip(&hits).zip(inside).zip(out) {
            *out = match hit {
                None => self.light.lights.environment(ray.ray.direction),
                Some(hit) => self.shade(view, ray, hit, inside, tally),
            };
        }
    }

    fn shares_tiles(&self) -> bool {
        matches!(self.options.estimator, Estimator::All | Estimator::Cut | Estimator::Cluster)
    }

    fn pass_bytes(&self, _view: View<'_>) -> u64 {
        let samples: u64 = self.bodies.iter().flatten().map(|body| u64::from(body.samples)).sum();
        samples * TAKEN_PER_SAMPLE
    }

    fn lights(&self, scene: &Scene) -> KnownLights {
        KnownLights::asked(scene, &self.light.lights)
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
            let bytes = body.samples as usize * size_of::<crate::cache::CachedSample>();
            parts.push(Part::built(
                format!("sample cache of `{name}`"),
                format!(
                    "{} samples a pass ({:.1} MB), {} triangles",
                    body.samples,
                    bytes as f64 / 1e6,
                    body.table.len()
                ),
            ));
            parts.push(self.tree_part(name, body));
            parts.push(self.near_part(name, body));
            parts.push(if body.medium.is_grey() {
                Part::left_out(format!("colour of `{name}`"), "a grey medium: S_d is evaluated in one channel")
            } else {
                Part::built(format!("colour of `{name}`"), "S_d is evaluated in three channels")
            });
        }
        parts.push(match (&self.single, self.options.single) {
            (Some(_), _) => Part::built(
                "single scattering",
                "straight from lamps, but for what small lamps send by a reflection inside; the models begin with light scattered twice",
            ),
            (None, true) => Part::left_out("single scattering", "the models have it"),
            (None, false) => Part::left_out("single scattering", "switched off"),
        });
        parts.push(if self.options.specular {
            Part::built("specular reflection", "nearest-hit rays")
        } else {
            Part::left_out("specular reflection", "switched off")
        });
        parts
    }
}
