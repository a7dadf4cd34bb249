//! Light traced from lamps and suns into a body: where it is scattered, for paths from the camera to connect to.

use super::cells::{Cells, Photon};
use super::draws::PathSampler;
use super::emission::{EmissionSampler, Entering};
use super::interior::{Edge, Interior, WalkObserver};
use super::spectrum::Spectrum;
use crate::integrator::View;
use crate::light::{Group, Lights, Reference};
use crate::math::{DVec3, Vec3, hash_combine};
use crate::optics::refract;
use crate::sampling::{CacheStream, Points, Turn};
use crate::scene::Body;
use crate::tally::Tally;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::{Arc, OnceLock};

/// What one body's photons are made from, pass after pass.
pub struct Source {
    /// The body, with points of its surface.
    pub body: Arc<Body>,
    /// Numbers of the points and of the light that reaches them.
    pub streams: [CacheStream; Turn::STREAMS],
    /// Seed of them and of all other numbers.
    pub seed: u64,
    /// Photons traced in a pass.
    pub count: u32,
    /// Connections reach this far [unit].
    pub reach: f32,
    /// What a first look at the lights tells, once; `None` where no light comes to the body.
    plan: OnceLock<Option<Plan>>,
}

/// How photons start, and how far their connections yield to the walk: see [`super::connect`].
#[derive(Clone, Copy, Debug)]
struct Plan {
    emission: EmissionSampler,
    yielding: f32,
}

/// Photons that tell how many collisions a photon leaves.
const SOUNDING: u64 = 512;
/// A kept collision in its task's list, which has room to grow, and among all others; later twice and with its cube.
const BYTES_PER_PHOTON: f64 = 3.7 * size_of::<Photon>() as f64;
/// Photons traced by one task.
const CHUNK: u64 = 64;
/// Photons of the estimate that makes a [`Plan`].
const PILOT: u64 = 1024;
/// Each of the [`EmissionSampler::ways`] has at least this share before they are made to add up to 1: what bounds a photon's power.
const LEAST_WAY: f32 = 0.02;
/// Beside lamps, suns have at least this share of the photons, and at most all but this.
const LEAST_SHARE: f32 = 0.05;

impl Source {
    /// `count` photons a pass; `reach` [unit].
    pub fn new(body: &Arc<Body>, count: u32, reach: f32, seed: u64) -> Self {
        let seed = hash_combine(hash_combine(seed, 0x7068_6f74_6f6e), u64::from(body.object));
        let streams = Turn::seeds(seed).map(|seed| CacheStream::new(Points::Sobol, seed, 0));
        Self { body: body.clone(), streams, seed, count, reach, plan: OnceLock::new() }
    }

    fn plan(&self, view: View<'_>, body: &Interior, lights: &Lights) -> Option<&Plan> {
        self.plan.get_or_init(|| self.look(view, body, lights)).as_ref()
    }

    /// By numbers that no photon uses, for shares of connections that depended on the photons would not be fair. Points are
    /// taken to see each other.
    fn look(&self, view: View<'_>, body: &Interior, lights: &Lights) -> Option<Plan> {
        let pilot = CacheStream::new(Points::Sobol, self.seed, 1);
        let around = Reference::body(&self.body.bounds);
        let flux_by = |emission: EmissionSampler| {
            let (mut flux, mut by) = (0.0, [0.0; 3]);
            for i in 0..PILOT {
                let (pick, u) = pilot.numbers(i);
                let found = emission.sample(view, (body, &self.body.table), lights, (pick, &u), &mut Tally::default());
                let Some(entering) = found else { continue };
                let each = entering.flux.mean() / PILOT as f32;
                flux += each;
                by.iter_mut().zip(entering.by).for_each(|(sum, share)| *sum += each * share);
            }
            (flux, by)
        };
        let (from_lamps, by) = if lights.has_emitters() {
            flux_by(EmissionSampler { around, from_suns: 0.0, ways: [1.0 / 3.0; 3] })
        } else {
            (0.0, [1.0; 3])
        };
        let from_suns = if lights.has_suns() {
            flux_by(EmissionSampler { around, from_suns: 1.0, ways: [1.0 / 3.0; 3] }).0
        } else {
            0.0
        };
        // Each way by the part of the flux that is its own under equal shares.
        let least = by.map(|flux| (flux / from_lamps.max(f32::MIN_POSITIVE)).max(LEAST_WAY));
        let ways = least.map(|share| share / least.iter().sum::<f32>());
        let sunny = match (lights.has_emitters(), lights.has_suns()) {
            (_, false) => 0.0,
            (false, true) => 1.0,
            (true, true) => {
                (from_suns / (from_lamps + from_suns).max(f32::MIN_POSITIVE)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE)
            }
        };
        // Radiance that brings the flux: of two kinds of light the mean of what each alone would have.
        let per = |flux: f32, radiance: f32| if flux > 0.0 { flux / (radiance * self.count as f32) } else { 0.0 };
        let per_photon =
            per(from_lamps, lights.mean_radiance(Group::Near)) + per(from_suns, lights.mean_radiance(Group::Far));
        let yielding = YIELD * per_photon / (4.0 * PI * body.eta * body.eta);
        let emission = EmissionSampler { around, from_suns: sunny, ways };
        (yielding.is_normal()).then_some(Plan { emission, yielding })
    }

    /// The pass's photons, in cells; `None` where no light comes to the body. Which thread traces which photon does not matter: each
    /// is a function of its number.
    pub fn trace(
        &self,
        view: View<'_>,
        body: &Interior,
        lights: &Lights,
        pass: u32,
        tally: &mut Tally,
    ) -> Option<Cells> {
        let plan = self.plan(view, body, lights)?;
        let turn = Turn::of(self.seed, pass);
        let first = u64::from(turn.number) * u64::from(self.count);
        let chunks: Vec<(Vec<Photon>, Tally)> = (0..u64::from(self.count).div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let numbers = chunk * CHUNK..((chunk + 1) * CHUNK).min(u64::from(self.count));
                let (mut photons, mut tally) = (Vec::new(), Tally::default());
                for number in numbers {
                    let which = (plan, turn, first + number);
                    self.photon(view, body, lights, which, &mut photons, &mut tally);
                }
                (photons, tally)
            })
            .collect();
        let mut photons = Vec::with_capacity(chunks.iter().map(|(p, ..)| p.len()).sum());
        for (some, work) in chunks {
            photons.extend(some);
            *tally += work;
        }
        tally.walk.vertices += photons.len() as u64;
        Some(Cells::new(photons, self.reach, plan.yielding))
    }

    /// Memory of a pass's photons at its most, while they are sorted [bytes], by a few of the first pass.
    pub fn bytes(&self, view: View<'_>, body: &Interior, lights: &Lights) -> u64 {
        let few = u64::from(self.count).min(SOUNDING);
        let Some(plan) = self.plan(view, body, lights) else { return 0 };
        if few == 0 {
            return 0;
        }
        // The first of a sequence lie evenly; a part of it, such as each 256th, need not.
        let turn = Turn::of(self.seed, 0);
        let kept: usize = (0..few)
            .into_par_iter()
            .map(|i| {
                let (mut photons, mut tally) = (Vec::new(), Tally::default());
                self.photon(view, body, lights, (plan, turn, i), &mut photons, &mut tally);
                photons.len()
            })
            .sum();
        (kept as f64 / few as f64 * f64::from(self.count) * BYTES_PER_PHOTON) as u64
    }

    fn photon(
        &self,
        view: View<'_>,
        body: &Interior,
        lights: &Lights,
        (plan, turn, number): (&Plan, Turn, u64),
        photons: &mut Vec<Photon>,
        tally: &mut Tally,
    ) {
        let numbers = self.streams[turn.stream].numbers(number);
        let found = plan.emission.sample(view, (body, &self.body.table), lights, (numbers.0, &numbers.1), tally);
        let Some(Entering { at, w, flux, light, shadow, .. }) = found else { return };
        let Some(w) = refract(w, at.n, body.eta) else { return };
        if flux.is_black() {
            return;
        }
        let open = shadow.is_none_or(|shadow| {
            tally.rays.shadow += 1;
            !view.rays.occluded(&shadow)
        });
        if let Some(light) = light {
            tally.rays.lights.ask(light, open);
        }
        if !open {
            return;
        }
        let key = hash_combine(turn.seed, number);
        let mut draws = PathSampler::new(&numbers.1[5..], key);
        let coins = draws.fork(0);
        let mut spectrum = Spectrum::new(flux * (1.0 / self.count as f32), draws.number());
        let mut deposit = Deposit { body, photons, reach: self.reach, coins };
        body.walk(view, (at.leave(w), w), &mut spectrum, &mut draws, &mut deposit, &mut tally.walk);
    }
}

/// Keeps every collision; far from the surface, where few connections come from, only some, with more weight.
struct Deposit<'a> {
    body: &'a Interior,
    photons: &'a mut Vec<Photon>,
    reach: f32,
    coins: PathSampler,
}

impl WalkObserver for Deposit<'_> {
    fn collision(&mut self, x: DVec3, w: Vec3, _: Option<Edge>, spectrum: &mut Spectrum, _: &mut PathSampler) -> bool {
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
/// Scales [`Plan::yielding`]; found by measuring the error at equal time.
const YIELD: f32 = 256.0;
