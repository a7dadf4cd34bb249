//! Light traced from lamps and suns into a body: where it is scattered, for paths from the camera to connect to.

use super::body::{Body, Edge, Watch};
use super::cells::Cells;
use super::draws::Draws;
use super::spectrum::Spectrum;
use crate::geometry::{AreaTable, SurfacePoint};
use crate::integrator::View;
use crate::light::{Arrival, Lights};
use crate::math::{DVec3, Rgb, Vec3, hash_combine};
use crate::optics::{refract, transmittance};
use crate::sampling::{CacheStream, Points, Turn};
use crate::scene::Scene;
use crate::tally::{RayTally, WalkTally};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Light scattered at a point.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// The point [unit].
    pub x: DVec3,
    /// Unit direction in which the light came.
    pub w: Vec3,
    /// Flux that is scattered [radiance unit x sr x unit²]; all photons of a pass together stand for the whole.
    pub flux: Rgb,
}

/// What one body's photons are made from, pass after pass.
pub struct Source {
    /// Points of the body's surface.
    pub table: AreaTable,
    /// Numbers of the points and of the light that reaches them.
    pub streams: [CacheStream; Turn::STREAMS],
    /// Seed of them and of all other numbers.
    pub seed: u64,
    /// Photons traced in a pass.
    pub count: u32,
    /// Connections reach this far [unit].
    pub reach: f32,
    /// How far a connection's share yields to the walk's: see [`super::connect`].
    pub yielding: f32,
    /// Share of the photons that come from suns.
    pub from_suns: f32,
}

/// Photons that tell how many collisions a photon leaves.
const SOUNDING: u64 = 512;
/// A kept collision in its task's list, which has room to grow, and among all others; later twice and with its cube.
const BYTES_PER_PHOTON: f64 = 3.7 * size_of::<Photon>() as f64;
/// Photons traced by one task.
const CHUNK: u64 = 64;
/// Photons of the estimate that sets [`Source::yielding`].
const PILOT: u64 = 1024;
/// Beside lamps, suns have at least this share of the photons, and at most all but this.
const LEAST_SHARE: f32 = 0.05;

impl Source {
    /// `None` where no lamp shines on the object. `count` photons a pass; `reach` [unit].
    pub fn new(scene: &Scene, body: &Body, lights: &Lights, count: u32, reach: f32, seed: u64) -> Option<Self> {
        let table = AreaTable::new(&scene.objects[body.object as usize].mesh)?;
        let seed = hash_combine(hash_combine(seed, 0x7068_6f74_6f6e), u64::from(body.object));
        let streams = Turn::seeds(seed).map(|seed| CacheStream::new(Points::Sobol, seed, 0));
        let mut source = Self { table, streams, seed, count, reach, yielding: 0.0, from_suns: 0.0 };
        // Light that would arrive without anything in its way; by numbers that no photon uses, for shares of connections
        // that depended on the photons would not be fair.
        let pilot = CacheStream::new(Points::Sobol, seed, 1);
        let mut flux_if = |from_suns: f32| {
            source.from_suns = from_suns;
            let arrivals = (0..PILOT).filter_map(|i| source.arrival(scene, body, lights, pilot.numbers(i)));
            arrivals.map(|(_, _, flux)| flux.mean()).sum::<f32>() / PILOT as f32
        };
        let flux = [
            if lights.has_emitters() { flux_if(0.0) } else { 0.0 },
            if lights.has_suns() { flux_if(1.0) } else { 0.0 },
        ];
        source.from_suns = match (lights.has_emitters(), lights.has_suns()) {
            (_, false) => 0.0,
            (false, true) => 1.0,
            (true, true) => {
                (flux[1] / (flux[0] + flux[1]).max(f32::MIN_POSITIVE)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE)
            }
        };
        // Radiance that brings the flux: of two kinds of light the mean of what each alone would have.
        let per = |flux: f32, radiance: f32| if flux > 0.0 { flux / (radiance * count as f32) } else { 0.0 };
        let per_photon = per(flux[0], lights.mean_radiance()) + per(flux[1], lights.radiance_of_suns());
        source.yielding = YIELD * per_photon / (4.0 * PI * body.eta * body.eta);
        (source.yielding.is_normal()).then_some(source)
    }

    /// The pass's photons, in cells. Which thread traces which photon does not matter: each is a function of its number.
    pub fn trace(
        &self,
        view: View<'_>,
        body: &Body,
        lights: &Lights,
        pass: u32,
        tally: &mut (RayTally, WalkTally),
    ) -> Cells {
        let turn = Turn::of(self.seed, pass);
        let first = u64::from(turn.number) * u64::from(self.count);
        let chunks: Vec<(Vec<Photon>, RayTally, WalkTally)> = (0..u64::from(self.count).div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let numbers = chunk * CHUNK..((chunk + 1) * CHUNK).min(u64::from(self.count));
                let (mut photons, mut rays, mut walks) = (Vec::new(), RayTally::default(), WalkTally::default());
                for number in numbers {
                    self.photon(view, body, lights, (turn, first + number), &mut photons, (&mut rays, &mut walks));
                }
                (photons, rays, walks)
            })
            .collect();
        let mut photons = Vec::with_capacity(chunks.iter().map(|(p, ..)| p.len()).sum());
        for (some, rays, walks) in chunks {
            photons.extend(some);
            tally.0 += rays;
            tally.1 += walks;
        }
        tally.1.vertices += photons.len() as u64;
        Cells::new(photons, self.reach)
    }

    /// Memory of a pass's photons at its most, while they are sorted [bytes], by a few of the first pass.
    pub fn bytes(&self, view: View<'_>, body: &Body, lights: &Lights) -> u64 {
        let few = u64::from(self.count).min(SOUNDING);
        if few == 0 {
            return 0;
        }
        // The first of a sequence lie evenly; a part of it, such as each 256th, need not.
        let turn = Turn::of(self.seed, 0);
        let kept: usize = (0..few)
            .into_par_iter()
            .map(|i| {
                let (mut photons, mut rays, mut walks) = (Vec::new(), RayTally::default(), WalkTally::default());
                self.photon(view, body, lights, (turn, i), &mut photons, (&mut rays, &mut walks));
                photons.len()
            })
            .sum();
        (kept as f64 / few as f64 * f64::from(self.count) * BYTES_PER_PHOTON) as u64
    }

    /// A point of the surface, the light that arrives there if nothing is in its way, and what enters of it.
    fn arrival(
        &self,
        scene: &Scene,
        body: &Body,
        lights: &Lights,
        (pick, u): (f64, [f32; 7]),
    ) -> Option<(SurfacePoint, Arrival, Rgb)> {
        let at = self.table.sample(pick, [u[0], u[1]]);
        let mut point = scene.objects[body.object as usize].mesh.point(at.triangle, at.u, at.v);
        point.n = point.n_geometric;
        // The number that picks suns or lamps, spread out again, picks one of them.
        let (arrival, share) = if u[2] < self.from_suns {
            let pick = u[2] / self.from_suns;
            (lights.sample_sun(&point, [pick, u[3], u[4]])?, self.from_suns)
        } else {
            let pick = (u[2] - self.from_suns) / (1.0 - self.from_suns);
            (lights.sample_emitter(scene, &point, [pick, u[3], u[4]])?, 1.0 - self.from_suns)
        };
        let entering = transmittance(body.eta, arrival.w.dot(point.n)) * self.table.area() as f32 / share;
        Some((point, arrival, arrival.irradiance * entering))
    }

    fn photon(
        &self,
        view: View<'_>,
        body: &Body,
        lights: &Lights,
        (turn, number): (Turn, u64),
        photons: &mut Vec<Photon>,
        (rays, walks): (&mut RayTally, &mut WalkTally),
    ) {
        let numbers = self.streams[turn.stream].numbers(number);
        let Some((at, arrival, flux)) = self.arrival(view.scene, body, lights, numbers) else { return };
        let Some(w) = refract(arrival.w, at.n, body.eta) else { return };
        if flux.is_black() {
            return;
        }
        rays.shadow += 1;
        let open = !view.rays.occluded(&arrival.shadow);
        if let Some(light) = arrival.light {
            rays.lights.ask(light, open);
        }
        if !open {
            return;
        }
        let key = hash_combine(turn.seed, number);
        let mut draws = Draws::new(&numbers.1[5..], key);
        let coins = draws.fork(0);
        let mut spectrum = Spectrum::new(flux * (1.0 / self.count as f32), draws.number());
        let mut deposit = Deposit { body, photons, reach: self.reach, coins };
        body.walk(view, (at.leave(w), w), &mut spectrum, &mut draws, &mut deposit, walks);
    }
}

/// Keeps every collision; far from the surface, where few connections come from, only some, with more weight.
struct Deposit<'a> {
    body: &'a Body,
    photons: &'a mut Vec<Photon>,
    reach: f32,
    coins: Draws,
}

impl Watch for Deposit<'_> {
    fn collision(&mut self, x: DVec3, w: Vec3, _: Option<Edge>, spectrum: &mut Spectrum, _: &mut Draws) -> bool {
        let beyond = self.body.clearance.at(x) - self.reach;
        let chance = if beyond > 0.0 { (-beyond * self.body.least_extinction).exp().max(LEAST_CHANCE) } else { 1.0 };
        if chance >= 1.0 || self.coins.number() < chance {
            self.photons.push(Photon { x, w, flux: spectrum.value(&self.body.medium) * (1.0 / chance) });
        }
        true
    }
}

/// The smallest chance of being kept.
const LEAST_CHANCE: f32 = 0.02;
/// Scales [`Source::yielding`]; found by measuring the error at equal time.
const YIELD: f32 = 256.0;
