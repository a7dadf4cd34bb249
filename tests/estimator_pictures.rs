//! Pictures of meshes: the estimators that leave out samples, against the sum over all samples of the same cache.
#![allow(clippy::unwrap_used)] // a scene that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod rendering;

use marmor::bssrdf::{ModelName, ModelOption};
use marmor::film::Image;
use marmor::integrator::{Subsurface, SubsurfaceOptions, View};
use marmor::query::{self, Backend};
use marmor::scene::{Estimator, Scene};
use rendering::{load_in, run};

/// Pixels across a block.
const BLOCK: usize = 6;
/// Blocks darker than this share of the mean are left out: nothing is gathered there.
const DARK: f64 = 1e-3;

/// A medium whose light comes farther than the next cached sample, but for `normalised`, which has a pole.
const CLEAR: &str = "sigma_s_prime = [0.2, 0.3, 0.4]\nsigma_a = [0.002, 0.004, 0.02]\neta = 1.4";

/// The picture of one pass alone.
fn pass(view: View<'_>, method: &Subsurface, pass: u32) -> Image {
    run(method, view, 3, pass..pass + 1, &mut []).0.image()
}

/// Sums over blocks, channel by channel, times `factor`.
fn blocks(image: &Image, factor: f64) -> Vec<f64> {
    let [width, height] = image.resolution.map(|v| v as usize);
    let [columns, rows] = [width.div_ceil(BLOCK), height.div_ceil(BLOCK)];
    let mut sums = vec![0.0; 3 * columns * rows];
    for (i, pixel) in image.pixels.iter().enumerate() {
        let block = i / width / BLOCK * columns + i % width / BLOCK;
        for c in 0..3 {
            sums[3 * block + c] += factor * f64::from(pixel.0[c]);
        }
    }
    sums
}

/// What stays the same for all estimators: samples, seed and light.
fn method(scene: &Scene, estimator: Estimator, samples: u32) -> Subsurface {
    let options = SubsurfaceOptions {
        cache_samples: samples,
        estimator,
        cut_error: Some(0.2),
        specular: false,
        single: false,
        bounces: 0,
        seed: 3,
        ..Default::default()
    };
    Subsurface::new(scene, options).unwrap()
}

/// The most standard errors by which the mean over passes of a block's difference from `all` is not 0; `factor` is a
/// planted one. Each pass has a cache of its own, so that passes are as good as independent in what is left to chance:
/// which samples stand for others.
fn apart(view: View<'_>, all: &[Vec<f64>], estimator: Estimator, samples: u32, factor: f64) -> f64 {
    let method = method(view.scene, estimator, samples);
    let passes = all.len() as f64;
    let own: Vec<Vec<f64>> = (0..all.len()).map(|p| blocks(&pass(view, &method, p as u32), factor)).collect();
    let mean = |block: usize| all.iter().map(|sums| sums[block]).sum::<f64>() / passes;
    let whole = (0..all[0].len()).map(mean).sum::<f64>() / all[0].len() as f64;
    let lit = (0..all[0].len()).filter(|&block| mean(block) > DARK * whole);
    let of = |block: usize| {
        let differences: Vec<f64> = own.iter().zip(all).map(|(own, all)| own[block] - all[block]).collect();
        let off = differences.iter().sum::<f64>() / passes;
        let variance = differences.iter().map(|d| (d - off).powi(2)).sum::<f64>() / (passes - 1.0);
        // Sums in f32 round.
        off.abs() / (variance / passes).sqrt().hypot(1e-5 * mean(block))
    };
    lit.map(of).fold(0.0, f64::max)
}

fn set(scene: &mut Scene, model: ModelName) {
    for material in &mut scene.materials {
        if let Some(t) = &mut material.surface.inside {
            let longest = t.medium.sigma_t_prime().0.into_iter().map(|s| 1.0 / s).fold(0.0, f32::max);
            t.model = model;
            t.thickness = model.takes(ModelOption::Thickness).then_some(10.0 * longest);
        }
    }
}

/// All models and estimators on a scene; a factor of 1.05 must be refused.
fn compare(scene: &mut Scene, passes: u32, samples: u32) {
    for model in ModelName::models() {
        set(scene, model);
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        let view = View { scene: &*scene, rays: &*rays };
        let reference = method(view.scene, Estimator::All, samples);
        println!(
            "{}: {} near fields, whose noise `cut` and `all` have in common",
            model.name(),
            reference.near_fields()
        );
        let all: Vec<Vec<f64>> = (0..passes).map(|p| blocks(&pass(view, &reference, p), 1.0)).collect();
        for estimator in [Estimator::Cut, Estimator::Thinned, Estimator::Notes] {
            let found = apart(view, &all, estimator, samples, 1.0);
            println!("{:11} {:8} {found:.2}", model.name(), estimator.name());
            assert!(found > 0.0 && found < 6.0, "{} {}: {found} standard errors", model.name(), estimator.name());
        }
        let planted = apart(view, &all, Estimator::Cut, samples, 1.05);
        assert!(planted > 6.0, "{}: 5 % would not be noticed: {planted}", model.name());
    }
}

#[test]
fn every_estimator_paints_the_lotus_as_the_sum_over_all_samples_does() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/lotus");
    let text = std::fs::read_to_string(folder.join("scene.toml")).unwrap();
    // Clear enough that most models need no near field.
    let text = text.replace("resolution = [512, 512]", "resolution = [24, 24]").replace("preset = \"marble\"", CLEAR);
    let mut scene = load_in(&folder, &text);
    compare(&mut scene, 20, 4096);
}

/// MARMOR_BENCH_OBJ=bunny.obj cargo test --release --features embree --test estimator_pictures -- --ignored --nocapture
#[test]
#[ignore = "minutes, and a mesh that is not ours"]
fn every_estimator_paints_a_given_mesh_as_the_sum_over_all_samples_does() {
    let path = std::path::PathBuf::from(std::env::var("MARMOR_BENCH_OBJ").expect("MARMOR_BENCH_OBJ names a mesh"));
    let bounds = marmor::geometry::load_mesh(&path).unwrap().bounds().unwrap();
    let scale = 100.0 / bounds.extent().max_element();
    let [x, y, z] = (-scale * bounds.centre()).to_array();
    let mut scene = load_in(
        std::path::Path::new("."),
        &format!(
            "unit = \"mm\"\n[camera]\nposition = [0, 5, 320]\nlook_at = [0, 0, 0]\nfov = 22\nresolution = [96, 96]\n\
             [[object]]\nname = \"body\"\nmaterial = \"milk\"\nmesh = {path:?}\n\
             transform = {{ scale = {scale}, translate = [{x}, {y}, {z}] }}\n\
             [[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [0, 140, -140]\nedge_u = [50, 0, 0]\n\
             edge_v = [0, 35, 35]\nmaterial = \"lamp\"\n\
             [material.milk]\ntype = \"translucent\"\n{CLEAR}\n\
             [material.lamp]\ntype = \"emissive\"\nradiance = 10\ntwo_sided = true\n"
        ),
    );
    compare(&mut scene, 24, 8192);
}
