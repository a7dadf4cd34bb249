//! `marmor diff`.

use super::{read_picture, stdout};
use marmor::Result;
use marmor::film::Image;
use marmor::film::metrics::{self, Comparison, Errors, Estimate};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Options.
#[derive(clap::Args)]
pub struct Args {
    /// The picture (EXR or HDR)
    a: PathBuf,
    /// The reference it is held against (EXR or HDR)
    b: PathBuf,
    /// Compare this layer's channels (LAYER.R, LAYER.G, LAYER.B) instead of R, G, B
    #[arg(long, value_name = "LAYER")]
    layer: Option<String>,
    /// EXR or HDR of the same size; where it is not black, the errors are also given for those pixels alone
    #[arg(long, value_name = "MASK.exr")]
    interior: Option<PathBuf>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

/// Runs the command. Pictures that differ are no failure: the exit code is 0.
pub fn run(args: Args) -> Result<ExitCode> {
    let a = read_picture(&args.a, args.layer.as_deref())?;
    let b = read_picture(&args.b, args.layer.as_deref())?;
    let mask = args.interior.as_deref().map(|path| read_mask(path, &a)).transpose()?;
    let comparison = metrics::compare(&a, &b, mask.as_deref())
        .map_err(|e| e.within(format!("{} against {}", args.a.display(), args.b.display())))?;
    stdout::write(format_args!("{}", if args.json { json(&args, &comparison) } else { table(&args, &comparison) }));
    Ok(ExitCode::SUCCESS)
}

fn read_mask(path: &Path, like: &Image) -> Result<Vec<bool>> {
    let mask = read_picture(path, None)?;
    if (mask.resolution, mask.window) != (like.resolution, like.window) {
        return Err(marmor::Error::usage(format!("{}: the mask has another size than the pictures", path.display())));
    }
    Ok(mask.pixels.iter().map(|pixel| !pixel.is_black()).collect())
}

fn json(args: &Args, comparison: &Comparison) -> String {
    let object = serde_json::json!({
        "image": args.a.to_string_lossy(),
        "reference": args.b.to_string_lossy(),
        "layer": args.layer,
        "comparison": comparison,
    });
    format!("{object}\n")
}

fn table(args: &Args, c: &Comparison) -> String {
    let mut out = String::new();
    if c.non_finite + c.non_finite_reference > 0 {
        let _ = writeln!(
            out,
            "pixels that are NaN or infinite: {} in the picture, {} in the reference; left out of every figure",
            c.non_finite, c.non_finite_reference
        );
    }
    let _ = writeln!(out, "picture    {}", args.a.display());
    let _ = writeln!(out, "reference  {}", args.b.display());
    let _ = writeln!(out, "\n{:<28}{:>12}   95 % interval", "", "value");
    let mut row = |name: &str, estimate: Option<Estimate>| {
        let _ = match estimate {
            None => writeln!(out, "{name:<28}{:>12}", "undefined"),
            Some(Estimate { value, interval: None }) => writeln!(out, "{name:<28}{:>12}   unknown", number(value)),
            Some(Estimate { value, interval: Some([low, high]) }) => {
                writeln!(out, "{name:<28}{:>12}   {} .. {}", number(value), number(low), number(high))
            }
        };
    };
    let mut errors = |suffix: &str, e: &Errors| {
        row(&format!("RMSE{suffix}"), Some(e.rmse));
        row(&format!("RMSE{suffix}, trimmed"), Some(e.rmse_trimmed));
        row(&format!("relMSE{suffix}"), e.relmse);
        row(&format!("relMSE{suffix}, trimmed"), e.relmse_trimmed);
    };
    errors("", &c.whole);
    if let Some(interior) = &c.interior {
        errors(" (interior)", interior);
    }
    for (name, ratio) in ["R", "G", "B"].iter().zip(c.mean_ratio) {
        row(&format!("mean / reference, {name}"), ratio);
    }
    let channel = ["R", "G", "B"][c.max_channel];
    let [x, y] = c.max_pixel;
    let _ = writeln!(out, "{:<28}{:>12}   at pixel {x},{y}, {channel}", "largest difference", number(c.max_difference));
    if let Some(share) = c.worst_share {
        let ([x, y], share) = (c.worst_pixel, 100.0 * share);
        let note =
            if share > 50.0 { ": the relMSE and its interval say little of the others, see trimmed" } else { "" };
        let _ = writeln!(out, "{:<28}{share:>10.2} %   at pixel {x},{y}{note}", "worst pixel, of relMSE");
    }
    if c.max_difference == 0.0 {
        out.push_str("the pictures are the same to the last bit: one render, or the same seed twice\n");
    }
    let interior = c.interior.map_or(String::new(), |i| format!(", {} interior", i.pixels));
    let _ = writeln!(out, "{:<28}{:>12}   of {}{interior}", "pixels compared", c.whole.pixels, c.window.area());
    out
}

/// Plain near 1, in powers of ten else; 5 digits.
fn number(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else if (0.1..1000.0).contains(&value.abs()) {
        format!("{value:.4}")
    } else {
        format!("{value:.4e}")
    }
}
