//! `marmor check`.

use marmor::Result;
use std::process::ExitCode;

/// Options.
#[derive(clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args) -> Result<ExitCode> {
    Ok(ExitCode::SUCCESS)
}
