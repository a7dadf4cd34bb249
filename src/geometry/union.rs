//! The surface of a union: what of the faces of a solid bounds the union of its parts, and what lies inside it.
//!
//! Decided at points by the winding number of all parts, a gap before the face: up to that gap surfaces count as one place, so that
//! faces in contact are inside and faces beside a wider gap are not. Faces that come near no other are decided once.

use super::solid::{Face, Solid};
use super::winding::distance;
use crate::math::DVec3;
use rayon::prelude::*;

/// A solid whose closed parts overlap, touch or lie in one another.
pub struct Union {
    solid: Solid,
    /// Surfaces nearer than this are in one place \[unit\].
    gap: f64,
    /// Number of the face of each triangle, and how much of it bounds the union.
    faces: Vec<(u32, Side)>,
}

/// Pairs of faces that a task looks at, at most.
const MOST_PAIRS: usize = 1 << 22;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    /// All of it.
    Outer,
    /// Nothing.
    Inner,
    /// It comes near another face: each point by itself.
    Mixed,
}

impl Union {
    /// Of the parts of `solid`, which is made of so many `triangles`; surfaces nearer than `gap` [unit] are in one place.
    pub fn new(solid: Solid, triangles: usize, gap: f64) -> Self {
        let near = |task: &(u32, u32)| {
            let (mut near, mut seen) = (Vec::new(), 0);
            solid.tree.pairs(&solid.tree, *task, gap as f32, |i, j| {
                seen += 1;
                if solid.may_meet(i, j, gap) {
                    near.extend([i, j]);
                }
                seen > MOST_PAIRS
            });
            (seen <= MOST_PAIRS).then_some(near)
        };
        let tasks = solid.tree.tasks(&solid.tree, gap as f32);
        // With too many faces in one place to look at, points are looked at one by one.
        let near: Option<Vec<Vec<u32>>> = tasks.par_iter().map(near).collect();
        let mut mixed = vec![near.is_none(); solid.faces.len()];
        near.into_iter().flatten().flatten().for_each(|i| mixed[i as usize] = true);
        let side = |(face, mixed): (&Face, &bool)| {
            let [a, b, c] = face.corners;
            match () {
                () if *mixed => Side::Mixed,
                () if is_inside(&solid, face, a * 0.37 + b * 0.29 + c * 0.34, gap) => Side::Inner,
                () => Side::Outer,
            }
        };
        let sides: Vec<Side> = solid.faces.par_iter().zip(&mixed).map(side).collect();
        // What is no face has no area, or the corners of another.
        let mut faces = vec![(u32::MAX, Side::Outer); triangles];
        for (i, (face, side)) in (0_u32..).zip(solid.faces.iter().zip(sides)) {
            faces[face.triangle as usize] = (i, side);
        }
        Self { solid, gap, faces }
    }

    /// Surfaces nearer than this are in one place \[unit\].
    pub fn gap(&self) -> f64 {
        self.gap
    }

    /// Whether `x`, a point of `triangle`, lies inside the union: light there meets no surface.
    pub fn hides(&self, triangle: u32, x: DVec3) -> bool {
        let (face, side) = self.faces[triangle as usize];
        match side {
            Side::Outer => false,
            Side::Inner => true,
            Side::Mixed => is_inside(&self.solid, &self.solid.faces[face as usize], x, self.gap),
        }
    }

    /// Whether `x`, a point of `triangle`, is a point of the union's surface, and the one that counts where faces lie in each other.
    pub fn bears(&self, triangle: u32, x: DVec3) -> bool {
        let (face, side) = self.faces[triangle as usize];
        side == Side::Outer || side == Side::Mixed && !self.hides(triangle, x) && self.is_first(face, x)
    }

    /// Whether no face of an earlier part lies there and looks the same way.
    fn is_first(&self, face: u32, x: DVec3) -> bool {
        let own = &self.solid.faces[face as usize];
        let n = own.scaled_normal().normalize_or_zero();
        let (mut first, reach) = (true, n * self.gap);
        self.solid.tree.along(x - reach, x + reach, |i| {
            let other = &self.solid.faces[i as usize];
            let same_way = n.dot(other.scaled_normal().normalize_or_zero()) > 0.5;
            first &= !(other.part < own.part && same_way && distance(other, x) <= self.gap);
        });
        first
    }
}

/// Whether the parts of `solid` wind around the place before `face` at `x`.
fn is_inside(solid: &Solid, face: &Face, x: DVec3, gap: f64) -> bool {
    let before = x + face.scaled_normal().normalize_or_zero() * gap;
    // On a surface again: at a seam no wider than the gap.
    solid.winding(before, |_| true).is_none_or(|winding| winding != 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::test_shapes::{cuboid, joined};
    use crate::geometry::{AreaTable, Mesh, RawMesh, sphere};
    use crate::math::{hash, unit_f32, unit_f64};

    const GAP: f64 = 1e-6;

    /// Area that bears light, and area that is hidden, by `n` points, with the area of all.
    fn areas(mesh: &RawMesh, n: u64) -> [f64; 3] {
        let mesh: Mesh = mesh.recentred(DVec3::ZERO);
        let (union, table) = (Union::new(Solid::new(&mesh), mesh.triangles.len(), GAP), AreaTable::new(&mesh).unwrap());
        let (mut bears, mut hides) = (0, 0);
        for i in 0..n {
            let draw = |d: u64| (hash(i * 3 + d + 1) >> 32) as u32;
            let at = table.sample(unit_f64(draw(0)), [unit_f32(draw(1)), unit_f32(draw(2))]);
            let x = mesh.point(at.triangle, at.u, at.v).x;
            bears += u64::from(union.bears(at.triangle, x));
            hides += u64::from(union.hides(at.triangle, x));
        }
        let area = table.area();
        [bears, hides]
            .map(|k| k as f64 / n as f64 * area)
            .into_iter()
            .chain([area])
            .collect::<Vec<_>>()
            .try_into()
            .unwrap()
    }

    fn cube(x: f64, half: f64, n: u32) -> RawMesh {
        cuboid(DVec3::new(x, 0.0, 0.0), DVec3::splat(half), n, n.is_multiple_of(2))
    }

    /// Boxes by their corners: overlapping, flush, touching over a face or a part of it, nested, with a cavity.
    #[test]
    fn the_area_of_a_union_is_that_of_its_shape() {
        let n = 40_000;
        let flipped = |mesh: RawMesh| mesh.flipped();
        let cases = [
            ("flush, overlapping by half", joined(cube(0.0, 1.0, 1), &cube(1.0, 1.0, 2)), 8.0 + 4.0 * 6.0, 8.0),
            ("touching", joined(cube(0.0, 1.0, 1), &cube(2.0, 1.0, 2)), 8.0 + 4.0 * 8.0, 8.0),
            ("touching, smaller", joined(cube(0.0, 1.0, 3), &cube(1.5, 0.5, 2)), 24.0 + 4.0, 2.0),
            ("within a thousandth of the gap", joined(cube(0.0, 1.0, 1), &cube(2.0 + 1e-9, 1.0, 2)), 40.0, 8.0),
            ("beside a gap", joined(cube(0.0, 1.0, 1), &cube(2.0 + 2e-6, 1.0, 2)), 48.0, 0.0),
            ("nested", joined(cube(0.0, 1.0, 1), &cube(0.0, 0.5, 2)), 24.0, 6.0),
            ("a cavity", joined(cube(0.0, 1.0, 1), &flipped(cube(0.0, 0.5, 2))), 30.0, 0.0),
            (
                "a bar through a box",
                joined(cube(0.0, 1.0, 2), &cuboid(DVec3::ZERO, DVec3::new(3.0, 0.5, 0.5), 3, false)),
                24.0 - 2.0 + 4.0 * 4.0 + 2.0,
                2.0 + 4.0 * 2.0,
            ),
        ];
        for (what, mesh, outer, inner) in cases {
            let [bears, hides, all] = areas(&mesh, n);
            let noise = |share: f64| (share * (1.0 - share) / n as f64).sqrt() * all;
            for (found, right) in [(bears, outer), (hides, inner)] {
                assert!((found - right).abs() <= 5.0 * noise(right / all) + 1e-9, "{what}: {found} for {right}");
            }
        }
    }

    /// Two balls through each other: caps of the closed form are hidden, whatever their triangles.
    #[test]
    fn caps_of_balls_are_hidden() {
        let (r, d, n) = (1.0, 1.2, 40_000);
        let balls = [0.0, d].map(|x| sphere(DVec3::new(x, 0.0, 0.0), r, 96, 192));
        let [bears, hides, all] = areas(&joined(balls[0].clone(), &balls[1]), n);
        let cap = 2.0 * std::f64::consts::PI * r * (r - 0.5 * d);
        assert!((hides - 2.0 * cap).abs() < 0.01 * all, "{hides} for {}", 2.0 * cap);
        assert!((bears + hides - all).abs() < 1e-9);
    }
}
