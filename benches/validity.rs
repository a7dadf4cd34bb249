//! How wrong each model is on plane half spaces, slabs and balls: a pencil beam enters along the normal, and what comes
//! out is compared with paths through the medium, ring by ring. Prints the table `src/bssrdf/expected.csv`; docs/models.md has
//! the method. `MARMOR_BENCH_PATHS` (100000) sets the paths a shape, `MARMOR_BENCH_ONLY` picks rows by their first words,
//! `MARMOR_BENCH_ALBEDO` by their reduced albedo.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)] // a bench that cannot run says so by stopping

#[path = "../tests/support/pencils.rs"]
mod pencils;

use marmor::bssrdf::{Bssrdf, Entry, Exit, ModelName, ModelOption, ModelOptions};
use marmor::math::{Rgb, Vec3};
use marmor::optics::{FresnelMoments, Medium};
use pencils::{Body, Shape, Sum};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Rings: six to a decade from 0.1 to 100 transport mean free paths, and what is left on both sides.
const RINGS: usize = 20;

fn ring(r: f32) -> usize {
    if r < 0.1 { 0 } else { (1.0 + 6.0 * (r / 0.1).log10()).min(RINGS as f32 - 1.0) as usize }
}

fn ring_end(i: usize) -> f64 {
    if i + 1 == RINGS { 1e4 } else { 0.1 * 10f64.powf(i as f64 / 6.0) }
}

/// Reduced albedos; with g = 0 all but [`HIGHEST`] come from the same paths.
const ALBEDOS: [f64; 9] = [0.3, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97, 0.99, 0.999];
/// The albedo of these paths.
const TRACED: f64 = 0.9993;
/// Milk and cream. Its light is scattered so often that paths of another albedo tell little of it.
const HIGHEST: f64 = 0.9999;
/// Thicknesses of slabs and radii of balls [transport mean free paths].
const SIZES: [f32; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0];

/// Light by face (near, far), ring and order (0, 1, 2 and more).
type Truth = [[[Sum; 3]; RINGS]; 2];

/// The truth for several albedos from one set of paths: weights times (α / traced)^order.
fn trace(shape: Shape, medium: Medium, factors: &[f64], paths: u64, seed: u64) -> Vec<Truth> {
    let body = Body::new(shape, medium);
    let blocks = 64;
    let empty = || vec![[[[Sum::default(); 3]; RINGS]; 2]; factors.len()];
    let block = |b: u64| {
        let mut truth = empty();
        body.run(b * (paths / blocks)..(b + 1) * (paths / blocks), seed, |out| {
            let ring = ring(if matches!(shape, Shape::Ball { .. }) { out.chord } else { out.r });
            for (truth, factor) in truth.iter_mut().zip(factors) {
                let w = f64::from(out.weight) * factor.powi(out.order as i32);
                truth[usize::from(out.far)][ring][out.order.min(2) as usize].add(w);
            }
        });
        truth
    };
    let join = |mut a: Vec<Truth>, b: Vec<Truth>| {
        for (a, b) in a.iter_mut().flatten().flatten().flatten().zip(b.iter().flatten().flatten().flatten()) {
            a.join(b);
        }
        a
    };
    (0..blocks).into_par_iter().map(block).reduce(empty, join)
}

/// S_d of a pencil beam straight into the body, to the exit at chord or radius r of a face, by a model's own type.
struct Rings {
    shape: Shape,
}

impl Rings {
    /// Exit at distance `r` from the entry: along the plane on a slab, straight on a ball. Entry at 0, normal z.
    fn exit(&self, far: bool, r: f64) -> Exit {
        let (x, n) = match self.shape {
            Shape::Slab { thickness, .. } if far => (Vec3::new(r as f32, 0.0, -thickness), Vec3::NEG_Z),
            Shape::Slab { .. } => (Vec3::new(r as f32, 0.0, 0.0), Vec3::Z),
            Shape::Ball { radius } => {
                let half = (0.5 * r as f32 / radius).min(1.0);
                let along = r as f32 * (1.0 - half * half).sqrt();
                let x = Vec3::new(along, 0.0, -(r as f32) * half);
                (x, (x + Vec3::Z * radius).normalize())
            }
        };
        Exit { x, n, w: n }
    }

    /// Flux through the rings of both faces.
    fn flux(&self, s_d: impl Fn(&Exit) -> f64, exitance: f64) -> [[f64; RINGS]; 2] {
        let largest = match self.shape {
            Shape::Ball { radius } => 2.0 * f64::from(radius),
            Shape::Slab { .. } => f64::INFINITY,
        };
        let mut flux = [[0.0; RINGS]; 2];
        for (face, flux) in flux.iter_mut().enumerate() {
            if face == 1 && matches!(self.shape, Shape::Ball { .. }) {
                break;
            }
            for (i, flux) in flux.iter_mut().enumerate() {
                let (from, to) = (if i == 0 { 0.0 } else { ring_end(i - 1) }, ring_end(i).min(largest));
                if from >= to {
                    break;
                }
                // Midpoints: even in the area of the first ring, even in ln r beyond.
                let steps = if i + 1 == RINGS { 60 } else { 12 };
                for k in 0..steps {
                    let at = (f64::from(k) + 0.5) / f64::from(steps);
                    let (r, area) = if i == 0 {
                        (to * at, 2.0 * PI * to * at * to / f64::from(steps))
                    } else {
                        let r = from * (to / from).powf(at);
                        (r, 2.0 * PI * r * r * (to / from).ln() / f64::from(steps))
                    };
                    // The ring of chord r on a sphere has the area of that on a plane.
                    *flux += area * exitance * s_d(&self.exit(face == 1, r));
                }
            }
        }
        flux
    }
}

/// Heads of columns, and the models below them.
fn variants() -> impl Iterator<Item = (&'static str, ModelName, ModelOptions)> {
    ModelName::models().flat_map(|name| {
        let variants = if name.takes(ModelOption::Calibrated) { vec![false, true] } else { vec![false] };
        variants.into_iter().map(move |calibrated| {
            let options = ModelOptions { calibrated, ..ModelOptions::DEFAULT };
            (name.evidence(&options).unwrap_or(name.name()), name, options)
        })
    })
}

/// In the order of the columns.
fn models(shape: Shape, medium: &Medium) -> Vec<Option<Box<dyn Bssrdf>>> {
    let thickness = match shape {
        Shape::Slab { thickness, half_width } if thickness < half_width => Some(thickness),
        Shape::Slab { .. } => None,
        Shape::Ball { radius } => Some(2.0 * radius),
    };
    variants().map(|(_, name, options)| name.build(medium, &ModelOptions { thickness, ..options }).ok()).collect()
}

fn report(head: &str, shape: Shape, medium: &Medium, truth: &Truth, paths: f64) {
    let exitance = PI * FresnelMoments::new(medium.eta.into()).four_c_phi_outside;
    let all: f64 = truth.iter().flatten().flatten().map(|s| s.mean(paths).0).sum();
    let straight: f64 = truth.iter().flatten().map(|ring| ring[0].mean(paths).0).sum();
    let (rings, mut row, mut largest) = (Rings { shape }, String::new(), 0.0_f64);
    let mut far_row = String::new();
    // Light that leaves far from its entry: by the far face, on the other half of a ball, beyond ten free paths.
    let far = |face: usize, i: usize| match shape {
        Shape::Slab { thickness, half_width } if thickness < half_width => face == 1,
        Shape::Slab { .. } => i > 0 && ring_end(i - 1) > 9.9,
        Shape::Ball { radius } => i > 0 && ring_end(i - 1) > 1.35 * f64::from(radius),
    };
    let places = || (0..2).flat_map(|face| (0..RINGS).map(move |i| (face, i))).filter(|&(face, i)| far(face, i));
    let far_truth = places().flat_map(|(face, i)| truth[face][i]).map(|s| s.mean(paths));
    let (far_flux, far_variance) = far_truth.fold((0.0, 0.0), |(f, v), (flux, error)| (f + flux, v + error * error));
    // Of too little light nothing is said.
    let far_known = far_variance.sqrt() < 0.1 * far_flux;
    for model in models(shape, medium) {
        let Some(model) = model else {
            row += ",,";
            far_row += ",";
            continue;
        };
        let entry = Entry { x: Vec3::ZERO, n: Vec3::Z, w: Vec3::NEG_Z };
        let flux = rings.flux(|exit| f64::from(model.eval(&entry, exit)[0]), exitance);
        let (first, held) = (model.claims().first_order, model.claims().unscattered);
        // What comes through straight stands beside models that leave it out, and those of half spaces have it somewhere.
        let (mut wrong, mut total, mut variance) = if held { (straight, -straight, 0.0) } else { (0.0, 0.0, 0.0) };
        for (flux, truth) in flux.iter().flatten().zip(truth.iter().flatten()) {
            let [_, one, more] = truth.map(|s| s.mean(paths));
            // Exact single scattering stands beside models that leave it out.
            let difference = flux - more.0 - if first { one.0 } else { 0.0 };
            wrong += difference.abs();
            total += difference;
            variance += more.1.powi(2) + if first { one.1.powi(2) } else { 0.0 };
        }
        row += &format!(",{:.3},{:.3}", total / all, wrong / all);
        largest = largest.max(variance.sqrt() / all);
        let beside = |order: usize, held: bool, (face, i): (usize, usize)| {
            if held { 0.0 } else { truth[face][i][order].mean(paths).0 }
        };
        let far_model: f64 = places().map(|at| flux[at.0][at.1] + beside(0, held, at) + beside(1, first, at)).sum();
        far_row += &if far_known { format!(",{:.3}", far_model / far_flux - 1.0) } else { ",".into() };
    }
    println!("{head},{largest:.3}{row}{far_row}");
}

fn main() {
    let set = |name: &str| std::env::var(name).ok();
    let paths: u64 = set("MARMOR_BENCH_PATHS").and_then(|n| n.parse().ok()).unwrap_or(100_000);
    let only = set("MARMOR_BENCH_ONLY").unwrap_or_default();
    let albedo = set("MARMOR_BENCH_ALBEDO").and_then(|a| a.parse::<f64>().ok());
    let wanted = |a: f64| albedo.is_none_or(|asked| asked == a);
    let mut shapes = vec![("half", 0.0, Shape::Slab { thickness: 400.0, half_width: 400.0 })];
    shapes.extend(SIZES.map(|h| ("slab", h, Shape::Slab { thickness: h, half_width: 400.0 })));
    shapes.extend(SIZES.map(|r| ("ball", r, Shape::Ball { radius: r })));
    let columns: String = variants().map(|(n, ..)| format!(",{n}_total,{n}_l1")).collect();
    let far: String = variants().map(|(n, ..)| format!(",{n}_far")).collect();
    println!("eta,g,shape,size,alpha_prime,standard_error{columns}{far}");
    let medium = |albedo: f64, g: f64, eta: f64| {
        // σ_t′ = 1: σ_t (1 - α g) = 1.
        let sigma_t = 1.0 / (1.0 - albedo * g);
        let (s, a) = (albedo * sigma_t, (1.0 - albedo) * sigma_t);
        Medium::unreduced(Rgb::splat(s as f32), Rgb::splat(a as f32), g, eta as f32).unwrap()
    };
    for (eta, g) in [(1.3, 0.0), (1.3, 0.8), (1.5, 0.0), (1.0, 0.0)] {
        for &(name, size, shape) in &shapes {
            let head = format!("{eta},{g},{name},{size}");
            if !head.starts_with(&only) {
                continue;
            }
            let seed = size as u64 * 100 + (eta * 10.0) as u64;
            if g == 0.0 && albedo != Some(HIGHEST) {
                let factors = ALBEDOS.map(|a| a / TRACED);
                let truths = trace(shape, medium(TRACED, g, eta), &factors, paths, seed);
                for (albedo, truth) in ALBEDOS.iter().zip(&truths).filter(|(a, _)| wanted(**a)) {
                    report(&format!("{head},{albedo}"), shape, &medium(*albedo, g, eta), truth, paths as f64);
                }
            }
            let own_paths: &[f64] = if g == 0.0 { &[HIGHEST] } else { &[0.5, 0.7, 0.9, 0.97, 0.99, 0.999, HIGHEST] };
            for &alpha_prime in own_paths.iter().filter(|a| wanted(**a)) {
                // α′ = α (1 - g) / (1 - α g).
                let medium = medium(alpha_prime / (1.0 - g + alpha_prime * g), g, eta);
                let truth = trace(shape, medium, &[1.0], paths / 2, seed);
                report(&format!("{head},{alpha_prime}"), shape, &medium, &truth[0], (paths / 2) as f64);
            }
        }
    }
}
