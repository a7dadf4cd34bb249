//! Even light from all sides on a body, for its [`Balance`].

use super::balance::Known;
use super::straight::straight;
use super::{Balance, Cache, CachedSample, Detail, GatherPoint, Gatherer, Plan, Scratch, Tuning};
use crate::bssrdf::{Exit, ModelName, ModelOptions, Partition};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3, Vec4};
use crate::optics::Medium;
use crate::sampling::{CacheStream, PixelStream, Points, cosine_hemisphere};
use crate::scene::{Estimator, View};
use crate::tally::Tally;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Samples of even light.
const SAMPLES: u32 = 1 << 14;
/// Points where what they bring is gathered, within bounds: so many for a square of a transport mean free path, which is how fine the balance is.
const POINTS: [u32; 2] = [1 << 9, 1 << 13];
const PER_SQUARE: f64 = 4.0;
/// The largest share of the sum that one node of a cut may be wrong by. On a ball of some mean free paths pictures by other numbers then
/// differ by 0.2 % (rms of pixels); at 0.2 it was 0.7 %, and more samples do not help.
const ERROR: f32 = 0.05;
/// Points gathered together.
const CHUNK: usize = 1024;

/// Points where there is a near part, and samples of it.
const NEAR: [u32; 2] = [1 << 11, 1 << 18];

/// The least share of light that is taken to be scattered in a body.
const LEAST_SCATTERED: f32 = 1e-6;

/// What numbers of the directions of even light are for.
const EVEN_LIGHT: u64 = 0x6576_656e;

/// Seed of all numbers here. It is not the render's, and no count here hangs on the samples of a pass: the balance is part of the model,
/// and whatever renders a scene has to come to one picture.
const SEED: u64 = 0x6261_6c61;

/// The balance of the body of `plan`, through which light may come `clear`: unscattered, beside the model. A function of the scene alone.
pub fn balance(plan: &Plan, view: View<'_>, clear: bool) -> Option<Balance> {
    let body = &plan.body;
    let surface = view.scene.surface(body.object()).inside.as_ref()?;
    let count = if plan.near.is_some() { NEAR[0] } else { points(body.table().area(), &surface.medium) };
    let normalised = surface.model.normalises_exit(surface.exit_normalisation);
    let options = surface.options();
    let exit = if normalised { options.moments(&surface.medium).four_c_phi_outside } else { 1.0 };
    let own = body.model.total_of_all_faces();
    let sheet = own != body.model.total();
    // What begins with light scattered twice competes with light scattered once too: the standard dipole has about the total of both.
    let standard = ModelName::STANDARD
        .build(&surface.medium, &ModelOptions { boundary: options.boundary, ..ModelOptions::DEFAULT })
        .ok();
    let total = standard.filter(|_| !body.model.claims().first_order).map_or(own, |model| model.total());
    let on_a_plane = own.map(|total| (f64::from(total) / (PI * exit)) as f32);
    let mesh = &view.scene.objects[body.object() as usize].mesh;
    let flat = |(pick, u): (f64, [f32; 7])| body.place(mesh, body.table().sample(pick, [u[0], u[1]]));
    let [light, points] = [1, 2].map(|k| CacheStream::new(Points::Sobol, SEED, k << 32 | u64::from(body.object())));
    let enter = |i: u64| {
        let numbers = light.numbers(i);
        let at = flat(numbers)?;
        let w = cosine_hemisphere(at.n, [numbers.1[2], numbers.1[3]]);
        Some(body.enters_untinted(&at, w, (Rgb::WHITE, body.table().area() as f32), numbers.1[4]))
    };
    let entering: Vec<Option<CachedSample>> = (0..u64::from(SAMPLES)).into_par_iter().filter_map(enter).collect();
    // Of all area that of the body's surface: what lies inside a union bears no light.
    let area = body.table().area() * (entering.len() as f64 / f64::from(SAMPLES));
    let lit: Vec<CachedSample> = entering.into_iter().flatten().collect();
    let entered: f64 = lit.iter().map(|s| f64::from(s.flux[0])).sum::<f64>() / f64::from(SAMPLES) / area;
    let partition = plan.near.as_ref().map_or(Partition::NONE, |near| near.rest);
    let tuning = Tuning { error: ERROR, floor: Vec4::ZERO, partition };
    let gatherer = Gatherer::new(Estimator::Cut, Cache { lit, attempted: SAMPLES }, &*body.model, tuning);
    let mut picks: Vec<(f64, [f32; 7])> = (0..u64::from(count)).map(|i| points.numbers(i)).collect();
    picks.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let known: Vec<Vec<Known>> = picks
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, picks)| {
            let point = |(i, &numbers): (usize, &(f64, [f32; 7]))| {
                let at = flat(numbers)?;
                let exit = Exit { x: (at.x - body.table().centre()).as_vec3(), n: at.n, w: at.n };
                Some(GatherPoint { exit, place: at.x, stream: PixelStream::new(SEED, (chunk * CHUNK + i) as u64, 0) })
            };
            let points: Vec<GatherPoint> = picks.iter().enumerate().filter_map(point).collect();
            // The total of a half space has all light that is scattered in it, where a thin body lets some through.
            let beside = clear && body.model.claims().unscattered;
            let straight = |numbers: &(f64, [f32; 7])| {
                let at = flat(*numbers)?;
                let [.., u, v] = numbers.1;
                Some(if beside { straight(plan, view, &at, [u, v]) } else { Rgb::BLACK })
            };
            let straight: Vec<Rgb> = picks.iter().filter_map(straight).collect();
            let mut sums = Vec::new();
            let (mut scratch, mut tally) = (Scratch::default(), Tally::default());
            plan.unbalanced_sum((&gatherer, Detail::Fine), &points, &mut scratch, &mut tally, &mut sums);
            for (point, sum) in points.iter().zip(&mut sums) {
                *sum += near_part(plan, view, point, NEAR[1] / count, &mut tally);
            }
            let divisors = |sum: &Rgb, straight: &Rgb| {
                let both = |c: usize| {
                    // Some models send out more than has entered.
                    let (s, p) = (f64::from(sum[c]) / entered / f64::from(on_a_plane[c]), f64::from(total[c]).min(1.0));
                    // The share s p / divisor leaves, which is no more than what does not come through straight.
                    let least = s * p / f64::from((1.0 - straight[c]).max(LEAST_SCATTERED));
                    // What would leave by the other face of a sheet is lost where that is not there.
                    [s * p + 1.0 - p, least.max(if sheet { 1.0 } else { 0.0 })].map(|v| v as f32)
                };
                // A channel that no light comes out of is as good as any.
                let channels =
                    [0, 1, 2].map(both).map(|[d, least]| if d.max(least).is_normal() { [d, least] } else { [1.0; 2] });
                [0, 1].map(|k| Rgb::from_fn(|c| channels[c][k]))
            };
            let known = |((p, sum), straight): ((&GatherPoint, &Rgb), &Rgb)| {
                let [divisor, least] = divisors(sum, straight);
                Known { x: p.exit.x, n: p.exit.n, divisor, least }
            };
            points.iter().zip(&sums).zip(&straight).map(known).collect()
        })
        .collect();
    Some(Balance::new(known.into_iter().flatten().collect(), area, body.table().centre()))
}

/// How many points an area [unit²] of a medium needs.
fn points(area: f64, medium: &Medium) -> u32 {
    let least = medium.transport_mean_free_path().0.into_iter().fold(f32::INFINITY, f32::min);
    let wanted = PER_SQUARE * area / f64::from(least).powi(2);
    (wanted as u32).clamp(POINTS[0], POINTS[1])
}

/// The mean of `count` samples of what even light close to `point` brings there.
fn near_part(plan: &Plan, view: View<'_>, point: &GatherPoint, count: u32, tally: &mut Tally) -> Rgb {
    let Some(near) = &plan.near else { return Rgb::BLACK };
    let exit = Exit { x: Vec3::ZERO, ..point.exit };
    let mut one = |k: u32| {
        let numbers = point.stream.split(k, count);
        let u = numbers.aside(EVEN_LIGHT).next_4d();
        let step = near.step(view, &plan.body, (point.place, exit.n), numbers, tally)?;
        let at = SurfacePoint { n: step.at.n_geometric, ..step.at };
        let w = cosine_hemisphere(at.n, [u[0], u[1]]);
        let sample = plan.body.enters_untinted(&at, w, (Rgb::WHITE, step.weight), u[2])?;
        Some(plan.near_part(near, &exit, &sample, (step.place - point.place).as_vec3(), tally))
    };
    (0..count).filter_map(&mut one).fold(Rgb::BLACK, |sum, part| sum + part) * (1.0 / count as f32)
}
