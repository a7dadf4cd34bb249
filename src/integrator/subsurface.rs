//! Translucent surfaces: light gathered from a cache of transmitted-light samples, leaving through the boundary.

use super::direct::lambertian_albedos;
use super::parts::of_cache;
use super::shade::DirectLight;
use super::single::Single;
use super::{CameraRay, Integrator, KnownLights, Part, camera_hits};
use crate::bssrdf::Exit;
use crate::cache::{GatherPoint, Gatherer, Plan, Scratch, SubsurfaceOptions, seen};
use crate::error::Result;
use crate::geometry::SurfacePoint;
use crate::light::{Lights, emitted};
use crate::math::{Rgb, Vec3};
use crate::memory;
use crate::optics::{reflect, reflectance, transmittance};
use crate::query::{Hit, Ray};
use crate::sampling::PixelStream;
use crate::scene::{EntrySampling, Scene, View};
use crate::tally::{Clock, Tally};
use std::sync::Once;

/// A cached sample, its columns twice while the tree is built, and its share of the tree.
const BYTES_PER_SAMPLE: u128 = 256;

/// What a sample was measured to take of that, with 2 million of them.
const TAKEN_PER_SAMPLE: u64 = 180;

/// L_o = T21 Σ S_d L_t / M + specular reflection, over a cache refilled each pass. Light passes between points of one
/// object only; what enters is direct light.
pub struct Subsurface {
    options: SubsurfaceOptions,
    light: DirectLight,
    albedo: Vec<Rgb>,
    /// One for each object; `None` where it is not translucent or has no area.
    plans: Vec<Option<Plan>>,
    /// Light scattered once, where a model leaves it out.
    single: Option<Single>,
    surveyed: Once,
}

impl Subsurface {
    /// Tables for the translucent objects of `scene`, and for no others.
    ///
    /// # Errors
    /// A translucent material whose model does not exist for its medium.
    pub fn new(scene: &Scene, options: SubsurfaceOptions) -> Result<Self> {
        let objects = 0..scene.objects.len() as u32;
        let translucent = |o: &u32| scene.surface(*o).is_translucent();
        let samples = objects.clone().filter(translucent).count() as u64 * u64::from(options.cache_samples);
        let what = format!("the cache of {samples} samples a pass");
        let needed = u128::from(samples) * BYTES_PER_SAMPLE;
        memory::require(needed, memory::available(), &what, "ask for fewer by `method.cache_samples`")?;
        let lights = Lights::new(scene);
        let plans = objects.map(|object| Plan::new(scene, &lights, object, options)).collect::<Result<_>>()?;
        Ok(Self {
            options,
            light: DirectLight { lights, samples: options.light_samples },
            albedo: lambertian_albedos(scene)?,
            plans,
            single: if options.single { Single::new(scene, options.seed)? } else { None },
            surveyed: Once::new(),
        })
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
            let point = |&(_, i): &(usize, usize)| {
                let (w, hit) = (-rays[i].ray.direction, hits[i].as_ref()?);
                let at = view.point(hit, -w);
                let x = (at.x - plan.body.table.centre()).as_vec3();
                let exit = Exit { x, n: at.normal_seen_from(w), w };
                Some(GatherPoint { exit, place: at.x, stream: rays[i].stream })
            };
            let points: Vec<GatherPoint> = group.iter().filter_map(point).collect();
            plan.gather((view, &self.light.lights), gatherer, &points, &mut scratch, tally, &mut sums);
            for ((&(_, i), point), &sum) in group.iter().zip(&points).zip(&sums) {
                inside[i] = sum * transmittance(plan.body.eta, point.exit.n.dot(point.exit.w));
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
        let Some(plan) = &self.plans[object] else {
            return emitted(view.scene, hit, ray.ray.direction)
                + self.light.reflected(view, &at, self.albedo[object], &mut stream, tally);
        };
        if !self.options.specular {
            return inside;
        }
        let w = -ray.ray.direction;
        let n = at.normal_seen_from(w);
        inside + self.mirrored(view, &at, reflect(w, n), &mut stream, tally) * reflectance(plan.body.eta, n.dot(w))
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

impl Integrator for Subsurface {
    type Pass = Vec<Option<Gatherer>>;

    fn begin_pass(&self, view: View<'_>, pass: u32, tally: &mut Tally) -> Self::Pass {
        let lights = &self.light.lights;
        Clock::time(&mut tally.clock.survey, || {
            self.surveyed.call_once(|| {
                let each = self.plans.iter().zip(seen(view));
                each.for_each(|(plan, seen)| plan.iter().for_each(|plan| plan.survey(view, lights, &seen)));
            });
        });
        self.plans.iter().map(|plan| Some(plan.as_ref()?.fill(view, lights, pass, tally))).collect()
    }

    fn radiance(&self, view: View<'_>, pass: &Self::Pass, rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        let hits = camera_hits(view, rays, tally);
        let inside = self.inside(view, pass, rays, &hits, tally);
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

    fn pass_bytes(&self, _view: View<'_>) -> u64 {
        let samples: u64 = self.plans.iter().flatten().map(|plan| u64::from(plan.samples)).sum();
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
        if self.plans.iter().all(Option::is_none) {
            parts.push(Part::left_out("area tables and sample cache", "no translucent material"));
        }
        for (object, plan) in scene.objects.iter().zip(&self.plans) {
            parts.extend(plan.iter().flat_map(|plan| of_cache(plan, &object.name, self.options.estimator)));
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
