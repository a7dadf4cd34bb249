//! `marmor converge`: error against run time, for several methods on one scene. Reads in the order it runs.

use super::keep::cancel_on_signals;
use super::observers::{Records, error_figures, own_figures};
use super::race::{Failures, RaceArgs, Reference, Runner, command, machine, race, remarks, stored};
use marmor::Result;
use marmor::film::{Image, Truth, Window, png_bytes};
use marmor::report::{Convergence, ErrorCurve, Picture, Record, RecordFile};
use marmor::words::counted;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

#[derive(clap::Args)]
#[command(after_help = "\
A method is one or more words joined by `+`: an estimator, a model, a backend, a method of light transport,
`as_notes`, a number of cached samples a pass, or KEY=VALUE of the scene. For instance
    marmor converge scene.toml --methods cut,all,notes,cut+65536+embree -o report
renders with each in turns until each has used the time budget, and writes report/index.html, the curves as CSV
and SVG, and the records of each method.")]
pub struct Args {
    /// Methods to compare, separated by commas
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', required = true)]
    methods: Vec<String>,
    #[command(flatten)]
    race: RaceArgs,
}

/// Runs the command.
pub fn run(args: Args) -> Result<ExitCode> {
    args.race.run(|| converge(&args.race, &args.methods))
}

fn converge(args: &RaceArgs, methods: &[String]) -> Result<ExitCode> {
    let entrants = args.entrants(methods)?;
    let name = |i: usize| file_name(&entrants[i].name);
    let records_of = |i: usize| format!("{}.jsonl", name(i));
    let mut names: Vec<String> = FILES.map(String::from).into();
    names.extend((0..entrants.len()).map(records_of));
    names.extend(args.reference.is_none().then(|| "reference.exr".into()));
    args.check_files(&entrants, &names)?;
    let given = args.reference.as_deref().map(stored).transpose()?;
    let resolution = args.check_sizes(&entrants, given.as_ref().map(|r| &r.truth.image))?;
    let mut runners = entrants.iter().map(Runner::new).collect::<Result<Vec<_>>>()?;
    let cancel = cancel_on_signals();
    let budget = args.budget();
    let mut failed = Failures::default();
    let reference = reference(args, given, &cancel, &mut failed)?;
    let truth = &reference.truth;
    truth.check(&runners[0].film)?;

    let mut records = Vec::new();
    for (i, runner) in runners.iter().enumerate() {
        let file = RecordFile::create(&args.output.join(records_of(i)))?;
        records.push((file, runner.seconds_setup));
    }
    let mut curves: Vec<ErrorCurve> = runners
        .iter()
        .map(|r| ErrorCurve {
            name: r.entrant.name.clone(),
            seconds_setup: r.seconds_setup,
            points: Vec::new(),
            not_met: Vec::new(),
        })
        .collect();
    let (mut next, mut told) = (vec![1; runners.len()], 0);
    args.say(&format!("{} in turns, {budget} s each", counted(runners.len(), "method", "methods")));
    let whole = race(&mut runners, budget, &cancel, |i, runner| {
        let passes = runner.film.passes();
        // Measuring takes milliseconds; steps of 3 % leave out nothing that a plot shows.
        if passes >= next[i] || runner.seconds.total() >= budget {
            next[i] = passes + 1 + passes / 32;
            curves[i].points.push(runner.measure(truth)?);
            let record = Records::record(runner.seconds_setup, runner.seconds, &runner.tally, &runner.film);
            curves[i].not_met = runner.not_met();
            let not_met = curves[i].not_met.clone();
            let own = own_figures(runner.own.last(), &not_met);
            let error = Some(error_figures(&runner.film.image(), &truth.image)?);
            // A full disk costs the record, not the report.
            failed.note(records[i].0.append(&Record { error, own, not_met, ..record }));
        }
        let tenth = ((10.0 * runner.seconds.total() / budget) as u32).min(10);
        if tenth > told && !args.quiet {
            told = tenth;
            eprintln!("{:3} %", 10 * tenth);
        }
        Ok(())
    })?;
    if !whole {
        args.say("interrupted; the report is of what there is");
    }
    args.leave_out_empty(&mut runners);
    curves.retain(|curve| !curve.points.is_empty());
    let report = Convergence {
        scene: scene_name(&args.scene),
        curves,
        reference: reference.text.clone(),
        reference_tells_noise: truth.tells_noise(),
        remarks: remarks(&runners, &reference),
        footnotes: vec![
            format!("Machine: {}.", machine()),
            format!("Command: {}", command()),
            format!("Pictures of {}x{} pixels.", resolution[0], resolution[1]),
        ],
    };
    let exposure = entrants[0].prepared.file.render.exposure.unwrap_or(0.0);
    write_report(args, &report, &runners, &truth.image, exposure, &mut failed)?;
    args.conclude((&report.remarks, &report.sentences()), &report.to_csv(), whole, failed)
}

/// What a report has, beside records and reference.
const FILES: [&str; 4] = ["converge.csv", "error_seconds.svg", "error_samples.svg", "index.html"];

/// The reference as given, or rendered with the scene's own method, another seed and a longer time; with a line for people.
fn reference(
    args: &RaceArgs,
    given: Option<Reference>,
    cancel: &AtomicBool,
    failed: &mut Failures,
) -> Result<Reference> {
    if let Some(mut reference) = given {
        reference.text = format!("{}; {}", reference.text, noise_text(&reference.truth));
        return Ok(reference);
    }
    let budget = args.reference_budget();
    args.say(&format!("reference: {budget} s"));
    let entrant = args.reference_entrant("reference", None, 0x7265_6665)?;
    let mut runners = [Runner::new(&entrant)?];
    race(&mut runners, budget, cancel, |_, r| r.follow())?;
    let [mut runner] = runners;
    let truth = Truth::of_film(&runner.film, &mut runner.own);
    let text = format!("{}, {}; {}", entrant.prepared.describe(), runner.made(), noise_text(&truth));
    let path = args.output.join("reference.exr");
    failed.note(marmor::film::save(&truth.image, &path, &Default::default(), Default::default()));
    Ok(Reference { text, truth, made: None, remarks: runner.remarks() })
}

fn noise_text(truth: &Truth) -> String {
    match truth.noise().map(|noise| (noise.value, noise.interval)) {
        Some((value, Some([low, high]))) => {
            format!("its own noise is relMSE {value:.1e} (95 %: {low:.1e} to {high:.1e}) and taken off")
        }
        _ => "its own noise is not known and in every figure".into(),
    }
}

fn write_report(
    args: &RaceArgs,
    report: &Convergence,
    runners: &[Runner<'_>],
    truth: &Image,
    exposure: f64,
    failed: &mut Failures,
) -> Result<()> {
    let [csv, plots @ .., page] = FILES;
    args.write(csv, &report.to_csv(), failed);
    for (figure, name) in report.figures().iter().zip(plots) {
        args.write(name, &figure.to_svg(), failed);
    }
    let images: Vec<Image> = runners.iter().map(|r| r.film.image()).collect();
    let part = telling_part(&images, truth);
    let picture = |image: &Image, caption: &str, note: String, pixelated| -> Result<Picture> {
        Ok(Picture { png: png_bytes(image, exposure)?, caption: caption.into(), note, pixelated })
    };
    let (mut crops, mut thumbnails) = (Vec::new(), Vec::new());
    for (image, runner) in images.iter().zip(runners) {
        let samples = counted(runner.film.passes(), "sample", "samples");
        let note = format!("{samples}, {:.1} s", runner.seconds.total());
        crops.push(picture(&image.cropped(part), &runner.entrant.name, note.clone(), true)?);
        thumbnails.push(picture(&image.shrunk(THUMBNAIL), &runner.entrant.name, note, false)?);
    }
    crops.push(picture(&truth.cropped(part), "reference", String::new(), true)?);
    thumbnails.push(picture(&truth.shrunk(THUMBNAIL), "reference", String::new(), false)?);
    if part == truth.window {
        thumbnails.clear();
    }
    args.write(page, &report.page(&crops, &thumbnails).to_html(), failed);
    Ok(())
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
