//! Which light is asked: by power or by the tree. Noise of one sample of irradiance and what it costs, shadow rays with it, on points of a
//! floor and of a body under few and many lamps.
//!
//!     cargo bench --bench lights
//!
//! A line has the relative variance of one sample, its mean over the points (relMSE after one sample; after n samples an n-th), the time of
//! a sample, and how many times less error the tree has than the power in equal time. By turns, so that a busy machine slows both alike.
#![allow(clippy::print_stdout, clippy::unwrap_used)] // a benchmark prints, and stops at what it cannot read

use marmor::geometry::{AreaTable, SurfacePoint};
use marmor::light::{Group, Lights};
use marmor::math::{Vec3, hash, unit_f32};
use marmor::query::{self, Backend};
use marmor::scene::{Scene, SceneFile, View};
use std::fmt::Write;
use std::time::Instant;

const POINTS: u64 = 2048;
const SAMPLES: u64 = 64;
const TURNS: u64 = 4;

fn number(i: u64) -> f32 {
    unit_f32((hash(i.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1) >> 32) as u32)
}

/// A floor, a ball of radius 3 above it, and lamps: squares of half size `half`, the middle of number i at `middle`, looking along `look`.
fn scene(lamps: u64, half: f32, middle: impl Fn(u64) -> [f32; 3], look: impl Fn(u64) -> [f32; 3]) -> Scene {
    let mut text = "unit = \"mm\"\n[camera]\nposition = [0, 30, 50]\nlook_at = [0, 0, 0]\nfov = 40\nresolution = [8, 8]\n\
                    [material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n[material.wax]\ntype = \"translucent\"\nsigma_s_prime = 1\n\
                    sigma_a = 0.01\neta = 1.3\n[material.bright]\ntype = \"emissive\"\nradiance = 30\n[material.dim]\ntype = \"emissive\"\n\
                    radiance = 3\n[[object]]\nname = \"floor\"\nshape = \"rectangle\"\ncentre = [0, -4, 0]\nedge_u = [0, 0, 40]\n\
                    edge_v = [40, 0, 0]\nmaterial = \"grey\"\n[[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 3\n\
                    material = \"wax\"\n"
        .to_string();
    for i in 0..lamps {
        let n = Vec3::from_array(look(i)).normalize();
        let u = n.any_orthonormal_vector();
        let (u, v) = (u * half, n.cross(u) * half);
        let material = if i.is_multiple_of(3) { "dim" } else { "bright" };
        writeln!(
            text,
            "[[object]]\nshape = \"rectangle\"\ncentre = {:?}\nedge_u = {:?}\nedge_v = {:?}\nmaterial = \"{material}\"",
            middle(i),
            u.to_array(),
            v.to_array()
        )
        .unwrap();
    }
    Scene::load(&SceneFile::parse(&text, "bench.toml".as_ref()).unwrap()).unwrap()
}

fn direction(i: u64) -> [f32; 3] {
    let (z, angle) = (1.0 - 2.0 * number(7 * i + 3), std::f32::consts::TAU * number(7 * i + 4));
    let r = (1.0 - z * z).max(0.0).sqrt();
    [r * angle.cos(), z, r * angle.sin()]
}

/// Lamps above the floor, within `wide` of its middle.
fn over_floor(lamps: u64, wide: f32, half: f32) -> Scene {
    let middle = move |i: u64| {
        let [x, y, z] = [0, 1, 2].map(|k| number(11 * i + k));
        [wide * (2.0 * x - 1.0), -3.5 + 2.0 * y, wide * (2.0 * z - 1.0)]
    };
    scene(lamps, half, middle, |_| [0.0, -1.0, 0.0])
}

/// Lamps around the ball that look anywhere.
fn around_ball(lamps: u64, half: f32) -> Scene {
    let middle = |i: u64| direction(i).map(|w| w * (4.0 + 4.0 * number(13 * i)));
    scene(lamps, half, middle, |i| direction(i + 1_000_000))
}

/// Points of the object number `object`; of the floor to where `wide` reaches.
fn points(scene: &Scene, object: usize, wide: f64) -> Vec<SurfacePoint> {
    let mesh = &scene.objects[object].mesh;
    let table = AreaTable::new(mesh).unwrap();
    let point = |i: u64| {
        let sample = table.sample(number(3 * i).into(), [number(3 * i + 1), number(3 * i + 2)]);
        let at = mesh.point(sample.triangle, sample.u, sample.v);
        SurfacePoint { n: at.n_geometric, ..at }
    };
    let inside = |at: &SurfacePoint| (at.x + scene.centre).abs().max_element() < wide;
    (0..).map(point).filter(inside).take(POINTS as usize).collect()
}

/// Sum over the points of the relative variance of a sample, and the seconds that the samples took.
fn measure(view: View<'_>, lights: &Lights, points: &[SurfacePoint], turn: u64) -> (Vec<[f64; 2]>, f64) {
    let start = Instant::now();
    let sums = points.iter().zip(0_u64..).map(|(at, p)| {
        let mut sums = [0.0; 2];
        for s in 0..SAMPLES {
            let key = 3 * (s + SAMPLES * (p + POINTS * turn));
            let u = [0, 1, 2].map(|k| number(key + k));
            let arrival = lights.arrival(view.scene, Group::Near, at, u);
            let open = arrival.filter(|arrival| !view.rays.occluded(&arrival.shadow));
            let value = open.map_or(0.0, |arrival| f64::from(arrival.irradiance.mean()));
            sums = [sums[0] + value, sums[1] + value * value];
        }
        sums
    });
    let sums = sums.collect();
    (sums, start.elapsed().as_secs_f64())
}

fn compare(name: &str, scene: &Scene, object: usize, wide: f64) {
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let view = View { scene, rays: &*rays };
    let points = points(scene, object, wide);
    let start = Instant::now();
    let choices = [usize::MAX, 0].map(|few| Lights::with_few(scene, few));
    let build = start.elapsed().as_secs_f64();
    let mut found = [0, 1].map(|_| (vec![[0.0; 2]; points.len()], 0.0));
    for turn in 0..TURNS {
        for (lights, (sums, seconds)) in choices.iter().zip(&mut found) {
            let (more, took) = measure(view, lights, &points, turn);
            *seconds += took;
            sums.iter_mut().zip(more).for_each(|(sum, more)| *sum = [sum[0] + more[0], sum[1] + more[1]]);
        }
    }
    let n = (SAMPLES * TURNS) as f64;
    // The mean of a point is known best by both together.
    let means: Vec<f64> = found[0].0.iter().zip(&found[1].0).map(|(a, b)| 0.5 * (a[0] + b[0]) / n).collect();
    let whole: f64 = means.iter().sum::<f64>() / means.len() as f64;
    let [power, tree] = found.each_ref().map(|(sums, seconds)| {
        let each = sums.iter().zip(&means).map(|(sum, mean)| {
            let own = sum[0] / n;
            (sum[1] / n - own * own) / (mean * mean + 0.01 * whole * whole)
        });
        (each.sum::<f64>() / means.len() as f64, seconds / (n * means.len() as f64))
    });
    println!(
        "{name}: power {:.3}, {:.2} us; tree {:.3}, {:.2} us; tree {:.2} times better in equal time (both tables {:.1} ms)",
        power.0,
        1e6 * power.1,
        tree.0,
        1e6 * tree.1,
        power.0 * power.1 / (tree.0 * tree.1),
        1e3 * build
    );
}

fn main() {
    for lamps in [2, 3, 4, 6, 8, 12, 16, 32, 100] {
        compare(&format!("{lamps} lamps near, floor"), &over_floor(lamps, 8.0, 0.3), 0, 10.0);
        compare(&format!("{lamps} lamps around, ball"), &around_ball(lamps, 0.3), 1, f64::INFINITY);
    }
    for lamps in [1000, 10_000] {
        compare(&format!("{lamps} lamps over the floor"), &over_floor(lamps, 38.0, 0.1), 0, 40.0);
        compare(&format!("{lamps} lamps around, ball"), &around_ball(lamps, 0.03), 1, f64::INFINITY);
        compare(&format!("{lamps} lamps around, floor"), &around_ball(lamps, 0.03), 0, 40.0);
    }
}
