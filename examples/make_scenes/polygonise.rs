//! From a signed field to a closed mesh: marching cubes whose cells are worked out instead of looked up, then
//! rounds of `improve` until the triangles are well shaped.

use std::collections::HashMap;

use marmor::math::DVec3;

use crate::improve;
use crate::mesh::{Mesh, smallest_of_triangle};

/// A solid: negative inside; near the surface about the distance [mm].
pub trait Field {
    /// The field's value at a point [mm].
    fn at(&self, p: DVec3) -> f64;

    /// Two opposite corners of a box that holds the solid with room to spare [mm].
    fn bounds(&self) -> (DVec3, DVec3);

    /// Gradient from the values at the corners of a small tetrahedron.
    fn gradient(&self, p: DVec3) -> DVec3 {
        const STEP: f64 = 0.02;
        const CORNERS: [DVec3; 4] = [
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::new(1.0, -1.0, -1.0),
            DVec3::new(-1.0, 1.0, -1.0),
            DVec3::new(-1.0, -1.0, 1.0),
        ];
        CORNERS.iter().map(|c| *c * self.at(p + *c * STEP)).sum::<DVec3>() / (4.0 * STEP)
    }
}

/// Rounds of improvement; more of them hardly change the smallest angles.
const ROUNDS: usize = 8;

/// A closed, manifold mesh of the surface where the field is zero, with cells of the given edge [mm] and the
/// field's gradient as normals.
pub fn polygonise(field: &impl Field, cell: f64) -> Mesh {
    let mut mesh = marching_cubes(&Grid::sample(field, cell));
    mesh.keep_largest_part();
    for _ in 0..ROUNDS {
        improve::spread(&mut mesh, field, cell);
        improve::collapse(&mut mesh, 0.35 * cell);
        improve::flip(&mut mesh);
    }
    mesh.normals = mesh.positions.iter().map(|p| field.gradient(*p).normalize()).collect();
    mesh.normal_triangles.clone_from(&mesh.triangles);
    improve::align_normals(&mut mesh);
    mesh
}

/// Field values on the corners of a regular grid.
struct Grid {
    origin: DVec3,
    cell: f64,
    size: [usize; 3],
    values: Vec<f64>,
}

/// Corners of a block, along one axis, that are skipped together when the surface is far away.
const BLOCK: usize = 4;

impl Grid {
    fn sample(field: &impl Field, cell: f64) -> Self {
        let (lo, hi) = field.bounds();
        let size = ((hi - lo) / cell).to_array().map(|n| (n.ceil() as usize + 1).next_multiple_of(BLOCK));
        let mut grid = Self { origin: lo, cell, size, values: vec![0.0; size[0] * size[1] * size[2]] };
        // The fields grow at most twice as fast as the distance.
        let reach = 2.0 * cell * (BLOCK - 1) as f64 * 0.5 * 3f64.sqrt();
        let middle = DVec3::splat((BLOCK - 1) as f64 * 0.5);
        for k in (0..size[2]).step_by(BLOCK) {
            for j in (0..size[1]).step_by(BLOCK) {
                for i in (0..size[0]).step_by(BLOCK) {
                    let centre = field.at(grid.point(DVec3::new(i as f64, j as f64, k as f64) + middle));
                    for n in 0..BLOCK * BLOCK * BLOCK {
                        let at = [i + n % BLOCK, j + n / BLOCK % BLOCK, k + n / (BLOCK * BLOCK)];
                        let p = grid.point(DVec3::from_array(at.map(|v| v as f64)));
                        let index = grid.index(at);
                        grid.values[index] = if centre.abs() > reach { centre } else { field.at(p) };
                    }
                }
            }
        }
        grid
    }

    fn point(&self, at: DVec3) -> DVec3 {
        self.origin + at * self.cell
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.size[1] + j) * self.size[0] + i
    }

    fn inside(&self, at: [usize; 3]) -> bool {
        self.values[self.index(at)] < 0.0
    }

    /// Where the surface crosses the edge between two neighbouring corners.
    fn crossing(&self, a: [usize; 3], b: [usize; 3]) -> DVec3 {
        let (fa, fb) = (self.values[self.index(a)], self.values[self.index(b)]);
        let [pa, pb] = [a, b].map(|at| self.point(DVec3::from_array(at.map(|v| v as f64))));
        pa.lerp(pb, (fa / (fa - fb)).clamp(0.02, 0.98))
    }
}

/// The six faces of a cell: corners as bit sets (1: x, 2: y, 4: z), counter-clockwise seen from outside.
const FACES: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Marching cubes without a table. On each face of a cell, walked around, every run of inside corners is cut off by
/// one segment from where the run is entered to where it is left; the neighbour walks the face the other way and
/// gets the same segments reversed, so the surface closes and is oriented. Segments join to loops, loops are filled.
fn marching_cubes(grid: &Grid) -> Mesh {
    let mut mesh = Mesh::default();
    let mut vertex_on: HashMap<(usize, usize), u32> = HashMap::new();
    let [nx, ny, nz] = grid.size;
    for k in 0..nz - 1 {
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                let corners: [[usize; 3]; 8] =
                    std::array::from_fn(|c| [i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)]);
                let inside = corners.map(|c| grid.inside(c));
                if inside.iter().all(|v| *v == inside[0]) {
                    continue;
                }
                let (mut segments, ambiguous) = segments_of_cell(&inside);
                while let Some((first, mut end)) = segments.pop() {
                    let mut edges = vec![first];
                    while end != first {
                        edges.push(end);
                        let at = segments.iter().position(|s| s.0 == end).expect("each crossing starts one segment");
                        end = segments.swap_remove(at).1;
                    }
                    let ring: Vec<u32> = edges
                        .iter()
                        .map(|(a, b)| {
                            let key = (grid.index(corners[*a]), grid.index(corners[*b]));
                            *vertex_on
                                .entry(key)
                                .or_insert_with(|| mesh.vertex(grid.crossing(corners[*a], corners[*b])))
                        })
                        .collect();
                    fill(&mut mesh, &ring, ambiguous);
                }
            }
        }
    }
    mesh
}

/// An edge of a cell by its two corners, the lower first.
type Edge = (usize, usize);

/// The segments on all faces of a cell, and whether a face is crossed four times.
fn segments_of_cell(inside: &[bool; 8]) -> (Vec<(Edge, Edge)>, bool) {
    let mut segments = Vec::with_capacity(12);
    let mut ambiguous = false;
    for face in FACES {
        let step = |n: usize| (face[n % 4], face[(n + 1) % 4]);
        let edge = |(a, b): (usize, usize)| (a.min(b), a.max(b));
        let mut entries = 0;
        for n in 0..4 {
            let (a, b) = step(n);
            if !inside[a] && inside[b] {
                entries += 1;
                let out = (1..4).find(|m| !inside[step(n + m).1]).expect("the walk ends at the outside corner a");
                segments.push((edge((a, b)), edge(step(n + out))));
            }
        }
        ambiguous |= entries == 2;
    }
    (segments, ambiguous)
}

/// Fills a loop with triangles: a fan from the vertex that gives the best angles. Where a face is crossed four times a
/// diagonal could lie in that face and meet the neighbour's: there the fan starts from a new vertex in the middle.
fn fill(mesh: &mut Mesh, ring: &[u32], ambiguous: bool) {
    let n = ring.len();
    if n > 3 && ambiguous {
        let middle = ring.iter().map(|v| mesh.positions[*v as usize]).sum::<DVec3>() / n as f64;
        let middle = mesh.vertex(middle);
        mesh.triangles.extend((0..n).map(|i| [middle, ring[i], ring[(i + 1) % n]]));
        return;
    }
    let fan = |start: usize| (1..n - 1).map(move |i| [ring[start], ring[(start + i) % n], ring[(start + i + 1) % n]]);
    let quality =
        |start: usize| fan(start).map(|t| smallest_of_triangle(mesh.corners(t))).fold(f64::INFINITY, f64::min);
    let best = (0..n).max_by(|a, b| quality(*a).total_cmp(&quality(*b))).unwrap_or(0);
    mesh.triangles.extend(fan(best));
}
