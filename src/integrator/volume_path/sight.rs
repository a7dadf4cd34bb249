//! Lights that a path asks for over straight lines, and what it leaves of them to chance when it meets them later: never both.
//!
//! A path keeps where it asked last; a boundary that does not refract changes nothing about that, and adds to the way since ([`CameraPath::sight`],
//! [`CameraPath::flown`]). Bodies that ask so have no photons: all light that a path finds in them is its own.

use super::camera::CameraPath;
use super::draws::PathSampler;
use super::interior::Interior;
use super::nesting::Stack;
use super::through::{mis_weight_by_chance, sun_mis_weight_by_chance};
use crate::geometry::SurfacePoint;
use crate::light::{Arrival, Reference};
use crate::math::{DVec3, Rgb, Vec3};
use crate::query::Hit;
use crate::surface::Bsdf;

/// Optical depth around a collision from which lights are asked for by chance.
const SURE: f32 = 1.0;

impl CameraPath<'_> {
    /// The path goes on from here in a new direction, with this [`Self::sight`].
    pub fn turn(&mut self, sight: Option<(f32, Reference)>) {
        (self.sight, self.left, self.flown) = (sight, None, 0.0);
    }

    /// Adds what a surface in the bodies `around` sends to `wo`, straight from lamps and suns, but for what paths that meet them have of it.
    /// `weight` is the path's.
    pub fn ask_on(
        &mut self,
        (at, wo, bsdf): (&SurfacePoint, Vec3, &dyn Bsdf),
        around: &Stack,
        weight: Rgb,
        numbers: fn(&mut Self) -> &mut PathSampler,
    ) {
        let lights = &self.method.light.lights;
        for group in lights.asked().filter(|_| !bsdf.is_delta()) {
            let draws = numbers(self);
            let u = [draws.number(), draws.number(), draws.number()];
            if let Some(arrival) = lights.arrival(self.view.scene, group, at, u) {
                let share = arrival.mis_weight_beside(bsdf.pdf(at, wo, arrival.w));
                let light = bsdf.eval(at, wo, arrival.w) * arrival.irradiance * (share * self.other);
                let passed = self.passed(&arrival, around);
                self.add(weight * light * passed);
            }
        }
    }

    /// Light that is scattered at `x`, in the matched body `body` with these `around`, against the direction `w` in which the path came,
    /// straight from lamps and suns, but for what paths that meet them have of it; per unit weight of the path.
    pub fn asked_in(&mut self, body: &Interior, around: &Stack, (x, w): (DVec3, Vec3)) -> Rgb {
        let (lights, mut sum) = (&self.method.light.lights, Rgb::BLACK);
        // No light comes here over less than this.
        let depth = body.extinction().min() * body.clearance.at(x).max(0.0);
        let chance = (SURE - depth).exp().min(1.0);
        if chance < 1.0 && self.coins.number() >= chance {
            return sum;
        }
        for group in lights.asked() {
            let u = [self.coins.number(), self.coins.number(), self.coins.number()];
            let drawn = lights.sample(self.view.scene, group, &Reference::place(x), u);
            if let Some(arrival) = drawn.and_then(|drawn| drawn.arrival_in_medium(x)) {
                let phase = body.phase(w, arrival.w);
                let share = arrival.mis_weight_beside(phase);
                sum += arrival.irradiance * self.passed(&arrival, around) * (phase * share / chance);
            }
        }
        sum
    }

    /// The share of light that arrives.
    fn passed(&mut self, arrival: &Arrival, around: &Stack) -> Rgb {
        let lines = self.method.lines(self.view);
        let passed = lines.passed(&arrival.shadow, around, &mut self.tally.rays.shadow);
        if let Some(light) = arrival.light {
            self.tally.rays.lights.ask(light, !passed.is_black());
        }
        passed
    }

    /// The share of a sun's light that a path meets by chance where suns, drawn with density `by_table` there, were asked
    /// for before.
    pub fn mis_weight_of_sun(&self, by_table: f32) -> f32 {
        match (self.sight, &self.left) {
            (Some((pdf, _)), _) => pdf / (pdf + by_table),
            (None, Some((body, Some(straight)))) => {
                sun_mis_weight_by_chance((body, self.method.through(body)), straight, by_table)
            }
            (None, Some((body, None))) if self.leaves_specks_out(body) => {
                let alone = self.method.through(body).is_some_and(|t| t.sun_alone(by_table));
                if alone { 0.0 } else { 1.0 }
            }
            _ => 1.0,
        }
    }

    /// Whether small lights are left out that are met by chance alone, and seldom, after light scattered once was reflected inside a
    /// body: white specks, where the first order stands beside a model.
    fn leaves_specks_out(&self, body: &Interior) -> bool {
        self.order > 0 && (self.method.once || self.method.modelled[body.object as usize].is_some())
    }

    /// The share of a lamp's light that a path meets by chance where the lamp was asked for at the collision or the Lambertian
    /// surface before.
    pub fn mis_weight(&self, hit: &Hit, direction: Vec3) -> f32 {
        let hit = &Hit { t: hit.t + self.flown, ..*hit };
        if let Some((pdf, from)) = &self.sight {
            return pdf / (pdf + self.method.light.lights.pdf_met(self.view.scene, from, hit, direction));
        }
        let Some((body, straight)) = &self.left else { return 1.0 };
        let Some(straight) = straight else {
            let alone = || self.method.through(body).is_some_and(|t| t.alone(hit.mesh));
            return if self.leaves_specks_out(body) && alone() { 0.0 } else { 1.0 };
        };
        let lit = (*body, self.method.through(body));
        mis_weight_by_chance(self.view.scene, &self.method.light.lights, lit, straight, hit, direction)
    }
}
