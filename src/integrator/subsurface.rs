//! Translucent surfaces: light gathered from a cache of transmitted-light samples, leaving through the boundary.

use super::direct::Albedos;
use super::glossy::Glossy;
use super::indirect::{Indirect, OVER};
use super::parts::{clear_bodies, of_cache};
use super::shade::DirectLight;
use super::single::Single;
use super::volume_path::{Asked, Modelled, Scratch as PathScratch};
use super::walked::{Exitance, WalkedBody};
use super::{CameraRay, Integrator, KnownLights, Part, camera_hits};
use crate::bssrdf::Exit;
use crate::cache::{Cache, Detail, GatherPoint, Gatherer, Plan, Scratch, SubsurfaceOptions, balance, seen};
use crate::error::{Error, Result};
use crate::geometry::{Patches, Solid, SurfacePoint};
use crate::light::{Lights, emitted};
use crate::math::{Rgb, Vec3};
use crate::memory;
use crate::optics::{Medium, reflect};
use crate::query::{Hit, Ray};
use crate::sampling::PixelStream;
use crate::scene::{Body, EntrySampling, ExitanceBy, Object, Scene, Shape, View};
use crate::tally::{Clock, Tally};
use std::sync::{Arc, Once};

/// A cached sample, its columns twice while the tree is built, and its share of the tree.
const BYTES_PER_SAMPLE: u128 = 256;

/// What a sample was measured to take of that, with 0.2 to 1.6 million of them.
const TAKEN_PER_SAMPLE: u64 = 150;

/// L_o = T21 Σ S_d L_t / M + specular reflection, over a cache refilled each pass. Light passes between points of one
/// object only; what enters is all light that arrives, or with no [`SubsurfaceOptions::bounces`] what comes straight from lights.
pub struct Subsurface {
    options: SubsurfaceOptions,
    light: DirectLight,
    albedo: Albedos,
    /// Opaque surfaces that are not Lambertian, where no paths go on.
    glossy: Option<Glossy>,
    /// One for each object; `None` where it is not translucent or has no area.
    plans: Vec<Option<Arc<Plan>>>,
    /// One for each object: whether paths walk through it.
    walked: Vec<bool>,
    /// Light scattered once, where a model leaves it out and no paths go on.
    single: Option<Single>,
    /// Light over other surfaces; `None` where there is none, or it is not asked for.
    indirect: Option<Indirect>,
    surveyed: Once,
}

impl Subsurface {
    /// Tables for the translucent objects of `scene`, and for no others.
    ///
    /// # Errors
    /// A translucent material whose model does not exist for its medium; bodies that paths cannot walk through, where they should.
    pub fn new(scene: &Scene, options: SubsurfaceOptions) -> Result<Self> {
        let objects = 0..scene.objects.len() as u32;
        let translucent = |o: &u32| scene.surface(*o).is_translucent();
        let samples = objects.clone().filter(translucent).count() as u64 * u64::from(options.cache_samples);
        let what = format!("the cache of {samples} samples a pass");
        let needed = u128::from(samples) * BYTES_PER_SAMPLE;
        memory::require(needed, memory::available(), &what, "ask for fewer by `method.cache_samples`")?;
        let lights = Lights::new(scene);
        refuse_unmet(scene, &lights, &options)?;
        refuse_rough(scene, &options)?;
        let walks = |object: u32| options.bounces > 0 && scene.exitance_by(object, options.shape) == ExitanceBy::Walks;
        let plan = |object| Ok(Plan::new(scene, &lights, object, walks(object), options)?.map(Arc::new));
        let plans: Vec<Option<Arc<Plan>>> = objects.map(plan).collect::<Result<_>>()?;
        if options.shape == Shape::Walked {
            can_be_walked(scene, &plans, &options)?;
        }
        let by_walks = |plan: &Option<Arc<Plan>>| plan.as_ref().is_some_and(|plan| walks(plan.body.object()));
        let walked: Vec<bool> = plans.iter().map(by_walks).collect();
        let modelled = modelled(&plans, &walked, &options);
        let goes_on = walked.contains(&true) || goes_on(scene, &modelled, &options);
        let indirect = goes_on.then(|| Indirect::new(scene, &plans, modelled, &options));
        Ok(Self {
            options,
            light: DirectLight { lights, samples: options.light_samples },
            albedo: Albedos::new(scene)?,
            glossy: if indirect.is_none() { Glossy::new(scene, options.light_samples) } else { None },
            plans,
            walked,
            single: if options.single && indirect.is_none() { Single::new(scene, options.seed)? } else { None },
            indirect,
            surveyed: Once::new(),
        })
    }

    /// What to say of `scene` before it is rendered: light that may not be found.
    pub fn warnings(&self, scene: &Scene) -> Vec<String> {
        if let Some(indirect) = &self.indirect {
            let walked = (0..).zip(&self.walked).filter(|(_, walked)| **walked);
            let long = walked.filter_map(|(object, _)| scene.long_walks(object));
            return indirect.paths.warnings(scene).into_iter().chain(long).collect();
        }
        let black = "`subsurface` without light over other surfaces (`bounces = 0`, `--as-notes`) shows clear bodies black, and lets no \
                     light through; leave that out, or take --method volume_path";
        if scene.has_clear_bodies() { vec![black.into()] } else { Vec::new() }
    }

    /// Whether paths walk through the body of number `object`, and say how much leaves where.
    pub fn walks(&self, object: u32) -> bool {
        self.walked[object as usize]
    }

    /// Whether paths walk through any body.
    pub fn walks_any(&self) -> bool {
        self.walked.contains(&true)
    }

    /// Number of bodies with a near field.
    pub fn near_fields(&self) -> usize {
        self.plans.iter().flatten().filter(|plan| plan.near.is_some()).count()
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
        let object = |i: usize| hits[i].as_ref().map(|hit| hit.mesh as usize).filter(|&o| self.plans[o].is_some());
        let mut translucent: Vec<(usize, usize)> = (0..rays.len()).filter_map(|i| Some((object(i)?, i))).collect();
        translucent.sort_unstable();
        let (mut scratch, mut sums) = (Scratch::default(), Vec::new());
        for group in translucent.chunk_by(|a, b| a.0 == b.0) {
            let (Some(plan), Some(gatherer)) = (&self.plans[group[0].0], &pass[group[0].0]) else { continue };
            let boundary = &plan.body.boundary;
            let point = |&(_, i): &(usize, usize)| {
                let (w, hit) = (-rays[i].ray.direction, hits[i].as_ref()?);
                let at = view.point(hit, -w);
                let x = (at.x - plan.body.table().centre()).as_vec3();
                let exit = Exit { x, n: at.normal_seen_from(w), w };
                let passed = boundary.tint(&at) * boundary.passed(exit.n.dot(w));
                Some((GatherPoint { exit, place: at.x, stream: rays[i].stream }, passed))
            };
            let (points, passed): (Vec<GatherPoint>, Vec<Rgb>) = group.iter().filter_map(point).unzip();
            plan.gather((view, &self.light.lights), (gatherer, Detail::Fine), &points, &mut scratch, tally, &mut sums);
            for ((&(_, i), &passed), &sum) in group.iter().zip(&passed).zip(&sums) {
                inside[i] = sum * passed;
                if let (Some(single), Some(hit)) = (&self.single, &hits[i]) {
                    inside[i] += single.radiance(view, &rays[i], hit, tally);
                }
            }
        }
        inside
    }

    /// Paths from the camera; all that they ask of a body is gathered together.
    fn all_the_light(
        &self,
        view: View<'_>,
        (indirect, pass): (&Indirect, &Lit),
        rays: &[CameraRay],
        hits: &[Option<Hit>],
        out: &mut [Rgb],
        tally: &mut Tally,
    ) {
        let (mut paths, mut asked) = (PathScratch::default(), Vec::new());
        let inside = indirect.paths.camera_is_inside();
        for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
            out[i] = match hit {
                _ if inside => indirect.paths.seen_from_inside(view, ray, &mut paths, tally),
                None => self.light.lights.environment(ray.ray.direction),
                Some(hit) if view.scene.surface(hit.mesh).is_lambertian() => {
                    let at = view.point(hit, ray.ray.direction);
                    let albedo = self.albedo.at(view.scene, hit.mesh, &at);
                    let straight = self.light.reflected(view, &at, albedo, &mut ray.stream.clone(), tally);
                    straight + indirect.paths.reflected(view, ray, hit, &mut paths, tally)
                }
                Some(hit) => indirect.paths.shade(view, &[], ray, &mut paths, tally, hit),
            };
            asked.extend(paths.asked.drain(..).map(|asked| (i, asked)));
        }
        asked.sort_by_key(|(_, asked)| (asked.object, asked.later));
        let (mut scratch, mut sums) = (Scratch::default(), Vec::new());
        for group in asked.chunk_by(|a, b| (a.1.object, a.1.later) == (b.1.object, b.1.later)) {
            let object = group[0].1.object as usize;
            let (Some(plan), Some(gatherer)) = (&self.plans[object], &pass.caches[object]) else { continue };
            let point = |(_, asked): &(usize, Asked)| {
                let x = (asked.at.x - plan.body.table().centre()).as_vec3();
                let exit = Exit { x, n: asked.at.normal_seen_from(asked.w), w: asked.w };
                GatherPoint { exit, place: asked.at.x, stream: asked.stream }
            };
            let points: Vec<GatherPoint> = group.iter().map(point).collect();
            let walked = pass.walked.get(object).and_then(Option::as_ref);
            let detail = match walked {
                _ if group[0].1.later => Detail::Coarse,
                Some(_) if self.options.cut_error.is_none() => Detail::Middle,
                _ => Detail::Fine,
            };
            plan.gather((view, &self.light.lights), (gatherer, detail), &points, &mut scratch, tally, &mut sums);
            for (((i, asked), point), sum) in group.iter().zip(&points).zip(&sums) {
                let sum = walked.map_or(*sum, |walked| walked.radiance(&asked.at, &point.exit, *sum));
                out[*i] += sum * asked.weight;
            }
        }
    }

    fn shade(&self, view: View<'_>, ray: &CameraRay, hit: &Hit, inside: Rgb, tally: &mut Tally) -> Rgb {
        if let Some(glossy) = self.glossy.as_ref().and_then(|glossy| glossy.radiance(view, ray, hit, tally)) {
            return glossy;
        }
        let at = view.point(hit, ray.ray.direction);
        let mut stream = ray.stream;
        let object = hit.mesh as usize;
        let Some(plan) = &self.plans[object] else {
            return emitted(view.scene, hit, ray.ray.direction)
                + self.light.reflected(view, &at, self.albedo.at(view.scene, hit.mesh, &at), &mut stream, tally);
        };
        if !self.options.specular {
            return inside;
        }
        let w = -ray.ray.direction;
        let n = at.normal_seen_from(w);
        inside + self.mirrored(view, &at, reflect(w, n), &mut stream, tally) * plan.body.boundary.reflected(n.dot(w))
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
                let albedo = self.albedo.at(view.scene, hit.mesh, &there);
                emitted(view.scene, &hit, direction) + self.light.reflected(view, &there, albedo, stream, tally)
            }
        }
    }
}

/// Refuses lights that no direction by the cosine meets, where there are no others.
fn refuse_unmet(scene: &Scene, lights: &Lights, options: &SubsurfaceOptions) -> Result<()> {
    let unmet = lights.of_no_size(scene).next().filter(|_| options.entry == EntrySampling::Cosine);
    unmet.map_or(Ok(()), |name| {
        let what = "light that enters is looked for by the cosine (`entry = \"cosine\"`, `--as-notes`)";
        Err(Error::scene(format!(
            "{what}, which never meets light {name:?}, for it has no size: take type = \"sun\" or an emissive sphere, or leave that out"
        )))
    })
}

/// Refuses rough boundaries where no path asks for what they reflect.
fn refuse_rough(scene: &Scene, options: &SubsurfaceOptions) -> Result<()> {
    let is_rough = |o: &&Object| {
        let inside = &scene.materials[o.material].surface.inside;
        options.bounces == 0 && inside.as_ref().is_some_and(|inside| inside.rough.is_some())
    };
    scene.objects.iter().find(is_rough).map_or(Ok(()), |object| {
        Err(Error::scene(format!(
            "the boundary of `{}` is rough, and `bounces = 0` (as in `--as-notes`) knows smooth ones alone: leave out `roughness` or that",
            object.name
        )))
    })
}

/// That paths can walk through all translucent bodies.
fn can_be_walked(scene: &Scene, plans: &[Option<Arc<Plan>>], options: &SubsurfaceOptions) -> Result<()> {
    if options.bounces == 0 {
        let what = "`shape = \"walked\"` is of all the light, and `bounces = 0` of what comes straight from lights";
        return Err(Error::scene(format!("{what}: leave out one of them")));
    }
    let mut refusals: Vec<String> = Vec::new();
    for refusal in plans.iter().flatten().flat_map(|plan| scene.not_walkable(plan.body.object())) {
        // What stands between two bodies is in the way of both.
        if !refusals.contains(&refusal) {
            refusals.push(refusal);
        }
    }
    if refusals.is_empty() {
        return Ok(());
    }
    refusals.push("`shape = \"walked\"` is for bodies that paths can walk through: mend that, or leave it out".into());
    Err(Error::scene(refusals.join("\n")))
}

/// The light of a pass.
pub struct Lit {
    caches: Vec<Option<Gatherer>>,
    /// Of bodies that are walked through; empty where none are.
    walked: Vec<Option<Exitance>>,
}

/// How paths meet each body.
fn modelled(plans: &[Option<Arc<Plan>>], walked: &[bool], options: &SubsurfaceOptions) -> Vec<Option<Modelled>> {
    let of = |(plan, &walked): (&Option<Arc<Plan>>, &bool)| {
        let plan = plan.as_ref()?;
        let once = options.single && !plan.body.model.claims().first_order;
        // Patches have no light that comes straight through, not even through what is thin of a thick body.
        let clear = walked || lets_light_through(&plan.body.body, plan.medium());
        // What comes over other surfaces is in what the paths bring.
        let near = plan.near.as_ref().filter(|_| !walked).map(|_| plan.clone());
        Some(Modelled { boundary: plan.body.boundary.clone(), clear, once, near, walked })
    };
    plans.iter().zip(walked).map(of).collect()
}

/// Optical thickness of bodies beyond which no light is taken to come through straight: less than exp(-14), a millionth.
const OPAQUE: f64 = 14.0;

/// Whether light comes straight through a body, by its thickness.
fn lets_light_through(body: &Body, medium: &Medium) -> bool {
    let sigma_t = medium.sigma_t();
    let least = f64::from(sigma_t.0.into_iter().fold(f32::INFINITY, f32::min));
    body.thickness.is_some_and(|thickness| least * thickness < OPAQUE)
}

/// Dents no deeper than this share of a body are rounding: four corners of a plane face are not in one plane.
const ROUNDING: f64 = 1e-6;

/// Whether any light comes over another surface: not where one convex body stands alone among lights.
fn goes_on(scene: &Scene, modelled: &[Option<Modelled>], options: &SubsurfaceOptions) -> bool {
    if options.bounces == 0 {
        return false;
    }
    let reflects = |(i, o): &(usize, &Object)| {
        let surface = &scene.materials[o.material].surface;
        modelled[*i].is_some() || surface.is_opaque() && !surface.bsdf.albedo().is_black()
    };
    let rough = |m: &Modelled| m.boundary.rough.is_some();
    if scene.has_clear_bodies() || modelled.iter().flatten().any(rough) {
        return true;
    }
    let mut all = scene.objects.iter().enumerate().filter(reflects);
    match (all.next(), all.next()) {
        (None, _) => false,
        (Some((i, object)), None) => {
            let clear = modelled[i].as_ref().is_some_and(|m| m.clear);
            let size = object.mesh.bounds().map_or(0.0, |bounds| bounds.extent().max_element());
            clear || !Solid::new(&object.mesh).is_convex(ROUNDING * size)
        }
        _ => true,
    }
}

impl Integrator for Subsurface {
    type Pass = Lit;

    fn begin_pass(&self, view: View<'_>, pass: u32, tally: &mut Tally) -> Self::Pass {
        let lights = &self.light.lights;
        Clock::time(&mut tally.clock.survey, || {
            self.surveyed.call_once(|| {
                let each = self.plans.iter().zip(seen(view));
                each.for_each(|(plan, seen)| plan.iter().for_each(|plan| plan.survey(view, lights, &seen)));
                if let Some(indirect) = &self.indirect {
                    indirect.survey(view, lights, &self.plans);
                }
                if self.indirect.is_some() {
                    let by_model = self.plans.iter().zip(&self.walked).filter(|(_, walked)| !**walked);
                    for plan in by_model.filter_map(|(plan, _)| plan.as_ref()) {
                        let clear = lets_light_through(&plan.body.body, plan.medium());
                        plan.balanced_by(|| balance(plan, view, clear));
                    }
                }
            });
        });
        let mut fill = |plan: &Option<Arc<Plan>>| Some(plan.as_ref()?.fill(view, lights, pass, tally));
        let mut caches: Vec<Option<Cache>> = self.plans.iter().map(&mut fill).collect();
        let walks = self
            .indirect
            .as_ref()
            .map(|indirect| indirect.add(view, lights, &self.plans, &mut caches, pass, tally))
            .unwrap_or_default();
        let ready =
            |(plan, cache): (&Option<Arc<Plan>>, Option<Cache>)| Some(plan.as_ref()?.ready(cache?, pass, tally));
        let caches: Vec<Option<Gatherer>> = self.plans.iter().zip(caches).map(ready).collect();
        let bodies = self.indirect.iter().flat_map(|indirect| &indirect.walked);
        let exitance = |((body, patches), cache): ((&Option<WalkedBody>, Option<Patches>), &Option<Gatherer>)| {
            let body = body.as_ref()?;
            let emerged = &walks.emerged[body.plan().body.object() as usize];
            Some(body.exitance((view, lights), (cache.as_ref()?, pass), patches?, emerged, tally))
        };
        let start = std::time::Instant::now();
        let walked = bodies.zip(walks.patches).zip(&caches).map(exitance).collect();
        tally.clock.walks += start.elapsed().as_secs_f64();
        Lit { caches, walked }
    }

    fn radiance(&self, view: View<'_>, pass: &Self::Pass, rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        let hits = camera_hits(view, rays, tally);
        if let Some(indirect) = &self.indirect {
            self.all_the_light(view, (indirect, pass), rays, &hits, out, tally);
            return;
        }
        let inside = self.inside(view, &pass.caches, rays, &hits, tally);
        for (((ray, hit), inside), out) in rays.iter().zip(&hits).zip(inside).zip(out) {
            *out = match hit {
                None => self.light.lights.environment(ray.ray.direction),
                Some(hit) => self.shade(view, ray, hit, inside, tally),
            };
        }
    }

    fn shares_tiles(&self) -> bool {
        self.options.splits()
    }

    fn pass_bytes(&self, _: View<'_>) -> u64 {
        let samples = |plan: &Option<Arc<Plan>>| plan.as_ref().map_or(0, |plan| u64::from(plan.samples));
        let samples: Vec<u64> = self.plans.iter().map(samples).collect();
        let more = self.indirect.as_ref().map_or(0, |indirect| indirect.bytes(&samples));
        samples.iter().sum::<u64>() * TAKEN_PER_SAMPLE + more
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
        if self.plans.iter().all(Option::is_none) {
            parts.push(Part::left_out("area tables and sample cache", "no translucent material"));
        }
        for (object, plan) in scene.objects.iter().zip(&self.plans) {
            parts.extend(plan.iter().flat_map(|plan| of_cache(plan, &object.name, self.options.estimator)));
        }
        parts.extend(self.indirect.as_ref().and_then(|_| clear_bodies(scene)));
        parts.push(match &self.indirect {
            Some(indirect) => indirect.part(),
            None if self.options.bounces == 0 => {
                Part::left_out(OVER, "switched off: light comes straight from the lights")
            }
            None => Part::left_out(OVER, "no surface reflects light to another, and no body to itself"),
        });
        let lacking = self.single.is_some() || self.indirect.as_ref().is_some_and(Indirect::walks_once);
        parts.push(match (lacking, self.options.single) {
            (true, _) => Part::built(
                "single scattering",
                "straight from lamps, but for what small lamps send by a reflection inside; the models begin with light scattered twice",
            ),
            (false, true) => Part::left_out("single scattering", "the models have it"),
            (false, false) => Part::left_out("single scattering", "switched off"),
        });
        parts.push(if self.options.specular {
            Part::built("specular reflection", "nearest-hit rays")
        } else {
            Part::left_out("specular reflection", "switched off")
        });
        parts
    }
}
