//! Memory that would not fit, said before it is asked for.

use crate::{Error, ErrorKind, Result};

/// Memory that programs can still get [bytes], where the system tells (Linux).
pub(super) fn available() -> Option<u64> {
    parse_available(&std::fs::read_to_string("/proc/meminfo").ok()?)
}

fn parse_available(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

/// A Memory error if `needed` bytes are more than `available`; `what` starts the message, `remedy` ends it.
pub(super) fn require(needed: u128, available: Option<u64>, what: &str, remedy: &str) -> Result<()> {
    match available {
        Some(available) if needed > u128::from(available) => Err(Error::new(
            ErrorKind::Memory,
            format!("{what} needs {}, {} is available; {remedy}", gigabytes(needed), gigabytes(available.into())),
        )),
        _ => Ok(()),
    }
}

/// For instance `1.50 GB` (10^9 bytes).
pub(super) fn gigabytes(bytes: u128) -> String {
    format!("{:.2} GB", bytes as f64 * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_need_above_what_is_there_names_both_numbers() {
        let error = require(2_500_000_000, Some(1_000_000_000), "the film", "use --crop").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Memory);
        assert_eq!(error.to_string(), "the film needs 2.50 GB, 1.00 GB is available; use --crop");
        assert!(require(1_000_000_000, Some(1_000_000_000), "", "").is_ok());
        assert!(require(u128::MAX, None, "", "").is_ok());
    }

    #[test]
    fn meminfo_counts_in_units_of_1024_bytes() {
        let text = "MemTotal:       100 kB\nMemAvailable:   12345 kB\n";
        assert_eq!(parse_available(text), Some(12345 * 1024));
        assert_eq!(parse_available("nothing of the kind"), None);
    }
}
