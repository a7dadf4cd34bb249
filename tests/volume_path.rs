//! The path tracer of media against what is known on paper, adding-doubling, another Monte Carlo program, and itself.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod parts;
mod rendering;
mod support;

use marmor::film::Image;
use marmor::integrator::{Left, Subsurface, SubsurfaceOptions, View, VolumePath, VolumePathOptions};
use marmor::math::{DVec3, Rgb, Vec3, hash};
use marmor::optics::reflectance;
use marmor::query::{self, Backend, RayQuery};
use marmor::scene::{Estimator, Orders, Scene, Spread};
use marmor::tally::{Tally, WalkTally};
use parts::cuboid;
use rendering::{Within, agree, channels, load, load_beside, means_of, on};
use std::path::Path;
use support::{Row, table, whole_table};

fn rays(scene: &Scene) -> Box<dyn RayQuery + '_> {
    query::build(Backend::preferred(), &scene.meshes()).unwrap()
}

const PLAIN: VolumePathOptions = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed: 1 };

fn render(scene: &Scene, options: VolumePathOptions, passes: u32) -> (Image, Tally) {
    let method = VolumePath::new(scene, options).unwrap();
    let (film, outcome) = on(Backend::preferred(), scene, &method, options.seed, 0..passes);
    assert_eq!(film.counts().non_finite, 0);
    (film.image(), outcome.tally)
}

/// Mean over the picture, and its standard error from independent renders.
fn mean(scene: &Scene, options: VolumePathOptions, passes: u32, runs: u64) -> [(f64, f64); 3] {
    let of = |seed| channels(&render(scene, VolumePathOptions { seed, ..options }, passes).0);
    means_of(&(1..=runs).map(of).collect::<Vec<_>>())
}

/// With ten runs and more the standard error itself is known to some 20 %: 8 of them stand for 6 of a known one.
fn assert_same(a: (f64, f64), b: (f64, f64), what: &str) {
    agree(a, b, Within { errors: 8.0, noise: 0.03 }, what);
}

/// A ball of radius 1 at the origin, seen from z = 5; eight pixels a side, all of them on the ball.
fn ball(material: &str, rest: &str) -> String {
    format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 15\nresolution = [8, 8]\n\
         [[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nrings = 32\nsegments = 64\n\
         material = \"body\"\n[material.body]\ntype = \"translucent\"\n{material}\n{rest}"
    )
}

const WHITE: &str = "[environment]\nradiance = 1\n";
const LAMP: &str = "[[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [0, 4, 3]\nedge_u = [1.5, 0, 0]\n\
                    edge_v = [0, 0.9, -1.2]\nmaterial = \"lamp\"\n[material.lamp]\ntype = \"emissive\"\n\
                    radiance = [3, 2, 1]\ntwo_sided = true\n";

/// Whatever enters comes out: the ball vanishes. Grey media give 1 in every sample; coloured ones in the mean, to 0.2 %.
#[test]
fn a_white_medium_vanishes_in_a_white_furnace() {
    let grey = load(&ball("sigma_s = 8\nsigma_a = 0\ng = 0.5\neta = 1.4", WHITE));
    let (image, tally) = render(&grey, PLAIN, 16);
    for pixel in image.pixels {
        assert!((pixel[0] - 1.0).abs() < 1e-5 && pixel.is_grey(), "{pixel:?}");
    }
    assert!(tally.walk.losses.total() == 0 && tally.walk.collisions > 10_000, "{:?}", tally.walk);
    // Spectralon, in a ball of 0.3 mm.
    let coloured = load(&ball("preset = \"spectralon\"\nscale = 0.3", WHITE));
    for (c, (mean, error)) in mean(&coloured, PLAIN, 2048, 6).into_iter().enumerate() {
        println!("Spectralon, channel {c}: {mean} +- {error}");
        assert!((mean - 1.0).abs() < 0.002 && error < 0.0015, "channel {c}: {mean} +- {error}");
    }
}

/// A medium in a slab under the plane z = 0 and beams into it from above.
struct Beam {
    scene: Scene,
}

impl Beam {
    fn new([sigma_s, sigma_a, g, eta]: [f64; 4], depth: f64, half: f64) -> Self {
        let text = format!(
            "unit = \"mm\"\n[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 15\nup = [0, 1, 0]\nresolution = [1, 1]\n\
             [[object]]\nmesh = \"slab.obj\"\nmaterial = \"m\"\n[material.m]\ntype = \"translucent\"\nsigma_s = {sigma_s}\n\
             sigma_a = {sigma_a}\ng = {g}\neta = {eta}\n"
        );
        let slab = cuboid([-half, -half, -depth], [half, half, 0.0]);
        Self { scene: load_beside("slab.obj", &slab, &text) }
    }

    /// What leaves of `paths` that enter at the origin straight down; x relative to there.
    fn run(&self, paths: u64, seed: u64, mut each: impl FnMut(Left)) -> WalkTally {
        let rays = rays(&self.scene);
        let view = View { scene: &self.scene, rays: &*rays };
        let method = VolumePath::new(&self.scene, PLAIN).unwrap();
        let top = -self.scene.centre;
        let start = DVec3::new(top.x, top.y, top.z - 1e-6 * top.z.abs());
        let mut tally = WalkTally::default();
        for i in 0..paths {
            let key = hash(seed << 32 | i);
            if let Some(mut left) = method.pencil(view, 0, (start, Vec3::NEG_Z), 0.5, key, &mut tally) {
                left.x -= top;
                each(left);
            }
        }
        tally
    }
}

/// Sum and sum of squares of weights.
#[derive(Clone, Copy, Default)]
struct Sum {
    n: f64,
    squares: f64,
}

impl Sum {
    fn add(&mut self, w: f32) {
        self.n += f64::from(w);
        self.squares += f64::from(w).powi(2);
    }

    /// Mean over `paths` and its standard error.
    fn mean(&self, paths: u64) -> (f64, f64) {
        let (n, mean) = (paths as f64, self.n / paths as f64);
        (mean, ((self.squares / n - mean * mean) / n).sqrt())
    }
}

/// Nothing is absorbed: what leaves is what entered, path by path, in a half space, a slab and a strongly forward medium.
#[test]
fn without_absorption_no_energy_is_lost() {
    for (medium, depth) in [([1.0, 0.0, 0.0, 1.5], 3.0), ([4.0, 0.0, 0.8, 1.3], 2.0), ([1.0, 0.0, -0.5, 0.8], 2.0)] {
        let beam = Beam::new(medium, depth, 40.0);
        let mut sum = 0.0_f64;
        let tally = beam.run(4000, 1, |left| sum += f64::from(left.weight.mean()));
        assert!((sum / 4000.0 - 1.0).abs() < 1e-4, "{medium:?}: {sum}");
        assert_eq!(tally.losses.total(), 0, "{medium:?}");
    }
}

/// Reflectance of a half space at normal incidence, after entry: adding-doubling with 160 quadrature points gives
/// R_coll_sub / (1 - F).
const HALF_SPACES: [([f64; 3], f64); 8] = [
    // n, g, albedo
    ([1.0, 0.0, 0.5], 0.115_225_9),
    ([1.0, 0.8, 0.9], 0.136_208_0),
    ([1.3, 0.0, 0.8], 0.178_239_7 / (1.0 - 0.017_013_2)),
    ([1.3, 0.0, 0.99], 0.645_394_0 / (1.0 - 0.017_013_2)),
    ([1.3, 0.8, 0.5], 0.006_372_5 / (1.0 - 0.017_013_2)),
    ([1.0, 0.0, 0.95], 0.535_541_1),
    ([1.0, 0.8, 0.95], 0.238_945_8),
    ([1.3, 0.0, 0.95], 0.400_877_7 / (1.0 - 0.017_013_2)),
];

fn half_space([n, g, albedo]: [f64; 3], paths: u64) -> (f64, f64) {
    // As wide and deep as 60 diffusion lengths.
    let (sigma_t_prime, sigma_a) = (1.0 - albedo * g, 1.0 - albedo);
    let size = 60.0 / (3.0 * sigma_a * sigma_t_prime).sqrt();
    let mut sum = Sum::default();
    let tally =
        Beam::new([albedo, sigma_a, g, n], size, size)
            .run(paths, (1e4 * n + 1e3 * g + 1e5 * albedo) as u64, |left| sum.add(left.weight[0]));
    // Rounding: a collision within the last place of a coordinate of the surface may come to lie behind it.
    assert!(tally.losses.total() as f64 <= 1e-4 * paths as f64, "{tally:?}");
    sum.mean(paths)
}

#[test]
fn half_spaces_reflect_as_adding_doubling_says() {
    for (medium, expected) in HALF_SPACES {
        let (mean, error) = half_space(medium, if expected < 0.01 { 300_000 } else { 40_000 });
        println!("{medium:?}: {mean:.6} +- {error:.6}, expected {expected:.6}");
        assert!(
            error < 0.03 * expected && (mean - expected).abs() < 6.0 * error,
            "{medium:?}: {mean} +- {error}, {expected}"
        );
    }
}

/// Every row of `adding_doubling.csv` in `MARMOR_REFERENCE_DIR`: within 3 standard errors, which are below 0.3 %.
#[test]
fn all_half_spaces() {
    let Some(folder) = std::env::var_os("MARMOR_REFERENCE_DIR") else { return };
    let text = std::fs::read_to_string(Path::new(&folder).join("adding_doubling.csv")).unwrap();
    let mut rows = 0;
    for line in text.lines().filter(|l| l.starts_with(|c: char| c.is_ascii_digit())) {
        let v: Vec<f64> = line.split(',').take(8).map(|v| v.parse().unwrap()).collect();
        let expected = v[7] / (1.0 - v[5]);
        let pilot = half_space([v[0], v[1], v[2]], 20_000);
        let paths = (20_000.0 * (pilot.1 / (0.0025 * expected)).powi(2)).max(20_000.0) as u64;
        let (mean, error) = half_space([v[0], v[1], v[2]], paths);
        let z = (mean - expected) / error;
        println!(
            "n {} g {} a {}: {mean:.6} +- {error:.6} ({:.2} %), expected {expected:.6}, z {z:.2}",
            v[0],
            v[1],
            v[2],
            100.0 * error / mean
        );
        assert!(error < 0.003 * expected && z.abs() < 3.0, "{line}");
        rows += 1;
    }
    assert!(rows > 20, "{rows} rows");
}

/// Chi-square of a radial profile by order, and degrees of freedom; lengths in transport mean free paths.
fn radial(totals: &Row, bins: &[&Row], paths: u64) -> (f64, u32) {
    let medium = ["mus", "mua", "g", "eta"].map(|k| totals.number(k));
    // 15 diffusion lengths: a ray leaves a surface some 4e-6 of the box away from it, which must be nothing beside the finest
    // rings.
    let [s, a, g, _] = medium;
    let size = (15.0 / (3.0 * a * (s * (1.0 - g) + a)).sqrt()).clamp(30.0, 1000.0);
    let beam = Beam::new(medium, size, size);
    let mut sums = vec![[Sum::default(); 2]; bins.len()];
    beam.run(paths, 3, |left| {
        let r = left.x.truncate().length();
        // Sides and the bottom are far.
        let bin = bins.partition_point(|b| b.number("r_hi") <= r).min(bins.len() - 1);
        if left.order > 0 && left.x.z.abs() < 1e-3 {
            sums[bin][usize::from(left.order > 1)].add(left.weight[0]);
        }
    });
    let (mut chi, mut freedom) = (0.0, 0);
    for (bin, sums) in bins.iter().zip(&sums) {
        for (order, sum) in sums.iter().enumerate() {
            let key = ["flux1", "flux2"][order];
            let (truth, its) = (bin.number(key), bin.number(&format!("{key}_se")));
            let (mean, error) = sum.mean(paths);
            // Bins with hits enough for a normal law in both.
            if truth > 0.0 && its < 0.15 * truth && error < 0.15 * mean {
                chi += (mean - truth).powi(2) / (its * its + error * error);
                freedom += 1;
            }
        }
    }
    (chi, freedom)
}

fn radial_profiles(totals: &[Row], bins: &[Row], paths: u64) {
    for row in totals {
        if row.number("theta_ext_deg") != 0.0 {
            continue;
        }
        let mine: Vec<&Row> = bins.iter().filter(|b| b.text("name") == row.text("name")).collect();
        if mine.is_empty() || row.number("mua") == 0.0 {
            continue;
        }
        let (chi, freedom) = radial(row, &mine, paths);
        // The cube root of chi-square over its degrees of freedom is nearly normal [WH31]. 3 standard
        // errors for some 40 rows together are 4 for each.
        let f = f64::from(freedom);
        let z = ((chi / f).cbrt() - (1.0 - 2.0 / (9.0 * f))) / (2.0 / (9.0 * f)).sqrt();
        println!("{}: chi-square {chi:.1} of {freedom}, z {z:.2}", row.text("name"));
        assert!(freedom >= 8 && z < 4.0, "{}: {chi} of {freedom}", row.text("name"));
    }
}

#[test]
fn radial_profiles_are_those_of_another_program() {
    radial_profiles(&table("mc_totals.csv"), &table("mc_profile_normal.csv"), 30_000);
}

#[test]
fn all_radial_profiles() {
    let Some(bins) = whole_table("mc_profile_normal.csv") else { return };
    radial_profiles(&whole_table("mc_totals.csv").unwrap(), &bins, 400_000);
}

const MILK: &str = "sigma_s = [2, 4, 7]\nsigma_a = [0.02, 0.05, 0.3]\ng = 0\neta = 1.3";
const FORWARD: &str = "sigma_s = [12, 15, 20]\nsigma_a = [0.02, 0.05, 0.3]\ng = 0.7\neta = 1.4";

/// Photons or none, one ray backend or the other: the same picture; and the orders add up to it.
#[test]
fn photons_change_the_noise_alone_and_orders_add_up() {
    for (name, medium) in [("isotropic", MILK), ("forward", FORWARD)] {
        let scene = load(&ball(medium, LAMP));
        let with = VolumePathOptions { photons: 512, ..PLAIN };
        let all = mean(&scene, with, 24, 10);
        let plain = mean(&scene, PLAIN, 48, 10);
        let orders = [Orders::None, Orders::Single, Orders::Multiple]
            .map(|orders| mean(&scene, VolumePathOptions { orders, ..with }, 24, 10));
        for c in 0..3 {
            assert_same(all[c], plain[c], &format!("{name}, channel {c}: photons against none"));
            let sum = orders.iter().fold((0.0, 0.0_f64), |s, o| (s.0 + o[c].0, s.1.hypot(o[c].1)));
            assert_same(sum, plain[c], &format!("{name}, channel {c}: sum of orders"));
        }
    }
}

/// A floor, a second body beside the first, an environment: every kind of path there is.
#[test]
fn photons_change_nothing_among_other_surfaces() {
    let rest = LAMP.to_string()
        + "[[object]]\nname = \"floor\"\nshape = \"rectangle\"\ncentre = [0, -1.05, 0]\nedge_u = [0, 0, 3]\nedge_v = [3, 0, 0]\n\
           material = \"grey\"\n[material.grey]\ntype = \"diffuse\"\nalbedo = 0.7\n\
           [[object]]\nname = \"other\"\nshape = \"sphere\"\ncentre = [1.4, -0.4, 0.8]\nradius = 0.5\nrings = 16\nsegments = 32\n\
           material = \"body\"\n[environment]\nradiance = [0.02, 0.03, 0.04]\n";
    let scene = load(&ball(MILK, &rest).replace("fov = 15", "fov = 40"));
    let with = mean(&scene, VolumePathOptions { photons: 512, ..PLAIN }, 24, 10);
    let without = mean(&scene, PLAIN, 48, 10);
    for c in 0..3 {
        assert_same(with[c], without[c], &format!("channel {c}"));
    }
}

/// A clear ball: light refracted through it and mirrored on it, in a white furnace; total reflection inside ends.
#[test]
fn media_at_the_ends_of_their_range_have_an_outcome() {
    let render =
        |medium: &str, rest: &str| render(&load(&ball(medium, rest)), VolumePathOptions { photons: 64, ..PLAIN }, 4);
    let clear = render("sigma_s = 0\nsigma_a = 0\ng = 0\neta = 1.5", WHITE);
    assert!(clear.0.pixels.iter().all(|p| (p[0] - 1.0).abs() < 1e-5), "{:?}", clear.0.pixels);
    for eta in [1.0, 0.7] {
        let white = render(&format!("sigma_s = 3\nsigma_a = 0\ng = 0\neta = {eta}"), WHITE).0;
        assert!(white.pixels.iter().all(|p| (p[0] - 1.0).abs() < 1e-5), "eta {eta}: {:?}", white.pixels);
    }
    // A pure absorber mirrors at most.
    let black = render("sigma_s = 0\nsigma_a = 50\ng = 0\neta = 1.5", WHITE).0;
    let mirror = reflectance(1.5, 1.0);
    assert!(black.pixels.iter().all(|p| p[0] > 0.9 * mirror && p[0] < 2.0 * mirror), "{:?}", black.pixels);
    for medium in
        ["sigma_s = 300\nsigma_a = 0.1\ng = 0.99\neta = 1.3", "sigma_s = 3\nsigma_a = 0.1\ng = -0.99\neta = 1.3"]
    {
        let (image, tally) = render(medium, &(WHITE.to_string() + LAMP));
        assert!(image.pixels.iter().all(|p| p.is_finite()) && tally.walk.losses.total() == 0, "{medium}");
    }
    let one_channel = render("sigma_s = [3, 0, 0]\nsigma_a = [0, 3, 0]\ng = 0\neta = 1.3", WHITE).0;
    let mean = |c: usize| one_channel.pixels.iter().map(|p| p[c]).sum::<f32>() / 64.0;
    assert!(
        (mean(2) - 1.0).abs() < 0.2 && mean(1) < 0.2 && (mean(0) - 1.0).abs() < 0.2,
        "{} {} {}",
        mean(0),
        mean(1),
        mean(2)
    );
}

#[test]
fn a_sheet_is_refused_by_name() {
    let message = |scene: &Scene| VolumePath::new(scene, PLAIN).err().unwrap().to_string();
    let sheet = "unit = \"mm\"\n[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 15\nresolution = [8, 8]\n\
                 [[object]]\nname = \"leaf\"\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 2, 0]\n\
                 material = \"body\"\n[material.body]\ntype = \"translucent\"\n";
    let said = message(&load(&format!("{sheet}{MILK}\n{WHITE}")));
    assert!(said.contains("\"leaf\"") && said.contains("no inside") && said.contains("thickness"), "{said}");
}

/// The first order beside `beam` is the path tracer's, by lamps and by the environment; `standard` gets none.
#[test]
fn single_scattering_of_subsurface_is_that_of_the_paths() {
    for (name, medium, light) in [("lamp", FORWARD, LAMP), ("environment", MILK, WHITE)] {
        let render = |model: &str, single: bool, seed: u64| {
            let scene = load(&ball(&format!("{medium}\nmodel = \"{model}\""), light));
            let options = SubsurfaceOptions {
                single,
                cache_samples: 256,
                estimator: Estimator::All,
                spread: Spread::Area,
                specular: false,
                seed,
                ..Default::default()
            };
            let method = Subsurface::new(&scene, options).unwrap();
            on(Backend::preferred(), &scene, &method, seed, 0..256).0.image().pixels
        };
        assert_eq!(render("standard", true, 1), render("standard", false, 1));
        // The same cache with and without: the difference is the first order alone.
        let runs: Vec<[f64; 3]> = (1..=10)
            .map(|seed| {
                let (with, without) = (render("beam", true, seed), render("beam", false, seed));
                std::array::from_fn(|c| {
                    with.iter().zip(&without).map(|(a, b)| f64::from(a[c] - b[c])).sum::<f64>() / 64.0
                })
            })
            .collect();
        let found = means_of(&runs);
        let scene = load(&ball(medium, light));
        let once = VolumePathOptions { orders: Orders::Single, specular: false, ..PLAIN };
        for (c, expected) in mean(&scene, once, 256, 10).into_iter().enumerate() {
            assert_same(found[c], expected, &format!("{name}, channel {c}: first order"));
        }
    }
}

/// The ball of the stored pictures: `preset`, eta and all, seen by the light that went through it alone.
fn stored_ball(preset: &str) -> Scene {
    load(&format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 10, 70]\nlook_at = [0, 0, 0]\nfov = 20\nresolution = [128, 128]\n\
         [[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 10\nrings = 256\nsegments = 512\n\
         material = \"m\"\n[material.m]\ntype = \"translucent\"\npreset = \"{preset}\"\n[[object]]\nname = \"lamp\"\n\
         shape = \"rectangle\"\ncentre = [0, 160, -120]\nedge_u = [50, 0, 0]\nedge_v = [0, 30, 40]\nmaterial = \"lamp\"\n\
         [material.lamp]\ntype = \"emissive\"\nradiance = 10\n"
    ))
}

/// Pixel by pixel against pictures that another program traced, in `MARMOR_REFERENCE_DIR`: 99.75 % of the pixels within
/// the bound that one of all pixels and channels of a fair picture would leave with a chance of 0.27 %.
#[test]
fn all_stored_spheres() {
    let Some(folder) = std::env::var_os("MARMOR_REFERENCE_DIR") else { return };
    for preset in ["skimmilk", "marble"] {
        let path = Path::new(&folder).join(format!("images/gt_sphere_{preset}_128_layers.exr"));
        let [truth, its] = ["sub", "sub_err"].map(|layer| Image::read_exr_layer(&path, Some(layer)).unwrap());
        let scene = stored_ball(preset);
        let options = VolumePathOptions { photons: 16384, specular: false, seed: 5, ..PLAIN };
        let method = VolumePath::new(&scene, options).unwrap();
        let (film, _) = on(Backend::preferred(), &scene, &method, 5, 0..128);
        let (mean, variance) = (film.image(), marmor::film::variance(&film).unwrap());
        let mut z = Vec::new();
        for i in 0..mean.pixels.len() {
            for c in 0..3 {
                let (error, own) = (f64::from(its.pixels[i][c]), f64::from(variance.pixels[i][c]));
                if error > 0.0 && own > 0.0 {
                    z.push(f64::from(mean.pixels[i][c] - truth.pixels[i][c]) / (error * error + own).sqrt());
                }
            }
        }
        let n = z.len() as f64;
        let average = z.iter().sum::<f64>() / n;
        let spread = (z.iter().map(|z| (z - average).powi(2)).sum::<f64>() / n).sqrt();
        // For 10^4 to 10^5 tests: 5.2 to 5.6 standard errors.
        let beyond = z.iter().filter(|z| z.abs() > 5.2).count();
        println!("{preset}: {n} values, z {average:.3} +- {spread:.3}, {beyond} beyond 5.2");
        assert!(n > 10_000.0 && (beyond as f64) < 0.0025 * n, "{preset}: {beyond} of {n}");
        // Where the stored picture is dark, few paths made both its mean and its error: too low a mean then comes with too
        // low an error, and the average of z is above 0 while sums over regions agree.
        assert!(average.abs() < 0.3 && spread < 1.25, "{preset}: z {average} +- {spread}");
        let sum = |image: &Image, c: usize| image.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>();
        for c in 0..3 {
            let ratio = sum(&mean, c) / sum(&truth, c);
            assert!((ratio - 1.0).abs() < 0.01, "{preset}, channel {c}: {ratio}");
        }
    }
}

/// What is rendered does not depend on the number of threads.
#[test]
fn threads_change_no_byte() {
    let scene = load(&ball(FORWARD, LAMP));
    let options = VolumePathOptions { photons: 256, ..PLAIN };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, options, 3).0.pixels)
    };
    let pixels: Vec<Rgb> = with(1);
    assert_eq!(pixels, with(3));
}
