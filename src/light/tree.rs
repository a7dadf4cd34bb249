//! A tree over lights: those that may send the most to a place are chosen most often [CEK18].

use super::{LightBounds, Reference};
use crate::math::{Aabb, DVec3, Vec3};

/// Where along an axis a node may be cut in two.
const CUTS: usize = 12;
/// From this depth on nodes are cut into halves, so that a path from the root fits into 64 bits.
const DEEP: u32 = 32;
/// Cosines this far below 0 are taken as above: f32 rounds.
const MARGIN: f32 = 1e-5;
/// Where light is not ruled out, a cosine has at least this weight.
const LEAST_COSINE: f32 = 1e-3;
/// From lights in a sphere no place is taken to be nearer than the root of this many radii. With 1, the usual bound, the variance under some
/// hundred lamps is three times as large: of what is spread over a sphere little is near its middle, but much of its light comes from near the place.
const NEAREST: f32 = 1.0 / 16.0;
/// Places are moved towards the tree to this many of its radii, from where all its lights are as far.
const FAR: f64 = 1e6;
/// Coordinates are rounded to f32 by no more than this part of the largest.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// A binary tree with one light a leaf. 52 bytes a node; two nodes and 8 bytes a light.
pub(super) struct Tree {
    /// Each before its children, the first child next to it.
    nodes: Vec<Node>,
    /// For each light the way from the root: from the lowest bit on, 1 to the second child.
    ways: Vec<u64>,
    /// Lengths are in units of `scale` and from `centre`.
    centre: DVec3,
    scale: f64,
}

/// The light that was chosen.
#[derive(Clone, Copy, Debug)]
pub struct Pick {
    /// Its number.
    pub light: usize,
    /// The chance of that.
    pub chance: f64,
    /// The number that chose it, spread out again over [0, 1).
    pub left: f64,
}

/// Lights within a sphere.
struct Node {
    centre: Vec3,
    radius: f32,
    intensity: f32,
    axis: Vec3,
    /// Cosine and sine of the cone of normals.
    normals: [f32; 2],
    /// Cosine beyond which nothing is sent.
    falloff: f32,
    two_sided: bool,
    /// The second child, or the light.
    next: u32,
    is_leaf: bool,
}

/// A place in the tree's own units.
struct Local {
    x: Vec3,
    n: Option<Vec3>,
    reach: f32,
    rounding: f32,
}

impl Tree {
    pub(super) fn new(lights: &[LightBounds]) -> Self {
        let all = lights.iter().fold(Aabb::EMPTY, |all, light| all.join(light.bounds));
        let radius = 0.5 * all.extent().length();
        let scale = if radius > 0.0 { radius } else { 1.0 };
        let mut tree = Self { nodes: Vec::new(), ways: vec![0; lights.len()], centre: all.centre(), scale };
        let total: f64 = lights.iter().map(|light| light.intensity).sum();
        let mut order: Vec<u32> = (0..lights.len() as u32).collect();
        let bounds = |light: u32| {
            let light = lights[light as usize];
            LightBounds { intensity: light.intensity / total, ..light }
        };
        tree.build(&bounds, &mut order, 0, 0);
        tree
    }

    fn build(&mut self, bounds: &impl Fn(u32) -> LightBounds, order: &mut [u32], way: u64, depth: u32) {
        let own = self.nodes.len();
        let [first, rest @ ..] = &*order else { return };
        let all = rest.iter().fold(bounds(*first), |all, &light| all.join(bounds(light)));
        self.nodes.push(self.node(&all));
        if rest.is_empty() {
            (self.nodes[own].next, self.nodes[own].is_leaf) = (*first, true);
            self.ways[*first as usize] = way;
            return;
        }
        let middle = cut(bounds, order, &all, depth);
        let (left, right) = order.split_at_mut(middle);
        self.build(bounds, left, way, depth + 1);
        self.nodes[own].next = self.nodes.len() as u32;
        self.build(bounds, right, way | 1 << depth, depth + 1);
    }

    fn node(&self, all: &LightBounds) -> Node {
        let centre = ((all.bounds.centre() - self.centre) / self.scale).as_vec3();
        let radius = (0.5 * all.bounds.extent().length() / self.scale) as f32;
        let cone = all.normals.half as f32;
        Node {
            centre,
            radius: radius * (1.0 + ROUNDING) + ROUNDING * centre.abs().max_element(),
            intensity: all.intensity as f32,
            axis: all.normals.axis.as_vec3(),
            normals: [cone.cos(), cone.sin()],
            falloff: all.falloff.cos() as f32,
            two_sided: all.two_sided,
            next: 0,
            is_leaf: false,
        }
    }

    fn local(&self, from: &Reference) -> Local {
        let apart = (from.x - self.centre) / self.scale;
        let x = (apart * (FAR / apart.length()).min(1.0)).as_vec3();
        // Not 0: it bounds what a light at the place itself is worth.
        let rounding = ROUNDING * (1.0 + x.abs().max_element());
        Local { x, n: from.n, reach: (f64::from(from.reach) / self.scale) as f32, rounding }
    }

    /// The two children of a node, and the chance of the second; `None` where nothing comes from either.
    #[inline]
    fn children(&self, node: usize, from: &Local) -> Option<([usize; 2], f64)> {
        let children = [node + 1, self.nodes[node].next as usize];
        let [first, second] = children.map(|child| f64::from(self.nodes[child].importance(from)));
        (first + second > 0.0).then(|| (children, second / (first + second)))
    }

    pub(super) fn pick(&self, from: &Reference, u: f64) -> Option<Pick> {
        let from = self.local(from);
        let (mut node, mut chance, mut left) = (0, 1.0, u);
        while !self.nodes[node].is_leaf {
            let (children, second) = self.children(node, &from)?;
            let first = 1.0 - second;
            let own;
            (node, own, left) = if left < first {
                (children[0], first, left / first)
            } else {
                (children[1], second, (left - first) / second)
            };
            chance *= own;
            left = left.min(1.0 - f64::EPSILON);
        }
        Some(Pick { light: self.nodes[node].next as usize, chance, left })
    }

    pub(super) fn chance(&self, from: &Reference, light: usize) -> f64 {
        let from = self.local(from);
        let (mut node, mut chance, mut way) = (0, 1.0, self.ways[light]);
        while !self.nodes[node].is_leaf {
            let Some((children, second)) = self.children(node, &from) else { return 0.0 };
            let turn = (way & 1) as usize;
            chance *= [1.0 - second, second][turn];
            (node, way) = (children[turn], way >> 1);
        }
        chance
    }
}

impl Node {
    /// What they may send to a place, up to a factor that all nodes have; 0 only where it is nothing.
    #[inline]
    fn importance(&self, from: &Local) -> f32 {
        let way = self.centre - from.x;
        let radius = self.radius + from.rounding;
        let square = way.length_squared();
        let near = self.intensity / square.max(NEAREST * radius * radius);
        if square <= radius * radius {
            return near;
        }
        let distance = square.sqrt();
        let to = way / distance;
        let at_light = match cosine_and_sine((radius + from.reach) / distance) {
            None => 1.0,
            Some(apart) => {
                let along = -self.axis.dot(to);
                let along = if self.two_sided { along.abs() } else { along };
                let cosine = less(less([along, sine(along)], self.normals), apart)[0];
                if cosine < self.falloff - MARGIN { return 0.0 } else { cosine.max(LEAST_COSINE) }
            }
        };
        let at_surface = match (from.n, cosine_and_sine(radius / distance)) {
            (Some(n), Some(apart)) => {
                let along = n.dot(to);
                let cosine = less([along, sine(along)], apart)[0];
                if cosine < -MARGIN { return 0.0 } else { cosine.max(LEAST_COSINE) }
            }
            _ => 1.0,
        };
        near * at_light * at_surface
    }
}

fn sine(cosine: f32) -> f32 {
    (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// Of an angle of which this is the sine; `None` where it is none.
fn cosine_and_sine(sine: f32) -> Option<[f32; 2]> {
    (sine < 1.0).then(|| [(1.0 - sine * sine).sqrt(), sine])
}

/// Cosine and sine of the angle `a` less the angle `b`, or of 0 where that is larger; both in [0, π].
fn less(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    if a[0] >= b[0] {
        return [1.0, 0.0];
    }
    [a[0] * b[0] + a[1] * b[1], (a[1] * b[0] - a[0] * b[1]).max(0.0)]
}

/// Puts the lights in an order in which those of the first child come first, and returns their number: the cut of least cost along
/// the three axes, or halves.
fn cut(bounds: &impl Fn(u32) -> LightBounds, order: &mut [u32], all: &LightBounds, depth: u32) -> usize {
    let middle = |light: u32| bounds(light).bounds.centre();
    let middles = Aabb::around(order.iter().map(|&light| middle(light)));
    let extent = middles.extent();
    let bucket = |light: u32, axis: usize| {
        let along = (middle(light)[axis] - middles.lower[axis]) / extent[axis];
        ((along * CUTS as f64) as usize).min(CUTS - 1)
    };
    let longest = all.bounds.extent().max_element();
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| depth < DEEP && extent[axis] > 0.0) {
        let mut buckets: [Option<LightBounds>; CUTS] = [None; CUTS];
        for &light in &*order {
            let own = &mut buckets[bucket(light, axis)];
            *own = join(*own, Some(bounds(light)));
        }
        // Thin slices of long nodes are no gain [CEK18].
        let shape = longest / all.bounds.extent()[axis];
        let cost = |some: Option<LightBounds>| some.map_or(0.0, |b| b.cost());
        let mut above = [None; CUTS];
        for k in (1..CUTS).rev() {
            above[k - 1] = join(buckets[k], above[k]);
        }
        let mut below = None;
        for k in 0..CUTS - 1 {
            below = join(below, buckets[k]);
            let cost = shape * (cost(below) + cost(above[k]));
            if below.is_some() && above[k].is_some() && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, k));
            }
        }
    }
    let Some((_, axis, last)) = best else {
        let axis = extent.max_position();
        let half = order.len() / 2;
        let by_place = |a: &u32, b: &u32| middle(*a)[axis].total_cmp(&middle(*b)[axis]).then(a.cmp(b));
        order.select_nth_unstable_by(half, by_place);
        return half;
    };
    order.sort_by_key(|&light| bucket(light, axis) > last);
    order.partition_point(|&light| bucket(light, axis) <= last)
}

fn join(a: Option<LightBounds>, b: Option<LightBounds>) -> Option<LightBounds> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.join(b)),
        (one, other) => one.or(other),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Cone;
    use super::*;
    use crate::math::{hash, unit_f64};
    use std::f64::consts::PI;

    fn number(i: u64) -> f64 {
        unit_f64((hash(i + 1) >> 32) as u32)
    }

    fn direction(i: u64) -> DVec3 {
        let (z, angle) = (1.0 - 2.0 * number(2 * i), 2.0 * PI * number(2 * i + 1));
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    }

    /// Small squares, `apart` wide all together, about `centre`: some of both sides, some a hundred times as bright.
    fn lamps(n: u64, centre: DVec3, apart: f64) -> Vec<LightBounds> {
        let lamp = |i: u64| {
            let middle = centre + (DVec3::new(number(5 * i), number(5 * i + 1), number(5 * i + 2)) - 0.5) * apart;
            let (n, half) = (direction(1000 + i), 0.02 * apart);
            let u = n.any_orthonormal_vector() * half;
            let corners = [u, -u, n.cross(u), -n.cross(u)].map(|edge| middle + edge);
            LightBounds {
                bounds: Aabb::around(corners),
                intensity: 10_f64.powf(2.0 * number(5 * i + 3)),
                normals: Cone { axis: n, half: 0.0 },
                falloff: 0.5 * PI,
                two_sided: i.is_multiple_of(3),
            }
        };
        (0..n).map(lamp).collect()
    }

    fn references(centre: DVec3, apart: f64) -> Vec<Reference> {
        let mut all = Vec::new();
        for (k, far) in [0.0, 0.3, 0.7, 2.0, 300.0, 1e9].into_iter().enumerate() {
            let x = centre + direction(k as u64) * (far * apart);
            let n = Some(direction(50 + k as u64).as_vec3());
            all.push(Reference { x, n, reach: 0.0 });
            all.push(Reference { x, n: None, reach: (0.2 * apart) as f32 });
        }
        all
    }

    /// Chances, with that of none, add up to 1 and are those of the draws, of which each leaves an even number: chi-square to 6 of its standard
    /// deviations, in scenes of 2 to 400 lights and of any size. There is none only where the children of a node are ruled out and it is not.
    #[test]
    fn lights_are_drawn_by_their_chances() {
        let mut worst = 0.0_f64;
        for (n, centre, apart) in
            [(2, DVec3::ZERO, 1.0), (9, DVec3::splat(1e3), 1e-6), (40, DVec3::X, 1e9), (400, DVec3::ZERO, 10.0)]
        {
            let tree = Tree::new(&lamps(n, centre, apart));
            for (k, from) in (0..).zip(references(centre, apart)) {
                let mut chances: Vec<f64> = (0..n as usize).map(|i| tree.chance(&from, i)).collect();
                let sum: f64 = chances.iter().sum();
                // From far away all may be below the horizon.
                let below = from.n.is_some_and(|n| n.as_dvec3().dot((centre - from.x).normalize_or_zero()) < 0.05);
                assert!(sum < 1.0 + 1e-9 && (sum > 0.5 || n < 10 || below), "{n} lights, {from:?}: {sum}");
                chances.push(1.0 - sum);
                let draws = 20_000;
                let (mut counts, mut left) = (vec![0.0; n as usize + 1], 0.0);
                for i in 0..draws {
                    let Some(pick) = tree.pick(&from, number(1_000_000 * k + i)) else {
                        counts[n as usize] += 1.0;
                        continue;
                    };
                    assert!((pick.chance - chances[pick.light]).abs() <= 1e-12 * pick.chance && pick.left < 1.0);
                    counts[pick.light] += 1.0;
                    left += pick.left;
                }
                // Rare ones together.
                let (mut square, mut cells, mut rest) = (0.0, 0.0, [0.0; 2]);
                for (&count, &chance) in counts.iter().zip(&chances) {
                    let expected = chance * draws as f64;
                    rest = [rest[0] + count, rest[1] + expected];
                    if rest[1] >= 8.0 {
                        square += (rest[0] - rest[1]).powi(2) / rest[1];
                        (cells, rest) = (cells + 1.0, [0.0; 2]);
                    }
                }
                let z = (square - cells) / (2.0_f64 * cells).sqrt();
                worst = worst.max(z);
                assert!(z < 6.0, "{n} lights, {from:?}: {square} of {cells}");
                let drawn = draws as f64 - counts[n as usize];
                let mean = left / drawn.max(1.0);
                assert!(
                    drawn < 9.0 || (mean - 0.5).abs() < 6.0 / (12.0 * drawn).sqrt(),
                    "{n} lights, {from:?}: {mean} left"
                );
            }
        }
        println!("worst z {worst}");
    }

    /// What a lamp sends to a place is never lost, and the choice follows it: light over chance, summed by the tree, has a much smaller
    /// spread than by power.
    #[test]
    fn every_light_that_shines_on_a_place_has_a_chance() {
        let (centre, apart) = (DVec3::new(3.0, -1.0, 2.0), 4.0);
        let lights = lamps(300, centre, apart);
        let tree = Tree::new(&lights);
        let total: f64 = lights.iter().map(|light| light.intensity).sum();
        for (k, from) in references(centre, apart).into_iter().enumerate().filter(|(_, from)| from.n.is_some()) {
            let (mut sum, mut by_tree, mut by_power) = (0.0, 0.0, 0.0);
            for (i, light) in lights.iter().enumerate() {
                let chance = tree.chance(&from, i);
                for corner in [light.bounds.lower, light.bounds.centre(), light.bounds.upper] {
                    let way = corner - from.x;
                    let to = way.normalize();
                    let at_light = -light.normals.axis.dot(to);
                    let at_light = if light.two_sided { at_light.abs() } else { at_light };
                    let cosines = at_light.max(0.0) * from.n.map_or(1.0, |n| n.as_dvec3().dot(to).max(0.0));
                    let sent = light.intensity * cosines / way.length_squared();
                    assert!(sent <= 0.0 || chance > 0.0, "place {k}: {light:?}");
                    if sent > 0.0 {
                        sum += sent;
                        by_tree += sent * sent / chance;
                        by_power += sent * sent * total / light.intensity;
                    }
                }
            }
            if sum > 0.0 {
                let ratio = (3.0 * by_tree - sum * sum) / (3.0 * by_power - sum * sum);
                println!("place {k}: variance {ratio:.3} of that by power");
                assert!(ratio < 1.0, "place {k}: {ratio}");
            }
        }
    }

    #[test]
    fn lights_at_one_place_and_on_a_line_make_trees_of_no_great_depth() {
        let one = lamps(1, DVec3::ZERO, 1.0)[0];
        let along = |x: f64| LightBounds { bounds: Aabb::around([DVec3::splat(x)]), ..one };
        let same: Vec<LightBounds> = vec![one; 3000];
        // Each as far from the next as all before it: every cut takes away the last alone.
        let steep: Vec<LightBounds> = (0..1000).map(|i| along(2_f64.powi(i - 500))).collect();
        for lights in [same, steep] {
            let tree = Tree::new(&lights);
            let from = Reference { x: DVec3::ONE, n: None, reach: 1.0 };
            let sum: f64 = (0..lights.len()).map(|i| tree.chance(&from, i)).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        }
    }
}
