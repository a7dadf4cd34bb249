//! What every ray backend of this build must do, against brute force in f64 and against each other.
#![allow(clippy::unwrap_used)] // a backend that cannot be built has failed the test
#![allow(clippy::print_stdout)] // figures for docs/rays.md

mod exact;
mod reference;
mod scenes;

use marmor::geometry::Mesh;
use marmor::math::{DVec3, Vec3};
use marmor::query::{self, Backend, Ray, RayQuery};
use reference::{examine, is_open, nearest_in_f64, verdict};
use scenes::{PathSampler, bumpy_sphere, mesh_of, placed, rays, soup};

const EMBREE: &str = "embree";

/// The backends of this build by name, and the tracer in f64 that takes their place in scenes that f32 cannot hold.
fn backends(meshes: &[&Mesh]) -> Vec<(&'static str, Box<dyn RayQuery>)> {
    let built = Backend::ALL.into_iter().filter(|b| b.is_built_in());
    let mut all: Vec<_> = built.map(|b| (b.name(), query::build(b, meshes).unwrap())).collect();
    assert!(!all.is_empty());
    all.push(("exact", query::exact(meshes)));
    all
}

/// What the rays of a check came to.
#[derive(Default)]
struct Tally {
    hits: usize,
    /// Rays on which rounding leaves a choice.
    open: usize,
}

/// Holds every backend to the f64 answer on every ray, and its two questions and its batches to each other.
fn check(what: &str, meshes: &[&Mesh], rays: &[Ray]) -> Tally {
    let backends = backends(meshes);
    let mut tally = Tally::default();
    for ray in rays {
        let exams = examine(meshes, ray);
        tally.open += usize::from(is_open(&exams));
        for (backend, query) in &backends {
            let hit = query.closest(ray);
            if let Err(wrong) = verdict(&exams, ray, hit.as_ref(), *backend == EMBREE) {
                panic!("{what}, {}: {ray:?}\nfound {hit:?}\n{wrong}", backend);
            }
            assert_eq!(query.occluded(ray), hit.is_some(), "{what}, {}: {ray:?} found {hit:?}", backend);
            tally.hits += usize::from(hit.is_some());
        }
    }
    for (backend, query) in &backends {
        let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
        query.closest_batch(rays, &mut hits);
        query.occluded_batch(rays, &mut occluded);
        for (i, ray) in rays.iter().enumerate() {
            assert_eq!((hits[i], occluded[i]), (query.closest(ray), hits[i].is_some()), "{what}, {}", backend);
        }
    }
    tally.hits /= backends.len();
    tally
}

#[test]
fn random_triangles_at_every_scale_in_several_meshes() {
    for exponent in [-6, -3, 0, 3, 6] {
        let scale = 10_f32.powi(exponent);
        let mut draws = PathSampler::new(1);
        let meshes: Vec<Mesh> = [200, 0, 1, 150].map(|n| placed(&soup(&mut draws, n), scale, Vec3::ZERO)).into();
        let meshes: Vec<&Mesh> = meshes.iter().collect();
        let rays = rays(&mut draws, 1500, scale, Vec3::ZERO);
        let tally = check(&format!("soup at 10^{exponent}"), &meshes, &rays);
        assert!(tally.hits > 500 && tally.hits < 1450, "{}", tally.hits);
        assert!(tally.open < 30, "{} of 1500 rays prove nothing", tally.open);
    }
}

/// Coordinates a million sizes away are coarse, but what a ray near them finds is as exact as at the origin: the bound of
/// `reference` knows only the distance between ray and triangle.
#[test]
fn triangles_far_from_the_origin_lose_nothing() {
    for (size, offset) in [(1.0, 1e4), (100.0, 1e6), (1e-2, 1e3)] {
        let mut draws = PathSampler::new(2);
        let offset = Vec3::new(1.0, -0.7, 0.4) * offset;
        let mesh = placed(&soup(&mut draws, 200), size, offset);
        let rays = rays(&mut draws, 1500, size, offset);
        let tally = check(&format!("soup of {size} at {offset}"), &[&mesh], &rays);
        assert!(tally.hits > 400, "{}", tally.hits);
        assert!(tally.open < 300, "{} of 1500 rays prove nothing", tally.open);
    }
}

#[test]
fn triangles_without_area_are_never_hit_and_needles_are_no_trouble() {
    let mut draws = PathSampler::new(3);
    let mut triangles = Vec::new();
    for _ in 0..100 {
        let [a, b] = [draws.point(), draws.point()];
        let third = draws.unit();
        triangles.push([a, a, a]);
        triangles.push([a, b, b]);
        triangles.push([a, b, a]);
        // Collinear up to rounding: some have no area, others next to none.
        triangles.push([a, b, a + (b - a) * third]);
        triangles.push([a, a + (b - a) * 0.5, b]);
        let thickness = 10_f32.powf(-7.0 * draws.unit());
        triangles.push([a, b, a + (b - a) * third + draws.direction() * thickness]);
    }
    let mesh = mesh_of(triangles);
    let mut rays = rays(&mut draws, 500, 1.0, Vec3::ZERO);
    // At the middles of the needles.
    for t in 0..mesh.triangles.len() as u32 {
        let [a, b, c] = mesh.corners(t).map(|p| p.as_vec3());
        let from = draws.direction() * 3.0;
        rays.push(Ray::new(from.as_dvec3(), (a + b + c) / 3.0 - from));
    }
    let tally = check("needles", &[&mesh], &rays);
    assert!(tally.hits > 50, "{}", tally.hits);
}

/// Corners on a grid of halves and rays along its lines: every comparison is a tie.
#[test]
fn rays_along_the_axes_through_a_grid() {
    let mut draws = PathSampler::new(4);
    let mut step = |n: usize| draws.below(n) as f32 * 0.5;
    let mesh = mesh_of((0..200).map(|_| [0; 3].map(|_| Vec3::new(step(5), step(5), step(5)))));
    let mut rays = Vec::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            for i in 0..81 {
                let mut origin = [0.25 * (i % 9) as f32, 0.25 * (i / 9) as f32, -1.0];
                if sign < 0.0 {
                    origin[2] = 3.0;
                }
                origin.rotate_right((axis + 1) % 3);
                let mut direction = [0.0, -0.0, sign];
                direction.rotate_right((axis + 1) % 3);
                rays.push(Ray::new(Vec3::from_array(origin).as_dvec3(), Vec3::from_array(direction)));
                direction[(axis + 1) % 3] = 0.5; // one zero is left
                rays.push(Ray::new(Vec3::from_array(origin).as_dvec3(), Vec3::from_array(direction)));
            }
        }
    }
    let tally = check("grid", &[&mesh], &rays);
    assert!(tally.hits > rays.len() / 3, "{} of {}", tally.hits, rays.len());
}

#[test]
fn rays_in_the_plane_of_a_triangle() {
    let flat = mesh_of([[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    let mut draws = PathSampler::new(5);
    let tilted = mesh_of([[draws.point(), draws.point(), draws.point()]]);
    for mesh in [&flat, &tilted] {
        let [a, b, c] = mesh.corners(0).map(|p| p.as_vec3());
        let rays: Vec<Ray> = (0..300)
            .map(|_| {
                let mut in_plane = || a + (b - a) * (4.0 * draws.unit() - 2.0) + (c - a) * (4.0 * draws.unit() - 2.0);
                let from = in_plane();
                Ray::new(from.as_dvec3(), in_plane() - from)
            })
            .collect();
        check("in the plane", &[mesh], &rays);
    }
}

/// From inside, every ray of a closed surface hits, whichever vertex or edge it goes through. Embree's robust mode promises
/// that for edges alone: about 1 in 1000 rays aimed at the very point of a vertex slips through (counted with 3.13).
#[test]
fn a_closed_mesh_has_no_leaks() {
    for scale in [1e-6, 1.0, 1e6] {
        let mesh = placed(&bumpy_sphere(24), scale, Vec3::ZERO);
        let mut draws = PathSampler::new(6);
        for (backend, query) in backends(&[&mesh]) {
            let leaks = |from: Vec3, to: Vec3| {
                let ray = Ray::new(from.as_dvec3(), to - from);
                let leaks = query.closest(&ray).is_none();
                assert_eq!(query.occluded(&ray), !leaks, "{}: {ray:?}", backend);
                leaks
            };
            let mut through_vertices = 0;
            for i in 0..4 {
                let from = if i == 0 { Vec3::ZERO } else { draws.point() * 0.4 * scale };
                through_vertices += mesh.positions.iter().filter(|p| leaks(from, p.as_vec3())).count();
                for t in 0..mesh.triangles.len() as u32 {
                    let [a, b, c] = mesh.corners(t).map(|p| p.as_vec3());
                    for (a, b) in [(a, b), (b, c), (c, a)] {
                        for s in [0.5, draws.unit()] {
                            let to = a + (b - a) * s;
                            assert!(!leaks(from, to), "{}: from {from} through an edge at {to}", backend);
                        }
                    }
                }
            }
            let most = if backend == EMBREE { 4 * mesh.positions.len() / 100 } else { 0 };
            assert!(through_vertices <= most, "{}: {through_vertices} through vertices", backend);
        }
    }
}

#[test]
fn the_interval_is_open_at_both_ends() {
    let mut draws = PathSampler::new(7);
    let mesh = soup(&mut draws, 300);
    let built = backends(&[&mesh]);
    let mut twice = 0;
    for ray in rays(&mut draws, 1000, 1.0, Vec3::ZERO) {
        for (backend, query) in &built {
            let Some(first) = query.closest(&ray) else { continue };
            let before = Ray { t_max: first.t, ..ray };
            assert_eq!(query.closest(&before), None, "{}: {ray:?}", backend);
            assert!(!query.occluded(&before), "{}: {ray:?}", backend);
            let beyond = Ray { t_min: first.t, ..ray };
            let second = query.closest(&beyond);
            assert!(second.is_none_or(|s| s.t > first.t), "{}: {ray:?} {first:?} {second:?}", backend);
            assert_eq!(query.occluded(&beyond), second.is_some(), "{}: {ray:?}", backend);
            twice += usize::from(second.is_some());
            // A hair wider and it is inside.
            let around = Ray { t_min: first.t * 0.999_99, t_max: first.t * 1.000_01, ..ray };
            assert!(query.closest(&around).is_some_and(|h| h.t == first.t) && query.occluded(&around));
        }
    }
    assert!(twice > 100, "{twice}");
}

#[test]
fn an_interval_that_ends_no_later_than_it_begins_is_empty() {
    let mesh = mesh_of([[Vec3::new(-1.0, -1.0, 1.0), Vec3::new(3.0, -1.0, 1.0), Vec3::new(-1.0, 3.0, 1.0)]]);
    for (backend, query) in backends(&[&mesh]) {
        for t_max in [0.0, -0.0, -f32::MIN_POSITIVE, -1.0, f32::NEG_INFINITY, f32::NAN] {
            for origin in [DVec3::ZERO, DVec3::Z, DVec3::Z * 2.0] {
                let rays = [Ray { t_max, ..Ray::new(origin, Vec3::Z) }; 20];
                let (mut hits, mut occluded) = ([None; 20], [false; 20]);
                query.closest_batch(&rays, &mut hits);
                query.occluded_batch(&rays, &mut occluded);
                let alone = (query.closest(&rays[0]), query.occluded(&rays[0]));
                assert_eq!((alone, hits, occluded), ((None, false), [None; 20], [false; 20]), "{backend}: {t_max}");
            }
        }
    }
}

#[test]
fn an_empty_scene_has_no_hits() {
    let empty = Mesh::default();
    let ray = Ray::new(DVec3::ZERO, Vec3::Z);
    for meshes in [&[][..], &[&empty], &[&empty, &empty]] {
        for (_, query) in backends(meshes) {
            assert!(query.closest(&ray).is_none() && !query.occluded(&ray));
        }
    }
}

/// A ray that leaves a surface does not meet it again, at any scale and ten thousand sizes from the origin.
#[test]
fn rays_that_leave_a_surface_do_not_hit_it() {
    let mut draws = PathSampler::new(8);
    let unit = soup(&mut draws, 200);
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        for offset in [0.0, 1e4] {
            let mesh = placed(&unit, scale, Vec3::new(-0.6, 1.0, 0.3) * offset * scale);
            for (backend, query) in backends(&[&mesh]) {
                for i in 0..4000 {
                    let triangle = draws.below(mesh.triangles.len()) as u32;
                    if mesh.area(triangle) == 0.0 {
                        continue;
                    }
                    let u = draws.unit();
                    let point = mesh.point(triangle, u.into(), (draws.unit() * (1.0 - u)).into());
                    let mut direction = draws.direction();
                    if i % 4 == 0 {
                        // Grazing: nearly all of the normal taken out.
                        direction -= point.n_geometric * (direction.dot(point.n_geometric) * 0.999);
                    }
                    let hit = query.closest(&Ray::new(point.leave(direction), direction));
                    assert!(
                        hit.is_none_or(|h| h.triangle != triangle),
                        "{} at {scale}, {offset} away: {hit:?} from {:?} into {direction}",
                        backend,
                        mesh.corners(triangle)
                    );
                }
            }
        }
    }
}

/// Both backends in one process give one answer, but for rays within rounding of an edge. Such rays are a share of about
/// perimeter times rounding over area, 7 rounding / edge length for compact triangles, once for each sheet passed.
#[test]
#[cfg(all(feature = "bvh", feature = "embree"))]
fn the_two_backends_agree() {
    let rings = 60;
    let mesh = bumpy_sphere(rings);
    let [bvh, embree] = [Backend::Bvh, Backend::Embree].map(|b| query::build(b, &[&mesh]).unwrap());
    let mut draws = PathSampler::new(9);
    let count = 100_000;
    let (mut hits, mut others, mut one_sided) = (0, 0, 0);
    let rounding = 2.0 * reference::ROUNDINGS * f64::from(f32::EPSILON) * 3.5; // both may err; 3.5 is the farthest corner
    for _ in 0..count {
        let (from, to) = (draws.direction() * 2.5 * draws.unit(), draws.point() * 0.8);
        let ray = Ray::new(from.as_dvec3(), (to - from).normalize());
        match (bvh.closest(&ray), embree.closest(&ray)) {
            (Some(a), Some(b)) if a.triangle == b.triangle => {
                let n = mesh.geometric_normal(a.triangle).dot(ray.direction).abs();
                assert!(f64::from((a.t - b.t).abs()) * f64::from(n.max(1e-3)) < rounding, "{a:?} {b:?} {ray:?}");
                hits += 1;
            }
            (Some(_), Some(_)) => others += 1,
            (None, None) => {}
            _ => one_sided += 1,
        }
        assert_eq!(bvh.occluded(&ray), bvh.closest(&ray).is_some());
    }
    let edge = std::f64::consts::PI / f64::from(rings);
    // Cells at the poles are thin: twice the share of compact ones. 6 standard errors of a count on top.
    let expected = 2.0 * 7.0 * rounding / edge * f64::from(count);
    let most = expected + 6.0 * expected.sqrt();
    println!("{hits} same, {others} other triangle, {one_sided} hit and miss; at most {most:.0}");
    assert!(hits > count / 2);
    assert!(f64::from(others + one_sided) < most, "{others} and {one_sided} of {count}, at most {most:.0}");
}

/// Queries from many threads are the queries from one.
#[test]
fn threads_do_not_disturb_each_other() {
    let mesh = bumpy_sphere(30);
    let mut draws = PathSampler::new(10);
    let rays = rays(&mut draws, 4000, 1.0, Vec3::ZERO);
    for (backend, query) in backends(&[&mesh]) {
        let alone: Vec<_> = rays.iter().map(|r| query.closest(r)).collect();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    let together: Vec<_> = rays.iter().map(|r| query.closest(r)).collect();
                    assert!(together == alone, "{}", backend);
                });
            }
        });
    }
}

/// Hits and misses against f64 on many rays: how many differ, and each only where a ray passes within rounding of a
/// silhouette.
fn against_f64(count: u32) {
    let mesh = bumpy_sphere(6);
    let meshes = [&mesh];
    let share = 1.0 / f64::from(count);
    for (backend, query) in backends(&meshes) {
        let mut draws = PathSampler::new(11);
        let (mut hits, mut others, mut one_sided) = (0, 0, 0);
        let mut batch: Vec<Ray> = Vec::with_capacity(1000);
        for _ in 0..count / 1000 {
            batch.clear();
            batch.extend((0..1000).map(|_| {
                let (from, to) = (draws.direction() * (0.2 + 2.0 * draws.unit()), draws.point());
                Ray::new(from.as_dvec3(), to - from)
            }));
            let (mut found, mut occluded) = (vec![None; batch.len()], vec![false; batch.len()]);
            query.closest_batch(&batch, &mut found);
            query.occluded_batch(&batch, &mut occluded);
            for ((ray, hit), occluded) in batch.iter().zip(&found).zip(occluded) {
                let nearest = nearest_in_f64(&mesh, ray);
                hits += u32::from(hit.is_some());
                assert_eq!(hit.is_some(), occluded, "{}: {ray:?}", backend);
                let same = match (hit, nearest) {
                    (Some(hit), Some((t, triangle))) if hit.triangle == triangle => {
                        (f64::from(hit.t) - t).abs() < 16.0 * f64::from(f32::EPSILON) * t.max(1.0)
                    }
                    (None, None) => true,
                    _ => false,
                };
                if same {
                    continue;
                }
                // Then the ray must be one on which f32 has a choice, and the answer one of those it may give.
                if let Err(wrong) = verdict(&examine(&meshes, ray), ray, hit.as_ref(), backend == EMBREE) {
                    panic!("{}: {ray:?}\nfound {hit:?}\n{wrong}", backend);
                }
                others += u32::from(hit.is_some() && nearest.is_some());
                one_sided += u32::from(hit.is_some() != nearest.is_some());
            }
        }
        println!(
            "{}: {count} rays, {hits} hits; other triangle or distance {others}, hit against miss {one_sided} ({:.1e})",
            backend,
            f64::from(one_sided) * share
        );
        assert!(hits > count / 2);
        // A ray in a million; six standard errors more for few rays.
        let expected = 1e-6 * f64::from(count);
        assert!(f64::from(one_sided) < expected + 6.0 * expected.sqrt(), "{}: {one_sided}", backend);
    }
}

#[test]
fn hits_and_misses_are_those_of_f64() {
    against_f64(100_000);
}

/// For the figures in docs/rays.md: in a release build half a minute.
#[test]
#[ignore = "a measurement"]
fn hits_and_misses_are_those_of_f64_ten_million_times() {
    against_f64(10_000_000);
}

/// Rays from within a closed mesh, half of them at points of edges: how many find a way out.
fn leaks(count: u32) {
    let mesh = bumpy_sphere(40);
    let query = backends(&[&mesh]);
    for (backend, query) in query {
        let mut draws = PathSampler::new(12);
        let mut leaks = 0;
        let mut batch: Vec<Ray> = Vec::with_capacity(1000);
        let mut hits = vec![None; 1000];
        for _ in 0..count / 1000 {
            batch.clear();
            let from = draws.point() * 0.4;
            batch.extend((0..1000).map(|i| {
                let direction = if i % 2 == 0 {
                    draws.direction()
                } else {
                    let [a, b, _] = mesh.corners(draws.below(mesh.triangles.len()) as u32).map(|p| p.as_vec3());
                    a + (b - a) * draws.unit() - from
                };
                Ray::new(from.as_dvec3(), direction)
            }));
            query.closest_batch(&batch, &mut hits);
            leaks += hits.iter().filter(|h| h.is_none()).count();
        }
        println!("{}: {leaks} of {count} rays leave a closed mesh", backend);
        assert_eq!(leaks, 0, "{}", backend);
    }
}

#[test]
fn a_million_rays_do_not_leave_a_closed_mesh() {
    leaks(1_000_000);
}

/// For the figures in docs/rays.md: in a release build a minute.
#[test]
#[ignore = "a measurement"]
fn a_hundred_million_rays_do_not_leave_a_closed_mesh() {
    leaks(100_000_000);
}

/// Batches of camera rays, which backends trace together, are the single rays: also at other scales, across the axes, and
/// with intervals that end before, on and behind the surface.
#[test]
fn batches_from_one_point_are_the_rays_alone() {
    for scale in [1e-6, 1.0, 1e6] {
        let mesh = placed(&bumpy_sphere(30), scale, Vec3::ZERO);
        let mut draws = PathSampler::new(13);
        let mut rays = Vec::new();
        for forward in [Vec3::Z, -Vec3::X, Vec3::new(1.0, 1.0, 0.9), Vec3::new(-0.3, -1.0, 0.4)] {
            let eye = forward * -2.0 * scale;
            let (right, up) = forward.any_orthonormal_pair();
            for i in 0..40 * 40 {
                let [x, y] = [i % 40, i / 40].map(|k| k as f32 * 0.04 - 0.8);
                let t_max = [f32::INFINITY, 1.0, scale, 1.5 * scale][i % 4];
                rays.push(Ray { t_max, ..Ray::new(eye.as_dvec3(), forward + right * x + up * y) });
            }
            // And as many without order.
            rays.extend((0..500).map(|_| Ray::new((draws.point() * scale).as_dvec3(), draws.direction())));
        }
        for (backend, query) in backends(&[&mesh]) {
            for length in [rays.len(), 1, 7, 100] {
                let (mut hits, mut occluded, mut ties) = (vec![None; length], vec![false; length], 0);
                query.closest_batch(&rays[..length], &mut hits);
                query.occluded_batch(&rays[..length], &mut occluded);
                for (i, ray) in rays[..length].iter().enumerate() {
                    let alone = query.closest(ray);
                    assert_eq!(occluded[i], alone.is_some(), "{} at {scale}: {ray:?}", backend);
                    if backend == EMBREE && hits[i] != alone {
                        // On a shared edge its packets may choose the other triangle.
                        ties += 1;
                        verdict(&examine(&[&mesh], ray), ray, hits[i].as_ref(), true).unwrap();
                    } else {
                        assert_eq!(hits[i], alone, "{} at {scale}: {ray:?}", backend);
                    }
                }
                assert!(ties <= length / 100, "{ties} of {length}");
            }
        }
    }
}
