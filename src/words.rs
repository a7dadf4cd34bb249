//! Numbers in sentences: counts with their nouns, and figures with the digits that they need.

use std::fmt::Display;

/// A number and its noun: `1 edge`, `2 edges`. A verb may follow in both, as in `edge belongs`, `edges belong`.
pub fn counted<N: Copy + Display + PartialEq + From<u8>>(n: N, one: &str, many: &str) -> String {
    format!("{n} {}", either(n, one, many))
}

/// The word that goes with one, or with any other number.
pub fn either<'a, N: PartialEq + From<u8>>(n: N, one: &'a str, many: &'a str) -> &'a str {
    if n == N::from(1) { one } else { many }
}

/// The first `most` of a list, and how many more there are.
pub fn first_of(list: &[String], most: usize) -> String {
    let shown = list[..list.len().min(most)].join(", ");
    match list.len().saturating_sub(most) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// Four significant digits, and no more zeros than it takes.
pub fn short(v: f64) -> String {
    digits(v, 4)
}

/// `count` significant digits (1 to 17), and no more zeros than it takes; in powers of ten below 10⁻⁴ and from 10⁹.
pub fn digits(v: f64, count: i32) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let magnitude = v.abs().log10().floor() as i32;
    if !(-4..9).contains(&magnitude) {
        let text = format!("{v:.*e}", count as usize - 1);
        let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{power}", without_zeros(mantissa));
    }
    let places = (count - 1 - magnitude).max(0) as usize;
    let step = 10f64.powi((magnitude + 1 - count).max(0));
    let text = if places > 0 { format!("{v:.places$}") } else { format!("{:.0}", (v / step).round() * step) };
    without_zeros(&text).into()
}

/// A number without the zeros after its last decimal.
fn without_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// A place, `(x, y, z)`, to seven digits; coordinates below `least` are what rounding leaves of 0.
pub fn place(p: [f64; 3], least: f64) -> String {
    let [x, y, z] = p.map(|v| if v.abs() < least { "0".into() } else { digits(v, 7) });
    format!("({x}, {y}, {z})")
}

/// An albedo to four decimals; where they would round to 1, what is missing: `1-2e-5`; where it is small, three digits.
pub fn albedo(v: f64) -> String {
    match 1.0 - v {
        0.0 => "1".into(),
        missing if missing > 0.0 && missing < 5e-5 => format!("1-{missing:.0e}"),
        _ if v.abs() < 0.01 => digits(v, 3),
        _ => format!("{v:.4}"),
    }
}

/// A share as a percentage, whole from 1 % on and with one digit below: nothing becomes 0 % that is not.
pub fn percent(share: f64) -> String {
    let v = 100.0 * share;
    if v.abs() < 0.995 { format!("{} %", digits(v, 1)) } else { format!("{v:.0} %") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_singular_and_nothing_else_is() {
        let edges = |n: usize| counted(n, "edge", "edges");
        assert_eq!([edges(0), edges(1), edges(2), edges(11)], ["0 edges", "1 edge", "2 edges", "11 edges"]);
        assert_eq!(counted(1_u64, "edge belongs", "edges belong"), "1 edge belongs");
        assert_eq!((either(1_u32, "has", "have"), either(21_u32, "has", "have")), ("has", "have"));
    }

    #[test]
    fn long_lists_are_cut_and_say_so() {
        let names = ["a", "b", "c"].map(String::from);
        let cut = [0, 1, 2, 3].map(|most| first_of(&names, most));
        assert_eq!(cut, [" and 3 more", "a and 2 more", "a, b and 1 more", "a, b, c"]);
    }

    #[test]
    fn numbers_are_short_and_right() {
        for (v, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (-0.25, "-0.25"),
            (1.0 / 3.0, "0.3333"),
            (123_456.0, "123500"),
            (99.999, "100"),
            (0.000_123_456, "0.0001235"),
            (1.5e-7, "1.5e-7"),
            (2e12, "2e12"),
        ] {
            assert_eq!(short(v), text);
        }
        assert_eq!(digits(1_234_567.8, 7), "1234568");
        assert_eq!(digits(-1.234_567_8, 7), "-1.234568");
        assert_eq!(place([1e-9, 0.25, -1e-12], 1e-10), "(1e-9, 0.25, 0)");
    }

    #[test]
    fn albedos_and_shares_keep_what_rounding_would_take() {
        let albedos = [1.0, 1.0 - 2e-5, 0.9999, 0.5, 0.012_345, 0.000_123_4, 0.0].map(albedo);
        assert_eq!(albedos, ["1", "1-2e-5", "0.9999", "0.5000", "0.0123", "0.000123", "0"]);
        let shares = [0.0, 3e-6, 0.0044, 0.0096, 0.01, 0.345, -0.25].map(percent);
        assert_eq!(shares, ["0 %", "0.0003 %", "0.4 %", "1 %", "1 %", "34 %", "-25 %"]);
    }
}
