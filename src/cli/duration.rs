//! Times as they are typed.

use std::time::Duration;

/// `30s`, `5m`, `2h`, `500ms`, or a plain number of seconds.
pub(super) fn duration(text: &str) -> std::result::Result<Duration, String> {
    let units = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0), ("", 1.0)];
    let (number, factor) = units
        .into_iter()
        .find_map(|(unit, factor)| text.strip_suffix(unit).map(|number| (number, factor)))
        .unwrap_or((text, 1.0));
    match number.trim().parse::<f64>() {
        Ok(n) if n > 0.0 && n * factor < 1e9 => Ok(Duration::from_secs_f64(n * factor)),
        _ => Err("expected a time above 0 such as 30s, 5m or 500ms".into()),
    }
}
