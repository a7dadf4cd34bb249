//! Rays per second of every backend of this build, one thread: primary, diffuse bounce and shadow rays.
//!
//!     cargo bench --features embree --bench rays
//!     MARMOR_BENCH_OBJ=mesh.obj cargo bench --features embree --bench rays
//!
//! Without a file the mesh is a sphere with bumps of about 70 000 triangles. With both backends the last lines give their
//! ratio, measured in turns so that a busy machine slows both.
#![allow(clippy::print_stdout, clippy::unwrap_used)] // a benchmark prints, and stops at what it cannot read

#[path = "../tests/contract_backends/scenes.rs"]
#[allow(dead_code)] // the tests use the rest
mod scenes;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput};
use marmor::geometry::Mesh;
use marmor::math::Vec3;
use marmor::query::{self, Backend, Ray, RayQuery};
use marmor::sampling::cosine_hemisphere;
use scenes::{Draws, bumpy_sphere};

/// Rays of one kind, and what is asked of them.
struct Kind {
    name: &'static str,
    rays: Vec<Ray>,
    any_hit: bool,
}

impl Kind {
    /// Asks every ray once; the number of hits keeps the compiler from leaving anything out.
    fn run(&self, query: &dyn RayQuery) -> usize {
        if self.any_hit {
            self.rays.iter().filter(|r| query.occluded(r)).count()
        } else {
            self.rays.iter().filter(|r| query.closest(r).is_some()).count()
        }
    }
}

fn main() {
    let (name, mesh) = mesh();
    let backends: Vec<(Backend, Box<dyn RayQuery + '_>)> = Backend::ALL
        .into_iter()
        .filter(|b| b.is_built_in())
        .map(|b| {
            let start = Instant::now();
            let query = query::build(b, &[&mesh]).unwrap();
            println!("{}: built in {:.0} ms", query.description(), start.elapsed().as_secs_f64() * 1e3);
            (b, query)
        })
        .collect();
    let kinds = kinds(&mesh, &*backends[0].1);
    println!("{name}: {} triangles", mesh.triangles.len());

    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    for kind in &kinds {
        let mut group = criterion.benchmark_group(kind.name);
        group.throughput(Throughput::Elements(kind.rays.len() as u64));
        for (backend, query) in &backends {
            group.bench_function(BenchmarkId::from_parameter(backend.name()), |b| {
                b.iter(|| black_box(kind.run(&**query)));
            });
        }
        group.finish();
    }
    criterion.final_summary();

    let find = |wanted| backends.iter().find(|(b, _)| *b == wanted).map(|(_, q)| &**q);
    if let (Some(embree), Some(bvh)) = (find(Backend::Embree), find(Backend::Bvh)) {
        for kind in &kinds {
            let [e, b] = in_turns(kind, [embree, bvh]);
            let rate = |seconds: f64| kind.rays.len() as f64 / seconds / 1e6;
            println!(
                "{}: embree {:.2} M rays/s, bvh {:.2} M rays/s, embree : bvh = {:.2} : 1",
                kind.name,
                rate(e),
                rate(b),
                b / e
            );
        }
    }
}

/// Seconds of the fastest of several rounds, the backends by turns in each.
fn in_turns(kind: &Kind, queries: [&dyn RayQuery; 2]) -> [f64; 2] {
    let mut best = [f64::INFINITY; 2];
    for _ in 0..12 {
        for (best, query) in best.iter_mut().zip(queries) {
            let start = Instant::now();
            black_box(kind.run(query));
            *best = best.min(start.elapsed().as_secs_f64());
        }
    }
    best
}

/// A camera before the mesh, bounces from what it sees, and shadow rays from there to a lamp above.
fn kinds(mesh: &Mesh, query: &dyn RayQuery) -> Vec<Kind> {
    const SIDE: u32 = 384;
    let (lower, upper) = mesh.bounds().unwrap();
    let (centre, size) = ((lower + upper) * 0.5, (upper - lower).max_element());
    let eye = centre + Vec3::new(0.3, 0.4, 1.6) * size;
    let forward = (centre - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let primary: Vec<Ray> = (0..SIDE * SIDE)
        .map(|i| {
            let [x, y] = [i % SIDE, i / SIDE].map(|k| (k as f32 + 0.5) / SIDE as f32 - 0.5);
            Ray::new(eye, forward + right * (x * 0.8) - up * (y * 0.8))
        })
        .collect();
    let mut draws = Draws::new(1);
    let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
    for ray in &primary {
        let Some(hit) = query.closest(ray) else { continue };
        let point = mesh.point(hit.triangle, hit.u, hit.v).facing(-ray.direction);
        let away = cosine_hemisphere(point.n_geometric, [draws.unit(), draws.unit()]);
        bounce.push(Ray::new(point.leave(away), away));
        let lamp = centre + Vec3::new(draws.unit() - 0.5, 2.0, draws.unit() - 0.5) * size;
        shadow.push(Ray::between(point.leave(lamp - point.x), lamp));
    }
    vec![
        Kind { name: "primary", rays: primary, any_hit: false },
        Kind { name: "diffuse bounce", rays: bounce, any_hit: false },
        Kind { name: "shadow", rays: shadow, any_hit: true },
    ]
}

fn mesh() -> (String, Mesh) {
    match std::env::var("MARMOR_BENCH_OBJ") {
        Ok(path) => (path.clone(), read_triangles(&std::fs::read_to_string(path).unwrap())),
        Err(_) => ("sphere with bumps".to_string(), bumpy_sphere(133)),
    }
}

/// Vertices and faces of an OBJ file, polygons as fans: all that a ray meets.
fn read_triangles(text: &str) -> Mesh {
    let mut mesh = Mesh::default();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let [x, y, z] = std::array::from_fn(|_| words.next().unwrap().parse::<f32>().unwrap());
                mesh.positions.push(Vec3::new(x, y, z));
            }
            Some("f") => {
                let corner = |word: &str| {
                    let index: i64 = word.split('/').next().unwrap().parse().unwrap();
                    (if index < 0 { mesh.positions.len() as i64 + index } else { index - 1 }) as u32
                };
                let corners: Vec<u32> = words.map(corner).collect();
                mesh.triangles.extend((2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]));
            }
            _ => {}
        }
    }
    mesh
}
