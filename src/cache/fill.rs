//! Filling the cache: random triangle by area, random point in it, a direction, what light arrives, what enters.

use super::{Cache, CachedSample, Density};
use crate::bssrdf::{Bssrdf, Entry};
use crate::geometry::{AreaSample, AreaTable, Mesh, SurfacePoint, Union};
use crate::light::{Arrival, Lights, Met};
use crate::math::{Rgb, Vec3};
use crate::query::Ray;
use crate::sampling::CacheStream;
use crate::scene::{Body, Scene, View};
use crate::surface::Interface;
use crate::tally::Tally;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::Arc;

/// A body as light enters it, by its model.
pub struct CachedBody {
    /// The body itself.
    pub body: Arc<Body>,
    /// What bounds it, where its parts meet.
    pub union: Option<Arc<Union>>,
    /// Its BSSRDF, which says at what depth a sample stands.
    pub model: Box<dyn Bssrdf>,
    /// Its boundary.
    pub boundary: Interface,
}

impl CachedBody {
    /// Of object number `object` by `model`; `None` where that bounds no body.
    pub fn new(scene: &Scene, object: u32, model: Box<dyn Bssrdf>) -> Option<Self> {
        let body = scene.body(object)?.clone();
        let surface = scene.surface(object);
        let inside = surface.inside.as_ref();
        let (rough, tint) = (inside.and_then(|t| t.rough.clone()), inside.and_then(|t| t.tint.clone()));
        let boundary = Interface { eta: surface.medium()?.eta, rough, tint };
        Some(Self { boundary, body, union: scene.union(object).cloned(), model })
    }

    /// Index of its surface.
    pub fn object(&self) -> u32 {
        self.body.object
    }

    /// Its area table; cached points are relative to its centre.
    pub fn table(&self) -> &AreaTable {
        &self.body.table
    }

    /// A point of the surface, flat as the triangle it lies on; `None` where it lies inside the body, or in a face that counts instead. The
    /// density stays that of all of the area.
    pub fn place(&self, mesh: &Mesh, at: AreaSample) -> Option<SurfacePoint> {
        let point = mesh.point(at.triangle, at.u, at.v);
        let bears = self.union.as_ref().is_none_or(|union| union.bears(at.triangle, point.x));
        // Flux through an area is flux through the triangle itself; interpolated normals would not conserve it.
        bears.then_some(SurfacePoint { n: point.n_geometric, ..point })
    }

    /// Light as it enters at `at`, flat as the triangle it lies on, seen from there in the unit direction `w`: `irradiance` times
    /// `weight` [unit²] before the boundary, `u` in [0, 1) for the depth. `None` where it is totally reflected.
    pub fn enters(&self, at: &SurfacePoint, w: Vec3, (irradiance, weight): (Rgb, f32), u: f32) -> Option<CachedSample> {
        self.enters_untinted(at, w, (irradiance * self.boundary.tint(at), weight), u)
    }

    /// The same without the pigment of the boundary.
    pub fn enters_untinted(
        &self,
        at: &SurfacePoint,
        w: Vec3,
        (irradiance, weight): (Rgb, f32),
        u: f32,
    ) -> Option<CachedSample> {
        let inside = self.boundary.told(at.n, w)?;
        let flux = irradiance * (self.boundary.passed(w.dot(at.n)) * weight);
        (!flux.is_black()).then(|| CachedSample {
            entry: Entry { x: (at.x - self.table().centre()).as_vec3(), n: at.n, w: inside },
            depth: self.model.sample_depth(u),
            flux,
        })
    }
}

/// How directions of entering light are picked.
#[derive(Clone, Copy, Debug)]
pub enum Directions {
    /// Towards the lights, but for this share by the cosine; see [`Lights::cosine_share`].
    Lights {
        /// In [0, 1].
        cosine_share: f32,
    },
    /// By the cosine, the lecture's way.
    Cosine,
}

/// What fills the cache of one object, pass after pass.
pub struct CacheBuilder<'a> {
    /// The scene and its rays.
    pub view: View<'a>,
    /// Its lights.
    pub lights: &'a Lights,
    /// The object.
    pub body: &'a CachedBody,
    /// How directions are picked.
    pub directions: Directions,
    /// The object's long stream of points.
    pub stream: &'a CacheStream,
    /// How the points are spread over the surface.
    pub density: &'a Density,
}

/// The way to a light.
pub struct Shadow {
    /// Light arrives if nothing is hit on this ray.
    pub ray: Ray,
    /// The number of the light, where it is one that is counted.
    pub light: Option<usize>,
}

/// Samples filled by one task; their shadow rays form one batch.
const CHUNK: u64 = 256;

impl CacheBuilder<'_> {
    /// The samples with numbers `first`..`first + count`, in parallel. Which thread fills which sample does not
    /// matter: a sample is a function of its number.
    pub fn fill(&self, first: u64, count: u32, tally: &mut Tally) -> Cache {
        let chunks: Vec<(Vec<CachedSample>, Tally)> = (0..u64::from(count).div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let start = chunk * CHUNK;
                let end = (start + CHUNK).min(u64::from(count));
                let mut tally = Tally::default();
                let lit = match self.directions {
                    Directions::Lights { .. } => self.by_light(first + start..first + end, &mut tally),
                    Directions::Cosine => self.by_cosine(first + start..first + end, &mut tally),
                };
                (lit, tally)
            })
            .collect();
        let mut lit = Vec::with_capacity(chunks.iter().map(|(samples, _)| samples.len()).sum());
        for (samples, work) in chunks {
            lit.extend(samples);
            *tally += work;
        }
        Cache { lit, attempted: count }
    }

    /// The first `count` samples of the stream that meet light, each with its place along the area table.
    pub fn pilots(&self, count: u32) -> Vec<(f64, CachedSample)> {
        let lit = |number: u64| {
            let (at, weight, u) = self.point(number)?;
            let place = self.density.place(self.stream.numbers(number).0).0;
            let (sample, shadow) = self.entering(at, weight, u, &mut Tally::default())?;
            let hidden = shadow.is_some_and(|shadow| self.view.rays.occluded(&shadow.ray));
            (sample.is_finite() && !hidden).then_some((place, sample))
        };
        (0..u64::from(count)).into_par_iter().filter_map(lit).collect()
    }

    /// Candidates first, then all their shadow rays at once.
    fn by_light(&self, numbers: std::ops::Range<u64>, tally: &mut Tally) -> Vec<CachedSample> {
        let mut candidates = Vec::with_capacity(CHUNK as usize);
        for number in numbers {
            let Some((at, weight, u)) = self.point(number) else { continue };
            candidates.extend(self.entering(at, weight, u, tally));
        }
        let shadows: Vec<Ray> = candidates.iter().filter_map(|(_, shadow)| Some(shadow.as_ref()?.ray)).collect();
        let mut occluded = vec![false; shadows.len()];
        self.view.rays.occluded_batch(&shadows, &mut occluded);
        tally.rays.shadow += shadows.len() as u64;
        let mut occluded = occluded.into_iter();
        candidates.retain(|(_, shadow)| {
            let Some(shadow) = shadow else { return true };
            let open = occluded.next() == Some(false);
            if let Some(light) = shadow.light {
                tally.rays.lights.ask(light, open);
            }
            open
        });
        candidates.into_iter().map(|(sample, _)| sample).collect()
    }

    /// Light that enters at `at`, a point with one over its density `weight` [unit²], if nothing stands on the ray beside it.
    pub fn entering(
        &self,
        at: SurfacePoint,
        weight: f32,
        u: [f32; 5],
        tally: &mut Tally,
    ) -> Option<(CachedSample, Option<Shadow>)> {
        // Flux through an area is flux through the triangle itself; interpolated normals would not conserve it.
        let at = SurfacePoint { n: at.n_geometric, ..at };
        let (arrival, open) = self.arrival(&at, [u[0], u[1], u[2], u[3]], tally)?;
        let sample = self.body.enters(&at, arrival.w, (arrival.irradiance, weight), u[4])?;
        let shadow = Shadow { ray: arrival.shadow, light: arrival.light };
        if let (true, Some(light)) = (open, arrival.light) {
            tally.rays.lights.meet(light);
        }
        Some((sample, (!open).then_some(shadow)))
    }

    fn cosine_share(&self) -> f32 {
        match self.directions {
            Directions::Lights { cosine_share } => cosine_share,
            Directions::Cosine => 1.0,
        }
    }

    /// One arrival, and whether the way to the light is known to be open.
    fn arrival(&self, at: &SurfacePoint, u: [f32; 4], tally: &mut Tally) -> Option<(Arrival, bool)> {
        let (arrival, open) = self.lights.arrival_of_all(self.view, at, self.cosine_share(), u)?;
        tally.rays.bounce += u64::from(open);
        Some((arrival, open))
    }

    /// Cosine-sampled directions, followed to whatever shines there.
    fn by_cosine(&self, numbers: std::ops::Range<u64>, tally: &mut Tally) -> Vec<CachedSample> {
        let mut lit = Vec::new();
        for number in numbers {
            let Some((at, weight, u)) = self.point(number) else { continue };
            let Some((w, ray)) = Lights::look_up(&at, [u[1], u[2]]) else { continue };
            tally.rays.bounce += 1;
            let Met { radiance, light } = self.lights.met(self.view.scene, self.view.rays.closest(&ray).as_ref(), w);
            if !radiance.is_black() {
                if let Some(light) = light {
                    tally.rays.lights.meet(light);
                }
                lit.extend(self.body.enters(&at, w, (radiance * PI, weight), u[4]));
            }
        }
        lit
    }

    /// Light that comes straight from the lights to point number `number`: the point, the unit direction to the light, and flux
    /// before the boundary over the density of all that was picked [radiance unit x sr x unit²].
    pub fn arriving(&self, number: u64, tally: &mut Tally) -> Option<(SurfacePoint, Vec3, Rgb)> {
        let (at, weight, u) = self.point(number)?;
        let (arrival, open) = self.arrival(&at, [u[0], u[1], u[2], u[3]], tally)?;
        if !open {
            tally.rays.shadow += 1;
            if self.view.rays.occluded(&arrival.shadow) {
                return None;
            }
        }
        Some((at, arrival.w, arrival.irradiance * weight))
    }

    /// Point number `number` of the surface, flat as the triangle it lies on, area over its density, four numbers for the
    /// light and one for the depth; `None` as [`CachedBody::place`].
    pub fn point(&self, number: u64) -> Option<(SurfacePoint, f32, [f32; 5])> {
        let (pick, u) = self.stream.numbers(number);
        let (pick, weight) = self.density.place(pick);
        let at = self.body.table().sample(pick, [u[0], u[1]]);
        let point = self.body.place(&self.view.scene.objects[self.body.object() as usize].mesh, at)?;
        Some((point, weight * self.body.table().area() as f32, [u[2], u[3], u[4], u[5], u[6]]))
    }
}
