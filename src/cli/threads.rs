//! Threads: as many as asked for, within reason.

use marmor::{Error, Result};

/// More threads than any machine has processors.
const MOST: usize = 4096;

/// Runs `job` on `asked` threads; without a number on those of `RAYON_NUM_THREADS`, else on one for each core.
///
/// # Errors
/// Usage for a number out of range, or one that the system does not allow; those of `job`.
pub fn with<T: Send>(asked: Option<usize>, job: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    let set = || std::env::var("RAYON_NUM_THREADS").ok()?.parse().ok().filter(|&n: &usize| n > 0);
    let number = match (asked, set()) {
        (Some(number), _) => in_range("--threads ", number)?,
        (None, Some(number)) => in_range("RAYON_NUM_THREADS=", number)?,
        // Rayon's own choice.
        (None, None) => 0,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(number).build();
    pool.map_err(|e| Error::usage(format!("cannot start threads: {e}; ask for fewer by --threads")))?.install(job)
}

fn in_range(what: &str, number: usize) -> Result<usize> {
    match number {
        1..=MOST => Ok(number),
        _ => Err(Error::usage(format!("{what}{number}: at least 1 and at most {MOST}"))),
    }
}
