//! Where the samples of a pixel lie: drawn from its filter, so that each counts as one [ESG06].

use std::sync::Arc;

/// A filter of a pixel: the density of its samples around its middle, the same across and down.
#[derive(Clone, Debug, Default)]
pub struct PixelFilter(Option<Arc<Table>>);

/// Cells of equal width over a filter; the density is linear in each.
const CELLS: usize = 1024;

#[derive(Debug)]
struct Table {
    /// Half of the filter's width [pixels].
    radius: f64,
    /// Density at the cells' ends, up to a factor.
    density: Vec<f64>,
    /// Its integral up to there, 0 to 1.
    below: Vec<f64>,
}

impl PixelFilter {
    /// A Gaussian cut off at `radius` [pixels], four standard deviations from the pixel's middle.
    pub fn gaussian(radius: f64) -> Self {
        Self::new(radius, |x| (-8.0 * x * x).exp())
    }

    /// The window of four terms by Blackman and Harris [Har78], 0 at `radius` [pixels] and beyond.
    pub fn blackman_harris(radius: f64) -> Self {
        let term = |k: f64, x: f64| (std::f64::consts::PI * k * x).cos();
        Self::new(radius, move |x| 0.35875 + 0.48829 * term(1.0, x) + 0.14128 * term(2.0, x) + 0.01168 * term(3.0, x))
    }

    /// By its density over -1 to 1.
    fn new(radius: f64, density: impl Fn(f64) -> f64) -> Self {
        let density: Vec<f64> = (0..=CELLS).map(|i| density(2.0 * i as f64 / CELLS as f64 - 1.0).max(0.0)).collect();
        let mut sum = 0.0;
        let sums = density.windows(2).map(|w| {
            sum += w[0] + w[1];
            sum
        });
        let below: Vec<f64> = std::iter::once(0.0).chain(sums).collect();
        let below = below.iter().map(|s| s / below[CELLS]).collect();
        Self(Some(Arc::new(Table { radius, density, below })))
    }

    /// The place of a sample, the pixel reaching from 0 to 1, for numbers in [0,1). Without a table, the box: the numbers themselves.
    #[inline]
    pub fn offset(&self, u: [f32; 2]) -> [f32; 2] {
        match &self.0 {
            None => u,
            Some(table) => u.map(|u| (0.5 + table.place(f64::from(u))) as f32),
        }
    }

    /// How far it reaches beyond the pixel [pixels].
    pub fn reach(&self) -> f32 {
        self.0.as_ref().map_or(0.0, |table| (table.radius - 0.5).max(0.0) as f32)
    }
}

impl Table {
    /// The distance from the pixel's middle below which a share `u` of the filter lies [pixels].
    fn place(&self, u: f64) -> f64 {
        let cell = self.below.partition_point(|b| *b <= u).clamp(1, CELLS) - 1;
        let share = (u - self.below[cell]) / (self.below[cell + 1] - self.below[cell]);
        let [a, b] = [self.density[cell], self.density[cell + 1]];
        // The root of the integral of a + (b - a) t, without cancellation.
        let root = a + (a * a + share * (b * b - a * a)).max(0.0).sqrt();
        let within = if root > 0.0 { (share * (a + b) / root).clamp(0.0, 1.0) } else { 0.0 };
        self.radius * (2.0 * (cell as f64 + within) / CELLS as f64 - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{GaussLegendre, hash, unit_f32};

    fn gaussian(x: f64) -> f64 {
        (-8.0 * x * x).exp()
    }

    /// As printed, over the window from 0 to 1.
    fn blackman_harris(x: f64) -> f64 {
        let t = std::f64::consts::TAU * 0.5 * (x + 1.0);
        0.35875 - 0.48829 * t.cos() + 0.14128 * (2.0 * t).cos() - 0.01168 * (3.0 * t).cos()
    }

    /// Chi-square of 2^18 offsets in 60 bins of equal width against a density over -1 to 1; bins of few draws go together.
    fn chi_square(filter: &PixelFilter, radius: f64, density: impl Fn(f64) -> f64) -> f64 {
        const BINS: usize = 60;
        let draws = 1_u64 << 18;
        let mut counts = [[0.0; BINS]; 2];
        for i in 0..draws {
            let u = [unit_f32((hash(2 * i) >> 32) as u32), unit_f32((hash(2 * i + 1) >> 32) as u32)];
            for (counts, at) in counts.iter_mut().zip(filter.offset(u)) {
                let x = (f64::from(at) - 0.5) / radius;
                assert!(x.abs() <= 1.000_001, "{x}");
                counts[(((x + 1.0) * 0.5 * BINS as f64) as usize).min(BINS - 1)] += 1.0;
            }
        }
        let end = |i: usize| 2.0 * i as f64 / BINS as f64 - 1.0;
        let rule = GaussLegendre::new(16);
        let masses: Vec<f64> = (0..BINS).map(|i| rule.integrate_panels(end(i), end(i + 1), 4, &density)).collect();
        let all: f64 = masses.iter().sum();
        let mut worst = 0.0_f64;
        for counts in counts {
            let (mut sum, mut rest) = (0.0, [0.0; 2]);
            for (n, mass) in counts.iter().zip(&masses) {
                let e = mass / all * draws as f64;
                if e < 20.0 { rest = [rest[0] + n, rest[1] + e] } else { sum += (n - e) * (n - e) / e }
            }
            worst = worst.max(sum + (rest[0] - rest[1]).powi(2) / rest[1].max(1.0));
        }
        worst
    }

    #[test]
    fn samples_lie_as_the_filters_say() {
        // 60 bins: mean 60, standard deviation 11.
        let most = 60.0 + 6.0 * 11.0;
        for radius in [0.5, 1.5, 2.0, 8.0] {
            let [g, b] = [PixelFilter::gaussian(radius), PixelFilter::blackman_harris(radius)];
            let [cg, cb] = [chi_square(&g, radius, gaussian), chi_square(&b, radius, blackman_harris)];
            assert!(cg < most && cb < most, "radius {radius}: {cg} {cb}");
            assert!(chi_square(&g, radius, blackman_harris) > 1000.0, "one for the other");
        }
    }

    #[test]
    fn the_box_is_the_numbers_themselves() {
        for u in [[0.0, 0.999_999_94], [0.25, 0.5]] {
            assert_eq!(PixelFilter::default().offset(u), u);
        }
        assert_eq!((PixelFilter::default().reach(), PixelFilter::gaussian(2.0).reach()), (0.0, 1.5));
    }

    /// Stratified numbers give the filter's moments: standard deviation a quarter of the radius, and a mean in the middle.
    #[test]
    fn the_mean_is_the_pixels_middle() {
        let filter = PixelFilter::gaussian(2.0);
        let n = 4096;
        let at = |i: i32| f64::from(filter.offset([(i as f32 + 0.5) / n as f32, 0.5])[0]) - 0.5;
        let mean = (0..n).map(at).sum::<f64>() / f64::from(n);
        let square = (0..n).map(|i| at(i).powi(2)).sum::<f64>() / f64::from(n);
        assert!(mean.abs() < 1e-6 && (square.sqrt() - 0.5).abs() < 2e-3, "{mean} {}", square.sqrt());
    }
}
