//! What enters a body: every density of points and of directions, and the near field, give the same light.
#![allow(clippy::unwrap_used)] // a scene that does not load has failed

mod parts;
mod rendering;

use marmor::bssrdf::{Bssrdf, Exit, ModelName, ModelOptions};
use marmor::cache::{
    CacheBuilder, CachedBody, CachedSample, Density, Directions, Envelope, GatherPoint, NearField, Survey, seen,
};
use marmor::light::Lights;
use marmor::math::{Rgb, Vec3};
use marmor::optics::Medium;
use marmor::query::{self, Backend, RayQuery};
use marmor::sampling::{CacheStream, PixelStream, Points};
use marmor::scene::{Scene, Spread, View};
use marmor::tally::Tally;
use parts::{WAX, camera, emissive, rectangle, sphere, translucent};
use rendering::{load, mean_of};

const MEDIUM: Medium = Medium { sigma_a: Rgb([0.01, 0.05, 0.2]), sigma_s: Rgb([0.5, 0.9, 2.0]), g: 0.0, eta: 1.3 };

/// A coarse ball under a lamp that almost touches it, or one farther away.
fn scene(height: f32, more: &str) -> Scene {
    let text = format!(
        "unit = \"mm\"\n[camera]\nposition = [30, 0, 0]\nlook_at = [0, 0, 0]\nfov = 30\nresolution = [64, 64]\n\
         [[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 5\nrings = 12\nsegments = 24\nmaterial = \"wax\"\n\
         [[object]]\nname = \"lamp\"\nshape = \"rectangle\"\ncentre = [0, {height}, 0]\nedge_u = [4, 0, 0]\nedge_v = [0, 0, 4]\nmaterial = \"lamp\"\n\
         [material.wax]\ntype = \"translucent\"\nsigma_s_prime = 1\nsigma_a = 0.1\neta = 1.3\n\
         [material.lamp]\ntype = \"emissive\"\nradiance = 1\ntwo_sided = true\n{more}"
    );
    load(&text)
}

struct Set {
    scene: &'static Scene,
    rays: Box<dyn RayQuery>,
    lights: Lights,
    body: CachedBody,
}

impl Set {
    fn new(scene: Scene, name: ModelName) -> Self {
        let scene: &'static Scene = Box::leak(Box::new(scene));
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        let lights = Lights::new(scene);
        let model = name.build(&MEDIUM, &ModelOptions::DEFAULT).unwrap();
        Self { rays, lights, body: CachedBody::new(scene, 0, model).unwrap(), scene }
    }

    fn view(&self) -> View<'_> {
        View { scene: self.scene, rays: &*self.rays }
    }

    fn builder<'a>(&'a self, stream: &'a CacheStream, density: &'a Density, cosine_share: f32) -> CacheBuilder<'a> {
        CacheBuilder {
            view: self.view(),
            lights: &self.lights,
            body: &self.body,
            directions: Directions::Lights { cosine_share },
            stream,
            density,
        }
    }
}

/// Enough to see a weight of the cosine that is a third off.
const FLUX_SAMPLES: u32 = 40_000;

/// Mean and standard error of the flux of each of some independent caches.
fn flux(set: &Set, density: &Density, cosine_share: f32) -> [f64; 2] {
    let each = (0..40).map(|seed| {
        let stream = CacheStream::new(Points::Independent, seed, 0);
        let cache = set.builder(&stream, density, cosine_share).fill(0, FLUX_SAMPLES, &mut Tally::default());
        cache.lit.iter().map(|s| f64::from(s.flux.mean())).sum::<f64>() / f64::from(FLUX_SAMPLES)
    });
    mean_of(each).into()
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).abs() / a[1].hypot(b[1])
}

#[test]
fn directions_by_light_and_by_cosine_bring_the_same_flux_together_and_alone() {
    for (height, environment) in [(5.2, ""), (9.0, ""), (9.0, "[environment]\nradiance = 0.3\n")] {
        let set = Set::new(scene(height, environment), ModelName::STANDARD);
        let even = Density::even();
        let shares: &[f32] = if environment.is_empty() { &[0.0, 0.2, 0.5] } else { &[0.3, 0.5, 0.7] };
        let found: Vec<[f64; 2]> = shares.iter().map(|&share| flux(&set, &even, share)).collect();
        for other in &found[1..] {
            assert!(apart(found[0], *other) < 6.0, "{height} {environment}: {found:?}");
        }
        assert!(apart(found[2], [1.15 * found[1][0], found[1][1]]) > 6.0, "15 % would not be noticed: {found:?}");
    }
}

#[test]
fn a_lamp_nearer_than_it_is_wide_takes_some_directions_by_the_cosine_and_has_less_noise_by_it() {
    let near = Set::new(scene(5.2, ""), ModelName::STANDARD);
    let share = near.lights.cosine_share(near.scene.objects[0].mesh.bounds().unwrap());
    assert!(share > 0.2 && share <= 0.5, "{share}");
    let even = Density::even();
    let noise = [0.0, share].map(|share| flux(&near, &even, share)[1]);
    assert!(noise[1] < noise[0], "{noise:?}");
    let far = Set::new(scene(30.0, ""), ModelName::STANDARD);
    assert!(far.lights.cosine_share(far.scene.objects[0].mesh.bounds().unwrap()) == 0.0);
}

#[test]
fn samples_spread_by_what_is_seen_bring_the_same_flux_as_an_even_spread() {
    let set = Set::new(scene(9.0, ""), ModelName::STANDARD);
    let envelope = Envelope::new(&*set.body.model, &MEDIUM);
    let (even, stream) = (Density::even(), CacheStream::new(Points::Sobol, 99, 0));
    let points = seen(set.view());
    assert!(points[0].len() > 100 && points[1].len() < points[0].len());
    let survey = Survey::new(&set.builder(&stream, &even, 0.0), &envelope, &points[0], Spread::Seen, 32768);
    assert!(survey.variance > 0.0 && survey.typical.x > 0.0);
    assert!(survey.noise2(1e4) > survey.noise2(1e5));
    let found = [flux(&set, &even, 0.0), flux(&set, &survey.density, 0.0)];
    assert!(apart(found[0], found[1]) < 6.0, "{found:?}");
    assert!(found[0][1] != found[1][1], "the densities are the same");
}

/// Σ S_d near flux over samples of a cache.
fn near_part(near: &NearField, model: &dyn Bssrdf, samples: &[CachedSample], exit: &Exit) -> f64 {
    let each = samples.iter().map(|s| {
        let share = near.partition.share(model.apart2(&s.entry, s.depth, exit));
        f64::from((model.eval_cached(&s.entry, s.depth, exit, 0.0) * s.flux * share).mean())
    });
    each.sum()
}

impl Set {
    /// Where a ray from outside along -`direction` meets the ball, with a normal turned by up to `tilt`.
    fn exit(&self, direction: Vec3, tilt: f32) -> Exit {
        let from = direction.normalize();
        let hit = self.rays.closest(&query::Ray::new(9.0 * from.as_dvec3(), -from)).unwrap();
        let at = self.scene.objects[0].mesh.point(hit.triangle, hit.u, hit.v);
        let n = (at.n_geometric + tilt * Vec3::new(0.3, -0.5, 0.8)).normalize();
        Exit { x: (at.x - self.body.table().centre()).as_vec3(), n, w: at.n_geometric }
    }

    /// Mean and standard error of the near field at each of `exits`: what their lines find together, and what caches have.
    fn near_field(&self, near: &NearField, exits: &[Exit], runs: u64) -> Vec<[[f64; 2]; 2]> {
        let (even, stream) = (Density::even(), CacheStream::new(Points::Independent, 1, 0));
        let builder = self.builder(&stream, &even, 0.0);
        let own = |run: u64| {
            let point = |(i, &exit): (u64, &Exit)| {
                let stream = PixelStream::new(5, run * exits.len() as u64 + i, 3);
                GatherPoint { exit, place: self.body.table().centre() + exit.x.as_dvec3(), stream }
            };
            let points: Vec<GatherPoint> = (0..).zip(exits).map(point).collect();
            let (mut sums, mut tally) = (vec![Rgb::BLACK; exits.len()], Tally::default());
            near.add(&builder, &points, &mut tally, &mut sums);
            let gather = tally.gather;
            assert!(gather.near <= gather.near_points * exits.len() as u64 && gather.non_finite == 0);
            sums
        };
        let own: Vec<Vec<Rgb>> = (0..runs).map(own).collect();
        let caches: Vec<_> = (0..300).map(|i| builder.fill(i * 2000, 2000, &mut Tally::default())).collect();
        let both = |(i, exit): (usize, &Exit)| {
            let cached = caches.iter().map(|c| near_part(near, &*self.body.model, &c.lit, exit) / 2000.0);
            [mean_of(own.iter().map(|sums| f64::from(sums[i].mean()))), mean_of(cached)].map(Into::into)
        };
        exits.iter().enumerate().map(both).collect()
    }
}

/// On a ball smaller than the near field its lines meet two and more sheets at all angles.
#[test]
fn the_near_field_is_the_part_that_the_cache_leaves_out() {
    for name in [ModelName::STANDARD, ModelName::BEAM, ModelName::DIRECTIONAL] {
        let set = Set::new(scene(9.0, ""), name);
        let envelope = Envelope::new(&*set.body.model, &MEDIUM);
        for (radius, direction) in [(2.0, Vec3::new(0.6, 0.8, 0.0)), (8.0, Vec3::new(0.9, 0.3, 0.3)), (20.0, Vec3::X)] {
            let near = NearField::new(&envelope, radius);
            for [own, cached] in set.near_field(&near, &[set.exit(direction, 0.0)], 16_000) {
                assert!(apart(own, cached) < 6.0, "{} {radius}: {own:?} {cached:?}", name.name());
                assert!(own[1] < 0.03 * own[0] && cached[1] < 0.06 * cached[0], "{own:?} {cached:?}");
            }
        }
    }
}

/// Exits share what their lines find: side by side, at the rim of one another's near field, beyond it, and with other normals.
#[test]
fn exits_that_share_their_lines_have_each_its_own_near_field() {
    let set = Set::new(scene(9.0, ""), ModelName::STANDARD);
    let envelope = Envelope::new(&*set.body.model, &MEDIUM);
    let near = NearField::new(&envelope, 2.0);
    let exits: Vec<Exit> = [0.0, 0.02, 0.1, 0.35, 0.4, 1.2]
        .iter()
        .enumerate()
        .map(|(i, &aside)| set.exit(Vec3::new(0.6, 0.8, aside), 0.2 * i as f32))
        .collect();
    let found = set.near_field(&near, &exits, 8000);
    for (i, [own, cached]) in found.iter().enumerate() {
        assert!(apart(*own, *cached) < 6.0, "exit {i}: {own:?} {cached:?}");
        assert!(apart([1.2 * own[0], own[1]], *cached) > 6.0, "20 % would not be noticed: {own:?} {cached:?}");
    }
    // Company lowers the noise.
    let [alone, _] = set.near_field(&near, &exits[..1], 8000)[0];
    assert!(found[0][0][1] < 0.8 * alone[1], "{:?} {alone:?}", found[0][0]);
}

/// Bright light that grazes the exit and faint light from straight above, drawn equally often: what comes from one must not
/// enter along the other.
#[test]
fn models_of_direction_have_each_light_of_the_near_field_along_its_own() {
    let text = camera([30.0, 0.0, 0.0], [0.0; 3], 30.0, [64, 64])
        + &sphere("ball", [0.0; 3], 5.0, 12, "wax")
        + &rectangle("grazing", [6.0, 6.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.5], "bright")
        + &rectangle("above", [60.0, 0.0, 0.0], [0.0, 0.0, 5.0], [0.0, 5.0, 0.0], "faint")
        + &translucent("wax", WAX)
        + &emissive("bright", 1)
        + &emissive("faint", 0.01);
    for name in [ModelName::BEAM, ModelName::DIRECTIONAL] {
        let set = Set::new(load(&text), name);
        let near = NearField::new(&Envelope::new(&*set.body.model, &MEDIUM), 8.0);
        let [own, cached] = set.near_field(&near, &[set.exit(Vec3::X, 0.0)], 16_000)[0];
        assert!(apart(own, cached) < 6.0, "{}: {own:?} {cached:?}", name.name());
        // Along the direction of the light that came first at a point it would be 16 to 20 % less.
        assert!(apart([0.88 * own[0], own[1]], cached) > 6.0, "12 % would not be noticed: {own:?} {cached:?}");
    }
}
