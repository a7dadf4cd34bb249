//! What curves say, in sentences: a verdict only where 95 % intervals are apart, and each figure with its interval.

use super::convergence::Convergence;
use super::curve::{ALL, Curve, Reached, Set, TRIMMED, error_text, why_not};
use crate::film::Bias;
use crate::film::metrics::Estimate;

/// Errors within this factor of each other are as good as equal: times on a machine with other work vary as much.
const AS_GOOD: f64 = 1.15;

/// Samples of each pixel before the noise of a render has an interval.
const FEWEST_SAMPLES: u32 = 4;

/// One method at equal time.
#[derive(Clone, Debug)]
pub struct Standing {
    /// The method.
    pub name: String,
    /// relMSE without the worst 0.1 % of the pixels.
    pub trimmed: Estimate,
    /// Over all pixels; none where these leave no verdict.
    pub all: Estimate,
    /// Why there is no verdict on it.
    pub no_verdict: Option<String>,
    /// Why there is none over all pixels.
    pub no_verdict_all: Option<String>,
}

impl Convergence {
    /// The time that all curves have reached [s].
    pub(super) fn equal_seconds(&self) -> f64 {
        self.curves.iter().filter_map(|c| c.points.last()).map(|p| p.seconds).fold(f64::INFINITY, f64::min)
    }

    /// The methods that have a sample of each pixel at equal time, the smallest error first, those without a verdict last.
    pub fn standings(&self) -> Vec<Standing> {
        let seconds = self.equal_seconds();
        let mut out: Vec<Standing> = self.curves.iter().filter_map(|c| standing(c, seconds)).collect();
        let key = |s: &Standing| (s.no_verdict.is_some(), s.trimmed.value);
        out.sort_by(|a, b| key(a).0.cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1)));
        out
    }

    /// The bias at which a curve flattens, where it is told from none and from the noise of the reference.
    pub fn floor(&self, curve: &Curve) -> Option<Bias> {
        let last = curve.points.last()?.judgement;
        let judged = curve.not_met.is_empty() && why_not(&last, &last.trimmed).is_none();
        last.trimmed.bias.filter(|bias| bias.is_seen() && judged)
    }

    /// What came out, in sentences.
    pub fn sentences(&self) -> Vec<String> {
        let seconds = self.equal_seconds();
        let standings = self.standings();
        let (judged, unjudged): (Vec<&Standing>, Vec<&Standing>) =
            standings.iter().partition(|s| s.no_verdict.is_none());
        let mut out = Vec::new();
        if let Some((best, _)) = judged.split_first() {
            let ahead = judged.iter().take_while(|s| !is_behind(best, s)).count();
            // One that is behind may be followed by one that is not, if that is less certain.
            let (mut level, mut behind): (Vec<&Standing>, Vec<&Standing>) = (judged[..ahead].to_vec(), Vec::new());
            for standing in &judged[ahead..] {
                if is_behind(best, standing) { &mut behind } else { &mut level }.push(standing);
            }
            out.push(self.winners_text(&level, (judged.len(), unjudged.is_empty()), seconds));
            let others: Vec<String> = behind.iter().map(|s| self.behind_text(s, &level, seconds)).collect();
            if !others.is_empty() {
                out.push(format!("{}.", others.join("; ")));
            }
        }
        out.extend(
            unjudged.iter().filter_map(|s| Some(format!("{}: no verdict: {}.", s.name, s.no_verdict.as_ref()?))),
        );
        if self
            .curves
            .iter()
            .filter_map(|c| c.points.last())
            .any(|p| p.judgement.all.pixels > p.judgement.trimmed.pixels)
        {
            let each: Vec<String> = standings.iter().map(all_pixels_text).collect();
            out.push(format!("All pixels counted: {}.", each.join("; ")));
        }
        for curve in &self.curves {
            match curve.points.first() {
                None => out.push(format!("{} was interrupted before its first sample of each pixel.", curve.name)),
                Some(first) if first.seconds > seconds => out.push(format!(
                    "{} needs {:.1} s for one sample of each pixel and is not compared.",
                    curve.name, first.seconds
                )),
                _ => {}
            }
        }
        out.extend(self.curves.iter().filter_map(|c| self.floor_text(c)));
        out
    }

    fn winners_text(&self, winners: &[&Standing], (judged, all_judged): (usize, bool), seconds: f64) -> String {
        let left_out = self
            .curves
            .iter()
            .filter_map(|c| c.points.last())
            .map(|p| p.judgement.all.pixels - p.judgement.trimmed.pixels);
        let over = match left_out.max() {
            Some(0) | None => String::new(),
            Some(1) => ", without the worst pixel".into(),
            Some(n) => format!(", without the worst 0.1 % of the pixels ({n})"),
        };
        let of_those = if all_judged { "" } else { " of those with a verdict" };
        match winners {
            // Alone, or alone with a verdict: there is nothing that it is better than.
            [one] if self.curves.len() == 1 || !all_judged && judged == 1 => {
                format!("At {seconds:.1} s{over}, {} has {}.", one.name, error_text(&one.trimmed))
            }
            [one] => {
                format!(
                    "At equal time ({seconds:.1} s){over}, {} has the smallest error{of_those}: {}.",
                    one.name,
                    error_text(&one.trimmed)
                )
            }
            _ => {
                let names: Vec<&str> = winners.iter().map(|w| w.name.as_str()).collect();
                let errors: Vec<String> =
                    winners.iter().map(|w| format!("{} {}", w.name, error_text(&w.trimmed))).collect();
                format!(
                    "At equal time ({seconds:.1} s){over}, no verdict between {}, which have the smallest errors{of_those}: {}.",
                    listed(&names),
                    errors.join("; ")
                )
            }
        }
    }

    /// How far behind the best, or behind the widest interval of those that are not told apart from it.
    fn behind_text(&self, one: &Standing, best: &[&Standing], seconds: f64) -> String {
        let (Some([low, high]), Some([best_low, _])) = (one.trimmed.interval, best[0].trimmed.interval) else {
            return format!("{} has {}", one.name, error_text(&one.trimmed));
        };
        let best_high = best[0].trimmed.interval.map_or(f64::INFINITY, |i| i[1]);
        let times = if best_low > 0.0 {
            format!("{} to {}", two_digits(low / best_high), two_digits(high / best_low))
        } else {
            format!("at least {}", two_digits(low / best_high))
        };
        let whose = if best.len() == 1 { "that error".into() } else { format!("the error of {}", best[0].name) };
        let out = format!("{} has {times} times {whose}: {}", one.name, error_text(&one.trimmed));
        let Some(curve) = self.curves.iter().find(|c| c.name == best[0].name) else { return out };
        // The least that it came sooner: when the best certainly was as good as this may be at its best.
        let least = match curve.reached(low, 1) {
            Reached::At(s) | Reached::Before(s) if s < seconds => seconds / s,
            _ => return out,
        };
        match curve.reached(high, 0) {
            Reached::At(s) => format!(
                "{out}, which {} had {} to {} times sooner",
                best[0].name,
                two_digits(least),
                two_digits((seconds / s).max(least))
            ),
            _ => format!("{out}, which {} had at least {} times sooner", best[0].name, two_digits(least)),
        }
    }

    fn floor_text(&self, curve: &Curve) -> Option<String> {
        let bias = self.floor(curve)?;
        let [low, high] = bias.interval();
        let figure = format!("relMSE {:.2e} (95 %: {low:.2e} to {high:.2e})", bias.value);
        Some(if self.reference_tells_noise {
            format!(
                "{} flattens: {figure} of it is bias against this reference and will not go away with samples.",
                curve.name
            )
        } else {
            format!(
                "{} differs from the picture given by {figure} more than by its own noise: that is bias, or noise of that \
                 picture, which an EXR does not tell; a film file does.",
                curve.name
            )
        })
    }
}

fn standing(curve: &Curve, seconds: f64) -> Option<Standing> {
    let last = curve.points.iter().rev().find(|p| p.seconds <= seconds).or(curve.points.first())?;
    let lacks = || {
        let names: Vec<String> = curve.not_met.iter().map(|light| format!("\"{light}\"")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        (!names.is_empty()).then(|| format!("too few of its paths have met {}", listed(&names)))
    };
    let few = || {
        let n = last.samples;
        (n < FEWEST_SAMPLES)
            .then(|| format!("{n} of the {FEWEST_SAMPLES} samples of each pixel that an interval needs"))
    };
    let at = |set: Set| -> Option<(Estimate, Option<String>)> {
        let error = curve.error_at(seconds, set)?;
        let unknown = || error.interval.is_none().then(|| "its noise has no interval".into());
        Some((error, lacks().or_else(|| why_not(&last.judgement, set(last))).or_else(few).or_else(unknown)))
    };
    let ((trimmed, no_verdict), (all, no_verdict_all)) = (at(TRIMMED)?, at(ALL)?);
    Some(Standing { name: curve.name.clone(), trimmed, all, no_verdict, no_verdict_all })
}

/// Whether the intervals are apart, by more than times vary.
fn is_behind(best: &Standing, other: &Standing) -> bool {
    match (best.trimmed.interval, other.trimmed.interval) {
        (Some([_, high]), Some([low, _])) => low > high && other.trimmed.value > AS_GOOD * best.trimmed.value,
        _ => false,
    }
}

fn all_pixels_text(standing: &Standing) -> String {
    match &standing.no_verdict_all {
        Some(why) => format!("{} {}, no verdict: {why}", standing.name, error_text(&standing.all)),
        None => format!("{} {}", standing.name, error_text(&standing.all)),
    }
}

/// A ratio as far as it is known.
fn two_digits(ratio: f64) -> String {
    match ratio {
        r if r >= 100.0 => format!("{:.1e}", r),
        r if r >= 10.0 => format!("{r:.0}"),
        r => format!("{r:.1}"),
    }
}

/// `a, b and c`.
pub(super) fn listed(names: &[&str]) -> String {
    match names {
        [front @ .., last] if !front.is_empty() => format!("{} and {last}", front.join(", ")),
        _ => names.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::curve::tests::judged;
    use super::super::curve::{Curve, Point};
    use super::*;
    use crate::film::{Judged, Judgement};

    /// Errors of `level` / seconds plus `floor`, a pass each `pass` seconds up to 20, intervals of `width`.
    fn curve(name: &str, level: f64, floor: f64, pass: f64, width: f64) -> Curve {
        let point = |samples: u32| {
            let seconds = pass * f64::from(samples);
            let own = (samples >= 4).then_some(level / seconds);
            let mut all = judged(own, floor, width);
            all.measured = level / seconds + floor + 1e-6;
            let trimmed = Judged { pixels: all.pixels - 10, ..all };
            Point { samples, seconds, judgement: Judgement { all, trimmed }, told: None }
        };
        let passes = (20.0 / pass).ceil() as u32;
        Curve { name: name.into(), seconds_setup: 0.1, points: (1..=passes).map(point).collect(), not_met: Vec::new() }
    }

    fn said(curves: Vec<Curve>) -> String {
        let (scene, reference) = ("s".into(), "r".into());
        let report = Convergence {
            scene,
            curves,
            reference,
            reference_tells_noise: true,
            remarks: Vec::new(),
            footnotes: Vec::new(),
        };
        report.sentences().join("\n")
    }

    #[test]
    fn sentences_say_which_to_use_and_which_are_biased() {
        let said = said(vec![
            curve("fair", 1e-2, 0.0, 0.1, 0.1),
            curve("biased", 1e-2, 5e-3, 0.1, 0.1),
            curve("slow", 0.5, 0.0, 2.0, 0.1),
            curve("late", 0.5, 0.0, 30.0, 0.1),
        ]);
        let best = "At equal time (20.0 s), without the worst 0.1 % of the pixels (10), fair has the smallest error: relMSE \
                    5.00e-4 (95 %: 4.52e-4 to 5.53e-4).";
        assert!(said.contains(best), "{said}");
        // 50 times, each known to 10 %; as soon as it was half as bad as that, at the least.
        assert!(said.contains("slow has 41 to 61 times that error: relMSE 2.50e-2"), "{said}");
        assert!(said.contains("which fair had at least 41 times sooner"), "{said}");
        assert!(said.contains("biased flattens: relMSE 5.00e-3 (95 %: 4.83e-3 to 5.17e-3)"), "{said}");
        assert!(!said.contains("fair flattens") && said.contains("late needs 30.0 s for one sample"), "{said}");
        assert!(said.contains("All pixels counted: fair relMSE 5.00e-4 (95 %"), "{said}");
    }

    #[test]
    fn there_is_no_verdict_where_intervals_meet() {
        let (a, c) = (curve("a", 1e-2, 0.0, 0.1, 0.3), curve("c", 10.0, 0.0, 0.1, 0.3));
        let close = said(vec![a.clone(), curve("b", 1.6e-2, 0.0, 0.1, 0.3), c.clone()]);
        assert!(
            close.contains("no verdict between a and b, which have the smallest errors: a relMSE 5.00e-4 (95 %"),
            "{close}"
        );
        assert!(close.contains("c has 5.5e2 to 1.8e3 times the error of a: "), "{close}");
        assert!(!close.contains("has the smallest error"), "{close}");
        let apart = said(vec![a, curve("b", 2e-2, 0.0, 0.1, 0.3), c]);
        assert!(apart.contains("a has the smallest error") && apart.contains("b has 1.1 to 3.6 times"), "{apart}");
    }

    /// The same error and noise, one with an interval as wide as few pixels make it.
    #[test]
    fn a_wide_interval_is_carried_into_every_sentence() {
        let said = said(vec![curve("sure", 1e-2, 0.0, 0.1, 0.1), curve("unsure", 1.0, 5e-1, 0.1, 2.5)]);
        assert!(said.contains("no verdict between sure and unsure") || said.contains("unsure has "), "{said}");
        assert!(!said.contains("flattens"), "a bias of 0.5 in noise known to a factor 12: {said}");
    }

    #[test]
    fn one_pixel_with_most_of_the_error_leaves_no_verdict() {
        let mut lone = curve("lone", 1.0, 5e-1, 0.1, 0.1);
        let mut speck = curve("speck", 1e-2, 0.0, 0.1, 0.1);
        lone.points
            .iter_mut()
            .for_each(|p| (p.judgement.trimmed.worst_share, p.judgement.all.worst_share) = (0.93, 0.96));
        speck.points.iter_mut().for_each(|p| p.judgement.all.worst_share = 0.7);
        let said = said(vec![curve("fair", 1e-2, 0.0, 0.1, 0.1), lone, speck]);
        assert!(said.contains("lone: no verdict: one pixel carries 93 % of its error (pixel 3,4)."), "{said}");
        assert!(said.contains("no verdict between fair and speck"), "judged without it: {said}");
        assert!(
            said.contains("speck relMSE 5.00e-4 (95 %: 4.52e-4 to 5.53e-4), no verdict: one pixel carries 70 %"),
            "{said}"
        );
        assert!(!said.contains("flattens"), "{said}");
    }

    #[test]
    fn a_picture_nearer_than_its_noise_allows_is_said() {
        let mut copy = curve("copy", 1e-2, 0.0, 0.1, 0.1);
        copy.points.iter_mut().for_each(|p| (p.judgement.trimmed.measured, p.judgement.all.measured) = (1e-6, 1e-6));
        let said = said(vec![copy, curve("fair", 1e-1, 0.0, 0.1, 0.1)]);
        assert!(
            said.contains("copy: no verdict: it is nearer to the reference") && said.contains("share a seed."),
            "{said}"
        );
        assert!(said.contains("fair has relMSE ") && !said.contains("smallest"), "{said}");
    }

    #[test]
    fn errors_below_the_noise_of_the_reference_are_bounded_not_told() {
        let mut curves = vec![curve("a", 1e-2, 0.0, 0.1, 0.3), curve("b", 3e-2, 0.0, 0.1, 0.3)];
        for p in curves.iter_mut().flat_map(|c| &mut c.points) {
            for judged in [&mut p.judgement.all, &mut p.judgement.trimmed] {
                judged.measured += 5e-2;
                judged.reference_noise += 5e-2;
            }
        }
        let said = said(curves);
        assert!(
            said.contains("no verdict between a and b") && said.contains("not told from the reference's noise"),
            "{said}"
        );
    }

    #[test]
    fn a_picture_that_may_lack_a_light_has_no_verdict() {
        let mut dim = curve("dim", 1e-3, 5e-3, 0.1, 0.1);
        assert!(said(vec![dim.clone()]).contains("dim flattens"));
        dim.not_met = vec!["sun".into(), "lamp".into()];
        let said = said(vec![curve("fair", 1e-2, 0.0, 0.1, 0.1), dim]);
        assert!(said.contains("dim: no verdict: too few of its paths have met \"sun\" and \"lamp\"."), "{said}");
        assert!(
            said.contains("fair has relMSE 5.00e-4") && !said.contains("smallest") && !said.contains("flattens"),
            "{said}"
        );
    }

    #[test]
    fn few_samples_have_no_verdict() {
        let mut short = curve("short", 1e-3, 0.0, 10.0, 0.1);
        short.points.truncate(2);
        let said = said(vec![curve("fair", 1e-2, 0.0, 0.1, 0.1), short]);
        assert!(said.contains("short: no verdict: 2 of the 4 samples of each pixel"), "{said}");
        assert!(said.contains("fair has relMSE ") && !said.contains("smallest"), "{said}");
    }
}
