//! The film: what the samples of each pixel add up to.

use super::exact::{ExactSum, MOST, PLACES};
use super::{Image, Window};
use crate::math::Rgb;
use crate::{Error, ErrorKind, Result, memory};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};
use std::ops::Range;

/// Sums of one pixel. Even and odd passes are kept apart; both halves together are the total.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    /// Digits of the exact sums: radiance per channel of the even passes, of the odd ones, squares of all.
    digits: [[i64; 2]; 9],
    /// Their highest places.
    tops: [u8; 9],
    /// Samples that are in the sums, by parity of the pass.
    samples: [u32; 2],
}

/// Where the squares begin in [`Sums`].
const SQUARES: usize = 6;

impl Sums {
    #[inline]
    fn get(&self, k: usize) -> ExactSum {
        ExactSum { top: self.tops[k], digits: self.digits[k] }
    }

    #[inline]
    fn set(&mut self, k: usize, sum: ExactSum) {
        (self.tops[k], self.digits[k]) = (sum.top, sum.digits);
    }

    /// Takes a finite sample of a pass with parity `half`.
    #[inline]
    fn add(&mut self, half: usize, sample: &Rgb) {
        self.samples[half] += 1;
        for c in 0..3 {
            let (mut sum, mut square) = (self.get(3 * half + c), self.get(SQUARES + c));
            sum.add(sample[c]);
            square.add_square(sample[c]);
            self.set(3 * half + c, sum);
            self.set(SQUARES + c, square);
        }
    }

    fn join(&mut self, other: &Self) {
        for k in 0..self.tops.len() {
            let mut sum = self.get(k);
            sum.join(&other.get(k));
            self.set(k, sum);
        }
        for half in 0..2 {
            self.samples[half] += other.samples[half];
        }
    }

    /// Samples of both halves.
    fn count(&self) -> f64 {
        f64::from(self.samples[0]) + f64::from(self.samples[1])
    }

    /// Sums of radiance in one half.
    fn half(&self, half: usize) -> [f64; 3] {
        std::array::from_fn(|c| self.get(3 * half + c).value(-149))
    }

    /// Sums of radiance, added before they are rounded.
    fn both(&self) -> [f64; 3] {
        std::array::from_fn(|c| {
            let mut sum = self.get(c);
            sum.join(&self.get(3 + c));
            sum.value(-149)
        })
    }

    fn squares(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.get(SQUARES + c).value(-298))
    }

    /// Fewest bytes that [`Self::write`] makes of a pixel.
    pub(super) const LEAST_BYTES: usize = 11;

    /// The pixel in a film file: counts, then for each sum its place and, unless it is empty, two digits.
    pub(super) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        for n in self.samples {
            write_whole(out, n.into())?;
        }
        for (top, digits) in self.tops.iter().zip(&self.digits) {
            out.write_all(&[*top])?;
            if *top > 0 {
                for digit in digits {
                    write_whole(out, ((digit << 1) ^ (digit >> 63)) as u64)?;
                }
            }
        }
        Ok(())
    }

    /// The pixel from a film file of `passes`; an error for numbers that no film has.
    pub(super) fn read(from: &mut impl Read, passes: u32) -> io::Result<Self> {
        let no = |what| Err(io::Error::new(io::ErrorKind::InvalidData, what));
        let mut sums = Self::default();
        for n in &mut sums.samples {
            let count = read_whole(from)?;
            if count > passes.into() {
                return no("a pixel has more samples than there were passes");
            }
            *n = count as u32;
        }
        for (top, digits) in sums.tops.iter_mut().zip(&mut sums.digits) {
            from.read_exact(std::slice::from_mut(top))?;
            if *top > PLACES {
                return no("a sum is out of range");
            }
            if *top > 0 {
                for digit in digits {
                    let zigzag = read_whole(from)?;
                    *digit = (zigzag >> 1) as i64 ^ -((zigzag & 1) as i64);
                    if digit.unsigned_abs() > u64::from(passes) << 35 {
                        return no("a digit of a sum is out of range");
                    }
                }
            }
        }
        Ok(sums)
    }
}

/// Seven bits a byte, the lowest first; the last byte is below 128.
fn write_whole(out: &mut impl Write, mut value: u64) -> io::Result<()> {
    let (mut bytes, mut n) = ([0_u8; 10], 0);
    while value >= 128 {
        bytes[n] = value as u8 | 128;
        (value, n) = (value >> 7, n + 1);
    }
    bytes[n] = value as u8;
    out.write_all(&bytes[..=n])
}

fn read_whole(from: &mut impl Read) -> io::Result<u64> {
    let mut value = 0;
    for shift in (0..63).step_by(7) {
        let mut byte = [0];
        from.read_exact(&mut byte)?;
        value |= u64::from(byte[0] & 127) << shift;
        if byte[0] < 128 {
            return Ok(value);
        }
    }
    Err(io::Error::new(io::ErrorKind::InvalidData, "a number is too long"))
}

/// A sample that is odd: enough to replay it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BadSample {
    /// Pass, from 0.
    pub pass: u32,
    /// Pixel [x, y] of the whole picture.
    pub pixel: [u32; 2],
}

/// What was odd about the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Samples added to the sums.
    pub samples: u64,
    /// Samples left out because a channel is NaN or infinite.
    pub non_finite: u64,
    /// The first of them by pass, then row, then column.
    pub first_non_finite: Option<BadSample>,
    /// Samples with a channel below zero; they are in the sums.
    pub negative: u64,
    /// The first of them, likewise.
    pub first_negative: Option<BadSample>,
}

/// Sums of radiance [W/(m^2 sr), or the scene's own scale] per pixel of a window of the picture.
///
/// A sample with a channel that is NaN or infinite is left out as a whole and counted; it does not advance the
/// pixel's own sample count, so that the mean stays the mean of the samples that are numbers. Were it counted, the
/// pixel would turn darker with each one. Leaving samples out can still shift a mean, if bad samples fall on
/// bright or dark paths rather than anywhere: hence the count, and the pixel and pass that replay the first.
///
/// The sums are the same bits for any order of tiles and passes and for any split of the passes into films that are
/// joined later: numbers are added as whole digits at fixed places, which takes 18 bytes for each of 9 sums.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    resolution: [u32; 2],
    window: Window,
    sums: Vec<Sums>,
    /// Closed passes in ascending order, the last run of them still growing.
    ranges: Vec<Range<u32>>,
    counts: Counts,
}

impl Film {
    /// Bytes for each pixel of the window.
    pub const BYTES_PER_PIXEL: usize = size_of::<Sums>();

    /// An empty film for `window` of a picture of `resolution` = [width, height].
    ///
    /// # Errors
    /// Usage if the window is empty or leaves the picture; Memory if the sums are more than what is available,
    /// known before anything is allocated where the system tells (Linux: [`memory::available`]).
    pub fn new(resolution: [u32; 2], window: Window) -> Result<Self> {
        Self::check(resolution, window)?;
        let mut sums = Vec::new();
        sums.try_reserve_exact(window.area()).map_err(|_| {
            let needed = memory::gigabytes(window.area() as u128 * Self::BYTES_PER_PIXEL as u128);
            let what = format!("the film of {}x{} pixels needs {needed}", window.width(), window.height());
            Error::new(ErrorKind::Memory, format!("{what}, which the system refuses; {}", Self::REMEDY))
        })?;
        sums.resize(window.area(), Sums::default());
        let none = 0..0;
        Ok(Self { resolution, window, sums, ranges: vec![none], counts: Counts::default() })
    }

    const REMEDY: &str = "render a smaller picture, or parts of it by --crop";

    /// Whether [`Film::new`] would make such a film, before anything else is done for it.
    ///
    /// # Errors
    /// As [`Film::new`].
    pub fn check(resolution: [u32; 2], window: Window) -> Result<()> {
        let [width, height] = resolution;
        if window.is_empty() || !Window::full(resolution).contains(window) {
            return Err(Error::usage(format!(
                "the window {window} (x0,y0,x1,y1; x1 and y1 excluded) is empty or leaves the picture of {width}x{height} pixels"
            )));
        }
        let what = format!("the film of {}x{} pixels", window.width(), window.height());
        let needed = window.area() as u128 * Self::BYTES_PER_PIXEL as u128;
        memory::require(needed, memory::available(), &what, Self::REMEDY)
    }

    /// The same film, still empty, whose first pass is number `pass`.
    #[must_use]
    pub fn starting_at(mut self, pass: u32) -> Self {
        debug_assert_eq!(self.passes(), 0, "the film has passes already");
        let none = pass..pass;
        self.ranges = vec![none];
        self
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
        let pass = self.next_pass();
        for (row, y) in samples.chunks_exact(window.width()).zip(window.y0..) {
            let start = self.window.index(window.x0, y);
            self.counts.take(&add_row(&mut self.sums[start..], row, BadSample { pass, pixel: [window.x0, y] }));
        }
    }

    /// [`Self::add`] for all tiles of a pass, on all cores. Tiles stand in rows from the top, those of a row with the same
    /// upper and lower ends.
    ///
    /// # Panics
    /// As [`Self::add`], and if a row of tiles does not lie below the one before it.
    pub fn add_pass(&mut self, tiles: &[(Window, Vec<Rgb>)]) {
        let (pass, film, width) = (self.next_pass(), self.window, self.window.width());
        let (mut rest, mut row) = (&mut self.sums[..], film.y0);
        for band in tiles.chunk_by(|a, b| a.0.y0 == b.0.y0) {
            let Window { y0, y1, .. } = band[0].0;
            for (tile, samples) in band {
                assert!(film.contains(*tile) && (tile.y1, samples.len()) == (y1, tile.area()), "tile {tile}");
            }
            let (rows, below) = rest[(y0 - row) as usize * width..].split_at_mut((y1 - y0) as usize * width);
            let add = |(i, sums): (usize, &mut [Sums])| {
                let (mut counts, y) = (Counts::default(), y0 + i as u32);
                for (tile, samples) in band {
                    let from = &mut sums[(tile.x0 - film.x0) as usize..];
                    let samples = &samples[i * tile.width()..(i + 1) * tile.width()];
                    counts.take(&add_row(from, samples, BadSample { pass, pixel: [tile.x0, y] }));
                }
                counts
            };
            let sum = |mut a: Counts, b: Counts| {
                a.take(&b);
                a
            };
            let counts = rows.par_chunks_mut(width).enumerate().map(add).reduce(Counts::default, sum);
            self.counts.take(&counts);
            (rest, row) = (below, y1);
        }
    }

    /// Closes the current pass; the next `add` belongs to the next one.
    pub fn end_pass(&mut self) {
        if let Some(last) = self.ranges.last_mut() {
            last.end += 1;
        }
    }

    /// Number of passes in the sums.
    pub fn passes(&self) -> u32 {
        self.ranges.iter().map(ExactSizeIterator::len).sum::<usize>() as u32
    }

    /// The pass that the next `add` belongs to.
    pub fn next_pass(&self) -> u32 {
        self.ranges.last().map_or(0, |last| last.end)
    }

    /// The passes in the sums: runs that neither touch nor overlap, in ascending order. Without a pass, one empty run.
    pub fn ranges(&self) -> &[Range<u32>] {
        &self.ranges
    }

    /// [`Self::ranges`] as text: `0..64`, or `0..16,32..64`.
    pub fn ranges_text(&self) -> String {
        self.ranges.iter().map(|r| format!("{}..{}", r.start, r.end)).collect::<Vec<_>>().join(",")
    }

    /// Adds the passes of another film of the same picture: the sums are those of one film of all these passes, bit for
    /// bit.
    ///
    /// # Errors
    /// Usage if the pictures differ in size or window, or a pass is in both.
    pub fn join(&mut self, other: &Self) -> Result<()> {
        if (self.resolution, self.window) != (other.resolution, other.window) {
            let size = |f: &Self| format!("{}x{} pixels, window {}", f.resolution[0], f.resolution[1], f.window);
            return Err(Error::usage(format!("films of different pictures: {} and {}", size(self), size(other))));
        }
        let mut ranges: Vec<Range<u32>> =
            self.ranges.iter().chain(&other.ranges).filter(|r| !r.is_empty()).cloned().collect();
        ranges.sort_by_key(|r| r.start);
        if let Some(w) = ranges.windows(2).find(|w| w[1].start < w[0].end) {
            let (from, to) = (w[1].start, w[1].end.min(w[0].end));
            return Err(Error::usage(format!("the passes {from}..{to} are in both; they may count once only")));
        }
        if self.passes() as u64 + other.passes() as u64 > u64::from(Self::MOST_PASSES) {
            return Err(Error::usage(format!("more than {} passes do not fit into one film", Self::MOST_PASSES)));
        }
        let mut joined: Vec<Range<u32>> = Vec::new();
        for range in ranges {
            match joined.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => joined.push(range),
            }
        }
        if !joined.is_empty() {
            self.ranges = joined;
        }
        for (sums, more) in self.sums.iter_mut().zip(&other.sums) {
            sums.join(more);
        }
        self.counts.take(&other.counts);
        Ok(())
    }

    /// Passes that a film holds at most.
    pub const MOST_PASSES: u32 = MOST;

    /// All pixels, for a film file.
    pub(super) fn write_sums(&self, out: &mut impl Write) -> io::Result<()> {
        self.sums.iter().try_for_each(|sums| sums.write(out))
    }

    /// Fills an empty film from a film file.
    pub(super) fn read_sums(
        &mut self,
        from: &mut impl Read,
        ranges: Vec<Range<u32>>,
        counts: Counts,
    ) -> io::Result<()> {
        (self.ranges, self.counts) = (ranges, counts);
        let passes = self.passes();
        for sums in &mut self.sums {
            *sums = Sums::read(from, passes)?;
        }
        Ok(())
    }

    /// Passes in the even and in the odd half.
    pub fn half_passes(&self) -> [u32; 2] {
        let even = |r: &Range<u32>| r.end.div_ceil(2) - r.start.div_ceil(2);
        let even = self.ranges.iter().map(even).sum();
        [even, self.passes() - even]
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
        self.map(|sums| mean(sums.both(), sums.count()))
    }

    /// Mean radiance of the even and of the odd passes, for errors without a reference ([`super::metrics::from_halves`])
    ///; none before two passes.
    pub fn half_images(&self) -> Option<[Image; 2]> {
        (self.passes() >= 2)
            .then(|| [0, 1].map(|half| self.map(|sums| mean(sums.half(half), f64::from(sums.samples[half])))))
    }

    /// Variance of the mean radiance per pixel, from the spread of its samples taken as independent; none before
    /// two passes. Samples of one low-discrepancy sequence are better spread than that: then it is too large.
    pub fn variance(&self) -> Option<Image> {
        (self.passes() >= 2).then(|| {
            self.map(|sums| {
                let n = sums.count();
                if n < 2.0 {
                    return Rgb::BLACK;
                }
                let (both, squares) = (sums.both(), sums.squares());
                Rgb::from_fn(|c| {
                    let mean = both[c] / n;
                    ((squares[c] / n - mean * mean).max(0.0) / (n - 1.0)) as f32
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

/// Adds samples of neighbouring pixels to their sums; `at` is the first of them.
fn add_row(sums: &mut [Sums], samples: &[Rgb], at: BadSample) -> Counts {
    let (mut counts, half) = (Counts::default(), (at.pass & 1) as usize);
    for (i, (sums, sample)) in sums.iter_mut().zip(samples).enumerate() {
        let this = BadSample { pixel: [at.pixel[0] + i as u32, at.pixel[1]], ..at };
        if !sample.is_finite() {
            counts.non_finite += 1;
            counts.first_non_finite = counts.first_non_finite.or(Some(this));
            continue;
        }
        if sample.min() < 0.0 {
            counts.negative += 1;
            counts.first_negative = counts.first_negative.or(Some(this));
        }
        counts.samples += 1;
        sums.add(half, sample);
    }
    counts
}

impl Counts {
    /// Adds those of another part.
    fn take(&mut self, b: &Self) {
        let sums =
            [(&mut self.samples, b.samples), (&mut self.non_finite, b.non_finite), (&mut self.negative, b.negative)];
        for (a, b) in sums {
            *a = a.saturating_add(b);
        }
        self.first_non_finite = first(self.first_non_finite, b.first_non_finite);
        self.first_negative = first(self.first_negative, b.first_negative);
    }
}

/// The earlier of two by pass, row, column.
fn first(a: Option<BadSample>, b: Option<BadSample>) -> Option<BadSample> {
    let order = |b: &BadSample| (b.pass, b.pixel[1], b.pixel[0]);
    a.into_iter().chain(b).min_by_key(order)
}
