//! Polygons of any shape into triangles over their own corners: a fan where that is right, else `polygon_fill.rs`.

use super::polygon_fill::fill;
use crate::math::DVec3;
use spade::Point2;
use std::f64::consts::TAU;

/// A triangle whose height is less than this share of its sides has no area in f64.
const FLAT: f64 = 1e-12;

/// What is odd about a polygon.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shape {
    /// Farthest corner from the polygon's plane, as a share of the root of its area.
    pub off_plane: f64,
    /// Edges cross, or an area is covered twice or backwards.
    pub crosses: bool,
}

/// Triangles of the polygon, as places in `corners`, in its own direction: every corner that is at another place than the
/// one before it is the corner of a triangle, so that neighbours along the edges meet no gap. What the first corner sees
/// whole stays a fan about it. A polygon that crosses itself is filled wherever it winds round a point.
pub(super) fn triangulate(corners: &[DVec3], out: &mut Vec<[u32; 3]>) -> Shape {
    out.clear();
    let n = corners.len() as u32;
    let fan = |out: &mut Vec<[u32; 3]>| {
        out.clear();
        out.extend((2..n).map(|i| [0, i - 1, i]));
    };
    let mut shape = Shape::default();
    let mut ring: Vec<u32> = (0..n).filter(|&i| corners[i as usize] != corners[((i + n - 1) % n) as usize]).collect();
    // All corners at one place, or two places: triangles without area, counted as such.
    if ring.len() < 3 {
        fan(out);
        return shape;
    }
    let Some(plane) = Plane::of(corners, &ring) else {
        fan(out);
        return shape;
    };
    shape.off_plane = plane.off(corners, &ring);
    let points: Vec<Point2<f64>> = ring.iter().map(|&i| plane.point(corners[i as usize])).collect();
    if !sees_all(&points) {
        if points.len() == 4 && sees_all(&[points[1], points[2], points[3], points[0]]) {
            ring.rotate_left(1);
        } else {
            match fill(&points, out) {
                Some(crosses) => shape.crosses = crosses,
                None => {
                    shape.crosses = true;
                    fan(out);
                    return shape;
                }
            }
            out.iter_mut().for_each(|t| *t = t.map(|i| ring[i as usize]));
            return shape;
        }
    }
    out.extend((2..ring.len()).map(|i| [ring[0], ring[i - 1], ring[i]]));
    shape
}

/// The plane of a polygon, by Newell's normal. Points in it are two of their three coordinates, those along which the
/// normal is shortest: what lies on a line stays on it to the last bit.
struct Plane {
    normal: DVec3,
    axes: [usize; 2],
    /// A power of two that brings coordinates below 1.
    scale: f64,
    /// Root of the area, times `scale`.
    size: f64,
}

impl Plane {
    /// None where all corners lie on a line, or too far apart for f64.
    fn of(corners: &[DVec3], ring: &[u32]) -> Option<Self> {
        let largest = ring.iter().map(|&i| corners[i as usize].abs().max_element()).fold(0.0, f64::max);
        let scale = (-largest.log2().floor() - 2.0).clamp(-1022.0, 1022.0).exp2();
        let at = |i: usize| (corners[ring[i % ring.len()] as usize] - corners[ring[0] as usize]) * scale;
        let crosses = || (1..ring.len() - 1).map(|i| at(i).cross(at(i + 1)));
        let (sum, size) =
            crosses().fold((DVec3::ZERO, 0.0), |(sum, size): (DVec3, f64), c| (sum + c, size + c.length()));
        let spread = (1..ring.len()).map(|i| at(i).length()).fold(0.0, f64::max);
        if !(size > FLAT * spread * spread && size.is_finite()) {
            return None;
        }
        // Where a bow tie's halves cancel, the direction of its largest triangle.
        let cancels = sum.length() <= 1e-9 * size;
        let longest = crosses().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
        let normal = if cancels { longest } else { sum };
        let area = 0.5 * if cancels { size } else { normal.length() };
        let normal = normal.normalize_or_zero();
        let [x, y, z] = normal.abs().to_array();
        let axis = if z >= x && z >= y { 2 } else { usize::from(y >= x) };
        let mut axes = [(axis + 1) % 3, (axis + 2) % 3];
        if normal[axis] < 0.0 {
            axes.swap(0, 1);
        }
        Some(Self { normal, axes, scale, size: area.sqrt() })
    }

    fn point(&self, p: DVec3) -> Point2<f64> {
        // Below what the triangulation takes; nothing beside the largest.
        let along = |axis: usize| Some(p[axis] * self.scale).filter(|x| x.abs() > 1e-40).unwrap_or(0.0);
        Point2::new(along(self.axes[0]), along(self.axes[1]))
    }

    /// Farthest corner from the plane through their middle, as a share of the root of the area.
    fn off(&self, corners: &[DVec3], ring: &[u32]) -> f64 {
        let at = |i: &u32| (corners[*i as usize] - corners[ring[0] as usize]) * self.scale;
        let middle = ring.iter().map(at).sum::<DVec3>() / ring.len() as f64;
        ring.iter().map(|i| (at(i) - middle).dot(self.normal).abs()).fold(0.0, f64::max) / self.size
    }
}

/// Whether the fan about the first point is the polygon: all its triangles turn left, less than once round in all.
fn sees_all(points: &[Point2<f64>]) -> bool {
    let (a, mut round) = (points[0], 0.0);
    points[1..].windows(2).all(|p| {
        let (b, c) = ([p[0].x - a.x, p[0].y - a.y], [p[1].x - a.x, p[1].y - a.y]);
        let (area, along) = (b[0] * c[1] - b[1] * c[0], b[0] * c[0] + b[1] * c[1]);
        // Two triangles cannot go round.
        if points.len() > 4 {
            round += area.atan2(along);
        }
        area > FLAT * b[0].hypot(b[1]) * c[0].hypot(c[1]) && round < TAU - 1e-3
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{hash, unit_f32};

    /// Triangles, their summed area and what was odd. Every triangle must face as the polygon does.
    fn cut(corners: &[[f64; 3]]) -> (Vec<[u32; 3]>, f64, Shape) {
        let points: Vec<DVec3> = corners.iter().map(|&p| p.into()).collect();
        let mut out = Vec::new();
        let shape = triangulate(&points, &mut out);
        let areas = out.iter().map(|t| {
            let [a, b, c] = t.map(|i| points[i as usize]);
            0.5 * (b - a).cross(c - a).length()
        });
        let area = areas.sum();
        (out, area, shape)
    }

    /// The area by the corners alone.
    fn newell(corners: &[[f64; 3]]) -> f64 {
        let at = |i: usize| DVec3::from(corners[i % corners.len()]) - DVec3::from(corners[0]);
        0.5 * (0..corners.len()).map(|i| at(i).cross(at(i + 1))).sum::<DVec3>().length()
    }

    fn flat(corners: &[[f64; 2]]) -> Vec<[f64; 3]> {
        corners.iter().map(|&[x, y]| [x, y, 0.0]).collect()
    }

    /// The same in a plane that leans, far from the origin.
    fn leaning(corners: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let (u, v) = (DVec3::new(0.36, 0.48, -0.8), DVec3::new(-0.8, 0.6, 0.0));
        corners.iter().map(|c| (u * c[0] + v * c[1] + DVec3::new(300.0, -20.0, 7.0)).into()).collect()
    }

    #[test]
    fn concave_polygons_keep_their_area_and_use_every_corner() {
        let x: &[[f64; 2]] = &[
            [-5.0, 9.0],
            [-9.0, 9.0],
            [-9.0, 5.0],
            [-3.0, 0.0],
            [-9.0, -5.0],
            [-9.0, -9.0],
            [-5.0, -9.0],
            [0.0, -3.0],
            [5.0, -9.0],
            [9.0, -9.0],
            [9.0, -5.0],
            [3.0, 0.0],
            [9.0, 5.0],
            [9.0, 9.0],
            [5.0, 9.0],
            [0.0, 3.0],
        ];
        let dart: &[[f64; 2]] = &[[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]];
        let runs: &[[f64; 2]] = &[
            [0.0, 0.0],
            [0.1, 0.0],
            [0.2, 0.0],
            [0.3, 0.0],
            [0.3, 0.3],
            [0.2, 0.3],
            [0.2, 0.1],
            [0.1, 0.1],
            [0.0, 0.1],
        ];
        for shape in [x, dart, runs] {
            for turned in 0..shape.len() {
                let mut corners = flat(shape);
                corners.rotate_left(turned);
                for corners in [corners.clone(), leaning(&corners), corners.iter().rev().copied().collect()] {
                    let (triangles, area, odd) = cut(&corners);
                    let expected = newell(&corners);
                    assert!((area / expected - 1.0).abs() < 1e-9, "{corners:?}: {area} for {expected}");
                    assert_eq!(triangles.len(), corners.len() - 2, "{triangles:?}");
                    assert!(!odd.crosses && odd.off_plane < 1e-9, "{odd:?}");
                    // One sum of all normals: none is turned.
                    let normals = triangles.iter().map(|t| {
                        let [a, b, c] = t.map(|i| DVec3::from(corners[i as usize]));
                        0.5 * (b - a).cross(c - a)
                    });
                    assert!((normals.sum::<DVec3>().length() / area - 1.0).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn what_the_first_corner_sees_stays_a_fan() {
        let pentagon: Vec<[f64; 3]> =
            (0..5).map(|i| (f64::from(i) * 1.2566).sin_cos()).map(|(s, c)| [c, s, 0.0]).collect();
        assert_eq!(cut(&leaning(&pentagon)).0, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        let quad = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.1], [2.0, 1.0, 0.0], [0.0, 1.0, 0.1]];
        assert_eq!(cut(&quad).0, [[0, 1, 2], [0, 2, 3]]);
        // The other diagonal where the first is outside.
        let dart = flat(&[[4.0, 0.0], [1.0, 1.0], [0.0, 4.0], [0.0, 0.0]]);
        assert_eq!(cut(&dart).0, [[1, 2, 3], [1, 3, 0]]);
    }

    /// A square with a square hole, reached and left by one repeated edge, as exporters write it.
    fn framed([a, b, c, d]: [[f64; 2]; 4]) -> Vec<[f64; 3]> {
        flat(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0], a, b, c, d, a])
    }

    #[test]
    fn a_hole_bridged_by_a_repeated_edge_stays_open() {
        let keyhole = framed([[1.0, 1.0], [1.0, 3.0], [3.0, 3.0], [3.0, 1.0]]);
        for corners in [keyhole.clone(), leaning(&keyhole)] {
            let (triangles, area, odd) = cut(&corners);
            assert!((area - 12.0).abs() < 1e-9 && triangles.len() == 8 && !odd.crosses, "{area} {triangles:?} {odd:?}");
        }
        // A corner that touches an edge of its own.
        let touching = flat(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [1.7, 0.0], [0.0, 4.0]]);
        for corners in [touching.clone(), leaning(&touching)] {
            let (_, area, odd) = cut(&corners);
            assert!((area - 8.0).abs() < 1e-9 && !odd.crosses, "{area} {odd:?}");
        }
        // Two holes, and a bridge that runs through a corner of the first.
        let two = flat(&[
            [0.0, 0.0],
            [9.0, 0.0],
            [9.0, 9.0],
            [0.0, 9.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [4.0, 4.0],
            [4.0, 6.0],
            [6.0, 6.0],
            [6.0, 4.0],
            [4.0, 4.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
        ]);
        let (_, area, odd) = cut(&two);
        assert!((area - 73.0).abs() < 1e-9 && !odd.crosses, "{area} {odd:?}");
    }

    #[test]
    fn repeated_corners_and_lines_do_no_harm() {
        let (triangles, area, odd) =
            cut(&flat(&[[0.0, 0.0], [0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [2.0, 2.0], [0.0, 2.0], [0.0, 0.0]]));
        assert!(triangles.len() == 2 && area == 4.0 && !odd.crosses, "{triangles:?}");
        for line in [flat(&[[1.0, 1.0]; 5]), flat(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]])] {
            let (triangles, area, odd) = cut(&line);
            assert!(
                triangles.len() == line.len() - 2 && area == 0.0 && odd == Shape::default(),
                "{triangles:?} {odd:?}"
            );
        }
        // There and back.
        let (_, area, _) =
            cut(&flat(&[[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [6.0, 2.0], [4.0, 2.0], [4.0, 4.0], [0.0, 4.0]]));
        assert_eq!(area, 16.0);
    }

    #[test]
    fn what_crosses_itself_is_said_and_filled() {
        let bow = flat(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]);
        assert!(cut(&bow).2.crosses);
        let pentagram: Vec<[f64; 3]> =
            (0..5).map(|i| (f64::from(2 * i) * 1.256_637_061_435_917_3).sin_cos()).map(|(s, c)| [c, s, 0.0]).collect();
        let (_, area, odd) = cut(&pentagram);
        assert!(odd.crosses && area > 1.0, "{area}");
        // A bow tie in the corner of a large plate leaves the plate alone.
        let plate = flat(&[
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 10.0],
            [5.0, 10.0],
            [5.0, 2.0],
            [4.0, 10.1],
            [4.1, 10.0],
            [0.0, 10.0],
        ]);
        let (_, area, odd) = cut(&plate);
        assert!(odd.crosses && (area - 95.5).abs() < 1.0, "{area}");
        // Twice round.
        let twice = flat(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        assert!(cut(&twice).2.crosses);
        // A hole that runs the way of its border.
        let wrong = framed([[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]]);
        assert!(cut(&wrong).2.crosses);
    }

    #[test]
    fn what_is_not_plane_is_measured() {
        let folded = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 0.0]];
        assert!((cut(&folded).2.off_plane - 0.1844).abs() < 1e-4);
        let twisted = [[0.0, 0.0, 0.01], [1.0, 0.0, -0.01], [1.0, 1.0, 0.01], [0.0, 1.0, -0.01]];
        assert!((cut(&twisted).2.off_plane - 0.01).abs() < 1e-4);
    }

    #[test]
    fn places_and_sizes_change_nothing() {
        let dart: Vec<[f64; 3]> =
            leaning(&flat(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [3.0, 1.0], [1.0, 1.0], [0.0, 4.0]]));
        let expected = cut(&dart).0;
        for scale in [1e-30, 1e-6, 1e9, 1e150] {
            let scaled: Vec<[f64; 3]> = dart.iter().map(|p| p.map(|x| x * scale)).collect();
            assert_eq!(cut(&scaled).0.len(), expected.len(), "{scale}");
            assert!(!cut(&scaled).2.crosses, "{scale}");
        }
        cut(&flat(&[[1e308, 0.0], [-1e308, 1e308], [0.0, -1e308], [1e300, 1.0], [0.0, 0.0]]));
    }

    /// Combs, stars and spirals of many corners, against the area by their corners.
    #[test]
    fn a_hundred_thousand_corners_are_cut_in_time() {
        let n = 100_000;
        let random = |i: usize| f64::from(unit_f32((hash(i as u64) >> 32) as u32));
        let star = (0..n).map(|i| {
            let (s, c) = (i as f64 / n as f64 * TAU).sin_cos();
            [c * (1.0 + random(i)), s * (1.0 + random(i))]
        });
        let comb = (0..n).map(|i| [i as f64, if i % 2 == 0 { 0.0 } else { 90.0 }]);
        let comb = comb.chain([[n as f64, -1.0], [-1.0, -1.0]]);
        let spiral = |i: usize, w: f64| {
            let (s, c) = (i as f64 * 0.01).sin_cos();
            [c * (1.0 + 1e-3 * i as f64 + w), s * (1.0 + 1e-3 * i as f64 + w)]
        };
        let spiral = (0..n / 2).map(|i| spiral(i, 0.2)).chain((0..n / 2).rev().map(|i| spiral(i, 0.0)));
        for polygon in [star.collect::<Vec<_>>(), comb.collect(), spiral.collect()] {
            let corners = leaning(&flat(&polygon));
            let (triangles, area, odd) = cut(&corners);
            assert!((area / newell(&corners) - 1.0).abs() < 1e-6, "{area} for {}", newell(&corners));
            assert!(triangles.len() == corners.len() - 2 && !odd.crosses, "{odd:?}");
        }
        // A ring with two corners at each other's places.
        let mut ring: Vec<[f64; 2]> =
            (0..n).map(|i| (i as f64 / n as f64 * TAU).sin_cos()).map(|(s, c)| [c, s]).collect();
        ring.swap(n / 3, n / 3 + 1000);
        let (_, area, odd) = cut(&leaning(&flat(&ring)));
        assert!(odd.crosses && (area / (0.5 * TAU) - 1.0).abs() < 1e-6, "{area} {odd:?}");
    }
}
