//! `marmor profile`.

use super::stdout;
use clap::builder::NonEmptyStringValueParser;
use marmor::bssrdf::{ModelName, ModelOption, ModelOptions};
use marmor::film::{check_replaceable, write_atomically};
use marmor::math::Rgb;
use marmor::optics::{self, Measured, Medium};
use marmor::report::Profile;
use marmor::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Options.
#[derive(clap::Args)]
#[command(after_help = "\
Exitance M(r) of a half space around a normal pencil beam, per entered flux. Models that leave out light
scattered once get exact single scattering added. For materials of the catalogue the Monte Carlo truth is
shown beside the models where the project has it, with the ratio of the fluxes through the same rings below.")]
pub struct Args {
    /// A material of the catalogue (`marmor materials` lists them)
    #[arg(long, value_name = "NAME", value_parser = NonEmptyStringValueParser::new(),
          conflicts_with_all = ["sigma_s_prime", "sigma_a", "g", "eta"], required_unless_present = "sigma_s_prime")]
    material: Option<String>,
    /// Reduced scattering coefficient, one value or r,g,b [1/unit of r]
    #[arg(long, value_name = "S", value_parser = triple, requires_all = ["sigma_a", "eta"])]
    sigma_s_prime: Option<[f64; 3]>,
    /// Absorption coefficient, one value or r,g,b [1/unit of r]
    #[arg(long, value_name = "A", value_parser = triple, requires = "sigma_s_prime")]
    sigma_a: Option<[f64; 3]>,
    /// Mean cosine of the phase function
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    g: f64,
    /// Index inside over index outside
    #[arg(long, requires = "sigma_s_prime")]
    eta: Option<f64>,
    /// Unit of r and of the coefficients: um, mm, cm or m
    #[arg(long, value_name = "UNIT", default_value = "mm", value_parser = unit)]
    unit_of_r: (&'static str, f64),
    /// Models, separated by commas; all that fit a half space by default
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    model: Vec<ModelName>,
    /// `directional` scaled to the true albedo of the half space, not as published
    #[arg(long)]
    calibrated: bool,
    /// First radius, last radius and their number, spaced in equal ratios
    #[arg(long, value_name = "A:B:N", value_parser = radii)]
    r: Option<Radii>,
    /// Where to write: a plot if it ends in .svg, a table if in .csv; without it a table on standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Clone)]
struct Radii(Vec<f64>);

/// Runs the command.
pub fn run(args: Args) -> Result<ExitCode> {
    if let Some(path) = &args.output {
        is_svg(path)?;
        check_replaceable(path)?;
    }
    let row = args.material.as_deref().map(optics::find_or_explain).transpose();
    let row = row.map_err(|e| Error::usage(format!("--material: {e}")))?;
    let medium = medium(&args, row)?;
    let mut profile = Profile::new(medium, args.unit_of_r, row, args.r.map(|r| r.0));
    let options = ModelOptions { calibrated: args.calibrated, ..ModelOptions::DEFAULT };
    let models = if args.model.is_empty() { ModelName::half_spaces().collect() } else { args.model };
    for name in models {
        let model = name.build(&medium, &options).map_err(|e| Error::usage(e.to_string()))?;
        let (name, variant) = (model.name(), if args.calibrated { ", calibrated" } else { "" });
        let variant = if name.takes(ModelOption::Calibrated) { variant } else { "" };
        profile.add(&format!("{}{variant}", name.name()), &*model);
    }
    match args.output.as_deref() {
        None => stdout::write(format_args!("{}", profile.to_csv())),
        Some(path) => {
            let content = if is_svg(path)? { profile.to_svg() } else { profile.to_csv() };
            write_atomically(path, |out| out.write_all(content.as_bytes()))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn medium(args: &Args, row: Option<&Measured>) -> Result<Medium> {
    if let Some(row) = row {
        return Ok(row.medium(args.unit_of_r.1));
    }
    let (Some(s), Some(a), Some(eta)) = (args.sigma_s_prime, args.sigma_a, args.eta) else {
        return Err(Error::usage("give --material, or --sigma-s-prime, --sigma-a and --eta"));
    };
    let sigma_s = Rgb(s.map(|v| (v / (1.0 - args.g)) as f32));
    Medium::unreduced(sigma_s, Rgb(a.map(|v| v as f32)), args.g, eta as f32).map_err(|e| Error::usage(e.to_string()))
}

/// Whether a plot is asked for, or else a table.
fn is_svg(path: &Path) -> Result<bool> {
    let is = |ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    if is("svg") || is("csv") {
        return Ok(is("svg"));
    }
    Err(Error::usage(format!("{}: a profile is written as .svg or .csv", path.display())))
}

fn triple(text: &str) -> std::result::Result<[f64; 3], String> {
    let values: Vec<f64> = text
        .split(',')
        .map(|word| match word.trim().parse::<f64>() {
            Ok(value) if (0.0..=1e15).contains(&value) => Ok(value),
            _ => Err(format!("`{word}` is not a coefficient in 0..1e15")),
        })
        .collect::<std::result::Result<_, _>>()?;
    match values[..] {
        [grey] => Ok([grey; 3]),
        [r, g, b] => Ok([r, g, b]),
        _ => Err("give one value, or three separated by commas".to_owned()),
    }
}

fn unit(text: &str) -> std::result::Result<(&'static str, f64), String> {
    [("um", 1e-3), ("mm", 1.0), ("cm", 10.0), ("m", 1000.0)]
        .into_iter()
        .find(|(name, _)| *name == text)
        .ok_or_else(|| "um, mm, cm or m".to_owned())
}

fn radii(text: &str) -> std::result::Result<Radii, String> {
    let why =
        "first radius, last radius and their number, such as 0.01:100:200, with 0 < first < last and 2 to 100000 radii";
    let words: Vec<&str> = text.split(':').collect();
    let [first, last, n] = words[..] else { return Err(why.to_owned()) };
    match (first.parse::<f64>(), last.parse::<f64>(), n.parse::<usize>()) {
        (Ok(first), Ok(last), Ok(n)) if first > 0.0 && first < last && last < 1e30 && (2..=100_000).contains(&n) => {
            let ratio = last / first;
            Ok(Radii((0..n).map(|i| first * ratio.powf(i as f64 / (n - 1) as f64)).collect()))
        }
        _ => Err(why.to_owned()),
    }
}
