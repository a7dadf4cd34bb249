//! The variance of each pixel of a picture, as a layer beside it.

use super::{Film, Image};
use crate::math::Rgb;

/// Pixels to each side whose halves judge the level of a pixel's variance.
const REACH: usize = 7;

/// Variance of the mean radiance per pixel and channel; none before both halves have a pass and two passes are in.
///
/// The spread of a pixel's samples tells where noise is, but not how much of it the sequence removed; the squared
/// difference of the two independent halves has the right expectation, but is a single number with a relative standard
/// error of 1.4. So the spread is scaled by the ratio of the two over the 15x15 pixels around. Everything comes from the
/// film's sums: films that were joined give the variance of the whole.
pub fn variance(film: &Film) -> Option<Image> {
    let n = film.half_passes().map(f64::from);
    let [even, odd] = film.half_images().filter(|_| n[0] * n[1] > 0.0)?;
    let mut spread = film.variance()?;
    let scale = n[0] * n[1] / (n[0] + n[1]).powi(2);
    let (width, height) = (film.window().width(), film.window().height());
    for c in 0..3 {
        let squares = (0..width * height).map(|i| {
            let difference = f64::from(even.pixels[i][c]) - f64::from(odd.pixels[i][c]);
            scale * difference * difference
        });
        let squares = around(squares.collect(), width, height);
        let spreads = around(spread.pixels.iter().map(|p| f64::from(p[c])).collect(), width, height);
        for (pixel, (halves, spread)) in spread.pixels.iter_mut().zip(squares.iter().zip(&spreads)) {
            let ratio = if *spread > 0.0 { halves / spread } else { 0.0 };
            *pixel = Rgb::from_fn(|k| if k == c { (f64::from(pixel[c]) * ratio) as f32 } else { pixel[k] });
        }
    }
    Some(spread)
}

/// Sums over the square of [`REACH`] about each value, as far as the picture goes.
fn around(values: Vec<f64>, width: usize, height: usize) -> Vec<f64> {
    let pass = |values: &[f64], along: usize, across: usize, step: usize, next: usize| {
        let mut out = vec![0.0; values.len()];
        for line in 0..across {
            for i in 0..along {
                let near = i.saturating_sub(REACH)..(i + REACH + 1).min(along);
                out[line * next + i * step] = near.map(|k| values[line * next + k * step]).sum();
            }
        }
        out
    };
    let rows = pass(&values, width, height, 1, width);
    pass(&rows, height, width, width, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Window;
    use crate::math::hash;

    /// Pixels of independent noise, uniform in 0..1 in the left half of the picture and 0..2 in the right.
    #[test]
    fn the_variance_is_that_of_the_mean() {
        let window = Window::full([60, 40]);
        let mut film = Film::new([60, 40], window).unwrap();
        let passes = 64;
        for pass in 0..passes {
            let value = |i: usize| {
                let u = (hash(pass * 10_000 + i as u64 + 1) >> 40) as f32 / (1 << 24) as f32;
                Rgb::splat(u * if i % 60 < 30 { 1.0 } else { 2.0 })
            };
            film.add(window, &(0..window.area()).map(value).collect::<Vec<_>>());
            film.end_pass();
        }
        let variance = variance(&film).unwrap();
        for (columns, truth) in [(0..20, 1.0 / 12.0), (40..60, 4.0 / 12.0)] {
            let of = |i: usize| f64::from(variance.pixels[i][0]);
            let some: Vec<f64> = (0..window.area()).filter(|i| columns.contains(&(i % 60))).map(of).collect();
            let mean = some.iter().sum::<f64>() / some.len() as f64 * passes as f64 / truth;
            // 800 pixels, each a square with relative deviation 1.4: 5 %; 6 of them.
            assert!((mean - 1.0).abs() < 0.3, "{mean}");
            // A pixel's own is known to some 20 %, by 225 pixels around it and its own 64 samples.
            assert!(some.iter().all(|v| (0.3..3.0).contains(&(v * passes as f64 / truth))));
        }
    }

    #[test]
    fn a_single_pass_has_no_variance() {
        let mut film = Film::new([4, 4], Window::full([4, 4])).unwrap();
        film.add(film.window(), &[Rgb::splat(1.0); 16]);
        film.end_pass();
        assert!(variance(&film).is_none());
    }
}
