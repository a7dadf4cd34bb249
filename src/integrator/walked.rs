//! How much light leaves each patch of a body, by paths that walk through the body itself.
//!
//! A model of a half space does not know the shape it is used on. What really leaves, and where, is what paths bring that enter with the
//! light of the cache, are scattered in the body, leave, and enter again. A pass has too few of them for a picture, and enough for the
//! exitance of patches of the surface. What is finer than a patch the model has: within it the model's own light is scaled, so that the
//! patch sends out what the paths say. That is linear in the paths, so the mean over passes has the noise of all of them, and the borders of
//! patches are nowhere in it; how light leans is told by sixteen patches together, where a ratio does no harm. Patches become smaller from
//! pass to pass, and with them what is left of the model's error.

use super::View;
use super::volume_path::{VolumePath, Windows};
use crate::bssrdf::Exit;
use crate::cache::{Detail, GatherPoint, Gatherer, Plan, Scratch};
use crate::geometry::{Facet, Facets, Mesh, Patches, SurfacePoint};
use crate::light::Lights;
use crate::math::{DVec3, Rgb, Vec3, hash_combine, unit_f64};
use crate::optics::{Moments, WayOut};
use crate::sampling::PixelStream;
use crate::tally::Tally;
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// Patches of the first pass: 2 to this.
const DEPTH: f64 = 10.5;
/// And at most.
const DEEPEST: f64 = 14.0;
/// Patches grow in number as passes to this power: the noise of a place, which fewer and fewer paths of a pass serve, and what patches are too
/// coarse for fall alike.
const GROWTH: f64 = 1.0 / 3.0;
/// Facets for each patch of the first passes.
const FACETS: f64 = 32.0;
/// And for each at the least: area that is told by facets is off by what its borders cut. As many paths for moments.
const FEWEST: f64 = 32.0;
/// Parts of a path where light enters, in the mean.
const PARTS: f64 = 4.0;
/// Places in a patch where the model is asked.
const PLACES: u32 = 4;
/// Patches in whose mean light a patch's dark places take part: 2 to this.
const AROUND: usize = 4;
/// Exits gathered together.
const CHUNK: usize = 1024;
/// What the numbers are for.
const PURPOSE: u64 = 0x7761_6c6b_6564;

/// Patches of a trial: 2 to this.
const TRIAL: u32 = 7;
/// Walks from what the camera sees, backwards.
const ADJOINT: usize = 1 << 13;
/// Patches darker than this share of the mean count as no darker.
const DARK: f64 = 0.02;
/// Rays across and down the picture that tell what is seen, at most.
const CELLS: u32 = 64;

/// Points of objects that the camera sees from outside.
pub fn visible(view: View<'_>) -> Vec<(u32, SurfacePoint)> {
    let camera = &view.scene.camera;
    let [columns, rows] = camera.resolution.map(|r| r.min(CELLS));
    let through = |cell: u32| {
        let at = [cell % columns, cell / columns].map(|k| k as f32 + 0.5);
        let [x, y] = [(0, columns), (1, rows)].map(|(a, n)| at[a] * camera.resolution[a] as f32 / n as f32);
        let ray = camera.grid_ray([x as u32, y as u32], [x.fract(), y.fract()], cell);
        let hit = view.rays.closest(&ray)?;
        let at = view.outwards(&hit);
        let at = SurfacePoint { n: at.n_geometric, ..at };
        (at.n_geometric.dot(ray.direction) < 0.0).then_some((hit.mesh, at))
    };
    (0..columns * rows).filter_map(through).collect()
}

/// A body that paths walk through.
pub struct WalkedBody {
    plan: Arc<Plan>,
    facets: Facets,
    way_out: WayOut,
    /// Paths in a pass.
    paths: u32,
    /// Orders that the camera's own paths bring: up to this.
    pub most: u32,
    seed: u64,
    windows: OnceLock<Option<Windows>>,
}

/// Light that left a body.
#[derive(Clone, Copy, Debug)]
pub struct Emerged {
    /// Index of the body.
    pub object: u32,
    /// Patch of its surface.
    pub patch: u32,
    /// How much [radiance unit x sr x unit²].
    pub flux: Rgb,
    /// Unit direction outside.
    pub w: Vec3,
    /// Outward normal of the triangle.
    pub n: Vec3,
}

/// One patch in one pass.
#[derive(Clone, Copy, Debug, Default)]
struct Patch {
    /// ∫ L cosθ dω [radiance unit x sr].
    exitance: Rgb,
    /// Of patches around together.
    around: Moments,
    /// One over the model's mean sum, `floor` added.
    inverse: Rgb,
    /// What is added to the model's sums in the patch: their mean over patches around.
    floor: Rgb,
}

/// What leaves a patch, summed.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    exitance: [f64; 3],
    normal: [f64; 3],
    along: [DVec3; 3],
}

/// What leaves a body in one pass.
pub struct Exitance {
    patches: Patches,
    each: Vec<Patch>,
    way_out: WayOut,
    centre: DVec3,
}

impl WalkedBody {
    /// Of the body of `plan`, whose surface is `mesh`, by so many paths a pass.
    pub fn new(mesh: &Mesh, plan: &Arc<Plan>, paths: u32, seed: u64) -> Self {
        let body = &plan.body;
        let (table, area) = (body.table(), body.table().area());
        let most = area / (2.0_f64.powf(DEPTH + 2.0) * FACETS);
        let bears = |triangle, x| body.union.as_ref().is_none_or(|union| union.bears(triangle, x));
        Self {
            facets: Facets::new(mesh, table.centre(), most, bears),
            way_out: match &body.boundary.rough {
                None => WayOut::new(body.boundary.eta),
                Some(rough) => WayOut::of_transmittance(0.0, |cosine| rough.passed(cosine)),
            },
            most: u32::from(!body.model.claims().first_order),
            seed: hash_combine(hash_combine(seed, PURPOSE), body.object().into()),
            plan: plan.clone(),
            paths,
            windows: OnceLock::new(),
        }
    }

    /// The body by its model.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Where paths are split, once that is known.
    pub fn windows(&self) -> Option<&Windows> {
        self.windows.get()?.as_ref()
    }

    /// Patches for a trial.
    pub fn trial(&self) -> Patches {
        let depth = f64::from(TRIAL).min(self.finest()) as u32;
        Patches::new(&self.facets, depth, hash_combine(self.seed, 4))
    }

    /// Patches of late passes.
    pub fn most_patches(&self) -> u32 {
        2_f64.powf(self.finest().min(DEEPEST)) as u32
    }

    /// Memory of facets and patches, and of what the paths of a pass bring [bytes].
    pub fn bytes(&self) -> u64 {
        // Lists grow by doubling, and are there twice while tasks are collected; of the parts of a path some come out (measured).
        let facets = self.facets.count() as u64 * (2 * size_of::<Facet>() + 8 * size_of::<f32>()) as u64;
        let emerged = 1.2 * PARTS * f64::from(self.paths) * size_of::<Emerged>() as f64;
        facets + u64::from(self.most_patches()) * size_of::<(Patch, Sums)>() as u64 + emerged as u64
    }

    /// Log2 of how many patches there may be: each has some facets, and those whose moments are taken together some paths.
    fn finest(&self) -> f64 {
        let by_facets = self.facets.largest_in_all() / FEWEST;
        let by_paths = f64::from(self.paths) / FEWEST * f64::from(1 << AROUND);
        by_facets.min(by_paths).max(1.0).log2()
    }

    /// Finds where paths are to be split, from what `emerged` in a trial, places where light enters with its flux, and what the camera sees.
    pub fn learn(
        &self,
        view: View<'_>,
        paths: &VolumePath,
        (patches, emerged): (Patches, &[Emerged]),
        entering: &[(DVec3, Rgb)],
        visible: &[(u32, SurfacePoint)],
    ) {
        let object = self.plan.body.object();
        let own: Vec<&SurfacePoint> = visible.iter().filter(|v| v.0 == object).map(|v| &v.1).collect();
        let mut exitance = vec![[0.0_f64; 3]; patches.count()];
        for e in emerged {
            (0..3).for_each(|c| exitance[e.patch as usize][c] += f64::from(e.flux[c]));
        }
        let at = |p: &SurfacePoint| {
            let patch = self.patch(&patches, p) as usize;
            exitance[patch].map(|e| e / patches.area(patch).max(f64::MIN_POSITIVE))
        };
        let seen: Vec<[f64; 3]> = own.iter().map(|p| at(p)).collect();
        let mean: [f64; 3] = std::array::from_fn(|c| seen.iter().map(|s| s[c]).sum::<f64>() / seen.len() as f64);
        let weight = |s: &[f64; 3]| {
            Rgb::from_fn(|c| if mean[c] > 0.0 { (mean[c] / s[c].max(DARK * mean[c])) as f32 } else { 0.0 })
        };
        let seen: Vec<(SurfacePoint, Rgb)> = own.iter().zip(&seen).map(|(p, s)| (**p, weight(s))).collect();
        let windows = || {
            let bounds = self.plan.body.body.bounds;
            let key = hash_combine(self.seed, 5);
            let mut windows = paths.importance(view, object, bounds, &seen, (ADJOINT, key))?;
            let worth = |(x, flux): &(DVec3, Rgb)| f64::from(windows.worth(*x, *flux));
            let mean = entering.iter().map(worth).sum::<f64>() / entering.len() as f64;
            let factor = (PARTS / mean) as f32;
            (factor.is_finite() && factor > 0.0).then(|| windows.scale(factor))?;
            Some(windows)
        };
        let _ = self.windows.set(if seen.is_empty() { None } else { windows() });
    }

    /// The patches of pass number `pass`.
    pub fn patches(&self, pass: u32) -> Patches {
        let seed = hash_combine(self.seed, pass.into());
        let depth = DEPTH + GROWTH * (f64::from(pass) + 1.0).log2();
        let depth = depth.min(self.finest()).min(DEEPEST);
        // Between two powers of two by chance.
        let depth = (depth + unit_f64(hash_combine(seed, 1) as u32)).floor() as u32;
        Patches::new(&self.facets, depth, hash_combine(seed, 2))
    }

    /// The patch of `patches` at a place with its triangle's outward normal.
    #[inline]
    pub fn patch(&self, patches: &Patches, at: &SurfacePoint) -> u32 {
        patches.at((at.x - self.plan.body.table().centre()).as_vec3(), at.n_geometric) as u32
    }

    /// What leaves in a pass, by what `emerged` of this body from `patches`, and by the model's sums over the cache.
    pub fn exitance(
        &self,
        around: (View<'_>, &Lights),
        (cache, pass): (&Gatherer, u32),
        patches: Patches,
        emerged: &[Emerged],
        tally: &mut Tally,
    ) -> Exitance {
        let mut each = vec![Patch::default(); patches.count()];
        let mut sums = vec![Sums::default(); patches.count()];
        for e in emerged {
            let sums = &mut sums[e.patch as usize];
            let c = e.n.dot(e.w);
            let along = (e.w - e.n * c).as_dvec3();
            for k in 0..3 {
                let flux = f64::from(e.flux[k]);
                sums.exitance[k] += flux;
                sums.normal[k] += flux * f64::from(c);
                sums.along[k] += along * flux;
            }
        }
        let modelled = self.modelled(around, (cache, pass), &patches, tally);
        // Leaves of one branch are neighbours.
        for (family, (patch, sums)) in each.chunks_mut(1 << AROUND).zip(sums.chunks(1 << AROUND)).enumerate() {
            let first = family << AROUND;
            let areas: Vec<f64> = (0..patch.len()).map(|i| patches.area(first + i)).collect();
            let whole: f64 = areas.iter().sum();
            let mut around = Sums::default();
            let mut floor = Rgb::BLACK;
            for (i, own) in sums.iter().enumerate() {
                for k in 0..3 {
                    around.exitance[k] += own.exitance[k] / whole;
                    around.normal[k] += own.normal[k] / whole;
                    around.along[k] += own.along[k] / whole;
                }
                floor += modelled[first + i].0 * (areas[i] / whole) as f32;
            }
            let around = Moments {
                exitance: Rgb::from_fn(|k| around.exitance[k] as f32),
                normal: Rgb::from_fn(|k| around.normal[k] as f32),
                along: around.along.map(DVec3::as_vec3),
            };
            for (i, patch) in patch.iter_mut().enumerate().filter(|(i, _)| areas[*i] > 0.0) {
                let (mean, variance) = modelled[first + i];
                let all = mean + floor;
                // One over a mean of few places is too large by the variance of that, relative to it.
                let inverse = |k: usize| {
                    let one = 1.0 / all[k];
                    if all[k] > f32::MIN_POSITIVE { one * (1.0 - (variance[k] * one * one).min(0.5)) } else { 0.0 }
                };
                *patch = Patch {
                    exitance: Rgb::from_fn(|k| (sums[i].exitance[k] / areas[i]) as f32),
                    around,
                    inverse: Rgb::from_fn(inverse),
                    floor,
                };
            }
        }
        Exitance { patches, each, way_out: self.way_out, centre: self.plan.body.table().centre() }
    }

    /// The mean of the model's sum over each patch, and its variance.
    fn modelled(
        &self,
        around: (View<'_>, &Lights),
        (cache, pass): (&Gatherer, u32),
        patches: &Patches,
        tally: &mut Tally,
    ) -> Vec<(Rgb, Rgb)> {
        let seed = hash_combine(hash_combine(self.seed, 3), pass.into());
        let centre = self.plan.body.table().centre();
        let parts: Vec<(Vec<(Rgb, Rgb)>, Tally)> = (0..patches.count().div_ceil(CHUNK / PLACES as usize))
            .into_par_iter()
            .map(|chunk| {
                let first = chunk * (CHUNK / PLACES as usize);
                let own = first..(first + CHUNK / PLACES as usize).min(patches.count());
                let (mut points, mut counts) = (Vec::new(), Vec::new());
                for patch in own {
                    let before = points.len();
                    for (k, facet) in patches.spread(&self.facets, patch, PLACES, seed).into_iter().enumerate() {
                        let stream = PixelStream::new(seed, (patch * PLACES as usize + k) as u64, 0);
                        let exit = Exit { x: facet.x, n: facet.n, w: facet.n };
                        points.push(GatherPoint { exit, place: centre + facet.x.as_dvec3(), stream });
                    }
                    counts.push(points.len() - before);
                }
                let (mut scratch, mut tally, mut sums) = (Scratch::default(), Tally::default(), Vec::new());
                self.plan.gather(around, (cache, Detail::Coarse), &points, &mut scratch, &mut tally, &mut sums);
                let mut at = 0;
                let mean = |count: usize| {
                    let own = &sums[at..at + count];
                    at += count;
                    let one = 1.0 / count.max(1) as f32;
                    let mean = own.iter().fold(Rgb::BLACK, |sum, s| sum + *s) * one;
                    let off = |k: usize| own.iter().map(|s| (s[k] - mean[k]).powi(2)).sum::<f32>();
                    (mean, Rgb::from_fn(|k| off(k) * one / count.saturating_sub(1).max(1) as f32))
                };
                (counts.into_iter().map(mean).collect(), tally)
            })
            .collect();
        let mut means = Vec::with_capacity(patches.count());
        for (part, work) in parts {
            means.extend(part);
            *tally += work;
        }
        means
    }
}

impl Exitance {
    /// Radiance under the boundary that leaves at `at` by `exit`, where the model's sum is `sum`.
    pub fn radiance(&self, at: &SurfacePoint, exit: &Exit, sum: Rgb) -> Rgb {
        let patch = &self.each[self.patches.at((at.x - self.centre).as_vec3(), at.n_geometric)];
        let light = self.way_out.even(patch.exitance);
        let turned = self.way_out.lean(&patch.around, exit.n, exit.w);
        let even = self.way_out.even(patch.around.exitance);
        let share = |k: usize| {
            // Where the model has nothing at all, all of the patch is alike.
            if patch.inverse[k] > 0.0 { (sum[k] + patch.floor[k]) * patch.inverse[k] } else { 1.0 }
        };
        // Two moments may tell of less than nothing in directions that hardly any light goes in.
        let turned = |k: usize| if even[k] > 0.0 { (1.0 + turned[k] / even[k]).max(0.0) } else { 1.0 };
        Rgb::from_fn(|k| light[k] * turned(k) * share(k))
    }
}
