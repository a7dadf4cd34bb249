//! Words on a command line -> calls into the library; the only code that prints or exits.
//! Not for: anything that computes. Read first: `render.rs`, the program's table of contents.

/// Prints a line to standard error. Whoever closed it, with a terminal or a pipe, must not end a render: the standard
/// library's macro would panic.
macro_rules! eprintln {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}
/// The same for standard output; a write that fails is told in the end.
macro_rules! println {
    () => { crate::cli::stdout::write(format_args!("\n")) };
    ($($text:tt)*) => { crate::cli::stdout::write(format_args!("{}\n", format_args!($($text)*))) };
}

mod advice;
mod check;
mod compare;
mod converge;
mod diff;
mod duration;
mod eval;
mod files;
mod keep;
mod layers;
mod looks;
mod materials;
mod merge;
mod need;
mod observers;
mod outputs;
mod profile;
mod race;
mod render;
mod replay;
mod setup;
mod stats;
mod stdout;
mod threads;

use clap::{Parser, Subcommand};
use marmor::film::{FilePicture, Image};
use marmor::{ErrorKind, Result};
use std::path::Path;
use std::process::ExitCode;

#[derive(Parser)]
#[command(name = "marmor", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene to EXR and PNG
    Render(render::Args),
    /// Join parts of one render, bit for bit
    Merge(merge::Args),
    /// Say what is in a scene, what will be built and what is left out
    Check(check::Args),
    /// Compare two pictures: RMSE and relative error with 95 % intervals
    Diff(diff::Args),
    /// Hold several models against a reference, with pictures of where they differ
    Compare(compare::Args),
    /// Plot the error of several methods against run time
    Converge(converge::Args),
    /// Print or plot M(r) of one or more models of a material
    Profile(profile::Args),
    /// Evaluate S_d for rows of a CSV on standard input
    Eval(eval::Args),
    /// List the catalogue of measured media
    Materials(materials::Args),
}

/// Exit code of a render that was interrupted and wrote what it had.
pub const INTERRUPTED: u8 = 75;

/// Reads a picture, and says what was taken how where that is not plain.
fn read_picture(path: &Path, layer: Option<&str>) -> Result<Image> {
    let FilePicture { image, remarks, .. } = FilePicture::read(path, layer)?;
    remarks.iter().for_each(|remark| eprintln!("warning: {}: {remark}", path.display()));
    Ok(image)
}

/// Runs the command of this process's arguments.
pub fn main() -> ExitCode {
    let outcome = parse().and_then(|cli| cli.map_or(Ok(ExitCode::SUCCESS), run));
    // Last: what was said so far may not have come through.
    outcome.and_then(|code| stdout::finish().map(|()| code)).unwrap_or_else(|error| {
        eprintln!("marmor: {error}");
        ExitCode::from(match error.kind() {
            ErrorKind::Usage => 2,
            ErrorKind::Scene => 3,
            ErrorKind::File => 4,
            ErrorKind::Numeric => 5,
            ErrorKind::Memory => 6,
            _ => 1,
        })
    })
}

/// The command asked for; none where help was.
fn parse() -> Result<Option<Cli>> {
    match Cli::try_parse() {
        Ok(cli) => Ok(Some(cli)),
        Err(wrong) if wrong.use_stderr() => wrong.exit(),
        Err(help) => {
            let text = help.render();
            let styled = std::io::IsTerminal::is_terminal(&std::io::stdout());
            stdout::write(format_args!("{}", if styled { text.ansi().to_string() } else { text.to_string() }));
            Ok(None)
        }
    }
}

fn run(cli: Cli) -> Result<ExitCode> {
    match cli.command {
        Command::Render(args) => render::run(args),
        Command::Converge(args) => converge::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Merge(args) => threads::with(None, || merge::run(args)),
        Command::Check(args) => threads::with(None, || check::run(args)),
        Command::Diff(args) => threads::with(None, || diff::run(args)),
        Command::Profile(args) => threads::with(None, || profile::run(args)),
        Command::Eval(args) => threads::with(None, || eval::run(args)),
        Command::Materials(args) => materials::run(args),
    }
}
