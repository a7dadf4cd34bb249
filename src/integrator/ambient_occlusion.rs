//! The share of the cosine-weighted hemisphere that is open.

use super::{CameraRay, Integrator, Part, View, camera_hits};
use crate::math::{Rgb, frame};
use crate::query::Ray;
use crate::sampling::Pairs;
use crate::scene::Scene;
use crate::tally::Tally;

/// Occlusion rays that go to the backend together, unless one camera ray has more: some MB a thread.
const MOST_PROBES: usize = 1 << 16;

/// (1/π) ∫ V(ω) cosθ dω over the hemisphere on the camera's side; grey, in [0, 1]; 1 where nothing is hit.
pub struct AmbientOcclusion {
    /// Surfaces farther than this do not occlude [unit]; infinite for none.
    pub radius: f32,
    /// Occlusion rays per camera ray, at least 1.
    pub rays: u32,
}

impl Integrator for AmbientOcclusion {
    type Pass = ();

    fn begin_pass(&self, _: View<'_>, _: u32, _: &mut Tally) {}

    fn radiance(&self, view: View<'_>, (): &(), rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        let hits = camera_hits(view, rays, tally);

        let per_hit = self.rays as usize;
        let together = (MOST_PROBES / per_hit).max(1);
        for ((rays, hits), out) in rays.chunks(together).zip(hits.chunks(together)).zip(out.chunks_mut(together)) {
            let mut pairs = Pairs::with_capacity(rays.len() * per_hit);
            let mut points = Vec::with_capacity(rays.len());
            for (ray, hit) in rays.iter().zip(hits) {
                let Some(hit) = hit else { continue };
                points.push(view.point(hit, ray.ray.direction));
                pairs.push_splits(&ray.stream, self.rays);
            }
            let mut probes = Vec::with_capacity(points.len() * per_hit);
            for (at, local) in points.iter().zip(pairs.cosine_hemisphere().chunks_exact(per_hit)) {
                let frame = frame(at.n);
                probes.extend(local.iter().map(|&w| {
                    let w = frame * w;
                    Ray { t_max: self.radius, ..Ray::new(at.leave(w), w) }
                }));
            }
            let mut occluded = vec![false; probes.len()];
            view.rays.occluded_batch(&probes, &mut occluded);
            tally.rays.shadow += probes.len() as u64;
            // Below the triangle, where only an interpolated normal looks up to, nothing is open.
            let each = points.iter().zip(probes.chunks_exact(per_hit)).zip(occluded.chunks_exact_mut(per_hit));
            for ((at, probes), occluded) in each {
                let below = |probe: &Ray| at.n_geometric.dot(probe.direction) <= 0.0;
                probes.iter().zip(occluded).for_each(|(probe, occluded)| *occluded |= below(probe));
            }

            let mut groups = occluded.chunks_exact(per_hit);
            for (hit, out) in hits.iter().zip(out) {
                *out = match hit.and_then(|_| groups.next()) {
                    Some(group) => Rgb::splat(group.iter().filter(|&&hidden| !hidden).count() as f32 / per_hit as f32),
                    None => Rgb::WHITE,
                };
            }
        }
    }

    fn parts(&self, _: &Scene) -> Vec<Part> {
        vec![
            Part::built("any-hit rays", format!("{} per camera ray", self.rays)),
            Part::left_out("light table", "ambient occlusion asks no light"),
            Part::left_out("area tables and sample cache", "ambient occlusion has no scattering"),
        ]
    }
}
