//! Light from a lamp or a sun straight to a collision, through every facet of the boundary that refracts it there.

use super::draws::PathSampler;
use super::facets::{Bend, Crossing, Facets, Towards};
use super::interior::{Interior, Straight};
use super::lines::Lines;
use super::nesting::Stack;
use super::spectrum::Spectrum;
use crate::light::{Group, LightEnd, LightSample, Lights, Reference};
use crate::math::{Aabb, DVec3, Rgb, Vec3};
use crate::optics::transmittance;
use crate::query::{Hit, Ray};
use crate::scene::Scene;
use crate::tally::{Tally, WalkTally};
use std::f32::consts::PI;

/// What a body needs to be asked for the light of lamps and suns.
pub struct RefractedNee {
    facets: Facets,
    /// The body's box.
    bounds: Aabb,
    /// For each object whether it is a lamp whose light is found from points of it alone; a path that meets it by chance,
    /// straight from a collision, carries none of it.
    alone: Vec<bool>,
    /// Whether that holds for all lamps.
    pub all_alone: bool,
    /// Directions of suns with a density [1/sr] above this are such lamps too.
    alone_above: f32,
}

/// Crossings whose light may be looked for at one collision; of more, as many are drawn by what they carry.
const MOST_TRACED: usize = 3;
/// Every crossing within this many mean free paths is asked for; those beyond by chance.
const SURE: f32 = 1.0;
/// A lamp is [`RefractedNee::alone`] if no sample of its points is worth more than this share of its radiance.
const ALONE_BELOW: f32 = 0.25;

impl RefractedNee {
    /// For the object number `object` with refractive index `eta` and mean cosine `g`. `None` without facets, or without lamps
    /// and suns.
    pub fn new(scene: &Scene, lights: &Lights, object: u32, eta: f32, g: f32) -> Option<Self> {
        if !lights.has_emitters() && !lights.has_suns() {
            return None;
        }
        let (mesh, bounds) = (&scene.objects[object as usize].mesh, scene.body(object)?.bounds);
        // HG's largest value [1/sr].
        let phase = (1.0 + g.abs()) / (4.0 * PI * (1.0 - g.abs()).powi(2));
        // The focus of a flat boundary seen from behind it is at most 1/(η L)² times the cosine's ratio.
        let is_alone = |lamp: u32| phase < ALONE_BELOW * lights.least_solid_pdf(lamp, &bounds) * (eta * eta).min(1.0);
        let alone: Vec<bool> = (0..scene.objects.len() as u32).map(is_alone).collect();
        let all_alone = (0_u32..).zip(&alone).all(|(i, &alone)| alone || !lights.is_light(i));
        let alone_above = phase / (ALONE_BELOW * (eta * eta).min(1.0));
        Some(Self { facets: Facets::new(mesh, eta)?, bounds, alone, all_alone, alone_above })
    }

    /// Whether light of the object number `object` is left to [`drawn_light`] alone.
    pub fn alone(&self, object: u32) -> bool {
        self.alone[object as usize]
    }

    /// Whether light of a sun that is drawn with density `pdf` [1/sr] is left to [`drawn_light`] alone.
    pub fn sun_alone(&self, pdf: f32) -> bool {
        pdf > self.alone_above
    }

    /// The same of what was drawn.
    fn drawn_alone(&self, drawn: &LightSample) -> bool {
        drawn.is_delta || drawn.object.map_or_else(|| self.sun_alone(drawn.pdf as f32), |object| self.alone(object))
    }
}

/// Densities of one line from a collision to a point of a lamp, per area of the lamp: by a point drawn on the lamp, and by a
/// direction drawn from the phase function and let through; for a sun, per solid angle outside. The balance heuristic [VG95] shares the light among both:
/// no line carries more than the lamp's radiance.
struct Densities {
    by_point: f32,
    by_chance: f32,
}

impl Densities {
    fn mis_weight_by_point(&self) -> f32 {
        self.by_point / (self.by_point + self.by_chance)
    }

    fn mis_weight_by_chance(&self) -> f32 {
        self.by_chance / (self.by_point + self.by_chance)
    }
}

/// Density of a direction outside [1/sr] by one drawn inside with density `phase` and let through.
fn density_outside(body: &Interior, bend: &Bend, phase: f32) -> f32 {
    phase * transmittance(1.0 / body.eta, bend.cosines[0] as f32) * bend.focus_of_directions(body.eta.into()) as f32
}

/// Radiance that lamps or suns send straight to the collision at `x`, through the boundary, scattered there against `w`, in
/// which the path from the camera came: an estimate with the path's weight in it.
///
/// A point of a lamp, or a direction to a sun, is drawn, and all facets that refract its light to `x` are found: the sum over
/// them is what arrives from there [WZHB09], caustics and all. Facets far away for the light to come through are looked for by
/// chance, with its inverse as weight. Light reflected inside on its way is not in it.
pub fn drawn_light(
    lines: Lines<'_>,
    ((body, through), lights, group): ((&Interior, &RefractedNee), &Lights, Group),
    (x, w): (DVec3, Vec3),
    spectrum: &Spectrum,
    found: &mut Vec<Crossing>,
    draws: &mut PathSampler,
    tally: &mut Tally,
) -> Rgb {
    let u = [draws.number(), draws.number(), draws.number()];
    let Some(horizon) = horizon(body, x, draws) else { return Rgb::BLACK };
    let from = Reference::inside(x, &through.bounds);
    let Some(drawn) = lights.sample(lines.view.scene, group, &from, u) else { return Rgb::BLACK };
    spectrum.value(&body.medium) * arriving(lines, (body, through), &drawn, (x, w), horizon, found, draws, tally)
}

/// How far away facets are looked for; `None` where no surface is that near.
fn horizon(body: &Interior, x: DVec3, draws: &mut PathSampler) -> Option<f32> {
    let horizon = (SURE - (1.0 - draws.number()).ln()) / body.least_extinction;
    (body.clearance.at(x) <= horizon).then_some(horizon)
}

/// What arrives at `x` from what was drawn, per unit weight of the path.
#[allow(clippy::too_many_arguments)] // what both callers have
fn arriving(
    lines: Lines<'_>,
    (body, through): (&Interior, &RefractedNee),
    drawn: &LightSample,
    (x, w): (DVec3, Vec3),
    horizon: f32,
    found: &mut Vec<Crossing>,
    draws: &mut PathSampler,
    tally: &mut Tally,
) -> Rgb {
    let decay = body.least_extinction;
    let mesh = &lines.view.scene.objects[body.object as usize].mesh;
    let towards = match drawn.end {
        LightEnd::Point { at, .. } => Towards::Point(at.x),
        LightEnd::Direction(w) => Towards::Direction(w),
    };
    through.facets.crossings(mesh, x, towards, horizon, found);
    let (mut sum, alone) = (0.0, through.drawn_alone(drawn));
    let carried = |crossing: &Crossing| {
        let light = line(body, crossing, drawn, body.phase(w, crossing.inside), alone);
        let length = crossing.bend.lengths[0] as f32;
        // Over the chance that the horizon is not nearer.
        let weighted = decay * (length - SURE / decay).max(0.0);
        drawn.radiance * body.medium.sigma_t.map(|s| (weighted - s * length).exp()) * light
    };
    found.retain(|crossing| {
        let light = carried(crossing).mean();
        sum += light;
        light > 0.0
    });
    let mut light = Rgb::BLACK;
    if found.len() <= MOST_TRACED {
        for crossing in found.iter() {
            light += carried(crossing) * open(lines, body, x, crossing, drawn, tally);
        }
    } else {
        // Evenly spaced marks along the sum of what is carried.
        let step = sum / MOST_TRACED as f32;
        let (mut mark, mut below) = (draws.number() * step, 0.0);
        for crossing in found.iter() {
            let carried = carried(crossing);
            below += carried.mean();
            let mut marks = 0.0;
            while mark < below {
                (mark, marks) = (mark + step, marks + 1.0);
            }
            if marks > 0.0 {
                let open = open(lines, body, x, crossing, drawn, tally);
                light += carried * (marks * step / carried.mean()) * open;
            }
        }
    }
    light
}

/// What arrives of the radiance over one line, over the density of what was drawn; without absorption.
fn line(body: &Interior, crossing: &Crossing, drawn: &LightSample, phase: f32, alone: bool) -> f32 {
    let by_chance = match drawn.end {
        LightEnd::Point { .. } => {
            let cosine = drawn.cosine(crossing.outside);
            if cosine <= 0.0 {
                return 0.0;
            }
            let passed = transmittance(1.0 / body.eta, crossing.bend.cosines[0] as f32);
            phase * passed * cosine * crossing.bend.focus(body.eta.into()) as f32
        }
        LightEnd::Direction(_) => density_outside(body, &crossing.bend, phase),
    };
    let densities = Densities { by_point: drawn.pdf as f32, by_chance };
    densities.by_chance / densities.by_point * if alone { 1.0 } else { densities.mis_weight_by_point() }
}

/// The share of light that arrives at `x` from what was drawn, but for the body's own extinction.
fn open(
    lines: Lines<'_>,
    body: &Interior,
    x: DVec3,
    crossing: &Crossing,
    drawn: &LightSample,
    tally: &mut Tally,
) -> Rgb {
    let passed = passed(lines, body, x, crossing, drawn, &mut tally.walk);
    tally.rays.lights.ask(drawn.light, !passed.is_black());
    passed
}

fn passed(
    lines: Lines<'_>,
    body: &Interior,
    x: DVec3,
    crossing: &Crossing,
    drawn: &LightSample,
    tally: &mut WalkTally,
) -> Rgb {
    // Behind a face in which another lies there is no air.
    if body.contacts.contains_key(&crossing.triangle) {
        return Rgb::BLACK;
    }
    let view = lines.view;
    let at = view.scene.objects[body.object as usize].mesh.point(crossing.triangle, crossing.u, crossing.v);
    if body.union.as_ref().is_some_and(|union| !union.bears(crossing.triangle, at.x)) {
        return Rgb::BLACK;
    }
    tally.rays += 1;
    if !body.lets_through(view, Ray::between(x, at.arrive(crossing.inside, x, 0.0))) {
        return Rgb::BLACK;
    }
    body.tint(&at) * lines.passed(&drawn.shadow(&at, crossing.outside), &Stack::default(), &mut tally.rays)
}

/// The share of the radiance of the lamp at `hit`, met along `direction` by a path that came out of a body straight from
/// a collision, that [`drawn_light`] leaves to it.
pub fn mis_weight_by_chance(
    scene: &Scene,
    lights: &Lights,
    (body, through): (&Interior, Option<&RefractedNee>),
    straight: &Straight,
    hit: &Hit,
    direction: Vec3,
) -> f32 {
    let Some(through) = through else { return 1.0 };
    if through.alone(hit.mesh) {
        return 0.0;
    }
    let bend = straight.bend(hit.t);
    let normal = scene.objects[hit.mesh as usize].mesh.geometric_normal(hit.triangle);
    let focus = bend.focus(body.eta.into()) as f32 * normal.dot(direction).abs();
    let passed = transmittance(1.0 / body.eta, bend.cosines[0] as f32);
    let by_point = lights.pdf_point(&Reference::inside(straight.from, &through.bounds), hit.mesh);
    Densities { by_point, by_chance: straight.phase * passed * focus }.mis_weight_by_chance()
}

/// The same for a sun, drawn with density `by_point` [1/sr], and [`drawn_light`].
pub fn sun_mis_weight_by_chance(
    (body, through): (&Interior, Option<&RefractedNee>),
    straight: &Straight,
    by_point: f32,
) -> f32 {
    let Some(through) = through else { return 1.0 };
    if through.sun_alone(by_point) {
        return 0.0;
    }
    let by_chance = density_outside(body, &straight.bend(f32::INFINITY), straight.phase);
    Densities { by_point, by_chance }.mis_weight_by_chance()
}

#[cfg(test)]
mod tests {
    use super::super::interior::Flight;
    use super::*;
    use crate::integrator::{View, VolumePath, VolumePathOptions};
    use crate::light::emitted;
    use crate::optics::refract;
    use crate::query::{self, Backend};
    use crate::scene::{Orders, SceneFile};

    const OPTIONS: VolumePathOptions = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed: 1 };

    fn scene(medium: &str, lamp: &str) -> Scene {
        let text = format!(
            "unit = \"mm\"\n[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov = 15\nresolution = [8, 8]\n\
             [[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 1\nrings = 12\nsegments = 24\n\
             material = \"body\"\n[material.body]\ntype = \"translucent\"\n{medium}\n\
             [[object]]\nname = \"post\"\nshape = \"sphere\"\ncentre = [0.5, 1.6, 0]\nradius = 0.4\nrings = 12\nsegments = 24\n\
             material = \"grey\"\n[material.grey]\ntype = \"diffuse\"\nalbedo = 0.5\n\
             [material.lamp]\ntype = \"emissive\"\nradiance = [3, 2, 1]\n{lamp}"
        );
        Scene::load(&SceneFile::parse(&text, std::path::Path::new("test.toml")).unwrap()).unwrap()
    }

    /// A mean and its standard error.
    #[derive(Default)]
    struct Mean([f64; 3]);

    impl Mean {
        fn add(&mut self, value: f32) {
            let v = f64::from(value);
            self.0 = [self.0[0] + 1.0, self.0[1] + v, self.0[2] + v * v];
        }

        fn get(&self) -> (f64, f64) {
            let [n, sum, squares] = self.0;
            (sum / n, ((squares / n - (sum / n).powi(2)) / n).sqrt())
        }
    }

    /// Points of lamps and chance together against directions of the phase function alone, straight flights, in channel 0.
    fn both_ways(medium: &str, lamp: &str, samples: u64) -> [(f64, f64); 2] {
        let scene = scene(medium, lamp);
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        let view = View { scene: &scene, rays: &*rays };
        // It asks through facets whatever the index.
        let method = VolumePath::once(&scene, |_| true, OPTIONS.seed);
        let (body, lights) = (method.bodies[0].as_ref().unwrap(), &method.light.lights);
        let through = method.through(body);
        let from = ((body, through.unwrap()), lights, Group::Near);
        let (mut points, mut chance) = (Mean::default(), Mean::default());
        let (mut found, mut tally) = (Vec::new(), Tally::default());
        for i in 0..samples {
            let mut draws = PathSampler::new(&[], i);
            // Somewhere in the ball, more often close to its surface.
            let x = (draws.direction() * (0.95 * (1.0 - draws.number().powi(2)))).as_dvec3() - scene.centre;
            let w = draws.direction();
            let spectrum = Spectrum::new(Rgb::WHITE, draws.number());
            let mut lucky = [0.0; 2];
            let to = body.scatter(w, &mut draws);
            if let Flight::Boundary(at, length) = body.flight(view, (x, 0.0), to, f32::INFINITY, &mut tally.walk)
                && let Some(out) = refract(-to, -at.n_geometric, 1.0 / body.eta)
                && let Some(hit) = view.rays.closest(&Ray::new(at.leave(out), out))
            {
                let mu = to.dot(at.n_geometric);
                let passed = transmittance(1.0 / body.eta, mu) * (-body.medium.sigma_t[0] * length).exp();
                let phase = body.phase(w, to);
                let straight = Straight { from: x, phase, length, cosines: [mu, out.dot(at.n_geometric)] };
                let light = emitted(&scene, &hit, out)[0] * passed;
                lucky = [light, light * mis_weight_by_chance(&scene, lights, (body, through), &straight, &hit, out)];
            }
            chance.add(lucky[0]);
            // Far less noisy, but slower.
            if i % 12 == 0 {
                let light =
                    drawn_light(method.lines(view), from, (x, w), &spectrum, &mut found, &mut draws, &mut tally);
                points.add(light[0] + lucky[1]);
            }
        }
        [points.get(), chance.get()]
    }

    const SMALL: &str = "[[object]]\nshape = \"rectangle\"\ncentre = [0, 8, 2]\nedge_u = [1.2, 0, 0]\n\
                         edge_v = [0, 0.9, -1.2]\nmaterial = \"lamp\"\n[[object]]\nshape = \"sphere\"\n\
                         centre = [7, -2, 3]\nradius = 0.7\nmaterial = \"lamp\"\n";
    /// Beside the ball, and larger than it.
    const LARGE: &str = "[[object]]\nshape = \"rectangle\"\ncentre = [0, -1.3, 0]\nedge_u = [0, 0, 3]\n\
                         edge_v = [3, 0, 0]\nmaterial = \"lamp\"\n";

    /// To 6 standard errors, in one scene a line: refraction to either side and none, forward and backward scattering,
    /// small and large lamps, something in the way.
    #[test]
    fn points_of_lamps_find_what_chance_finds() {
        for (medium, lamp) in [
            ("sigma_s = 1.5\nsigma_a = 0.2\ng = 0\neta = 1.3", SMALL),
            ("sigma_s = 9\nsigma_a = 0.2\ng = 0\neta = 1.5", SMALL),
            ("sigma_s = 1.5\nsigma_a = 0.2\ng = 0.6\neta = 1", SMALL),
            ("sigma_s = 1.5\nsigma_a = 0.2\ng = -0.5\neta = 0.75", SMALL),
            ("sigma_s = 1.5\nsigma_a = 0.2\ng = 0\neta = 1.3", LARGE),
            ("sigma_s = 1.5\nsigma_a = 0.2\ng = 0.9\neta = 1.5", LARGE),
        ] {
            let [points, chance] = both_ways(medium, lamp, 1_200_000);
            println!("{medium}: {points:?} {chance:?} ratio of errors {}", chance.1 / points.1);
            let error = points.1.hypot(chance.1);
            assert!(error < 0.1 * chance.0, "{medium}: too noisy to say anything: {points:?} {chance:?}");
            assert!((points.0 - chance.0).abs() < 6.0 * error, "{medium}: {points:?} {chance:?}");
        }
    }

    /// No line carries more than the lamp's radiance.
    #[test]
    fn light_is_bounded() {
        for (medium, lamp) in [
            ("sigma_s = 1.5\nsigma_a = 0.2\ng = 0\neta = 1.3", LARGE),
            ("sigma_s = 1.5\nsigma_a = 0.2\ng = 0.95\neta = 1.5", LARGE),
            ("sigma_s = 1.5\nsigma_a = 0.2\ng = 0\neta = 0.75", SMALL),
        ] {
            let scene = scene(medium, lamp);
            let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
            let view = View { scene: &scene, rays: &*rays };
            let method = VolumePath::new(&scene, OPTIONS).unwrap();
            let (body, lights) = (method.bodies[0].as_ref().unwrap(), &method.light.lights);
            let from = ((body, method.through(body).unwrap()), lights, Group::Near);
            let (mut found, mut tally, mut most) = (Vec::new(), Tally::default(), 0.0_f32);
            for i in 0..100_000 {
                let mut draws = PathSampler::new(&[], i);
                let x = draws.direction().as_dvec3() * 0.98 - scene.centre;
                let spectrum = Spectrum::new(Rgb::WHITE, draws.number());
                let w = draws.direction();
                let light =
                    drawn_light(method.lines(view), from, (x, w), &spectrum, &mut found, &mut draws, &mut tally);
                most = most.max(light.max() / found.len().max(1) as f32);
            }
            println!("{medium}: {most}");
            assert!(most > 0.0 && most < 3.0, "{medium}: {most}");
        }
    }
}
