//! How many rays of which kind were traced.

/// Rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct RayTally {
    /// From the camera.
    pub camera: u64,
    /// Any-hit rays: shadow and occlusion.
    pub shadow: u64,
    /// Nearest-hit rays that leave a surface: reflections, cosine-sampled light.
    pub bounce: u64,
}

impl RayTally {
    /// All kinds together.
    pub fn total(&self) -> u64 {
        self.camera + self.shadow + self.bounce
    }
}

impl std::ops::AddAssign for RayTally {
    fn add_assign(&mut self, other: Self) {
        self.camera += other.camera;
        self.shadow += other.shadow;
        self.bounce += other.bounce;
    }
}
