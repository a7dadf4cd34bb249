//! Light from the centre of a ball of a medium that scatters all ways alike: how much leaves the ball, and in which directions.
//!
//! The density of collisions c(r), in mean free paths and per unit of light, obeys the equation of transport in integral form with the kernel
//! of Peierls [DM79, chapter 2]: r c(r) = e^(-r) / (4π r) + α/2 ∫ r' c(r') [E₁(|r - r'|) - E₁(r + r')] dr' over the radius. The first term, light
//! that has met nothing yet, has a pole; what is left, v = r c - e^(-r) / (4π r), has none, and is taken as linear between nodes.

use crate::math::GaussLegendre;
use std::f64::consts::{FRAC_PI_2, PI};

/// Steps of the angle between the direction in which light leaves and the normal, from 0 to π/2.
pub const ANGLES: usize = 64;

/// What leaves a ball, as shares of the light that starts at its centre.
pub struct Ball {
    /// Without a collision, along the normal.
    pub straight: f64,
    /// After collisions, in each step of the angle.
    pub scattered: [f64; ANGLES],
}

/// First node, in radii: v does not vanish at the centre, though the integral at the centre itself does.
const FIRST: f64 = 1e-4;
/// What is left of a flight that is no longer followed.
const FARTHEST: f64 = 25.0;

/// Where c is known.
struct Collisions {
    radii: Vec<f64>,
    v: Vec<f64>,
}

impl Ball {
    /// Of `radius` mean free paths, up to some tens, where a collision leaves the share `albedo` in \[0, 1\].
    pub fn new(radius: f64, albedo: f64) -> Self {
        let collisions = Collisions::new(radius, albedo);
        let straight = (-radius).exp();
        let shape = collisions.leaving(radius).map(|s| 2.0 * PI * radius * radius * albedo * s);
        let sum: f64 = shape.iter().sum();
        // What is scattered once leaves or is absorbed. Both are too high alike, by what lines between nodes are.
        let factor = albedo * (1.0 - straight) / (sum + (1.0 - albedo) * collisions.count());
        Self { straight, scattered: shape.map(|s| if albedo > 0.0 { s * factor } else { 0.0 }) }
    }
}

impl Collisions {
    fn new(radius: f64, albedo: f64) -> Self {
        let n = 48 + (6.0 * radius) as usize;
        let node = |i: usize| radius * (FIRST + (1.0 - FIRST) * (0.5 - 0.5 * (PI * i as f64 / (n - 1) as f64).cos()));
        let radii: Vec<f64> = (0..n).map(node).collect();
        let rule = GaussLegendre::new(24);
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(n);
        for (i, &r) in radii.iter().enumerate() {
            let mut row = vec![0.0; n + 1];
            let apart: Vec<[f64; 2]> = radii.iter().map(|s| integrals((r - s).abs())).collect();
            let beyond: Vec<[f64; 2]> = radii.iter().map(|s| integrals(r + s)).collect();
            for j in 0..n - 1 {
                let h = radii[j + 1] - radii[j];
                // The share of the inner end, and that of the outer one.
                let (near, far) = if j >= i { (j, j + 1) } else { (j + 1, j) };
                let [all, farther] = moments((radii[near] - r).abs(), &apart[near], &apart[far], h);
                row[near] += all - farther;
                row[far] += farther;
                let [all, farther] = moments(r + radii[j], &beyond[j], &beyond[j + 1], h);
                row[j] -= all - farther;
                row[j + 1] -= farther;
            }
            row.iter_mut().for_each(|a| *a *= -0.5 * albedo);
            row[i] += 1.0;
            row[n] = albedo * once(r, radius, &rule);
            rows.push(row);
        }
        Self { v: solve(rows), radii }
    }

    /// r c(r).
    fn at(&self, r: f64) -> f64 {
        let i = self.radii.partition_point(|s| *s < r).clamp(1, self.radii.len() - 1);
        let (a, b) = (self.radii[i - 1], self.radii[i]);
        let t = ((r - a) / (b - a)).clamp(0.0, 1.0);
        self.v[i - 1] + (self.v[i] - self.v[i - 1]) * t + (-r).exp() / (4.0 * PI * r)
    }

    /// How many collisions there are after the first.
    fn count(&self) -> f64 {
        let mut sum = 0.0;
        for (r, v) in self.radii.windows(2).zip(self.v.windows(2)) {
            // ∫ 4π r v dr, v linear.
            let (h, slope) = (r[1] - r[0], v[1] - v[0]);
            sum += 4.0 * PI * h * (r[0] * v[0] + 0.5 * (r[0] * slope + h * v[0]) + h * slope / 3.0);
        }
        sum
    }

    /// The light that leaves in each step of the angle, but for a constant factor: 2π R² sin θ cos θ ∫ c e^(-s) ds along the chord.
    fn leaving(&self, radius: f64) -> [f64; ANGLES] {
        let (angles, rule) = (GaussLegendre::new(1), GaussLegendre::new(6));
        let step = FRAC_PI_2 / ANGLES as f64;
        std::array::from_fn(|k| {
            angles.integrate(step * k as f64, step * (k + 1) as f64, |theta| {
                // Along the chord r = b cosh y; c ds = r c dy has no peak where it passes the centre.
                let (b, end) = (radius * theta.sin(), radius * theta.cos());
                let lengths = [0.0, 0.3, 0.8, 1.5, 2.5, 4.0, 6.0, 9.0, 13.0, 18.0, FARTHEST];
                let mut cuts: Vec<f64> =
                    lengths.iter().map(|s| end - s).chain([0.0, b, -b, 4.0 * b, -4.0 * b]).collect();
                cuts.retain(|t| t.abs() <= end && end - t <= FARTHEST);
                if 2.0 * end < FARTHEST {
                    cuts.push(-end);
                }
                cuts.sort_by(f64::total_cmp);
                let light = |y: f64| self.at((b * y.cosh()).min(radius)) * (b * y.sinh() - end).exp();
                let y = |t: f64| (t / b).asinh();
                let sum: f64 = cuts.windows(2).map(|c| rule.integrate(y(c[0]), y(c[1]), light)).sum();
                theta.sin() * theta.cos() * sum
            })
        })
    }
}

/// ½ ∫ e^(-s)/(4π s) [E₁(|r - s|) - E₁(r + s)] ds over the radius: light that has met its second collision.
fn once(r: f64, radius: f64, rule: &GaussLegendre) -> f64 {
    let kernel = |s: f64| (-s).exp() / (8.0 * PI) * (e1((r - s).abs()) - e1(r + s));
    // Cubes take the logarithm at s = r out of the integrand.
    let inner = rule.integrate(0.0, 1.0, |u| {
        let s = r * (1.0 - u * u * u);
        if s > 0.0 { kernel(s) / s * r * 3.0 * u * u } else { 0.0 }
    });
    let reach = (radius.min(r + FARTHEST) / r).ln();
    if reach <= 0.0 {
        return inner;
    }
    inner + rule.integrate(0.0, 1.0, |u| kernel(r * (reach * u * u * u).exp()) * reach * 3.0 * u * u)
}

/// E₂ and E₃.
fn integrals(t: f64) -> [f64; 2] {
    let e = (-t).exp();
    let e2 = if t > 0.0 { e - t * e1(t) } else { 1.0 };
    [e2, 0.5 * (e - t * e2)]
}

/// ∫ E₁(t) dt from `a` to `a + h`, and the same with the weight (t - a)/h, by E₂ and E₃ at both ends.
fn moments(a: f64, near: &[f64; 2], far: &[f64; 2], h: f64) -> [f64; 2] {
    let all = near[0] - far[0];
    let first = a * near[0] + near[1] - (a + h) * far[0] - far[1];
    [all, (first - a * all) / h]
}

/// The exponential integral E₁ of t > 0: its series, and Lentz's continued fraction [PTVF07, section 6.3].
fn e1(t: f64) -> f64 {
    if t > 40.0 {
        return 0.0;
    }
    const EULER: f64 = 0.577_215_664_901_532_9;
    if t <= 1.0 {
        let (mut sum, mut term) = (-EULER - t.ln(), -1.0);
        for k in 1..20 {
            term *= -t / f64::from(k);
            sum += term / f64::from(k);
        }
        return sum;
    }
    let (mut b, mut c) = (t + 1.0, f64::INFINITY);
    let mut d = 1.0 / b;
    let mut h = d;
    for k in 1..60 {
        let a = -f64::from(k * k);
        b += 2.0;
        d = 1.0 / (a * d + b);
        c = if c.is_infinite() { b } else { b + a / c };
        h *= c * d;
        if (c * d - 1.0).abs() < 1e-13 {
            break;
        }
    }
    h * (-t).exp()
}

/// Solves equations whose right sides are the last column. Rows sum to less than twice their diagonals, so nothing is exchanged.
fn solve(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let n = rows.len();
    for i in 0..n {
        let (done, rest) = rows.split_at_mut(i + 1);
        let pivot = &done[i];
        for row in rest {
            let factor = row[i] / pivot[i];
            (i..=n).for_each(|j| row[j] -= factor * pivot[j]);
        }
    }
    let mut x = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| rows[i][j] * x[j]).sum();
        x[i] = (rows[i][n] - known) / rows[i][i];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, hash_combine, unit_f64};

    #[test]
    fn exponential_integrals_have_their_printed_values() {
        // Abramowitz and Stegun, table 5.1.
        for (t, value) in [(0.5, 0.559_773_595), (1.0, 0.219_383_934), (2.0, 0.048_900_511), (10.0, 4.156_969e-6)] {
            assert!((e1(t) / value - 1.0).abs() < 1e-6, "{t}: {}", e1(t));
        }
        assert!((e1(1.0 - 1e-9) - e1(1.0 + 1e-9)).abs() < 1e-8);
    }

    /// What is not absorbed leaves, to 0.6 % before it is made so: the chords know nothing of the count.
    #[test]
    fn chords_and_absorption_agree() {
        for radius in [0.5, 1.5, 4.0, 12.0, 24.0] {
            for albedo in [0.3, 0.9, 0.99, 1.0] {
                let collisions = Collisions::new(radius, albedo);
                let shape = collisions.leaving(radius);
                let leaving = 2.0 * PI * radius * radius * albedo * shape.iter().sum::<f64>();
                let absorbed = (1.0 - albedo) * collisions.count();
                let scattered = albedo * (1.0 - (-radius).exp());
                println!("{radius} {albedo}: {leaving:.6} + {absorbed:.6} of {scattered:.6}");
                assert!(((leaving + absorbed) / scattered - 1.0).abs() < 6e-3, "{radius} {albedo}");
            }
        }
    }

    /// Walks, to five standard errors: what leaves, and the mean cosine and sine with which it does.
    #[test]
    fn walks_agree() {
        for (radius, albedo) in [(1.5, 0.9), (4.0, 0.99), (4.0, 0.5), (12.0, 0.99), (10.0, 0.999)] {
            let ball = Ball::new(radius, albedo);
            let step = FRAC_PI_2 / ANGLES as f64;
            let mean = |f: fn(f64) -> f64| {
                let scattered: f64 =
                    ball.scattered.iter().enumerate().map(|(k, s)| s * f(step * (k as f64 + 0.5))).sum();
                ball.straight * f(0.0) + scattered
            };
            let expected = [mean(|_| 1.0), mean(f64::cos), mean(f64::sin), mean(|a| (2.0 * a).cos())];
            let (n, mut sums) = (400_000_u64, [[0.0; 2]; 4]);
            for i in 0..n {
                let mut count = 0;
                let mut number = || {
                    count += 1;
                    unit_f64(hash_combine(i, count) as u32)
                };
                let (mut x, mut weight) = (DVec3::ZERO, 1.0);
                let w = loop {
                    let (z, phi) = (1.0 - 2.0 * number(), 2.0 * PI * number());
                    let r = (1.0 - z * z).sqrt();
                    let w = DVec3::new(r * phi.cos(), r * phi.sin(), z);
                    let next = x - w * (1.0 - number()).ln();
                    if next.length() > radius {
                        break w;
                    }
                    (x, weight) = (next, weight * albedo);
                };
                // On to the surface.
                let along = x.dot(w);
                let end = x + w * ((along * along + radius * radius - x.length_squared()).sqrt() - along);
                let c = end.dot(w) / radius;
                let angle = c.min(1.0).acos();
                let each = [1.0, c, angle.sin(), (2.0 * angle).cos()];
                for (sum, v) in sums.iter_mut().zip(each) {
                    *sum = [sum[0] + v * weight, sum[1] + (v * weight).powi(2)];
                }
            }
            for (sum, expected) in sums.iter().zip(expected) {
                let mean = sum[0] / n as f64;
                let error = ((sum[1] / n as f64 - mean * mean) / n as f64).sqrt();
                println!("{radius} {albedo}: {expected:.5} {mean:.5} +- {error:.5}");
                // Steps of the angle move a mean by their square.
                assert!(
                    (mean - expected).abs() < 5.0 * error + 2e-4,
                    "{radius} {albedo}: {expected}, {mean} +- {error}"
                );
            }
        }
    }
}
