//! Joining a path from the camera to photons near it.

use super::Asked;
use super::cells::Cells;
use super::draws::PathSampler;
use super::facets::Crossing;
use super::interior::Interior;
use crate::integrator::View;
use crate::math::{DVec3, Rgb, Vec3};
use crate::query::Ray;
use crate::tally::WalkTally;

/// Photons looked at from one point; of more, every second, third, ... is taken, with the weight of all.
const MOST_LOOKED_AT: u32 = 1024;

/// Room for the work at one point.
#[derive(Default)]
pub struct Scratch {
    rows: Vec<(u32, u32)>,
    found: Vec<(DVec3, Rgb)>,
    pub crossings: Vec<Crossing>,
    /// Where paths ask models for light.
    pub asked: Vec<Asked>,
}

/// The share of light over a straight flight of `length` from a collision whose phase function into that direction is
/// `phase`, that is left to the walk; the photons have the rest, `1 - walked_mis_weight`. Beyond their reach all is left to
/// the walk.
///
/// With r the length and p the phase, the walk's share is c p / (r² + c p). A connection carries p/r², which grows without
/// bound on the way to r = 0, times 1 - c p / (r² + c p): at most 1/c. c is about what the balance heuristic [VG95] would
/// take: flux of a photon over radiance of the lamps. Any shares that add up to 1 for each path are unbiased, as long as
/// they depend on the path alone.
#[inline]
pub fn walked_mis_weight(cells: &Cells, length: f32, phase: f32) -> f32 {
    if length >= cells.reach() {
        return 1.0;
    }
    let c = cells.yielding() * phase;
    c / (length * length + c)
}

/// Radiance that is scattered at `x` against the direction `w` in which the path from the camera went on, from all light
/// scattered within reach, per unit weight of the path:
///
///   Σ p(w_v) p(w_p) Φ exp(-σ_t r) V / r² · (1 - walked share)
///
/// Whether something lies between is asked for one photon for each channel, drawn by what it carries there.
pub fn connect(
    view: View<'_>,
    body: &Interior,
    cells: &Cells,
    (x, w): (DVec3, Vec3),
    scratch: &mut Scratch,
    coins: &mut PathSampler,
    tally: &mut WalkTally,
) -> Rgb {
    let Scratch { rows, found, .. } = scratch;
    let near = cells.near(x, rows);
    if near == 0 {
        return Rgb::BLACK;
    }
    let stride = near.div_ceil(MOST_LOOKED_AT);
    let mut skip = ((coins.number() * stride as f32) as u32).min(stride - 1);
    let (reach2, yielding) = (cells.reach() * cells.reach(), cells.yielding());
    let sigma_t = body.medium.sigma_t;
    let (mut sum, isotropic) = (Rgb::BLACK, body.phase.g == 0.0);
    found.clear();
    for &row in rows.iter() {
        let photons = cells.photons(row);
        let mut i = skip as usize;
        while i < photons.len() {
            let photon = &photons[i];
            i += stride as usize;
            let between = (photon.x - x).as_vec3();
            let r2 = between.length_squared();
            if r2 >= reach2 {
                continue;
            }
            let r = r2.sqrt();
            let (p_v, p_p) = if isotropic {
                (body.phase(w, w), body.phase(w, w))
            } else {
                let direction = if r > 0.0 { between / r } else { w };
                (body.phase(w, direction), body.phase(photon.w, -direction))
            };
            // A path from the camera runs against the light: it came along w, the light leaves along -w. The phase
            // function knows only the angle.
            let common = p_v * p_p / (r2 + yielding * p_v);
            let carried = Rgb::from_fn(|c| photon.flux[c] * (-sigma_t[c] * r).exp()) * common;
            sum += carried;
            found.push((photon.x, sum));
        }
        skip = (i - photons.len()) as u32;
    }
    tally.connections += found.len() as u64;
    if sum.max() <= 0.0 {
        return Rgb::BLACK;
    }
    let free = body.clearance.at(x);
    let mut last = (usize::MAX, true);
    let seen = Rgb::from_fn(|c| {
        if sum[c] <= 0.0 {
            return 0.0;
        }
        let target = coins.number() * sum[c];
        let chosen = found.partition_point(|(_, below)| below[c] <= target).min(found.len() - 1);
        if chosen != last.0 {
            let there = found[chosen].0;
            let visible = there.distance(x) < free.into() || {
                tally.rays += 1;
                !view.rays.occluded(&Ray::between(x, there))
            };
            last = (chosen, visible);
        }
        if last.1 { sum[c] } else { 0.0 }
    });
    seen * stride as f32
}
