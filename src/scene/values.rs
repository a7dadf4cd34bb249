//! Numbers, names and switches as sections of a scene file have them.

use super::tree::{Fields, Node, Value};
use crate::error::{Error, Result, did_you_mean};
use crate::math::{DVec3, Rgb};

/// Known units and their length in mm.
const UNITS: &[(&str, f64)] =
    &[("um", 1e-3), ("mm", 1.0), ("cm", 10.0), ("m", 1e3), ("km", 1e6), ("in", 25.4), ("ft", 304.8)];

/// What [`unit`] takes.
pub(super) const UNIT: &str = "\"um\", \"mm\", \"cm\", \"m\", \"km\", \"in\", \"ft\" or a number of mm above 0";

/// A unit of length in mm.
pub(super) fn unit(node: &Node) -> Option<f64> {
    match node.text() {
        Some(name) => UNITS.iter().find(|(known, _)| *known == name).map(|(_, mm)| *mm),
        None => node.number().filter(|mm| mm.is_normal() && *mm > 0.0),
    }
}

/// Three numbers.
pub(super) fn vector(node: &Node) -> Option<DVec3> {
    node.numbers::<3>().map(DVec3::from_array)
}

/// One number for all channels, or three; each finite in f32 and accepted by `within`.
pub(super) fn colour(node: &Node, within: impl Fn(f64) -> bool) -> Option<[f64; 3]> {
    let rgb = node.number().map(|v| [v; 3]).or_else(|| node.numbers::<3>())?;
    rgb.iter().all(|&v| within(v) && (v as f32).is_finite()).then_some(rgb)
}

/// Rounded once.
pub(super) fn rgb(value: [f64; 3]) -> Rgb {
    Rgb(value.map(|v| v as f32))
}

/// A name of an enum, with the enum's own complaint and hint.
pub(super) fn named_value<T: std::str::FromStr<Err = Error>>(fields: &Fields<'_>, key: &str) -> Result<Option<T>> {
    let Some(name) = fields.get(key, "a name in quotes", Node::text)? else { return Ok(None) };
    name.parse().map(Some).map_err(|e: Error| fields.error_at(key, format_args!("is wrong: {e}")))
}

/// `name` among `known`, or the complaint with the nearest one; long lists are cut short.
pub(super) fn unknown(name: &str, known: &[&str]) -> String {
    const MOST: usize = 60;
    let more = known.len().saturating_sub(MOST);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let listed = known[..known.len().min(MOST)].join(", ");
    format!("{name:?} does not exist{}; there are {listed}{more}", did_you_mean(name, known.iter().copied()))
}

/// The direction of `v`, whatever its length; `None` for zero.
pub(super) fn unit_vector(v: DVec3) -> Option<DVec3> {
    (v / v.abs().max_element()).try_normalize()
}

/// What a radiance is.
pub(super) const RADIANCE: &str = "one number or three, none negative";

/// A number from 1 to `largest`.
pub(super) fn whole(fields: &Fields<'_>, key: &str, largest: u32) -> Result<Option<u32>> {
    let expected = format!("a whole number from 1 to {largest}");
    fields.get(key, &expected, |n| n.integer().filter(|i| (1..=i64::from(largest)).contains(i)).map(|i| i as u32))
}

/// A whole number from 0 to 2^24.
pub(super) fn whole_or_none(fields: &Fields<'_>, key: &str) -> Result<Option<u32>> {
    let integer = |n: &Node| n.integer().filter(|i| (0..=1 << 24).contains(i)).map(|i| i as u32);
    fields.get(key, "a whole number from 0 to 16777216", integer)
}

/// `true` or `false`.
pub(super) fn switch(fields: &Fields<'_>, key: &str) -> Result<Option<bool>> {
    fields.get(key, "true or false", |n| if let Value::Bool(b) = n.value { Some(b) } else { None })
}
