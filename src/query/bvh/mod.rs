//! The backend in pure Rust: a tree of four children a node over packs of four triangles.
//! Read first: this file, which walks the tree; `triangle.rs` has the test of a pack, `node.rs` that of a node's boxes,
//! `build.rs` makes the tree.

mod build;
mod node;
mod triangle;

use super::{Hit, Ray, RayQuery};
use crate::geometry::Mesh;
use build::Tree;
use node::{Child, NodeRay, widen};
use triangle::TriangleRay;

/// Entries of the two traversal stacks: common trees need less than the small one, and the builder makes none that needs
/// more than the large one.
const SMALL_STACK: usize = 64;
const LARGE_STACK: usize = 256;

/// Meshes, copied into a tree.
pub struct Bvh {
    tree: Tree,
}

/// The best hit so far, by its place in the tree.
#[derive(Clone, Copy)]
struct Found {
    t: f32,
    pack: u32,
    lane: usize,
    u: f32,
    v: f32,
}

impl Bvh {
    /// Copies the meshes into a tree.
    pub fn new(meshes: &[&Mesh]) -> Self {
        Self { tree: Tree::new(meshes, LARGE_STACK) }
    }

    /// The nearest hit, or with `ANY` the first that comes along.
    #[inline]
    fn find<const ANY: bool>(&self, ray: &Ray) -> Option<Found> {
        if self.tree.stack_needed <= SMALL_STACK {
            self.walk::<ANY, SMALL_STACK>(ray)
        } else {
            self.walk::<ANY, LARGE_STACK>(ray)
        }
    }

    fn walk<const ANY: bool, const STACK: usize>(&self, ray: &Ray) -> Option<Found> {
        let tree = &self.tree;
        let mut node = tree.nodes.first()?;
        let (node_ray, triangle_ray) = (NodeRay::new(ray), TriangleRay::new(ray));
        let mut t_max = ray.t_max;
        let mut found = None;
        // Children still to visit, with the distance at which the ray enters them.
        let mut stack = [(0_u32, 0.0_f32); STACK];
        let mut waiting = 0;
        loop {
            let entered = node.enter(&node_ray, t_max);
            if ANY {
                entered.push(&mut stack, &mut waiting);
            } else {
                entered.sorted().push(&mut stack, &mut waiting);
            }
            // The leaves up to the next inner node.
            node = loop {
                if waiting == 0 {
                    return found;
                }
                waiting -= 1;
                let (child, enters) = stack[waiting];
                if enters > widen(t_max) {
                    continue;
                }
                match Child::from_bits(child) {
                    Child::Inner(index) => break &tree.nodes[index as usize],
                    Child::Leaf(pack) => {
                        if let Some(hit) = tree.packs[pack as usize].closest(&triangle_ray, ray.t_min, t_max) {
                            t_max = hit.t;
                            found = Some(Found { t: hit.t, pack, lane: hit.lane, u: hit.u, v: hit.v });
                            if ANY {
                                return found;
                            }
                        }
                    }
                }
            };
        }
    }
}

impl RayQuery for Bvh {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let found = self.find::<false>(ray)?;
        let owner = self.tree.owners[found.pack as usize][found.lane];
        Some(Hit { t: found.t, mesh: owner.mesh, triangle: owner.triangle, u: found.u, v: found.v })
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.find::<true>(ray).is_some()
    }

    fn description(&self) -> String {
        "bvh (four-wide, watertight)".to_string()
    }

    fn bytes(&self) -> Option<usize> {
        Some(self.tree.bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Vec3, hash, unit_f32};

    fn point(i: u64) -> Vec3 {
        let draw = |d: u64| unit_f32((hash(3 * i + d + 1) >> 32) as u32);
        Vec3::new(draw(0), draw(1), draw(2))
    }

    fn mesh_of(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Mesh {
        let mut mesh = Mesh::default();
        for corners in triangles {
            let base = mesh.positions.len() as u32;
            mesh.positions.extend(corners);
            mesh.triangles.push([base, base + 1, base + 2]);
        }
        mesh
    }

    #[test]
    fn nothing_is_hit_where_nothing_has_area() {
        let ray = Ray::new(Vec3::new(0.5, 0.0, -1.0), Vec3::Z);
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
                let found = scaled.closest(&Ray::new(a * s, b * s - a * s));
                let expected = reference.closest(&Ray::new(a, b - a));
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
        let bvh = Bvh::new(&[&Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles, normals: None }]);
        assert!(bvh.tree.stack_needed <= LARGE_STACK, "{}", bvh.tree.stack_needed);
        let down = |x: f32| Ray::new(Vec3::new(x, x, 1.0), -Vec3::Z);
        let hit = bvh.closest(&down(0.25)).unwrap();
        assert_eq!((hit.t, hit.u, hit.v), (1.0, 0.25, 0.25));
        assert!(bvh.occluded(&down(0.25)) && !bvh.occluded(&down(0.75)));
    }

    /// Costs all alike are the worst case of clustering by nearest neighbours.
    #[test]
    fn a_strip_of_equal_steps_makes_a_shallow_tree() {
        let step = |i: u32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + Vec3::X * i as f32);
        let bvh = Bvh::new(&[&mesh_of((0..20_000).map(step))]);
        assert!(bvh.tree.stack_needed <= SMALL_STACK, "{}", bvh.tree.stack_needed);
        for i in (0..20_000).step_by(37) {
            let hit = bvh.closest(&Ray::new(Vec3::new(i as f32 + 0.25, 0.25, 2.0), -Vec3::Z)).unwrap();
            assert_eq!(hit.triangle, i);
        }
    }

    /// Triangles that shrink by half at each step: a deep tree for any builder.
    #[test]
    fn nested_triangles_are_all_found() {
        let nest = |i: i32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * 0.5_f32.powi(i) + Vec3::Z * i as f32);
        let bvh = Bvh::new(&[&mesh_of((0..100).map(nest))]);
        for i in 0..100 {
            let x = 0.25 * 0.5_f32.powi(i);
            let hit = bvh.closest(&Ray::new(Vec3::new(x, x, i as f32 + 0.5), -Vec3::Z)).unwrap();
            assert_eq!(hit.triangle, i as u32);
        }
    }
}
