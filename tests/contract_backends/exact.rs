//! Rays in f64 alone: what no backend in f32 could do.

use super::scenes::{PathSampler, soup};
use marmor::geometry::{Mesh, Precision};
use marmor::math::{DVec3, Vec3};
use marmor::query::{self, Backend, Ray};

/// A ray that leaves a surface does not meet it again: as in f32, with a bound that is half a billion times smaller.
#[test]
fn rays_that_leave_a_surface_do_not_hit_it() {
    let mut draws = PathSampler::new(14);
    for offset in [0.0, 1e3, 1e9] {
        let mut mesh = soup(&mut draws, 200);
        mesh.precision = Precision::Double;
        mesh.positions.iter_mut().for_each(|p| *p = *p * 1.1 + DVec3::new(-0.6, 1.0, 0.3) * offset);
        let query = query::exact(&[&mesh]);
        for i in 0..20_000 {
            let triangle = draws.below(mesh.triangles.len()) as u32;
            let u = f64::from(draws.unit());
            let point = mesh.point(triangle, u, f64::from(draws.unit()) * (1.0 - u));
            let mut direction = draws.direction();
            if i % 4 == 0 {
                direction -= point.n_geometric * (direction.dot(point.n_geometric) * 0.999);
            }
            let from = point.leave(direction);
            assert!(from.distance(point.x) <= 1e-14 * (2.0 + offset), "{from} {}", point.x);
            let hit = query.closest(&Ray::new(from, direction));
            assert!(hit.is_none_or(|h| h.triangle != triangle), "{offset} away: {hit:?} into {direction}");
        }
    }
}

/// Sheets that f32 cannot tell apart, seen from both sides, and what is found on them.
#[test]
fn sheets_are_told_apart_that_f32_cannot() {
    let mut draws = PathSampler::new(15);
    let corner = |x: f64, y: f64, z: f64| DVec3::new(1e4 * x, 1e4 * y, z + 3.0);
    let mut mesh = Mesh { precision: Precision::Double, ..Mesh::default() };
    for i in 0..20 {
        let z = f64::from(i) * 1e-7;
        let base = mesh.positions.len() as u32;
        mesh.positions.extend([corner(-1.0, -1.0, z), corner(1.0, -1.0, z), corner(1.0, 1.0, z), corner(-1.0, 1.0, z)]);
        mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    }
    let query = query::build(Backend::preferred(), &[&mesh]).unwrap();
    assert!(query.description().contains("double"), "{}", query.description());
    for _ in 0..2000 {
        let place = corner(2.0 * f64::from(draws.unit()) - 1.0, 2.0 * f64::from(draws.unit()) - 1.0, 0.0);
        let sheet = draws.below(19) as u32;
        let from = place.with_z(3.0 + (f64::from(sheet) + 0.5) * 1e-7);
        for (up, met) in [(1.0, sheet + 1), (-1.0, sheet)] {
            let hit = query.closest(&Ray::new(from, Vec3::new(0.3, -0.2, up))).unwrap();
            assert_eq!(hit.triangle / 2, met);
            let at = mesh.point(hit.triangle, hit.u, hit.v).x;
            assert!(at.distance(from) < 1e-7 && (at.z - mesh.corners(hit.triangle)[0].z).abs() < 1e-14, "{at} {from}");
        }
    }
}
