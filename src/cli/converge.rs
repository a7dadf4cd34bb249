//! `marmor converge`: error against run time, for several methods on one scene. Reads in the order it runs.

use super::keep::cancel_on_signals;
use super::observers::{Records, error_figures};
use super::race::{Entrant, Runner, command, machine, race};
use super::render::duration;
use super::setup::MethodArgs;
use marmor::film::{Image, Window, png_bytes, write_atomically};
use marmor::report::{Convergence, ErrorCurve, Picture, Record, RecordFile, Reference};
use marmor::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

#[derive(clap::Args)]
#[command(after_help = "\
A method is one or more words joined by `+`: an estimator, a model, a backend, a method of light transport,
`as_notes`, a number of cached samples a pass, or KEY=VALUE of the scene. For instance
    marmor converge scene.toml --methods cut,all,notes,cut+65536+embree -o report
renders with each in turns until each has used the time budget, and writes report/index.html, the curves as CSV
and SVG, and the records of each method.")]
pub struct Args {
    /// The scene file
    scene: PathBuf,
    /// Methods to compare, separated by commas
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', required = true)]
    methods: Vec<String>,
    /// Measure against this EXR [default: a reference is rendered with the scene's own method and another seed]
    #[arg(long, value_name = "EXR")]
    reference: Option<PathBuf>,
    /// Time of rendering for each method, such as 20s
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "20s")]
    time_budget: Duration,
    /// Time of rendering for the reference [default: three times the budget of a method]
    #[arg(long, value_name = "TIME", value_parser = duration)]
    reference_budget: Option<Duration>,
    /// Folder for the results; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    method: MethodArgs,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Runs the command.
pub fn run(args: Args) -> Result<ExitCode> {
    std::fs::create_dir_all(&args.output).map_err(|e| Error::file(&args.output, "make the folder", e))?;
    let mut builder = rayon::ThreadPoolBuilder::new();
    if let Some(threads) = args.threads {
        builder = builder.num_threads(threads.max(1));
    }
    let pool = builder.build().map_err(|e| Error::usage(format!("cannot start threads: {e}")))?;
    pool.install(|| converge(&args))
}

fn converge(args: &Args) -> Result<ExitCode> {
    let say = |text: &str| {
        if !args.quiet {
            eprintln!("{text}");
        }
    };
    let entrants = args
        .methods
        .iter()
        .map(|spec| Entrant::new(spec, &args.scene, &args.method.variant(spec)?))
        .collect::<Result<Vec<_>>>()?;
    let mut runners = entrants.iter().map(Runner::new).collect::<Result<Vec<_>>>()?;
    let cancel = cancel_on_signals();
    let budget = args.time_budget.as_secs_f64();
    let resolution = runners[0].film.resolution();
    if let Some(other) = runners.iter().find(|r| r.film.resolution() != resolution) {
        let name = &other.entrant.name;
        return Err(Error::usage(format!("`{name}` has another resolution; pictures of one size are compared")));
    }

    let reference_budget = args.reference_budget.map_or(3.0 * budget, |t| t.as_secs_f64());
    if args.reference.is_none() {
        say(&format!("reference: {reference_budget:.0} s"));
    }
    let (image, reference) = reference(args, reference_budget, &cancel)?;

    let name = |i: usize| file_name(&entrants[i].name);
    let mut records = Vec::new();
    for (i, runner) in runners.iter().enumerate() {
        let file = RecordFile::create(&args.output.join(format!("{}.jsonl", name(i))))?;
        records.push((file, runner.seconds_setup));
    }
    let mut curves: Vec<ErrorCurve> = runners
        .iter()
        .map(|r| ErrorCurve { name: r.entrant.name.clone(), seconds_setup: r.seconds_setup, points: Vec::new() })
        .collect();
    let (mut next, mut told) = (vec![2; runners.len()], 0);
    say(&format!("{} methods in turns, {budget:.0} s each", runners.len()));
    let whole = race(&mut runners, budget, &cancel, |i, runner| {
        let passes = runner.film.passes();
        // Measuring takes milliseconds; steps of 3 % leave out nothing that a plot shows.
        if passes >= next[i] || runner.seconds.total() >= budget {
            next[i] = passes + 1 + passes / 32;
            curves[i].points.extend(runner.measure(&image)?);
            let record = Records::record(runner.seconds_setup, runner.seconds, &runner.tally, &runner.film);
            let own = runner.own.last().as_ref().map(Into::into);
            records[i].0.append(&Record {
                error: Some(error_figures(&runner.film.image(), &image)?),
                own,
                ..record
            })?;
        }
        let tenth = (10.0 * runner.seconds.total() / budget) as u32;
        if tenth > told && !args.quiet {
            told = tenth;
            eprintln!("{:3} %", (10 * tenth).min(100));
        }
        Ok(())
    })?;
    if !whole {
        say("interrupted; the report is of what there is");
    }
    let report = Convergence {
        scene: scene_name(&args.scene),
        curves,
        reference,
        footnotes: vec![
            format!("Machine: {}.", machine()),
            format!("Command: {}", command()),
            format!("Pictures of {}x{} pixels.", resolution[0], resolution[1]),
        ],
    };
    let exposure = entrants[0].prepared.file.render.exposure.unwrap_or(0.0);
    write_report(&args.output, &report, &runners, &image, exposure)?;
    for sentence in report.sentences() {
        say(&sentence);
    }
    say(&format!("wrote {}", args.output.join("index.html").display()));
    Ok(if whole { ExitCode::SUCCESS } else { ExitCode::from(super::INTERRUPTED) })
}

/// The reference as given, or rendered with the scene's own method, another seed and a longer time.
fn reference(args: &Args, budget: f64, cancel: &AtomicBool) -> Result<(Image, Reference)> {
    if let Some(path) = &args.reference {
        let text = format!("{}, taken as exact", path.display());
        return Ok((Image::read_exr(path)?, Reference { text, noise: 0.0 }));
    }
    let seed = args.method.seed().unwrap_or(0) ^ 0x7265_6665;
    let entrant = Entrant::new("reference", &args.scene, &args.method.clone().seeded(seed))?;
    let mut runners = [Runner::new(&entrant)?];
    race(&mut runners, budget, cancel, |_, _| Ok(()))?;
    let [mut runner] = runners;
    let noise = runner.own.measure(&runner.film).and_then(|e| e.relmse).map_or(0.0, |e| e.value);
    let image = runner.film.image();
    let text = format!(
        "{}, another seed, {} samples of each pixel in {:.1} s; its own noise is relMSE {noise:.1e} and taken off",
        entrant.prepared.describe(),
        runner.film.passes(),
        runner.seconds.total()
    );
    let path = args.output.join("reference.exr");
    marmor::film::save(&image, &path, &Default::default(), Default::default())?;
    Ok((image, Reference { text, noise }))
}

fn write_report(
    folder: &Path,
    report: &Convergence,
    runners: &[Runner<'_>],
    truth: &Image,
    exposure: f64,
) -> Result<()> {
    let write = |name: &str, text: &str| write_atomically(&folder.join(name), |out| out.write_all(text.as_bytes()));
    write("converge.csv", &report.to_csv())?;
    for (figure, name) in report.figures().iter().zip(["error_seconds.svg", "error_samples.svg"]) {
        write(name, &figure.to_svg())?;
    }
    let images: Vec<Image> = runners.iter().map(|r| r.film.image()).collect();
    let part = telling_part(&images, truth);
    let picture = |image: &Image, caption: &str, note: String, pixelated| -> Result<Picture> {
        Ok(Picture { png: png_bytes(image, exposure)?, caption: caption.into(), note, pixelated })
    };
    let (mut crops, mut thumbnails) = (Vec::new(), Vec::new());
    for (image, runner) in images.iter().zip(runners) {
        let note = format!("{} samples, {:.1} s", runner.film.passes(), runner.seconds.total());
        crops.push(picture(&image.cropped(part), &runner.entrant.name, note.clone(), true)?);
        thumbnails.push(picture(&image.shrunk(THUMBNAIL), &runner.entrant.name, note, false)?);
    }
    crops.push(picture(&truth.cropped(part), "reference", String::new(), true)?);
    thumbnails.push(picture(&truth.shrunk(THUMBNAIL), "reference", String::new(), false)?);
    write("index.html", &report.page(&crops, &thumbnails).to_html())
}

/// Longest side of a thumbnail [pixels].
const THUMBNAIL: u32 = 256;
/// Side of the part that is shown pixel by pixel.
const PART: u32 = 96;

/// The part of the pictures with the most relative error in all of them together.
fn telling_part(images: &[Image], truth: &Image) -> Window {
    let w = truth.window;
    let level = truth.pixels.iter().map(|p| p[1]).sum::<f32>() / truth.pixels.len() as f32;
    let error = |window: Window| -> f32 {
        let mut sum = 0.0;
        for i in 0..window.area() {
            let [x, y] = window.pixel(i);
            let at = w.index(x, y);
            let r = truth.pixels[at][1];
            // Capped, so that single outliers do not choose.
            let one = |image: &Image| ((image.pixels[at][1] - r).powi(2) / (r * r + 0.1 * level * level)).min(0.1);
            sum += images.iter().map(one).sum::<f32>();
        }
        sum
    };
    let (wide, high) = (PART.min(w.width() as u32), PART.min(w.height() as u32));
    let steps = |from: u32, to: u32, size: u32| (from..=to - size).step_by((size / 2).max(1) as usize);
    steps(w.y0, w.y1, high)
        .flat_map(|y0| steps(w.x0, w.x1, wide).map(move |x0| Window { x0, y0, x1: x0 + wide, y1: y0 + high }))
        .map(|window| (window, error(window)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(w, |(window, _)| window)
}

/// The scene's name for people: its file, or its folder for a plain `scene.toml`.
pub fn scene_name(path: &Path) -> String {
    let stem = |p: &Path| p.file_stem().map(|s| s.to_string_lossy().into_owned());
    let name = stem(path).unwrap_or_default();
    if name == "scene" { path.parent().and_then(stem).unwrap_or(name) } else { name }
}

/// A method's words as a file name.
pub fn file_name(spec: &str) -> String {
    spec.chars().map(|c| if c.is_ascii_alphanumeric() || "+-_.".contains(c) { c } else { '_' }).collect()
}
