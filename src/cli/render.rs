//! `marmor render`: from a scene file to pictures. Reads in the order it runs.

use super::INTERRUPTED;
use super::advice::Advice;
use super::duration::duration;
use super::files::{Files, Remedy};
use super::keep::{FilmFile, KeepArgs, Keeper, cancel_on_signals};
use super::layers::{LayerName, Layers};
use super::observers::{Measure, OwnError, ProgressDisplay, Records, Verbosity, check_reference, error_figures};
use super::outputs::Outputs;
use super::setup::{Method, MethodArgs, prepare};
use super::stats::{self, Stats};
use super::{read_picture, replay, threads};
use marmor::film::{Film, Format, Image, Window, check_replaceable, check_writable};
use marmor::integrator::{Integrator as _, View, lost};
use marmor::render::{self, Job, Observer, Options, Outcome, Spent, Stop, no_light};
use marmor::report::RecordFile;
use marmor::scene::{Scene, SceneFile};
use marmor::words::counted;
use marmor::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

#[derive(clap::Args)]
pub struct Args {
    /// The scene file
    scene: PathBuf,
    /// Where to write; the ending .exr, .png or .film decides the format; may be given more than once
    /// [default: NAME.exr and NAME.png here, after the scene; with --samples-range NAME.A-B.film]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    keep: KeepArgs,
    /// Samples per pixel [default: the scene's, else 64]
    #[arg(long, value_name = "N")]
    spp: Option<u32>,
    /// Stop after this time of rendering in this run, such as 30s, 5m or 500ms; what --resume goes on from is not in it
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
    /// Further layers in the EXR, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    layers: Vec<LayerName>,
    /// Brighten or darken the PNG by this many stops [default: the scene's, else 0]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = stops)]
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
    /// Exit with code 5 if any contribution was not finite, negative, clamped or dropped, or more than 0.1 % of the paths in bodies
    /// were lost; the pictures are written
    #[arg(long)]
    strict: bool,
    /// Print one sample of this pixel and what it meets, instead of rendering; see --pass
    #[arg(long, value_name = "X,Y", value_parser = pixel)]
    pixel: Option<[u32; 2]>,
    /// The pass of --pixel, from 0
    #[arg(long, value_name = "N", requires = "pixel", default_value_t = 0)]
    pass: u32,
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
    let outputs = if args.output.is_empty() { default_outputs(&args) } else { args.output.clone() };
    let film_file = args.keep.film_file(&outputs);
    if args.pixel.is_none() {
        check_files(&args, &outputs, &film_file)?;
    }
    let reference = args.reference.as_deref().map(|path| Ok((path, read_picture(path, None)?))).transpose()?;

    threads::with(args.threads, || {
        let file = args.method.read(&args.scene)?;
        let resolution = file.camera.resolution;
        let window = args.crop.unwrap_or(Window::full(resolution));
        if args.pixel.is_none() {
            collisions(&args, &outputs, &film_file, &file)?;
        }
        // Before meshes are read, which may take long.
        Film::check(resolution, window)?;
        if let Some((path, image)) = &reference {
            check_reference(path, image, resolution, window)?;
        }
        let reference = reference.map(|(_, image)| image);
        let passes = match &args.keep.samples_range {
            Some(range) => Some(range.end),
            None if args.target_error.is_some() && args.spp.is_none() => None,
            None => Options { spp: args.spp, time: args.time, ..args.method.options() }.passes(&file)?,
        };
        let prepared = prepare(file, &args.method)?;
        let scene = &prepared.scene;
        for warning in &scene.warnings {
            if verbosity > Verbosity::Quiet {
                eprintln!("warning: {warning}");
            }
        }
        let rays = scene.rays(prepared.backend)?;
        let view = View { scene, rays: &*rays };
        let cancel = cancel_on_signals();
        let job = Job { seed: prepared.seed, passes, time: args.time, cancel: &cancel };
        if let Some(pixel) = args.pixel {
            return replay::run(&prepared, view, &job, pixel, args.pass);
        }
        let exposure = args.exposure.or(prepared.file.render.exposure).unwrap_or(0.0);
        let layers = Layers::new(&args.layers, Some((&prepared, view)))?;
        layers.check(args.keep.samples_range.clone().unwrap_or(0..passes.unwrap_or(u32::MAX)))?;
        let outputs = Outputs::new(&prepared, &rays.description(), window, outputs, exposure, layers);
        let (mut film, spent, mut keeper) = args.keep.start(&outputs, &film_file, &prepared.file, window, passes)?;
        let earlier = spent.seconds.total();
        if film.passes() > 0 && verbosity > Verbosity::Quiet {
            let path = film_file.path.display();
            let passes = counted(film.passes(), "pass", "passes");
            eprintln!("going on from {path} after {passes} and {earlier:.1} s of rendering");
        }
        let mut task = Task {
            args: &args,
            verbosity,
            begin,
            reference,
            description: rays.description(),
            effective: prepared.file.effective(),
            own: OwnError::default(),
            advice: None,
            earlier,
            failed: None,
        };
        if verbosity > Verbosity::Quiet {
            let triangles: usize = scene.objects.iter().map(|o| o.mesh.triangles.len()).sum();
            eprintln!(
                "{}: {}, {}, {}x{} pixels, {} on {}, {}",
                scene.name,
                counted(scene.objects.len(), "object", "objects"),
                counted(triangles, "triangle", "triangles"),
                resolution[0],
                resolution[1],
                prepared.method.name(),
                task.description,
                counted(rayon::current_num_threads(), "thread", "threads")
            );
        }
        let silent = verbosity == Verbosity::Quiet;
        let advice = (!silent || args.stats.is_some()).then(|| Advice::before_render(&prepared, view, window, silent));
        task.advice = advice.as_ref();
        let finished = task.run(&prepared.method, view, &job, &mut film, spent, &mut keeper)?;
        let spent = Spent { setup: keeper.setup, seconds: finished.seconds, tally: finished.tally };
        match outputs.save(&film, &spent) {
            Ok(said) if verbosity > Verbosity::Quiet => said.iter().for_each(|line| eprintln!("{line}")),
            Ok(_) => {}
            // Where a picture fails the film file may still come through.
            Err(error) => return Err(keeper.rescue(error, &film, &spent)),
        }
        let kept = keeper.finish(finished.stop, &film, &spent)?;
        let odd = odd(&film, &spent).map(|cause| (cause, replay_line(&args, &film, prepared.seed)));
        task.tell(scene, &finished, &film, &outputs.paths, kept, odd.as_ref())?;
        let failed = task.failed.take();
        if finished.stop == Stop::Cancelled {
            failed.iter().for_each(|error| eprintln!("marmor: {error}"));
            return Ok(ExitCode::from(INTERRUPTED));
        }
        if let Some((cause, replay)) = odd.filter(|_| args.strict) {
            failed.iter().for_each(|error| eprintln!("marmor: {error}"));
            return Err(Error::new(ErrorKind::Numeric, format!("--strict: {cause}; to look at one: {replay}")));
        }
        if args.strict && spent.tally.walk.lost_many() {
            failed.iter().for_each(|error| eprintln!("marmor: {error}"));
            let why = lost(&spent.tally.walk, scene).join("; ");
            return Err(Error::new(ErrorKind::Numeric, format!("--strict: {why}")));
        }
        // The pictures are there, and something else that was asked for is not.
        failed.map_or(Ok(ExitCode::SUCCESS), Err)
    })
}

/// Whether everything can be written, and what is there already may be.
fn check_files(args: &Args, outputs: &[PathBuf], film_file: &FilmFile) -> Result<()> {
    outputs.iter().try_for_each(|path| check_writable(path))?;
    args.stats.iter().try_for_each(|path| check_replaceable(path))?;
    args.keep.check(film_file)?;
    let is = |path: &PathBuf, kind| Format::of(path).is_ok_and(|format| format == kind);
    if args.keep.samples_range.is_some() && !outputs.iter().any(|path| is(path, Format::Film)) {
        eprintln!("warning: `marmor merge` needs film files: add -o NAME.film");
    }
    if !args.layers.is_empty() && !outputs.iter().any(|path| is(path, Format::Exr)) {
        return Err(Error::usage("--layers: only an EXR holds layers; add -o NAME.exr"));
    }
    Ok(())
}

/// Refuses outputs that are inputs, or each other; and records over a file of something else.
fn collisions(args: &Args, outputs: &[PathBuf], film_file: &FilmFile, file: &SceneFile) -> Result<()> {
    let mut files = Files::default();
    files.reads_scene(file);
    args.reference.iter().for_each(|path| files.reads("the reference", path));
    for path in outputs {
        let what = if Format::of(path)? == Format::Film { "the film file" } else { "the picture" };
        files.writes(what, path, Remedy::Name("-o"));
    }
    args.records.iter().for_each(|path| files.writes("the file of --records", path, Remedy::Name("--records")));
    args.stats.iter().for_each(|path| files.writes("the file of --stats", path, Remedy::Name("--stats")));
    if !outputs.contains(&film_file.path) {
        files.writes("the film file of an interrupted render", &film_file.path, Remedy::Name("-o"));
    }
    files.check()?;
    args.records.iter().try_for_each(|path| RecordFile::check(path))
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
    advice: Option<&'a Advice<'a>>,
    /// Time of rendering in earlier runs [s].
    earlier: f64,
    /// What could not be written beside the pictures.
    failed: Option<Error>,
}

impl Task<'_> {
    fn run(
        &mut self,
        method: &Method,
        view: View<'_>,
        job: &Job<'_>,
        film: &mut Film,
        spent: Spent,
        keeper: &mut Keeper<'_>,
    ) -> Result<Outcome> {
        let parts = method.parts(view.scene);
        if self.verbosity == Verbosity::Verbose {
            for part in &parts {
                eprintln!("  {} {}: {}", if part.built { "built   " } else { "left out" }, part.name, part.why);
            }
        }
        let seconds_setup = spent.setup + self.begin.elapsed().as_secs_f64();
        keeper.setup = seconds_setup;
        let (target, each_pass) = (self.args.target_error, self.args.records.is_some());
        let mut measure = Measure::new(self.own.clone(), method.lights(view.scene), each_pass, target);
        let mut display = ProgressDisplay::new(self.verbosity, self.own.clone(), target);
        let mut records = match &self.args.records {
            Some(path) => {
                let file = RecordFile::go_on(path, film.passes())?;
                let (reference, own) = (self.reference.clone(), self.own.clone());
                Some(Records { file, seconds_setup, reference, own, failed: None })
            }
            None => None,
        };
        let mut observers: Vec<&mut dyn Observer> = vec![&mut measure, &mut display];
        if let Some(records) = &mut records {
            observers.push(records);
        }
        observers.push(keeper);
        let outcome = render::resume(method, view, job, film, spent, &mut observers)?;
        display.finish();
        self.failed = records.and_then(Records::failure);
        if let Some(path) = &self.args.stats {
            let stats = Stats {
                effective: &self.effective,
                scene: view.scene,
                backend: &self.description,
                seconds_setup,
                parts: &parts,
                advice: self.advice,
                outcome: &outcome,
                film,
            };
            if let Err(error) = stats::write(path, &stats) {
                self.failed.get_or_insert(error);
            }
        }
        Ok(outcome)
    }

    /// What came out, in a few lines.
    fn tell(
        &self,
        scene: &Scene,
        outcome: &Outcome,
        film: &Film,
        outputs: &[PathBuf],
        kept: Option<&FilmFile>,
        odd: Option<&(String, String)>,
    ) -> Result<()> {
        if self.verbosity == Verbosity::Quiet {
            return Ok(());
        }
        let seconds = outcome.seconds;
        eprintln!(
            "{} in {:.1} s (cache {:.1} s, gather {:.1} s){}, {:.1} s in all{}",
            counted(film.passes(), "pass", "passes"),
            seconds.total(),
            seconds.cache,
            seconds.gather,
            if self.earlier > 0.0 {
                format!(", {:.1} s of them in this run", seconds.total() - self.earlier)
            } else {
                String::new()
            },
            self.begin.elapsed().as_secs_f64(),
            match outcome.stop {
                Stop::Passes => "",
                Stop::Time => "; stopped by --time",
                Stop::Satisfied => "; reached --target-error",
                Stop::Cancelled => "; interrupted",
            }
        );
        eprintln!("{}", self.own.text(film.passes()));
        if let Some(reference) = &self.reference {
            let e = error_figures(&film.image(), reference)?;
            let relative = e.relmse.map_or(String::new(), |value| format!(", relMSE {value:.4e}"));
            let interval = e
                .interval
                .map_or(" (interval unknown)".into(), |[low, high]| format!(" (95 %: {low:.4e} to {high:.4e})"));
            eprintln!("against the reference: RMSE {:.4e}{relative}{interval}", e.rmse);
        }
        no_light(scene, &outcome.tally).iter().for_each(|line| eprintln!("warning: {line}"));
        let level = if outcome.tally.walk.lost_many() { "warning: " } else { "" };
        for sentence in lost(&outcome.tally.walk, scene) {
            eprintln!("{level}{sentence}");
        }
        let names: Vec<String> = outputs.iter().map(|p| p.display().to_string()).collect();
        eprintln!("wrote {}", names.join(", "));
        if let Some(kept) = kept {
            let path = kept.path.display();
            match &kept.passed_by {
                None => eprintln!("wrote {path}: the same call with --resume goes on from it"),
                Some(_) => {
                    let names = names.join(" -o ");
                    eprintln!("wrote {path}: the same call with -o {names} -o {path} --resume goes on from it");
                }
            }
        }
        let spent = Spent { setup: 0.0, seconds: outcome.seconds, tally: outcome.tally };
        eprintln!("{}", odd_line(film, &spent, odd.map(|(_, replay)| replay.as_str())));
        Ok(())
    }
}

/// The last line of the log: every count of odd contributions, with a call that shows one.
pub fn odd_line(film: &Film, spent: &Spent, replay: Option<&str>) -> String {
    let (counts, gather) = (film.counts(), &spent.tally.gather);
    let replay = replay.map_or(String::new(), |line| format!(" (look at one: {line})"));
    format!(
        "dropped {} and {}; {} negative; {} of S_d clamped at 0{replay}",
        counted(counts.non_finite, "non-finite sample", "non-finite samples"),
        counted(gather.non_finite, "cached one", "cached ones"),
        counts.negative,
        counted(gather.clamped, "value", "values")
    )
}

/// The causes that `--strict` does not let pass, with their counts.
fn odd(film: &Film, spent: &Spent) -> Option<String> {
    let (counts, gather) = (film.counts(), &spent.tally.gather);
    let causes = [
        (counts.non_finite, "samples dropped because they are not finite"),
        (gather.non_finite, "cached samples dropped because they are not finite"),
        (counts.negative, "samples below zero"),
        (gather.clamped, "values of S_d clamped at 0"),
    ];
    let causes: Vec<String> = causes.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    (!causes.is_empty()).then(|| causes.join(", "))
}

/// A call that shows an odd sample: the first that is not finite, or below zero; else any of the first pass.
fn replay_line(args: &Args, film: &Film, seed: u64) -> String {
    let counts = film.counts();
    let window = film.window();
    let (pass, [x, y]) = counts
        .first_non_finite
        .or(counts.first_negative)
        .map_or((film.ranges()[0].start, [window.x0, window.y0]), |bad| (bad.pass, bad.pixel));
    let options = args.method.words().iter().map(|word| format!(" {word}")).collect::<String>();
    format!("marmor render {}{options} --pixel {x},{y} --pass {pass} --seed {seed}", args.scene.display())
}

/// NAME.exr and NAME.png in the current folder; NAME is the scene file's, or its folder's for a plain `scene.toml`.
fn default_outputs(args: &Args) -> Vec<PathBuf> {
    let scene = &args.scene;
    let stem = |p: &Path| p.file_stem().map(|s| s.to_string_lossy().into_owned());
    let mut name = stem(scene).unwrap_or_else(|| "render".into());
    if name == "scene"
        && let Some(folder) = scene.parent().and_then(stem)
    {
        name = folder;
    }
    if let Some(range) = &args.keep.samples_range {
        return vec![PathBuf::from(format!("{name}.{}-{}.film", range.start, range.end))];
    }
    ["exr", "png"].map(|ending| PathBuf::from(format!("{name}.{ending}"))).to_vec()
}

/// Stops that a picture can be brightened or darkened by.
pub(super) fn stops(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(n) if n.abs() <= 64.0 => Ok(n),
        _ => Err("expected stops from -64 to 64".into()),
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

/// `x,y`.
fn pixel(text: &str) -> std::result::Result<[u32; 2], String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| "expected x,y, two whole numbers".into())
}
