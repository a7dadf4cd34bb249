//! Random walks from the camera through a ball and through a slab, from the formulas alone: weights in f64, one medium at a
//! time, and no code of the library.

use std::f64::consts::{PI, TAU};

pub type Vector = [f64; 3];

pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + s b.
pub fn along(a: Vector, s: f64, b: Vector) -> Vector {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

pub fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn unit(a: Vector) -> Vector {
    along([0.0; 3], 1.0 / dot(a, a).sqrt(), a)
}

/// SplitMix64.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed);
        Self(random.bits())
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn number(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// One channel of a homogeneous medium.
#[derive(Clone, Copy, Debug)]
pub struct Medium {
    pub sigma_s: f64,
    pub sigma_a: f64,
    pub g: f64,
    pub eta: f64,
}

impl Medium {
    fn sigma_t(&self) -> f64 {
        self.sigma_s + self.sigma_a
    }

    fn albedo(&self) -> f64 {
        self.sigma_s / self.sigma_t()
    }

    /// Henyey-Greenstein phase function [1/sr].
    fn phase(&self, cosine: f64) -> f64 {
        let g = self.g;
        (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
    }

    /// A direction with that density about `w`.
    fn scatter(&self, w: Vector, random: &mut Random) -> Vector {
        let (g, u) = (self.g, random.number());
        let cosine = if g == 0.0 {
            2.0 * u - 1.0
        } else {
            let q = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
            (1.0 + g * g - q * q) / (2.0 * g)
        };
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (sin, cos) = (TAU * random.number()).sin_cos();
        let a = unit(if w[0].abs() < 0.6 { cross([1.0, 0.0, 0.0], w) } else { cross([0.0, 1.0, 0.0], w) });
        let next = along(along(along([0.0; 3], cosine, w), sine * cos, a), sine * sin, cross(w, a));
        unit(next)
    }

    /// Distance to the next collision.
    fn distance(&self, random: &mut Random) -> f64 {
        -(1.0 - random.number()).ln() / self.sigma_t()
    }
}

/// Fresnel reflectance of unpolarised light that comes out of index 1 onto index `n`, and the cosine behind; total
/// reflection has 1 and 0.
fn fresnel(n: f64, cosine: f64) -> (f64, f64) {
    let square = 1.0 - (1.0 - cosine * cosine) / (n * n);
    if square <= 0.0 {
        return (1.0, 0.0);
    }
    let behind = square.sqrt();
    let s = (cosine - n * behind) / (cosine + n * behind);
    let p = (n * cosine - behind) / (n * cosine + behind);
    (0.5 * (s * s + p * p), behind)
}

/// Direction behind a face with the normal `normal`, against which `w` runs, for Snell's law with index `n` behind it.
fn refracted(w: Vector, normal: Vector, n: f64, behind: f64) -> Vector {
    let cosine = -dot(w, normal);
    unit(along(along([0.0; 3], 1.0 / n, w), cosine / n - behind, normal))
}

fn mirrored(w: Vector, normal: Vector) -> Vector {
    along(w, -2.0 * dot(w, normal), normal)
}

/// Light of radiance 1.
#[derive(Clone, Copy, Debug)]
pub enum Light {
    /// From all around.
    Sky,
    /// A rectangle that shines on the side of its normal; half edges at right angles.
    Lamp { centre: Vector, edges: [Vector; 2], normal: Vector },
}

impl Light {
    /// Radiance along a ray from `x`.
    fn seen(&self, x: Vector, w: Vector) -> f64 {
        let Self::Lamp { centre, edges, normal } = *self else { return 1.0 };
        let towards = -dot(w, normal);
        if towards <= 0.0 {
            return 0.0;
        }
        let t = dot(along(x, -1.0, centre), normal) / towards;
        let at = along(along(x, t, w), -1.0, centre);
        let inside = |e: Vector| dot(at, e).abs() <= dot(e, e);
        f64::from(u8::from(t > 0.0 && edges.into_iter().all(inside)))
    }

    /// A direction from the origin towards a point of it, and radiance times solid angle over the density of that point.
    fn drawn(&self, random: &mut Random) -> (Vector, f64) {
        let Self::Lamp { centre, edges: [u, v], normal } = *self else { unreachable!("the slab has a lamp") };
        let at = along(along(centre, 2.0 * random.number() - 1.0, u), 2.0 * random.number() - 1.0, v);
        let (w, area) = (unit(at), 4.0 * (dot(u, u) * dot(v, v)).sqrt());
        (w, area * (-dot(w, normal)).max(0.0) / dot(at, at))
    }
}

/// Weights below this go on by chance.
const ROULETTE: f64 = 0.25;

fn goes_on(weight: &mut f64, random: &mut Random) -> bool {
    if *weight < ROULETTE {
        if random.number() * ROULETTE >= *weight {
            return false;
        }
        *weight = ROULETTE;
    }
    true
}

/// Radiance by order: scattered never, once, more often.
pub type Orders = [f64; 3];

/// Radiance that comes from the ball of radius 1 about the origin against the ray from `from` along `w`. The lamp is met by
/// chance, at each boundary by the share of the light that leaves there.
pub fn ball(medium: &Medium, light: &Light, from: Vector, w: Vector, random: &mut Random) -> Orders {
    let mut sum = [0.0; 3];
    let half = -dot(from, w);
    let square = half * half - dot(from, from) + 1.0;
    if square <= 0.0 {
        return sum;
    }
    let mut x = unit(along(from, half - square.sqrt(), w));
    let (reflected, behind) = fresnel(medium.eta, -dot(w, x));
    sum[0] += reflected * light.seen(x, mirrored(w, x));
    let mut w = refracted(w, x, medium.eta, behind);
    let (mut weight, mut order) = (1.0 - reflected, 0);
    loop {
        let half = -dot(x, w);
        let boundary = half + (half * half - dot(x, x) + 1.0).max(0.0).sqrt();
        let flown = medium.distance(random);
        if flown < boundary {
            x = along(x, flown, w);
            w = medium.scatter(w, random);
            (weight, order) = (weight * medium.albedo(), order + 1);
        } else {
            x = unit(along(x, boundary, w));
            let inwards = along([0.0; 3], -1.0, x);
            let (reflected, behind) = fresnel(1.0 / medium.eta, -dot(w, inwards));
            if reflected < 1.0 {
                let out = refracted(w, inwards, 1.0 / medium.eta, behind);
                sum[order.min(2)] += weight * (1.0 - reflected) * light.seen(x, out);
            }
            weight *= reflected;
            w = mirrored(w, inwards);
        }
        if !goes_on(&mut weight, random) {
            return sum;
        }
    }
}

/// The same of the slab without end in 0 < z < `depth` under a lamp above z = `depth` that is so far away that its light is the
/// same everywhere. Light that comes unscattered to a collision is known in closed form: it goes to and fro between the
/// faces, each time weaker by R exp(-τ / μ).
pub fn slab(medium: &Medium, depth: f64, light: &Light, w: Vector, random: &mut Random) -> Orders {
    let mut sum = [0.0; 3];
    let face = |up: bool| if up { [0.0, 0.0, 1.0] } else { [0.0, 0.0, -1.0] };
    let normal = face(w[2] < 0.0);
    let (reflected, behind) = fresnel(medium.eta, -dot(w, normal));
    // The lamp is far away: from everywhere the same.
    sum[0] += reflected * light.seen([0.0; 3], mirrored(w, normal));
    let mut z = if w[2] < 0.0 { depth } else { 0.0 };
    let mut w = refracted(w, normal, medium.eta, behind);
    let (mut weight, mut order) = (1.0 - reflected, 0);
    loop {
        let boundary = if w[2] > 0.0 { (depth - z) / w[2] } else { -z / w[2] };
        let flown = medium.distance(random);
        if flown < boundary {
            z += flown * w[2];
            (weight, order) = (weight * medium.albedo(), order + 1);
            sum[order.min(2)] += weight * unscattered(medium, (depth, z), light, w, random);
            w = medium.scatter(w, random);
        } else {
            let up = w[2] > 0.0;
            z = if up { depth } else { 0.0 };
            let inwards = face(!up);
            let (reflected, behind) = fresnel(1.0 / medium.eta, -dot(w, inwards));
            if order == 0 && reflected < 1.0 {
                let out = refracted(w, inwards, 1.0 / medium.eta, behind);
                sum[0] += weight * (1.0 - reflected) * light.seen([0.0; 3], out);
            }
            weight *= reflected;
            w = mirrored(w, inwards);
        }
        if !goes_on(&mut weight, random) {
            return sum;
        }
    }
}

/// Light that comes to `z` unscattered and is scattered there against `w`, as radiance outside.
fn unscattered(medium: &Medium, (depth, z): (f64, f64), light: &Light, w: Vector, random: &mut Random) -> f64 {
    let (to_lamp, radiance) = light.drawn(random);
    let (reflected, behind) = fresnel(medium.eta, to_lamp[2]);
    let down = refracted(along([0.0; 3], -1.0, to_lamp), [0.0, 0.0, 1.0], medium.eta, behind);
    let up = [down[0], down[1], -down[2]];
    // Flux over an area across the way inside. It would be radiance times η² over a solid angle smaller by η² and the cosines.
    let flux = radiance * (1.0 - reflected) * to_lamp[2] / behind;
    let passed = |way: f64| (-medium.sigma_t() * way / behind).exp();
    let again = 1.0 / (1.0 - (reflected * passed(depth)).powi(2));
    let falling = flux * passed(depth - z) * again;
    let rising = flux * passed(depth) * reflected * passed(z) * again;
    // Light runs against the walk. Radiance falls by η² on its way out.
    let scattered = falling * medium.phase(-dot(w, down)) + rising * medium.phase(-dot(w, up));
    scattered / (medium.eta * medium.eta)
}

#[test]
fn reflectances_are_those_of_tables() {
    assert!((fresnel(1.5, 1.0).0 - 0.04).abs() < 1e-12);
    // Brewster's angle has no light of one polarisation; beyond the critical angle all comes back.
    let brewster = (1.0 / (1.0 + 1.5_f64.powi(2))).sqrt();
    assert!((fresnel(1.5, brewster).0 - 0.5 * (5.0_f64 / 13.0).powi(2)).abs() < 1e-12);
    assert_eq!(fresnel(1.0 / 1.5, 0.7), (1.0, 0.0));
}
