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
    pub fn parts(&self, _: &Scene) -> Vec<Part> {
        let table = if self.lights.has_emitters() {
            let (n, t) = (self.lights.emitters(), self.lights.triangles());
            Part::built("light table", {
                let (t, n) = (counted(t, "emitting triangle", "emitting triangles"), counted(n, "mesh", "meshes"));
                format!("{t} of {n}, {}", self.lights.choice_text())
            })
        } else {
            Part::left_out("light table", "no emissive surface with area")
        };
        let environment = if self.lights.has_environment() {
            Part::built("environment", self.lights.environment_text())
        } else {
            Part::left_out("environment", "black")
        };
        vec![table, environment]
    }
}
