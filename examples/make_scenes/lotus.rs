//! The hero: a lotus in the round on a turned foot, as a marble carver would cut it. Thin ribbed petals let light
//! through, the seed pod and the foot hardly any; seeds, beads and flutes are the fine detail.
//! All lengths in millimetres; y is up, the foot stands on y = 0.

use std::f64::consts::{PI, TAU};

use marmor::math::{DVec2, DVec3, hash, hash_combine, unit_f64};

use crate::polygonise::Field;

/// The union of the foot and the petals.
pub struct Lotus {
    petals: Vec<Petal>,
}

/// Petals that share a circle around the axis.
struct Ring {
    count: usize,
    /// Angle of the first petal [turns of one petal].
    phase: f64,
    /// Radius and height of the petals' roots [mm].
    root: [f64; 2],
    /// Direction of growth above the horizontal at the root and at the tip [degrees].
    rise: [f64; 2],
    /// Length along the midrib and half the greatest width [mm].
    length: f64,
    half_width: f64,
    /// How strongly the sides curl towards the axis [1/mm].
    cup: f64,
    /// How strongly the last third bends away from the axis [1/mm].
    recurve: f64,
    /// Half the thickness at the root and at the rim [mm].
    half_thickness: [f64; 2],
}

const RINGS: [Ring; 3] = [
    Ring {
        count: 5,
        phase: 0.75,
        root: [5.5, 19.5],
        rise: [22.0, 104.0],
        length: 27.0,
        half_width: 8.0,
        cup: 0.042,
        recurve: 0.012,
        half_thickness: [1.5, 0.62],
    },
    Ring {
        count: 6,
        phase: 0.5,
        root: [5.8, 17.5],
        rise: [8.0, 80.0],
        length: 28.0,
        half_width: 8.8,
        cup: 0.036,
        recurve: 0.014,
        half_thickness: [1.6, 0.66],
    },
    Ring {
        count: 7,
        phase: 0.25,
        root: [5.5, 15.5],
        rise: [-6.0, 50.0],
        length: 28.0,
        half_width: 8.6,
        cup: 0.030,
        recurve: 0.018,
        half_thickness: [1.8, 0.75],
    },
];

/// One petal: a shell around a circular arc, curled across and bent at its tip.
struct Petal {
    /// Azimuth of the midrib as (cos, sin).
    azimuth: DVec2,
    /// Centre of the midrib's arc in the petal's own plane (outward, up), its radius, and the direction from the centre
    /// to the middle of the arc.
    centre: DVec2,
    radius: f64,
    middle: f64,
    length: f64,
    half_width: f64,
    cup: f64,
    recurve: f64,
    half_thickness: [f64; 2],
    /// A ball around the petal: its centre in the petal's plane, its radius.
    ball: (DVec2, f64),
}

impl Petal {
    /// The petal `index` of a ring, with the small irregularities of handwork.
    fn new(ring: &Ring, index: usize) -> Self {
        let seed = hash_combine(ring.count as u64, index as u64);
        let vary = |what: u64| unit_f64((hash(seed ^ hash(what)) >> 32) as u32) * 2.0 - 1.0;
        let azimuth = (index as f64 + ring.phase + 0.06 * vary(1)) / ring.count as f64 * TAU;
        // Every other petal stands a little steeper, so that neighbours pass each other.
        let lean = 3.0 * vary(2) + if index.is_multiple_of(2) { 3.5 } else { -3.5 };
        let rise = ring.rise.map(|degrees| (degrees + lean).to_radians());
        let length = ring.length * (1.0 + 0.04 * vary(3));
        let radius = length / (rise[1] - rise[0]);
        // A direction of growth a turns anticlockwise around a centre to its left, at a + 90 degrees.
        let root = DVec2::from_array(ring.root);
        let centre = root + radius * DVec2::new(-rise[0].sin(), rise[0].cos());
        let middle = 0.5 * (rise[0] + rise[1]) - 0.5 * PI;
        let ball = (centre + radius * DVec2::from_angle(middle), 0.5 * length + 3.0);
        Self {
            azimuth: DVec2::from_angle(azimuth),
            centre,
            radius,
            middle,
            length,
            half_width: ring.half_width * (1.0 + 0.04 * vary(4)),
            cup: ring.cup,
            recurve: ring.recurve,
            half_thickness: ring.half_thickness,
            ball,
        }
    }

    /// Distance to the petal, exact enough near its surface; any number above `limit` if it is farther than that.
    fn distance(&self, p: DVec3, limit: f64) -> f64 {
        let outward = p.x * self.azimuth.x + p.z * self.azimuth.y;
        let across = p.z * self.azimuth.x - p.x * self.azimuth.y;
        let plane = DVec2::new(outward, p.y);
        let to_ball = plane.distance(self.ball.0).hypot(across) - self.ball.1;
        if to_ball > limit.min(4.0) {
            return to_ball;
        }
        // Position along the midrib, 0..1, and height over the arc towards its centre.
        let from_centre = plane - self.centre;
        let turned = DVec2::from_angle(-self.middle).rotate(from_centre);
        let t = 0.5 + self.radius * turned.to_angle() / self.length;
        let late = (t - 0.62).max(0.0) * self.length;
        let lift = self.cup * across * across - self.recurve * late * late;
        let slope = (2.0 * self.cup * across).hypot(2.0 * self.recurve * late);
        let height = (self.radius - from_centre.length() - lift) / slope.hypot(1.0);

        // Outline: widest past the middle, pointed at the tip.
        let (width, width_slope) = self.width(t);
        let aside = (across.abs() - width) / (width_slope / self.length).hypot(1.0);
        let outline = aside.max(-t * self.length);

        // Ribs converge towards the tip and fade where they would be too fine to carve.
        let v = across / width.max(1.0);
        let fade = smooth_step(0.12, 0.35, t) * smooth_step(1.5, 4.5, width) * smooth_step(1.0, 0.8, v.abs());
        let ribs = 0.17 * fade * (v.abs() * 3.0 * TAU * 0.83).cos();
        let midrib = 0.35 * fade * (-(across / 0.9).powi(2)).exp();
        let [root, rim] = self.half_thickness;
        let thin = rim + (root - rim) * (1.0 - t).clamp(0.0, 1.0).powi(2);
        smooth_max(height.abs() - thin - ribs - midrib, outline, 0.9)
    }

    /// Half the width at `t` along the midrib [mm], and its derivative by `t`.
    fn width(&self, t: f64) -> (f64, f64) {
        const WIDEST: f64 = 0.56;
        const AT_ROOT: f64 = 0.5;
        let w = self.half_width;
        if t < WIDEST {
            let q = ((WIDEST - t) / WIDEST).clamp(0.0, 1.0);
            (w * (1.0 - (1.0 - AT_ROOT) * q * q), w * (1.0 - AT_ROOT) * 2.0 * q / WIDEST)
        } else {
            // (1 - q²)(1 - 0.4 q²), continued past the tip by its tangent.
            let q = (t - WIDEST) / (1.0 - WIDEST);
            let (value, slope) = if q < 1.0 {
                let q2 = q * q;
                ((1.0 - q2) * (1.0 - 0.4 * q2), -2.8 * q + 1.6 * q * q2)
            } else {
                (-1.2 * (q - 1.0), -1.2)
            };
            (w * value, w * slope / (1.0 - WIDEST))
        }
    }
}

impl Lotus {
    /// The whole figure.
    pub fn new() -> Self {
        let petals = RINGS.iter().flat_map(|ring| (0..ring.count).map(move |i| Petal::new(ring, i))).collect();
        Self { petals }
    }
}

impl Field for Lotus {
    fn bounds(&self) -> (DVec3, DVec3) {
        (DVec3::new(-40.0, -1.5, -40.0), DVec3::new(40.0, 52.0, 40.0))
    }

    fn at(&self, p: DVec3) -> f64 {
        // Between the roots the creases widen, as a chisel cannot reach there, and a core fills the heart.
        let r = p.x.hypot(p.z);
        let crease = 0.5 + 2.0 * smooth_step(15.0, 8.0, r);
        let core = p.distance(DVec3::Y * 18.5) - 7.6;
        let rest = smooth_min(smooth_min(pod(p), core, 2.0), foot(p), 1.2);
        self.petals.iter().fold(rest, |d, petal| smooth_min(d, petal.distance(p, d + crease), crease))
    }
}

/// The seed pod: a cone that widens upwards, a domed top with pits, a seed in each.
fn pod(p: DVec3) -> f64 {
    const TOP: f64 = 30.0;
    let r = p.x.hypot(p.z);
    let side = (r - (4.4 + (p.y - 15.0) * 0.27)) * 0.965;
    let top = p.y - TOP + 0.02 * r * r;
    let bottom = 12.0 - p.y;
    // A rolled lip around the top.
    let lip = DVec2::new(r - 8.2, p.y - 28.2).length() - 0.9;
    let body = smooth_min(smooth_max(side, top, 1.2).max(bottom), lip, 0.8);
    let mut carved = body;
    let seats = std::iter::once((0.0, 0.0, 1)).chain([(3.05, 0.2, 6), (6.1, 0.0, 12)]);
    for (radius, phase, count) in seats {
        let seat = nearest_of(p, radius, phase, count);
        let from = p - DVec3::new(seat.x, TOP - 0.02 * radius * radius, seat.y);
        carved = smooth_max(carved, 1.3 - from.length(), 0.3);
        let seed = (from + DVec3::Y * 0.75).length() - 0.85;
        carved = smooth_min(carved, seed, 0.4);
    }
    carved
}

/// The foot: a plinth with a beaded edge, a ring, a fluted stem.
fn foot(p: DVec3) -> f64 {
    let r = p.x.hypot(p.z);
    let profile = DVec2::new(r, p.y);
    let plinth = rounded_disc(profile, 15.0, [0.0, 2.6], 0.5);
    let step = rounded_disc(profile, 12.2, [2.0, 4.4], 0.5);
    let torus = DVec2::new(r - 8.2, 5.6).distance(DVec2::new(0.0, p.y)) - 1.7;
    let bead = nearest_of(p, 13.55, 0.0, 30);
    let beads = p.distance(DVec3::new(bead.x, 2.9, bead.y)) - 1.05;
    // The stem narrows to a waist and opens into the calyx.
    let y = p.y.clamp(4.0, 20.0);
    let waist = 5.0 + 0.07 * (y - 11.0) * (y - 11.0);
    let angle = p.z.atan2(p.x);
    let flutes = 0.6 * (12.0 * angle).cos().abs() * smooth_step(6.0, 9.0, y) * smooth_step(18.0, 14.0, y);
    let stem = smooth_max((r - waist - 0.4 + flutes) * 0.8, (p.y - 10.5).abs() - 7.5, 0.8);
    let turned = smooth_min(plinth, step, 0.25).min(torus);
    smooth_min(smooth_min(turned, stem, 0.8), beads, 0.3)
}

/// Distance in a plane through the axis to a disc between two heights with rounded edges.
fn rounded_disc(profile: DVec2, radius: f64, [low, high]: [f64; 2], round: f64) -> f64 {
    let from = DVec2::new(profile.x - radius, (profile.y - 0.5 * (low + high)).abs() - 0.5 * (high - low)) + round;
    from.max(DVec2::ZERO).length() + from.max_element().min(0.0) - round
}

/// The one of `count` points, spread evenly over a circle around the axis, whose azimuth is nearest: (x, z).
fn nearest_of(p: DVec3, radius: f64, phase: f64, count: usize) -> DVec2 {
    let step = TAU / count as f64;
    let index = (p.z.atan2(p.x) / step - phase).round();
    radius * DVec2::from_angle((index + phase) * step)
}

/// Minimum whose crease is rounded over a width of `k` [mm].
fn smooth_min(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0);
    a.min(b) - h * h * 0.25 / k
}

fn smooth_max(a: f64, b: f64, k: f64) -> f64 {
    -smooth_min(-a, -b, k)
}

/// 0 at `from`, 1 at `to`, in between without a kink; `from` may be the larger.
fn smooth_step(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
