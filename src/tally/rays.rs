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
    /// What was asked of each light.
    pub lights: LightTally,
}

/// Lights that are counted apart; those after them are counted together with the last.
pub const LIGHTS: usize = 32;

/// For each light how often it was asked for, and how often light came from it. A light has the number that
/// `light::Lights` gives it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(into = "Vec<[u64; 2]>", from = "Vec<[u64; 2]>")]
pub struct LightTally([[u64; 2]; LIGHTS]);

impl LightTally {
    /// A ray was sent to find out whether light of number `light` arrives, and did or did not find it.
    #[inline]
    pub fn ask(&mut self, light: usize, arrives: bool) {
        let count = &mut self.0[light.min(LIGHTS - 1)];
        count[0] += 1;
        count[1] += u64::from(arrives);
    }

    /// A path met light of number `light` by chance.
    #[inline]
    pub fn meet(&mut self, light: usize) {
        self.0[light.min(LIGHTS - 1)][1] += 1;
    }

    /// How often light of number `light` was asked for, and how often it came, by asking or by chance.
    pub fn of(&self, light: usize) -> [u64; 2] {
        self.0[light.min(LIGHTS - 1)]
    }
}

impl From<LightTally> for Vec<[u64; 2]> {
    fn from(tally: LightTally) -> Self {
        let used = tally.0.iter().rposition(|n| *n != [0, 0]).map_or(0, |last| last + 1);
        tally.0[..used].to_vec()
    }
}

impl From<Vec<[u64; 2]>> for LightTally {
    fn from(counts: Vec<[u64; 2]>) -> Self {
        let mut tally = Self::default();
        for (to, from) in tally.0.iter_mut().zip(counts) {
            *to = from;
        }
        tally
    }
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
        for (to, from) in self.lights.0.iter_mut().flatten().zip(other.lights.0.iter().flatten()) {
            *to += from;
        }
    }
}
