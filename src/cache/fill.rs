//! Filling the cache: random triangle by area, random point in it, a direction, what light arrives, what enters.

use super::{Cache, CachedSample, Density};
use crate::bssrdf::{Entry, Model};
use crate::geometry::{AreaTable, SurfacePoint};
use crate::light::{Arrival, Lights, emitted};
use crate::math::Rgb;
use crate::optics::{refract, transmittance};
use crate::query::{Ray, RayQuery, RayTally};
use crate::sampling::CacheStream;
use crate::scene::{EntrySampling, Scene};
use rayon::prelude::*;
use std::f32::consts::PI;

/// What the filling of one object's cache needs, pass after pass.
pub struct Filler<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its ray backend.
    pub rays: &'a dyn RayQuery,
    /// Its lights.
    pub lights: &'a Lights,
    /// The translucent object.
    pub object: u32,
    /// Its area table.
    pub table: &'a AreaTable,
    /// Its BSSRDF, which says at what depth a sample stands.
    pub model: &'a Model,
    /// Its relative index of refraction.
    pub eta: f32,
    /// How directions are picked.
    pub sampling: EntrySampling,
    /// The object's long stream of points.
    pub stream: &'a CacheStream,
    /// How the points are spread over the surface.
    pub density: &'a Density,
}

/// Samples filled by one task; their shadow rays form one batch.
const CHUNK: u64 = 256;

impl Filler<'_> {
    /// The samples with numbers `first`..`first + count`, in parallel. Which thread fills which sample does not
    /// matter: a sample is a function of its number.
    pub fn fill(&self, first: u64, count: u32, rays: &mut RayTally) -> Cache {
        let chunks: Vec<(Vec<CachedSample>, RayTally)> = (0..u64::from(count).div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let start = chunk * CHUNK;
                let end = (start + CHUNK).min(u64::from(count));
                let mut tally = RayTally::default();
                let lit = match self.sampling {
                    EntrySampling::Light => self.by_light(first + start..first + end, &mut tally),
                    EntrySampling::Cosine => self.by_cosine(first + start..first + end, &mut tally),
                };
                (lit, tally)
            })
            .collect();
        let mut lit = Vec::with_capacity(chunks.iter().map(|(samples, _)| samples.len()).sum());
        for (samples, tally) in chunks {
            lit.extend(samples);
            *rays += tally;
        }
        Cache { lit, attempted: count }
    }

    /// The first `count` samples of the stream that meet light, each with its place along the area table.
    pub fn pilots(&self, count: u32) -> Vec<(f64, CachedSample)> {
        let lit = |number: u64| {
            let (sample, shadow) = self.candidate(number)?;
            let place = self.density.place(self.stream.numbers(number).0).0;
            (sample.is_finite() && !self.rays.occluded(&shadow)).then_some((place, sample))
        };
        (0..u64::from(count)).into_par_iter().filter_map(lit).collect()
    }

    /// Candidates first, then all their shadow rays at once.
    fn by_light(&self, numbers: std::ops::Range<u64>, tally: &mut RayTally) -> Vec<CachedSample> {
        let mut candidates = Vec::with_capacity(CHUNK as usize);
        candidates.extend(numbers.filter_map(|number| self.candidate(number)));
        let shadows: Vec<Ray> = candidates.iter().map(|(_, ray)| *ray).collect();
        let mut occluded = vec![false; shadows.len()];
        self.rays.occluded_batch(&shadows, &mut occluded);
        tally.shadow += shadows.len() as u64;
        candidates.into_iter().zip(occluded).filter(|(_, hidden)| !hidden).map(|((sample, _), _)| sample).collect()
    }

    /// Sample number `number`, if nothing stands on the ray beside it.
    fn candidate(&self, number: u64) -> Option<(CachedSample, Ray)> {
        let (at, weight, u) = self.point(number);
        let arrival = self.arrival(&at, [u[0], u[1], u[2], u[3]])?;
        Some((self.transmitted(&at, weight, &arrival, u[4])?, arrival.shadow))
    }

    /// One arrival from whichever kinds of light there are; each kind stands for its share of the samples.
    fn arrival(&self, at: &SurfacePoint, u: [f32; 4]) -> Option<Arrival> {
        match (self.lights.has_emitters(), self.lights.has_environment()) {
            (false, false) => None,
            (true, false) => self.lights.sample_emitter(self.scene, at, [u[0], u[1], u[2]]),
            (false, true) => self.lights.sample_environment(at, [u[1], u[2]]),
            (true, true) => {
                let mut arrival = if u[3] < 0.5 {
                    self.lights.sample_emitter(self.scene, at, [u[0], u[1], u[2]])
                } else {
                    self.lights.sample_environment(at, [u[1], u[2]])
                }?;
                arrival.irradiance *= 2.0;
                Some(arrival)
            }
        }
    }

    /// Cosine-sampled directions, followed to whatever shines there.
    fn by_cosine(&self, numbers: std::ops::Range<u64>, tally: &mut RayTally) -> Vec<CachedSample> {
        let mut lit = Vec::new();
        for number in numbers {
            let (at, weight, u) = self.point(number);
            let Some((w, ray)) = Lights::look_up(&at, [u[1], u[2]]) else { continue };
            tally.bounce += 1;
            let radiance = match self.rays.closest(&ray) {
                Some(hit) => emitted(self.scene, &hit, w),
                None => self.lights.environment(),
            };
            if !radiance.is_black() {
                lit.extend(self.transmitted(&at, weight, &Arrival { w, irradiance: radiance * PI, shadow: ray }, u[4]));
            }
        }
        lit
    }

    /// Point number `number` of the surface, flat as the triangle it lies on, area over its density, four numbers for the
    /// light and one for the depth.
    fn point(&self, number: u64) -> (SurfacePoint, f32, [f32; 5]) {
        let (pick, u) = self.stream.numbers(number);
        let (pick, weight) = self.density.place(pick);
        let at = self.table.sample(pick, [u[0], u[1]]);
        let mut point = self.scene.objects[self.object as usize].mesh.point(at.triangle, at.u, at.v);
        // Flux through an area is flux through the triangle itself; interpolated normals would not conserve it.
        point.n = point.n_geometric;
        (point, weight * self.table.area() as f32, [u[2], u[3], u[4], u[5], u[6]])
    }

    /// Refracts an arrival into the medium; `weight` is one over the density of the point [unit²]. `None` where it is totally reflected.
    fn transmitted(&self, at: &SurfacePoint, weight: f32, arrival: &Arrival, u: f32) -> Option<CachedSample> {
        let w = refract(arrival.w, at.n, self.eta)?;
        let t12 = transmittance(self.eta, arrival.w.dot(at.n));
        let flux: Rgb = arrival.irradiance * (t12 * weight);
        (!flux.is_black()).then(|| CachedSample {
            entry: Entry { x: at.x, n: at.n, w },
            depth: self.model.sample_depth(u),
            flux,
        })
    }
}
