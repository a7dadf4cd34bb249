//! Light that enters close to an exit, sampled anew for each exit: for media whose light does not come as far as the next
//! sample of a cache.

use super::{CachedSample, Envelope, Filler};
use crate::bssrdf::{Bssrdf, Exit, Model, ModelVisitor, Partition};
use crate::geometry::SurfacePoint;
use crate::math::{Frame, Rgb, Vec3, hash};
use crate::query::{Ray, RayTally};
use std::f32::consts::{PI, TAU};

/// Rings of the radial density, but for the innermost disk.
const RINGS: usize = 80;
/// Radius of the innermost disk, relative to the outermost.
const INNERMOST: f32 = 1e-8;
/// Share of the samples that is spread evenly over the rings, lest a model differ from the envelope.
const EVEN: f64 = 0.1;
/// Chance of each axis that a disk is laid across: mostly the normal, so that steep walls are met along the others.
const AXES: [f32; 3] = [0.5, 0.25, 0.25];
/// Surfaces that one probe finds at most.
const MOST_HITS: u32 = 64;

/// Samples of the near part of S_d on disks about an exit, projected onto the surface [King et al. 2013].
pub struct NearField {
    /// What belongs to the near part.
    pub partition: Partition,
    radius: f32,
    /// Outer radii of the rings [unit].
    radii: Vec<f32>,
    /// Chance of each ring and all within it.
    cumulative: Vec<f32>,
}

impl NearField {
    /// The near part within `radius` [unit].
    pub fn new(envelope: &Envelope, radius: f32) -> Self {
        let partition = Partition::within(radius);
        let ratio = INNERMOST.powf(-1.0 / RINGS as f32);
        let radii: Vec<f32> = (0..=RINGS).map(|k| radius * INNERMOST * ratio.powi(k as i32)).collect();
        let mut mass = vec![[0.0_f64; 3]; radii.len()];
        for (k, mass) in mass.iter_mut().enumerate() {
            let (inner, outer) = (if k == 0 { 0.0 } else { radii[k - 1] }, radii[k]);
            let middle2 = 0.5 * (inner * inner + outer * outer);
            let value = envelope.at(middle2).value * partition.near(middle2) * (outer * outer - inner * inner);
            *mass = [value.x, value.y, value.z].map(f64::from);
        }
        let total: [f64; 3] = std::array::from_fn(|c| mass.iter().map(|m| m[c]).sum());
        let live = total.iter().filter(|&&t| t > 0.0).count().max(1) as f64;
        let mut sum = 0.0;
        let cumulative: Vec<f64> = mass
            .iter()
            .map(|m| {
                let own: f64 = (0..3).filter(|&c| total[c] > 0.0).map(|c| m[c] / total[c] / live).sum();
                sum += EVEN / mass.len() as f64 + (1.0 - EVEN) * own;
                sum
            })
            .collect();
        let cumulative = cumulative.iter().map(|c| (c / sum) as f32).collect();
        Self { partition, radius, radii, cumulative }
    }

    /// One estimate of ∫∫ S_d near(r) T12 L_i cosθ_i dω dA for `exit`, seeded by `key`.
    pub fn estimate(&self, filler: &Filler<'_>, exit: &Exit, key: u64, tally: &mut RayTally) -> Rgb {
        let number =
            |i: u64| (hash(key.wrapping_add((i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))) >> 40) as f32 / 16_777_216.0;
        let frame = Frame::about(exit.n);
        let axes = [Vec3::Z, Vec3::X, Vec3::Y].map(|a| frame.to_world(a));
        let pick = number(0);
        let chosen = if pick < AXES[0] { 0 } else { 1 + usize::from(pick >= AXES[0] + AXES[1]) };
        let (axis, aside, other) = (axes[chosen], axes[(chosen + 1) % 3], axes[(chosen + 2) % 3]);
        let r = self.ring(number(1));
        let (sin, cos) = (TAU * number(2)).sin_cos();
        let middle = exit.x + (aside * cos + other * sin) * r;
        let half = (self.radius * self.radius - r * r).max(0.0).sqrt();
        let mut ray = Ray { origin: middle + axis * half, direction: -axis, t_min: 0.0, t_max: 2.0 * half };
        let (mut sum, mut last) = (Rgb::BLACK, None);
        for _ in 0..MOST_HITS {
            tally.bounce += 1;
            let Some(hit) = filler.rays.closest(&ray) else { break };
            // The next one may begin where this one is hit, but for rounding.
            ray.t_min = hit.t.max(ray.t_min.next_up());
            let again = last.replace((hit.mesh, hit.triangle)) == Some((hit.mesh, hit.triangle));
            if again || hit.mesh != filler.object {
                continue;
            }
            let at = filler.scene.objects[hit.mesh as usize].mesh.point(hit.triangle, hit.u, hit.v);
            let density = self.density(exit, &axes, &at);
            let numbers: [f32; 5] = std::array::from_fn(|i| number(3 + u64::from(hit.triangle) * 8 + i as u64));
            if density > 0.0
                && let Some((sample, shadow)) = filler.entering(at, 1.0 / density, numbers)
            {
                tally.shadow += 1;
                if !filler.rays.occluded(&shadow) {
                    sum += filler.model.visit(Share { near: self, model: filler.model, sample: &sample, exit });
                }
            }
        }
        sum
    }

    /// The radius [unit] with cumulative chance `u`, evenly by area within its ring.
    fn ring(&self, u: f32) -> f32 {
        let k = self.cumulative.partition_point(|&c| c <= u).min(RINGS);
        let (low, inner) = if k == 0 { (0.0, 0.0) } else { (self.cumulative[k - 1], self.radii[k - 1]) };
        let within = ((u - low) / (self.cumulative[k] - low)).clamp(0.0, 1.0);
        let (inner2, outer2) = (inner * inner, self.radii[k] * self.radii[k]);
        (inner2 + within * (outer2 - inner2)).sqrt()
    }

    /// Chance per area of a disk at `r` from its middle [1/unit²].
    fn on_disk(&self, r: f32) -> f32 {
        let k = self.radii.partition_point(|&outer| outer <= r);
        if k > RINGS {
            return 0.0;
        }
        let (low, inner) = if k == 0 { (0.0, 0.0) } else { (self.cumulative[k - 1], self.radii[k - 1]) };
        (self.cumulative[k] - low) / (PI * (self.radii[k] * self.radii[k] - inner * inner))
    }

    /// Chance per area of the surface at `at`, over all axes.
    fn density(&self, exit: &Exit, axes: &[Vec3; 3], at: &SurfacePoint) -> f32 {
        let apart = at.x - exit.x;
        let of = |(&axis, chance): (&Vec3, f32)| {
            let r = (apart - axis * apart.dot(axis)).length();
            chance * self.on_disk(r) * at.n_geometric.dot(axis).abs()
        };
        axes.iter().zip(AXES).map(of).sum()
    }
}

/// S_d near(r) times flux.
struct Share<'a> {
    near: &'a NearField,
    model: &'a Model,
    sample: &'a CachedSample,
    exit: &'a Exit,
}

impl ModelVisitor for Share<'_> {
    type Out = Rgb;
    fn visit<B: Bssrdf>(self, model: &B) -> Rgb {
        let CachedSample { entry, depth, flux } = self.sample;
        let near = self.near.partition.near(self.model.apart2(entry, *depth, self.exit));
        if near == 0.0 {
            return Rgb::BLACK;
        }
        model.eval_cached(entry, *depth, self.exit, 0.0) * *flux * near
    }
}
