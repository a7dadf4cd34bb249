//! marmor's command line; `marmor help` lists the commands.
#![deny(unsafe_code)]
#![allow(clippy::print_stdout, clippy::print_stderr)] // printing is this room's job

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
