//! Makes the tree from the top down: the widest box of a node is cut in two where the surface area heuristic finds it
//! cheapest, until the node has eight children or nothing is left to cut [Wald 2007] [DHK08].
//!
//! Cuts are looked for in a copy of the boxes that fills the unit cube, where areas neither overflow nor vanish; the boxes
//! of the finished nodes are those of the corners themselves, exactly. The tree is a function of the meshes alone:
//! threads work on parts whose limits do not depend on their number.

use rayon::prelude::*;

use super::fold::{Fold, Slot};
use super::node::{Child, Node, WIDTH};
use super::split::{self, Range, Ref};
use super::stack::STACK;
use super::triangle::{LANES, Pack};
use crate::geometry::Mesh;
use crate::math::{Aabb32, DVec3, Vec3};
use crate::query::{has_area, rounded};

/// Which triangle of which mesh lies at a place in a pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Owner {
    pub mesh: u32,
    pub triangle: u32,
}

/// The finished tree.
#[derive(Default)]
pub struct Tree {
    /// `None` if there is nothing to hit.
    pub root: Option<Child>,
    pub nodes: Vec<Node>,
    pub packs: Vec<Pack>,
    /// Owners of the triangles of each pack.
    pub owners: Vec<[Owner; LANES]>,
    /// Most entries that a traversal can have waiting.
    pub stack_needed: usize,
}

/// Ranges of no more triangles than this are built by one thread from top to bottom.
const TASK: usize = 1 << 14;
/// From this depth on ranges are halved by number.
const STEEP_DEPTH: u32 = 20;

/// A range that is one task's, or a node above such.
enum Plan<'r> {
    Node(Vec<Self>),
    Task(Range<'r>),
}

/// What is said of the triangles while the tree is made.
struct Source<'a> {
    meshes: &'a [&'a Mesh],
    /// By [`Ref::item`].
    owners: Vec<Owner>,
}

impl Tree {
    /// The tree of all triangles with area.
    pub fn new(meshes: &[&Mesh]) -> Self {
        let (source, mut refs) = Source::new(meshes);
        if refs.is_empty() {
            return Self::default();
        }
        let tree = Self::of(&source, &mut refs, false);
        if tree.stack_needed <= STACK {
            return tree;
        }
        // Triangles that shrink by a factor each can make cheap trees deep; cuts by number alone cannot: four billion
        // triangles are 32 cuts, and no cut leaves more than seven boxes waiting.
        Self::of(&source, &mut refs, true)
    }

    fn of(source: &Source<'_>, refs: &mut [Ref], halve: bool) -> Self {
        let plan = plan(Range::new(refs), halve, 0);
        let mut tasks = Vec::new();
        let outline = outline(plan, &mut tasks);
        let parts: Vec<(Self, Aabb32)> = tasks
            .into_par_iter()
            .map(|range| {
                let Range { refs, .. } = range;
                let fold = Fold::new(Range::new(refs), halve);
                let mut part = Self::default();
                let (root, bounds) = part.grow(source, &fold, refs, fold.root());
                part.root = Some(root);
                (part, bounds)
            })
            .collect();
        let mut tree = Self::default();
        let count = |of: fn(&Self) -> usize| parts.iter().map(|(part, _)| of(part)).sum::<usize>();
        tree.nodes.reserve_exact(count(|p| p.nodes.len()) + parts.len());
        tree.packs.reserve_exact(count(|p| p.packs.len()));
        tree.owners.reserve_exact(count(|p| p.owners.len()));
        let (root, _) = tree.assemble(&outline, &mut parts.into_iter());
        tree.root = Some(root);
        tree.stack_needed = tree.stack_below(root);
        tree
    }

    /// Memory of nodes, triangles and their owners.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.packs) + size_of_val(&*self.owners)
    }

    /// Nodes and packs of a folded range, depth first.
    fn grow(&mut self, source: &Source<'_>, fold: &Fold, refs: &[Ref], place: Slot) -> (Child, Aabb32) {
        match place {
            Slot::Leaf { start, count } => self.push_leaf(source, &refs[start..start + count]),
            Slot::Node(at) => {
                let node = self.nodes.len();
                self.nodes.push(Node::new(&[]));
                let children: Vec<(Child, Aabb32)> =
                    fold.places(at).into_iter().map(|place| self.grow(source, fold, refs, place)).collect();
                self.nodes[node] = Node::new(&children);
                (Child::Inner(node as u32), around(&children))
            }
        }
    }

    fn push_leaf(&mut self, source: &Source<'_>, refs: &[Ref]) -> (Child, Aabb32) {
        let owner = |lane: usize| source.owners[refs[if lane < refs.len() { lane } else { 0 }].item() as usize];
        let corners: Vec<[Vec3; 3]> = (0..refs.len()).map(|lane| source.corners(owner(lane))).collect();
        let bounds = Aabb32::around(corners.iter().flatten().copied());
        self.packs.push(Pack::new(&corners));
        self.owners.push(std::array::from_fn(owner));
        (Child::Leaf(self.packs.len() as u32 - 1), bounds)
    }

    /// Appends the parts in the order of the outline, under the nodes above them.
    fn assemble(&mut self, outline: &Outline, parts: &mut impl Iterator<Item = (Self, Aabb32)>) -> (Child, Aabb32) {
        match outline {
            Outline::Part => {
                let (part, bounds) = parts.next().unwrap_or_default();
                let (nodes, packs) = (self.nodes.len() as u32, self.packs.len() as u32);
                self.nodes.extend(part.nodes.into_iter().map(|node| node.moved_by(nodes, packs)));
                self.packs.extend(part.packs);
                self.owners.extend(part.owners);
                (part.root.unwrap_or(Child::Leaf(0)).moved_by(nodes, packs), bounds)
            }
            Outline::Node(outlines) => {
                let node = self.nodes.len();
                self.nodes.push(Node::new(&[]));
                let children: Vec<(Child, Aabb32)> = outlines.iter().map(|o| self.assemble(o, parts)).collect();
                self.nodes[node] = Node::new(&children);
                (Child::Inner(node as u32), around(&children))
            }
        }
    }

    /// All children of a node wait but one, which puts its own on top of them.
    fn stack_below(&self, child: Child) -> usize {
        let Child::Inner(node) = child else { return 0 };
        let node = &self.nodes[node as usize];
        let deepest = node.children().map(|c| self.stack_below(c)).max().unwrap_or(0);
        node.children().count().max(node.children().count().saturating_sub(1) + deepest)
    }
}

/// A [`Plan`] whose tasks were taken out, in order.
enum Outline {
    Node(Vec<Self>),
    Part,
}

fn plan(range: Range<'_>, halve: bool, depth: u32) -> Plan<'_> {
    if range.len() <= TASK {
        return Plan::Task(range);
    }
    let halve = halve || depth >= STEEP_DEPTH;
    Plan::Node(cut(range, halve).into_iter().map(|part| plan(part, halve, depth + 1)).collect())
}

fn outline<'r>(plan: Plan<'r>, tasks: &mut Vec<Range<'r>>) -> Outline {
    match plan {
        Plan::Task(range) => {
            tasks.push(range);
            Outline::Part
        }
        Plan::Node(parts) => Outline::Node(parts.into_iter().map(|p| outline(p, tasks)).collect()),
    }
}

/// A range cut into up to eight, the widest first; `halve` cuts by number alone.
fn cut(range: Range<'_>, halve: bool) -> Vec<Range<'_>> {
    let mut parts = Vec::with_capacity(WIDTH);
    parts.push(range);
    while parts.len() < WIDTH {
        let size = |r: &Range<'_>| if halve { r.len() as f32 } else { r.half_area() };
        let candidates = (0..parts.len()).filter(|&i| parts[i].len() > LANES);
        let Some(widest) = candidates.max_by(|&a, &b| size(&parts[a]).total_cmp(&size(&parts[b]))) else { break };
        let (left, right) = split::split(parts.swap_remove(widest), halve);
        parts.push(left);
        parts.push(right);
    }
    parts.sort_by(|a, b| b.half_area().total_cmp(&a.half_area()));
    parts
}

impl<'a> Source<'a> {
    /// The triangles with area, and their boxes in the unit cube.
    fn new(meshes: &'a [&'a Mesh]) -> (Self, Vec<Ref>) {
        let mut owners = Vec::with_capacity(meshes.iter().map(|m| m.triangles.len()).sum());
        for (mesh, number) in meshes.iter().zip(0..) {
            let with_area = (0..mesh.triangles.len() as u32).into_par_iter().filter(|&t| has_area(rounded(mesh, t)));
            owners.par_extend(with_area.map(|triangle| Owner { mesh: number, triangle }));
        }
        let source = Self { meshes, owners };
        let all = source.owners.par_iter().map(|&o| Aabb32::around(source.corners(o))).reduce_with(Aabb32::join);
        let Aabb32 { lower, upper } = all.unwrap_or_default();
        let lower = lower.as_dvec3();
        let scale = 1.0 / (upper.as_dvec3() - lower).max_element();
        let place = |p: Vec3| -> DVec3 { (p.as_dvec3() - lower) * scale };
        let refs = source.owners.par_iter().enumerate().map(|(item, &owner)| {
            let Aabb32 { lower, upper } = Aabb32::around(source.corners(owner));
            Ref::new(place(lower).as_vec3(), place(upper).as_vec3(), item as u32)
        });
        let refs = refs.collect();
        (source, refs)
    }

    fn corners(&self, owner: Owner) -> [Vec3; 3] {
        rounded(self.meshes[owner.mesh as usize], owner.triangle)
    }
}

fn around(children: &[(Child, Aabb32)]) -> Aabb32 {
    children.iter().map(|(_, bounds)| *bounds).fold(Aabb32::EMPTY, Aabb32::join)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{hash, unit_f32};

    fn scattered(n: u32) -> Mesh {
        let draw = |i: u32| unit_f32((hash(u64::from(i) + 1) >> 32) as u32);
        let positions =
            (0..3 * n).map(|i| Vec3::new(draw(3 * i), draw(3 * i + 1), draw(3 * i + 2)) + (i / 3) as f32 * 0.1);
        let triangles = (0..n).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Mesh { positions: positions.map(|p| p.as_dvec3()).collect(), triangles, ..Mesh::default() }
    }

    /// Every triangle is in the tree once, repeats in a pack aside.
    fn assert_complete(tree: &Tree, n: u32) {
        let mut seen = vec![false; n as usize];
        for owners in &tree.owners {
            let mut own: Vec<u32> = owners.iter().map(|o| o.triangle).collect();
            own.sort_unstable();
            own.dedup();
            for t in own {
                assert!(!std::mem::replace(&mut seen[t as usize], true), "{t} twice");
            }
        }
        assert!(seen.iter().all(|&s| s));
        let mut reached = (0, 0); // nodes and packs
        for child in tree.nodes.iter().flat_map(Node::children).chain(tree.root) {
            match child {
                Child::Inner(_) => reached.0 += 1,
                Child::Leaf(_) => reached.1 += 1,
            }
        }
        assert_eq!(reached, (tree.nodes.len(), tree.packs.len()));
    }

    #[test]
    fn every_triangle_is_kept() {
        for n in [1, 2, 8, 9, 33, 1000, 2 * TASK as u32] {
            let tree = Tree::new(&[&scattered(n)]);
            assert_complete(&tree, n);
            assert!(tree.stack_needed < 96, "{}", tree.stack_needed);
        }
    }

    /// The tree of any number of threads is the same.
    #[test]
    fn threads_do_not_shape_the_tree() {
        let mesh = scattered(100_000);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let many = rayon::ThreadPoolBuilder::new().num_threads(5).build().unwrap();
        let [a, b] = [alone, many].map(|pool| pool.install(|| Tree::new(&[&mesh])));
        assert!(a.owners == b.owners && format!("{:?}", a.nodes) == format!("{:?}", b.nodes));
    }

    /// Ranges that are halved by number alone end in time, whatever is in them.
    #[test]
    fn halving_makes_a_shallow_tree() {
        let mesh = scattered(40_000);
        let (meshes, n) = ([&mesh], 40_000);
        let (source, mut refs) = Source::new(&meshes);
        let tree = Tree::of(&source, &mut refs, true);
        assert_complete(&tree, n);
        assert!(tree.stack_needed <= 7 * 16, "{}", tree.stack_needed);
    }
}
