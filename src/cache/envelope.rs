//! How fast S_d falls with the distance, in a table: what decides where a cut may be coarse. Only the noise of an estimate
//! depends on it, never its mean.

use crate::bssrdf::{BetterDipole, Bssrdf, Partition, Radial};
use crate::math::Vec4;
use crate::optics::Medium;

/// Table rows per octave of r².
const STEPS: u32 = 4;
/// Bits of an f32 below a step.
const SHIFT: u32 = 23 - STEPS.trailing_zeros();
/// Octaves of r² covered to each side of the medium's own scale, so that a scene and the same one scaled see the same table.
const OCTAVES: u32 = 60;

/// S_d and its slope at one distance, up to a common factor.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fall {
    /// S_d per channel; the fourth is 0.
    pub value: Vec4,
    /// -dS_d/dr per channel [value/unit]; the fourth is 0.
    pub slope: Vec4,
}

/// [`Fall`] by distance.
pub struct Envelope {
    rows: Vec<Fall>,
    /// Upper bits of r² [unit²] at the first row.
    first: u32,
    /// Decay per channel [1/unit].
    decay: [f32; 3],
    /// Variation of S_d over members of a node that does not come from the distance, relative: from directions or depths.
    pub other: f32,
}

/// Upper bits of the r² [unit²] that lies [`OCTAVES`] below the square of the medium's shortest transport mean free path.
fn first_row(medium: &Medium) -> u32 {
    let sigma = medium.sigma_t_prime().max();
    let square = 1.0 / (sigma * sigma);
    // Biased exponents of f32 are 1 to 254; a medium without scattering takes the middle.
    let exponent = if square.is_normal() { (square.to_bits() >> 23).clamp(OCTAVES + 1, 254 - OCTAVES) } else { 127 };
    (exponent - OCTAVES) << (23 - SHIFT)
}

impl Envelope {
    /// Of `model` of `medium`. Models of more than the distance take the better dipole's.
    pub fn new(model: &dyn Bssrdf, medium: &Medium) -> Self {
        let proxy = BetterDipole::new(medium, true);
        let radial: &dyn Radial = model.radial().unwrap_or(&proxy);
        let other = model.variation();
        let count = 2 * OCTAVES * STEPS;
        let first = first_row(medium);
        let distance = |i: u32| f32::from_bits((first + i) << SHIFT).sqrt();
        let finite = |v: f32| if v > 0.0 { v.min(1e30) } else { 0.0 };
        let rows = (0..count)
            .map(|i| {
                let (near, far) = (distance(i), distance(i + 1));
                let (a, b) = (radial.exitance(near), radial.exitance(far));
                let mut fall = Fall::default();
                for c in 0..3 {
                    fall.value[c] = finite(a[c]);
                    fall.slope[c] = finite((a[c] - b[c]) / (far - near));
                }
                fall
            })
            .collect();
        Self { rows, first, decay: medium.sigma_tr().0, other }
    }

    /// S_d at √`r2` ≥ 0, of each channel stretched until its decay length is at least `least` [unit], its integral over the
    /// plane kept.
    #[inline]
    pub fn widened(&self, r2: f32, least: f32) -> Vec4 {
        let scale = self.decay.map(|decay| if decay * least > 1.0 { 1.0 / (decay * least) } else { 1.0 });
        if scale == [1.0; 3] {
            return self.at(r2).value;
        }
        let mut value = Vec4::ZERO;
        for c in 0..3 {
            let area = scale[c] * scale[c];
            value[c] = area * self.at(r2 * area).value[c];
        }
        value
    }

    /// ∫ (S_d share)² dA / (∫ S_d dA)² on a plane, the largest of the channels [1/unit²], where `share` is that of
    /// `part`: times the area of a sample the relative variance of a sum of independent ones. 0 where no channel scatters.
    pub fn variance_per_area(&self, part: Partition) -> f64 {
        let (mut first, mut second) = ([0.0; 3], [0.0; 3]);
        for (i, fall) in self.rows.iter().enumerate() {
            let r2 = |i: usize| f64::from(f32::from_bits((self.first + i as u32) << SHIFT));
            let ring = std::f64::consts::PI * (r2(i + 1) - r2(i));
            let share = f64::from(part.share((0.5 * (r2(i) + r2(i + 1))) as f32));
            for c in 0..3 {
                let value = f64::from(fall.value[c]);
                first[c] += value * ring;
                second[c] += (value * share).powi(2) * ring;
            }
        }
        (0..3).map(|c| if first[c] > 0.0 { second[c] / first[c].powi(2) } else { 0.0 }).fold(0.0, f64::max)
    }

    /// At the largest tabulated distance up to √`r2`, `r2` ≥ 0 [unit²].
    #[inline]
    pub fn at(&self, r2: f32) -> &Fall {
        let row = (r2.to_bits() >> SHIFT).saturating_sub(self.first);
        &self.rows[(row as usize).min(self.rows.len() - 1)]
    }
}
