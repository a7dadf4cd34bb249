//! Light that comes to bodies over other surfaces, as samples of their caches.
//!
//! A path from a light to the place where it enters a body is made in one of two ways, by what it met last. If that was no body, the path
//! is followed from the place of entry backwards, over opaque surfaces, and asks them for their light. If it was one, whose boundary
//! mirrored it, or out of which it came, it is followed forwards: from places on bodies where the light of all samples so far is gathered
//! as for a pixel, and from places where light arrives. What it brings to a body is a sample as any other, gathered by the next round.

use super::followed::{Arrived, Followed, Found, Rows, collect};
use super::volume_path::{Modelled, PathSampler, VolumePath, VolumePathOptions};
use super::walked::{Emerged, WalkedBody, visible};
use super::{MOST_SURFACES, Part, View};
use crate::bssrdf::Exit;
use crate::cache::{Cache, CachedSample, Detail, GatherPoint, Plan, Scratch, SubsurfaceOptions};
use crate::geometry::{Patches, SurfacePoint};
use crate::light::Lights;
use crate::math::{hash_combine, unit_f32};
use crate::query::Ray;
use crate::sampling::{CacheStream, PixelStream, Points, Turn, cosine_hemisphere};
use crate::scene::{Object, Scene};
use crate::tally::{Cause, Tally};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::Arc;

/// Paths of each kind in a pass for so many of its samples.
const SAMPLES_PER_PATH: u32 = 4;
/// Rounds in which light leaves bodies and meets them again. What is left then would go on without end.
const MOST_ROUNDS: u32 = 1000;
/// Paths of one task; exits of one task are neighbours, and gathered together.
const CHUNK: usize = 1024;
/// A round of fewer exits is made by chance, with more weight.
const FEWEST: f64 = 64.0;
/// What the numbers are for.
const PURPOSE: u64 = 0x696e_6469_7265_6374;
/// Of a trial before the first pass.
const TRIAL: u64 = 0x74_7269_616c;

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
    /// Bodies that paths walk through themselves, one for each object.
    pub walked: Vec<Option<WalkedBody>>,
}

/// What paths through the bodies themselves brought in a pass.
#[derive(Default)]
pub struct Walks {
    /// One for each body.
    pub patches: Vec<Option<Patches>>,
    /// All that left them.
    pub emerged: Vec<Vec<Emerged>>,
}

/// What all tasks of a pass share.
struct Round<'a> {
    of: &'a Indirect,
    view: View<'a>,
    lights: &'a Lights,
    turn: Turn,
    followed: Followed<'a>,
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
        let reflects = |o: &Object| {
            let surface = &scene.materials[o.material].surface;
            surface.clear.is_some() || surface.is_opaque() && !surface.bsdf.albedo().is_black()
        };
        let surfaces = scene.objects.iter().any(reflects) && plans.iter().any(Option::is_some);
        let own = hash_combine(seed, PURPOSE);
        let count = (options.cache_samples / SAMPLES_PER_PATH).max(1);
        let body = |((object, plan), modelled): ((&Object, &Option<Arc<Plan>>), &Option<Modelled>)| {
            let walked = modelled.as_ref().is_some_and(|m| m.walked);
            plan.as_ref().filter(|_| walked).map(|plan| WalkedBody::new(&object.mesh, plan, count, seed))
        };
        let walked: Vec<Option<WalkedBody>> = scene.objects.iter().zip(plans).zip(&modelled).map(body).collect();
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
            count,
            seed: own,
            walked,
            streams: (0..scene.objects.len() as u64).map(streams).collect(),
        }
    }

    /// What is said of it.
    pub fn part(&self) -> Part {
        let count = self.count;
        if let Some(patches) = self.walked.iter().flatten().map(WalkedBody::most_patches).max() {
            return Part::built(
                OVER,
                format!(
                    "a pass, {count} paths of light through each body, split where the camera sees what they bring; up to {patches} patches"
                ),
            );
        }
        let over = if self.surfaces.is_some() { "; as many backwards over opaque surfaces" } else { "" };
        Part::built(OVER, format!("a pass, {count} paths of light from each body and {count} that it mirrors{over}"))
    }

    /// Whether paths walk through any body themselves.
    fn walks(&self) -> bool {
        self.walked.iter().any(Option::is_some)
    }

    /// Whether paths are scattered once in bodies whose models lack that.
    pub fn walks_once(&self) -> bool {
        self.once
    }

    /// Memory beside that of the caches, of so many samples for each object, where half of the paths arrive
    /// [bytes].
    pub fn bytes(&self, samples: &[u64]) -> u64 {
        let kinds = if self.surfaces.is_some() { 3 } else { 2 };
        let of = |(samples, body): (&u64, &Option<WalkedBody>)| {
            if *samples == 0 {
                return 0;
            }
            // What bodies send on by their models is gathered from a copy of the cache.
            let twice = if body.is_some() { 0 } else { *samples };
            let rows = (twice + kinds * u64::from(self.count) / 2) * size_of::<CachedSample>() as u64;
            rows + body.as_ref().map_or(0, |body| body.bytes())
        };
        samples.iter().zip(&self.walked).map(of).sum()
    }

    fn round<'a>(
        &'a self,
        (view, lights): (View<'a>, &'a Lights),
        plans: &'a [Option<Arc<Plan>>],
        turn: Turn,
        patches: &'a [Option<Patches>],
    ) -> Round<'a> {
        let (paths, walked, bounces) = (&self.paths, &self.walked[..], self.bounces);
        let followed = Followed { view, plans, paths, walked, patches, bounces, seed: turn.seed };
        Round { of: self, view, lights, turn, followed }
    }

    /// Finds what the camera sees of bodies that paths walk through, and where it comes from.
    pub fn survey(&self, view: View<'_>, lights: &Lights, plans: &[Option<Arc<Plan>>]) {
        if !self.walks() {
            return;
        }
        let trial = |body: &Option<WalkedBody>| Some(body.as_ref()?.trial());
        let patches: Vec<Option<Patches>> = self.walked.par_iter().map(trial).collect();
        let turn = Turn::of(hash_combine(self.seed, TRIAL), 0);
        let round = self.round((view, lights), plans, turn, &patches);
        let (mut rows, mut tally) = (Rows::new(plans.len()), Tally::default());
        for plan in plans.iter().flatten() {
            round.backwards(plan, &mut rows, &mut tally);
            round.mirrored(plan, &mut rows, &mut tally);
        }
        let visible = visible(view);
        for (body, patches) in self.walked.iter().zip(patches) {
            let (Some(body), Some(patches)) = (body, patches) else { continue };
            let plan = body.plan();
            let stream = &self.streams[plan.body.object() as usize][0];
            let builder = plan.builder(view, lights, stream, plan.density());
            let entering = |i: u64| {
                let (at, w, flux) = builder.arriving(i, &mut Tally::default())?;
                let boundary = &plan.body.boundary;
                let passed = boundary.tint(&at) * (boundary.passed(w.dot(at.n)) / self.count as f32);
                (!flux.is_black()).then(|| (at.x, flux * passed))
            };
            let entering: Vec<_> = (0..u64::from(self.count)).into_par_iter().filter_map(entering).collect();
            let emerged = &rows.emerged[plan.body.object() as usize];
            body.learn(view, &self.paths, (patches, emerged), &entering, &visible);
        }
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
    ) -> Walks {
        let start = std::time::Instant::now();
        let trees = tally.clock.tree;
        let patches: Vec<Option<Patches>> =
            self.walked.par_iter().map(|body| Some(body.as_ref()?.patches(pass))).collect();
        let round = self.round((view, lights), plans, Turn::of(self.seed, pass), &patches);
        let mut rows = Rows::new(plans.len());
        for plan in plans.iter().flatten() {
            round.backwards(plan, &mut rows, tally);
            round.mirrored(plan, &mut rows, tally);
        }
        keep(caches, &rows, tally);
        let mut emerged = rows.emerged;
        // The first round has all light so far, each later one what the one before brought. What enters bodies that are walked through has
        // been followed.
        let by_model = |(cache, body): (&Option<Cache>, &Option<WalkedBody>)| cache.clone().filter(|_| body.is_none());
        let mut sources: Vec<Option<Cache>> = caches.iter().zip(&self.walked).map(by_model).collect();
        let whole: f64 = sources.iter().flatten().map(flux).sum();
        for level in 1..=self.bounces {
            if sources.iter().all(Option::is_none) {
                break;
            }
            if level > MOST_ROUNDS {
                for plan in plans.iter().flatten().filter(|p| sources[p.body.object() as usize].is_some()) {
                    tally.walk.walks += 1;
                    tally.walk.losses.add(plan.body.object(), Cause::Endless);
                }
                break;
            }
            let mut rows = Rows::new(plans.len());
            for (plan, source) in plans.iter().zip(&mut sources) {
                if let (Some(plan), Some(source)) = (plan, source.take()) {
                    round.forwards(plan, source, (whole, level, pass), &mut rows, tally);
                }
            }
            keep(caches, &rows, tally);
            emerged.iter_mut().zip(rows.emerged).for_each(|(all, new)| all.extend(new));
            let source = |(mut rows, (cache, body)): (Vec<CachedSample>, (&Option<Cache>, &Option<WalkedBody>))| {
                rows.retain(CachedSample::is_finite);
                let cache = cache.as_ref().filter(|_| !rows.is_empty() && body.is_none());
                cache.map(|_| Cache { lit: rows, attempted: 1 })
            };
            sources = rows.of.into_iter().zip(caches.iter().zip(&self.walked)).map(source).collect();
        }
        let spent = start.elapsed().as_secs_f64() - (tally.clock.tree - trees);
        *(if self.walks() { &mut tally.clock.walks } else { &mut tally.clock.fill }) += spent;
        Walks { patches, emerged }
    }
}

/// All that has entered.
fn flux(cache: &Cache) -> f64 {
    let sum: f64 = cache.lit.iter().map(|s| s.flux.mean_f64()).sum();
    sum / f64::from(cache.attempted.max(1))
}

/// Samples that stand for all of their flux, beside those that stand for it all together.
fn keep(caches: &mut [Option<Cache>], rows: &Rows, tally: &mut Tally) {
    for (cache, rows) in caches.iter_mut().zip(&rows.of) {
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
                for i in first..(first + CHUNK as u64).min(numbers.end) {
                    task(i, &mut found);
                }
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
            // What picked the light must not pick too which part of it goes on.
            let draws = draws.fork(2);
            self.followed.enter(&arrived, depth, draws, found);
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
            let draws = PathSampler::new(&[], hash_combine(key, i));
            let mirrored = plan.body.boundary.reflected(w.dot(at.n));
            let mut own = draws.fork(0);
            if let Some((away, weight)) = plan.body.boundary.mirror(at.n, w, || own.number()) {
                self.followed.follow(Ray::new(at.leave(away), away), flux * (mirrored * weight), own, found);
            }
            let passed = plan.body.boundary.tint(&at) * plan.body.boundary.passed(w.dot(at.n));
            let arrived = Arrived { plan, at, w, flux: flux * passed };
            self.followed.pass_on(&arrived, draws, found);
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
                    let passed = plan.body.boundary.passed(w.dot(at.n));
                    let flux = *sum * (each * passed) * plan.body.boundary.tint(at);
                    self.followed.follow(
                        Ray::new(at.leave(w), w),
                        flux,
                        PathSampler::new(&[], point.stream.key()),
                        &mut found,
                    );
                }
                found
            })
            .collect();
        collect(chunks, rows, tally);
    }

    /// Seed of what a body's paths of one kind draw in this pass.
    fn key(&self, plan: &Plan, kind: u64) -> u64 {
        let pass = hash_combine(self.turn.seed, self.turn.number.into());
        hash_combine(hash_combine(pass, plan.body.object().into()), kind)
    }
}
