//! `marmor compare`: models against a reference on one scene, and where they differ. Reads in the order it runs.

use super::converge::{file_name, scene_name};
use super::keep::cancel_on_signals;
use super::race::{RaceArgs, Runner, command, machine, race};
use super::read_picture;
use marmor::Result;
use marmor::film::{Checkpoint, Format, Image, Metadata, PngOptions, SelfError, metrics, png_bytes, save};
use marmor::math::Rgb;
use marmor::report::{Compared, ModelComparison, Picture, common_range, false_colours};
use marmor::scene::MethodName;
use std::path::Path;
use std::process::ExitCode;

#[derive(clap::Args)]
#[command(after_help = "\
A model is one or more words joined by `+`, as for `marmor converge --methods`: standard, beam+notes, directional ...
Writes for each model NAME.exr and NAME.png, NAME_difference.exr (signed), NAME_relative.exr and NAME_relative.png
(false colours), then compare.csv and one page, index.html.")]
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

/// A picture with the relMSE of its noise.
struct Truth {
    text: String,
    image: Image,
    /// Of its even and odd passes, where they are known.
    halves: Option<[Image; 2]>,
    noise: f64,
}

fn compare(args: &RaceArgs, models: &[String], truth: Option<&str>) -> Result<ExitCode> {
    let entrants = args.entrants(models)?;
    let mut runners = entrants.iter().map(Runner::new).collect::<Result<Vec<_>>>()?;
    let cancel = cancel_on_signals();
    let budget = args.budget();
    let truth = match &args.reference {
        Some(path) => stored(path)?,
        None => {
            let spec = truth.unwrap_or(MethodName::VolumePath.name());
            args.say(&format!("reference {spec}: {:.0} s", args.reference_budget()));
            let entrant = args.reference_entrant(spec, Some(spec), 0x7472_7574)?;
            let mut runner = [Runner::new(&entrant)?];
            race(&mut runner, args.reference_budget(), &cancel, |_, r| r.follow())?;
            let [runner] = runner;
            let noise = runner.own.last().and_then(|e| e.relmse).map_or(0.0, |e| e.value);
            let halves = runner.film.half_images();
            Truth { text: spec.to_owned(), image: runner.film.image(), halves, noise }
        }
    };
    args.say(&format!("{} models in turns, {budget:.0} s each", runners.len()));
    let whole = race(&mut runners, budget, &cancel, |_, runner| runner.follow())?;
    let exposure = entrants[0].prepared.file.render.exposure.unwrap_or(0.0);
    let footnotes = vec![format!("Machine: {}.", machine()), format!("Command: {}", command())];
    let report = write(args, &mut runners, &truth, exposure, footnotes)?;
    Ok(args.conclude(&report.sentences(), whole))
}

/// A picture that was rendered before. An EXR counts as free of noise; a film has the halves that tell it.
fn stored(path: &Path) -> Result<Truth> {
    let text = path.file_name().map_or("stored picture".into(), |name| name.to_string_lossy().into_owned());
    if Format::of(path).is_ok_and(|format| format == Format::Film) {
        let film = Checkpoint::read(path)?.film;
        let noise = SelfError::new().measure(&film).and_then(|e| e.relmse).map_or(0.0, |e| e.value);
        let text = format!("{text}, {} samples", film.passes());
        return Ok(Truth { text, image: film.image(), halves: film.half_images(), noise });
    }
    Ok(Truth { text, image: read_picture(path, None)?, halves: None, noise: 0.0 })
}

/// Longest side of a picture on the page [pixels].
const SHOWN: u32 = 320;

fn write(
    args: &RaceArgs,
    runners: &mut [Runner<'_>],
    truth: &Truth,
    exposure: f64,
    footnotes: Vec<String>,
) -> Result<ModelComparison> {
    let folder = &args.output;
    let picture = |image: &Image, caption: &str, note: String, exposure: f64| -> Result<Picture> {
        let png = png_bytes(&image.shrunk(SHOWN), exposure)?;
        Ok(Picture { png, caption: caption.into(), note, pixelated: false })
    };
    save_both(folder, "reference", &truth.image, exposure)?;
    let mut pictures = vec![picture(&truth.image, &truth.text, "reference".into(), exposure)?];
    let (mut models, mut relatives) = (Vec::new(), Vec::new());
    for runner in runners.iter_mut() {
        let (image, name) = (runner.film.image(), &runner.entrant.name);
        let file = file_name(name);
        let comparison = metrics::compare(&image, &truth.image, None)?;
        let point = runner.measure(&truth.image)?;
        let [signed, relative] = differences(&image, &truth.image);
        save_both(folder, &file, &image, exposure)?;
        for (suffix, image) in [("difference", &signed), ("relative", &relative)] {
            let path = folder.join(format!("{file}_{suffix}.exr"));
            save(image, &path, &Metadata::default(), PngOptions::default())?;
        }
        let note = format!("{} samples, {:.1} s", runner.film.passes(), runner.seconds.total());
        pictures.push(picture(&image, name, note, exposure)?);
        relatives.push((name.clone(), file, relative));
        models.push(Compared {
            name: name.clone(),
            seconds: runner.seconds.total(),
            samples: runner.film.passes(),
            mean_ratio: comparison.mean_ratio,
            squared_bias: runner
                .film
                .half_images()
                .and_then(|halves| metrics::squared_bias(&halves, &truth.image, truth.halves.as_ref())),
            measured: comparison.whole.relmse.map_or(0.0, |e| e.value),
            noise: point.own.unwrap_or(0.0),
            width: point.width,
        });
    }
    let range = common_range(relatives.iter().map(|(_, _, image)| image));
    let mut shown = Vec::new();
    for (name, file, relative) in &relatives {
        let colours = false_colours(relative, range);
        save(&colours, &folder.join(format!("{file}_relative.png")), &Metadata::default(), PngOptions::default())?;
        // Shrunk before it is coloured: colours do not average.
        shown.push(picture(&false_colours(&relative.shrunk(SHOWN), range), name, String::new(), 0.0)?);
    }
    let report = ModelComparison {
        scene: scene_name(&args.scene),
        reference: truth.text.clone(),
        reference_noise: truth.noise,
        reference_halves: truth.halves.is_some(),
        models,
        range,
        footnotes,
    };
    args.write("compare.csv", &report.to_csv())?;
    args.write("index.html", &report.page(&pictures, &shown).to_html())?;
    Ok(report)
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
