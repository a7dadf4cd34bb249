//! Light in plane layers by a Monte Carlo program of its own: distances by each layer's extinction, weights by albedo, one channel, no
//! geometry but depth.

use marmor::math::{hash, unit_f32};

/// A layer of a scattering medium.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    pub sigma_s: f64,
    pub sigma_a: f64,
    /// Mean cosine of Henyey and Greenstein's phase function.
    pub g: f64,
    /// Refractive index over that of air.
    pub eta: f64,
    pub depth: f64,
}

/// Fresnel's reflectance of unpolarised light from index `a` to `b`, and the cosine behind.
fn fresnel(a: f64, b: f64, mu: f64) -> (f64, f64) {
    let behind = 1.0 - (a / b).powi(2) * (1.0 - mu * mu);
    if behind <= 0.0 {
        return (1.0, 0.0);
    }
    let nu = behind.sqrt();
    let (s, p) = ((a * mu - b * nu) / (a * mu + b * nu), (b * mu - a * nu) / (b * mu + a * nu));
    (0.5 * (s * s + p * p), nu)
}

/// Share of light from straight above that goes up again, with its standard error.
pub fn reflected(layers: &[Layer], paths: u64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..paths {
        let value = path(layers, i);
        (sum, squares) = (sum + value, squares + value * value);
    }
    let n = paths as f64;
    (sum / n, ((squares / n - (sum / n).powi(2)) / n).sqrt())
}

/// The weight with which one path goes up.
fn path(layers: &[Layer], number: u64) -> f64 {
    let mut drawn = 0;
    let mut random = || {
        drawn += 1;
        f64::from(unit_f32((hash(hash(number + 1) ^ drawn) >> 32) as u32))
    };
    let index = |k: i64| layers.get(k as usize).map_or(1.0, |l| l.eta);
    // mu > 0 goes down; `layer` -1 is the air above.
    let (mut layer, mut z, mut mu, mut weight) = (-1_i64, 0.0, 1.0_f64, 1.0);
    loop {
        if layer >= 0 && (layer as usize) < layers.len() {
            let l = layers[layer as usize];
            let sigma_t = l.sigma_s + l.sigma_a;
            let way = -(1.0 - random()).ln() / sigma_t;
            let next = z + way * mu;
            if (0.0..l.depth).contains(&next) {
                weight *= l.sigma_s / sigma_t;
                if weight < 1e-3 {
                    if random() < 0.5 {
                        return 0.0;
                    }
                    weight *= 2.0;
                }
                let u = random();
                let cosine = if l.g == 0.0 {
                    1.0 - 2.0 * u
                } else {
                    let t = (1.0 - l.g * l.g) / (1.0 - l.g + 2.0 * l.g * u);
                    (1.0 + l.g * l.g - t * t) / (2.0 * l.g)
                };
                let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
                let side = (std::f64::consts::TAU * random()).cos();
                z = next;
                mu = (mu * cosine + (1.0 - mu * mu).max(0.0).sqrt() * sine * side).clamp(-1.0, 1.0);
                continue;
            }
        } else if layer < 0 && mu < 0.0 {
            return weight;
        } else if layer >= 0 && mu > 0.0 {
            return 0.0;
        }
        // At the interface below or above.
        let to = if mu > 0.0 { layer + 1 } else { layer - 1 };
        let (r, behind) = fresnel(index(layer), index(to), mu.abs());
        let mirrored = random() < r;
        let in_layers = |k: i64| layers.get(k as usize).map_or(0.0, |l| l.depth);
        if mirrored {
            z = if mu > 0.0 { in_layers(layer) } else { 0.0 };
            mu = -mu;
        } else {
            z = if mu > 0.0 { 0.0 } else { in_layers(to) };
            (layer, mu) = (to, behind * mu.signum());
        }
    }
}
