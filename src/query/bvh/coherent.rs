//! Camera rays together: up to 64 rays from one point walk the tree as one [ORM08].
//!
//! A box that the pyramid around all of them misses is passed by at once. Of a box that it meets, the rays of those eights
//! are asked that have met the box around it. Where only few rays are left they go on one by one, from there. Each ray's
//! tests are those it would make alone, to the bit.

use super::build::Tree;
use super::node::{Child, NodeRay, Slabs, WIDENED, WIDTH};
use super::stack::{STACK, Stack};
use super::triangle::{LANES, Shear, Sheared, longest_axis};
use super::walk::{Closest, Found, OneRay};
use crate::math::{F8, LaneKernel, Simd, splat3};
use crate::query::Ray;

/// Rays of a packet.
const RAYS: usize = 8;
/// Packets of a group at most.
const PACKETS: usize = 8;
/// Groups of fewer rays than this are traced one by one.
const FEWEST: usize = 2 * RAYS;
/// From a box that no more rays than this enter they go on alone.
const ALONE: u32 = 5;
/// Triangles of a leaf are tested by no fewer rays of an eight than this; fewer rays test the eight triangles each.
const TOGETHER: u32 = 5;
/// Slopes of the rays of a group differ from the first one's by no more than this.
const SPREAD: f32 = 0.1;

/// The first triangle along each of several rays.
pub struct ClosestBatch<'a, F> {
    pub tree: &'a Tree,
    pub rays: &'a [Ray],
    /// Gets the number of each ray and what it found.
    pub give: F,
}

impl<F: FnMut(usize, &Found)> LaneKernel for ClosestBatch<'_, F> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let mut done = 0;
        while done < self.rays.len() {
            let rest = &self.rays[done..];
            let run = run_length(rest);
            match self.tree.root {
                Some(Child::Inner(root)) if run >= FEWEST => {
                    let mut group = Group::new(simd, &rest[..run]);
                    group.trace(self.tree, root);
                    for i in 0..run {
                        (self.give)(done + i, &group.packets[i / RAYS].best[i % RAYS]);
                    }
                }
                _ => {
                    for (i, ray) in rest[..run].iter().enumerate() {
                        (self.give)(done + i, &Closest { tree: self.tree, ray }.run(simd));
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
#[derive(Clone, Copy)]
struct Packet<S: Simd> {
    slabs: Slabs<S>,
    sheared: Sheared<S>,
    best: [Found; RAYS],
    /// Of each ray, `best.t`.
    t: [f32; RAYS],
    /// Of each ray, `best.t_end()`.
    t_end: [f32; RAYS],
}

impl<S: Simd> Packet<S> {
    /// The first eight of `rays`; places left over repeat `any` and end where they begin.
    #[inline(always)]
    fn new(simd: S, rays: &[Ray], any: &Ray, axes: [usize; 3]) -> Self {
        let mut directions = [[0.0; RAYS]; 3];
        let (mut t_min, mut t) = ([0.0; RAYS], [0.0; RAYS]);
        for i in 0..RAYS {
            let ray = rays.get(i).unwrap_or(any);
            for (along, axis) in directions.iter_mut().zip(ray.direction.to_array()) {
                along[i] = axis;
            }
            t_min[i] = ray.t_min;
            t[i] = if i < rays.len() { ray.t_max } else { 0.0 };
        }
        let origin = splat3(simd, any.origin.as_vec3().to_array());
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
            best: t.map(Found::nothing),
            t,
            t_end: t,
        }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, found: Found) {
        self.best[i] = found;
        self.t[i] = found.t;
        self.t_end[i] = found.t_end();
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
struct Group<'a, S: Simd> {
    rays: &'a [Ray],
    packets: [Packet<S>; PACKETS],
    pyramid: Pyramid<S>,
    axes: [usize; 3],
    /// Which end of a slab comes first.
    first: [usize; 3],
    /// No ray looks beyond this any more.
    t_max: f32,
    simd: S,
}

/// A box to visit: its node, its lane there, and the packets that have entered the box around it.
#[derive(Clone, Copy)]
struct Visit {
    node: u32,
    lane: u8,
    packets: u8,
}

impl<'a, S: Simd> Group<'a, S> {
    #[inline(always)]
    fn new(simd: S, rays: &'a [Ray]) -> Self {
        let axes = Shear::new(&rays[0]).axes;
        let mut packets = [Packet::new(simd, rays, &rays[0], axes); PACKETS];
        for (i, packet) in packets.iter_mut().enumerate().skip(1) {
            *packet = Packet::new(simd, rays.get(i * RAYS..).unwrap_or(&[]), &rays[0], axes);
        }
        let t_max = rays.iter().map(|r| r.t_max).fold(0.0, f32::max);
        Self {
            pyramid: Pyramid::new(simd, &packets),
            rays,
            packets,
            axes,
            first: NodeRay::new(simd, &rays[0]).first(),
            t_max,
            simd,
        }
    }

    #[inline(always)]
    fn trace(&mut self, tree: &Tree, root: u32) {
        let mut stack = Stack::<Visit, STACK>::new();
        let all = 0xff >> (PACKETS - self.rays.len().div_ceil(RAYS));
        self.push_children(tree, root, all, &mut stack);
        while let Some((place, near)) = stack.pop() {
            if near <= self.t_max {
                self.visit(tree, place, &mut stack);
            }
        }
    }

    #[inline(always)]
    fn push_children(&self, tree: &Tree, index: u32, packets: u8, stack: &mut Stack<Visit, STACK>) {
        let node = &tree.nodes[index as usize];
        let (first, last) = node.all_planes(self.simd, self.first);
        let (mut inside, near) = self.pyramid.enter(first, last, F8::splat(self.simd, self.t_max));
        let near = near.to_array();
        let from = stack.len();
        while inside != 0 {
            let lane = inside.trailing_zeros() as usize % WIDTH;
            inside &= inside - 1;
            stack.insert(from, Visit { node: index, lane: lane as u8, packets }, near[lane]);
        }
    }

    #[inline(always)]
    fn visit(&mut self, tree: &Tree, place: Visit, stack: &mut Stack<Visit, STACK>) {
        let node = &tree.nodes[place.node as usize];
        let (first, last) = node.box_planes(self.simd, place.lane as usize, self.first);
        let mut entered = [0_u8; PACKETS];
        let mut enters = [F8::splat(self.simd, 0.0); PACKETS];
        let (mut packets, mut count) = (0, 0);
        let mut rest = place.packets;
        while rest != 0 {
            let p = rest.trailing_zeros() as usize % PACKETS;
            rest &= rest - 1;
            let packet = &self.packets[p];
            let (lanes, near) = packet.slabs.enter(first, last, F8::load(self.simd, &packet.t));
            (entered[p], enters[p]) = (lanes as u8, near);
            if lanes != 0 {
                packets |= 1 << p;
                count += lanes.count_ones();
            }
        }
        match Child::from_bits(node.child_bits(place.lane as usize)) {
            _ if packets == 0 => {}
            Child::Inner(index) if count > ALONE => self.push_children(tree, index, packets, stack),
            Child::Leaf(pack) if count > ALONE => self.meet(tree, pack, packets, &entered, &enters),
            child => {
                while packets != 0 {
                    let p = packets.trailing_zeros() as usize % PACKETS;
                    packets &= packets - 1;
                    self.alone(tree, child, p, entered[p], enters[p]);
                }
                self.shorten();
            }
        }
    }

    /// Each of the rays `lanes` of packet `p` below `child`.
    #[inline(always)]
    fn alone(&mut self, tree: &Tree, child: Child, p: usize, mut lanes: u8, enters: F8<S>) {
        let enters = enters.to_array();
        let packet = &mut self.packets[p];
        while lanes != 0 {
            let i = lanes.trailing_zeros() as usize % RAYS;
            lanes &= lanes - 1;
            let Some(ray) = self.rays.get(p * RAYS + i) else { return }; // a place left over
            let found = OneRay::new(self.simd, ray).closest(tree, child, enters[i], packet.best[i]);
            packet.set(i, found);
        }
    }

    /// The rays that have entered a leaf against its triangles.
    #[inline(always)]
    fn meet(&mut self, tree: &Tree, pack: u32, mut packets: u8, entered: &[u8; PACKETS], enters: &[F8<S>; PACKETS]) {
        let triangles = &tree.packs[pack as usize];
        let owners = &tree.owners[pack as usize];
        let simd = self.simd;
        while packets != 0 {
            let p = packets.trailing_zeros() as usize % PACKETS;
            packets &= packets - 1;
            let entered = entered[p];
            if entered.count_ones() < TOGETHER {
                self.alone(tree, Child::Leaf(pack), p, entered, enters[p]);
                continue;
            }
            let packet = &mut self.packets[p];
            for lane in 0..LANES {
                if lane > 0 && owners[lane] == owners[0] {
                    break; // places left over
                }
                let inside = packet.sheared.inside(triangles.corners_of(simd, lane, self.axes));
                if inside.lanes & u32::from(entered) == 0 {
                    continue;
                }
                let met = packet.sheared.meet(&inside, enters[p], packet.slabs.t_min, F8::load(simd, &packet.t_end));
                let mut lanes = met.lanes & u32::from(entered);
                while lanes != 0 {
                    let i = lanes.trailing_zeros() as usize % RAYS;
                    lanes &= lanes - 1;
                    let found = Found { t: met.t[i], place: (pack, lane as u32), u: met.u[i], v: met.v[i] };
                    if found.t < packet.t[i] || found.place < packet.best[i].place {
                        packet.set(i, found);
                    }
                }
            }
        }
        self.shorten();
    }

    /// Looks no farther than the ray that may still look farthest.
    #[inline(always)]
    fn shorten(&mut self) {
        let mut t = F8::load(self.simd, &self.packets[0].t);
        for packet in &self.packets[1..] {
            t = t.max(F8::load(self.simd, &packet.t));
        }
        self.t_max = greatest(t);
    }
}
