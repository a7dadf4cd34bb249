//! A surface in patches of about equal area, cut anew for each pass, so that their borders are nowhere in the mean of many.

use super::Mesh;
use crate::math::{DVec3, Vec3, hash_combine, unit_f32};

/// Coordinates by which a surface is cut: place and normal.
const AXES: usize = 6;
/// A turn of the normal by one radian counts as much as a way of so many radii of the ball with the surface's area: faces of a thin
/// part are apart.
const NORMAL: f64 = 0.3;
/// Facets that tell where a patch is cut, at most.
const TRIED: usize = 257;
/// A facet is no longer than this many edges of a square with the area wanted.
const SLENDER: f64 = 4.0;

/// A small piece of a surface: a triangle of the mesh or a part of one.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Its middle, relative to a centre [unit].
    pub x: Vec3,
    /// Unit normal of its triangle, outwards.
    pub n: Vec3,
    /// Its area \[unit²\].
    pub area: f32,
}

/// A surface as small pieces.
pub struct Facets {
    all: Vec<Facet>,
    normal: f32,
    largest_in_all: f64,
}

impl Facets {
    /// Of the part of `mesh` that `bears` takes, by triangle and place; pieces of at most `most` area [unit²], relative to `centre`.
    pub fn new(mesh: &Mesh, centre: DVec3, most: f64, bears: impl Fn(u32, DVec3) -> bool) -> Self {
        let mut all = Vec::new();
        let mut area = 0.0;
        for triangle in 0..mesh.triangles.len() as u32 {
            let whole = mesh.area(triangle);
            if whole.is_nan() || whole <= 0.0 {
                continue;
            }
            let n = mesh.point(triangle, 1.0 / 3.0, 1.0 / 3.0).n_geometric;
            let mut open = vec![(mesh.corners(triangle), whole)];
            while let Some(([a, b, c], size)) = open.pop() {
                let edges = [b.distance_squared(c), c.distance_squared(a), a.distance_squared(b)];
                let by = |better: fn(f64, f64) -> bool| {
                    (0..3).fold(0, |l, k| if better(edges[k], edges[l]) { k } else { l })
                };
                let (longest, shortest) = (by(|a, b| a > b), by(|a, b| a < b));
                let turned = |first: usize| [[a, b, c], [b, c, a], [c, a, b]][first];
                if size > most {
                    let [a, b, c] = turned(longest);
                    let middle = 0.5 * (b + c);
                    open.extend([([a, b, middle], 0.5 * size), ([a, middle, c], 0.5 * size)]);
                    continue;
                }
                // What is slender still is sliced, from the tip on.
                let [tip, b, c] = turned(shortest);
                let slices = (edges[longest] / most).sqrt() / SLENDER;
                let slices = if size > 1e-3 * most { slices.ceil().max(1.0) } else { 1.0 };
                for i in 0..slices as u32 {
                    let [from, to] = [i, i + 1].map(|k| f64::from(k) / slices);
                    let share = to * to - from * from;
                    let along = 2.0 / 3.0 * (to.powi(3) - from.powi(3)) / share;
                    let x = tip + (0.5 * (b + c) - tip) * along;
                    if bears(triangle, x) {
                        area += size * share;
                        all.push(Facet { x: (x - centre).as_vec3(), n, area: (size * share) as f32 });
                    }
                }
            }
        }
        let radius = (area / (4.0 * std::f64::consts::PI)).sqrt();
        let largest = all.iter().map(|f| f.area).fold(0.0, f32::max);
        let largest_in_all = if largest > 0.0 { area / f64::from(largest) } else { 0.0 };
        Self { all, normal: (NORMAL * radius) as f32, largest_in_all }
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// All of the area over that of the largest one.
    pub fn largest_in_all(&self) -> f64 {
        self.largest_in_all
    }
}

/// Where a patch is cut in two.
#[derive(Clone, Copy, Debug)]
struct Split {
    axis: u8,
    at: f32,
}

/// All on one side.
const WHOLE: Split = Split { axis: 0, at: f32::NEG_INFINITY };

/// A surface cut in 2^depth patches.
pub struct Patches {
    axes: [Vec3; 3],
    normal: f32,
    /// Of the whole, of its halves, of their halves.
    splits: Vec<Split>,
    /// Facets in the order of their patches.
    order: Vec<u32>,
    /// Where each patch ends in that.
    ends: Vec<u32>,
    area: Vec<f64>,
}

impl Patches {
    /// Cuts `facets` into 2^`depth` patches, by directions and borders of `seed`.
    pub fn new(facets: &Facets, depth: u32, seed: u64) -> Self {
        let axes = turned(seed);
        let keys: Vec<[f32; AXES]> = facets.all.iter().map(|f| key(&axes, facets.normal, f.x, f.n)).collect();
        let mut order: Vec<u32> = (0..keys.len() as u32).collect();
        let mut splits = vec![WHOLE; (1 << depth) - 1];
        let mut ranges: Vec<std::ops::Range<usize>> = std::iter::once(0..order.len()).collect();
        for level in 0..depth {
            let mut next = Vec::with_capacity(2 * ranges.len());
            for (i, range) in ranges.into_iter().enumerate() {
                let node = (1 << level) - 1 + i;
                let own = &mut order[range.clone()];
                let split = cut(&facets.all, &keys, own, hash_combine(seed, node as u64));
                let below = partition(own, |f| keys[f as usize][split.axis as usize] < split.at);
                splits[node] = split;
                next.extend([range.start..range.start + below, range.start + below..range.end]);
            }
            ranges = next;
        }
        let area =
            ranges.iter().map(|r| order[r.clone()].iter().map(|&f| f64::from(facets.all[f as usize].area)).sum());
        let area = area.collect();
        let ends = ranges.iter().map(|r| r.end as u32).collect();
        Self { axes, normal: facets.normal, splits, order, ends, area }
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.ends.len()
    }

    /// The patch of a place `x`, relative to the facets' centre, with outward normal `n` of its triangle.
    #[inline]
    pub fn at(&self, x: Vec3, n: Vec3) -> usize {
        let key = key(&self.axes, self.normal, x, n);
        let mut node = 0;
        while let Some(split) = self.splits.get(node) {
            node = 2 * node + if key[split.axis as usize] < split.at { 1 } else { 2 };
        }
        node - self.splits.len()
    }

    /// Its area \[unit²\].
    pub fn area(&self, patch: usize) -> f64 {
        self.area[patch]
    }

    /// `count` facets of it, each for the same part of its area, by chance; none of an empty one.
    pub fn spread<'a>(&self, facets: &'a Facets, patch: usize, count: u32, seed: u64) -> Vec<&'a Facet> {
        let start = if patch == 0 { 0 } else { self.ends[patch - 1] as usize };
        let own = &self.order[start..self.ends[patch] as usize];
        let (mut at, mut passed) = (0, 0.0);
        let whole = self.area[patch];
        let pick = (0..if own.is_empty() { 0 } else { count }).map(|k| {
            let u = unit_f32(hash_combine(hash_combine(seed, patch as u64), k.into()) as u32);
            let target = whole * (f64::from(k) + f64::from(u)) / f64::from(count);
            while at + 1 < own.len() && passed + f64::from(facets.all[own[at] as usize].area) < target {
                passed += f64::from(facets.all[own[at] as usize].area);
                at += 1;
            }
            &facets.all[own[at] as usize]
        });
        pick.collect()
    }
}

/// Three directions at right angles, by chance.
fn turned(seed: u64) -> [Vec3; 3] {
    let number = |k: u64| unit_f32(hash_combine(seed, !k) as u32);
    let (z, phi, roll) = (1.0 - 2.0 * number(0), std::f32::consts::TAU * number(1), std::f32::consts::TAU * number(2));
    let r = (1.0 - z * z).max(0.0).sqrt();
    let a = Vec3::new(r * phi.cos(), r * phi.sin(), z).normalize();
    let (b, c) = a.any_orthonormal_pair();
    [a, b * roll.cos() + c * roll.sin(), c * roll.cos() - b * roll.sin()]
}

#[inline]
fn key(axes: &[Vec3; 3], normal: f32, x: Vec3, n: Vec3) -> [f32; AXES] {
    let [a, b, c] = axes;
    [a.dot(x), b.dot(x), c.dot(x), normal * a.dot(n), normal * b.dot(n), normal * c.dot(n)]
}

/// Across the widest spread of some facets, in the middle of their area.
fn cut(all: &[Facet], keys: &[[f32; AXES]], own: &[u32], seed: u64) -> Split {
    if own.len() < 2 {
        return WHOLE;
    }
    let mut tried: Vec<u32> = match own.len() {
        0..=TRIED => own.to_vec(),
        n => (0..TRIED as u64).map(|k| own[(hash_combine(seed, k) % n as u64) as usize]).collect(),
    };
    let of = |axis: usize| move |f: &u32| f64::from(keys[*f as usize][axis]);
    let weight = |f: &u32| f64::from(all[*f as usize].area);
    let whole: f64 = tried.iter().map(weight).sum();
    let spread = |axis: usize| {
        let mean = tried.iter().map(|f| weight(f) * of(axis)(f)).sum::<f64>() / whole;
        tried.iter().map(|f| weight(f) * (of(axis)(f) - mean).powi(2)).sum::<f64>()
    };
    let spreads: [f64; AXES] = std::array::from_fn(spread);
    let axis = (0..AXES).fold(0, |best, k| if spreads[k] > spreads[best] { k } else { best });
    tried.sort_unstable_by(|a, b| of(axis)(a).total_cmp(&of(axis)(b)));
    let mut passed = 0.0;
    let middle = tried.iter().position(|f| {
        passed += weight(f);
        passed >= 0.5 * whole
    });
    // Of alike ones, as on a plane face by its normal, all are on one side.
    let middle = middle.unwrap_or(0).clamp(1, tried.len() - 1);
    let value = |k: usize| keys[tried[k] as usize][axis];
    let apart = (1..tried.len()).filter(|&k| value(k - 1) < value(k)).min_by_key(|k| k.abs_diff(middle));
    match apart {
        Some(k) => Split { axis: axis as u8, at: 0.5 * (value(k - 1) + value(k)) },
        None => WHOLE,
    }
}

/// Those that are `below` first; how many.
fn partition(own: &mut [u32], below: impl Fn(u32) -> bool) -> usize {
    let mut first = 0;
    for i in 0..own.len() {
        if below(own[i]) {
            own.swap(first, i);
            first += 1;
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{RawMesh, rectangle, sphere};

    fn mesh(mesh: &RawMesh) -> Mesh {
        mesh.recentred(DVec3::ZERO)
    }

    fn thin() -> Mesh {
        let mut mesh = rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
        let back = rectangle(DVec3::new(0.0, 0.0, -1e-3), DVec3::Y, DVec3::X);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(back.positions.iter().copied());
        mesh.triangles.extend(back.triangles.iter().map(|t| t.map(|i| i + first)));
        self::mesh(&mesh)
    }

    /// Facets keep all of the area, whatever they are cut from: of large triangles, of slender ones, of small ones.
    #[test]
    fn facets_are_small_and_keep_the_area() {
        let slender = mesh(&rectangle(DVec3::ZERO, DVec3::X * 100.0, DVec3::Y * 0.01));
        for (mesh, most) in [(mesh(&sphere(DVec3::ZERO, 1.0, 16, 32)), 0.01), (thin(), 1e-3), (slender, 1e-2)] {
            let area: f64 = (0..mesh.triangles.len() as u32).map(|t| mesh.area(t)).sum();
            let facets = Facets::new(&mesh, DVec3::ZERO, most, |_, _| true);
            let sum: f64 = facets.all.iter().map(|f| f64::from(f.area)).sum();
            assert!((sum / area - 1.0).abs() < 1e-5, "{sum} of {area}");
            assert!(facets.all.iter().all(|f| f64::from(f.area) <= most));
            assert!(
                (facets.count() as f64) < 24.0 * area / most + 2.0 * mesh.triangles.len() as f64,
                "{}",
                facets.count()
            );
        }
    }

    /// Each facet lies in the patch that its place and normal say, patches are of about one size and keep all of the area.
    #[test]
    fn patches_are_of_one_size_and_found_again() {
        let mesh = mesh(&sphere(DVec3::ZERO, 1.0, 32, 64));
        let facets = Facets::new(&mesh, DVec3::ZERO, 12.6 / 16384.0, |_, _| true);
        for seed in 0..4 {
            let patches = Patches::new(&facets, 8, seed);
            assert_eq!(patches.count(), 256);
            let mut areas = vec![0.0; 256];
            facets.all.iter().for_each(|f| areas[patches.at(f.x, f.n)] += f64::from(f.area));
            let mean = areas.iter().sum::<f64>() / 256.0;
            for (i, area) in areas.iter().enumerate() {
                assert!((area - patches.area(i)).abs() < 1e-9 * mean, "{i}");
                assert!((0.4 * mean..2.0 * mean).contains(area), "{} of {mean}", area);
            }
            let spread = patches.spread(&facets, 7, 5, 1);
            assert_eq!(spread.len(), 5);
            assert!(spread.iter().all(|f| patches.at(f.x, f.n) == 7));
        }
    }

    /// The two faces of a thin sheet have no patch in common, and other seeds have other borders.
    #[test]
    fn faces_of_a_thin_sheet_are_apart() {
        let facets = Facets::new(&thin(), DVec3::ZERO, 5e-4, |_, _| true);
        let borders = |seed| {
            let patches = Patches::new(&facets, 9, seed);
            let of = |up: bool| {
                let own = facets.all.iter().filter(move |f| (f.n.z > 0.0) == up);
                own.map(|f| patches.at(f.x, f.n)).collect::<std::collections::BTreeSet<_>>()
            };
            assert!(of(true).is_disjoint(&of(false)), "{seed}");
            facets.all.iter().map(|f| patches.at(f.x, f.n)).collect::<Vec<_>>()
        };
        assert_ne!(borders(1), borders(2));
        assert_eq!(borders(3), borders(3));
    }
}
