//! `marmor compare`: models against a reference on one scene, and where they differ. Reads in the order it runs.

use super::converge::{file_name, scene_name};
use super::keep::cancel_on_signals;
use super::race::{Failures, RaceArgs, Reference, Runner, command, machine, race, remarks, stored};
use marmor::film::{Image, Metadata, PngOptions, Truth, Window, brightness, judge, png_bytes, save};
use marmor::integrator::View;
use marmor::math::Rgb;
use marmor::render::{Aov, first_hit};
use marmor::report::{Compared, Figures, ModelComparison, Picture, PicturePart, common_range, false_colours};
use marmor::scene::MethodName;
use marmor::words::counted;
use marmor::{Error, Result};
use std::path::Path;
use std::process::ExitCode;

#[derive(clap::Args)]
#[command(after_help = "\
A model is one or more words joined by `+`, as for `marmor converge --methods`: standard, beam+notes, directional ...
Writes for each model NAME.exr and NAME.png, NAME_difference.exr (signed), NAME_relative.exr and NAME_relative.png
(false colours), then compare.csv, compare.json and one page, index.html. Judged are the pixels of translucent objects,
by what the camera sees first; silhouettes and background are told apart.")]
pub struct Args {
    /// Models to compare, separated by commas
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', required = true)]
    models: Vec<String>,
    /// What the models are held against, in the words of a model [default: volume_path]
    #[arg(long, value_name = "METHOD", conflicts_with = "reference")]
    truth: Option<String>,
    #[command(flatten)]
    race: RaceArgs,
}

/// Runs the command.
pub fn run(args: Args) -> Result<ExitCode> {
    args.race.run(|| compare(&args.race, &args.models, args.truth.as_deref()))
}

fn compare(args: &RaceArgs, models: &[String], truth: Option<&str>) -> Result<ExitCode> {
    let entrants = args.entrants(models)?;
    let mut names: Vec<String> =
        ["compare.csv", "compare.json", "index.html", "reference.exr", "reference.png"].map(String::from).into();
    for name in entrants.iter().map(|e| file_name(&e.name)) {
        let ends = [".exr", ".png", "_difference.exr", "_relative.exr", "_relative.png"];
        names.extend(ends.map(|end| format!("{name}{end}")));
    }
    args.check_files(&entrants, &names)?;
    let given = args.reference.as_deref().map(stored).transpose()?;
    args.check_sizes(&entrants, given.as_ref().map(|r| &r.truth.image))?;
    let mut runners = entrants.iter().map(Runner::new).collect::<Result<Vec<_>>>()?;
    let cancel = cancel_on_signals();
    let budget = args.budget();
    let reference = match given {
        Some(reference) => reference,
        None => {
            let spec = truth.unwrap_or(MethodName::VolumePath.name());
            args.say(&format!("reference {spec}: {} s", args.reference_budget()));
            let entrant = args.reference_entrant(spec, Some(spec), 0x7472_7574)?;
            args.check_files(std::slice::from_ref(&entrant), &names)?;
            let mut runner = [Runner::new(&entrant)?];
            race(&mut runner, args.reference_budget(), &cancel, |_, r| r.follow())?;
            let [mut runner] = runner;
            let truth = Truth::of_film(&runner.film, &mut runner.own);
            Reference { text: spec.to_owned(), truth, made: Some(runner.made()), remarks: runner.remarks() }
        }
    };
    reference.truth.check(&runners[0].film)?;
    args.say(&format!("{} in turns, {budget} s each", counted(runners.len(), "model", "models")));
    let whole = race(&mut runners, budget, &cancel, |_, runner| runner.follow())?;
    args.leave_out_empty(&mut runners);
    let exposure = entrants[0].prepared.file.render.exposure.unwrap_or(0.0);
    let mut failed = Failures::default();
    let report = write(args, &mut runners, &reference, exposure, &mut failed)?;
    args.conclude((&report.remarks, &report.sentences()), &report.to_csv(), whole, failed)
}

/// Longest side of a picture on the page [pixels].
const SHOWN: u32 = 320;

fn write(
    args: &RaceArgs,
    runners: &mut [Runner<'_>],
    reference: &Reference,
    exposure: f64,
    failed: &mut Failures,
) -> Result<ModelComparison> {
    let (folder, truth) = (&args.output, &reference.truth);
    let picture = |image: &Image, caption: &str, note: String, exposure: f64| -> Result<Picture> {
        let png = png_bytes(&image.shrunk(SHOWN), exposure)?;
        Ok(Picture { png, caption: caption.into(), note, pixelated: false })
    };
    failed.note(save_both(folder, "reference", &truth.image, exposure));
    let mut pictures = vec![picture(&truth.image, &reference.text, "reference".into(), exposure)?];
    let shares = translucent_shares(&runners[0]);
    let (mut models, mut relatives) = (Vec::new(), Vec::new());
    for runner in runners.iter_mut() {
        let (image, name) = (runner.film.image(), &runner.entrant.name);
        let file = file_name(name);
        let [signed, relative] = differences(&image, &truth.image);
        failed.note(save_both(folder, &file, &image, exposure));
        for (suffix, image) in [("difference", &signed), ("relative", &relative)] {
            let path = folder.join(format!("{file}_{suffix}.exr"));
            failed.note(save(image, &path, &Metadata::default(), PngOptions::default()));
        }
        let samples = counted(runner.film.passes(), "sample", "samples");
        let note = format!("{samples}, {:.1} s", runner.seconds.total());
        pictures.push(picture(&image, name, note, exposure)?);
        relatives.push((name.clone(), file, relative));
        models.push(Compared {
            name: name.clone(),
            seconds: runner.seconds.total(),
            samples: runner.film.passes(),
            parts: parts(runner, truth, &shares)?,
        });
    }
    let range = common_range(relatives.iter().map(|(_, _, image)| image));
    let mut shown = Vec::new();
    for (name, file, relative) in &relatives {
        let colours = false_colours(relative, range);
        let path = folder.join(format!("{file}_relative.png"));
        failed.note(save(&colours, &path, &Metadata::default(), PngOptions::default()));
        // Shrunk before it is coloured: colours do not average.
        shown.push(picture(&false_colours(&relative.shrunk(SHOWN), range), name, String::new(), 0.0)?);
    }
    let report = ModelComparison {
        scene: scene_name(&args.scene),
        reference: reference.text.clone(),
        reference_noise: truth.noise(),
        models,
        range,
        remarks: remarks(runners, reference),
        footnotes: reference
            .made
            .iter()
            .map(|made| format!("{} as the reference: {made}.", reference.text))
            .chain([format!("Machine: {}.", machine()), format!("Command: {}", command())])
            .collect(),
    };
    args.write("compare.csv", &report.to_csv(), failed);
    let json = serde_json::to_string_pretty(&report).map_err(|e| Error::file(folder, "write compare.json", e))?;
    args.write("compare.json", &json, failed);
    args.write("index.html", &report.page(&pictures, &shown).to_html(), failed);
    Ok(report)
}

/// The share of each pixel where the camera meets a translucent object first.
fn translucent_shares(runner: &Runner<'_>) -> Vec<f32> {
    let (scene, window) = (&runner.entrant.prepared.scene, Window::full(runner.film.resolution()));
    let seen = first_hit(View { scene, rays: runner.rays() }, window, Aov::Translucent);
    seen.pixels.iter().map(|p| p[0]).collect()
}

/// The figures of a model over each part of the picture that has pixels.
fn parts(runner: &mut Runner<'_>, truth: &Truth, shares: &[f32]) -> Result<Vec<Figures>> {
    let mut out = Vec::new();
    for part in PicturePart::ORDER {
        let set: Vec<bool> = shares.iter().map(|&share| part.has(share)).collect();
        let pixels = set.iter().filter(|in_it| **in_it).count();
        if pixels > 0 {
            let judgement = judge(&runner.film, &mut runner.own, truth, Some(&set))?;
            let brightness = brightness(&runner.film, &runner.own, truth, Some(&set))?;
            out.push(Figures { part, pixels, brightness, judgement });
        }
    }
    Ok(out)
}

fn save_both(folder: &Path, name: &str, image: &Image, exposure: f64) -> Result<()> {
    for ending in ["exr", "png"] {
        save(image, &folder.join(format!("{name}.{ending}")), &Metadata::default(), PngOptions { exposure })?;
    }
    Ok(())
}

/// x - r, and (x - r) / sqrt(r^2 + 0.01 mean(r)^2).
fn differences(x: &Image, r: &Image) -> [Image; 2] {
    let sum: f64 = r.pixels.iter().flat_map(|p| p.0).map(f64::from).sum();
    let floor = (0.1 * sum / (3 * r.pixels.len()) as f64) as f32;
    let of = |f: &dyn Fn(f32, f32) -> f32| Image {
        pixels: x.pixels.iter().zip(&r.pixels).map(|(x, r)| Rgb::from_fn(|c| f(x[c], r[c]))).collect(),
        ..Image { resolution: r.resolution, window: r.window, pixels: Vec::new() }
    };
    let relative = |x: f32, r: f32| if floor > 0.0 { (x - r) / r.hypot(floor) } else { 0.0 };
    [of(&|x, r| x - r), of(&relative)]
}
