//! A mesh as the body that it encloses: its faces, the parts that hang together, which of them are closed.
//! Read first: [`Solid`]; `contact.rs` finds where two of them meet, `winding.rs` what is inside.

use super::box_tree::BoxTree;
use super::{Mesh, morton_code};
use crate::math::{Aabb, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// A face of a [`Solid`].
#[derive(Clone, Copy)]
pub(super) struct Face {
    pub(super) corners: [DVec3; 3],
    /// Numbers of the places of the corners.
    pub(super) places: [u32; 3],
    pub(super) part: u32,
    /// Number of its triangle in the mesh.
    pub(super) triangle: u32,
}

impl Face {
    /// (b - a) x (c - a).
    pub(super) fn scaled_normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    pub(super) fn bounds(&self) -> Aabb {
        Aabb::around(self.corners)
    }
}

/// Faces that hang together over edges.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Whether each edge is run along as often one way as the other: then inside and outside are two things.
    pub closed: bool,
    /// Enclosed volume \[unit³\] of a closed part, below zero where its faces look inwards; 0 for others.
    pub volume: f64,
    /// Area \[unit²\].
    pub area: f64,
    /// Its box [unit].
    pub bounds: Aabb,
    /// Number of faces.
    pub faces: usize,
    /// Its largest face.
    pub(super) largest: u32,
}

/// Edges that leave open what is inside.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seams {
    /// Edges of one face: rims of holes.
    pub open: usize,
    /// Edges of two faces that run along them the same way.
    pub mixed: usize,
    /// Edges of three and more faces, not as many one way as the other: walls inside, or fins.
    pub walls: usize,
    /// Faces with the corners of another.
    pub repeated: usize,
    /// Area that it would take to close the rims with flat pieces, over the area with them.
    pub hole_share: f64,
}

/// The faces of a mesh, each set of corners once, in the order of a space-filling curve.
pub struct Solid {
    pub(super) faces: Vec<Face>,
    pub(super) tree: BoxTree,
    /// Key of the edge and direction, and the face; sorted.
    edges: Vec<(u64, u32)>,
    /// Its parts.
    pub parts: Vec<Part>,
    /// What is wrong with its edges.
    pub seams: Seams,
}

impl Solid {
    /// Of the triangles of `mesh`. Vertices at exactly the same place count as one; triangles with two of those left out.
    pub fn new(mesh: &Mesh) -> Self {
        let point = |i: u32| mesh.positions[i as usize];
        let places = mesh.places();
        let mut keys: Vec<([u32; 3], u32)> = (0_u32..)
            .zip(&mesh.triangles)
            .filter_map(|(i, t)| {
                let mut key = t.map(|v| places[v as usize]);
                key.sort_unstable();
                (key[0] != key[1] && key[1] != key[2]).then_some((key, i))
            })
            .collect();
        let all = keys.len();
        keys.par_sort_unstable();
        keys.dedup_by_key(|k| k.0);
        let repeated = all - keys.len();
        let bounds = mesh.bounds().unwrap_or_default();
        let mut order: Vec<(u64, u32)> = keys
            .par_iter()
            .map(|&(_, t)| {
                let [a, b, c] = mesh.corners(t);
                (morton_code(((a + b + c) / 3.0).clamp(bounds.lower, bounds.upper), &bounds), t)
            })
            .collect();
        drop(keys);
        order.par_sort_unstable();
        let face = |&(_, t): &(u64, u32)| {
            let v = mesh.triangles[t as usize];
            Face { corners: v.map(point), places: v.map(|v| places[v as usize]), part: 0, triangle: t }
        };
        let mut faces: Vec<Face> = order.iter().map(face).collect();
        drop(order);
        let mut edges: Vec<(u64, u32)> = Vec::with_capacity(3 * faces.len());
        edges.extend((0_u32..).zip(&faces).flat_map(|(i, f)| keyed(f.places, i)));
        edges.par_sort_unstable();
        let parts = label(&mut faces, &edges);
        let tree = BoxTree::new(faces.len(), |i| faces[i].bounds());
        let seams = Seams { repeated, ..Seams::default() };
        let mut solid = Self { faces, tree, edges, parts: Vec::new(), seams };
        solid.measure(parts);
        solid
    }

    /// Whether all of it is closed, its faces agree, and none is there twice.
    pub fn is_closed(&self) -> bool {
        !self.parts.is_empty() && self.parts.iter().all(|p| p.closed) && self.seams.repeated == 0
    }

    /// Whether it is one closed part without a dent deeper than `gap` [unit]: such a part does not meet itself.
    pub fn is_convex(&self, gap: f64) -> bool {
        let [part] = &self.parts[..] else { return false };
        part.closed
            && self.edges.chunk_by(|a, b| a.0 >> 1 == b.0 >> 1).all(|uses| {
                let [a, b] = uses else { return false };
                let (one, other) = (&self.faces[a.1 as usize], &self.faces[b.1 as usize]);
                let n = one.scaled_normal().normalize_or_zero();
                other.corners.iter().all(|c| n.dot(*c - one.corners[0]) <= gap)
            })
    }

    /// The faces at the edge between two places, but for `face` itself.
    pub(super) fn mates(&self, face: u32, places: [u32; 2]) -> impl Iterator<Item = &Face> {
        let key = edge_key(places[0], places[1]) >> 1;
        let from = self.edges.partition_point(|e| e.0 >> 1 < key);
        let uses = self.edges[from..].iter().take_while(move |e| e.0 >> 1 == key);
        uses.filter(move |e| e.1 != face).map(|e| &self.faces[e.1 as usize])
    }

    /// Box of the whole [unit].
    pub fn bounds(&self) -> Option<Aabb> {
        self.parts.iter().map(|p| p.bounds).reduce(Aabb::join)
    }

    fn measure(&mut self, count: usize) {
        let none = Part { closed: true, volume: 0.0, area: 0.0, bounds: Aabb::EMPTY, faces: 0, largest: 0 };
        let mut parts = vec![none; count];
        let (mut origins, mut most) = (vec![None; count], vec![-1.0; count]);
        for (i, face) in (0_u32..).zip(&self.faces) {
            let p = face.part as usize;
            let part = &mut parts[p];
            let area = 0.5 * face.scaled_normal().length();
            let origin: DVec3 = *origins[p].get_or_insert(face.corners[0]);
            let [a, b, c] = face.corners.map(|c| c - origin);
            part.volume += a.dot(b.cross(c)) / 6.0;
            part.area += area;
            part.faces += 1;
            part.bounds = part.bounds.join(face.bounds());
            if area > most[p] {
                (most[p], part.largest) = (area, i);
            }
        }
        let mut rims: HashMap<u32, Vec<(u32, DVec3)>> = HashMap::new();
        for uses in self.edges.chunk_by(|a, b| a.0 >> 1 == b.0 >> 1) {
            let back = uses.iter().filter(|e| e.0 & 1 == 1).count();
            if 2 * back == uses.len() {
                continue;
            }
            uses.iter().for_each(|e| parts[self.faces[e.1 as usize].part as usize].closed = false);
            match uses {
                [one] => {
                    self.seams.open += 1;
                    let (places, corners) = (self.faces[one.1 as usize].places, self.faces[one.1 as usize].corners);
                    for k in 0..3 {
                        let (from, to) = (k, (k + 1) % 3);
                        if edge_key(places[from], places[to]) >> 1 == one.0 >> 1 {
                            rims.entry(places[from]).or_default().push((places[to], corners[from]));
                        }
                    }
                }
                [_, _] => self.seams.mixed += 1,
                _ => self.seams.walls += 1,
            }
        }
        let holes = rim_area(rims);
        let area: f64 = parts.iter().map(|p| p.area).sum();
        self.seams.hole_share = if holes > 0.0 { holes / (holes + area) } else { 0.0 };
        parts.iter_mut().filter(|p| !p.closed).for_each(|p| p.volume = 0.0);
        self.parts = parts;
    }
}

/// Area of flat pieces over loops of edges, each from a place to the next.
fn rim_area(mut rims: HashMap<u32, Vec<(u32, DVec3)>>) -> f64 {
    let mut starts: Vec<u32> = rims.keys().copied().collect();
    starts.sort_unstable();
    let mut area = 0.0;
    for start in starts {
        while let Some((mut next, origin)) = rims.get_mut(&start).and_then(Vec::pop) {
            let (mut twice, mut last) = (DVec3::ZERO, origin);
            while let Some((to, at)) = rims.get_mut(&next).and_then(Vec::pop) {
                twice += (last - origin).cross(at - origin);
                (next, last) = (to, at);
            }
            area += 0.5 * twice.length();
        }
    }
    area
}

/// Lower place, higher place and direction: edges between the same places sort together. Numbers stay below 2^31.
fn edge_key(from: u32, to: u32) -> u64 {
    u64::from(from.min(to)) << 32 | u64::from(from.max(to)) << 1 | u64::from(from > to)
}

fn keyed(places: [u32; 3], face: u32) -> [(u64, u32); 3] {
    [0, 1, 2].map(|k| (edge_key(places[k], places[(k + 1) % 3]), face))
}

/// Numbers the parts, in the order of their first faces, and returns how many there are. Faces hang together over edges of two; over
/// edges of more only where a part would not be closed without the other.
fn label(faces: &mut [Face], edges: &[(u64, u32)]) -> usize {
    let mut leader: Vec<u32> = (0..faces.len() as u32).collect();
    fn find(leader: &mut [u32], mut i: u32) -> u32 {
        while leader[i as usize] != i {
            leader[i as usize] = leader[leader[i as usize] as usize];
            i = leader[i as usize];
        }
        i
    }
    fn join(leader: &mut [u32], a: u32, b: u32) {
        let (a, b) = (find(leader, a), find(leader, b));
        leader[a.max(b) as usize] = a.min(b);
    }
    let groups = || edges.chunk_by(|a, b| a.0 >> 1 == b.0 >> 1);
    for uses in groups() {
        if let [a, b] = uses {
            join(&mut leader, a.1, b.1);
        }
    }
    for uses in groups().filter(|uses| uses.len() > 2) {
        let mut sums: HashMap<u32, i32> = HashMap::new();
        for e in uses {
            *sums.entry(find(&mut leader, e.1)).or_default() += if e.0 & 1 == 1 { 1 } else { -1 };
        }
        if sums.values().sum::<i32>() != 0 {
            continue;
        }
        let mut open: Vec<u32> = sums.into_iter().filter(|(_, sum)| *sum != 0).map(|(part, _)| part).collect();
        open.sort_unstable();
        open.windows(2).for_each(|pair| join(&mut leader, pair[0], pair[1]));
    }
    let mut numbers = HashMap::new();
    for i in 0..faces.len() as u32 {
        let next = numbers.len() as u32;
        faces[i as usize].part = *numbers.entry(find(&mut leader, i)).or_insert(next);
    }
    numbers.len()
}
