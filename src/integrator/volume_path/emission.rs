//! Where light of lamps and suns enters a body, and how much of it.

use super::interior::Interior;
use crate::geometry::{AreaTable, SurfacePoint};
use crate::integrator::View;
use crate::light::{Arrival, Group, LightEnd, Lights, Reference, Shines, emitted};
use crate::math::{Rgb, Vec3};
use crate::optics::transmittance;
use crate::query::Ray;
use crate::sampling::cosine_hemisphere;
use crate::tally::Tally;
use std::f32::consts::PI;

/// Light at a point of a body's surface.
pub struct Entering {
    /// The point, flat as its triangle.
    pub at: SurfacePoint,
    /// Unit direction towards the light.
    pub w: Vec3,
    /// Flux that enters, over the density of point and direction [radiance unit x sr x unit²].
    pub flux: Rgb,
    /// The number of the light, where it is one that is counted.
    pub light: Option<usize>,
    /// It arrives if nothing is hit on this ray; `None` where that is known.
    pub shadow: Option<Ray>,
    /// Share of each of the [`EmissionSampler::ways`] in its density; zeros under a sun.
    pub by: [f32; 3],
}

/// How pairs of a point of the body and a point of a light are drawn.
#[derive(Clone, Copy, Debug)]
pub struct EmissionSampler {
    /// The body as a whole, for which lamps are chosen before there is a point of it.
    pub around: Reference,
    /// Share of the pairs whose light is a sun.
    pub from_suns: f32,
    /// Shares of the three ways to draw a point of a lamp and one of the body: both by area; the body's by area, and the lamp
    /// by a direction with the cosine about the normal there; the lamp's by area, and the body by the cosine about the normal
    /// of the lamp. Together by the balance heuristic [VG95]. The first alone has no bound where a lamp is near; by the others a
    /// pair carries no more than π times radiance times the area of the body, or of the lamp, over their share.
    pub ways: [f32; 3],
}

impl EmissionSampler {
    /// One pair, before it is known whether anything stands between; `None` where no light comes that way.
    pub fn sample(
        &self,
        view: View<'_>,
        (body, table): (&Interior, &AreaTable),
        lights: &Lights,
        numbers: (f64, &[f32; 7]),
        tally: &mut Tally,
    ) -> Option<Entering> {
        let entering = self.untinted(view, (body, table), lights, numbers, tally)?;
        let flux = entering.flux * body.tint(&entering.at);
        (!flux.is_black()).then_some(Entering { flux, ..entering })
    }

    /// The same without the pigment of the boundary.
    fn untinted(
        &self,
        view: View<'_>,
        (body, table): (&Interior, &AreaTable),
        lights: &Lights,
        (pick, u): (f64, &[f32; 7]),
        tally: &mut Tally,
    ) -> Option<Entering> {
        let mesh = &view.scene.objects[body.object as usize].mesh;
        let flat = |triangle, u, v| {
            let at = mesh.point(triangle, u, v);
            SurfacePoint { n: at.n_geometric, ..at }
        };
        let on_body = || {
            let at = table.sample(pick, [u[0], u[1]]);
            flat(at.triangle, at.u, at.v)
        };
        let area = table.area() as f32;
        let passed = |at: &SurfacePoint, w: Vec3| transmittance(body.eta, w.dot(at.n)) * area;
        // The number that picks what is far or near, spread out again, picks one of them.
        if u[2] < self.from_suns {
            let at = on_body();
            let sun = lights.arrival(view.scene, Group::Far, &at, [u[2] / self.from_suns, u[3], u[4]])?;
            let flux = sun.irradiance * (passed(&at, sun.w) / self.from_suns);
            return Some(Entering { at, w: sun.w, flux, light: sun.light, shadow: Some(sun.shadow), by: [0.0; 3] });
        }
        let lamps = 1.0 - self.from_suns;
        let pick_way = (u[2] - self.from_suns) / lamps;
        // Densities of the three ways over that of the second, without their shares. `pdf_angle` by the first way.
        let together = |at: &SurfacePoint, w: Vec3, pdf_angle: f32, lamp: u32| {
            let two_sided = view.scene.surface(lamp).emission.is_some_and(|e| e.two_sided);
            let by_lamp = area * lights.pdf_point(&self.around, lamp) * if two_sided { 0.5 } else { 1.0 };
            let ways = [PI * pdf_angle / at.n.dot(w), 1.0, by_lamp];
            let by: [f32; 3] = std::array::from_fn(|i| self.ways[i] * ways[i]);
            let density = by.iter().sum::<f32>();
            (by.map(|d| d / density), PI / density / lamps)
        };
        if pick_way < self.ways[0] {
            let at = on_body();
            let numbers = [pick_way / self.ways[0], u[3], u[4]];
            let drawn = lights.sample(view.scene, Group::Near, &Reference::surface(&at), numbers)?;
            let Arrival { w, irradiance, pdf_angle, shadow, light } = drawn.arrival(&at)?;
            let (by, flux) = match drawn.object {
                Some(lamp) => {
                    let (by, weight) = together(&at, w, pdf_angle, lamp);
                    (by, drawn.radiance * (weight * passed(&at, w)))
                }
                // What no ray meets is found in no other way.
                None => ([1.0, 0.0, 0.0], irradiance * (passed(&at, w) / (self.ways[0] * lamps))),
            };
            Some(Entering { at, w, flux, light, shadow: Some(shadow), by })
        } else if pick_way < self.ways[0] + self.ways[1] {
            let at = on_body();
            let (w, ray) = Lights::look_up(&at, [u[3], u[4]])?;
            tally.rays.bounce += 1;
            let hit = view.rays.closest(&ray)?;
            let radiance = emitted(view.scene, &hit, w);
            if radiance.is_black() {
                return None;
            }
            let pdf_angle = lights.pdf_met(view.scene, &Reference::surface(&at), &hit, w);
            let (by, weight) = together(&at, w, pdf_angle, hit.mesh);
            let flux = radiance * (weight * passed(&at, w));
            Some(Entering { at, w, flux, light: lights.number(hit.mesh), shadow: None, by })
        } else {
            let drawn = lights.sample(view.scene, Group::Near, &self.around, [pick as f32, u[0], u[1]])?;
            let (LightEnd::Point { at: lamp, shines }, Some(object)) = (drawn.end, drawn.object) else {
                return None;
            };
            let side = (pick_way - self.ways[0] - self.ways[1]) / self.ways[2];
            let n = if shines == Shines::BothSides && side >= 0.5 { -lamp.n_geometric } else { lamp.n_geometric };
            let out = cosine_hemisphere(n, [u[3], u[4]]);
            tally.rays.bounce += 1;
            let hit = view.rays.closest(&Ray::new(lamp.leave(out), out)).filter(|hit| hit.mesh == body.object)?;
            let (at, w) = (flat(hit.triangle, hit.u, hit.v), -out);
            if at.n.dot(w) <= 0.0 {
                return None;
            }
            let pdf = lights.pdf_point(&Reference::surface(&at), object);
            let (by, weight) = together(&at, w, hit.t * pdf * hit.t / n.dot(out), object);
            let flux = drawn.radiance * (weight * passed(&at, w));
            Some(Entering { at, w, flux, light: Some(drawn.light), shadow: None, by })
        }
    }
}
