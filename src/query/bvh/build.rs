//! Makes the tree: `obvhs` clusters the triangles into a binary tree, which is folded here into nodes of four children.
//!
//! Of `obvhs` we take the topology alone and compute the boxes ourselves, exactly. So it may see a copy of the scene that
//! suits it: scaled to the unit cube, where its areas neither overflow nor vanish, and with every box moved a little, since
//! it pairs nearest neighbours and takes quadratic time where costs are all alike (equal triangles, regular strips).

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::node::{Child, Node};
use super::triangle::{LANES, Pack};
use crate::geometry::Mesh;
use crate::math::{DVec3, Vec3, hash, unit_f32};

/// Which triangle of which mesh lies at a place in a pack.
#[derive(Clone, Copy, Debug)]
pub struct Owner {
    pub mesh: u32,
    pub triangle: u32,
}

/// The finished tree; node 0 is the root, no nodes if there is nothing to hit.
pub struct Tree {
    pub nodes: Vec<Node>,
    pub packs: Vec<Pack>,
    /// Owners of the triangles of each pack.
    pub owners: Vec<[Owner; LANES]>,
    /// Most entries that a traversal can have waiting.
    pub stack_needed: usize,
}

/// A triangle with area, and its box.
struct Item {
    corners: [Vec3; 3],
    bounds: Bounds,
    owner: Owner,
}

type Bounds = (Vec3, Vec3);

fn union(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

/// A binary tree: a node with `count` 0 has the children `first` and `first` + 1, else it is a leaf with `count` entries
/// of `order` from `first` on.
struct Binary {
    nodes: Vec<BinaryNode>,
    order: Vec<u32>,
}

#[derive(Clone, Copy)]
struct BinaryNode {
    first: u32,
    count: u32,
}

/// Share of the nodes that `obvhs` tries to place better; more is slower to build and little faster to trace.
const REINSERTION: f32 = 0.1;
/// Cost of a node in tests of a triangle, for the choice of leaves: a pack costs the same for one triangle as for four.
const NODE_COST: f32 = 3.0;

impl Tree {
    /// The tree of all triangles with area; a traversal needs at most `stack_limit` entries.
    pub fn new(meshes: &[&Mesh], stack_limit: usize) -> Self {
        let items = items(meshes);
        if items.is_empty() {
            return Self { nodes: Vec::new(), packs: Vec::new(), owners: Vec::new(), stack_needed: 0 };
        }
        clustered(&items)
            .map(|binary| Self::fold(&binary, &items))
            .filter(|tree| tree.stack_needed <= stack_limit)
            .unwrap_or_else(|| Self::fold(&halved(&items), &items))
    }

    /// Memory of nodes, triangles and their owners.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.packs) + size_of_val(&*self.owners)
    }

    /// Folds two levels into one, the children with the largest boxes first.
    fn fold(binary: &Binary, items: &[Item]) -> Self {
        let bounds = binary.bounds(items);
        let area = |node: u32| {
            let (lower, upper) = bounds[node as usize];
            let d = upper.as_dvec3() - lower.as_dvec3();
            d.x * d.y + d.y * d.z + d.z * d.x
        };
        let mut tree = Self { nodes: vec![Node::new(&[])], packs: Vec::new(), owners: Vec::new(), stack_needed: 0 };
        let mut unfinished = vec![(0_u32, 0_usize)];
        while let Some((binary_node, wide_node)) = unfinished.pop() {
            let mut slots = vec![binary_node];
            while slots.len() < 4 {
                let inner = (0..slots.len()).filter(|&s| binary.nodes[slots[s] as usize].count == 0);
                let Some(widest) = inner.max_by(|&a, &b| area(slots[a]).total_cmp(&area(slots[b]))) else { break };
                let first = binary.nodes[slots[widest] as usize].first;
                slots[widest] = first;
                slots.push(first + 1);
            }
            let children: Vec<(Child, Bounds)> = slots
                .iter()
                .map(|&slot| {
                    let child = match binary.nodes[slot as usize] {
                        BinaryNode { count: 0, .. } => {
                            tree.nodes.push(Node::new(&[]));
                            unfinished.push((slot, tree.nodes.len() - 1));
                            Child::Inner(tree.nodes.len() as u32 - 1)
                        }
                        leaf => tree.push_leaf(binary.entries(leaf), items),
                    };
                    (child, bounds[slot as usize])
                })
                .collect();
            tree.nodes[wide_node] = Node::new(&children);
        }
        tree.stack_needed = tree.stack_needed();
        tree
    }

    fn push_leaf(&mut self, entries: &[u32], items: &[Item]) -> Child {
        let item = |lane: usize| &items[entries[if lane < entries.len() { lane } else { 0 }] as usize];
        let corners: Vec<[Vec3; 3]> = (0..entries.len()).map(|lane| item(lane).corners).collect();
        self.packs.push(Pack::new(&corners));
        self.owners.push(std::array::from_fn(|lane| item(lane).owner));
        Child::Leaf(self.packs.len() as u32 - 1)
    }

    /// All children of a node wait on the stack; one is taken and, if it is a node, puts its own in its place.
    fn stack_needed(&self) -> usize {
        let mut needed = vec![0; self.nodes.len()];
        for (i, node) in self.nodes.iter().enumerate().rev() {
            let count = node.children().count();
            let below = |child| match child {
                Child::Inner(node) => needed[node as usize], // behind its parent in the list, so known
                Child::Leaf(_) => 0,
            };
            let deepest = node.children().map(below).max().unwrap_or(0);
            needed[i] = count.max(count.saturating_sub(1) + deepest);
        }
        needed[0]
    }
}

fn items(meshes: &[&Mesh]) -> Vec<Item> {
    let mut items = Vec::new();
    for (mesh_number, mesh) in meshes.iter().enumerate() {
        items.extend((0..mesh.triangles.len() as u32).filter(|&t| mesh.area(t) > 0.0).map(|triangle| {
            let corners = mesh.corners(triangle);
            let [a, b, c] = corners;
            let bounds = (a.min(b).min(c), a.max(b).max(c));
            Item { corners, bounds, owner: Owner { mesh: mesh_number as u32, triangle } }
        }));
    }
    items
}

fn total_bounds(items: &[Item]) -> Bounds {
    items.iter().map(|i| i.bounds).reduce(union).unwrap_or_default()
}

/// The tree of `obvhs`: clusters of nearest neighbours, then the worst nodes moved to better places. `None` where it had to
/// pair so often that the tree is deep.
fn clustered(items: &[Item]) -> Option<Binary> {
    if items.len() <= LANES {
        return None;
    }
    let boxes = boxes_in_unit_cube(items);
    let order = (0..items.len() as u32).collect();
    let mut bvh =
        PlocBuilder::with_capacity(boxes.len()).build(PlocSearchDistance::Medium, &boxes, order, SortPrecision::U64, 3);
    // Beyond this depth `obvhs` changes to stacks that end in a panic when full.
    if bvh.max_depth > DEFAULT_MAX_STACK_DEPTH {
        return None;
    }
    let mut reinsertion = ReinsertionOptimizer::default();
    reinsertion.run(&mut bvh, REINSERTION, None);
    collapse(&mut bvh, LANES as u32, NODE_COST);
    reinsertion.run(&mut bvh, 2.0 * REINSERTION, None);
    let Bvh2 { nodes, primitive_indices, .. } = bvh;
    let nodes = nodes.iter().map(|n| BinaryNode { first: n.first_index, count: n.prim_count }).collect();
    Some(Binary { nodes, order: primitive_indices })
}

/// The items' boxes as `obvhs` gets them: in the unit cube, each moved by a thousandth of its size.
fn boxes_in_unit_cube(items: &[Item]) -> Vec<Aabb> {
    const SHIFT_OF_BOX: f32 = 1e-3;
    const SHIFT_OF_SCENE: f32 = 1e-6;
    let (lower, upper) = total_bounds(items);
    let lower = lower.as_dvec3();
    let scale = 1.0 / (upper.as_dvec3() - lower).max_element();
    let place = |p: Vec3| -> DVec3 { (p.as_dvec3() - lower) * scale };
    items
        .iter()
        .enumerate()
        .map(|(i, item)| {
            let (min, max) = (Vec3A::from(place(item.bounds.0).as_vec3()), Vec3A::from(place(item.bounds.1).as_vec3()));
            let draw = |d: u64| unit_f32((hash(3 * i as u64 + d + 1) >> 32) as u32) - 0.5;
            let shift =
                Vec3A::new(draw(0), draw(1), draw(2)) * (SHIFT_OF_BOX * (max - min).max_element() + SHIFT_OF_SCENE);
            Aabb::new(min + shift, max + shift)
        })
        .collect()
}

/// A tree whose every node halves its triangles by their order along the longest axis: depth is the logarithm of their
/// number, whatever they look like.
fn halved(items: &[Item]) -> Binary {
    let centre = |i: u32| {
        let (lower, upper) = items[i as usize].bounds;
        0.5 * lower.as_dvec3() + 0.5 * upper.as_dvec3()
    };
    let mut order: Vec<u32> = (0..items.len() as u32).collect();
    let mut nodes = vec![BinaryNode { first: 0, count: items.len() as u32 }];
    let mut unfinished = vec![0];
    while let Some(at) = unfinished.pop() {
        let BinaryNode { first, count } = nodes[at];
        if count as usize <= LANES {
            continue;
        }
        let range = &mut order[first as usize..(first + count) as usize];
        let start = centre(range[0]);
        let (lower, upper) = range.iter().fold((start, start), |(lo, hi), &i| (lo.min(centre(i)), hi.max(centre(i))));
        let axis = (upper - lower).max_position();
        let left = (count / 2).next_multiple_of(LANES as u32);
        range.select_nth_unstable_by(left as usize, |&a, &b| {
            centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b))
        });
        let children = nodes.len();
        nodes[at] = BinaryNode { first: children as u32, count: 0 };
        nodes.push(BinaryNode { first, count: left });
        nodes.push(BinaryNode { first: first + left, count: count - left });
        unfinished.extend([children, children + 1]);
    }
    Binary { nodes, order }
}

impl Binary {
    fn entries(&self, leaf: BinaryNode) -> &[u32] {
        &self.order[leaf.first as usize..(leaf.first + leaf.count) as usize]
    }

    /// The exact box of each node, from the leaves up.
    fn bounds(&self, items: &[Item]) -> Vec<Bounds> {
        let mut from_root = Vec::with_capacity(self.nodes.len());
        let mut unfinished = vec![0_usize];
        while let Some(at) = unfinished.pop() {
            from_root.push(at);
            if self.nodes[at].count == 0 {
                let first = self.nodes[at].first as usize;
                unfinished.extend([first, first + 1]);
            }
        }
        let mut bounds = vec![Bounds::default(); self.nodes.len()];
        for &at in from_root.iter().rev() {
            let node = self.nodes[at];
            bounds[at] = if node.count == 0 {
                union(bounds[node.first as usize], bounds[node.first as usize + 1])
            } else {
                let boxes = self.entries(node).iter().map(|&i| items[i as usize].bounds);
                boxes.reduce(union).unwrap_or_default()
            };
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scattered(n: u32) -> Mesh {
        let draw = |i: u32| unit_f32((hash(u64::from(i) + 1) >> 32) as u32);
        let positions =
            (0..3 * n).map(|i| Vec3::new(draw(3 * i), draw(3 * i + 1), draw(3 * i + 2)) + (i / 3) as f32 * 0.1);
        let positions: Vec<Vec3> = positions.collect();
        Mesh { positions, triangles: (0..n).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(), normals: None }
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
        let mut reached = (1, 0); // nodes and packs
        for child in tree.nodes.iter().flat_map(Node::children) {
            match child {
                Child::Inner(_) => reached.0 += 1,
                Child::Leaf(_) => reached.1 += 1,
            }
        }
        assert_eq!(reached, (tree.nodes.len(), tree.packs.len()));
    }

    #[test]
    fn both_builders_keep_every_triangle() {
        for n in [1, 2, 4, 5, 6, 33, 1000] {
            let mesh = scattered(n);
            let items = items(&[&mesh]);
            if n as usize > LANES {
                assert_complete(&Tree::fold(&clustered(&items).unwrap(), &items), n);
            }
            assert_complete(&Tree::fold(&halved(&items), &items), n);
            assert_complete(&Tree::new(&[&mesh], 256), n);
        }
    }

    #[test]
    fn a_stack_limit_is_kept() {
        let mesh = scattered(1000);
        // Five levels of full nodes hold 1024 packs, and each leaves three children waiting.
        assert!(Tree::new(&[&mesh], 16).stack_needed <= 16);
        assert!(Tree::new(&[&mesh], 256).stack_needed < 64);
    }
}
