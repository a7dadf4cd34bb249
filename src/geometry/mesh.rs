//! A mesh of triangles, and the point of a surface that a ray or a sampler found.

use crate::math::{Aabb, DVec3, Vec3, hash_combine};

/// Triangles over shared vertices, in world space relative to the scene's centre.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions [unit].
    pub positions: Vec<DVec3>,
    /// Indices into `positions`, three a triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Shading normals; `None` shades with the triangles' own.
    pub normals: Option<Normals>,
    /// Texture coordinates of the corners of each triangle; `None` where nobody asks for them.
    pub uv: Option<Vec<CornerUv>>,
    /// What rays are traced in, which decides how far from the surface they start.
    pub precision: Precision,
    /// For each vertex a number: of vertices at one place those of one number are one. Empty where all are.
    pub groups: Vec<u32>,
}

/// Texture coordinates (u, v) of a triangle's three corners: u to the right in a picture, v upwards, 0 to 1 over all of it.
pub type CornerUv = [[f32; 2]; 3];

/// The numbers that rays are traced in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// f32, as the ray backends have it.
    #[default]
    Single,
    /// f64, for scenes that f32 cannot hold.
    Double,
}

impl Precision {
    /// How far from a surface rays start whose largest coordinate is `largest`.
    #[inline]
    pub fn error(self, largest: f64) -> f64 {
        let epsilon = match self {
            Self::Single => f32::EPSILON.into(),
            Self::Double => f64::EPSILON,
        };
        ERROR_ULPS * epsilon * largest
    }
}

/// Shading normals with indices of their own, as OBJ has them.
#[derive(Clone, Debug, Default)]
pub struct Normals {
    /// Unit vectors.
    pub vectors: Vec<Vec3>,
    /// Indices into `vectors`, one triple for each triangle of the mesh.
    pub triangles: Vec<[u32; 3]>,
}

/// A point on a triangle, with what every reader of a surface needs.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position [unit].
    pub x: DVec3,
    /// Unit normal of the triangle, outward.
    pub n_geometric: Vec3,
    /// Unit normal for shading, in the same half space as `n_geometric`.
    pub n: Vec3,
    /// Texture coordinates, v upwards; 0 where the mesh has none.
    pub uv: [f32; 2],
    /// Bound of the rounding error of `x` and of a ray test against the triangle [unit].
    pub error: f64,
}

/// A ray that leaves the surface starts this many units in the last place of the triangle's largest
/// coordinate away from it: interpolation and the intersection test each lose a few.
const ERROR_ULPS: f64 = 32.0;

/// Share of its length by which rounding its direction to f32 may move a segment's end, with a factor of 4 to spare.
const SEGMENT_ERROR: f64 = 4.0 * f32::EPSILON as f64;

/// Sine of the least elevation of a mirrored direction above a surface whose normal was bent for it.
const LEAST_ELEVATION: f32 = 0.01;

impl Mesh {
    /// The three corners of a triangle [unit].
    #[inline]
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// (b - a) x (c - a), in f64 so that neither needles nor scales of 1e-6 or 1e6 lose it [unit²].
    #[inline]
    pub fn scaled_normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// Area of a triangle [unit²].
    pub fn area(&self, triangle: u32) -> f64 {
        0.5 * self.scaled_normal(triangle).length()
    }

    /// What it encloses \[unit³\]; with small holes nearly so.
    pub fn volume(&self) -> f64 {
        let Some(middle) = self.bounds().map(|b| b.centre()) else { return 0.0 };
        let under = |t: u32| {
            let [a, b, c] = self.corners(t).map(|p| p - middle);
            a.dot(b.cross(c)) / 6.0
        };
        (0..self.triangles.len() as u32).map(under).sum()
    }

    /// Unit outward normal of a triangle; zero for a triangle without area.
    #[inline]
    pub fn geometric_normal(&self, triangle: u32) -> Vec3 {
        self.scaled_normal(triangle).normalize_or_zero().as_vec3()
    }

    /// The point a + u (b - a) + v (c - a) of a triangle.
    #[inline]
    pub fn point(&self, triangle: u32, u: f64, v: f64) -> SurfacePoint {
        let [a, b, c] = self.corners(triangle);
        let n_geometric = self.geometric_normal(triangle);
        let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
        SurfacePoint {
            x: a * (1.0 - u - v) + b * u + c * v,
            n_geometric,
            n: self.shading_normal(triangle, u as f32, v as f32, n_geometric),
            uv: self.uv_at(triangle, u as f32, v as f32),
            error: self.precision.error(largest),
        }
    }

    /// Where the line through `origin` along `direction` meets the plane of a triangle; `None` where it does not.
    pub fn crossing(&self, triangle: u32, origin: DVec3, direction: DVec3) -> Option<DVec3> {
        let n = self.scaled_normal(triangle);
        let t = (self.corners(triangle)[0] - origin).dot(n) / direction.dot(n);
        t.is_finite().then(|| origin + direction * t)
    }

    /// Interpolated normal, kept on the side of `n_geometric`; the geometric one where there is none or
    /// where the file's normals cancel.
    fn shading_normal(&self, triangle: u32, u: f32, v: f32, n_geometric: Vec3) -> Vec3 {
        let Some(normals) = &self.normals else { return n_geometric };
        let [a, b, c] = normals.triangles[triangle as usize].map(|i| normals.vectors[i as usize]);
        let n = (a * (1.0 - u - v) + b * u + c * v).normalize_or(n_geometric);
        if n.dot(n_geometric) < 0.0 { -n } else { n }
    }

    /// Interpolated texture coordinates; 0 without any.
    #[inline]
    fn uv_at(&self, triangle: u32, u: f32, v: f32) -> [f32; 2] {
        let Some(all) = &self.uv else { return [0.0; 2] };
        let [a, b, c] = all[triangle as usize];
        std::array::from_fn(|k| a[k] * (1.0 - u - v) + b[k] * u + c[k] * v)
    }

    /// Derivatives of a triangle's points by their texture coordinates \[unit\]; `None` where these do not span it.
    pub fn tangents(&self, triangle: u32) -> Option<[Vec3; 2]> {
        let [a, b, c] = self.corners(triangle);
        let [s, t, r] = self.uv.as_ref()?[triangle as usize].map(|uv| uv.map(f64::from));
        let ([u1, v1], [u2, v2]) = ([t[0] - s[0], t[1] - s[1]], [r[0] - s[0], r[1] - s[1]]);
        let determinant = u1 * v2 - u2 * v1;
        let along = |p: f64, q: f64| (((b - a) * p - (c - a) * q) * (1.0 / determinant)).as_vec3();
        let tangents = [along(v2, v1), along(-u2, -u1)];
        (determinant != 0.0 && tangents.iter().all(|t| t.is_finite())).then_some(tangents)
    }

    /// Memory of vertices, triangles, normals and texture coordinates.
    pub fn bytes(&self) -> usize {
        let normals = self.normals.as_ref().map_or(0, |n| size_of_val(&*n.vectors) + size_of_val(&*n.triangles));
        let uv = self.uv.as_ref().map_or(0, |uv| size_of_val(&**uv));
        size_of_val(&*self.positions) + size_of_val(&*self.triangles) + normals + uv
    }

    /// A hash of every bit of the mesh.
    pub fn fingerprint(&self) -> u64 {
        let point = |state: u64, p: &Vec3| p.to_array().iter().fold(state, |s, x| hash_combine(s, x.to_bits().into()));
        let index = |state: u64, t: &[u32; 3]| t.iter().fold(state, |s, &i| hash_combine(s, i.into()));
        let place = |state: u64, p: &DVec3| p.to_array().iter().fold(state, |s, x| hash_combine(s, x.to_bits()));
        let mut state = self.positions.iter().fold(self.positions.len() as u64, place);
        state = self.triangles.iter().fold(state, index);
        if let Some(normals) = &self.normals {
            state = normals.vectors.iter().fold(hash_combine(state, 1), point);
            state = normals.triangles.iter().fold(state, index);
        }
        let numbers = self.uv.iter().flatten().flatten().flatten();
        numbers.fold(state, |state, x| hash_combine(state, x.to_bits().into()))
    }

    /// The box around all vertices [unit]; `None` without vertices.
    pub fn bounds(&self) -> Option<Aabb> {
        (!self.positions.is_empty()).then(|| Aabb::around(self.positions.iter().copied()))
    }
}

impl SurfacePoint {
    /// The same point seen from the side that `direction` leaves to: normals turned into its half space.
    #[inline]
    #[must_use]
    pub fn facing(mut self, direction: Vec3) -> Self {
        if self.n_geometric.dot(direction) < 0.0 {
            self.n_geometric = -self.n_geometric;
            self.n = -self.n;
        }
        self
    }

    /// The shading normal, bent towards the geometric one as far as it takes for light mirrored into the unit direction
    /// `w` to come from above the surface; `w` is above it, and the point [`Self::facing`] it. Coarse triangles carry
    /// normals that look past the viewer: unbent, Fresnel's transmittance would draw dark lines along creases.
    #[inline]
    pub fn normal_seen_from(&self, w: Vec3) -> Vec3 {
        let least = LEAST_ELEVATION.min(0.9 * self.n_geometric.dot(w));
        let mirrored = self.n * (2.0 * self.n.dot(w).max(0.0)) - w;
        let elevation = self.n_geometric.dot(mirrored);
        if elevation >= least {
            return self.n;
        }
        // Lift the mirrored direction to the least elevation; the normal is half-way to it.
        let lifted = (mirrored + self.n_geometric * (least - elevation)).normalize_or(self.n_geometric);
        (w + lifted).normalize_or(self.n_geometric)
    }

    /// Where a ray into `direction` starts so that it cannot meet the surface it leaves: moved along the
    /// geometric normal, to the side of `direction`, by the bound of the error. Scales with the scene.
    #[inline]
    pub fn leave(&self, direction: Vec3) -> DVec3 {
        self.aside(direction, self.error)
    }

    /// Where a segment along `w` ends that comes from `from`, a place known up to `error`: as [`Self::leave`] against `w`, and at
    /// least as far from the surface as rounding can move the segment's end.
    #[inline]
    pub fn arrive(&self, w: Vec3, from: DVec3, error: f64) -> DVec3 {
        self.aside(-w, self.error.max(error).max(SEGMENT_ERROR * from.distance(self.x)))
    }

    #[inline]
    fn aside(&self, direction: Vec3, distance: f64) -> DVec3 {
        let offset = self.n_geometric.as_dvec3() * distance;
        if self.n_geometric.dot(direction) < 0.0 { self.x - offset } else { self.x + offset }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(n: Vec3) -> SurfacePoint {
        SurfacePoint { x: DVec3::ZERO, n_geometric: Vec3::Z, n: n.normalize(), uv: [0.0; 2], error: 0.0 }
    }

    #[test]
    fn a_normal_that_mirrors_upwards_stays_and_one_that_does_not_is_bent() {
        let w = Vec3::new(0.6, 0.0, 0.8);
        let harmless = point(Vec3::new(0.1, 0.2, 1.0));
        assert_eq!(harmless.normal_seen_from(w), harmless.n);
        for n in
            [Vec3::new(-1.0, 0.0, 0.1), Vec3::new(-0.8, 0.1, 0.6), Vec3::new(1.0, 0.0, 0.01), Vec3::new(0.0, 1.0, 1e-3)]
        {
            let bent = point(n).normal_seen_from(w);
            let mirrored = bent * (2.0 * bent.dot(w)) - w;
            assert!((bent.length() - 1.0).abs() < 1e-6 && bent.dot(w) > 0.0, "{n}: {bent}");
            assert!(mirrored.z > 0.009, "{n}: {bent} mirrors to {mirrored}");
        }
    }

    #[test]
    fn the_bend_is_continuous_where_it_begins() {
        let w = Vec3::new(0.6, 0.0, 0.8);
        let bent = |angle: f32| point(Vec3::new(angle.sin(), 0.0, angle.cos())).normal_seen_from(w);
        for i in 0..3000 {
            let angle = -1.5 + i as f32 * 1e-3;
            assert!(bent(angle).distance(bent(angle + 1e-3)) < 5e-3, "jump at {angle}");
        }
    }
}
