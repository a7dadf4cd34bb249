//! The film: what the samples of each pixel add up to.

use super::memory;
use super::{Image, Window};
use crate::math::Rgb;
use crate::{Error, ErrorKind, Result};
use serde::Serialize;

/// Sums of one pixel. Even and odd passes are kept apart; both halves together are the total.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// Radiance per channel, by parity of the pass.
    half: [[f64; 3]; 2],
    /// Squares of radiance per channel, all passes.
    squares: [f64; 3],
    /// Samples that are in the sums, by parity of the pass.
    samples: [u32; 2],
}

/// A sample that was left out because a channel is NaN or infinite: enough to replay it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct BadSample {
    /// Pass, from 0.
    pub pass: u32,
    /// Pixel [x, y] of the whole picture.
    pub pixel: [u32; 2],
}

/// What was odd about the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Samples added to the sums.
    pub samples: u64,
    /// Samples left out because a channel is NaN or infinite.
    pub non_finite: u64,
    /// The first of them by pass, then row, then column.
    pub first_non_finite: Option<BadSample>,
    /// Samples with a channel below zero; they are in the sums.
    pub negative: u64,
}

/// Sums of radiance [W/(m^2 sr), or the scene's own scale] per pixel of a window of the picture.
///
/// A sample with a channel that is NaN or infinite is left out as a whole and counted; it does not advance the
/// pixel's own sample count, so that the mean stays the mean of the samples that are numbers. Were it counted, the
/// pixel would turn darker with each one. Leaving samples out can still shift a mean, if bad samples fall on
/// bright or dark paths rather than anywhere: hence the count, and the pixel and pass that replay the first.
///
/// Each pixel gets one addition per pass, in order of the passes, so the sums do not depend on the number of
/// threads or on the order of tiles within a pass.
#[derive(Clone, Debug)]
pub struct Film {
    resolution: [u32; 2],
    window: Window,
    sums: Vec<Sums>,
    passes: u32,
    counts: Counts,
}

impl Film {
    /// Bytes for each pixel of the window.
    pub const BYTES_PER_PIXEL: usize = size_of::<Sums>();

    /// An empty film for `window` of a picture of `resolution` = [width, height].
    ///
    /// # Errors
    /// Usage if the window is empty or leaves the picture; Memory if the sums are more than what is available,
    /// known before anything is allocated where the system tells (`MemAvailable` of Linux).
    pub fn new(resolution: [u32; 2], window: Window) -> Result<Self> {
        let [width, height] = resolution;
        if window.is_empty() || !Window::full(resolution).contains(window) {
            return Err(Error::usage(format!(
                "the window {window} (x0,y0,x1,y1; x1 and y1 excluded) is empty or leaves the picture of {width}x{height} pixels"
            )));
        }
        let what = format!("the film of {}x{} pixels", window.width(), window.height());
        let remedy = "render a smaller picture, or parts of it by --crop";
        let needed = window.area() as u128 * Self::BYTES_PER_PIXEL as u128;
        memory::require(needed, memory::available(), &what, remedy)?;
        let mut sums = Vec::new();
        sums.try_reserve_exact(window.area()).map_err(|_| {
            let needed = memory::gigabytes(needed);
            Error::new(ErrorKind::Memory, format!("{what} needs {needed}, which the system refuses; {remedy}"))
        })?;
        sums.resize(window.area(), Sums::default());
        Ok(Self { resolution, window, sums, passes: 0, counts: Counts::default() })
    }

    /// Adds one sample of the current pass to each pixel of the tile `window`; `samples` in row-major order.
    ///
    /// # Panics
    /// If the tile leaves the film or `samples` has another length: a fault of the caller, not of input.
    pub fn add(&mut self, window: Window, samples: &[Rgb]) {
        assert!(self.window.contains(window), "tile {window} leaves the film's window {}", self.window);
        assert_eq!(samples.len(), window.area(), "one sample for each pixel of tile {window}");
        if window.is_empty() {
            return;
        }
        let half = (self.passes & 1) as usize;
        for (row, y) in samples.chunks_exact(window.width()).zip(window.y0..) {
            let start = self.window.index(window.x0, y);
            for (i, (sums, sample)) in self.sums[start..].iter_mut().zip(row).enumerate() {
                if !sample.is_finite() {
                    let bad = BadSample { pass: self.passes, pixel: [window.x0 + i as u32, y] };
                    self.counts.leave_out(bad);
                    continue;
                }
                self.counts.samples += 1;
                self.counts.negative += u64::from(sample.min() < 0.0);
                sums.samples[half] += 1;
                for c in 0..3 {
                    let value = f64::from(sample[c]);
                    sums.half[half][c] += value;
                    sums.squares[c] += value * value;
                }
            }
        }
    }

    /// Closes the current pass; the next `add` belongs to the next one.
    pub fn end_pass(&mut self) {
        self.passes += 1;
    }

    /// Passes closed so far.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// Passes in the even and in the odd half.
    pub fn half_passes(&self) -> [u32; 2] {
        [self.passes.div_ceil(2), self.passes / 2]
    }

    /// What was odd about the samples so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// [width, height] of the whole picture.
    pub fn resolution(&self) -> [u32; 2] {
        self.resolution
    }

    /// The pixels that are rendered.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Pixels without a single sample that is a number; they are black in [`Film::image`].
    pub fn empty_pixels(&self) -> usize {
        self.sums.iter().filter(|sums| sums.samples == [0, 0]).count()
    }

    /// Mean radiance per pixel.
    pub fn image(&self) -> Image {
        self.map(|sums| {
            let samples = f64::from(sums.samples[0]) + f64::from(sums.samples[1]);
            mean(std::array::from_fn(|c| sums.half[0][c] + sums.half[1][c]), samples)
        })
    }

    /// Mean radiance of the even and of the odd passes, for errors without a reference ([`super::metrics::from_halves`])
    ///; none before two passes.
    pub fn half_images(&self) -> Option<[Image; 2]> {
        (self.passes >= 2)
            .then(|| [0, 1].map(|half| self.map(|sums| mean(sums.half[half], f64::from(sums.samples[half])))))
    }

    /// Variance of the mean radiance per pixel, from the spread of its samples taken as independent; none before
    /// two passes. Samples of one low-discrepancy sequence are better spread than that: then it is too large.
    pub fn variance(&self) -> Option<Image> {
        (self.passes >= 2).then(|| {
            self.map(|sums| {
                let n = f64::from(sums.samples[0]) + f64::from(sums.samples[1]);
                if n < 2.0 {
                    return Rgb::BLACK;
                }
                Rgb::from_fn(|c| {
                    let mean = (sums.half[0][c] + sums.half[1][c]) / n;
                    ((sums.squares[c] / n - mean * mean).max(0.0) / (n - 1.0)) as f32
                })
            })
        })
    }

    fn map(&self, pixel: impl FnMut(&Sums) -> Rgb) -> Image {
        Image { resolution: self.resolution, window: self.window, pixels: self.sums.iter().map(pixel).collect() }
    }
}

/// `sum` / `samples`, black without a sample.
fn mean(sum: [f64; 3], samples: f64) -> Rgb {
    if samples > 0.0 { Rgb::from_fn(|c| (sum[c] / samples) as f32) } else { Rgb::BLACK }
}

impl Counts {
    fn leave_out(&mut self, bad: BadSample) {
        self.non_finite += 1;
        let order = |b: BadSample| (b.pass, b.pixel[1], b.pixel[0]);
        if self.first_non_finite.is_none_or(|first| order(bad) < order(first)) {
            self.first_non_finite = Some(bad);
        }
    }
}
