//! Axes of plots: where values stand, and which of them are labelled.

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// With unit; empty for none.
    pub label: String,
    /// Lower end.
    pub min: f64,
    /// Upper end.
    pub max: f64,
    /// Spacing of the values.
    pub scale: Scale,
}

/// Spacing of the values along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps.
    Linear,
    /// Equal ratios; both ends are positive.
    Log,
}

impl Axis {
    /// Position of `value` in 0 .. 1; `None` where it cannot be drawn.
    pub(super) fn at(&self, value: f64) -> Option<f64> {
        let t = match self.scale {
            Scale::Linear => (value - self.min) / (self.max - self.min),
            Scale::Log if value > 0.0 => (value / self.min).ln() / (self.max / self.min).ln(),
            Scale::Log => return None,
        };
        t.is_finite().then_some(t)
    }

    /// (value, label) of labelled ticks and values of unlabelled ones.
    pub(super) fn ticks(&self) -> (Vec<(f64, String)>, Vec<f64>) {
        match self.scale {
            Scale::Linear => {
                let step = nice_step((self.max - self.min) / 4.0);
                let first = (self.min / step).ceil() as i64;
                let last = (self.max / step).floor() as i64;
                let digits = (-step.log10().floor()).max(0.0) as usize;
                let major = (first..=last).map(|i| i as f64 * step).map(|v| (v, format!("{v:.digits$}"))).collect();
                (major, Vec::new())
            }
            Scale::Log => {
                let (first, last) = (self.min.log10().ceil() as i32, self.max.log10().floor() as i32);
                let every = ((last - first) / 8 + 1).max(1);
                let plain = (-2..=3).contains(&first) && (-2..=3).contains(&last);
                let (mut major, mut minor) = (Vec::new(), Vec::new());
                for decade in first - 1..=last {
                    let value = 10f64.powi(decade);
                    if decade >= first {
                        if (decade - first) % every == 0 {
                            major.push((value, power_of_ten(decade, plain)));
                        } else {
                            minor.push(value);
                        }
                    }
                    if every == 1 {
                        minor.extend(
                            (2..10).map(|k| f64::from(k) * value).filter(|v| (self.min..=self.max).contains(v)),
                        );
                    }
                }
                // Few decades: the numbers between them are needed to read anything off.
                if major.len() < 3 {
                    for decade in first - 1..=last {
                        for k in [2, 5] {
                            let value = f64::from(k) * 10f64.powi(decade);
                            if (self.min..=self.max).contains(&value) {
                                let label = if plain {
                                    plain_number(value)
                                } else {
                                    format!("{k}·{}", power_of_ten(decade, false))
                                };
                                major.push((value, label));
                            }
                        }
                    }
                    minor.retain(|v| major.iter().all(|(m, _)| (v / m - 1.0).abs() > 1e-9));
                }
                (major, minor)
            }
        }
    }
}

/// 1, 2 or 5 times a power of ten, at least `rough`.
fn nice_step(rough: f64) -> f64 {
    let power = 10f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|k| k * power).find(|&step| step >= rough * 0.999).unwrap_or(10.0 * power)
}

/// Without the digits that rounding adds.
fn plain_number(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The number itself, or 10 with a raised exponent.
fn power_of_ten(decade: i32, plain: bool) -> String {
    match decade {
        _ if plain => format!("{}", 10f64.powi(decade)),
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        _ => {
            let raised = |c: char| match c {
                '-' => '⁻',
                '1' => '¹',
                '2' => '²',
                '3' => '³',
                digit => char::from_u32(0x2070 + digit as u32 - '0' as u32).unwrap_or(digit),
            };
            format!("10{}", decade.to_string().chars().map(raised).collect::<String>())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_where_readers_expect_them() {
        let log = Axis { label: String::new(), min: 0.02, max: 3e4, scale: Scale::Log };
        let labels: Vec<String> = log.ticks().0.into_iter().map(|t| t.1).collect();
        assert_eq!(labels, ["10⁻¹", "1", "10", "10²", "10³", "10⁴"]);
        let linear = Axis { label: String::new(), min: 0.0, max: 2.0, scale: Scale::Linear };
        let labels: Vec<String> = linear.ticks().0.into_iter().map(|t| t.1).collect();
        assert_eq!(labels, ["0.0", "0.5", "1.0", "1.5", "2.0"]);
        assert_eq!(power_of_ten(-12, false), "10⁻¹²");
    }
}
