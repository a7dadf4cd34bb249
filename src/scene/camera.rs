//! A pinhole camera.

use crate::math::{DVec3, Vec3};
use crate::query::Ray;

/// A perspective camera; the film's row 0 is at the top, x grows to the right.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Pixels across and down.
    pub resolution: [u32; 2],
    /// Pinhole \[unit\], relative to the scene's centre.
    pub origin: DVec3,
    /// Unit direction of view.
    forward: Vec3,
    /// Film axis to the right, its length half the film's width at distance 1.
    right: Vec3,
    /// Film axis upwards, its length half the film's height at distance 1.
    up: Vec3,
}

impl Camera {
    /// A camera at `origin` looking along `forward`; `up` need not be orthogonal. `half_width` and `half_height`
    /// are the tangents of half the angles of view. `None` if `forward` and `up` are parallel or zero.
    pub fn new(
        resolution: [u32; 2],
        origin: DVec3,
        forward: Vec3,
        up: Vec3,
        half_width: f32,
        half_height: f32,
    ) -> Option<Self> {
        let forward = forward.try_normalize()?;
        let right = forward.cross(up).try_normalize()?;
        let up = right.cross(forward);
        Some(Self { resolution, origin, forward, right: right * half_width, up: up * half_height })
    }

    /// Unit direction of view.
    pub fn forward(&self) -> Vec3 {
        self.forward
    }

    /// The ray through `offset` in [0,1)² of a pixel.
    #[inline]
    pub fn ray(&self, pixel: [u32; 2], offset: [f32; 2]) -> Ray {
        let [x, y] = [0, 1].map(|a| (pixel[a] as f32 + offset[a]) / self.resolution[a] as f32 * 2.0 - 1.0);
        Ray::new(self.origin, (self.forward + self.right * x - self.up * y).normalize())
    }
}
