//! The sample cache, one thread: filling, the lecture's loop, and what every estimator costs and adds in noise at an exit.
//!
//!     cargo bench --features embree --bench cache
//!     MARMOR_BENCH_OBJ=mesh.obj cargo bench --features embree --bench cache
//!
//! A file's mesh is scaled to 100 mm; without a file the mesh is a closed sphere with bumps, 60 mm wide. The lines at the end tell, for each medium, model
//! and number of samples M: time at an exit and noise against the sum over all samples, and the ratio to the lecture's
//! loop, all estimators by turns in one run. Exits are the hits of a camera's tiles, as in a render.
#![allow(clippy::print_stdout, clippy::unwrap_used)] // a benchmark prints, and stops at what it cannot read

mod bumps;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput};
use marmor::bssrdf::{Bssrdf, Exit, ModelName, ModelOptions};
use marmor::cache::{
    Cache, CacheBuilder, CachedBody, Density, Detail, Directions, Envelope, Gatherer, Scratch, Tuning,
};
use marmor::geometry::{AreaTable, load_mesh};
use marmor::light::Lights;
use marmor::math::{DVec3, Rgb, hash};
use marmor::optics::Medium;
use marmor::query::{self, Backend, RayQuery};
use marmor::sampling::{CacheStream, Points};
use marmor::scene::{Estimator, Scene, SceneFile, View};
use marmor::tally::{GatherTally, Tally};

/// Edge of a tile of camera rays, as the renderer has them.
const TILE: u32 = 32;
/// Hits of a tile that the slow loops sum at.
const FEW: usize = 6;
/// Estimates at each hit.
const DRAWS: u64 = 4;

/// The mesh, in skim milk, under a lamp behind it.
fn scene() -> (Scene, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let object = match std::env::var("MARMOR_BENCH_OBJ") {
        Ok(path) => {
            std::fs::copy(&path, folder.path().join("mesh.obj")).unwrap();
            let mesh = load_mesh(path.as_ref()).unwrap();
            let bounds = mesh.bounds().unwrap();
            let scale = 100.0 / bounds.extent().max_element();
            let [x, y, z] = (-scale * bounds.centre()).to_array();
            format!("mesh = \"mesh.obj\"\ntransform = {{ scale = {scale}, translate = [{x}, {y}, {z}] }}\n")
        }
        Err(_) => {
            std::fs::write(folder.path().join("mesh.obj"), bumps::bumps(133)).unwrap();
            "mesh = \"mesh.obj\"\ntransform = { scale = 30 }\n".to_string()
        }
    };
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 5, 320]\nlook_at = [0, 0, 0]\nfov = 22\nresolution = [512, 512]\n\
         [[object]]\nname = \"body\"\nmaterial = \"milk\"\n{object}\
         [[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [0, 150, -120]\nedge_u = [50, 0, 0]\n\
         edge_v = [0, 35, 35]\nmaterial = \"lamp\"\n\
         [material.milk]\ntype = \"translucent\"\npreset = \"skimmilk\"\n\
         [material.lamp]\ntype = \"emissive\"\nradiance = 10\ntwo_sided = true\n"
    );
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    (Scene::load(&SceneFile::read(&path).unwrap()).unwrap(), folder)
}

struct Bench<'a> {
    scene: &'a Scene,
    rays: &'a dyn RayQuery,
    lights: &'a Lights,
    /// Of the body's area table.
    centre: DVec3,
}

impl Bench<'_> {
    fn body(&self, model: Box<dyn Bssrdf>) -> CachedBody {
        CachedBody::new(self.scene, 0, model).unwrap()
    }

    fn fill(&self, body: &CachedBody, count: u32) -> Cache {
        let stream = CacheStream::new(Points::Sobol, 1, 0);
        let builder = CacheBuilder {
            view: View { scene: self.scene, rays: self.rays },
            lights: self.lights,
            body,
            directions: Directions::Lights { cosine_share: 0.0 },
            stream: &stream,
            density: &Density::even(),
        };
        builder.fill(0, count, &mut Tally::default())
    }

    /// Hits of some tiles of the picture, tile by tile.
    fn tiles(&self) -> Vec<Vec<Exit>> {
        let camera = &self.scene.camera;
        let hit = |pixel: [u32; 2]| {
            let ray = camera.ray(pixel, [0.5; 2]);
            let hit = self.rays.closest(&ray).filter(|h| h.mesh == 0)?;
            let p = self.scene.objects[0].mesh.point(hit.triangle, hit.u, hit.v).facing(-ray.direction);
            Some(Exit { x: (p.x - self.centre).as_vec3(), n: p.n_geometric, w: -ray.direction })
        };
        let mut tiles = Vec::new();
        for y in (0..camera.resolution[1] / TILE).step_by(3) {
            for x in (0..camera.resolution[0] / TILE).step_by(3) {
                let pixels = (0..TILE * TILE).map(|i| [x * TILE + i % TILE, y * TILE + i / TILE]);
                let exits: Vec<Exit> = pixels.filter_map(hit).collect();
                if exits.len() > FEW {
                    tiles.push(exits);
                }
            }
        }
        tiles
    }
}

/// One estimator on one cache.
struct Entrant {
    name: String,
    gatherer: Gatherer,
    seconds: f64,
    noise: [f64; 3],
    tally: GatherTally,
}

fn copy(cache: &Cache) -> Cache {
    Cache { lit: cache.lit.clone(), attempted: cache.attempted }
}

/// Time and noise of all estimators on one cache, by turns.
fn compare(bench: &Bench<'_>, medium: (&str, Medium), name: ModelName, count: u32) {
    let thickness = Some(60.0);
    let model = name.build(&medium.1, &ModelOptions { thickness, ..ModelOptions::DEFAULT }).unwrap();
    let envelope = Envelope::new(&*model, &medium.1);
    let body = bench.body(model);
    let (model, cache) = (&*body.model, bench.fill(&body, count));
    let lit = cache.lit.len();
    let start = Instant::now();
    let mut entrants: Vec<Entrant> = Vec::new();
    let entrant = |name: String, gatherer| Entrant {
        name,
        gatherer,
        seconds: f64::INFINITY,
        noise: [0.0; 3],
        tally: GatherTally::default(),
    };
    for error in [0.003, 0.01, 0.03, 0.1] {
        let gatherer = Gatherer::new(Estimator::Cut, copy(&cache), model, Tuning::relative(error));
        entrants.push(entrant(format!("cut {error}"), gatherer));
    }
    let built = start.elapsed().as_secs_f64() / 4.0;
    for estimator in [Estimator::Notes, Estimator::All] {
        let gatherer = Gatherer::new(estimator, copy(&cache), model, Tuning::relative(0.1));
        entrants.push(entrant(estimator.name().to_string(), gatherer));
    }
    let tiles = bench.tiles();
    let few = |tile: &Vec<Exit>| -> Vec<Exit> { tile.iter().step_by(tile.len() / FEW).copied().take(FEW).collect() };
    let mut scratch = Scratch::default();
    let mut out = Vec::new();
    let exact: Vec<Vec<Rgb>> = {
        let all = &entrants.last().unwrap().gatherer;
        let mut tally = GatherTally::default();
        let mut sum = |tile: &Vec<Exit>| {
            let mut out = Vec::new();
            let exits = few(tile);
            all.gather(
                (model, &envelope),
                (&exits, Detail::Fine),
                &vec![0; exits.len()],
                &mut scratch,
                &mut tally,
                &mut out,
            );
            out
        };
        tiles.iter().map(&mut sum).collect()
    };
    let slow = count > 200_000;
    for round in 0..if slow { 1 } else { 3 } {
        for e in &mut entrants {
            let plain = !e.name.starts_with("cut");
            let draws = if plain { 1 } else { DRAWS };
            let (mut squares, mut compared) = ([0.0; 3], 0.0);
            e.tally = GatherTally::default();
            let mut seconds = 0.0;
            for draw in 0..draws {
                for (t, (tile, exact)) in tiles.iter().zip(&exact).enumerate() {
                    let exits = if plain { few(tile) } else { tile.clone() };
                    let key = |i: usize| hash(1 + ((round * DRAWS + draw) * 1000 + t as u64) * 10_000 + i as u64);
                    let keys: Vec<u64> = (0..exits.len()).map(key).collect();
                    let start = Instant::now();
                    e.gatherer.gather(
                        (model, &envelope),
                        (&exits, Detail::Fine),
                        &keys,
                        &mut scratch,
                        &mut e.tally,
                        &mut out,
                    );
                    seconds += start.elapsed().as_secs_f64();
                    let step = exits.len() / FEW;
                    for (value, exact) in out.iter().step_by(step).zip(exact) {
                        for c in 0..3 {
                            squares[c] += (f64::from(value[c]) / f64::from(exact[c]) - 1.0).powi(2);
                        }
                        compared += 1.0;
                    }
                }
            }
            e.seconds = e.seconds.min(seconds / e.tally.exits as f64);
            e.noise = squares.map(|s| (s / compared).sqrt());
        }
    }
    let notes = entrants.iter().find(|e| e.name == "notes").unwrap().seconds;
    println!("{} {} M = {count}, {lit} lit, prepared in {:.2} ms", medium.0, name.name(), built * 1e3);
    for e in &entrants {
        let per_exit = |n: u64| n as f64 / e.tally.exits as f64;
        let [r, g, b] = e.noise.map(|n| n * 100.0);
        println!(
            "    {:9} {:10.2} us an exit, noise {r:6.2} {g:6.2} {b:6.2} %, {:7.1} nodes, {:8.1} evaluations, notes : this = {:.1} : 1",
            e.name,
            e.seconds * 1e6,
            per_exit(e.tally.nodes),
            per_exit(e.tally.evaluated),
            notes / e.seconds
        );
    }
}

fn medium(name: &str) -> (&str, Medium) {
    // Per mm, reduced [JMLH01].
    let (s, a) = match name {
        "skimmilk" => ([0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142]),
        "wholemilk" => ([2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
        "marble" => ([2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071]),
        _ => ([0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    };
    (name, Medium::reduced(Rgb(s), Rgb(a), 1.3).unwrap())
}

fn main() {
    let (scene, _folder) = scene();
    let meshes: Vec<_> = scene.objects.iter().map(|o| &o.mesh).collect();
    let rays = query::build(Backend::preferred(), &meshes).unwrap();
    let lights = Lights::new(&scene);
    let centre = AreaTable::new(&scene.objects[0].mesh).unwrap().centre();
    let bench = Bench { scene: &scene, rays: &*rays, lights: &lights, centre };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        if std::env::var_os("MARMOR_BENCH_TABLE_ONLY").is_none() {
            timed(&bench);
        }
        let largest = std::env::var("MARMOR_BENCH_M").ok().and_then(|m| m.parse().ok()).unwrap_or(100_000);
        for count in [10_000, 100_000, 1_000_000].into_iter().filter(|c| *c <= largest) {
            for name in ["skimmilk", "marble", "skin1"] {
                compare(&bench, medium(name), ModelName::STANDARD, count);
            }
        }
        for name in [ModelName::BETTER, ModelName::NORMALISED, ModelName::BEAM, ModelName::DIRECTIONAL] {
            compare(&bench, medium("skimmilk"), name, 10_000);
        }
    });
}

/// Rates of filling and of the plain loop.
fn timed(bench: &Bench<'_>) {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .configure_from_args();
    let (_, milk) = medium("skimmilk");
    let model = ModelName::STANDARD.build(&milk, &ModelOptions::DEFAULT).unwrap();
    let envelope = Envelope::new(&*model, &milk);
    let body = bench.body(model);
    let model = &*body.model;
    let mut group = criterion.benchmark_group("cache");
    group.throughput(Throughput::Elements(10_000));
    group.bench_function("fill, samples", |b| b.iter(|| black_box(bench.fill(&body, 10_000))));
    let cache = bench.fill(&body, 10_000);
    let exit = bench.tiles()[0][0];
    let mut out = Vec::new();
    let mut scratch = Scratch::default();
    let mut tally = GatherTally::default();
    group.throughput(Throughput::Elements(cache.lit.len() as u64));
    for estimator in [Estimator::Notes, Estimator::All] {
        let gatherer = Gatherer::new(estimator, copy(&cache), model, Tuning::relative(0.1));
        let mut key = 0;
        group.bench_function(format!("{}, pairs", estimator.name()), |b| {
            b.iter(|| {
                key += 1;
                gatherer.gather(
                    (model, &envelope),
                    (&[exit], Detail::Fine),
                    &[hash(key)],
                    &mut scratch,
                    &mut tally,
                    &mut out,
                );
                black_box(out[0])
            });
        });
    }
    group.throughput(Throughput::Elements(cache.lit.len() as u64));
    group.bench_function("plain loop, S_d", |b| {
        b.iter(|| {
            let mut sum = Rgb::BLACK;
            for sample in &cache.lit {
                sum += model.radial().unwrap().eval(&sample.entry, &exit) * sample.flux;
            }
            black_box(sum)
        });
    });
    group.finish();
    criterion.final_summary();
}
