//! Radial profiles of the catalogue's materials from the project's own Monte Carlo runs of the transfer equation.
//! The numbers are in `monte_carlo.txt`, 2e7 photons per channel; its head says how to read it.

use std::sync::LazyLock;

/// One channel of one material: exitance of a half space around a normal pencil beam.
#[derive(Clone, Debug)]
pub struct Run {
    material: String,
    channel: char,
    /// σ_t′ of the material [1/mm]: lengths of the bins are in units of its inverse.
    sigma_t_prime_per_mm: f64,
    /// Total reflectance per entered flux.
    pub reflectance: f64,
    /// Its standard error.
    pub reflectance_error: f64,
    bins: Vec<Bin>,
}

/// One ring of exit points.
#[derive(Clone, Copy, Debug)]
pub struct Bin {
    /// Inner radius \[mm\].
    pub r_min: f64,
    /// Outer radius \[mm\].
    pub r_max: f64,
    /// Share of the entered flux that leaves in the ring after one scattering.
    pub once: f64,
    /// The same after two or more.
    pub more: f64,
    /// Standard error of their sum.
    pub error: f64,
}

impl Bin {
    /// All orders.
    pub fn flux(&self) -> f64 {
        self.once + self.more
    }

    /// Area of the ring [mm²].
    pub fn area(&self) -> f64 {
        std::f64::consts::PI * (self.r_max - self.r_min) * (self.r_max + self.r_min)
    }
}

impl Run {
    /// The rings that have a standard error below 10 %, lengths in mm.
    pub fn bins(&self) -> impl Iterator<Item = Bin> + '_ {
        let mm = 1.0 / self.sigma_t_prime_per_mm;
        self.bins.iter().map(move |b| Bin { r_min: b.r_min * mm, r_max: b.r_max * mm, ..*b })
    }
}

/// The run of channel `c` (0 red, 1 green, 2 blue) of the catalogue's `material`, if there is one.
pub fn channel_run(material: &str, c: usize) -> Option<&'static Run> {
    static RUNS: LazyLock<Vec<Run>> = LazyLock::new(|| parse(include_str!("monte_carlo.txt")));
    RUNS.iter().find(|run| run.material == material && "rgb".chars().nth(c) == Some(run.channel))
}

fn parse(text: &str) -> Vec<Run> {
    const WHY: &str = "the file is part of the crate and a test reads all of it";
    let number = |word: &str| word.parse::<f64>().expect(WHY);
    let mut runs: Vec<Run> = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        if let [material, channel, sigma, reflectance, error] = words[..] {
            runs.push(Run {
                material: material.to_owned(),
                channel: channel.chars().next().expect(WHY),
                sigma_t_prime_per_mm: number(sigma),
                reflectance: number(reflectance),
                reflectance_error: number(error),
                bins: Vec::new(),
            });
        } else if let [index, once, more, error] = words[..] {
            let edge = |i: f64| if i < 0.0 { 0.0 } else { 1e-3 * 10f64.powf(i / 12.0) };
            let i = number(index);
            runs.last_mut().expect(WHY).bins.push(Bin {
                r_min: edge(i - 1.0),
                r_max: edge(i),
                once: number(once),
                more: number(more),
                error: number(error),
            });
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{CATALOGUE, find};

    #[test]
    fn runs_fit_the_catalogue() {
        let runs =
            CATALOGUE.iter().flat_map(|m| (0..3).filter_map(move |c| channel_run(m.name, c).map(|run| (m, c, run))));
        let mut count = 0;
        for (material, c, run) in runs {
            count += 1;
            let sigma = material.sigma_s_prime_per_mm()[c] + material.sigma_a_per_mm()[c];
            assert!((run.sigma_t_prime_per_mm / sigma - 1.0).abs() < 1e-9, "{}", material.name);
            let reference = material.reflectance_isotropic()[c];
            assert!((run.reflectance - reference).abs() < 6.0 * run.reflectance_error, "{} {c}", material.name);
            // What the bins hold: all but the tails that were left out.
            let held: f64 = run.bins().map(|b| b.flux()).sum();
            assert!(held < 1.0001 * run.reflectance && held > 0.999 * run.reflectance, "{} {c}: {held}", material.name);
        }
        assert_eq!(count, 27);
        assert!(find("apple").is_some() && channel_run("apple", 0).is_none() && channel_run("apple", 1).is_some());
    }

    #[test]
    fn rings_are_in_mm() {
        let run = channel_run("marble", 1).unwrap();
        let first = run.bins().next().unwrap();
        assert_eq!(first.r_min, 0.0);
        assert!((first.r_max * 2.6241 / 1e-3 - 1.0).abs() < 1e-9);
    }
}
