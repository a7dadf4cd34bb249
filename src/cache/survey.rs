//! What is known before the first pass: where light enters that the camera gets to see, from a trial cache and a grid of camera rays.

use super::{CacheBuilder, CachedSample, Density, Envelope};
use crate::math::{DVec3, Vec3, Vec4};
use crate::scene::{Spread, View};

/// Trial samples for each bin of equal area along the area table.
const PILOTS_PER_BIN: u32 = 32;
/// Bins, at most.
const BINS: u32 = 256;
/// Trial samples are at most one for so many of a pass.
const PASS_PER_PILOT: u32 = 4;
/// Cells of the picture, across and down, through whose middles the camera looks for visible points; no more than pixels.
const CELLS: u32 = 64;
/// Visible points of an object that importance is measured at, at most.
const EXITS: usize = 384;
/// A kernel is widened until its decay length is this many times the distance between visible points: a narrower one would
/// fall between them.
const WIDEST: f32 = 2.0;

/// A point that the camera sees, for the part of the picture around it.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Where [unit].
    pub x: DVec3,
    /// Mean squared distance between it and the surface points that it stands for \[unit²\].
    pub spread2: f32,
}

/// What a trial cache tells of an object in the camera's view. Its samples are not used again.
pub struct Survey {
    /// Of all densities the one with the least mean squared relative error at the visible points, if samples were
    /// independent, mixed with an even one: the root of the mean squared share that light entering there has.
    pub density: Density,
    /// Mean over the visible points of the sum over the samples, per sample [S_d flux, up to a factor]; the fourth is 0.
    pub typical: Vec4,
    /// Relative variance of one sample of the density, mean over visible points and channels.
    pub variance: f64,
}

impl Survey {
    /// Without any knowledge; every sample as good as the next.
    pub fn none() -> Self {
        Self { density: Density::even(), typical: Vec4::ZERO, variance: 0.0 }
    }

    /// Of the light that `builder` finds, as it reaches the points `seen`, for passes of `count` samples. [`Self::none`] where
    /// there are none or all is dark.
    pub fn new(builder: &CacheBuilder<'_>, envelope: &Envelope, seen: &[Seen], spread: Spread, count: u32) -> Self {
        let bins = (count / PASS_PER_PILOT / PILOTS_PER_BIN).clamp(8, BINS);
        let attempted = bins * PILOTS_PER_BIN;
        let pilots = builder.pilots(attempted);
        let local = |s: &Seen| ((s.x - builder.body.table().centre()).as_vec3(), s.spread2);
        let seen: Vec<(Vec3, f32)> = seen.iter().map(local).collect();
        let sums: Vec<Vec4> = seen.iter().map(|s| pilots.iter().map(|(_, p)| share(envelope, s, p)).sum()).collect();
        let mean = sums.iter().sum::<Vec4>() / sums.len().max(1) as f32;
        // As errors are measured: relative, but dark points count less.
        let scale: Vec<Vec4> = sums.iter().map(|&sum| inverse(sum * sum + 0.01 * mean * mean)).collect();
        let mut bins = vec![0.0_f64; bins as usize];
        for (pick, pilot) in &pilots {
            let squares: Vec4 = seen
                .iter()
                .zip(&scale)
                .map(|(s, &scale)| {
                    let share = share(envelope, s, pilot);
                    share * share * scale
                })
                .sum();
            let bin = ((pick * bins.len() as f64) as usize).min(bins.len() - 1);
            bins[bin] += f64::from(squares.element_sum());
        }
        let density = match spread {
            Spread::Seen => Density::of(&bins.iter().map(|b| b.sqrt()).collect::<Vec<_>>()),
            Spread::Area => Density::even(),
        };
        let counted = 3.0 * seen.len().max(1) as f64;
        let squares: f64 = bins.iter().enumerate().map(|(b, sum)| sum * density.weight(b, bins.len())).sum();
        let variance = f64::from(attempted) * squares / counted;
        if !variance.is_finite() {
            return Self::none();
        }
        Self { density, typical: mean / attempted as f32, variance }
    }

    /// Relative variance of the sum over the first `count` samples of a Sobol stream. That of independent ones is
    /// variance / count; scrambled Sobol points on a surface gain another 0.09 count / variance where there are enough
    /// to resolve the kernel, as measured on five cases of media and counts.
    pub fn noise2(&self, count: f64) -> f64 {
        let independent = self.variance / count;
        independent / (0.09 / independent).max(1.0)
    }
}

/// What a sample gives to a visible point, up to a common factor.
#[inline]
fn share(envelope: &Envelope, &(x, spread2): &(Vec3, f32), sample: &CachedSample) -> Vec4 {
    let r2 = sample.entry.x.distance_squared(x) + spread2;
    let [r, g, b] = sample.flux.0;
    envelope.widened(r2, WIDEST * spread2.sqrt()) * Vec4::new(r, g, b, 0.0)
}

/// 1/v, or 0 where that is not finite.
fn inverse(v: Vec4) -> Vec4 {
    Vec4::from_array(v.to_array().map(|v| if v > f32::MIN_POSITIVE { 1.0 / v } else { 0.0 }))
}

/// For each object, points that the camera sees of it. A function of the scene alone.
pub fn seen(view: View<'_>) -> Vec<Vec<Seen>> {
    let View { scene, rays } = view;
    let camera = &scene.camera;
    let [columns, rows] = camera.resolution.map(|r| r.min(CELLS));
    let [width, height] = [(0, columns), (1, rows)].map(|(a, cells)| camera.resolution[a] as f32 / cells as f32);
    // Rays of one cell through one place of the lens.
    let through = |cell: u32, x: f32, y: f32| {
        let (i, j) = (x * width, y * height);
        camera.grid_ray([i as u32, j as u32], [i.fract(), j.fract()], cell)
    };
    let mut seen = vec![Vec::new(); scene.objects.len()];
    for cell in 0..columns * rows {
        let (x, y) = ((cell % columns) as f32 + 0.5, (cell / columns) as f32 + 0.5);
        let ray = through(cell, x, y);
        let Some(hit) = rays.closest(&ray) else { continue };
        let at = view.outwards(&hit);
        let beside = [through(cell, x + 0.5, y), through(cell, x, y + 0.5)];
        // The cell's size at distance 1, or that of parallel rays anywhere.
        let ([right, down], distance2) = if camera.is_orthographic() {
            (beside.map(|r| 2.0 * (r.origin - ray.origin).as_vec3()), 1.0)
        } else {
            (beside.map(|r| 2.0 * (r.direction - ray.direction)), at.x.distance_squared(ray.origin) as f32)
        };
        let cos = at.n_geometric.dot(ray.direction).abs().max(0.05);
        let area = right.cross(down).length() * distance2 / cos;
        seen[hit.mesh as usize].push(Seen { x: at.x, spread2: area / std::f32::consts::TAU });
    }
    for points in &mut seen {
        // Fewer of them, each for more.
        let step = points.len().div_ceil(EXITS).max(1);
        *points = points.iter().step_by(step).map(|s| Seen { spread2: s.spread2 * step as f32, ..*s }).collect();
    }
    seen
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a scene of a test that does not load has failed
mod tests {
    use super::*;
    use crate::query::{self, Backend};
    use crate::scene::{Scene, SceneFile};
    use std::path::Path;

    fn points(keys: &str) -> Vec<Seen> {
        let text = format!(
            "unit = \"mm\"\n[camera]\nlook_at = [0, 0, 0]\nresolution = [32, 32]\n{keys}\n[[object]]\nshape = \"sphere\"\n\
             centre = [0, 0, 0]\nradius = 1\nmaterial = \"wax\"\n[material.wax]\ntype = \"translucent\"\npreset = \"marble\"\n"
        );
        let scene = Scene::load(&SceneFile::parse(&text, Path::new("x.toml")).unwrap()).unwrap();
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        seen(View { scene: &scene, rays: &*rays }).remove(0)
    }

    /// A view of 4 units from far away is nearly that of parallel rays, and so is one through a small lens that far off.
    #[test]
    fn parallel_rays_and_lenses_see_as_much_as_a_pinhole() {
        let pinhole = points("position = [0, 0, 1000]\nfov = 0.2291828");
        let sum = |points: &[Seen]| points.iter().map(|p| f64::from(p.spread2)).sum::<f64>();
        assert!(pinhole.len() > 150);
        for keys in [
            "position = [0, 0, 9]\nprojection = \"orthographic\"\nheight = 4",
            "position = [0, 0, 9]\nprojection = \"orthographic\"\nheight = 4\naperture = 0.01",
            "position = [0, 0, 1000]\nfov = 0.2291828\naperture = 1",
        ] {
            let other = points(keys);
            assert!(other.len().abs_diff(pinhole.len()) <= 4, "{keys}: {} of {}", other.len(), pinhole.len());
            assert!((sum(&other) / sum(&pinhole) - 1.0).abs() < 0.05, "{keys}: {} {}", sum(&other), sum(&pinhole));
        }
    }
}
