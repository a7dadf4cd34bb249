//! Even light from all sides on a body, for its [`Balance`].

use super::balance::Known;
use super::{Balance, Cache, CachedSample, Detail, GatherPoint, Gatherer, Plan, Scratch, Tuning};
use crate::bssrdf::{Exit, ModelName, ModelOptions, Partition};
use crate::math::{Rgb, Vec4};
use crate::optics::FresnelMoments;
use crate::sampling::{CacheStream, PixelStream, Points, cosine_hemisphere};
use crate::scene::{Estimator, View};
use crate::tally::Tally;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Samples of even light, for one of a pass, within bounds.
const SAMPLES: [u32; 2] = [1 << 11, 1 << 16];
/// Of them, for each point where what they bring is gathered.
const SAMPLES_PER_POINT: u32 = 4;
/// The largest share of the sum that one node of a cut may be wrong by: means over neighbours even it out.
const ERROR: f32 = 0.2;
/// Points gathered together.
const CHUNK: usize = 1024;

/// The balance of the body of `plan`; a function of scene and seed. `None` for models of sheets, which have two faces, and where light comes no
/// farther than to the next sample of a cache.
pub fn balance(plan: &Plan, view: View<'_>, seed: u64) -> Option<Balance> {
    let body = &plan.body;
    let samples = plan.samples.clamp(SAMPLES[0], SAMPLES[1]);
    let count = samples / SAMPLES_PER_POINT;
    let surface = view.scene.surface(body.object()).inside.as_ref()?;
    if body.model.name() == ModelName::SLAB || plan.near.is_some() {
        return None;
    }
    let normalised = surface.model.normalises_exit(surface.exit_normalisation);
    let exit = if normalised { FresnelMoments::new(body.eta.into()).four_c_phi_outside } else { 1.0 };
    let own = body.model.total();
    // What begins with light scattered twice competes with light scattered once too: the standard dipole has about the total of both.
    let standard = ModelName::STANDARD.build(&surface.medium, &ModelOptions::DEFAULT).ok();
    let total = standard.filter(|_| !body.model.claims().first_order).map_or(own, |model| model.total());
    let on_a_plane = own.map(|total| (f64::from(total) / (PI * exit)) as f32);
    let mesh = &view.scene.objects[body.object() as usize].mesh;
    let flat = |(pick, u): (f64, [f32; 7])| body.place(mesh, body.table().sample(pick, [u[0], u[1]]));
    let [light, points] = [1, 2].map(|k| CacheStream::new(Points::Sobol, seed, k << 32 | u64::from(body.object())));
    let enter = |i: u64| {
        let numbers = light.numbers(i);
        let at = flat(numbers)?;
        let w = cosine_hemisphere(at.n, [numbers.1[2], numbers.1[3]]);
        Some(body.enters(&at, w, (Rgb::WHITE, body.table().area() as f32), numbers.1[4]))
    };
    let entering: Vec<Option<CachedSample>> = (0..u64::from(samples)).into_par_iter().filter_map(enter).collect();
    // Of all area that of the body's surface: what lies inside a union bears no light.
    let area = body.table().area() * (entering.len() as f64 / f64::from(samples));
    let lit: Vec<CachedSample> = entering.into_iter().flatten().collect();
    let entered: f64 = lit.iter().map(|s| f64::from(s.flux[0])).sum::<f64>() / f64::from(samples) / area;
    let tuning = Tuning { error: ERROR, floor: Vec4::ZERO, partition: Partition::NONE };
    let gatherer = Gatherer::new(Estimator::Cut, Cache { lit, attempted: samples }, &*body.model, tuning);
    let mut picks: Vec<(f64, [f32; 7])> = (0..u64::from(count)).map(|i| points.numbers(i)).collect();
    picks.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let known: Vec<Vec<Known>> = picks
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, picks)| {
            let point = |(i, &numbers): (usize, &(f64, [f32; 7]))| {
                let at = flat(numbers)?;
                let exit = Exit { x: (at.x - body.table().centre()).as_vec3(), n: at.n, w: at.n };
                Some(GatherPoint { exit, place: at.x, stream: PixelStream::new(seed, (chunk * CHUNK + i) as u64, 0) })
            };
            let points: Vec<GatherPoint> = picks.iter().enumerate().filter_map(point).collect();
            let mut sums = Vec::new();
            plan.sum((&gatherer, Detail::Fine), &points, &mut Scratch::default(), &mut Tally::default(), &mut sums);
            let divisor = |sum: &Rgb| {
                let divisor = |c: usize| {
                    // Some models send out more than has entered.
                    let (s, p) = (f64::from(sum[c]) / entered / f64::from(on_a_plane[c]), f64::from(total[c]).min(1.0));
                    (s * p + 1.0 - p) as f32
                };
                // A channel that no light comes out of is as good as any.
                Rgb::from_fn(|c| if divisor(c).is_normal() { divisor(c) } else { 1.0 })
            };
            points.iter().zip(&sums).map(|(p, sum)| Known { x: p.exit.x, n: p.exit.n, divisor: divisor(sum) }).collect()
        })
        .collect();
    Some(Balance::new(known.into_iter().flatten().collect(), area, body.table().centre()))
}
