//! Better triangles on the same surface: vertices spread evenly, short edges collapsed, edges flipped, normals kept on
//! the side of their triangles. Closed manifold meshes stay so.

use std::collections::HashSet;

use marmor::math::DVec3;

use crate::mesh::{Mesh, angle_at, smallest_of_triangle};
use crate::polygonise::Field;

/// Triangles with a smaller angle [radians] are needles: about 3 degrees. Their normals mean nothing.
const NEEDLE: f64 = 0.05;

/// Moves each vertex half way to the mean of its neighbours, within the tangent plane, then back onto the surface.
pub fn spread(mesh: &mut Mesh, field: &impl Field, cell: f64) {
    let mut sums = vec![(DVec3::ZERO, 0.0); mesh.positions.len()];
    for t in &mesh.triangles {
        for k in 0..3 {
            // Each edge belongs to two triangles that run along it in opposite directions: every neighbour counts once.
            let (sum, count) = &mut sums[t[k] as usize];
            *sum += mesh.positions[t[(k + 1) % 3] as usize];
            *count += 1.0;
        }
    }
    for (p, (sum, count)) in mesh.positions.iter_mut().zip(sums) {
        let n = field.gradient(*p).normalize();
        let shift = (sum / count - *p) * 0.5;
        let mut moved = *p + shift - n * n.dot(shift);
        for _ in 0..2 {
            let g = field.gradient(moved);
            let step = g * (field.at(moved) / g.length_squared().max(0.1));
            moved -= step.clamp_length_max(0.25 * cell);
        }
        *p = moved;
    }
}

/// Draws the two ends of edges shorter than `shortest` [mm] together, where that neither pinches the surface nor turns a
/// triangle over.
pub fn collapse(mesh: &mut Mesh, shortest: f64) {
    let mut around = vec![Vec::new(); mesh.positions.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        triangle.iter().for_each(|i| around[*i as usize].push(t));
    }
    let neighbours = |mesh: &Mesh, v: u32| -> HashSet<u32> {
        around[v as usize].iter().flat_map(|t| mesh.triangles[*t]).filter(|i| *i != v).collect()
    };
    let mut locked = vec![false; mesh.positions.len()];
    let mut dropped = vec![false; mesh.triangles.len()];
    for t in 0..mesh.triangles.len() {
        for k in 0..3 {
            let (a, b) = (mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
            let [pa, pb] = [a, b].map(|v| mesh.positions[v as usize]);
            if a > b || pa.distance(pb) >= shortest || locked[a as usize] || locked[b as usize] {
                continue;
            }
            let (of_a, of_b) = (neighbours(mesh, a), neighbours(mesh, b));
            let shared: Vec<u32> = of_a.intersection(&of_b).copied().collect();
            // A third shared neighbour, or a corner with three triangles, would leave two triangles back to back.
            if shared.len() != 2 || shared.iter().any(|v| around[*v as usize].len() <= 3) {
                continue;
            }
            let middle = 0.5 * (pa + pb);
            let turns_over = around[a as usize].iter().chain(&around[b as usize]).any(|t| {
                let triangle = mesh.triangles[*t];
                let [p, q, r] = triangle.map(|i| if i == a || i == b { middle } else { mesh.positions[i as usize] });
                let both = triangle.contains(&a) && triangle.contains(&b);
                let old = mesh.scaled_normal(triangle);
                let new = (q - p).cross(r - p);
                let needle = smallest_of_triangle(mesh.corners(triangle)) < NEEDLE;
                !both && !needle && new.dot(old) <= 0.5 * new.length() * old.length()
            });
            if turns_over {
                continue;
            }
            mesh.positions[a as usize] = middle;
            for t in &around[b as usize] {
                let triangle = &mut mesh.triangles[*t];
                dropped[*t] |= triangle.contains(&a);
                triangle.iter_mut().filter(|i| **i == b).for_each(|i| *i = a);
            }
            // What lies around the new vertex has other triangles than `around` says: left for the next call.
            of_a.union(&of_b).chain([&a, &b]).for_each(|v| locked[*v as usize] = true);
        }
    }
    let mut keep = dropped.iter().map(|d| !d);
    mesh.triangles.retain(|_| keep.next().unwrap_or(true));
    mesh.drop_unused_vertices();
}

/// Flips edges whose two opposite angles exceed half a turn, where the surface is nearly flat or a needle goes away.
pub fn flip(mesh: &mut Mesh) {
    let mut halves = Vec::with_capacity(mesh.triangles.len() * 3);
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            halves.push((a.min(b), a.max(b), t, triangle[(k + 2) % 3]));
        }
    }
    halves.sort_unstable();
    let mut edges: HashSet<(u32, u32)> = halves.iter().map(|h| (h.0, h.1)).collect();
    let mut touched = vec![false; mesh.triangles.len()];
    for pair in halves.chunks_exact(2) {
        let [(a, b, s, c), (_, _, t, d)] = [pair[0], pair[1]];
        if touched[s] || touched[t] || edges.contains(&(c.min(d), c.max(d))) {
            continue;
        }
        let [pa, pb, pc, pd] = [a, b, c, d].map(|v| mesh.positions[v as usize]);
        if angle_at(pc, pa, pb) + angle_at(pd, pa, pb) <= std::f64::consts::PI + 1e-6 {
            continue;
        }
        // `s` may run along the edge as b, a: keep its sense.
        let runs_ab = (0..3).any(|k| mesh.triangles[s][k] == a && mesh.triangles[s][(k + 1) % 3] == b);
        let (first, second) = if runs_ab { ([a, d, c], [d, b, c]) } else { ([a, c, d], [d, c, b]) };
        // Weighted by area, so that a needle's own direction, which means nothing, counts for nothing.
        let [old_s, old_t] = [s, t].map(|t| mesh.scaled_normal(mesh.triangles[t]));
        let old = (old_s + old_t).normalize_or_zero();
        let turn = |t: [u32; 3]| mesh.scaled_normal(t).normalize_or_zero().dot(old);
        let needle = [s, t].iter().any(|t| smallest_of_triangle(mesh.corners(mesh.triangles[*t])) < NEEDLE);
        let bent = old_s.normalize_or_zero().dot(old_t.normalize_or_zero()) < 0.8;
        let least = if needle { 0.3 } else { 0.9 };
        if (needle || !bent) && turn(first) > least && turn(second) > least {
            edges.remove(&(a, b));
            edges.insert((c.min(d), c.max(d)));
            mesh.triangles[s] = first;
            mesh.triangles[t] = second;
            touched[s] = true;
            touched[t] = true;
        }
    }
}

/// In a crease the gradient at a vertex can point behind one of its triangles: that corner takes the triangle's own
/// normal, so that shading never turns its back on the surface.
pub fn align_normals(mesh: &mut Mesh) {
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let n = mesh.scaled_normal(*triangle).normalize_or_zero();
        for (k, i) in triangle.iter().enumerate() {
            if mesh.normals[*i as usize].dot(n) < 0.1 {
                mesh.normal_triangles[t][k] = mesh.normals.len() as u32;
                mesh.normals.push(n);
            }
        }
    }
}
