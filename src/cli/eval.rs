//! `marmor eval`.

use super::stdout;
use marmor::bssrdf::{KappaExtinction, ModelName, ModelOption, ModelOptions, WidthFit};
use marmor::report::{Batch, BatchOptions};
use marmor::{Error, Result};
use std::io::{self, BufRead, Read, Write};
use std::path::Path;
use std::process::ExitCode;

/// Options.
#[derive(clap::Args)]
#[command(after_help = "\
The header names the columns, in any order: sigma_s, sigma_a, g, eta, then either r (a plane, normal
incidence) or x,y,z (exit minus entry), nix,niy,niz and nox,noy,noz (outward unit normals), wx,wy,wz
(refracted direction inside). sigma_s is not reduced; with g = 0 it may be. `slab` also needs `thickness` and takes
`eta_far`. `normalised` takes A and l (see --width) in place of the coefficients; eta may then be left out. Any unit of
length. Other columns, empty lines and lines that begin with # pass through.

Appended: S_d [1/(unit² sr)]; with r also `exitance`, M(r) [1/unit²] per entered flux. Results come last, so that
they win where the input has a column of the same name. S_d is the formula's own value, which is negative in places
for `directional` and `slab`; rendering has 0 there, and so has --clamped.
Exit code 2: bad header or option; 3: bad row, with its line. A bad row ends the run; with --keep-going its results
stay empty and the exit code waits until the end.")]
pub struct Args {
    /// BSSRDF model
    #[arg(long, value_name = "NAME")]
    model: ModelName,
    /// Leave out the factor that keeps the exit Fresnel term from losing energy: S_d = R_d / π, as the papers print it
    #[arg(long)]
    no_exit_normalisation: bool,
    /// Model `directional`: scale to the true albedo of the half space
    #[arg(long)]
    calibrated: bool,
    /// Model `beam`: σ_t instead of σ_t′ in the near-field correction
    #[arg(long)]
    kappa_full: bool,
    /// Model `slab`, rows with r: light that leaves by the far face
    #[arg(long)]
    transmitted: bool,
    /// 0 where the formula is negative, as rendering has it
    #[arg(long)]
    clamped: bool,
    /// Model `normalised`, rows with A and l: the fit, and with it what l is: `searchlight` and `diffuse` (mean free
    /// path), `dmfp` (diffusion length) [default: dmfp]
    #[arg(long, value_name = "FIT")]
    width: Option<WidthFit>,
    /// Leave the results of a bad row empty and go on
    #[arg(long)]
    keep_going: bool,
    /// Append exact single scattering on a plane too [1/unit²], as `single`
    #[arg(long)]
    single: bool,
}

/// Longer than any row; what has no end is not read to it.
const LONGEST: u64 = 1 << 20;

/// Results are written when this many bytes are there.
const BUFFER: usize = 1 << 18;

/// Runs the command.
pub fn run(args: Args) -> Result<ExitCode> {
    let refuse = |given: bool, name: &str, option: ModelOption| {
        if given && !args.model.takes(option) {
            let takers: Vec<&str> = ModelName::models().filter(|m| m.takes(option)).map(ModelName::name).collect();
            return Err(Error::usage(format!("--{name} goes with --model {}", takers.join(" or "))));
        }
        Ok(())
    };
    refuse(args.calibrated, "calibrated", ModelOption::Calibrated)?;
    refuse(args.kappa_full, "kappa-full", ModelOption::KappaFull)?;
    refuse(args.transmitted, "transmitted", ModelOption::Transmitted)?;
    refuse(args.width.is_some(), "width", ModelOption::Width)?;
    let options = BatchOptions {
        model: args.model,
        made: ModelOptions {
            exit_normalisation: !args.no_exit_normalisation,
            calibrated: args.calibrated,
            kappa: if args.kappa_full { KappaExtinction::Full } else { KappaExtinction::Reduced },
            ..ModelOptions::DEFAULT
        },
        width: args.width.unwrap_or(WidthFit::DiffusionLength),
        transmitted: args.transmitted,
        clamped: args.clamped,
        single: args.single,
    };
    refuse_own_output()?;
    let mut input = io::BufReader::with_capacity(BUFFER, io::stdin().lock());
    let mut output = io::stdout().lock();
    let mut out = String::with_capacity(BUFFER + 4096);
    let outcome = evaluate(&mut input, options, args.keep_going, &mut out, |out| {
        let written = output.write_all(out.as_bytes()).and_then(|()| output.flush());
        out.clear();
        written
    });
    match outcome {
        Ok(()) | Err(Stop::ReaderGone) => Ok(ExitCode::SUCCESS),
        Err(Stop::Error(error)) => Err(error),
    }
}

/// Results that are appended to the very rows that are read would never end.
fn refuse_own_output() -> Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let end = |name: &str| std::fs::metadata(name).ok().filter(|m| m.is_file()).map(|m| (m.dev(), m.ino()));
        if end("/dev/stdin").is_some_and(|input| end("/dev/stdout") == Some(input)) {
            return Err(Error::usage("standard output is the file that the rows come from; write to another one"));
        }
    }
    Ok(())
}

enum Stop {
    /// Whoever read the output has seen enough: no error.
    ReaderGone,
    Error(Error),
}

/// Reads all of `input`; what was computed before an error is still handed to `flush`.
fn evaluate(
    input: &mut impl BufRead,
    options: BatchOptions,
    keep_going: bool,
    out: &mut String,
    mut flush: impl FnMut(&mut String) -> io::Result<()>,
) -> std::result::Result<(), Stop> {
    let mut flush = |out: &mut String| {
        flush(out).map_err(|cause| match cause.kind() {
            io::ErrorKind::BrokenPipe => Stop::ReaderGone,
            _ => Stop::Error(stdout::error_of(cause)),
        })
    };
    let (mut batch, mut bytes, mut number) = (None, Vec::new(), 0_u64);
    let (mut first_bad, mut bad) = (None, 0_u64);
    loop {
        bytes.clear();
        number += 1;
        let unread = |cause: io::Error| {
            Stop::Error(Error::file(Path::new("standard input"), &format!("read line {number}"), cause))
        };
        let read = input.by_ref().take(LONGEST).read_until(b'\n', &mut bytes).map_err(unread)?;
        if read as u64 == LONGEST && !bytes.ends_with(b"\n") {
            flush(out)?;
            let what = format!("standard input, line {number}: longer than {LONGEST} bytes; is it a CSV?");
            return Err(Stop::Error(Error::scene(what)));
        }
        let line = std::str::from_utf8(&bytes).map_err(|e| unread(io::Error::new(io::ErrorKind::InvalidData, e)))?;
        if read == 0 {
            flush(out)?;
            return first_bad.map_or(Ok(()), |error: Error| {
                Err(Stop::Error(error.within(format_args!("{bad} bad rows left empty; the first"))))
            });
        }
        let row = line.trim_end_matches(['\n', '\r']).trim_start_matches('\u{feff}');
        let computed = match &mut batch {
            _ if row.trim().is_empty() || row.starts_with('#') => {
                out.push_str(row);
                Ok(())
            }
            None => Batch::new(row, options).map(|new| {
                out.push_str(row);
                out.push_str(&new.appended());
                batch = Some(new);
            }),
            Some(batch) => batch.row(row, out).map_err(|e| e.within(format_args!("standard input, line {number}"))),
        };
        match (computed, &batch) {
            (Ok(()), _) => {}
            (Err(error), Some(batch)) if keep_going => {
                bad += 1;
                first_bad.get_or_insert(error);
                out.push_str(row);
                out.extend(std::iter::repeat_n(',', batch.appended().matches(',').count()));
            }
            (Err(error), _) => {
                flush(out)?;
                return Err(Stop::Error(error));
            }
        }
        out.push('\n');
        if out.len() >= BUFFER {
            flush(out)?;
        }
    }
}
