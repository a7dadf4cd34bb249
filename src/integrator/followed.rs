//! Light on its way from a place where it is known, over surfaces and through bodies, until nothing is left of it. What comes to a body on the way
//! is a sample of that body's cache.

use super::View;
use super::volume_path::{Out, PathSampler, VolumePath};
use super::walked::{Emerged, WalkedBody};
use crate::bssrdf::{Entry, Exit};
use crate::cache::{CachedSample, Plan};
use crate::geometry::{Patches, SurfacePoint};
use crate::math::{Rgb, Vec3, hash_combine};
use crate::query::Ray;
use crate::sampling::{PixelStream, cosine_hemisphere};
use crate::tally::Tally;
use std::f32::consts::PI;
use std::sync::Arc;

/// Samples of each object's cache: place, and all of the flux they stand for.
pub struct Rows {
    /// Samples of each object.
    pub of: Vec<Vec<CachedSample>>,
    /// What left each, of those that are walked through.
    pub emerged: Vec<Vec<Emerged>>,
}

impl Rows {
    /// None of so many objects.
    pub fn new(objects: usize) -> Self {
        Self { of: vec![Vec::new(); objects], emerged: vec![Vec::new(); objects] }
    }
}

/// What one task found.
#[derive(Default)]
pub struct Found {
    /// Samples, each with its object.
    pub rows: Vec<(u32, CachedSample)>,
    /// What left bodies that are walked through.
    pub emerged: Vec<Emerged>,
    /// Light that has come out of bodies and goes on, each part over so many surfaces.
    open: Vec<(Ray, Rgb, PathSampler, u32)>,
    /// Surfaces that are left to what is followed now.
    left: u32,
    /// What it cost.
    pub tally: Tally,
}

/// Light that comes to a body from outside.
pub struct Arrived<'a> {
    /// The body.
    pub plan: &'a Plan,
    /// Flat as the triangle it lies on.
    pub at: SurfacePoint,
    /// Unit direction to where it comes from.
    pub w: Vec3,
    /// Before the boundary.
    pub flux: Rgb,
}

/// What light meets.
pub struct Followed<'a> {
    /// The scene and its rays.
    pub view: View<'a>,
    /// Bodies by their models, one for each object.
    pub plans: &'a [Option<Arc<Plan>>],
    /// Paths through clear bodies, and of what models lack.
    pub paths: &'a VolumePath,
    /// Bodies that are walked through, one for each object.
    pub walked: &'a [Option<WalkedBody>],
    /// Their patches.
    pub patches: &'a [Option<Patches>],
    /// Surfaces over which light goes on.
    pub bounces: u32,
    /// Of numbers that are not a path's own.
    pub seed: u64,
}

impl Followed<'_> {
    /// Follows light along `ray` until nothing is left of it, and what has come of it out of bodies that it was walked through.
    pub fn follow(&self, ray: Ray, flux: Rgb, draws: PathSampler, found: &mut Found) {
        found.left = self.bounces;
        self.follow_one(ray, flux, draws, found);
        self.follow_open(found);
    }

    fn follow_open(&self, found: &mut Found) {
        while let Some((ray, flux, draws, left)) = found.open.pop() {
            found.left = left;
            self.follow_one(ray, flux, draws, found);
        }
    }

    fn follow_one(&self, mut ray: Ray, mut flux: Rgb, mut draws: PathSampler, found: &mut Found) {
        while found.left > 0 {
            found.left -= 1;
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
                let Some(next) = self.paths.past_clear(self.view, way, flux, &mut draws, tally) else { return };
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
    pub fn enter(&self, arrived: &Arrived<'_>, depth: f32, mut draws: PathSampler, found: &mut Found) {
        found.left = self.bounces;
        if let Some((ray, flux)) = self.goes_on(arrived, depth, &mut draws, found) {
            self.follow_one(ray, flux, draws, found);
        }
        self.follow_open(found);
    }

    /// Light that has passed the boundary, without a sample: what the cache has no need of.
    pub fn pass_on(&self, arrived: &Arrived<'_>, mut draws: PathSampler, found: &mut Found) {
        found.left = self.bounces;
        if let Some((ray, flux)) = self.walk(arrived, &mut draws, found) {
            self.follow_one(ray, flux, draws, found);
        }
        self.follow_open(found);
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
        if draws.number() < plan.body.boundary.reflected(w.dot(at.n)) {
            let (away, weight) = plan.body.boundary.mirror(at.n, w, || draws.number())?;
            return Some((Ray::new(at.leave(away), away), flux * weight));
        }
        let flux = flux * plan.body.boundary.tint(&at);
        if flux.is_black() {
            return None;
        }
        if self.walked[plan.body.object() as usize].is_some() {
            return self.walk(&Arrived { flux, ..*arrived }, draws, found);
        }
        let walks = self.paths.walks(plan.body.object());
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
        let key =
            hash_combine(self.seed, u64::from(draws.number().to_bits()) << 32 | u64::from(draws.number().to_bits()));
        let step = near.step(self.view, &plan.body, (at.x, at.n), PixelStream::new(key, 0, 0), &mut found.tally)?;
        let out = SurfacePoint { n: step.at.n_geometric, ..step.at };
        let away = cosine_hemisphere(out.n, draws.pair());
        // The boundary has been passed by the choice not to mirror.
        let inside = plan.body.boundary.told(at.n, w)?;
        let sample = CachedSample {
            entry: Entry { x: Vec3::ZERO, n: at.n, w: inside },
            depth: plan.body.model.sample_depth(draws.number()),
            flux: flux * (PI * step.weight),
        };
        let exit = Exit { x: Vec3::ZERO, n: out.n, w: away };
        let passed = plan.near_part(near, &exit, &sample, (at.x - step.place).as_vec3(), &mut found.tally)
            * plan.balance_at(step.place, exit.n);
        let left = passed * plan.body.boundary.tint(&out) * plan.body.boundary.passed(away.dot(out.n));
        let chance = (left.max() / flux.max()).min(1.0);
        let goes_on = draws.number() < chance;
        goes_on.then(|| (Ray::new(out.leave(away), away), left * (1.0 / chance)))
    }

    /// What the model of the body lacks: light scattered less often, until it leaves. What arrived has passed the boundary.
    fn walk(&self, arrived: &Arrived<'_>, draws: &mut PathSampler, found: &mut Found) -> Option<(Ray, Rgb)> {
        let &Arrived { plan, at, w, flux } = arrived;
        let (inside, weight) = plan.body.boundary.enter(at.n, w, || draws.number())?;
        let flux = flux * weight;
        if flux.is_black() {
            return None;
        }
        let from = (at.leave(inside), inside);
        let object = plan.body.object();
        if let (Some(Some(body)), Some(Some(patches))) =
            (self.walked.get(object as usize), self.patches.get(object as usize))
        {
            let Found { emerged, open, tally, left, .. } = found;
            let each = |Out { exit, flux, order, draws }: Out, tally: &mut Tally| {
                if !flux.is_finite() {
                    tally.gather.non_finite += 1;
                    return;
                }
                if order > body.most {
                    emerged.push(Emerged {
                        object,
                        patch: body.patch(patches, &exit.at),
                        flux,
                        w: exit.w,
                        n: exit.at.n_geometric,
                    });
                }
                let passed = flux * plan.body.boundary.tint(&exit.at);
                open.push((Ray::new(exit.at.leave(exit.w), exit.w), passed, draws, *left));
            };
            self.paths.walk_through((self.view, object), (from, flux), body.windows(), draws.fork(1), tally, each);
            return None;
        }
        self.paths.unmodelled(self.view, plan.body.object(), from, flux, draws, &mut found.tally)
    }
}

/// What tasks found, in their order.
pub fn collect(chunks: Vec<Found>, rows: &mut Rows, tally: &mut Tally) {
    for found in chunks {
        found.rows.into_iter().for_each(|(object, row)| rows.of[object as usize].push(row));
        found.emerged.into_iter().for_each(|emerged| rows.emerged[emerged.object as usize].push(emerged));
        *tally += found.tally;
    }
}
