//! Where a light is and where it shines, alone or together with others.

use crate::math::{Aabb, DQuat, DVec3};
use std::f64::consts::PI;

/// Bounds of what one light, or several, send to a place.
#[derive(Clone, Copy, Debug)]
pub struct LightBounds {
    /// The box around them.
    pub bounds: Aabb,
    /// Into the direction of the most [radiance unit x unit²], mean over the channels, all of them together.
    pub intensity: f64,
    /// Their normals.
    pub normals: Cone,
    /// Angle from a normal beyond which nothing is sent \[rad\], at most π/2.
    pub falloff: f64,
    /// Whether the back shines like the front.
    pub two_sided: bool,
}

impl LightBounds {
    /// Both together.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.join(other.bounds),
            intensity: self.intensity + other.intensity,
            normals: self.normals.join(other.normals),
            falloff: self.falloff.max(other.falloff),
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// What is to be small in a tree [CEK18]: intensity times the solid angle that it goes to times the size. The size is the square
    /// of the diagonal, for it is a sphere that [`super::Choice`] takes around a node.
    pub fn cost(&self) -> f64 {
        let inner = self.normals.half;
        let outer = (inner + self.falloff).min(PI);
        let rim = 2.0 * outer * inner.sin() - (inner - 2.0 * outer).cos() - 2.0 * inner * inner.sin() + inner.cos();
        let solid_angle = 2.0 * PI * (1.0 - inner.cos()) + 0.5 * PI * rim;
        self.intensity * solid_angle * self.bounds.extent().length_squared()
    }
}

/// Unit vectors within an angle of an axis.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// The axis.
    pub axis: DVec3,
    /// The angle \[rad\]; π holds all.
    pub half: f64,
}

impl Cone {
    const ALL: Self = Self { axis: DVec3::Z, half: PI };

    /// The cone about `axis`, of any length, that holds the directions of all vectors; those of length 0 have none.
    pub fn around(axis: DVec3, vectors: impl Iterator<Item = DVec3>) -> Self {
        let axis = axis.normalize_or_zero();
        if axis == DVec3::ZERO {
            return Self::ALL;
        }
        let cosine = |v: DVec3| v.normalize_or(axis).dot(axis);
        Self { axis, half: vectors.map(cosine).fold(1.0, f64::min).clamp(-1.0, 1.0).acos() }
    }

    /// A cone around both.
    fn join(self, other: Self) -> Self {
        let (wide, narrow) = if self.half >= other.half { (self, other) } else { (other, self) };
        let apart = wide.axis.angle_between(narrow.axis);
        if (apart + narrow.half).min(PI) <= wide.half {
            return wide;
        }
        let half = 0.5 * (wide.half + apart + narrow.half);
        let turn = wide.axis.cross(narrow.axis).normalize_or_zero();
        if half >= PI || turn == DVec3::ZERO {
            return Self::ALL;
        }
        Self { axis: DQuat::from_axis_angle(turn, half - wide.half) * wide.axis, half }
    }
}
