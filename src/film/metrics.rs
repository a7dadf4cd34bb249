//! How far one picture is from another, with 95 % intervals; and from its own limit, by half-buffers.
//!
//! Errors of neighbouring pixels are not independent here: all pixels of a pass share one sample cache, and its
//! noise is smooth over many pixels. An interval that counts pixels would be far too narrow. So the interval of
//! every figure comes from the spread between blocks of 16x16 pixels, by the delta method for a ratio of sums
//! [Cochran 1977, section 6]: no random numbers, hence the same interval each time, and cheap enough for every
//! pass; a bootstrap over the same blocks gives the same to first order. Two things to know:
//!
//! * Blocks differ also because the scene does; that widens the interval, it does not narrow it.
//! * An error that all blocks share (a pass's brightness as a whole) is not in the spread between blocks. It shows
//!   in the ratio of the means, and in other seeds.

use super::{Film, Image, Window};
use crate::math::Rgb;
use crate::{Error, ErrorKind, Result};
use serde::Serialize;

/// Side of the blocks whose spread gives the intervals \[pixels\].
pub const BLOCK: u32 = 16;

/// Share of pixels left out of the trimmed figures: those with the largest error.
pub const TRIMMED: f64 = 0.001;

/// A figure and where its expectation lies with 95 % confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The figure itself.
    pub value: f64,
    /// Lower and upper end; none where fewer than two blocks have pixels.
    pub interval: Option<[f64; 2]>,
}

/// Errors over a set of pixels; each is a mean over pixels and the three channels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Pixels in the set.
    pub pixels: usize,
    /// sqrt(mean((x - ref)^2)), in the unit of the picture.
    pub rmse: Estimate,
    /// The same without the worst 0.1 % of the pixels (by their squared error).
    pub rmse_trimmed: Estimate,
    /// mean((x - ref)^2 / (ref^2 + 0.01 mean(ref)^2)), with mean(ref) over the set and the channels. None where the
    /// reference is black.
    pub relmse: Option<Estimate>,
    /// The same without the worst 0.1 % of the pixels (by their relative squared error); mean(ref) as before.
    pub relmse_trimmed: Option<Estimate>,
}

/// A picture against its reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// [width, height] of the whole picture.
    pub resolution: [u32; 2],
    /// The pixels that both have.
    pub window: Window,
    /// Pixels of the picture with a channel that is NaN or infinite; they are in no figure.
    pub non_finite: usize,
    /// The same of the reference.
    pub non_finite_reference: usize,
    /// Over all pixels.
    pub whole: Errors,
    /// Over the pixels of the mask, if there is one.
    pub interior: Option<Errors>,
    /// mean(x) / mean(ref) per channel R, G, B, over all pixels. None where the reference's mean is 0.
    pub mean_ratio: [Option<Estimate>; 3],
    /// max |x - ref| over pixels and channels.
    pub max_difference: f64,
    /// Where that is: pixel [x, y] of the whole picture.
    pub max_pixel: [u32; 2],
    /// Where that is: channel, 0 to 2.
    pub max_channel: usize,
    /// Share of the worst pixel in the relMSE over all pixels; none without an error, or where the reference is black.
    pub worst_share: Option<f64>,
    /// Which that is, [x, y] of the whole picture.
    pub worst_pixel: [u32; 2],
}

/// Compares `image` with `reference`. `interior` marks, in the order of the pixels, those that also count on their
/// own: usually pixels whose whole footprint lies on an object, so that silhouettes do not decide.
///
/// # Errors
/// Usage if the resolutions, the windows or the mask's length differ; Numeric if no pixel is finite in both.
pub fn compare(image: &Image, reference: &Image, interior: Option<&[bool]>) -> Result<Comparison> {
    same_size(image, reference)?;
    let (x, r) = (&image.pixels, &reference.pixels);
    let finite: Vec<bool> = x.iter().zip(r).map(|(x, r)| x.is_finite() && r.is_finite()).collect();
    if !finite.contains(&true) {
        return Err(Error::new(ErrorKind::Numeric, "no pixel is a finite number in both pictures"));
    }
    let interior = match interior {
        Some(mask) if mask.len() != x.len() => {
            return Err(Error::usage(format!("a mask of {} for {} pixels", mask.len(), x.len())));
        }
        Some(mask) => {
            let both: Vec<bool> = mask.iter().zip(&finite).map(|(m, f)| *m && *f).collect();
            both.contains(&true).then(|| errors(image.window, x, r, 1.0, &both))
        }
        None => None,
    };
    let mut max = (0.0, image.window.pixel(0), 0);
    for i in (0..x.len()).filter(|&i| finite[i]) {
        for c in 0..3 {
            let difference = (f64::from(x[i][c]) - f64::from(r[i][c])).abs();
            if difference > max.0 {
                max = (difference, image.window.pixel(i), c);
            }
        }
    }
    let (worst, worst_share) = worst_of(x, r, &finite);
    let not_finite = |pixels: &[Rgb]| pixels.iter().filter(|p| !p.is_finite()).count();
    Ok(Comparison {
        resolution: image.resolution,
        window: image.window,
        non_finite: not_finite(x),
        non_finite_reference: not_finite(r),
        whole: errors(image.window, x, r, 1.0, &finite),
        interior,
        mean_ratio: [0, 1, 2].map(|c| mean_ratio(image.window, x, r, c, &finite)),
        max_difference: max.0,
        max_pixel: max.1,
        max_channel: max.2,
        worst_share,
        worst_pixel: image.window.pixel(worst),
    })
}

/// The pixel with the largest relative squared error and its share of the sum.
fn worst_of(x: &[Rgb], r: &[Rgb], used: &[bool]) -> (usize, Option<f64>) {
    let pixels: Vec<usize> = (0..used.len()).filter(|&i| used[i]).collect();
    let level: f64 = pixels.iter().flat_map(|&i| r[i].0).map(f64::from).sum();
    let floor = 0.01 * (level / (3 * pixels.len()) as f64).powi(2);
    let square = |i: usize| -> f64 {
        let one = |c: usize| (f64::from(x[i][c]) - f64::from(r[i][c])).powi(2) / (f64::from(r[i][c]).powi(2) + floor);
        (0..3).map(one).sum()
    };
    let (mut sum, mut worst) = (0.0, (0, 0.0));
    for &i in &pixels {
        let one = square(i);
        sum += one;
        worst = if one > worst.1 { (i, one) } else { worst };
    }
    (worst.0, (floor > 0.0 && sum > 0.0).then(|| worst.1 / sum))
}

/// Whether two pictures have the same pixels.
pub(super) fn same_size(image: &Image, reference: &Image) -> Result<()> {
    if image.resolution != reference.resolution || image.window != reference.window {
        let size = |i: &Image| format!("{}x{} with pixels {}", i.resolution[0], i.resolution[1], i.window);
        return Err(Error::usage(format!(
            "pictures of different sizes cannot be compared: {} against the reference's {} (x0,y0,x1,y1)",
            size(image),
            size(reference)
        )));
    }
    Ok(())
}

/// The errors of a film's image against what it converges to, estimated from its two halves: with even and odd
/// passes that are independent, mean((even - odd)^2) times n_e n_o / (n_e + n_o)^2 (a quarter for equal halves) has
/// the expectation of mean((image - limit)^2). None before two passes, or where `interior` marks no pixel.
///
/// Renders keep the halves independent (`sampling/turn.rs`). [`super::SelfError`] follows a growing film and gives
/// narrower intervals than the spread between blocks. Neither knows of a model's own error.
pub fn from_halves(film: &Film, interior: Option<&[bool]>) -> Option<Errors> {
    let [even, odd] = film.half_images()?;
    let image = film.image();
    let n_odd = f64::from(film.passes() / 2);
    let n_even = f64::from(film.passes()) - n_odd;
    let scale = n_even * n_odd / (n_even + n_odd).powi(2);
    let all = vec![true; image.pixels.len()];
    let used = interior.filter(|mask| mask.len() == all.len()).unwrap_or(&all);
    // The difference of the halves, on top of the picture that relative errors are relative to.
    used.contains(&true).then(|| {
        errors_by(film.window(), &image.pixels, scale, used, |i, c| {
            f64::from(even.pixels[i][c]) - f64::from(odd.pixels[i][c])
        })
    })
}

fn errors(window: Window, x: &[Rgb], r: &[Rgb], scale: f64, used: &[bool]) -> Errors {
    errors_by(window, r, scale, used, |i, c| f64::from(x[i][c]) - f64::from(r[i][c]))
}

/// Errors from `difference(pixel, channel)`, its square multiplied by `scale`, over the pixels `used`.
fn errors_by(
    window: Window,
    reference: &[Rgb],
    scale: f64,
    used: &[bool],
    difference: impl Fn(usize, usize) -> f64,
) -> Errors {
    let pixels: Vec<usize> = (0..used.len()).filter(|&i| used[i]).collect();
    let sum: f64 = pixels.iter().flat_map(|&i| reference[i].0).map(f64::from).sum();
    let floor = 0.01 * (sum / (3 * pixels.len()) as f64).powi(2);
    let over_channels = |i: usize, divisor: &dyn Fn(f64) -> f64| -> f64 {
        (0..3).map(|c| scale * difference(i, c).powi(2) / divisor(f64::from(reference[i][c]))).sum::<f64>() / 3.0
    };
    let squared: Vec<_> = pixels.iter().map(|&i| (i, over_channels(i, &|_| 1.0))).collect();
    let [rmse, rmse_trimmed] = with_and_without_worst(window, squared).map(Estimate::sqrt);
    let relative = (floor > 0.0).then(|| {
        let relative = pixels.iter().map(|&i| (i, over_channels(i, &|r| r * r + floor))).collect();
        with_and_without_worst(window, relative)
    });
    Errors {
        pixels: pixels.len(),
        rmse,
        rmse_trimmed,
        relmse: relative.map(|[all, _]| all),
        relmse_trimmed: relative.map(|[_, trimmed]| trimmed),
    }
}

/// The mean of all values, and of all but the worst 0.1 %; `values` are (pixel, value >= 0).
fn with_and_without_worst(window: Window, mut values: Vec<(usize, f64)>) -> [Estimate; 2] {
    let all = mean(window, &values);
    let worst = (TRIMMED * values.len() as f64) as usize;
    if worst == 0 {
        return [all, all];
    }
    let keep = values.len() - worst;
    // Equal values go by pixel, so that the choice is always the same.
    values.select_nth_unstable_by(keep, |a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    values.truncate(keep);
    values.sort_unstable_by_key(|&(i, _)| i); // sums in one order
    [all, mean(window, &values)]
}

/// The mean of values >= 0. Such a mean is skewed where few blocks carry it, so the interval is taken symmetric on
/// the scale of its logarithm.
fn mean(window: Window, values: &[(usize, f64)]) -> Estimate {
    let ratio = Ratio::over_blocks(window, values.iter().map(|&(i, v)| (i, v, 1.0)));
    let interval = ratio.half_width.map(|half| match ratio.value {
        0.0 => [0.0, 0.0],
        value => [value * (-half / value).exp(), value * (half / value).exp()],
    });
    Estimate { value: ratio.value, interval }
}

fn mean_ratio(window: Window, x: &[Rgb], r: &[Rgb], c: usize, used: &[bool]) -> Option<Estimate> {
    let pairs = (0..used.len()).filter(|&i| used[i]).map(|i| (i, f64::from(x[i][c]), f64::from(r[i][c])));
    let ratio = Ratio::over_blocks(window, pairs);
    let interval = ratio.half_width.map(|half| [ratio.value - half, ratio.value + half]);
    ratio.value.is_finite().then_some(Estimate { value: ratio.value, interval })
}

impl Estimate {
    /// The root of value and interval.
    #[must_use]
    pub fn sqrt(self) -> Self {
        Self { value: self.value.sqrt(), interval: self.interval.map(|ends| ends.map(f64::sqrt)) }
    }
}

/// A ratio of two sums over pixels.
struct Ratio {
    value: f64,
    /// Half of the 95 % interval; none with fewer than two blocks.
    half_width: Option<f64>,
}

impl Ratio {
    /// Σ a / Σ b over (pixel, a, b), with the interval from the spread of the residuals a - (Σa/Σb) b between
    /// blocks: standard error sqrt(B/(B-1) Σ residual²) / |Σ b|, times Student's factor for B - 1.
    fn over_blocks(window: Window, values: impl Iterator<Item = (usize, f64, f64)>) -> Self {
        let columns = window.width().div_ceil(BLOCK as usize);
        let mut blocks = vec![None; columns * window.height().div_ceil(BLOCK as usize)];
        for (i, a, b) in values {
            let (x, y) = (i % window.width(), i / window.width());
            let sums = blocks[y / BLOCK as usize * columns + x / BLOCK as usize].get_or_insert((0.0, 0.0));
            *sums = (sums.0 + a, sums.1 + b);
        }
        let blocks: Vec<(f64, f64)> = blocks.into_iter().flatten().collect();
        let (a, b) = blocks.iter().fold((0.0, 0.0), |sum, block| (sum.0 + block.0, sum.1 + block.1));
        let value = a / b;
        let n = blocks.len() as f64;
        let half_width = (blocks.len() >= 2).then(|| {
            let residuals: f64 = blocks.iter().map(|block| (block.0 - value * block.1).powi(2)).sum();
            student_975(blocks.len() - 1) * (n / (n - 1.0) * residuals).sqrt() / b.abs()
        });
        Self { value, half_width }
    }
}

/// The 0.975 quantile of Student's t: 95 % of it lies within plus or minus this. Exact to 4 digits for one and two
/// degrees of freedom, else by the expansion about the normal quantile [AS64, 26.7.5] (0.2 % at three, better above).
pub fn student_975(freedom: usize) -> f64 {
    const Z: f64 = 1.959_963_984_540_054;
    match freedom {
        0 => f64::INFINITY,
        1 => 12.706,
        2 => 4.3027,
        _ => {
            let n = freedom as f64;
            let z2 = Z * Z;
            let g1 = Z * (z2 + 1.0) / 4.0;
            let g2 = Z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
            let g3 = Z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
            let g4 = Z * ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) / 92_160.0;
            Z + (g1 + (g2 + (g3 + g4 / n) / n) / n) / n
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_factors_are_those_of_the_tables() {
        for (freedom, printed) in
            [(1, 12.706), (2, 4.303), (3, 3.182), (4, 2.776), (10, 2.228), (30, 2.042), (120, 1.980)]
        {
            assert!((student_975(freedom) / printed - 1.0).abs() < 2e-3, "{freedom}");
        }
    }

    #[test]
    fn a_ratio_over_blocks_agrees_with_one_worked_out_by_hand() {
        // Two blocks, sums (3, 1) and (5, 3): ratio 2, residuals 1 and -1; error sqrt(2 * 2) / 4 = 1/2.
        let window = Window { x0: 0, y0: 0, x1: 20, y1: 1 };
        let ratio = Ratio::over_blocks(window, [(0, 3.0, 1.0), (17, 5.0, 3.0)].into_iter());
        assert_eq!(ratio.value, 2.0);
        assert!((ratio.half_width.unwrap() - 12.706 / 2.0).abs() < 1e-12);
    }
}
