//! `marmor render`: from a scene file to pictures. Reads in the order it runs.

use super::INTERRUPTED;
use super::observers::{Measure, OwnError, ProgressDisplay, Records, Verbosity, error_figures};
use super::setup::{Method, MethodArgs, prepare};
use super::stats::{self, Stats};
use marmor::film::{
    Attribute, Film, Image, Layer, Metadata, PngOptions, Window, check_writable, save_with_layers, source_date_epoch,
    variance,
};
use marmor::integrator::{Integrator, View};
use marmor::query;
use marmor::render::{self, Job, Observer, Outcome, Stop};
use marmor::report::RecordFile;
use marmor::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Samples per pixel where neither scene nor options say.
const DEFAULT_SPP: u32 = 64;

#[derive(clap::Args)]
pub struct Args {
    /// The scene file
    scene: PathBuf,
    /// Where to write; the ending .exr or .png decides the format; may be given more than once
    /// [default: NAME.exr and NAME.png here, after the scene]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    method: MethodArgs,
    /// Samples per pixel [default: the scene's, else 64]
    #[arg(long, value_name = "N")]
    spp: Option<u32>,
    /// Stop after this time of rendering, such as 30s, 5m or 500ms
    #[arg(long, value_name = "TIME", value_parser = duration)]
    time: Option<Duration>,
    /// Stop when the estimated relMSE is down to this, such as 1e-3
    #[arg(long, value_name = "E", value_parser = positive)]
    target_error: Option<f64>,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Render these pixels only: x0,y0,x1,y1, the last two exclusive
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = window)]
    crop: Option<Window>,
    /// Further layers in the EXR, separated by commas: variance
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    layers: Vec<LayerName>,
    /// Brighten or darken the PNG by this many stops [default: the scene's, else 0]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// Measure the error against this EXR after each pass
    #[arg(long, value_name = "EXR")]
    reference: Option<PathBuf>,
    /// Write one JSON line per pass
    #[arg(long, value_name = "JSONL")]
    records: Option<PathBuf>,
    /// Write what was built, what it cost and how fast it went
    #[arg(long, value_name = "JSON")]
    stats: Option<PathBuf>,
    /// Say what was built and what was left out
    #[arg(short, long)]
    verbose: bool,
    /// Say nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    quiet: bool,
}

/// Runs the command.
pub fn run(args: Args) -> Result<ExitCode> {
    let begin = Instant::now();
    let verbosity = match (args.quiet, args.verbose) {
        (true, _) => Verbosity::Quiet,
        (_, true) => Verbosity::Verbose,
        _ => Verbosity::Normal,
    };
    let outputs = if args.output.is_empty() { default_outputs(&args.scene) } else { args.output.clone() };
    for path in &outputs {
        check_writable(path)?;
    }
    let reference = args.reference.as_deref().map(Image::read_exr).transpose()?;
    let mut builder = rayon::ThreadPoolBuilder::new();
    if let Some(threads) = args.threads {
        builder = builder.num_threads(threads.max(1));
    }
    let pool = builder.build().map_err(|e| Error::usage(format!("cannot start threads: {e}")))?;

    pool.install(|| {
        let prepared = prepare(&args.scene, &args.method)?;
        let scene = &prepared.scene;
        for warning in &scene.warnings {
            if verbosity > Verbosity::Quiet {
                eprintln!("warning: {warning}");
            }
        }
        let meshes: Vec<_> = scene.objects.iter().map(|o| &o.mesh).collect();
        let rays = query::build(prepared.backend, &meshes)?;
        let view = View { scene, rays: &*rays };
        let resolution = scene.camera.resolution;
        let mut film = Film::new(resolution, args.crop.unwrap_or(Window::full(resolution)))?;
        let cancel = cancel_on_signals();
        let job = Job {
            seed: prepared.seed,
            passes: Some(args.spp.or(prepared.file.render.spp).unwrap_or(DEFAULT_SPP))
                .filter(|_| args.spp.is_some() || args.time.is_none() && args.target_error.is_none()),
            time: args.time,
            cancel: &cancel,
        };
        let mut task = Task {
            args: &args,
            verbosity,
            begin,
            reference,
            description: rays.description(),
            effective: prepared.file.effective(),
            own: OwnError::default(),
        };
        if verbosity > Verbosity::Quiet {
            let triangles: usize = scene.objects.iter().map(|o| o.mesh.triangles.len()).sum();
            eprintln!(
                "{}: {} objects, {triangles} triangles, {}x{} pixels, {} on {}, {} threads",
                scene.name,
                scene.objects.len(),
                resolution[0],
                resolution[1],
                prepared.method.name(),
                task.description,
                rayon::current_num_threads()
            );
        }
        let finished = match &prepared.method {
            Method::AmbientOcclusion(method) => task.run(method, view, &job, &mut film)?,
            Method::Direct(method) => task.run(method, view, &job, &mut film)?,
            Method::Subsurface(method) => task.run(&**method, view, &job, &mut film)?,
        };
        if film.passes() == 0 {
            return Err(Error::usage("0 samples per pixel make no picture; ask for at least 1 with --spp"));
        }
        let metadata = Metadata {
            samples_per_pixel: film.passes(),
            render_seconds: Some(finished.seconds.total()),
            created: source_date_epoch(),
            attributes: attributes(&prepared, &film, &task.description),
        };
        let exposure = args.exposure.or(prepared.file.render.exposure).unwrap_or(0.0);
        let image = film.image();
        let layers = layers(&args.layers, &film)?;
        for path in &outputs {
            save_with_layers(&image, &layers, path, &metadata, PngOptions { exposure })?;
        }
        task.tell(&finished, &film, &outputs)?;
        Ok(if finished.stop == Stop::Cancelled { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
    })
}

/// One render and what is said about it.
struct Task<'a> {
    args: &'a Args,
    verbosity: Verbosity,
    begin: Instant,
    reference: Option<Image>,
    description: String,
    effective: String,
    own: OwnError,
}

impl Task<'_> {
    fn run<I: Integrator>(&mut self, method: &I, view: View<'_>, job: &Job<'_>, film: &mut Film) -> Result<Outcome> {
        let parts = method.parts(view.scene);
        if self.verbosity == Verbosity::Verbose {
            for part in &parts {
                eprintln!("  {} {}: {}", if part.built { "built   " } else { "left out" }, part.name, part.why);
            }
        }
        let seconds_setup = self.begin.elapsed().as_secs_f64();
        let (target, each_pass) = (self.args.target_error, self.args.records.is_some());
        let mut measure = Measure::new(self.own.clone(), each_pass, target);
        let mut display = ProgressDisplay::new(self.verbosity, self.own.clone(), target);
        let mut records = match &self.args.records {
            Some(path) => Some(Records {
                file: RecordFile::create(path)?,
                seconds_setup,
                reference: self.reference.clone(),
                own: self.own.clone(),
            }),
            None => None,
        };
        let mut observers: Vec<&mut dyn Observer> = vec![&mut measure, &mut display];
        if let Some(records) = &mut records {
            observers.push(records);
        }
        let outcome = render::run(method, view, job, film, &mut observers)?;
        display.finish();
        if let Some(path) = &self.args.stats {
            let stats = Stats {
                effective: &self.effective,
                scene: view.scene,
                backend: &self.description,
                seconds_setup,
                parts: &parts,
                outcome: &outcome,
                film,
            };
            stats::write(path, &stats)?;
        }
        Ok(outcome)
    }

    /// What came out, in a few lines.
    fn tell(&self, outcome: &Outcome, film: &Film, outputs: &[PathBuf]) -> Result<()> {
        if self.verbosity == Verbosity::Quiet {
            return Ok(());
        }
        let seconds = outcome.seconds;
        eprintln!(
            "{} passes in {:.1} s (cache {:.1} s, gather {:.1} s), {:.1} s in all{}",
            film.passes(),
            seconds.total(),
            seconds.cache,
            seconds.gather,
            self.begin.elapsed().as_secs_f64(),
            match outcome.stop {
                Stop::Passes => "",
                Stop::Time => "; stopped by --time",
                Stop::Satisfied => "; reached --target-error",
                Stop::Cancelled => "; interrupted",
            }
        );
        if let Some(own) = self.own.relmse() {
            let interval =
                own.interval.map_or(String::new(), |[low, high]| format!(" (95 %: {low:.2e} to {high:.2e})"));
            eprintln!("estimated relMSE {:.2e}{interval}", own.value);
        }
        if let Some(reference) = &self.reference {
            let e = error_figures(&film.image(), reference)?;
            let relative = e.relmse.map_or(String::new(), |value| format!(", relMSE {value:.4e}"));
            let interval = e.interval.map_or(String::new(), |[low, high]| format!(" (95 %: {low:.4e} to {high:.4e})"));
            eprintln!("against the reference: RMSE {:.4e}{relative}{interval}", e.rmse);
        }
        if outcome.tally.gather.samples > 0 && outcome.tally.gather.lit == 0 {
            eprintln!(
                "warning: none of {} samples on translucent surfaces met any light: do the lights face them? (a light \
                 shines along its outward normal; `two_sided = true` lets it shine both ways)",
                outcome.tally.gather.samples
            );
        }
        let names: Vec<String> = outputs.iter().map(|p| p.display().to_string()).collect();
        eprintln!("wrote {}", names.join(", "));
        let counts = film.counts();
        let replay = counts.first_non_finite.map_or(String::new(), |bad| {
            let [x, y] = bad.pixel;
            format!(" (the first: pass {}, --crop {x},{y},{},{})", bad.pass, x + 1, y + 1)
        });
        eprintln!(
            "dropped {} non-finite samples{replay}; {} negative; none clamped",
            counts.non_finite, counts.negative
        );
        Ok(())
    }
}

/// What the EXR header says of its making.
fn attributes(prepared: &super::setup::Prepared, film: &Film, backend: &str) -> Vec<(String, Attribute)> {
    let text = |key: &str, value: String| (format!("marmor:{key}"), Attribute::Text(value));
    let counts = film.counts();
    let mut list = vec![
        text("scene", prepared.file.effective()),
        text("method", prepared.method.name().into()),
        text("backend", backend.into()),
        text("seed", prepared.seed.to_string()),
        text("sampleRange", format!("0..{}", film.passes())),
        text("nonFinite", counts.non_finite.to_string()),
        text("negative", counts.negative.to_string()),
    ];
    list.extend(prepared.method_attributes().into_iter().map(|(key, value)| text(key, value)));
    list
}

/// What an EXR may hold beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum LayerName {
    /// Variance of each pixel's mean
    Variance,
}

/// The layers asked for, each once.
fn layers(names: &[LayerName], film: &Film) -> Result<Vec<Layer>> {
    if !names.contains(&LayerName::Variance) {
        return Ok(Vec::new());
    }
    let image = variance(film).ok_or_else(|| Error::usage("--layers variance needs at least 2 samples per pixel"))?;
    Ok(vec![Layer { name: "Variance".into(), image }])
}

/// NAME.exr and NAME.png in the current folder; NAME is the scene file's, or its folder's for a plain `scene.toml`.
fn default_outputs(scene: &Path) -> Vec<PathBuf> {
    let stem = |p: &Path| p.file_stem().map(|s| s.to_string_lossy().into_owned());
    let mut name = stem(scene).unwrap_or_else(|| "render".into());
    if name == "scene"
        && let Some(folder) = scene.parent().and_then(stem)
    {
        name = folder;
    }
    ["exr", "png"].map(|ending| PathBuf::from(format!("{name}.{ending}"))).to_vec()
}

/// SIGINT and SIGTERM set the flag; a second one ends the program at once.
pub(super) fn cancel_on_signals() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        // In this order: the first signal finds the flag unset and only sets it.
        let both = signal_hook::flag::register_conditional_shutdown(signal, 130, Arc::clone(&flag))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&flag)));
        if let Err(error) = both {
            eprintln!("warning: cannot listen for signal {signal}, an interrupt will lose the picture: {error}");
        }
    }
    flag
}

/// `30s`, `5m`, `2h`, `500ms`, or a plain number of seconds.
pub(super) fn duration(text: &str) -> std::result::Result<Duration, String> {
    let units = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0), ("", 1.0)];
    let (number, factor) = units
        .into_iter()
        .find_map(|(unit, factor)| text.strip_suffix(unit).map(|number| (number, factor)))
        .unwrap_or((text, 1.0));
    match number.trim().parse::<f64>() {
        Ok(n) if n > 0.0 && n * factor < 1e9 => Ok(Duration::from_secs_f64(n * factor)),
        _ => Err("expected a time above 0 such as 30s, 5m or 500ms".into()),
    }
}

/// A number above 0.
fn positive(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(n) if n > 0.0 && n.is_finite() => Ok(n),
        _ => Err("expected a number above 0 such as 1e-3".into()),
    }
}

/// `x0,y0,x1,y1`.
fn window(text: &str) -> std::result::Result<Window, String> {
    let numbers: Vec<u32> = text.split(',').map_while(|n| n.trim().parse().ok()).collect();
    match numbers[..] {
        [x0, y0, x1, y1] if x0 < x1 && y0 < y1 => Ok(Window { x0, y0, x1, y1 }),
        _ => Err("expected x0,y0,x1,y1 with x0 < x1 and y0 < y1".into()),
    }
}
