//! `marmor merge`: parts of one render become one.

use super::files::{Files, Remedy};
use super::layers::{LayerName, Layers};
use super::outputs::{Outputs, progress};
use marmor::film::{Checkpoint, check_writable};
use marmor::scene::difference;
use marmor::words::counted;
use marmor::{Error, Result};
use std::path::PathBuf;
use std::process::ExitCode;

/// Options.
#[derive(clap::Args)]
pub struct Args {
    /// Film files of one render (--samples-range, --checkpoint-every, or an output that ends in .film)
    #[arg(required = true, value_name = "PART.film")]
    parts: Vec<PathBuf>,
    /// Where to write; the ending .exr, .png or .film decides the format; may be given more than once
    #[arg(short, long, required = true, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Further layers in the EXR, separated by commas: variance
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    layers: Vec<LayerName>,
    /// Brighten or darken the PNG by this many stops [default: as the first part would]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = super::render::stops)]
    exposure: Option<f64>,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Runs the command. The result is that of one render of all passes, bit for bit.
pub fn run(args: Args) -> Result<ExitCode> {
    let layers = Layers::new(&args.layers, None)?;
    let mut files = Files::default();
    args.parts.iter().for_each(|path| files.reads("a part", path));
    for path in &args.output {
        check_writable(path)?;
        files.writes("the result", path, Remedy::Name("-o"));
    }
    files.check()?;
    let mut parts = args.parts.iter();
    let Some(first) = parts.next() else { return Err(Error::usage("nothing to merge")) };
    let mut all = Checkpoint::read(first)?;
    let (mut spent, exposure) = progress(&all);
    for path in parts {
        let part = Checkpoint::read(path)?;
        if let Some(fact) = all.identity.differs(&part.identity) {
            let (a, b) = (first.display().to_string(), path.display().to_string());
            let scenes = (fact == "scene").then(|| all.identity.get(fact).zip(part.identity.get(fact))).flatten();
            let in_scenes = scenes.and_then(|(x, y)| difference(x, y, [&format!("in {a}"), &format!("in {b}")]));
            let generic = || all.identity.difference(&part.identity).map(|what| format!("{what} ({a} is `there`)"));
            let what = in_scenes.or_else(generic).unwrap_or_default();
            return Err(Error::usage(format!("{b}: not a part of the same render as {a}: {what}")));
        }
        all.film.join(&part.film).map_err(|e| e.within(path.display()))?;
        spent.add(&progress(&part).0);
    }
    let Checkpoint { identity, attributes, film, .. } = all;
    if film.passes() == 0 {
        return Err(Error::usage("the parts have no passes: there is no picture"));
    }
    layers.check(0..film.passes())?;
    let exposure = args.exposure.unwrap_or(exposure);
    let outputs = Outputs { paths: args.output, identity, attributes, exposure, layers };
    let said = outputs.save(&film, &spent)?;
    if !args.quiet {
        said.iter().for_each(|line| eprintln!("{line}"));
        eprintln!(
            "merged {}: passes {} ({} in all)",
            counted(args.parts.len(), "file", "files"),
            film.ranges_text(),
            film.passes()
        );
        if film.ranges().len() > 1 {
            eprintln!("warning: passes are missing between the parts");
        }
        eprintln!("{}", super::render::odd_line(&film, &spent, None));
    }
    Ok(ExitCode::SUCCESS)
}
