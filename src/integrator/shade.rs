//! Light from the lights on a Lambertian surface, shared by `direct` and `subsurface`.

use super::{Part, View};
use crate::geometry::SurfacePoint;
use crate::light::Lights;
use crate::math::Rgb;
use crate::sampling::PixelStream;
use crate::scene::Scene;
use crate::tally::Tally;
use crate::words::counted;
use std::f32::consts::FRAC_1_PI;

/// Direct light on diffuse surfaces.
pub struct DirectLight {
    /// The scene's lights.
    pub lights: Lights,
    /// Samples of each kind of light per shaded point, at least 1.
    pub samples: u32,
}

impl DirectLight {
    /// Radiance that a Lambertian surface reflects: albedo/π times irradiance. `at` faces the viewer.
    pub fn reflected(
        &self,
        view: View<'_>,
        at: &SurfacePoint,
        albedo: Rgb,
        stream: &mut PixelStream,
        tally: &mut Tally,
    ) -> Rgb {
        if albedo.is_black() {
            return Rgb::BLACK;
        }
        let mut irradiance = Rgb::BLACK;
        let mut add = |arrival: crate::light::Arrival| {
            tally.rays.shadow += 1;
            let open = !view.rays.occluded(&arrival.shadow);
            if let Some(light) = arrival.light {
                tally.rays.lights.ask(light, open);
            }
            if open {
                irradiance += arrival.irradiance;
            }
        };
        for part in 0..self.samples {
            let mut numbers = stream.split(part, self.samples);
            for group in self.lights.asked_beside_sky() {
                let [u, v] = numbers.next_2d();
                if let Some(arrival) = self.lights.arrival(view.scene, group, at, [numbers.next_1d(), u, v]) {
                    add(arrival);
                }
            }
            if self.lights.has_environment()
                && let Some(arrival) = self.lights.sample_environment(at, numbers.next_2d())
            {
                add(arrival);
            }
        }
        stream.skip_split();
        albedo * irradiance * (FRAC_1_PI / self.samples as f32)
    }

    /// What there is of lights in this scene.
    pub fn parts(&self, scene: &Scene) -> Vec<Part> {
        let (triangles, lamps) = (self.lights.triangles(), self.lights.emitters());
        let points = self.lights.points();
        let table = if self.lights.has_emitters() {
            let of = |n, one, many| (n > 0).then(|| counted(n, one, many));
            let meshes = of(lamps - points, "mesh", "meshes")
                .map(|n| format!("{} of {n}", counted(triangles, "emitting triangle", "emitting triangles")));
            let all: Vec<String> = meshes.into_iter().chain(of(points, "point", "points")).collect();
            Part::built("light table", format!("{}, {}", all.join(" and "), self.lights.choice_text()))
        } else {
            Part::left_out("light table", "no emissive surface with area, no point")
        };
        let environment = if self.lights.has_environment() {
            Part::built("environment", self.lights.environment_text())
        } else {
            Part::left_out("environment", "black")
        };
        let far: Vec<String> =
            scene.lights.iter().filter(|l| l.kind.position().is_none()).map(|l| l.name.clone()).collect();
        let far = (!far.is_empty())
            .then(|| Part::built("lights far away", format!("{}, asked for by direction", far.join(", "))));
        let no_size: Vec<String> = self.lights.of_no_size(scene).collect();
        let mirrored = (!no_size.is_empty()
            && scene.materials.iter().any(|m| !m.surface.is_lambertian() && !m.surface.shines()))
        .then(|| {
            let name = format!("mirror images of {}", no_size.join(", "));
            Part::left_out(
                name,
                "no size, so no path over a smooth surface meets it; a sun or an emissive sphere has them",
            )
        });
        [table, environment].into_iter().chain(far).chain(mirrored).collect()
    }
}
