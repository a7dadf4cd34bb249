//! A path from the camera through the whole scene.

use super::VolumePath;
use super::cells::Cells;
use super::connect::{Scratch, connect, walked_mis_weight};
use super::draws::PathSampler;
use super::interior::{Edge, Interior, MOST_SURFACES, Straight, Turn, WalkObserver, russian_roulette};
use super::nesting::{self, Entry, Guide, Meets, Stack};
use super::spectrum::Spectrum;
use super::through::drawn_light;
use crate::geometry::SurfacePoint;
use crate::integrator::View;
use crate::light::{Reference, emitted};
use crate::math::{DVec3, Rgb, Vec3};
use crate::query::{Hit, Ray};
use crate::sampling::PixelStream;
use crate::scene::{Orders, Surface};
use crate::surface::{Bsdf, Colour, RoughBoundary};
use crate::tally::{Cause, Tally, WalkTally};

/// A path that a surface with a mirror has left this weight goes on for certain.
const GOES_ON: f32 = 0.25;

/// A path and what it has found.
pub struct CameraPath<'a> {
    pub method: &'a VolumePath,
    pub view: View<'a>,
    pub photons: &'a [Option<Cells>],
    pub scratch: &'a mut Scratch,
    pub tally: &'a mut Tally,
    pub draws: PathSampler,
    /// Numbers of the sample's own, for what is asked of models.
    pub stream: PixelStream,
    /// Questions to models so far, but for the first surface's.
    pub asked: u32,
    /// Mirror images that it is in, of those followed beside the rest.
    pub branches: u32,
    /// Numbers for connections, so that they do not disturb the walk's.
    pub coins: PathSampler,
    pub spectrum: Spectrum,
    /// Share of lamps and suns that the next exit from the present body may meet: photons have the rest.
    pub direct: f32,
    /// Share of all other light.
    pub other: f32,
    /// Times scattered in media.
    pub order: u32,
    /// Density [1/sr] of the present direction, where lights were asked for over straight lines at the last surface or collision, and that
    /// place.
    pub sight: Option<(f32, Reference)>,
    /// The way since then, or since the body that was left, up to the present ray [unit]: through boundaries that do not refract.
    pub flown: f32,
    /// Whether the light of lights that it meets next is in a sum already: after a step in a near field, or a surface whose direct light
    /// was asked for apart.
    pub stepped: bool,
    /// The body that was just left, and how.
    pub left: Option<(&'a Interior, Option<Straight>)>,
    pub radiance: Rgb,
}

impl<'a> CameraPath<'a> {
    /// Adds light of the present order.
    pub fn add(&mut self, light: Rgb) {
        if self.method.options.orders.contains(self.order) {
            self.radiance += light;
        }
    }

    /// Follows `ray` outside all bodies until nothing is left. Each surface that absorbs ends it by chance; it is given up
    /// after as many surfaces as were asked for, or [`MOST_SURFACES`].
    pub fn trace(&mut self, mut ray: Ray) {
        for bounces in 0_u32.. {
            self.tally.rays.bounce += 1;
            let Some(hit) = self.view.rays.closest(&ray) else {
                self.meet_sky(ray.direction);
                return;
            };
            if bounces >= self.method.bounces {
                self.end(&hit, ray.direction);
                return;
            }
            let Some(next) = self.meet(&hit, ray.direction) else { return };
            ray = next;
        }
    }

    /// Adds what shines at the end of `ray`, and nothing else.
    pub fn meet_light(&mut self, ray: &Ray) {
        self.tally.rays.bounce += 1;
        match self.view.rays.closest(ray) {
            None => self.meet_sky(ray.direction),
            Some(hit) => {
                let share = self.mis_weight(&hit, ray.direction);
                self.add_lamp(&hit, ray.direction, share);
            }
        }
    }

    /// The last surface of a path: what shines there, no more.
    fn end(&mut self, hit: &Hit, direction: Vec3) {
        if self.view.scene.surface(hit.mesh).shines() {
            self.meet(hit, direction);
        } else if self.method.bounces == MOST_SURFACES {
            self.lose(hit.mesh, Cause::Endless);
        }
    }

    /// Adds a share of a lamp that is met by chance.
    fn add_lamp(&mut self, hit: &Hit, direction: Vec3, share: f32) {
        if self.stepped {
            return;
        }
        let light = self.spectrum.value_outside() * emitted(self.view.scene, hit, direction) * share;
        if let (false, Some(number)) = (light.is_black(), self.method.light.lights.number(hit.mesh)) {
            self.tally.rays.lights.meet(number);
        }
        self.add(light);
    }

    /// Adds the environment.
    fn meet_sky(&mut self, w: Vec3) {
        if self.stepped {
            return;
        }
        let lights = &self.method.light.lights;
        let share = match lights.pdf_far(w) {
            by_table if by_table > 0.0 => {
                let share = self.direct * self.mis_weight_of_sun(by_table);
                if let (true, Some(number)) = (share > 0.0, lights.number_far(w)) {
                    self.tally.rays.lights.meet(number);
                }
                share
            }
            _ => self.other,
        };
        self.add(self.spectrum.value_outside() * lights.environment(w) * share);
    }

    /// Goes on from a surface that the camera sees.
    pub fn resume(&mut self, hit: &Hit, direction: Vec3) {
        if let Some(ray) = self.meet(hit, direction) {
            self.trace(ray);
        }
    }

    /// What a surface adds, and the ray on which the path goes on.
    fn meet(&mut self, hit: &Hit, direction: Vec3) -> Option<Ray> {
        let at = self.view.point(hit, direction);
        match self.view.scene.surface(hit.mesh) {
            Surface { emission: Some(_), .. } => {
                let share = self.direct * self.mis_weight(hit, direction);
                self.add_lamp(hit, direction, share);
                None
            }
            surface @ Surface { bsdf, .. } if surface.is_opaque() => {
                (self.left, self.stepped) = (None, false);
                self.reflect(&at, -direction, &**bsdf)
            }
            Surface { .. } => {
                self.stepped = false;
                if let Some(surface) = &self.method.stand_ins[hit.mesh as usize] {
                    self.left = None;
                    return self.reflect(&at, -direction, &**surface);
                }
                if self.method.modelled[hit.mesh as usize].is_some() {
                    self.left = None;
                    return self.meet_modelled(hit, &at, direction);
                }
                let asked = self.direct > 0.0;
                self.direct = self.other;
                let entry = self.entry(hit, direction)?;
                if self.other <= 0.0 {
                    return None;
                }
                if entry.body.matched && asked {
                    self.flown += hit.t;
                } else {
                    self.turn(None);
                }
                if entry.body.matched {
                    return self.let_in(entry, &at, direction);
                }
                let flat = SurfacePoint { n: at.n_geometric, ..at };
                if entry.body.rough.is_some() {
                    return self.meet_rough(entry, (&flat, -direction), true);
                }
                let w = entry.body.cross(&flat, -direction, &mut self.draws)?.wi;
                if w.dot(at.n_geometric) > 0.0 {
                    return Some(Ray::new(at.leave(w), w));
                }
                self.let_in(entry, &at, w)
            }
        }
    }

    /// The way into a body that is met; at the inner side of a face the path is lost, and counted.
    pub fn entry(&mut self, hit: &Hit, direction: Vec3) -> Option<Entry<'a>> {
        let bodies = &self.method.bodies;
        let body = bodies[hit.mesh as usize].as_ref()?;
        let way = self.faces(hit, direction).then(|| Entry::at(self.view, bodies, body, hit, direction)).flatten();
        if way.is_none() {
            self.lose(body.object, body.leak);
        }
        way
    }

    /// Whether a body is met from outside.
    fn faces(&self, hit: &Hit, direction: Vec3) -> bool {
        let n = self.view.scene.objects[hit.mesh as usize].mesh.geometric_normal(hit.triangle);
        n.dot(direction) < 0.0
    }

    fn lose(&mut self, object: u32, cause: Cause) {
        self.tally.walk.walks += 1;
        self.tally.walk.losses.add(object, cause);
    }

    /// Asks for lights at an opaque surface, and goes on by its own sampling.
    fn reflect(&mut self, at: &SurfacePoint, wo: Vec3, bsdf: &dyn Bsdf) -> Option<Ray> {
        self.direct = self.other;
        if self.other <= 0.0 {
            return None;
        }
        let weight = self.spectrum.value_outside();
        self.ask_on((at, wo, bsdf), &Stack::default(), weight, |path| &mut path.draws);
        let (before, mut after) = (self.spectrum.value_outside().max(), self.spectrum);
        after.scale(bsdf.albedo_at(at));
        let left = after.value_outside().max();
        // Mirror images of few samples are not for chance to thin out.
        let chance = if bsdf.is_lambertian() { left / before } else { left / GOES_ON };
        if left <= 0.0 || !russian_roulette(chance, &mut self.spectrum, &mut self.draws) {
            return None;
        }
        let [u, v] = self.draws.pair();
        let which = if bsdf.is_lambertian() { 0.0 } else { self.draws.number() };
        let next = bsdf.sample(at, wo, [u, v, which])?;
        self.spectrum.scale(next.weight);
        // Of a mirror, or of the mirror in a coat, nothing was asked.
        self.turn((next.pdf > 0.0).then(|| (next.pdf, Reference::surface(at))));
        (at.n_geometric.dot(next.wi) > 0.0).then(|| Ray::new(at.leave(next.wi), next.wi))
    }

    /// Asks for lights at a rough boundary that is met from outside, unless `mirrors` is false, and goes on by its sampling: away, or through the body.
    pub fn meet_rough(&mut self, entry: Entry<'a>, (at, wo): (&SurfacePoint, Vec3), mirrors: bool) -> Option<Ray> {
        if let Some(rough) = entry.body.rough.as_ref().filter(|_| mirrors) {
            let weight = self.spectrum.value_outside();
            self.ask_on((at, wo, &**rough), &Stack::default(), weight, |path| &mut path.draws);
        }
        let next = entry.body.cross(at, wo, &mut self.draws)?;
        self.spectrum.scale(next.weight);
        // By the interpolated normal light may go where it cannot by the triangle's.
        match [at.n, at.n_geometric].map(|n| n.dot(next.wi) > 0.0) {
            [true, true] if mirrors => {
                self.turn(Some((next.pdf, Reference::surface(at))));
                Some(Ray::new(at.leave(next.wi), next.wi))
            }
            [false, false] => {
                self.turn(None);
                self.let_in(entry, at, next.wi)
            }
            _ => None,
        }
    }

    /// Through the pigment on a boundary; whether anything is left.
    pub fn tinted(&mut self, tint: Option<&Colour>, at: &SurfacePoint) -> bool {
        let Some(tint) = tint else { return true };
        self.spectrum.scale(tint.at(at));
        !self.spectrum.value_outside().is_black()
    }

    /// Through the pigment at `at` and, refracted into `w`, through bodies; the ray on which the path leaves them.
    pub fn let_in(&mut self, entry: Entry<'a>, at: &SurfacePoint, w: Vec3) -> Option<Ray> {
        if !self.tinted(entry.body.tint.as_ref(), at) {
            return None;
        }
        self.inside(entry, at, w)
    }

    /// Through bodies from `at`, refracted into `w`, the pigment behind; the ray on which the path leaves them.
    pub fn inside(&mut self, entry: Entry<'a>, at: &SurfacePoint, w: Vec3) -> Option<Ray> {
        let from = SurfacePoint { error: at.error.max(entry.margin), ..*at }.leave(w);
        self.through(entry, from, w)
    }

    /// Through bodies from `from`, inside, along `w`; the ray on which the path leaves them.
    pub fn through(&mut self, entry: Entry<'a>, from: DVec3, w: Vec3) -> Option<Ray> {
        let Entry { body, stack, through, .. } = entry;
        let (mut spectrum, mut draws) = (self.spectrum, self.draws.clone());
        let mut walks = WalkTally::default();
        let view = self.view;
        let bodies = &self.method.bodies;
        let left = if body.nested {
            let mut guide = Nested(self);
            nesting::walk(view, bodies, ((stack, through), from, w), &mut spectrum, &mut draws, &mut guide, &mut walks)
        } else {
            let around = if body.matched { Stack::only(body.object) } else { Stack::default() };
            let mut watch = Gather { path: self, body, around: &around, lit: true };
            let exit = body.walk(view, (from, w), &mut spectrum, &mut draws, &mut watch, &mut walks);
            exit.map(|exit| (body, exit))
        };
        (self.spectrum, self.draws) = (spectrum, draws);
        self.tally.walk += walks;
        let (body, exit) = left?;
        if !self.tinted(body.tint.as_ref(), &exit.at) {
            return None;
        }
        // Behind a rough boundary lights have been asked for.
        if !body.matched && body.rough.is_none() {
            self.turn(None);
            self.left = Some((body, exit.straight));
        }
        Some(Ray::new(exit.at.leave(exit.w), exit.w))
    }
}

/// A path inside a body: connects to photons, and lets the walk keep its share.
struct Gather<'a, 'b> {
    path: &'a mut CameraPath<'b>,
    body: &'a Interior,
    /// What is around the path.
    around: &'a Stack,
    /// Whether lamps are asked for through facets.
    lit: bool,
}

/// A path through bodies in one another.
struct Nested<'a, 'b>(&'a mut CameraPath<'b>);

impl Guide for Nested<'_, '_> {
    fn watch<'a>(&'a mut self, body: &'a Interior, around: &'a Stack, lit: bool) -> impl WalkObserver + 'a {
        Gather { path: self.0, body, around, lit }
    }

    fn meets(&self, object: u32) -> Meets {
        self.0.method.meets(object)
    }
}

impl WalkObserver for Gather<'_, '_> {
    fn collision(
        &mut self,
        x: DVec3,
        w: Vec3,
        edge: Option<Edge>,
        spectrum: &mut Spectrum,
        draws: &mut PathSampler,
    ) -> bool {
        let (path, body) = (&mut *self.path, self.body);
        path.order += 1;
        if path.method.options.orders.none_above(path.order) || path.in_model(body) {
            return false;
        }
        let photons = path.photons.get(body.object as usize).and_then(Option::as_ref);
        if let (Some(cells), Some(edge), true) = (photons, edge, path.direct > 0.0) {
            let share = walked_mis_weight(cells, edge.length, edge.phase);
            if share < 1.0 && draws.number() >= share {
                path.direct = 0.0;
                // What has been weighted up before goes on for certain: no weight is above the inverse of the chance.
                let chance = (path.method.persistence * path.other).min(1.0);
                if chance > 0.0 && draws.number() < chance {
                    path.other /= chance;
                } else {
                    path.other = 0.0;
                }
            }
        }
        if path.direct <= 0.0 {
            return path.other > 0.0;
        }
        let orders = path.method.options.orders;
        if body.matched && orders.contains(path.order) {
            let asked = path.asked_in(body, self.around, (x, w));
            path.radiance += asked * spectrum.value(&body.medium) * path.other;
        }
        if let Some(through) = path.method.through(body).filter(|_| self.lit && orders.contains(path.order)) {
            let (coins, found, tally) = (&mut path.coins, &mut path.scratch.crossings, &mut *path.tally);
            let (lines, lights) = (path.method.lines(path.view), &path.method.light.lights);
            for group in lights.asked() {
                let from = ((body, through), lights, group);
                path.radiance += drawn_light(lines, from, (x, w), spectrum, found, coins, tally) * path.direct;
            }
            if path.method.points_are_all(body) {
                return false;
            }
        }
        if let (Some(cells), true) = (photons, orders.contains(path.order + 1)) {
            let (coins, tally) = (&mut path.coins, &mut path.tally.walk);
            let light = connect(path.view, body, cells, (x, w), path.scratch, coins, tally);
            // Radiance falls by η² on its way out.
            path.radiance += spectrum.value(&body.medium) * light * (path.direct / (body.eta * body.eta));
        }
        true
    }

    /// Photons and points of lamps behind facets have no light from inside: it is part of all other light, and met by chance alone but for
    /// straight lines.
    fn lamp(&mut self, hit: &Hit, w: Vec3, spectrum: &Spectrum) {
        let (path, body) = (&mut *self.path, self.body);
        let share = if body.matched { path.mis_weight(hit, w) } else { 1.0 };
        let light = spectrum.value(&body.medium) * emitted(path.view.scene, hit, w) * share;
        // Radiance falls by η² on its way out.
        path.add(light * (path.other / (body.eta * body.eta)));
    }

    fn surface(&mut self, at: &SurfacePoint, wo: Vec3, bsdf: &dyn Bsdf, spectrum: &Spectrum) {
        let (path, body) = (&mut *self.path, self.body);
        if body.matched {
            path.ask_on((at, wo, bsdf), self.around, spectrum.value(&body.medium), |path| &mut path.coins);
        }
    }

    fn boundary(&mut self, at: &SurfacePoint, wo: Vec3, rough: &RoughBoundary, spectrum: &Spectrum) {
        let (path, body) = (&mut *self.path, self.body);
        // Beside a model what comes straight through has paths of its own.
        if path.order == 0 && path.method.modelled[body.object as usize].is_some() {
            return;
        }
        let weight = spectrum.value(&body.medium) * body.tint(at);
        path.ask_on((at, wo, rough), &Stack::default(), weight, |path| &mut path.coins);
    }

    fn turned(&mut self, turn: Turn<'_>) {
        let (path, asks) = (&mut *self.path, self.body.matched);
        match turn {
            Turn::None(length) => path.flown += length,
            Turn::Scattered(x, pdf) => path.turn(asks.then(|| (pdf, Reference::place(x)))),
            // Of a mirror nothing was asked.
            Turn::Reflected(at, pdf) => path.turn((asks && pdf > 0.0).then(|| (pdf, Reference::surface(at)))),
            Turn::Out(at, pdf) => path.turn(Some((pdf, Reference::surface(at)))),
            Turn::Bent => path.turn(None),
        }
    }
}

impl Orders {
    /// Whether light scattered `order` times is wanted.
    pub fn contains(self, order: u32) -> bool {
        match self {
            Self::All => true,
            Self::None => order == 0,
            Self::Single => order == 1,
            Self::Multiple => order >= 2,
        }
    }

    /// Whether a path that has been scattered `order` times can be dropped.
    pub fn none_above(self, order: u32) -> bool {
        match self {
            Self::None => order > 0,
            Self::Single => order > 1,
            Self::All | Self::Multiple => false,
        }
    }
}
