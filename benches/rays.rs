//! Rays per second of every backend of this build, one thread: primary, diffuse bounce, shadow and ambient occlusion rays,
//! alone and in batches; time and memory of the trees.
//!
//!     cargo bench --features embree --bench rays
//!     MARMOR_BENCH_OBJ=mesh.obj cargo bench --features embree --bench rays
//!     MARMOR_BENCH_RINGS=1000 cargo bench --features embree --bench rays     # four million triangles
//!
//! Without a file the mesh is a sphere with bumps of 133 rings, about 70 000 triangles; their number goes with the square
//! of the rings. The last lines are measured in turns, so that a busy machine slows all alike; `-- --quick` skips what
//! comes before them. `RAYON_NUM_THREADS` bounds the threads that build.
#![allow(clippy::print_stdout, clippy::unwrap_used)] // a benchmark prints, and stops at what it cannot read

#[path = "../tests/contract_backends/scenes.rs"]
#[allow(dead_code)] // the tests use the rest
mod scenes;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput};
use marmor::geometry::Mesh;
use marmor::math::{DVec3, Vec3};
use marmor::query::{self, Backend, Ray, RayQuery};
use marmor::sampling::cosine_hemisphere;
use scenes::{PathSampler, bumpy_sphere};

/// Rays that are handed over together, as the renderer does with those of a tile.
const BATCH: usize = 1024;

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

    /// The same in batches.
    fn run_batches(&self, query: &dyn RayQuery) -> usize {
        let (mut hits, mut occluded) = ([None; BATCH], [false; BATCH]);
        let batches = self.rays.chunks(BATCH);
        if self.any_hit {
            let count = |rays: &[Ray]| {
                query.occluded_batch(rays, &mut occluded[..rays.len()]);
                occluded[..rays.len()].iter().filter(|&&o| o).count()
            };
            batches.map(count).sum()
        } else {
            let count = |rays: &[Ray]| {
                query.closest_batch(rays, &mut hits[..rays.len()]);
                hits[..rays.len()].iter().filter(|h| h.is_some()).count()
            };
            batches.map(count).sum()
        }
    }
}

fn main() {
    let (name, mesh) = mesh();
    let triangles = mesh.triangles.len();
    println!("{name}: {triangles} triangles");
    let backends: Vec<(Backend, Box<dyn RayQuery + '_>)> = Backend::ALL
        .into_iter()
        .filter(|b| b.is_built_in())
        .map(|b| {
            let start = Instant::now();
            let query = query::build(b, &[&mesh]).unwrap();
            let seconds = start.elapsed().as_secs_f64();
            let bytes = query.bytes().unwrap_or_default() as f64 / triangles as f64;
            println!("{}: built in {:.0} ms, {bytes:.0} bytes per triangle", query.description(), seconds * 1e3);
            (b, query)
        })
        .collect();
    let kinds = kinds(&mesh, &*backends[0].1);
    if !std::env::args().any(|a| a == "--quick") {
        alone(&kinds, &backends);
    }
    in_turns(&kinds, &backends);
}

fn alone(kinds: &[Kind], backends: &[(Backend, Box<dyn RayQuery + '_>)]) {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    for kind in kinds {
        let mut group = criterion.benchmark_group(kind.name);
        group.throughput(Throughput::Elements(kind.rays.len() as u64));
        for (backend, query) in backends {
            group.bench_function(BenchmarkId::from_parameter(backend.name()), |b| {
                b.iter(|| black_box(kind.run(&**query)));
            });
        }
        group.finish();
    }
    criterion.final_summary();
}

/// The fastest of several rounds, every backend once in each, single rays and batches.
fn in_turns(kinds: &[Kind], backends: &[(Backend, Box<dyn RayQuery + '_>)]) {
    for kind in kinds {
        let mut best = vec![[f64::INFINITY; 2]; backends.len()];
        for _ in 0..12 {
            for ((_, query), best) in backends.iter().zip(&mut best) {
                let runs: [&dyn Fn() -> usize; 2] = [&|| kind.run(&**query), &|| kind.run_batches(&**query)];
                for (run, best) in runs.into_iter().zip(best) {
                    let start = Instant::now();
                    black_box(run());
                    *best = best.min(start.elapsed().as_secs_f64());
                }
            }
        }
        for ((backend, _), [single, batch]) in backends.iter().zip(&best) {
            let rate = |seconds: f64| kind.rays.len() as f64 / seconds / 1e6;
            let (name, gain) = (backend.name(), single / batch);
            let (single, batch) = (rate(*single), rate(*batch));
            println!("{}: {name} {single:.2} M rays/s, in batches {batch:.2} ({gain:.2} times)", kind.name);
        }
        let find = |wanted| backends.iter().position(|(b, _)| *b == wanted).map(|i| best[i]);
        if let (Some(embree), Some(bvh)) = (find(Backend::Embree), find(Backend::Bvh)) {
            let [single, batch] = [0, 1].map(|i| embree[i] / bvh[i]);
            println!("{}: bvh : embree = {single:.2} : 1, in batches {batch:.2} : 1", kind.name);
        }
    }
}

/// A camera before the mesh, bounces and occlusion rays from what it sees, and shadow rays from there to a lamp above.
fn kinds(mesh: &Mesh, query: &dyn RayQuery) -> Vec<Kind> {
    const SIDE: u32 = 384;
    const SQUARE: u32 = 8;
    let bounds = mesh.bounds().unwrap();
    let (centre, size) = (bounds.centre(), bounds.extent().max_element());
    let eye = centre + DVec3::new(0.3, 0.4, 1.6) * size;
    let forward = (centre - eye).normalize().as_vec3();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    // In squares of eight by eight pixels, as the renderer has them.
    let primary: Vec<Ray> = (0..SIDE * SIDE)
        .map(|i| {
            let (square, i) = (i / (SQUARE * SQUARE), i % (SQUARE * SQUARE));
            let [x, y] =
                [square % (SIDE / SQUARE) * SQUARE + i % SQUARE, square / (SIDE / SQUARE) * SQUARE + i / SQUARE]
                    .map(|k| (k as f32 + 0.5) / SIDE as f32 - 0.5);
            Ray::new(eye, forward + right * (x * 0.8) - up * (y * 0.8))
        })
        .collect();
    let mut draws = PathSampler::new(1);
    let (mut bounce, mut shadow, mut occlusion) = (Vec::new(), Vec::new(), Vec::new());
    for ray in &primary {
        let Some(hit) = query.closest(ray) else { continue };
        let point = mesh.point(hit.triangle, hit.u, hit.v).facing(-ray.direction);
        let mut away = || {
            let w = cosine_hemisphere(point.n_geometric, [draws.unit(), draws.unit()]);
            Ray::new(point.leave(w), w)
        };
        bounce.push(away());
        occlusion.extend([away(), away()]);
        let lamp = centre + Vec3::new(draws.unit() - 0.5, 2.0, draws.unit() - 0.5).as_dvec3() * size;
        shadow.push(Ray::between(point.leave((lamp - point.x).as_vec3()), lamp));
    }
    vec![
        Kind { name: "primary", rays: primary, any_hit: false },
        Kind { name: "diffuse bounce", rays: bounce, any_hit: false },
        Kind { name: "shadow", rays: shadow, any_hit: true },
        Kind { name: "ambient occlusion", rays: occlusion, any_hit: true },
    ]
}

fn mesh() -> (String, Mesh) {
    let rings = std::env::var("MARMOR_BENCH_RINGS").map_or(133, |rings| rings.parse().unwrap());
    match std::env::var("MARMOR_BENCH_OBJ") {
        Ok(path) => (path.clone(), read_triangles(&std::fs::read_to_string(path).unwrap())),
        Err(_) => (format!("sphere with bumps, {rings} rings"), bumpy_sphere(rings)),
    }
}

/// Vertices and faces of an OBJ file, polygons as fans: all that a ray meets.
fn read_triangles(text: &str) -> Mesh {
    let mut mesh = Mesh::default();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let [x, y, z] = std::array::from_fn(|_| words.next().unwrap().parse::<f64>().unwrap());
                mesh.positions.push(DVec3::new(x, y, z));
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
