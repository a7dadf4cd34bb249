//! `volume_path` against a second Monte Carlo program that shares nothing with it: a ball and a slab, seen from several sides,
//! by order of scattering and by channel.
#![allow(clippy::unwrap_used)] // a scene of this file that does not render has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod monte_carlo;
#[path = "../parts/mod.rs"]
mod parts;
#[path = "../rendering/mod.rs"]
mod rendering;

use marmor::integrator::{VolumePath, VolumePathOptions};
use marmor::query::Backend;
use marmor::scene::{Orders, Scene};
use monte_carlo::{Light, Medium, Random, Vector, along, ball, cross, slab, unit};
use rayon::prelude::*;
use rendering::on;
use std::path::Path;

/// Renders of each view with seeds of their own, and as many parts of the walks.
const BATCHES: usize = 12;

/// Three media, one in each channel, with the same g and η.
struct Media {
    sigma_s: [f64; 3],
    sigma_a: [f64; 3],
    g: f64,
    eta: f64,
}

impl Media {
    fn channel(&self, c: usize) -> Medium {
        Medium { sigma_s: self.sigma_s[c], sigma_a: self.sigma_a[c], g: self.g, eta: self.eta }
    }

    fn text(&self) -> String {
        let Self { sigma_s, sigma_a, g, eta } = self;
        format!("sigma_s = {sigma_s:?}\nsigma_a = {sigma_a:?}\ng = {g:?}\neta = {eta:?}")
    }
}

/// A square picture about the origin, and the sets of pixels whose means are compared.
struct Sight {
    name: &'static str,
    from: Vector,
    fov: f64,
    side: u32,
    sets: Vec<Vec<[u32; 2]>>,
}

impl Sight {
    /// Rings of the ball of radius 1, each of them on it.
    fn rings(name: &'static str, from: Vector) -> Self {
        let (side, fov) = (24, 19.5_f64);
        let distance = monte_carlo::dot(from, from).sqrt();
        // The ball's outline, in half pictures.
        let outline = (1.0 / distance).asin().tan() / (0.5 * fov).to_radians().tan();
        let pixels = (0..side * side).map(|i| [i % side, i / side]);
        let mut sets = vec![Vec::new(); 5];
        for pixel in pixels {
            let offset = pixel.map(|p| ((f64::from(p) + 0.5) / f64::from(side) * 2.0 - 1.0).abs());
            let farthest = (offset[0] + 1.0 / f64::from(side)).hypot(offset[1] + 1.0 / f64::from(side));
            if farthest < outline {
                sets[(offset[0].hypot(offset[1]) / outline * 5.0) as usize].push(pixel);
            }
        }
        Self { name, from, fov, side, sets }
    }

    /// A point of a plane: the whole picture.
    fn point(name: &'static str, from: Vector) -> Self {
        let side = 8;
        Self { name, from, fov: 0.4, side, sets: vec![(0..side * side).map(|i| [i % side, i / side]).collect()] }
    }

    fn text(&self) -> String {
        parts::camera(self.from, [0.0; 3], self.fov, [self.side; 2])
    }

    /// A ray through the pixel, at a place of it that is drawn.
    fn ray(&self, pixel: [u32; 2], random: &mut Random) -> Vector {
        let forward = unit(along([0.0; 3], -1.0, self.from));
        let right = unit(cross(forward, [0.0, 1.0, 0.0]));
        let up = cross(right, forward);
        let half = (0.5 * self.fov).to_radians().tan();
        let mut at = |p: u32| half * ((f64::from(p) + random.number()) / f64::from(self.side) * 2.0 - 1.0);
        let (x, y) = (at(pixel[0]), at(pixel[1]));
        unit(along(along(forward, x, right), -y, up))
    }
}

/// A body in three media under a lamp.
struct Case {
    name: &'static str,
    media: Media,
    light: Light,
    sights: Vec<Sight>,
    /// Of the slab; the ball has none.
    depth: Option<f64>,
    /// Passes of each render, by order, and walks in a batch for each set of pixels.
    passes: [u32; 3],
    photons: u32,
    walks: usize,
}

/// Thickness of the slab.
const DEPTH: f64 = 1.5;
/// Half edge of the slab's faces.
const WIDE: f64 = 12.0;

/// Means of one batch: by view, set of pixels, channel and order, in that order.
type Batch = Vec<f64>;

impl Case {
    fn text(&self, sight: &Sight) -> String {
        let light = match self.light {
            Light::Sky => parts::sky(1.0),
            Light::Lamp { centre, edges: [u, v], .. } => {
                parts::rectangle("lamp", centre, u, v, "lamp") + &parts::emissive("lamp", 1.0)
            }
        };
        let body = match self.depth {
            Some(_) => parts::mesh("slab", "slab.obj", "m"),
            None => parts::sphere("ball", [0.0; 3], 1.0, 96, "m"),
        };
        sight.text() + &body + &parts::translucent("m", &self.media.text()) + &light
    }

    /// By one method for all views, which differ in the camera alone; seeds and passes are each batch's own.
    fn rendered(&self, folder: &Path) -> Vec<Batch> {
        let scenes: Vec<Scene> =
            self.sights.iter().map(|sight| rendering::load_in(folder, &self.text(sight))).collect();
        let orders = [Orders::None, Orders::Single, Orders::Multiple];
        let methods = orders.map(|orders| {
            let options = VolumePathOptions { orders, photons: self.photons, specular: true, seed: 1 };
            VolumePath::new(&scenes[0], options).unwrap()
        });
        let batch = |batch: u32| {
            let mut means = Vec::new();
            for (sight, scene) in self.sights.iter().zip(&scenes) {
                let images = [0, 1, 2].map(|order| {
                    let n = self.passes[order];
                    let passes = n * batch..n * (batch + 1);
                    let (film, _) = on(Backend::preferred(), scene, &methods[order], 1 + u64::from(batch), passes);
                    film.image()
                });
                for set in &sight.sets {
                    for c in 0..3 {
                        for image in &images {
                            let at = |p: &[u32; 2]| f64::from(image.pixels[(p[1] * sight.side + p[0]) as usize][c]);
                            means.push(set.iter().map(at).sum::<f64>() / set.len() as f64);
                        }
                    }
                }
            }
            means
        };
        (0..BATCHES as u32).into_par_iter().map(batch).collect()
    }

    fn walked(&self, batch: usize) -> Batch {
        let mut means = Vec::new();
        for (s, sight) in self.sights.iter().enumerate() {
            for (k, set) in sight.sets.iter().enumerate() {
                for c in 0..3 {
                    let mut random = Random::new(((batch * 8 + s) * 8 + k) as u64 * 8 + c as u64 + 1);
                    let (medium, mut sum) = (self.media.channel(c), [0.0; 3]);
                    for i in 0..self.walks {
                        let w = sight.ray(set[i % set.len()], &mut random);
                        let found = match self.depth {
                            Some(depth) => slab(&medium, depth, &self.light, w, &mut random),
                            None => ball(&medium, &self.light, sight.from, w, &mut random),
                        };
                        (0..3).for_each(|order| sum[order] += found[order]);
                    }
                    means.extend(sum.map(|s| s / self.walks as f64));
                }
            }
        }
        means
    }

    /// Every comparison of the case.
    fn run(&self) -> Vec<Cell> {
        let folder = tempfile::tempdir().unwrap();
        if let Some(depth) = self.depth {
            let slab = parts::cuboid([-WIDE, -WIDE, -depth], [WIDE, WIDE, 0.0]);
            std::fs::write(folder.path().join("slab.obj"), slab).unwrap();
        }
        let start = std::time::Instant::now();
        let rendered = self.rendered(folder.path());
        let between = start.elapsed();
        let walked: Vec<Batch> = (0..BATCHES).into_par_iter().map(|batch| self.walked(batch)).collect();
        println!("{}: rendered in {between:.1?}, walked in {:.1?}", self.name, start.elapsed() - between);
        let names = self.sights.iter().flat_map(|sight| {
            (0..sight.sets.len())
                .flat_map(move |k| (0..3).flat_map(move |c| (0..3).map(move |order| (sight.name, k, c, order))))
        });
        let cells = names.enumerate().map(|(i, (sight, ring, channel, order))| {
            let of = |batches: &[Batch]| batches.iter().map(|batch| batch[i]).collect();
            Cell { case: self.name, sight, ring, channel, order, rendered: of(&rendered), walked: of(&walked) }
        });
        cells.collect()
    }
}

/// One mean radiance by both programs, batch by batch.
struct Cell {
    case: &'static str,
    sight: &'static str,
    ring: usize,
    channel: usize,
    order: usize,
    rendered: Batch,
    walked: Batch,
}

/// Means that are known to this share are held to 3 standard errors.
const KNOWN: f64 = 0.004;

/// Facets of the mesh and rounding to f32, as a share.
const MESH: f64 = 5e-4;

impl Cell {
    /// Whether both have light enough for a normal law.
    fn is_known(&self) -> bool {
        [&self.rendered, &self.walked].iter().all(|batches| {
            let (mean, error) = mean_of(batches);
            error < 0.1 * mean
        })
    }

    fn name(&self) -> String {
        format!("{}, {}, ring {}, channel {}, order {}", self.case, self.sight, self.ring, self.channel, self.order)
    }

    /// Difference in standard errors, as of a normal law.
    fn z(&self) -> f64 {
        z(&self.rendered, &self.walked)
    }
}

fn mean_of(batches: &[f64]) -> (f64, f64) {
    rendering::mean_of(batches.iter().copied())
}

/// Difference of the means over its standard error, by Welch's degrees of freedom \[Wel47\] the normal deviate of the same chance
/// (Wallace's approximation).
fn z(a: &[f64], b: &[f64]) -> f64 {
    let ((a, of_a), (b, of_b)) = (mean_of(a), mean_of(b));
    let n = (BATCHES - 1) as f64;
    let square = of_a.powi(2) + of_b.powi(2) + (MESH * b).powi(2);
    let freedom = n * square.powi(2) / (of_a.powi(4) + of_b.powi(4));
    let t = (a - b) / square.sqrt();
    t.signum() * (freedom * (t * t / freedom).ln_1p()).sqrt() * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)
}

/// Normal deviate that the largest of `n` exceeds by chance once in 1000 times, by Sidak.
fn bound(n: usize) -> f64 {
    // Two tails: 1 - 0.999^(1/n) = sqrt(2/pi) / z (1 - 1/z^2 + 3/z^4) exp(-z^2/2).
    let chance = 1.0 - 0.999_f64.powf(1.0 / n as f64);
    let tails =
        |z: f64| (2.0 / std::f64::consts::PI).sqrt() / z * (1.0 - z.powi(-2) + 3.0 * z.powi(-4)) * (-z * z / 2.0).exp();
    let (mut low, mut high) = (2.5, 8.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        (low, high) = if tails(middle) > chance { (middle, high) } else { (low, middle) };
    }
    low
}

/// Sum over cells of rendered over that of walked, its standard error, and the difference from 1 in standard errors. So what is bright,
/// and known best, counts most.
fn ratio(cells: &[&Cell]) -> (f64, f64, f64) {
    let sums = |of: fn(&Cell) -> &Batch| -> Batch {
        (0..BATCHES).map(|batch| cells.iter().map(|cell| of(cell)[batch]).sum()).collect()
    };
    let (rendered, walked) = (sums(|cell| &cell.rendered), sums(|cell| &cell.walked));
    let ((a, of_a), (b, of_b)) = (mean_of(&rendered), mean_of(&walked));
    (a / b, of_a.hypot(of_b) / b, z(&rendered, &walked))
}

fn balls(name: &'static str, media: Media) -> Case {
    let light =
        Light::Lamp { centre: [0.0, 0.0, 2.0], edges: [[0.0, 2.2, 0.0], [2.2, 0.0, 0.0]], normal: [0.0, 0.0, -1.0] };
    let at = |degrees: f64| [6.0 * degrees.to_radians().sin(), 0.0, 6.0 * degrees.to_radians().cos()];
    let sights = [("front", 60.0), ("side", 100.0), ("behind", 150.0)];
    let sights = sights.map(|(name, degrees)| Sight::rings(name, at(degrees))).into();
    Case { name, media, light, sights, depth: None, photons: 256, passes: [4, 6, 8], walks: 3_000 }
}

/// Dense media that are much alike, seen from where the lamp is: most of the light is the photons'.
fn dense(name: &'static str) -> Case {
    let media = Media { sigma_s: [10.0, 11.0, 12.0], sigma_a: [0.1, 0.2, 0.3], g: 0.0, eta: 1.4 };
    let mut case = balls(name, media);
    case.sights.truncate(1);
    Case { photons: 2048, passes: [8, 2, 48], walks: 10_000, ..case }
}

/// Light from all around, which every path meets: what a factor is wrong by is seen best.
fn balls_in_the_open(name: &'static str, media: Media) -> Case {
    let sights = vec![Sight::rings("anywhere", [6.0, 0.0, 0.0])];
    Case { name, media, light: Light::Sky, sights, depth: None, photons: 256, passes: [8, 16, 24], walks: 6_000 }
}

fn slabs(name: &'static str, media: Media) -> Case {
    let (sin, cos) = 35.0_f64.to_radians().sin_cos();
    let light = Light::Lamp {
        centre: [1000.0 * sin, 0.0, 1000.0 * cos],
        edges: [[0.0, 700.0, 0.0], [700.0 * cos, 0.0, -700.0 * sin]],
        normal: [-sin, 0.0, -cos],
    };
    let at = |degrees: f64| [-40.0 * degrees.to_radians().sin(), 0.0, 40.0 * degrees.to_radians().cos()];
    let sights =
        [("above, 0", 1.0), ("above, 35", 35.0), ("above, 65", 65.0), ("below, 20", 160.0), ("below, 60", 120.0)];
    let sights = sights.map(|(name, degrees)| Sight::point(name, at(degrees))).into();
    Case { name, media, light, sights, depth: Some(DEPTH), photons: 256, passes: [8, 64, 16], walks: 2_500 }
}

#[test]
fn paths_are_those_of_a_second_program() {
    let isotropic = || Media { sigma_s: [2.0, 4.5, 8.0], sigma_a: [0.4, 0.15, 0.05], g: 0.0, eta: 1.35 };
    let forward = || Media { sigma_s: [6.0, 15.0, 25.0], sigma_a: [0.5, 0.2, 0.1], g: 0.8, eta: 1.5 };
    let cases = [
        balls("ball, g = 0", isotropic()),
        balls("ball, g = 0.8", forward()),
        dense("dense"),
        balls_in_the_open("sky, g = 0", isotropic()),
        balls_in_the_open("sky, g = 0.8", forward()),
        slabs("slab, g = 0", isotropic()),
        slabs("slab, g = 0.8", forward()),
    ];
    let all: Vec<Cell> = cases.iter().flat_map(Case::run).collect();
    let cells: Vec<&Cell> = all.iter().filter(|cell| cell.is_known()).collect();
    let most = bound(cells.len());
    let mut worst: Vec<(f64, &Cell)> = cells.iter().map(|cell| (cell.z(), *cell)).collect();
    worst.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    let spread = (worst.iter().map(|w| w.0 * w.0).sum::<f64>() / worst.len() as f64).sqrt();
    println!("{} of {} cells, rms of z {spread:.2}, bound {most:.2}", cells.len(), all.len());
    for (z, cell) in worst.iter().take(5) {
        let (a, b) = (mean_of(&cell.rendered), mean_of(&cell.walked));
        println!("z {z:5.2}: {}: {:.5} +- {:.5} against {:.5} +- {:.5}", cell.name(), a.0, a.1, b.0, b.1);
    }
    // A slip that all cells share is seen in their mean.
    let mut groups: Vec<(String, Vec<&Cell>)> = vec![("all".into(), cells.clone())];
    let mut group = |name: String, keep: &dyn Fn(&Cell) -> bool| {
        groups.push((name, cells.iter().copied().filter(|cell| keep(cell)).collect()));
    };
    for case in &cases {
        group(case.name.into(), &|cell| cell.case == case.name);
        for i in 0..3 {
            group(format!("{}, order {i}", case.name), &|cell| cell.case == case.name && cell.order == i);
            group(format!("{}, channel {i}", case.name), &|cell| cell.case == case.name && cell.channel == i);
        }
    }
    for i in 0..3 {
        group(format!("channel {i}"), &|cell| cell.channel == i);
    }
    let (mut wrong, mut known) = (Vec::new(), 0);
    let most_of_groups = bound(groups.len());
    for (name, cells) in groups {
        let (mean, error, z) = ratio(&cells);
        println!("{name} ({} cells): {mean:.4} +- {error:.4}, z {z:.2}", cells.len());
        let well = error <= KNOWN;
        known += usize::from(well);
        if z.abs() > if well { 3.0 } else { most_of_groups } {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "means of {wrong:?}");
    assert!(worst[0].0.abs() < most, "{}: z {}, bound {most}", worst[0].1.name(), worst[0].0);
    // Else a slip of 1 % would not be seen.
    assert!(cells.len() > 250 && known >= 12, "{} cells have light enough, {known} means are known well", cells.len());
}
