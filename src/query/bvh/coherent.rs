//! Camera rays together: up to 64 rays from one point walk the tree as one [ORM08].
//!
//! A box that the pyramid around all of them misses is passed by at once. Of a box that it meets, the rays are asked eight at
//! a time, and no more of them than it takes to find one that enters; who comes before that one stays outside below it,
//! too. Only leaves ask every ray. Each ray's tests are those it would make alone, to the bit.

use super::node::{Child, NodeRay, Slabs, WIDENED, WIDTH};
use super::stack::Stack;
use super::triangle::{LANES, Shear, Sheared, longest_axis};
use super::{Closest, Found, STACK, Tree};
use crate::math::{F8, LaneKernel, Simd, splat3};
use crate::query::Ray;

/// Rays of a packet.
const RAYS: usize = 8;
/// Packets of a group at most.
const PACKETS: usize = 8;
/// Groups of fewer rays than this are traced one by one.
const FEWEST: usize = 2 * RAYS;
/// Slopes of the rays of a group differ from the first one's by no more than this.
const SPREAD: f32 = 0.1;

/// The first triangle along each of several rays.
pub struct ClosestBatch<'a, F> {
    pub tree: &'a Tree,
    pub rays: &'a [Ray],
    /// Gets the number of each ray and what it found.
    pub give: F,
}

impl<F: FnMut(usize, Option<Found>)> LaneKernel for ClosestBatch<'_, F> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let mut done = 0;
        while done < self.rays.len() {
            let rest = &self.rays[done..];
            let run = run_length(rest);
            match self.tree.root {
                Some(root @ Child::Inner(_)) if run >= FEWEST => {
                    let mut group = Group::new(simd, &rest[..run]);
                    group.trace(self.tree, root);
                    for i in 0..run {
                        (self.give)(done + i, group.packets[i / RAYS].found(i % RAYS));
                    }
                }
                _ => {
                    for (i, ray) in rest[..run].iter().enumerate() {
                        (self.give)(done + i, Closest { tree: self.tree, ray }.run(simd));
                    }
                }
            }
            done += run;
        }
    }
}

/// How many of the first rays can go together: one origin, one octant, one longest axis, nearly one direction.
#[inline(always)]
fn run_length(rays: &[Ray]) -> usize {
    let first = &rays[0];
    if rays.get(1).is_none_or(|second| second.origin != first.origin) {
        return 1;
    }
    let d = first.direction;
    let (along, signs) = (longest_axis(d), d.signum());
    let spread = SPREAD * d[along].abs();
    let most = rays.len().min(RAYS * PACKETS);
    for (i, ray) in rays[..most].iter().enumerate() {
        let e = ray.direction;
        // One over anything larger is finite.
        let in_octant = (e * signs).min_element() > 1e-36;
        // Slopes, times both lengths along the axis.
        let apart = (e * d[along] - d * e[along]).abs().max_element();
        if ray.origin != first.origin || !in_octant || longest_axis(e) != along || apart > spread * e[along].abs() {
            return i.max(1);
        }
    }
    most
}

/// Eight rays and what they have found so far.
struct Packet<S: Simd> {
    slabs: Slabs<S>,
    sheared: Sheared<S>,
    /// The best hit so far, or the ray's end.
    t: [f32; RAYS],
    /// The first distance that is no longer of use; beyond the best hit only by a tie.
    t_end: [f32; RAYS],
    /// Pack and lane of the best hit.
    place: [(u32, u32); RAYS],
    u: [f32; RAYS],
    v: [f32; RAYS],
}

const NOTHING: (u32, u32) = (u32::MAX, u32::MAX);

impl<S: Simd> Packet<S> {
    /// Places left over repeat the first ray.
    #[inline(always)]
    fn new(simd: S, rays: &[Ray], axes: [usize; 3]) -> Self {
        let mut directions = [[0.0; RAYS]; 3];
        let (mut t_min, mut t) = ([0.0; RAYS], [0.0; RAYS]);
        for i in 0..RAYS {
            let ray = rays.get(i).unwrap_or(&rays[0]);
            for (along, axis) in directions.iter_mut().zip(ray.direction.to_array()) {
                along[i] = axis;
            }
            (t_min[i], t[i]) = (ray.t_min, ray.t_max);
        }
        let origin = splat3(simd, rays[0].origin.to_array());
        let d = load3(simd, &directions);
        let (one, widened) = (F8::splat(simd, 1.0), F8::splat(simd, WIDENED));
        let inverse = [one / d[0], one / d[1], one / d[2]];
        let [kx, ky, kz] = axes;
        Self {
            slabs: Slabs {
                origin,
                inverse,
                inverse_far: [inverse[0] * widened, inverse[1] * widened, inverse[2] * widened],
                t_min: F8::load(simd, &t_min),
            },
            sheared: Sheared {
                origin: [origin[kx], origin[ky], origin[kz]],
                by: [d[kx] / d[kz], d[ky] / d[kz], inverse[kz]],
            },
            t,
            t_end: t,
            place: [NOTHING; RAYS],
            u: [0.0; RAYS],
            v: [0.0; RAYS],
        }
    }

    fn found(&self, i: usize) -> Option<Found> {
        let (pack, lane) = self.place[i];
        (pack != u32::MAX).then_some(Found { t: self.t[i], pack, lane, u: self.u[i], v: self.v[i] })
    }
}

#[inline(always)]
fn load3<S: Simd>(simd: S, from: &[[f32; 8]; 3]) -> [F8<S>; 3] {
    [F8::load(simd, &from[0]), F8::load(simd, &from[1]), F8::load(simd, &from[2])]
}

#[inline(always)]
fn least<S: Simd>(v: F8<S>) -> f32 {
    v.to_array().into_iter().fold(f32::INFINITY, f32::min)
}

#[inline(always)]
fn greatest<S: Simd>(v: F8<S>) -> f32 {
    v.to_array().into_iter().fold(f32::NEG_INFINITY, f32::max)
}

/// The pyramid around rays from one point: bounds of their distances to planes.
struct Pyramid<S: Simd> {
    origin: [F8<S>; 3],
    /// The least and the largest inverse direction, and the same widened.
    inverse: [[F8<S>; 3]; 2],
    inverse_far: [[F8<S>; 3]; 2],
    t_min: F8<S>,
}

impl<S: Simd> Pyramid<S> {
    #[inline(always)]
    fn new(simd: S, packets: &[Packet<S>]) -> Self {
        let slabs = &packets[0].slabs;
        let (mut low, mut high, mut t_min) = (slabs.inverse, slabs.inverse, slabs.t_min);
        for Packet { slabs, .. } in &packets[1..] {
            for axis in 0..3 {
                low[axis] = low[axis].min(slabs.inverse[axis]);
                high[axis] = high[axis].max(slabs.inverse[axis]);
            }
            t_min = t_min.min(slabs.t_min);
        }
        let low = [least(low[0]), least(low[1]), least(low[2])];
        let high = [greatest(high[0]), greatest(high[1]), greatest(high[2])];
        let widened = |i: [f32; 3]| [i[0] * WIDENED, i[1] * WIDENED, i[2] * WIDENED];
        Self {
            origin: slabs.origin,
            inverse: [splat3(simd, low), splat3(simd, high)],
            inverse_far: [splat3(simd, widened(low)), splat3(simd, widened(high))],
            t_min: F8::splat(simd, least(t_min)),
        }
    }

    /// The boxes that any of the rays may enter before `t_max`, and a distance before which none does.
    #[inline(always)]
    fn enter(&self, first: [F8<S>; 3], last: [F8<S>; 3], t_max: F8<S>) -> (u32, F8<S>) {
        let (mut near, mut far) = (self.t_min, t_max);
        // Rounding keeps order: the product of the extremes bounds the rounded product of any ray.
        for axis in 0..3 {
            let to_first = first[axis] - self.origin[axis];
            near = near.max((to_first * self.inverse[0][axis]).min(to_first * self.inverse[1][axis]));
            let to_last = last[axis] - self.origin[axis];
            far = far.min((to_last * self.inverse_far[0][axis]).max(to_last * self.inverse_far[1][axis]));
        }
        (near.le(far), near)
    }
}

/// Rays that go together.
struct Group<S: Simd> {
    packets: [Packet<S>; PACKETS],
    /// Packets in use.
    count: usize,
    pyramid: Pyramid<S>,
    axes: [usize; 3],
    /// Which end of a slab comes first.
    first: [usize; 3],
    /// No ray looks beyond this any more.
    t_max: f32,
    simd: S,
}

impl<S: Simd> Group<S> {
    #[inline(always)]
    fn new(simd: S, rays: &[Ray]) -> Self {
        let axes = Shear::new(&rays[0]).axes;
        let count = rays.len().div_ceil(RAYS);
        let packets = std::array::from_fn(|i| {
            Packet::new(simd, rays.get(i * RAYS..).filter(|r| !r.is_empty()).unwrap_or(rays), axes)
        });
        let t_max = rays.iter().map(|r| r.t_max).fold(0.0, f32::max);
        Self {
            pyramid: Pyramid::new(simd, &packets[..count]),
            packets,
            count,
            axes,
            first: NodeRay::new(simd, &rays[0]).first(),
            t_max,
            simd,
        }
    }

    #[inline(always)]
    fn trace(&mut self, tree: &Tree, root: Child) {
        // Of each box to visit: its place in its node, the first packet that may enter, a distance before which none does.
        let mut stack = Stack::<STACK>::new();
        let Child::Inner(root) = root else { return };
        self.push_children(tree, root, 0, &mut stack);
        while let Some((place, near)) = stack.pop() {
            if near > self.t_max {
                continue;
            }
            let (node, lane, from) = unpack(place);
            let node = &tree.nodes[node as usize];
            let (first, last) = node.box_planes(self.simd, lane, self.first);
            let mut packet = from;
            loop {
                if packet >= self.count {
                    break;
                }
                let p = &self.packets[packet % PACKETS];
                if p.slabs.enter(first, last, F8::load(self.simd, &p.t)).0 != 0 {
                    break;
                }
                packet += 1;
            }
            if packet >= self.count {
                continue;
            }
            match Child::from_bits(node.child_bits(lane)) {
                Child::Inner(index) => self.push_children(tree, index, packet, &mut stack),
                Child::Leaf(pack) => self.meet(tree, pack, packet, first, last),
            }
        }
    }

    #[inline(always)]
    fn push_children(&self, tree: &Tree, index: u32, packet: usize, stack: &mut Stack<STACK>) {
        let node = &tree.nodes[index as usize];
        let (first, last) = node.all_planes(self.simd, self.first);
        let (mut inside, near) = self.pyramid.enter(first, last, F8::splat(self.simd, self.t_max));
        let near = near.to_array();
        let from = stack.len();
        while inside != 0 {
            let lane = inside.trailing_zeros() as usize % WIDTH;
            inside &= inside - 1;
            stack.insert(from, pack_up(index, lane, packet), near[lane]);
        }
    }

    /// All rays from packet `from` on against the triangles of a leaf.
    #[inline(always)]
    fn meet(&mut self, tree: &Tree, pack: u32, from: usize, first: [F8<S>; 3], last: [F8<S>; 3]) {
        let triangles = &tree.packs[pack as usize];
        let owners = &tree.owners[pack as usize];
        let simd = self.simd;
        let mut met_any = false;
        for packet in &mut self.packets[from..self.count] {
            let (entered, enters) = packet.slabs.enter(first, last, F8::load(simd, &packet.t));
            if entered == 0 {
                continue;
            }
            for lane in 0..LANES {
                if lane > 0 && owners[lane] == owners[0] {
                    break; // places left over
                }
                let inside = packet.sheared.inside(triangles.corners_of(simd, lane, self.axes));
                if inside.lanes & entered == 0 {
                    continue;
                }
                let met = packet.sheared.meet(&inside, enters, packet.slabs.t_min, F8::load(simd, &packet.t_end));
                let mut lanes = met.lanes & entered;
                met_any |= lanes != 0;
                while lanes != 0 {
                    let i = lanes.trailing_zeros() as usize % RAYS;
                    lanes &= lanes - 1;
                    let place = (pack, lane as u32);
                    if met.t[i] < packet.t[i] || place < packet.place[i] {
                        (packet.t[i], packet.place[i]) = (met.t[i], place);
                        (packet.u[i], packet.v[i]) = (met.u[i], met.v[i]);
                        packet.t_end[i] = met.t[i].next_up();
                    }
                }
            }
        }
        if met_any {
            let mut t = F8::load(simd, &self.packets[0].t);
            for packet in &self.packets[1..self.count] {
                t = t.max(F8::load(simd, &packet.t));
            }
            self.t_max = greatest(t);
        }
    }
}

fn pack_up(node: u32, lane: usize, packet: usize) -> u32 {
    node << 6 | (lane << 3 | packet) as u32
}

fn unpack(place: u32) -> (u32, usize, usize) {
    (place >> 6, (place >> 3) as usize % WIDTH, place as usize % PACKETS)
}
