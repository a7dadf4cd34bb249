//! Error against time of all estimators of the sample cache on one scene, all cores, by turns; then the error at equal time
//! over media from clear to stiff.
//!
//!     cargo bench --features embree --bench converge_estimators
//!     MARMOR_BENCH_FAMILY=1 cargo bench --features embree --bench converge_estimators      # the family of media alone
//!     MARMOR_BENCH_SCENE=scene.toml MARMOR_BENCH_SECONDS=20 MARMOR_BENCH_SVG=plot.svg cargo bench ... --bench converge_estimators
//!
//! Errors are relMSE over pixels that lie wholly on an object, without the worst 0.1 %, against a picture by `cut` of
//! another seed and some times the budget. Seconds are those of passes: loading and tables are told apart.
#![allow(clippy::print_stdout, clippy::unwrap_used)] // a benchmark prints, and stops at what it cannot read

mod bumps;

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use marmor::film::{Film, Image, Window, metrics::compare};
use marmor::geometry::AreaTable;
use marmor::integrator::{Direct, Integrator, Subsurface, SubsurfaceOptions, View};
use marmor::query::{self, Backend};
use marmor::render::{self, Job, Spent};
use marmor::report::{Axis, COLOURS, DASHES, Figure, Panel, Row, Scale, Series, Stroke};
use marmor::sampling::Points;
use marmor::scene::{EntrySampling, Estimator, Scene, SceneFile, Spread};

/// Pixels this far from the next one that misses the object are its interior.
const INTERIOR: i64 = 3;
/// Times the budget of a contestant that the reference gets.
const REFERENCE: f64 = 6.0;
/// Factors on the coefficients of the stiff family.
const STIFFNESS: [f64; 7] = [0.1, 0.5, 2.0, 10.0, 100.0, 1e3, 1e4];
/// Those among them that have N = A σ_tr² / 2π from 1 to 1e8, the least absorbing channel from 1.4 and the most up to 1.6e8.
const FAMILY: std::ops::RangeInclusive<f64> = 0.5..=1e3;

struct Contestant {
    name: &'static str,
    options: SubsurfaceOptions,
}

fn options(estimator: Estimator, seed: u64) -> SubsurfaceOptions {
    SubsurfaceOptions {
        cache_samples: estimator.default_samples(),
        estimator,
        specular: false,
        seed,
        ..Default::default()
    }
}

fn contestants() -> Vec<Contestant> {
    let of = |name, estimator| Contestant { name, options: options(estimator, 1) };
    let lecture = SubsurfaceOptions {
        entry: EntrySampling::Cosine,
        points: Points::Independent,
        spread: Spread::Area,
        ..options(Estimator::Notes, 1)
    };
    vec![
        Contestant { name: "as the notes", options: lecture },
        of("notes", Estimator::Notes),
        of("thinned", Estimator::Thinned),
        of("all", Estimator::All),
        of("cluster", Estimator::Cluster),
        of("cut", Estimator::Cut),
    ]
}

/// The scene, as asked or of our own, with the materials of `medium` in its place.
fn scene(medium: &str) -> Scene {
    let own = "unit = \"mm\"\n[camera]\nposition = [0, 30, 200]\nlook_at = [0, 0, 0]\nfov = 24\nresolution = [256, 256]\n\
         [[object]]\nname = \"body\"\nmesh = \"bumps.obj\"\ntransform = { scale = 30 }\nmaterial = \"milk\"\n\
         [[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [100, 120, 80]\nedge_u = [40, 0, -40]\n\
         edge_v = [-25, 40, -25]\nmaterial = \"lamp\"\n\
         [material.lamp]\ntype = \"emissive\"\nradiance = 10\ntwo_sided = true\n[material.milk]\n";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bumps.obj"), bumps::bumps(133)).unwrap();
    let file = SceneFile::parse(&format!("{own}{medium}"), &folder.path().join("scene.toml")).unwrap();
    Scene::load(&file).unwrap()
}

struct Bench<'a> {
    view: View<'a>,
    interior: Vec<bool>,
}

/// A film and what it has cost.
struct Run {
    film: Film,
    spent: Spent,
}

impl Bench<'_> {
    fn film(&self) -> Film {
        let resolution = self.view.scene.camera.resolution;
        Film::new(resolution, Window::full(resolution)).unwrap()
    }

    fn run(&self) -> Run {
        Run { film: self.film(), spent: Spent::default() }
    }

    /// More passes, up to `passes` in all or `seconds` in all.
    fn go_on(&self, integrator: &impl Integrator, seed: u64, run: &mut Run, passes: Option<u32>, seconds: f64) {
        let cancel = AtomicBool::new(false);
        let job = Job { seed, passes, time: Some(Duration::from_secs_f64(seconds)), cancel: &cancel };
        let outcome = render::resume(integrator, self.view, &job, &mut run.film, run.spent, &mut []).unwrap();
        run.spent = Spent { setup: 0.0, seconds: outcome.seconds, tally: outcome.tally };
    }

    fn error(&self, film: &Film, reference: &Image) -> f64 {
        let found = compare(&film.image(), reference, Some(&self.interior)).unwrap();
        found.interior.and_then(|e| e.relmse_trimmed).map_or(f64::NAN, |e| e.value)
    }

    fn reference(&self, seconds: f64) -> Image {
        let options = SubsurfaceOptions { cache_samples: 1 << 19, ..options(Estimator::Cut, 99) };
        let mut run = self.run();
        self.go_on(&Subsurface::new(self.view.scene, options).unwrap(), 99, &mut run, None, seconds);
        run.film.image()
    }
}

/// Pixels whose centre and all centres around hit an object that is no lamp.
fn interior(view: View<'_>) -> Vec<bool> {
    let [width, height] = view.scene.camera.resolution.map(i64::from);
    let on = |x: i64, y: i64| {
        let ray = view.scene.camera.ray([x, y].map(|v| v as u32), [0.5; 2]);
        let hit = view.rays.closest(&ray);
        hit.is_some_and(|h| view.scene.surface(h.mesh).emission.is_none())
    };
    let hit: Vec<bool> = (0..width * height).map(|i| on(i % width, i / width)).collect();
    let at = |x: i64, y: i64| hit[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize];
    let around = -INTERIOR..=INTERIOR;
    let inside = |x: i64, y: i64| around.clone().all(|dy| around.clone().all(|dx| at(x + dx, y + dy)));
    (0..width * height).map(|i| inside(i % width, i / width)).collect()
}

fn with_bench(scene: &Scene, work: impl FnOnce(&Bench<'_>)) {
    let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
    let view = View { scene, rays: &*rays };
    work(&Bench { view, interior: interior(view) });
}

fn main() {
    let seconds = std::env::var("MARMOR_BENCH_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(8.0);
    let begin = Instant::now();
    let (name, loaded) = match std::env::var("MARMOR_BENCH_SCENE") {
        Ok(path) => (path.clone(), Scene::load(&SceneFile::read(path.as_ref()).unwrap()).unwrap()),
        Err(_) => (
            "a bumpy ball of skim milk".into(),
            scene("type = \"translucent\"\npreset = \"skimmilk\"\nexit_normalisation = false\n"),
        ),
    };
    println!("{name}: loaded in {:.2} s, {} threads", begin.elapsed().as_secs_f64(), rayon::current_num_threads());
    if std::env::var_os("MARMOR_BENCH_FAMILY").is_none() {
        with_bench(&loaded, |bench| race(bench, &name, seconds));
    }
    if std::env::var_os("MARMOR_BENCH_SCENE").is_none() {
        stiff(seconds / 4.0);
    }
}

/// All contestants, a pass or more of each by turns; each gets the same time.
fn race(bench: &Bench<'_>, name: &str, seconds: f64) {
    let reference = bench.reference(REFERENCE * seconds);
    let contestants = contestants();
    let integrators: Vec<Subsurface> =
        contestants.iter().map(|c| Subsurface::new(bench.view.scene, c.options).unwrap()).collect();
    let mut runs: Vec<Run> = contestants.iter().map(|_| bench.run()).collect();
    let mut curves: Vec<Vec<(f64, f64)>> = vec![Vec::new(); contestants.len()];
    let mut until = 0.1;
    while until <= seconds {
        for ((contestant, integrator), (run, curve)) in
            contestants.iter().zip(&integrators).zip(runs.iter_mut().zip(&mut curves))
        {
            let before = run.film.passes();
            bench.go_on(integrator, contestant.options.seed, run, None, until);
            if run.film.passes() > before {
                curve.push((run.spent.seconds.total(), bench.error(&run.film, &reference)));
            }
        }
        until *= 1.5;
    }
    println!("relMSE of the interior, without the worst 0.1 %, after seconds of passes:");
    for ((contestant, curve), run) in contestants.iter().zip(&curves).zip(&runs) {
        let shown: Vec<String> = curve.iter().map(|(s, e)| format!("{s:.2} s {e:.2e}")).collect();
        println!("    {:13}{}", contestant.name, shown.join(", "));
        let per_exit = |n: u64| n as f64 / run.spent.tally.gather.exits as f64;
        println!(
            "    {:13}{} passes; an exit: {:.1} nodes, {:.1} evaluations, {:.2} of the near field; {:.0} % of the time in the cache",
            "",
            run.film.passes(),
            per_exit(run.spent.tally.gather.nodes),
            per_exit(run.spent.tally.gather.evaluated),
            per_exit(run.spent.tally.gather.near_points),
            100.0 * run.spent.seconds.cache / run.spent.seconds.total()
        );
    }
    for target in [1e-2, 1e-3, 1e-4] {
        let times: Vec<Option<f64>> = curves.iter().map(|curve| time_to(curve, target)).collect();
        let Some(lecture) = times[0] else { continue };
        let each = contestants.iter().zip(&times).map(|(c, t)| match t {
            Some(t) => format!("{} {t:.2} s (1 : {:.1})", c.name, lecture / t),
            None => format!("{} never", c.name),
        });
        println!("    to {target:.0e}: {}", each.collect::<Vec<_>>().join(", "));
    }
    if let Ok(path) = std::env::var("MARMOR_BENCH_SVG") {
        std::fs::write(&path, plot(name, &contestants, &curves, seconds)).unwrap();
    }
}

/// When a curve reaches `target`: between its points along a line in logarithms, beyond the last one as 1/time. None
/// where that would be more than a hundredfold, or the curve lies flat.
fn time_to(curve: &[(f64, f64)], target: f64) -> Option<f64> {
    let after = curve.iter().position(|(_, e)| *e <= target);
    match after {
        Some(0) => Some(curve[0].0),
        Some(i) => {
            let ((s0, e0), (s1, e1)) = (curve[i - 1], curve[i]);
            Some(s0 * (s1 / s0).powf((e0 / target).ln() / (e0 / e1).ln()))
        }
        None => {
            let (seconds, error) = *curve.last()?;
            let (before_seconds, before) = curve[curve.len() / 2];
            let falls = before / error > (seconds / before_seconds).sqrt();
            (falls && error < 100.0 * target).then(|| seconds * error / target)
        }
    }
}

fn plot(name: &str, contestants: &[Contestant], curves: &[Vec<(f64, f64)>], seconds: f64) -> String {
    let errors = || curves.iter().flatten().map(|(_, e)| *e).filter(|e| e.is_finite());
    let below = |v: f64| 10_f64.powf(v.log10().floor());
    let stroke = |i: usize| Stroke::Line { colour: COLOURS[i], dash: DASHES[i] };
    let series = |(i, curve): (usize, &Vec<(f64, f64)>)| Series {
        stroke: stroke(i),
        points: curve.iter().map(|&(s, e)| (s, e, 0.0)).collect(),
    };
    let panel = Panel {
        title: String::new(),
        x: Axis { label: "seconds of passes".into(), min: 0.05, max: 1.2 * seconds, scale: Scale::Log },
        y: Axis {
            label: "relMSE of the interior, without the worst 0.1 %".into(),
            min: below(errors().fold(f64::INFINITY, f64::min)),
            max: 10.0 * below(errors().fold(0.0, f64::max)),
            scale: Scale::Log,
        },
        series: curves.iter().enumerate().map(series).collect(),
        notes: Vec::new(),
    };
    let threads = rayon::current_num_threads();
    Figure {
        width: None,
        ends: Vec::new(),
        title: "Estimators of the sample cache: error against time".into(),
        subtitle: format!("{name}, {threads} threads, all by turns in one run"),
        rows: vec![Row { height: 420.0, panels: vec![panel] }],
        legend: contestants.iter().enumerate().map(|(i, c)| (stroke(i), c.name.into())).collect(),
        footnotes: vec!["cargo bench --features embree --bench converge_estimators".into()],
    }
    .to_svg()
}

/// Equal time for media whose light travels from across the object to less than a thousandth of it; then what an opaque
/// body takes, which no sampling of light under the surface can be better than by much.
fn stiff(seconds: f64) {
    println!("media of skim milk's colour with their coefficients times k, {seconds:.1} s of passes each:");
    let mut family = Vec::new();
    for k in STIFFNESS {
        let list = |v: [f64; 3]| v.map(|v| format!("{}", v * k)).join(", ");
        let (s, a) = (list([0.70, 1.22, 1.90]), list([0.0014, 0.0025, 0.0142]));
        let scene = scene(&format!("type = \"translucent\"\nsigma_s_prime = [{s}]\nsigma_a = [{a}]\neta = 1.3\n"));
        let Some(t) = &scene.materials[scene.objects[0].material].surface.inside else { continue };
        let area = AreaTable::new(&scene.objects[0].mesh).unwrap().area();
        let stiffness = t.medium.sigma_tr().0.map(|s| area * f64::from(s).powi(2) / std::f64::consts::TAU);
        with_bench(&scene, |bench| {
            let reference = bench.reference(REFERENCE * seconds);
            let options = options(Estimator::Cut, 1);
            let mut run = bench.run();
            bench.go_on(&Subsurface::new(bench.view.scene, options).unwrap(), 1, &mut run, None, seconds);
            let (gather, error) = (run.spent.tally.gather, bench.error(&run.film, &reference));
            println!(
                "    k = {k:7}: N = {:.1e} {:.1e} {:.1e}, {} passes, relMSE {error:.2e}, {:.1} near-field points an exit",
                stiffness[0],
                stiffness[1],
                stiffness[2],
                run.film.passes(),
                gather.near_points as f64 / gather.exits as f64
            );
            if FAMILY.contains(&k) {
                family.push(error);
            }
        });
    }
    let (least, most) = family.iter().fold((f64::INFINITY, 0.0_f64), |(l, m), &e| (l.min(e), m.max(e)));
    println!(
        "    {} media from k = {} to {}: the largest error over the least {:.1} in relMSE, {:.1} in relative RMS",
        family.len(),
        FAMILY.start(),
        FAMILY.end(),
        most / least,
        (most / least).sqrt()
    );
    with_bench(&scene("type = \"diffuse\"\nalbedo = 0.5\n"), |bench| {
        let method = Direct::new(bench.view.scene, 1).unwrap();
        let [mut reference, mut run] = [bench.run(), bench.run()];
        bench.go_on(&method, 99, &mut reference, None, REFERENCE * seconds);
        bench.go_on(&method, 1, &mut run, None, seconds);
        let error = bench.error(&run.film, &reference.film.image());
        println!("    opaque, `direct`: {} passes, relMSE {error:.2e}", run.film.passes());
    });
}
