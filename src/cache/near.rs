//! Light that enters close to an exit, sampled anew for each exit: for media whose light does not come as far as the next
//! sample of a cache.

use super::{CacheBuilder, CachedBody, CachedSample, Columns, Envelope, Shadow};
use crate::bssrdf::{Exit, Layout, Partition};
use crate::geometry::{SurfacePoint, Union};
use crate::math::{DVec3, Rgb, Vec3, frame};
use crate::query::{Hit, Ray};
use crate::sampling::PixelStream;
use crate::scene::View;
use crate::tally::{Clock, Tally};
use std::f32::consts::TAU;
use std::time::Instant;

/// Rings of the radial density per octave of r².
const STEPS: u32 = 4;
/// Bits of an f32 below a step.
const SHIFT: u32 = 23 - STEPS.trailing_zeros();
/// Octaves of r² from the innermost disk to the outermost ring.
const OCTAVES: u32 = 40;
/// Rings, but for the innermost disk.
const RINGS: usize = (OCTAVES * STEPS) as usize;
/// Upper bits of r² of the innermost disk, where the outermost ring ends at 1.
const FIRST: u32 = (127 - OCTAVES) << (23 - SHIFT);
/// Share of the samples that is spread evenly over the rings, lest a model differ from the envelope.
const EVEN: f64 = 0.1;
/// Lines parallel to the normal of an exit.
const LINES: u32 = 8;
/// Points of the lights that shine at each surface found: a shadow ray costs less than a line.
const LIGHTS: u32 = 2;
/// Number of lines parallel to each axis on average, the normal first: on a plane that alone finds all, steep walls need the
/// others.
const AXES: [f32; 3] = [LINES as f32, 0.5, 0.5];
/// Neighbouring exits that share what their lines find.
const GROUP: usize = 8;
/// Lines reach farther by so many units in the last place of the coordinates of their ends: near fields may be as small as
/// the rounding of a ray.
const SLACK_ULPS: f32 = 64.0 * f32::EPSILON;
/// Surfaces that one line finds at most.
const MOST_HITS: u32 = 64;
/// What the numbers of lines parallel to the normal are for, and of those parallel to a tangent.
const PURPOSES: [u64; 2] = [0x6e65_6172, 0x7369_6465];

/// Samples of the near part of S_d on disks about exits, projected onto the surface [King et al. 2013].
///
/// What decides S_d and the density of the samples is the way from an exit to an entry, which may be far below the
/// rounding of a place in f32 on a body of many mean free paths: ways are differences of places in f64, an entry that of the
/// line itself on the plane of the triangle it meets, and S_d and density see the same way.
pub struct NearField {
    /// What belongs to the near part.
    pub partition: Partition,
    /// What is left for the cache.
    pub rest: Partition,
    /// Of the outermost ring [unit].
    radius: f32,
    /// Chance of each ring and all within it.
    cumulative: Vec<f32>,
    /// Chance per area in each ring [1/unit²].
    per_area: Vec<f32>,
}

/// A point where light is gathered.
#[derive(Clone, Copy, Debug)]
pub struct GatherPoint {
    /// How light comes out, relative to the centre of the object's area table.
    pub exit: Exit,
    /// The same point in the scene.
    pub place: DVec3,
    /// Numbers of the point's own.
    pub stream: PixelStream,
}

/// A line to look for surfaces along.
struct Line {
    ray: Ray,
    /// A point of it, before rounding.
    through: DVec3,
    /// The exit that it is about.
    middle: DVec3,
    /// Its own numbers, those that placed it used up.
    numbers: PixelStream,
    /// The triangle that was found last.
    last: Option<(u32, u32)>,
    /// The place that was found last on the surface of a union.
    borne: Option<DVec3>,
}

impl Line {
    /// Whether `place`, at `hit`, is a point of the body's surface that was not found yet: of a union not one inside it, and of faces that lie in each
    /// other one, whichever comes first.
    fn is_new(&mut self, union: Option<&Union>, hit: &Hit, place: DVec3) -> bool {
        let Some(union) = union else { return true };
        if union.hides(hit.triangle, place) {
            return false;
        }
        let again = self.borne.is_some_and(|borne| borne.distance(place) <= union.gap());
        self.borne = Some(place);
        !again
    }
}

/// Light that may enter at a point.
struct Candidate {
    /// Number of the surface that a line met.
    surface: u32,
    n_geometric: Vec3,
    place: DVec3,
    /// Its own place is nowhere: 0.
    sample: CachedSample,
    shadow: Option<Shadow>,
}

/// Light that enters at a place.
struct Found {
    place: DVec3,
    /// Its own place is nowhere: 0.
    sample: CachedSample,
}

/// A place that [`NearField::step`] leads to.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Where, before rounding.
    pub place: DVec3,
    /// The same point of the surface, its normals outwards.
    pub at: SurfacePoint,
    /// One over its density \[unit²\].
    pub weight: f32,
}

/// An exit and its axes, the normal first.
struct Middle {
    x: DVec3,
    axes: [Vec3; 3],
}

impl NearField {
    /// The near part within `radius` [unit].
    pub fn new(envelope: &Envelope, radius: f32) -> Self {
        let partition = Partition::within(radius);
        let square = f64::from(radius) * f64::from(radius);
        let area = |k: usize| std::f64::consts::PI * square * (outer2(k) - if k == 0 { 0.0 } else { outer2(k - 1) });
        let mut mass = vec![[0.0_f64; 3]; RINGS + 1];
        for (k, mass) in mass.iter_mut().enumerate() {
            let middle2 = (0.5 * square * (outer2(k) + if k == 0 { 0.0 } else { outer2(k - 1) })) as f32;
            let value = envelope.at(middle2).value * partition.share(middle2);
            *mass = [value.x, value.y, value.z].map(|v| f64::from(v) * area(k));
        }
        let total: [f64; 3] = std::array::from_fn(|c| mass.iter().map(|m| m[c]).sum());
        let live = total.iter().filter(|&&t| t > 0.0).count().max(1) as f64;
        let chance = |m: &[f64; 3]| -> f64 {
            let own: f64 = (0..3).filter(|&c| total[c] > 0.0).map(|c| m[c] / total[c] / live).sum();
            EVEN / mass.len() as f64 + (1.0 - EVEN) * own
        };
        let whole: f64 = mass.iter().map(chance).sum();
        let (mut sum, mut cumulative, mut per_area) = (0.0, Vec::new(), Vec::new());
        for (k, m) in mass.iter().enumerate() {
            let below = sum as f32;
            sum += chance(m) / whole;
            cumulative.push(sum as f32);
            per_area.push((f64::from(sum as f32 - below) / area(k)) as f32);
        }
        Self { partition, rest: Partition::beyond(radius), radius, cumulative, per_area }
    }

    /// Of the outermost ring [unit].
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Adds an estimate of ∫∫ S_d near(r) T12 L_i cosθ_i dω dA for each of `points` to `sums`. All surfaces found along lines parallel
    /// to the normals and tangents of neighbouring exits count for each of them, over the density of all their lines together.
    pub fn add(&self, builder: &CacheBuilder<'_>, points: &[GatherPoint], tally: &mut Tally, sums: &mut [Rgb]) {
        let (start, before) = (Instant::now(), tally.clock.rays);
        let model = &*builder.body.model;
        let [mut all, mut own] = [0; 2].map(|_| Columns::new(model.layout()));
        let mut picked = Vec::new();
        for (points, sums) in points.chunks(GROUP).zip(sums.chunks_mut(GROUP)) {
            let middle = |point: &GatherPoint| {
                let frame = frame(point.exit.n);
                Middle { x: point.place, axes: [Vec3::Z, Vec3::X, Vec3::Y].map(|a| frame * a) }
            };
            let middles: Vec<Middle> = points.iter().map(middle).collect();
            let candidates = self.along(builder, self.lines(&middles, points), tally);
            let found = self.lit(builder, &middles, candidates, tally);
            tally.gather.near_points += found.len() as u64;
            all.refill(model, found.iter().map(|f| &f.sample));
            for (point, sum) in points.iter().zip(sums) {
                let exit = Exit { x: Vec3::ZERO, ..point.exit };
                picked.clear();
                picked.extend((0_u32..).zip(&found).map(|(i, f)| (i, (f.place - point.place).as_vec3())));
                // Beyond the radius the share is 0.
                picked.retain(|(_, way)| way.length_squared() < self.radius * self.radius);
                tally.gather.near += picked.len() as u64;
                own.pick_moved(&all, &picked);
                let mut value = [[0.0; 3]];
                tally.gather.clamped += own.sum(model, &[exit], self.partition, &mut value);
                *sum += Rgb::from_fn(|c| value[0][c] as f32);
            }
        }
        tally.clock.near += start.elapsed().as_secs_f64() - (tally.clock.rays - before);
    }

    /// The lines about some exits.
    fn lines(&self, middles: &[Middle], points: &[GatherPoint]) -> Vec<Line> {
        let mut lines = Vec::with_capacity(middles.len() * (LINES as usize + 1));
        for (middle, point) in middles.iter().zip(points) {
            let [along, across] = PURPOSES.map(|purpose| point.stream.aside(purpose));
            lines.extend((0..LINES).filter_map(|line| self.line(middle, 0, along.split(line, LINES))));
            let mut choice = across;
            let u = choice.next_1d();
            if let Some(axis) = [AXES[1], AXES[1] + AXES[2]].iter().position(|&below| u < below) {
                choice.skip_split();
                lines.extend(self.line(middle, axis + 1, choice));
            }
        }
        lines
    }

    /// A line parallel to an axis. `None` where it only touches the sphere.
    fn line(&self, Middle { x, axes }: &Middle, axis: usize, mut numbers: PixelStream) -> Option<Line> {
        let [u, v] = numbers.next_2d();
        let r2 = self.ring(u) * self.radius * self.radius;
        let (sin, cos) = (TAU * v).sin_cos();
        let (along, aside, other) = (axes[axis], axes[(axis + 1) % 3], axes[(axis + 2) % 3]);
        let through = *x + ((aside * cos + other * sin) * r2.sqrt()).as_dvec3();
        let half = (self.radius * self.radius - r2).max(0.0).sqrt();
        let reach = half + SLACK_ULPS * (through.abs().max_element() as f32 + half);
        let ray = Ray { t_max: 2.0 * reach, ..Ray::new(through + (along * reach).as_dvec3(), -along) };
        (half > 0.0).then_some(Line { ray, through, middle: *x, numbers, last: None, borne: None })
    }

    /// What enters where the lines meet the object, all of them at once, surface after surface.
    fn along(&self, builder: &CacheBuilder<'_>, mut lines: Vec<Line>, tally: &mut Tally) -> Vec<Candidate> {
        let view = builder.view;
        let mut candidates = Vec::with_capacity(lines.len());
        let mut surface = 0;
        let (mut asked, mut hits): (Vec<Ray>, Vec<Option<Hit>>) = (Vec::new(), Vec::new());
        for _ in 0..MOST_HITS {
            asked.clear();
            asked.extend(lines.iter().map(|line| line.ray));
            hits.clear();
            hits.resize(lines.len(), None);
            Clock::time(&mut tally.clock.rays, || builder.view.rays.closest_batch(&asked, &mut hits));
            tally.rays.bounce += lines.len() as u64;
            let mut hit = hits.iter();
            lines.retain_mut(|line| {
                let Some(Some(hit)) = hit.next() else { return false };
                // The next one may begin where this one is hit, but for rounding.
                line.ray.t_min = hit.t.max(line.ray.t_min.next_up());
                let again = line.last.replace((hit.mesh, hit.triangle)) == Some((hit.mesh, hit.triangle));
                let mesh = &view.scene.objects[hit.mesh as usize].mesh;
                let crossing = || mesh.crossing(hit.triangle, line.through, line.ray.direction.as_dvec3());
                let square = f64::from(self.radius) * f64::from(self.radius);
                let near = |place: &DVec3| place.distance_squared(line.middle) <= square;
                if !again
                    && hit.mesh == builder.body.object()
                    && let Some(place) = crossing().filter(near)
                    && line.is_new(builder.body.union.as_deref(), hit, place)
                {
                    let at = view.outwards(hit);
                    surface += 1;
                    for part in 0..LIGHTS {
                        let mut numbers = line.numbers.split(part, LIGHTS);
                        let ([u, v, pick, share], depth) = (numbers.next_4d(), numbers.next_1d());
                        // The lights have the first two numbers, which are spread best: their noise is the largest.
                        let entering = builder.entering(at, 1.0 / LIGHTS as f32, [pick, u, v, share, depth], tally);
                        candidates.extend(entering.map(|(mut sample, shadow)| {
                            sample.entry.x = Vec3::ZERO;
                            Candidate { surface, n_geometric: at.n_geometric, place, sample, shadow }
                        }));
                    }
                    line.numbers.skip_split();
                }
                true
            });
            if lines.is_empty() {
                break;
            }
        }
        candidates
    }

    /// Those candidates that nothing hides, over the density of all lines.
    fn lit(
        &self,
        builder: &CacheBuilder<'_>,
        middles: &[Middle],
        candidates: Vec<Candidate>,
        tally: &mut Tally,
    ) -> Vec<Found> {
        let shadows: Vec<Ray> = candidates.iter().filter_map(|c| Some(c.shadow.as_ref()?.ray)).collect();
        let mut hidden = vec![false; shadows.len()];
        Clock::time(&mut tally.clock.rays, || builder.view.rays.occluded_batch(&shadows, &mut hidden));
        tally.rays.shadow += shadows.len() as u64;
        let mut hidden = hidden.into_iter();
        let mut found: Vec<Found> = Vec::with_capacity(candidates.len());
        let (mut last, mut density) = (0, 0.0);
        // Where the distance alone decides, all light at one point is one sample.
        let joined = builder.body.model.layout() == Layout::POINTS;
        for Candidate { surface, n_geometric, place, mut sample, shadow } in candidates {
            if let Some(shadow) = shadow {
                let open = hidden.next() == Some(false);
                if let Some(light) = shadow.light {
                    tally.rays.lights.ask(light, open);
                }
                if !open {
                    continue;
                }
            }
            let again = std::mem::replace(&mut last, surface) == surface;
            if !again {
                density = self.density(middles, place, n_geometric);
            }
            // At the rim of the near field, by rounding; its share is 0 there.
            if density == 0.0 {
                continue;
            }
            sample.flux *= 1.0 / density;
            match found.last_mut().filter(|_| again && joined) {
                _ if !sample.is_finite() => (tally.gather.non_finite, last) = (tally.gather.non_finite + 1, 0),
                Some(same) => same.sample.flux += sample.flux,
                None => found.push(Found { place, sample }),
            }
        }
        found
    }

    /// The near part of S_d from one place to another, by chance: a place on the surface that a line near `from` meets, in the units
    /// of a sum over samples that are weighted by the number beside it, one over its density [unit²]. `None` where it meets none.
    pub fn step(
        &self,
        view: View<'_>,
        body: &CachedBody,
        (from, n): (DVec3, Vec3),
        mut numbers: PixelStream,
        tally: &mut Tally,
    ) -> Option<Step> {
        let frame = frame(n);
        let middle = Middle { x: from, axes: [Vec3::Z, Vec3::X, Vec3::Y].map(|a| frame * a) };
        let all: f32 = AXES.iter().sum();
        let [u, pick] = numbers.next_2d();
        let axis = if u * all < AXES[0] { 0 } else { 1 + usize::from(u * all >= AXES[0] + AXES[1]) };
        let mut line = self.line(&middle, axis, numbers)?;
        let square = f64::from(self.radius) * f64::from(self.radius);
        let mesh = &view.scene.objects[body.object() as usize].mesh;
        let mut found = Vec::new();
        for _ in 0..MOST_HITS {
            tally.rays.bounce += 1;
            let Some(hit) = view.rays.closest(&line.ray) else { break };
            line.ray.t_min = hit.t.max(line.ray.t_min.next_up());
            let again = line.last.replace((hit.mesh, hit.triangle)) == Some((hit.mesh, hit.triangle));
            if again || hit.mesh != body.object() {
                continue;
            }
            let place = mesh.crossing(hit.triangle, line.through, line.ray.direction.as_dvec3());
            if let Some(place) = place.filter(|p| p.distance_squared(from) <= square)
                && line.is_new(body.union.as_deref(), &hit, place)
            {
                found.push((place, hit));
            }
        }
        let &(place, hit) = found.get((pick * found.len() as f32) as usize)?;
        let at = view.outwards(&hit);
        let density = self.density(std::slice::from_ref(&middle), place, at.n_geometric) / all;
        (density > 0.0).then(|| Step { place, at, weight: found.len() as f32 / density })
    }

    /// The square of a radius with cumulative chance `u`, evenly by area within its ring, where the outermost one is 1.
    fn ring(&self, u: f32) -> f32 {
        let k = self.cumulative.partition_point(|&c| c <= u).min(RINGS);
        let (low, inner2) = if k == 0 { (0.0, 0.0) } else { (self.cumulative[k - 1], outer2(k - 1) as f32) };
        let within = ((u - low) / (self.cumulative[k] - low)).clamp(0.0, 1.0);
        inner2 + within * (outer2(k) as f32 - inner2)
    }

    /// Number of times that the lines of all exits meet the surface at `place`, per area [1/unit²].
    fn density(&self, middles: &[Middle], place: DVec3, n_geometric: Vec3) -> f32 {
        let scale = 1.0 / (self.radius * self.radius);
        let mut density = 0.0;
        for Middle { x, axes } in middles {
            let apart = (place - *x).as_vec3();
            let r2 = apart.length_squared();
            if r2 * scale > 1.0 {
                continue;
            }
            for (axis, number) in axes.iter().zip(AXES) {
                let q = (apart - *axis * apart.dot(*axis)).length_squared() * scale;
                density += number * self.per_area[ring_of(q)] * n_geometric.dot(*axis).abs();
            }
        }
        density
    }
}

/// r² at the outer edge of ring `k`, where the outermost one is 1.
fn outer2(k: usize) -> f64 {
    f64::from(f32::from_bits((FIRST + k as u32) << SHIFT))
}

/// The ring of `q` = r² in 0..=1.
#[inline]
fn ring_of(q: f32) -> usize {
    let bits = q.to_bits() >> SHIFT;
    if bits < FIRST { 0 } else { ((bits - FIRST) as usize + 1).min(RINGS) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_end_where_the_next_begins() {
        assert!(outer2(RINGS) == 1.0);
        for k in 0..RINGS {
            let edge = outer2(k) as f32;
            assert_eq!((ring_of(edge.next_down()), ring_of(edge)), (k, k + 1));
        }
        assert_eq!((ring_of(0.0), ring_of(1.0)), (0, RINGS));
    }
}
