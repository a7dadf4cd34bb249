//! Where on the surface the samples of a cache are spent: evenly by area, or where light enters that the camera gets to see.
//! Any density gives the same mean; each sample is weighted by its inverse.

/// Share of the samples that is spread by area all the same: what the trial overlooked is still met, with a weight of at
/// most its inverse.
const EVEN: f64 = 0.5;

/// Chance per area relative to an even spread, constant in bins of equal area along the area table.
pub struct Density {
    /// Chance of all bins before each, and of all: rises from 0 to 1.
    cumulative: Vec<f64>,
}

impl Density {
    /// Evenly by area.
    pub fn even() -> Self {
        Self { cumulative: vec![0.0, 1.0] }
    }

    /// One over the density in bin `bin` of `bins`.
    pub(super) fn weight(&self, bin: usize, bins: usize) -> f64 {
        f64::from(self.place(self.cumulative[(self.cumulative.len() - 1) * bin / bins]).1)
    }

    pub(super) fn of(bins: &[f64]) -> Self {
        let total: f64 = bins.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return Self::even();
        }
        let even = 1.0 / bins.len() as f64;
        let mut cumulative = vec![0.0];
        let mut sum = 0.0;
        for bin in bins {
            sum += EVEN * even + (1.0 - EVEN) * bin / total;
            cumulative.push(sum);
        }
        cumulative.iter_mut().for_each(|c| *c /= sum);
        Self { cumulative }
    }

    /// The place along the area table for a number in [0, 1), and one over its density relative to an even spread.
    #[inline]
    pub fn place(&self, u: f64) -> (f64, f32) {
        let bins = self.cumulative.len() - 1;
        let bin = self.cumulative[1..bins].partition_point(|&c| c <= u);
        let (low, chance) = (self.cumulative[bin], self.cumulative[bin + 1] - self.cumulative[bin]);
        let even = 1.0 / bins as f64;
        // Rounding must not reach the next bin.
        let within = ((u - low) / chance).clamp(0.0, 1.0 - f64::EPSILON);
        ((bin as f64 + within) * even, (even / chance) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_rise_with_the_number_and_weights_are_inverse_densities() {
        let density = Density::of(&[0.0, 1.0, 3.0, 0.0]);
        let (mut before, mut mean) = (-1.0, 0.0);
        let n = 100_000;
        let mut counts = [0_u32; 4];
        for i in 0..n {
            let (pick, weight) = density.place((f64::from(i) + 0.5) / f64::from(n));
            assert!(pick > before && pick < 1.0);
            before = pick;
            counts[(pick * 4.0) as usize] += 1;
            // ∫ x² over the unit interval is a third.
            mean += f64::from(weight) * pick * pick / f64::from(n);
        }
        assert!((mean - 1.0 / 3.0).abs() < 1e-4, "{mean}");
        assert!(counts[2] > counts[1] && counts[1] > counts[0] && counts[0] > n / 25, "{counts:?}");
    }

    #[test]
    fn darkness_and_the_ends_of_the_interval_have_a_place() {
        for density in [Density::even(), Density::of(&[0.0; 8]), Density::of(&[f64::NAN; 8]), Density::of(&[1.0, 0.0])]
        {
            for u in [0.0, 0.5, 1.0 - f64::EPSILON, 1.0] {
                let (pick, weight) = density.place(u);
                assert!((0.0..1.0).contains(&pick) && weight > 0.0 && weight <= 1.0 / EVEN as f32, "{pick} {weight}");
            }
        }
    }
}
