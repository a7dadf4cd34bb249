//! The backend in pure Rust: a tree of eight children a node over packs of eight triangles.
//! Read first: `walk.rs`, one ray through the tree; `triangle.rs` has the test of a pack, `node.rs` that of a node's boxes,
//! `coherent.rs` takes many rays at once, `build.rs` makes the tree.
//!
//! A ray's answer is the least of (distance, place in the tree) over all triangles that it meets, and no distance is less
//! than that at which the ray enters the triangle's box. So it depends neither on the order in which boxes are visited, nor
//! on the instruction set, nor on whether rays come alone or in batches.

mod build;
mod coherent;
mod fold;
mod node;
mod split;
#[allow(unsafe_code)] // reads what it has written into memory that was not cleared; nothing else
mod stack;
mod triangle;
mod walk;

use super::{Hit, Ray, RayQuery};
use crate::geometry::Mesh;
use crate::math::{Lanes, Level};
use build::Tree;
use coherent::ClosestBatch;
use walk::{Closest, Found, Occluded};

/// Meshes, copied into a tree.
pub struct Bvh {
    tree: Tree,
    lanes: Lanes,
}

impl Bvh {
    /// Copies the meshes into a tree.
    pub fn new(meshes: &[&Mesh]) -> Self {
        Self::at(meshes, Level::best())
    }

    /// The same, with an instruction set of choice.
    fn at(meshes: &[&Mesh], level: Level) -> Self {
        Self { tree: Tree::new(meshes), lanes: Lanes::at(level) }
    }

    fn hit(&self, found: &Found) -> Option<Hit> {
        found.is_hit().then(|| {
            let owner = self.tree.owners[found.place.0 as usize][found.place.1 as usize];
            Hit { t: found.t, mesh: owner.mesh, triangle: owner.triangle, u: found.u.into(), v: found.v.into() }
        })
    }
}

impl RayQuery for Bvh {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.hit(&self.lanes.run(Closest { tree: &self.tree, ray }))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let mut out = [false];
        self.lanes.run(Occluded { tree: &self.tree, rays: std::slice::from_ref(ray), out: &mut out });
        out[0]
    }

    fn closest_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let give = |i: usize, found: &Found| hits[i] = self.hit(found);
        self.lanes.run(ClosestBatch { tree: &self.tree, rays, give });
    }

    fn occluded_batch(&self, rays: &[Ray], out: &mut [bool]) {
        self.lanes.run(Occluded { tree: &self.tree, rays, out });
    }

    fn description(&self) -> String {
        "bvh (eight-wide, watertight)".to_string()
    }

    fn bytes(&self) -> Option<usize> {
        Some(self.tree.bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Vec3, hash, unit_f32};

    fn point(i: u64) -> Vec3 {
        let draw = |d: u64| unit_f32((hash(3 * i + d + 1) >> 32) as u32);
        Vec3::new(draw(0), draw(1), draw(2))
    }

    fn mesh_of(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Mesh {
        let mut mesh = Mesh::default();
        for corners in triangles {
            let base = mesh.positions.len() as u32;
            mesh.positions.extend(corners.map(|p| p.as_dvec3()));
            mesh.triangles.push([base, base + 1, base + 2]);
        }
        mesh
    }

    #[test]
    fn nothing_is_hit_where_nothing_has_area() {
        let ray = Ray::new(DVec3::new(0.5, 0.0, -1.0), Vec3::Z);
        for mesh in [Mesh::default(), mesh_of([[Vec3::ONE; 3], [Vec3::ZERO, Vec3::X, Vec3::X * 2.0]])] {
            let bvh = Bvh::new(&[&mesh]);
            assert!(bvh.closest(&ray).is_none() && !bvh.occluded(&ray));
        }
        assert!(Bvh::new(&[]).closest(&ray).is_none());
    }

    /// From coordinates whose areas only f64 can hold to those whose volumes f32 cannot.
    #[test]
    fn triangles_of_any_size_are_hit_at_the_same_place() {
        let corners = |i: u64, s: f32| [0, 1, 2].map(|c| point(3 * i + c) * s);
        let reference = Bvh::new(&[&mesh_of((0..40).map(|i| corners(i, 1.0)))]);
        for exponent in -30..=15 {
            let s = 10_f32.powi(exponent);
            let scaled = Bvh::new(&[&mesh_of((0..40).map(|i| corners(i, s)))]);
            let mut hits = 0;
            for i in 0..200 {
                let (a, b) = (point(1000 + i) * 3.0 - Vec3::ONE, point(2000 + i));
                let found = scaled.closest(&Ray::new((a * s).as_dvec3(), b * s - a * s));
                let expected = reference.closest(&Ray::new(a.as_dvec3(), b - a));
                hits += u32::from(expected.is_some());
                // Rounding of the scaled points moves hits a little, but none of these over an edge.
                assert_eq!(found.map(|h| h.triangle), expected.map(|h| h.triangle), "10^{exponent}, ray {i}");
                if let (Some(found), Some(expected)) = (found, expected) {
                    assert!((found.t - expected.t).abs() < 1e-4 && (found.u - expected.u).abs() < 1e-3, "{found:?}");
                }
            }
            assert!(hits > 50, "{hits}");
        }
    }

    #[test]
    fn one_hundred_thousand_equal_triangles_are_one_hit() {
        let triangles = vec![[0, 1, 2]; 100_000];
        let bvh = Bvh::new(&[&Mesh { positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y], triangles, ..Mesh::default() }]);
        assert!(bvh.tree.stack_needed <= 96, "{}", bvh.tree.stack_needed);
        let down = |x: f64| Ray::new(DVec3::new(x, x, 1.0), -Vec3::Z);
        let hit = bvh.closest(&down(0.25)).unwrap();
        assert_eq!((hit.t, hit.u, hit.v), (1.0, 0.25, 0.25));
        assert!(bvh.occluded(&down(0.25)) && !bvh.occluded(&down(0.75)));
    }

    /// Costs all alike are the worst case of clustering by nearest neighbours.
    #[test]
    fn a_strip_of_equal_steps_makes_a_shallow_tree() {
        let step = |i: u32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + Vec3::X * i as f32);
        let bvh = Bvh::new(&[&mesh_of((0..20_000).map(step))]);
        assert!(bvh.tree.stack_needed <= 96, "{}", bvh.tree.stack_needed);
        for i in (0..20_000).step_by(37) {
            let hit = bvh.closest(&Ray::new(DVec3::new(f64::from(i) + 0.25, 0.25, 2.0), -Vec3::Z)).unwrap();
            assert_eq!(hit.triangle, i);
        }
    }

    /// Triangles that shrink by half at each step: a deep tree for any builder.
    #[test]
    fn nested_triangles_are_all_found() {
        let nest = |i: i32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * 0.5_f32.powi(i) + Vec3::Z * i as f32);
        let bvh = Bvh::new(&[&mesh_of((0..100).map(nest))]);
        for i in 0..100 {
            let x = 0.25 * 0.5_f64.powi(i);
            let hit = bvh.closest(&Ray::new(DVec3::new(x, x, f64::from(i) + 0.5), -Vec3::Z)).unwrap();
            assert_eq!(hit.triangle, i as u32);
        }
    }

    /// A camera before a grid of triangles that share corners, its rays through the corners and between them.
    fn camera(count: u32) -> Vec<Ray> {
        let eye = Vec3::new(2.0, 2.0, 32.0);
        let at =
            |i: u32| Vec3::new((i % count) as f32, (i / count) as f32, 0.0) * (4.4 / count as f32) - Vec3::splat(0.2);
        (0..count * count).map(|i| Ray::new(eye.as_dvec3(), at(i).with_z(0.0) - eye)).collect()
    }

    /// Where it is flat the camera's rays through its corners are exact: their triangles are met at one distance.
    fn grid(height: f32) -> Mesh {
        let corner = |i: u32| Vec3::new((i % 17) as f32, (i / 17) as f32, 0.0) * 0.25;
        let raised = |p: Vec3| p.with_z(height * (3.0 * p.x).sin() * (2.0 * p.y).cos());
        let cell = |i: u32| i / 16 * 17 + i % 16;
        let triangles = (0..256).flat_map(|i| {
            let a = cell(i);
            [[a, a + 1, a + 17], [a + 1, a + 18, a + 17]]
        });
        let positions = (0..289).map(|i| raised(corner(i)).as_dvec3()).collect();
        Mesh { positions, triangles: triangles.collect(), ..Mesh::default() }
    }

    /// Large triangles across each other in one plane: their distances differ by rounding alone.
    fn sheets() -> Mesh {
        let corner = |i: u64| (point(i) * 6.0 - Vec3::ONE).with_z(1.0 / 3.0);
        mesh_of((0..300).map(|i| [corner(3 * i), corner(3 * i + 1), corner(3 * i + 2)]))
    }

    /// Alone and in batches, on every instruction set, rays find the same to the bit: also those through shared corners or
    /// through many triangles in one place, which are met at one distance.
    #[test]
    fn neither_batches_nor_instruction_sets_change_an_answer() {
        let (grid, flat, sheets) = (grid(0.3), grid(0.0), sheets());
        for meshes in [vec![&grid], vec![&flat], vec![&grid; 20], vec![&sheets]] {
            let baseline = Bvh::at(&meshes, Level::Baseline);
            let mut rays = camera(45);
            let from = rays[0].origin;
            rays.extend(grid.positions.iter().map(|&p| Ray::new(from, (p - from).as_vec3())));
            // In one quarter, so that they go together.
            let quarter = flat.positions.iter().filter(|p| p.x < from.x && p.y < from.y);
            rays.extend(quarter.map(|&p| Ray::new(from, (p - from).as_vec3())));
            // Intervals that end on the surface, before it and behind.
            let ends = [0.5, 1.0, 1.5].iter().cycle();
            let ends: Vec<Ray> = rays.iter().zip(ends).map(|(r, &t_max)| Ray { t_max, ..*r }).collect();
            rays.extend(ends);
            rays.extend((0..500).map(|i| Ray::new(point(i).as_dvec3() * 4.0, point(1000 + i) - point(2000 + i))));
            let alone: Vec<Option<Hit>> = rays.iter().map(|r| baseline.closest(r)).collect();
            let hits = alone.iter().filter(|h| h.is_some()).count();
            assert!(hits > 2000 && hits < rays.len() - 200, "{hits} of {}", rays.len());
            for level in Level::available() {
                let bvh = Bvh::at(&meshes, level);
                let (mut batch, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
                bvh.closest_batch(&rays, &mut batch);
                bvh.occluded_batch(&rays, &mut occluded);
                for (i, ray) in rays.iter().enumerate() {
                    assert_eq!((batch[i], bvh.closest(ray)), (alone[i], alone[i]), "{level:?}, ray {i}");
                    let hit = alone[i].is_some();
                    assert_eq!((occluded[i], bvh.occluded(ray)), (hit, hit), "{level:?}, ray {i}");
                }
            }
        }
    }
}
