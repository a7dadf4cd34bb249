//! All lights of a scene: which of them is asked, and how that shares with directions that meet them by chance.

use super::choice::{Choice, FEW};
use super::tree::Pick;
use super::{
    AreaLight, Arrival, CountedLight, Distant, Light, LightEnd, LightSample, Met, PointLight, Reference, Sky, Sun,
    Suns, emitted,
};
use crate::geometry::SurfacePoint;
use crate::math::{Aabb, DVec3, Rgb, Vec3};
use crate::query::{Hit, Ray};
use crate::sampling::cosine_hemisphere;
use crate::scene::{Scene, View};
use crate::tally::LIGHTS;
use std::f32::consts::PI;
use std::f64::consts::PI as PI64;

/// A lamp of this share of its area and that of a disk with its distance as radius: from there on the cosine has less noise
/// than points of the lamp. For the middle of a disk, (a² + h²)² / (3 a² h²) - 1 against h² / a², the relative variances
/// cross at h² = a²/2.
const NEAR: f32 = 2.0 / 3.0;

/// Objects that are no light.
const NONE: u32 = u32::MAX;

/// Everything that shines in a scene. Tables exist for emissive meshes only.
pub struct Lights {
    /// Those at places, then those far away.
    lights: Vec<Box<dyn Light>>,
    groups: [Asked; 3],
    /// What surfaces find by directions of their own: it is in no group.
    sky: Sky,
    /// For each object the place of its light in the list, or [`NONE`].
    of_object: Vec<u32>,
    facts: Facts,
}

/// Lights of which one is asked at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// At places: lamps.
    Near,
    /// Far away: suns.
    Far,
    /// Those far away that are not in the environment's picture.
    FarBeside,
}

struct Asked {
    lights: Vec<u32>,
    choice: Choice,
}

/// What is told of some kinds of light.
struct Facts {
    triangles: usize,
    /// Share of the picture's light that comes from elsewhere than its suns.
    of_picture: f32,
    /// The same of all that comes from far away.
    beside_suns: f32,
}

impl Lights {
    /// The lights of a scene; an emissive mesh without area or radiance is no light.
    pub fn new(scene: &Scene) -> Self {
        Self::with_few(scene, FEW)
    }

    /// The same; up to `few` lights at places are chosen by power, more by a tree.
    pub fn with_few(scene: &Scene, few: usize) -> Self {
        let (sky, lamps) = (Sky::new(&scene.environment), AreaLight::all(scene).collect::<Vec<_>>());
        let suns = Suns::new(&sky);
        let (of_picture, triangles) =
            (suns.as_ref().map_or(1.0, |suns| suns.beside), lamps.iter().map(AreaLight::triangles).sum());
        // Each kind of light has its line here.
        let mut lights: Vec<Box<dyn Light>> = Vec::with_capacity(lamps.len() + scene.lights.len() + 1);
        lights.extend(lamps.into_iter().map(|lamp| Box::new(lamp) as Box<dyn Light>));
        lights.extend(suns.map(|suns| Box::new(suns) as Box<dyn Light>));
        lights.extend(scene.lights.iter().filter_map(|source| PointLight::boxed(scene, source)));
        lights.extend(scene.lights.iter().filter_map(Sun::boxed));
        lights.extend(scene.lights.iter().filter_map(Distant::boxed));
        let facts = Facts { triangles, of_picture, beside_suns: beside_suns(&sky, of_picture, &lights) };
        lights.sort_by_key(|light| light.bounds().is_none());
        let mut of_object = vec![NONE; scene.objects.len()];
        for (i, light) in (0..).zip(&lights) {
            light.object().into_iter().for_each(|object| of_object[object as usize] = i);
        }
        let group = |wanted: &dyn Fn(&dyn Light) -> bool| {
            let of: Vec<u32> = (0..lights.len() as u32).filter(|&i| wanted(&*lights[i as usize])).collect();
            let choice = Choice::new(of.iter().map(|&i| &*lights[i as usize]), few);
            Asked { lights: of, choice }
        };
        let is_far = |light: &dyn Light| light.bounds().is_none();
        let groups = [group(&|l| !is_far(l)), group(&is_far), group(&|l| is_far(l) && !l.in_picture())];
        Self { lights, groups, sky, of_object, facts }
    }

    fn group(&self, group: Group) -> &Asked {
        &self.groups[group as usize]
    }

    /// Whether there are lights at places.
    pub fn has_emitters(&self) -> bool {
        !self.group(Group::Near).lights.is_empty()
    }

    /// Whether light arrives from the environment.
    pub fn has_environment(&self) -> bool {
        !self.sky.is_black()
    }

    /// Whether there are lights far away that paths ask for: parts of a picture of the environment that are so bright.
    pub fn has_suns(&self) -> bool {
        !self.group(Group::Far).lights.is_empty()
    }

    /// Whether a path that leaves the scene may meet light.
    pub fn shine_from_afar(&self) -> bool {
        self.has_environment() || self.group(Group::Far).lights.iter().any(|&i| !self.lights[i as usize].is_delta())
    }

    /// The groups that paths ask for where they scatter: all else they find by themselves.
    pub fn asked(&self) -> impl Iterator<Item = Group> {
        self.present([Group::Near, Group::Far])
    }

    /// The groups that a method asks for which looks around for the environment with all that is in its picture.
    pub fn asked_beside_sky(&self) -> impl Iterator<Item = Group> {
        self.present([Group::Near, Group::FarBeside])
    }

    fn present(&self, groups: [Group; 2]) -> impl Iterator<Item = Group> {
        let there = groups.map(|group| (!self.group(group).lights.is_empty()).then_some(group));
        there.into_iter().flatten()
    }

    /// The lights that are counted: all that can be asked for, several together where they are many. Others, such as an even sky, no path misses.
    pub fn counted(&self, scene: &Scene) -> Vec<CountedLight> {
        let mut counted: Vec<(CountedLight, usize)> = Vec::new();
        let near = self.group(Group::Near).lights.len();
        let far = near..self.lights.len();
        for i in far.chain(0..near) {
            let choice = &self.group(if i < near { Group::Near } else { Group::Far }).choice;
            let (number, chance) = (self.number_in_tally(i), choice.share(if i < near { i } else { i - near }));
            match counted.last_mut().filter(|(last, _)| last.number == number) {
                Some((last, more)) => (last.chance, *more) = (last.chance + chance, *more + 1),
                None => counted.push((CountedLight { number, name: self.lights[i].name(scene), chance }, 0)),
            }
        }
        let named = |(light, more): (CountedLight, usize)| match more {
            0 => light,
            _ => CountedLight { name: format!("{} and {more} more", light.name), ..light },
        };
        counted.into_iter().map(named).collect()
    }

    /// Lights far away have the first numbers, of which one is left free where there are none. Of many lamps neighbours in the file
    /// have one number.
    fn number_in_tally(&self, i: usize) -> usize {
        let near = self.group(Group::Near).lights.len();
        let far = (self.lights.len() - near).clamp(1, LIGHTS / 2);
        let left = LIGHTS - far;
        match i.checked_sub(near) {
            Some(i) => i.min(far - 1),
            None if near <= left => far + i,
            None => far + i * left / near,
        }
    }

    fn of_object(&self, object: u32) -> Option<usize> {
        self.of_object.get(object as usize).filter(|&&i| i != NONE).map(|&i| i as usize)
    }

    /// The number in the tally of the object number `object`; `None` if it is no light.
    pub fn number(&self, object: u32) -> Option<usize> {
        self.of_object(object).map(|i| self.number_in_tally(i))
    }

    /// The number in the tally of a light far away in the direction `w`, if one is there.
    pub fn number_far(&self, w: Vec3) -> Option<usize> {
        let from = Reference { x: DVec3::ZERO, n: None, reach: 0.0 };
        let far = &self.group(Group::Far).lights;
        far.iter().find(|&&i| self.lights[i as usize].pdf(&from, w) > 0.0).map(|&i| self.number_in_tally(i as usize))
    }

    /// Share of the environment's light that comes from elsewhere than suns.
    pub fn share_beside_suns(&self) -> f32 {
        self.facts.beside_suns
    }

    /// Those far away that rays meet, each with its solid angle \[sr\].
    pub fn disks<'a>(&'a self, scene: &'a Scene) -> impl Iterator<Item = (String, f64)> + 'a {
        let far = self.lights.iter().filter(|light| light.bounds().is_none() && !light.is_delta());
        far.map(|light| (light.name(scene), light.solid_angle()))
    }

    /// The names of those that no ray meets by chance.
    pub fn of_no_size<'a>(&'a self, scene: &'a Scene) -> impl Iterator<Item = String> + 'a {
        self.lights.iter().filter(|light| light.is_delta()).map(|light| light.name(scene))
    }

    /// How many of those at places have no surface.
    pub fn points(&self) -> usize {
        let near = self.group(Group::Near).lights.iter();
        near.filter(|&&i| self.lights[i as usize].object().is_none()).count()
    }

    /// Mean radiance of the lights of a group, by power; 0 without any.
    pub fn mean_radiance(&self, group: Group) -> f32 {
        let Asked { lights, choice } = self.group(group);
        let weighted = |(k, &i): (usize, &u32)| self.lights[i as usize].mean_radiance() * choice.share(k) as f32;
        lights.iter().enumerate().map(weighted).sum()
    }

    /// Triangles in the light table.
    pub fn triangles(&self) -> usize {
        self.facts.triangles
    }

    /// Number of lights at places.
    pub fn emitters(&self) -> usize {
        self.group(Group::Near).lights.len()
    }

    /// How one of them is chosen, in words.
    pub fn choice_text(&self) -> &'static str {
        if self.group(Group::Near).choice.is_by_tree() {
            "picked by a tree: by power, distance and where they shine, then by area"
        } else {
            "picked by power and area"
        }
    }

    /// Radiance from outside the scene out of the direction of the unit vector `w`; black without an environment.
    #[inline]
    pub fn environment(&self, w: Vec3) -> Rgb {
        self.sky.radiance(w) + self.beside_picture(w)
    }

    /// Radiance out of the direction `w` of lights that are in no picture.
    #[inline]
    fn beside_picture(&self, w: Vec3) -> Rgb {
        let far = &self.group(Group::FarBeside).lights;
        far.iter().fold(Rgb::BLACK, |sum, &i| sum + self.lights[i as usize].radiance(w))
    }

    /// What is said of the environment in a list of parts.
    pub fn environment_text(&self) -> String {
        let share = 100.0 * (1.0 - self.facts.of_picture);
        match self.facts.of_picture < 1.0 {
            true => {
                format!("{}; {share:.1} % of its light is from suns, which are asked for like lamps", self.sky.text())
            }
            false => self.sky.text(),
        }
    }

    /// What a ray along `w` meets, at `hit` or outside the scene.
    pub fn met(&self, scene: &Scene, hit: Option<&Hit>, w: Vec3) -> Met {
        match hit {
            Some(hit) => Met { radiance: emitted(scene, hit, w), light: self.number(hit.mesh) },
            None => Met { radiance: self.environment(w), light: self.number_far(w) },
        }
    }

    /// A point of one of a group of lights, or a direction to it, for `from`. `None` where none of them can shine.
    pub fn sample(&self, scene: &Scene, group: Group, from: &Reference, u: [f32; 3]) -> Option<LightSample> {
        let Asked { lights, choice } = self.group(group);
        let Pick { light, chance, left } = choice.pick(from, u[0], [u[1], u[2]])?;
        let i = lights[light] as usize;
        let own = self.lights[i].sample(scene, from, left, [u[1], u[2]])?;
        let own = LightSample { pdf: chance * own.pdf, light: self.number_in_tally(i), ..own };
        // Of a direction all that comes from there: what lies before one another is one light for those who meet it, too.
        match (own.end, group) {
            (LightEnd::Direction(w), Group::Far) if !own.is_delta => {
                Some(LightSample { radiance: self.environment(w), pdf: self.density_far(group, w), ..own })
            }
            (LightEnd::Direction(w), Group::FarBeside) if !own.is_delta => {
                Some(LightSample { radiance: self.beside_picture(w), pdf: self.density_far(group, w), ..own })
            }
            _ => Some(own),
        }
    }

    /// Light of one of a group on a surface; `None` where it comes from behind the surface or leaves the light at its dark side.
    pub fn arrival(&self, scene: &Scene, group: Group, at: &SurfacePoint, u: [f32; 3]) -> Option<Arrival> {
        self.sample(scene, group, &Reference::surface(at), u)?.arrival(at)
    }

    /// Light of the environment from one of the directions of [`Self::look_around`].
    pub fn sample_environment(&self, at: &SurfacePoint, u: [f32; 2]) -> Option<Arrival> {
        let sample = self.sky.towards(at.n, u);
        let arrival = sample.arrival(at)?;
        Some(Arrival { light: self.number_far(arrival.w), ..arrival })
    }

    /// One arrival from all that shines on a surface, and whether the way to it is known to be open. A share of the directions is
    /// picked by the surface and the environment, the rest by the other lights; each counts over the density of both [VG95], the balance heuristic.
    pub fn arrival_of_all(
        &self,
        view: View<'_>,
        at: &SurfacePoint,
        look_around: f32,
        u: [f32; 4],
    ) -> Option<(Arrival, bool)> {
        let groups = self.asked_beside_sky().count();
        if groups == 0 {
            return if self.has_environment() {
                Some((self.sample_environment(at, [u[1], u[2]])?, false))
            } else {
                None
            };
        }
        let each = (1.0 - look_around) / groups as f32;
        if u[3] >= look_around {
            let pick = u[0] * groups as f32;
            let number = (pick as usize).min(groups - 1);
            let group = self.asked_beside_sky().nth(number)?;
            let mut arrival = self.arrival(view.scene, group, at, [pick - number as f32, u[1], u[2]])?;
            if group == Group::FarBeside {
                // The environment behind it, which directions around find too.
                arrival.irradiance += self.sky.radiance(arrival.w) * (at.n.dot(arrival.w) / arrival.pdf_angle);
            }
            arrival.irradiance *= 1.0 / (each + look_around * self.pdf_around(at, arrival.w) / arrival.pdf_angle);
            return Some((arrival, false));
        }
        let (w, shadow) = self.look_around(at, [u[1], u[2]])?;
        let hit = view.rays.closest(&shadow);
        let by_light = match hit {
            Some(hit) => self.pdf_met(view.scene, &Reference::surface(at), &hit, w),
            None => self.density_far(Group::FarBeside, w) as f32,
        };
        let Met { radiance, light } = self.met(view.scene, hit.as_ref(), w);
        let pdf_angle = look_around * self.pdf_around(at, w) + each * by_light;
        let irradiance = radiance * (at.n.dot(w) / pdf_angle);
        Some((Arrival { w, irradiance, pdf_angle, shadow, light }, true))
    }

    /// Density of points [1/unit²] by [`Self::sample`] on the object number `object`; 0 if it is no light.
    pub fn pdf_point(&self, from: &Reference, object: u32) -> f32 {
        let near = &self.group(Group::Near).choice;
        self.of_object(object).map_or(0.0, |i| (near.chance(from, i) * self.lights[i].pdf(from, Vec3::ZERO)) as f32)
    }

    /// Density [1/sr] with which [`Self::sample`] looks from `from` along the unit vector `w` to `hit`; 0 where no light is.
    pub fn pdf_met(&self, scene: &Scene, from: &Reference, hit: &Hit, w: Vec3) -> f32 {
        let pdf = self.pdf_point(from, hit.mesh);
        if pdf == 0.0 {
            return 0.0;
        }
        let cos = scene.objects[hit.mesh as usize].mesh.geometric_normal(hit.triangle).dot(w).abs();
        hit.t * pdf * hit.t / cos
    }

    /// Density [1/sr] of `w` by [`Self::sample`] of what is far; 0 where nothing is.
    #[inline]
    pub fn pdf_far(&self, w: Vec3) -> f32 {
        self.density_far(Group::Far, w) as f32
    }

    fn density_far(&self, group: Group, w: Vec3) -> f64 {
        let Asked { lights, choice } = self.group(group);
        let from = Reference::place(DVec3::ZERO);
        let pdf = |(k, &i): (usize, &u32)| choice.share(k) * self.lights[i as usize].pdf(&from, w);
        lights.iter().enumerate().map(pdf).sum::<f64>()
    }

    /// Whether the object number `object` is a light.
    pub fn is_light(&self, object: u32) -> bool {
        self.of_object(object).is_some()
    }

    /// Density of points [1/unit²] of the object number `object` by [`Self::sample`] times the squared distance [unit²]: the least for places
    /// within `bounds`, looked for at its corners and its middle. 0 if it is no light.
    pub fn least_solid_pdf(&self, object: u32, bounds: &Aabb) -> f32 {
        let Some(i) = self.of_object(object) else { return 0.0 };
        let Some(own) = self.lights[i].bounds().map(|b| b.bounds) else { return 0.0 };
        let square = |gap: f64| gap as f32 * gap as f32;
        let middle = Reference::body(bounds);
        if !self.group(Group::Near).choice.is_by_tree() {
            return self.pdf_point(&middle, object) * square(own.distance(bounds));
        }
        let corner = |k: usize| {
            let side = |axis: usize| if k >> axis & 1 == 0 { bounds.lower[axis] } else { bounds.upper[axis] };
            DVec3::from_array(std::array::from_fn(side))
        };
        let at = |x: DVec3| {
            let from = Reference::inside(x, bounds);
            self.pdf_point(&from, object) * square(own.distance(&Aabb::around([x])))
        };
        (0..8).map(corner).chain([middle.x]).map(at).fold(f32::INFINITY, f32::min)
    }

    /// Share of directions that are better picked by the cosine for a body within `bounds`: half with an environment, none
    /// without, unless an emitter is nearer than it is wide: from there its points have densities that differ without
    /// bound.
    pub fn cosine_share(&self, bounds: Aabb) -> f32 {
        if self.has_environment() {
            return if self.asked_beside_sky().next().is_none() { 1.0 } else { 0.5 };
        }
        let seen = |&i: &u32| {
            let light = &self.lights[i as usize];
            let gap = light.bounds().map_or(f64::INFINITY, |own| own.bounds.distance(&bounds)) as f32;
            let area = light.area() as f32;
            if area > 0.0 { area / (area + PI * gap * gap) } else { 0.0 }
        };
        let largest = self.group(Group::Near).lights.iter().map(seen).fold(0.0, f32::max);
        if largest > NEAR { 0.5 * largest } else { 0.0 }
    }

    /// A cosine-weighted direction about the surface's normal and the ray that looks there.
    pub fn look_up(at: &SurfacePoint, u: [f32; 2]) -> Option<(Vec3, Ray)> {
        looking(at, cosine_hemisphere(at.n, u))
    }

    /// As [`Self::look_up`], but under a picture of the environment half of the directions are those it shines from.
    pub fn look_around(&self, at: &SurfacePoint, u: [f32; 2]) -> Option<(Vec3, Ray)> {
        looking(at, self.sky.direction(at.n, u))
    }

    /// Density [1/sr] of the direction `w` by [`Self::look_around`].
    pub fn pdf_around(&self, at: &SurfacePoint, w: Vec3) -> f32 {
        self.sky.density(at.n, w)
    }
}

/// Share of the light from far away that comes from no sun, of the picture or beside it.
fn beside_suns(sky: &Sky, of_picture: f32, lights: &[Box<dyn Light>]) -> f32 {
    let far = lights.iter().filter(|light| light.bounds().is_none() && !light.in_picture());
    let (all, beside) = (4.0 * PI64 * f64::from(sky.mean_radiance()), far.map(|light| light.power()).sum::<f64>());
    if beside > 0.0 { (f64::from(of_picture) * all / (all + beside)) as f32 } else { of_picture }
}

fn looking(at: &SurfacePoint, w: Vec3) -> Option<(Vec3, Ray)> {
    (at.n.dot(w) > 0.0 && at.n_geometric.dot(w) > 0.0).then(|| (w, Ray::new(at.leave(w), w)))
}
