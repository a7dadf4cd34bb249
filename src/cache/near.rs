//! Light that enters close to an exit, sampled anew for each exit: for media whose light does not come as far as the next
//! sample of a cache.

use super::{CachedSample, Envelope, Filler, GatherTally};
use crate::bssrdf::{Bssrdf, Exit, Model, ModelVisitor, Partition};
use crate::geometry::SurfacePoint;
use crate::math::{Frame, Rgb, Vec3, hash, unit_f32};
use crate::query::{Ray, RayTally};
use std::f32::consts::{PI, TAU};

/// Rings of the radial density, but for the innermost disk.
const RINGS: usize = 80;
/// Radius of the innermost disk, relative to the outermost.
const INNERMOST: f32 = 1e-6;
/// Share of the samples that is spread evenly over the rings, lest a model differ from the envelope.
const EVEN: f64 = 0.1;
/// Lines parallel to the normal.
const LINES: u32 = 8;
/// Number of lines parallel to each axis on average, the normal first: on a plane that alone finds all, steep walls need the
/// others.
const AXES: [f32; 3] = [LINES as f32, 0.5, 0.5];
/// Steps between the numbers of one line and the next: powers of the root of x^6 = x + 1, a generalised golden ratio
/// [Roberts 2018].
const STEPS: [f32; 5] = [0.881_271_5, 0.776_639_4, 0.684_430_7, 0.603_168_7, 0.531_555_4];
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

    /// One estimate of ∫∫ S_d near(r) T12 L_i cosθ_i dω dA for `exit`, seeded by `key`: all surfaces found along some lines
    /// parallel to the normal, and along one parallel to a tangent, each over the density of them all.
    pub fn estimate(
        &self,
        filler: &Filler<'_>,
        exit: &Exit,
        key: u64,
        (rays, gather): (&mut RayTally, &mut GatherTally),
    ) -> Rgb {
        let frame = Frame::about(exit.n);
        let axes = [Vec3::Z, Vec3::X, Vec3::Y].map(|a| frame.to_world(a));
        let [turn, shift, across] = [0, 1, 2].map(|i| Numbers(key).at(i));
        let mut sum = Rgb::BLACK;
        for line in 0..LINES {
            // Radii in equal shares of the light, directions a golden angle apart.
            let radius = (line as f32 + Numbers(key).at(3 + u64::from(line))) / LINES as f32;
            let angle = (turn + line as f32 * 0.618_034).fract();
            sum += self.probe(filler, exit, (&axes, 0), [radius, angle], (key, line), (rays, gather));
        }
        let tangent = 1 + usize::from(across >= 0.5);
        sum + self.probe(filler, exit, (&axes, tangent), [shift, turn], (!key, 0), (rays, gather))
    }

    /// What is found along a line parallel to one of the axes.
    fn probe(
        &self,
        filler: &Filler<'_>,
        exit: &Exit,
        (axes, chosen): (&[Vec3; 3], usize),
        [radius, angle]: [f32; 2],
        (key, line): (u64, u32),
        (rays, gather): (&mut RayTally, &mut GatherTally),
    ) -> Rgb {
        let (axis, aside, other) = (axes[chosen], axes[(chosen + 1) % 3], axes[(chosen + 2) % 3]);
        let r = self.ring(radius);
        let (sin, cos) = (TAU * angle).sin_cos();
        let middle = exit.x + (aside * cos + other * sin) * r;
        let half = (self.radius * self.radius - r * r).max(0.0).sqrt();
        let mut ray = Ray { origin: middle + axis * half, direction: -axis, t_min: 0.0, t_max: 2.0 * half };
        let (mut sum, mut last, mut found) = (Rgb::BLACK, None, 0);
        for _ in 0..MOST_HITS {
            rays.bounce += 1;
            let Some(hit) = filler.rays.closest(&ray) else { break };
            // The next one may begin where this one is hit, but for rounding.
            ray.t_min = hit.t.max(ray.t_min.next_up());
            let again = last.replace((hit.mesh, hit.triangle)) == Some((hit.mesh, hit.triangle));
            if again || hit.mesh != filler.object {
                continue;
            }
            let at = filler.scene.objects[hit.mesh as usize].mesh.point(hit.triangle, hit.u, hit.v);
            let density = self.density(exit, axes, &at);
            // Lines spread over the lights together, as they do over the surface.
            let u =
                std::array::from_fn(|i| (Numbers(key).at(16 + found * 8 + i as u64) + line as f32 * STEPS[i]).fract());
            found += 1;
            if density > 0.0
                && let Some((sample, shadow)) = filler.entering(at, 1.0 / density, u, rays)
            {
                rays.shadow += u64::from(shadow.is_some());
                if !shadow.is_some_and(|ray| filler.rays.occluded(&ray)) {
                    sum += filler.model.visit(Share { near: self, model: filler.model, sample: &sample, exit, gather });
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

/// Uniform numbers in [0, 1) by number.
struct Numbers(u64);

impl Numbers {
    fn at(&self, i: u64) -> f32 {
        unit_f32((hash(self.0.wrapping_add((i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))) >> 32) as u32)
    }
}

/// S_d near(r) times flux.
struct Share<'a> {
    near: &'a NearField,
    model: &'a Model,
    sample: &'a CachedSample,
    exit: &'a Exit,
    gather: &'a mut GatherTally,
}

impl ModelVisitor for Share<'_> {
    type Out = Rgb;
    fn visit<B: Bssrdf>(self, model: &B) -> Rgb {
        let CachedSample { entry, depth, flux } = self.sample;
        let near = self.near.partition.near(self.model.apart2(entry, *depth, self.exit));
        if near == 0.0 {
            return Rgb::BLACK;
        }
        let s = model.eval_cached(entry, *depth, self.exit, 0.0);
        self.gather.near += 1;
        self.gather.clamped += (0..3).filter(|&c| model.clamps() && s[c] == 0.0 && flux[c] > 0.0).count() as u64;
        s * *flux * near
    }
}
