//! What leaves a half space or a slab, ring by ring, against the tables of another Monte Carlo program.
#![allow(dead_code)] // each test and bench uses its part

use crate::pencils::{Body, Shape, Sum};
use crate::support::Row;
use marmor::math::Rgb;
use marmor::optics::Medium;
use rayon::prelude::*;

/// A run against its table.
pub struct Against {
    pub chi_square: f64,
    pub freedom: u32,
    /// Difference of the reflected and the transmitted total in standard errors; none where nothing is transmitted.
    pub z: [Option<f64>; 2],
}

impl Against {
    /// Chance of a larger chi-square [WH31].
    pub fn p(&self) -> f64 {
        let f = f64::from(self.freedom);
        let k = 2.0 / (9.0 * f);
        let z = ((self.chi_square / f).cbrt() - (1.0 - k)) / k.sqrt();
        upper_tail(z)
    }
}

/// Chance of a normal number above `z`, to 1e-3 of itself for moderate z.
fn upper_tail(z: f64) -> f64 {
    // Simpson's rule over the density.
    let (steps, end) = (400, z.max(0.0) + 12.0);
    let h = (end - z) / f64::from(steps);
    let density = |x: f64| (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let sum: f64 = (0..=steps)
        .map(|i| {
            let weight = if i == 0 || i == steps { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
            weight * density(z + f64::from(i) * h)
        })
        .sum();
    sum * h / 3.0
}

/// The names of a face's columns, scattered once and more often; a half space has one face.
fn columns(slab: bool, face: usize) -> [&'static str; 2] {
    match (slab, face) {
        (false, _) => ["flux1", "flux2"],
        (true, 0) => ["R1", "R2"],
        (true, _) => ["T1", "T2"],
    }
}

/// The run of `totals` by `paths` of our own; `bins` are the rows of its profile. Lengths in transport mean free paths.
pub fn against(totals: &Row, bins: &[&Row], paths: u64, seed: u64) -> Against {
    let [s, a, g, eta, thickness] = ["mus", "mua", "g", "eta", "thickness"].map(|k| totals.number(k));
    let medium = Medium::unreduced(Rgb::splat(s as f32), Rgb::splat(a as f32), g, eta as f32).unwrap();
    let slab = thickness > 0.0;
    // As wide and deep as matters, and no wider: positions are single precision.
    let shape = match slab {
        true => Shape::Slab { thickness: thickness as f32, half_width: 200.0 },
        // 15 diffusion lengths; rays that leave a surface start a few millionths of this away from it.
        false => {
            let size = (15.0 / (3.0 * a * (s * (1.0 - g) + a)).sqrt()).clamp(30.0, 1000.0) as f32;
            Shape::Slab { thickness: size, half_width: size }
        }
    };
    let body = Body::new(shape, medium);
    let ends: Vec<f64> = bins.iter().map(|b| b.number("r_hi")).collect();
    let blocks = 16;
    let empty = || (vec![[[Sum::default(); 2]; 2]; bins.len()], [Sum::default(); 2]);
    let block = |b: u64| {
        let (mut rings, mut faces) = empty();
        body.run(b * paths / blocks..(b + 1) * paths / blocks, seed, |out| {
            let (w, face) = (f64::from(out.weight), usize::from(out.far));
            faces[face].add(w);
            if out.order > 0 {
                let ring = ends.partition_point(|&end| end <= f64::from(out.r)).min(bins.len() - 1);
                rings[ring][face][usize::from(out.order > 1)].add(w);
            }
        });
        (rings, faces)
    };
    let join = |mut a: (Vec<[[Sum; 2]; 2]>, [Sum; 2]), b: (Vec<[[Sum; 2]; 2]>, [Sum; 2])| {
        a.0.iter_mut().flatten().flatten().zip(b.0.iter().flatten().flatten()).for_each(|(a, b)| a.join(b));
        a.1.iter_mut().zip(&b.1).for_each(|(a, b)| a.join(b));
        a
    };
    let (rings, faces) = (0..blocks).into_par_iter().map(block).reduce(empty, join);
    let n = paths as f64;
    let (mut chi_square, mut freedom) = (0.0, 0);
    for (bin, sums) in bins.iter().zip(&rings) {
        for (face, sums) in sums.iter().enumerate().take(1 + usize::from(slab)) {
            for (key, sum) in columns(slab, face).iter().zip(sums) {
                let (truth, its) = (bin.number(key), bin.number(&format!("{key}_se")));
                let (mean, error) = sum.mean(n);
                // Bins with hits enough for a normal law in both.
                if truth > 0.0 && its < 0.15 * truth && error < 0.15 * mean {
                    chi_square += (mean - truth).powi(2) / (its * its + error * error);
                    freedom += 1;
                }
            }
        }
    }
    let z = |face: usize, key: &str| {
        let (truth, its) = (totals.number(key), totals.number(&format!("{key}_se")));
        let (mean, error) = faces[face].mean(n);
        (truth > 0.0 && mean > 0.0).then(|| (mean - truth) / its.hypot(error))
    };
    Against { chi_square, freedom, z: [z(0, "R"), if slab { z(1, "T") } else { None }] }
}
