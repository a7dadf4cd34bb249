//! Light that comes to bodies over other surfaces, as samples of their caches.
//!
//! A path from a light to the place where it enters a body is made in one of two ways, by what it met last. If that was no body, the path
//! is followed from the place of entry backwards, over opaque surfaces, and asks them for their light. If it was one, whose boundary
//! mirrored it, or out of which it came, it is followed forwards: from places on bodies where the light of all samples so far is gathered
//! as for a pixel, and from places where light arrives. What it brings to a body is a sample as any other, gathered by the next round.

use super::volume_path::{Modelled, PathSampler, VolumePath, VolumePathOptions};
use super::{MOST_SURFACES, Part, View};
use crate::bssrdf::Exit;
use crate::cache::{Cache, CachedSample, Detail, GatherPoint, Plan, Scratch, SubsurfaceOptions};
use crate::geometry::SurfacePoint;
use crate::light::Lights;
use crate::math::{Rgb, Vec3, hash_combine, unit_f32};
use crate::optics::{reflect, reflectance, refract, transmittance};
use crate::query::Ray;
use crate::sampling::{CacheStream, PixelStream, Points, Turn, cosine_hemisphere};
use crate::scene::Scene;
use crate::tally::{Cause, Tally};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::Arc;

/// Paths of each kind in a pass for so many of its samples.
const SAMPLES_PER_PATH: u32 = 8;
/// Rounds in which light leaves bodies and meets them again. What is left then would go on without end.
const MOST_ROUNDS: u32 = 1000;
/// Paths of one task; exits of one task are neighbours, and gathered together.
const CHUNK: usize = 1024;
/// A round of fewer exits is made by chance, with more weight.
const FEWEST: f64 = 64.0;
/// What the numbers are for.
const PURPOSE: u64 = 0x696e_6469_7265_6374;

/// Samples of each object's cache: place, and all of the flux they stand for.
type Rows = Vec<Vec<CachedSample>>;

/// What a method's list of parts calls [`Indirect`].
pub const OVER: &str = "light over other surfaces";

/// Light over other surfaces.
pub struct Indirect {
    /// Paths from the camera.
    pub paths: VolumePath,
    /// Paths backwards from places of entry; `None` where no opaque surface reflects, and no clear body stands.
    surfaces: Option<VolumePath>,
    bounces: u32,
    /// Paths of each kind in a pass, for each body at most.
    count: u32,
    /// Whether paths are scattered once in some body.
    once: bool,
    seed: u64,
    /// For each object, of even passes and of odd ones.
    streams: Vec<[CacheStream; Turn::STREAMS]>,
}

/// What all tasks of a pass share.
struct Round<'a> {
    of: &'a Indirect,
    view: View<'a>,
    lights: &'a Lights,
    plans: &'a [Option<Arc<Plan>>],
    turn: Turn,
}

/// What one task found.
#[derive(Default)]
struct Found {
    rows: Vec<(u32, CachedSample)>,
    tally: Tally,
}

impl Indirect {
    /// For the bodies of `plans`; `modelled` says how paths meet them.
    pub fn new(
        scene: &Scene,
        plans: &[Option<Arc<Plan>>],
        modelled: Vec<Option<Modelled>>,
        options: &SubsurfaceOptions,
    ) -> Self {
        let SubsurfaceOptions { specular, seed, .. } = *options;
        let bounces = options.bounces.min(MOST_SURFACES);
        let reflects = |o: &crate::scene::Object| {
            let surface = &scene.materials[o.material].surface;
            surface.clear.is_some() || surface.is_opaque() && !surface.bsdf.albedo().is_black()
        };
        let surfaces = scene.objects.iter().any(reflects) && plans.iter().any(Option::is_some);
        let own = hash_combine(seed, PURPOSE);
        let streams = |object| Turn::seeds(own).map(|seed| CacheStream::new(Points::Sobol, seed, object));
        Self {
            once: modelled.iter().flatten().any(|m| m.once),
            paths: VolumePath::over_models(
                scene,
                modelled,
                bounces,
                VolumePathOptions { specular, seed, ..Default::default() },
            ),
            surfaces: surfaces
                .then(|| VolumePath::over_surfaces(scene, vec![None; scene.objects.len()], bounces - 1, seed)),
            bounces,
            count: (options.cache_samples / SAMPLES_PER_PATH).max(1),
            seed: own,
            streams: (0..scene.objects.len() as u64).map(streams).collect(),
        }
    }

    /// What is said of it.
    pub fn part(&self) -> Part {
        let count = self.count;
        let over = if self.surfaces.is_some() { "; as many backwards over opaque surfaces" } else { "" };
        Part::built(OVER, format!("a pass, {count} paths of light from each body and {count} that it mirrors{over}"))
    }

    /// Whether paths are scattered once in bodies whose models lack that.
    pub fn walks_once(&self) -> bool {
        self.once
    }

    /// Memory beside that of `samples` cached samples of `bodies` bodies [bytes], where half of the paths arrive.
    pub fn bytes(&self, bodies: u64, samples: u64) -> u64 {
        let paths = bodies * u64::from(self.count) * if self.surfaces.is_some() { 3 } else { 2 };
        (samples + paths / 2) * size_of::<CachedSample>() as u64
    }

    /// Adds to the caches of pass number `pass`, which have the light that comes straight from the lights, all other light.
    pub fn add(
        &self,
        view: View<'_>,
        lights: &Lights,
        plans: &[Option<Arc<Plan>>],
        caches: &mut [Option<Cache>],
        pass: u32,
        tally: &mut Tally,
    ) {
        let start = std::time::Instant::now();
        let trees = tally.clock.tree;
        let round = Round { of: self, view, lights, plans, turn: Turn::of(self.seed, pass) };
        let mut rows: Rows = vec![Vec::new(); plans.len()];
        for plan in plans.iter().flatten() {
            round.backwards(plan, &mut rows, tally);
            round.mirrored(plan, &mut rows, tally);
        }
        keep(caches, &rows, tally);
        // The first round has all light so far, each later one what the one before brought.
        let mut sources: Vec<Option<Cache>> = caches.to_vec();
        let whole: f64 = sources.iter().flatten().map(flux).sum();
        for level in 1..=self.bounces {
            if level > MOST_ROUNDS {
                for plan in plans.iter().flatten().filter(|p| sources[p.body.object() as usize].is_some()) {
                    tally.walk.walks += 1;
                    tally.walk.losses.add(plan.body.object(), Cause::Endless);
                }
                break;
            }
            let mut rows: Rows = vec![Vec::new(); plans.len()];
            for (plan, source) in plans.iter().zip(&mut sources) {
                if let (Some(plan), Some(source)) = (plan, source.take()) {
                    round.forwards(plan, source, (whole, level, pass), &mut rows, tally);
                }
            }
            if rows.iter().all(Vec::is_empty) {
                break;
            }
            keep(caches, &rows, tally);
            let source = |(mut rows, cache): (Vec<CachedSample>, &Option<Cache>)| {
                rows.retain(CachedSample::is_finite);
                cache.as_ref().filter(|_| !rows.is_empty()).map(|_| Cache { lit: rows, attempted: 1 })
            };
            sources = rows.into_iter().zip(caches.iter()).map(source).collect();
        }
        tally.clock.fill += start.elapsed().as_secs_f64() - (tally.clock.tree - trees);
    }
}

/// All that has entered.
fn flux(cache: &Cache) -> f64 {
    let sum: f64 = cache.lit.iter().map(|s| s.flux.mean_f64()).sum();
    sum / f64::from(cache.attempted.max(1))
}

/// Samples that stand for all of their flux, beside those that stand for it all together.
fn keep(caches: &mut [Option<Cache>], rows: &Rows, tally: &mut Tally) {
    for (cache, rows) in caches.iter_mut().zip(rows) {
        let Some(cache) = cache else { continue };
        let times = cache.attempted as f32;
        let whole = rows.iter().map(|row| CachedSample { flux: row.flux * times, ..*row });
        let before = cache.lit.len();
        cache.lit.extend(whole.filter(CachedSample::is_finite));
        tally.gather.indirect += rows.len() as u64;
        tally.gather.non_finite += (before + rows.len() - cache.lit.len()) as u64;
    }
}

impl Round<'_> {
    /// What `task` makes of each of `count` numbers, in their order.
    fn tasks(&self, count: u32, rows: &mut Rows, tally: &mut Tally, task: impl Fn(u64, &mut Found) + Sync) {
        let numbers = 0..u64::from(count);
        let chunks: Vec<Found> = (0..numbers.end.div_ceil(CHUNK as u64))
            .into_par_iter()
            .map(|chunk| {
                let mut found = Found::default();
                let first = chunk * CHUNK as u64;
                (first..(first + CHUNK as u64).min(numbers.end)).for_each(|i| task(i, &mut found));
                found
            })
            .collect();
        collect(chunks, rows, tally);
    }

    /// Light that comes over opaque surfaces to the body of `plan`, met last of all bodies.
    fn backwards(&self, plan: &Plan, rows: &mut Rows, tally: &mut Tally) {
        let Some(paths) = &self.of.surfaces else { return };
        let stream = &self.of.streams[plan.body.object() as usize][self.turn.stream];
        let builder = plan.builder(self.view, self.lights, stream, plan.density());
        let first = u64::from(self.turn.number) * u64::from(self.of.count);
        let key = self.key(plan, 1);
        self.tasks(self.of.count, rows, tally, |i, found| {
            let Some((at, weight, u)) = builder.point(first + i) else { return };
            let Some((w, ray)) = Lights::look_up(&at, [u[1], u[2]]) else { return };
            found.tally.rays.bounce += 1;
            let Some(hit) = self.view.rays.closest(&ray) else { return };
            let surface = self.view.scene.surface(hit.mesh);
            if !surface.is_opaque() && surface.clear.is_none() {
                return;
            }
            let mut draws = PathSampler::new(&[u[4], u[0], u[3]], hash_combine(key, i));
            let depth = draws.number();
            let light = paths.arriving(self.view, &hit, w, draws.fork_with(&[u[4], u[0], u[3]], 0), &mut found.tally);
            if light.is_black() {
                return;
            }
            let flux = light * (PI * weight / self.of.count as f32);
            let arrived = Arrived { plan, at, w, flux };
            self.enter(&arrived, depth, draws, found);
        });
    }

    /// Light straight from lights, where the boundary of the body mirrors it, or lets it through unscattered or nearly so.
    fn mirrored(&self, plan: &Plan, rows: &mut Rows, tally: &mut Tally) {
        let stream = &self.of.streams[plan.body.object() as usize][self.turn.stream];
        let builder = plan.builder(self.view, self.lights, stream, plan.density());
        let first = u64::from(self.turn.number) * u64::from(self.of.count);
        let key = self.key(plan, 2);
        self.tasks(self.of.count, rows, tally, |i, found| {
            let Some((at, w, flux)) = builder.arriving(first + i, &mut found.tally) else { return };
            if flux.is_black() {
                return;
            }
            let flux = flux * (1.0 / self.of.count as f32);
            let mut draws = PathSampler::new(&[], hash_combine(key, i));
            let mirrored = reflectance(plan.body.eta, w.dot(at.n));
            let away = reflect(w, at.n);
            self.follow(Ray::new(at.leave(away), away), flux * mirrored, draws.fork(0), found);
            let passed = transmittance(plan.body.eta, w.dot(at.n));
            let arrived = Arrived { plan, at, w, flux: flux * passed };
            if let Some((ray, flux)) = self.walk(&arrived, &mut draws, found) {
                self.follow(ray, flux, draws, found);
            }
        });
    }

    /// Light of `source` that comes out of the body of `plan`.
    fn forwards(
        &self,
        plan: &Plan,
        source: Cache,
        (whole, level, pass): (f64, u32, u32),
        rows: &mut Rows,
        tally: &mut Tally,
    ) {
        let object = plan.body.object() as usize;
        let key = hash_combine(self.key(plan, 3), level.into());
        let wanted = f64::from(self.of.count) * (flux(&source) / whole).min(1.0);
        if wanted.is_nan() || wanted <= 0.0 {
            return;
        }
        let (count, chance) = if wanted >= FEWEST { (wanted, 1.0) } else { (FEWEST, wanted / FEWEST) };
        if f64::from(unit_f32(hash_combine(key, 0) as u32)) >= chance {
            return;
        }
        let count = count as u32;
        let gatherer = plan.ready(source, pass, tally);
        let stream = CacheStream::new(Points::Sobol, hash_combine(self.turn.seed, level.into()), !(object as u64));
        let first = u64::from(self.turn.number) * u64::from(self.of.count);
        // Neighbours along the area table are neighbours on the surface.
        let mut picks: Vec<(f64, [f32; 7])> = (0..u64::from(count)).map(|i| stream.numbers(first + i)).collect();
        picks.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mesh = &self.view.scene.objects[object].mesh;
        let each = PI * plan.body.table().area() as f32 / (f64::from(count) * chance) as f32;
        let chunks: Vec<Found> = picks
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, picks)| {
                let mut found = Found::default();
                let place = |(i, &(pick, u)): (usize, &(f64, [f32; 7]))| {
                    let at = plan.body.place(mesh, plan.body.table().sample(pick, [u[0], u[1]]))?;
                    let w = cosine_hemisphere(at.n, [u[2], u[3]]);
                    let exit = Exit { x: (at.x - plan.body.table().centre()).as_vec3(), n: at.n, w };
                    let stream = PixelStream::new(key, (chunk * CHUNK + i) as u64, 0);
                    Some((at, GatherPoint { exit, place: at.x, stream }))
                };
                let (places, points): (Vec<SurfacePoint>, Vec<GatherPoint>) =
                    picks.iter().enumerate().filter_map(place).unzip();
                let (mut scratch, mut sums) = (Scratch::default(), Vec::new());
                if level == 1 {
                    let around = (self.view, self.lights);
                    plan.gather(
                        around,
                        (&gatherer, Detail::Coarse),
                        &points,
                        &mut scratch,
                        &mut found.tally,
                        &mut sums,
                    );
                } else {
                    plan.sum((&gatherer, Detail::Coarse), &points, &mut scratch, &mut found.tally, &mut sums);
                }
                for ((at, point), sum) in places.iter().zip(&points).zip(&sums) {
                    let w = point.exit.w;
                    let flux = *sum * (each * transmittance(plan.body.eta, w.dot(at.n)));
                    self.follow(Ray::new(at.leave(w), w), flux, PathSampler::new(&[], point.stream.key()), &mut found);
                }
                found
            })
            .collect();
        collect(chunks, rows, tally);
    }

    /// Follows light along `ray` until nothing is left of it.
    fn follow(&self, mut ray: Ray, mut flux: Rgb, mut draws: PathSampler, found: &mut Found) {
        for _ in 0..self.of.bounces {
            if !flux.is_finite() {
                found.tally.gather.non_finite += 1;
                return;
            }
            if flux.is_black() {
                return;
            }
            found.tally.rays.bounce += 1;
            let Some(hit) = self.view.rays.closest(&ray) else { return };
            let at = self.view.point(&hit, ray.direction);
            let surface = self.view.scene.surface(hit.mesh);
            if surface.emission.is_some() {
                return;
            }
            let w = -ray.direction;
            if let Some(plan) = &self.plans[hit.mesh as usize] {
                let outside = self.view.outwards(&hit).n_geometric.dot(w) > 0.0;
                if !outside {
                    return;
                }
                let at = SurfacePoint { n: at.n_geometric, ..at };
                let depth = draws.number();
                let Some(next) = self.goes_on(&Arrived { plan, at, w, flux }, depth, &mut draws, found) else { return };
                (ray, flux) = next;
                continue;
            }
            if surface.clear.is_some() {
                let (way, tally) = ((&hit, ray.direction), &mut found.tally);
                let Some(next) = self.of.paths.past_clear(self.view, way, flux, &mut draws, tally) else { return };
                (ray, flux) = next;
                continue;
            }
            let Some(next) = surface.bsdf.sample(&at, w, [draws.number(), draws.number(), draws.number()]) else {
                return;
            };
            let after = flux * next.weight;
            // Roulette: what has lost some of its flux goes on by the chance of what is left.
            let chance = (after.max() / flux.max()).min(1.0);
            if draws.number() >= chance || at.n_geometric.dot(next.wi) <= 0.0 {
                return;
            }
            flux = after * (1.0 / chance);
            ray = Ray::new(at.leave(next.wi), next.wi);
        }
    }

    /// A sample of what enters, and what is left of the light followed.
    fn enter(&self, arrived: &Arrived<'_>, depth: f32, mut draws: PathSampler, found: &mut Found) {
        if let Some((ray, flux)) = self.goes_on(arrived, depth, &mut draws, found) {
            self.follow(ray, flux, draws, found);
        }
    }

    /// A sample of what enters; the light goes on mirrored, by the chance of it, or by what the model lacks.
    fn goes_on(
        &self,
        arrived: &Arrived<'_>,
        depth: f32,
        draws: &mut PathSampler,
        found: &mut Found,
    ) -> Option<(Ray, Rgb)> {
        let &Arrived { plan, at, w, flux } = arrived;
        let sample = plan.body.enters(&at, w, (flux, 1.0), depth);
        found.rows.extend(sample.map(|sample| (plan.body.object(), sample)));
        if draws.number() < reflectance(plan.body.eta, w.dot(at.n)) {
            let away = reflect(w, at.n);
            return Some((Ray::new(at.leave(away), away), flux));
        }
        let walks = self.of.paths.walks(plan.body.object());
        let steps = plan.near.is_some();
        let (step, flux) = match (steps, walks) {
            (true, true) => (draws.number() < 0.5, flux * 2.0),
            (step, _) => (step, flux),
        };
        let rest = Arrived { flux, ..*arrived };
        if step { self.step(&rest, draws, found) } else { self.walk(&rest, draws, found) }
    }

    /// The near part of what entered, let out close to where that was.
    fn step(&self, arrived: &Arrived<'_>, draws: &mut PathSampler, found: &mut Found) -> Option<(Ray, Rgb)> {
        let &Arrived { plan, at, w, flux } = arrived;
        let near = plan.near.as_ref()?;
        let key = hash_combine(
            self.turn.seed,
            u64::from(draws.number().to_bits()) << 32 | u64::from(draws.number().to_bits()),
        );
        let step = near.step(self.view, &plan.body, (at.x, at.n), PixelStream::new(key, 0, 0), &mut found.tally)?;
        let out = SurfacePoint { n: step.at.n_geometric, ..step.at };
        let away = cosine_hemisphere(out.n, draws.pair());
        // The boundary has been passed by the choice not to mirror.
        let refracted = refract(w, at.n, plan.body.eta)?;
        let sample = CachedSample {
            entry: crate::bssrdf::Entry { x: Vec3::ZERO, n: at.n, w: refracted },
            depth: plan.body.model.sample_depth(draws.number()),
            flux: flux * (PI * step.weight),
        };
        let exit = Exit { x: Vec3::ZERO, n: out.n, w: away };
        let passed = plan.near_part(near, &exit, &sample, (at.x - step.place).as_vec3(), &mut found.tally)
            * plan.balance_at(step.place, exit.n);
        let left = passed * transmittance(plan.body.eta, away.dot(out.n));
        let chance = (left.max() / flux.max()).min(1.0);
        let goes_on = draws.number() < chance;
        goes_on.then(|| (Ray::new(out.leave(away), away), left * (1.0 / chance)))
    }

    /// What the model of the body lacks: light scattered less often, until it leaves.
    fn walk(&self, arrived: &Arrived<'_>, draws: &mut PathSampler, found: &mut Found) -> Option<(Ray, Rgb)> {
        let &Arrived { plan, at, w, flux } = arrived;
        let inside = refract(w, at.n, plan.body.eta)?;
        let from = (at.leave(inside), inside);
        self.of.paths.unmodelled(self.view, plan.body.object(), from, flux, draws, &mut found.tally)
    }

    /// Seed of what a body's paths of one kind draw in this pass.
    fn key(&self, plan: &Plan, kind: u64) -> u64 {
        let pass = hash_combine(self.turn.seed, self.turn.number.into());
        hash_combine(hash_combine(pass, plan.body.object().into()), kind)
    }
}

/// Light that comes to a body from outside.
struct Arrived<'a> {
    plan: &'a Plan,
    /// Flat as the triangle it lies on.
    at: SurfacePoint,
    /// Unit direction to where it comes from.
    w: Vec3,
    /// Before the boundary.
    flux: Rgb,
}

/// What tasks found, in their order.
fn collect(chunks: Vec<Found>, rows: &mut Rows, tally: &mut Tally) {
    for found in chunks {
        found.rows.into_iter().for_each(|(object, row)| rows[object as usize].push(row));
        *tally += found.tally;
    }
}
