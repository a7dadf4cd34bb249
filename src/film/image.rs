//! A picture in memory, and one from a file.

use super::Window;
use crate::math::{Rgb, hash_combine};

/// Linear radiance for each pixel of a window of the whole picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// [width, height] of the whole picture (EXR: the display window).
    pub resolution: [u32; 2],
    /// The pixels that are here (EXR: the data window).
    pub window: Window,
    /// Their values in row-major order.
    pub pixels: Vec<Rgb>,
}

/// A picture from a file, with what a user should hear of.
#[derive(Clone, Debug)]
pub struct FilePicture {
    /// In linear Rec. 709.
    pub image: Image,
    /// What was taken how where that is not plain, and what is odd.
    pub remarks: Vec<String>,
    /// It holds the six sides of a cube (`envmap` of an EXR file).
    pub cube: bool,
}

impl Image {
    /// A picture of `resolution` = [width, height], all of it; `pixel(x, y)` gives each value.
    pub fn from_fn(resolution: [u32; 2], mut pixel: impl FnMut(u32, u32) -> Rgb) -> Self {
        let window = Window::full(resolution);
        let pixels = (0..window.area())
            .map(|i| {
                let [x, y] = window.pixel(i);
                pixel(x, y)
            })
            .collect();
        Self { resolution, window, pixels }
    }

    /// A hash of every bit of the picture.
    pub fn fingerprint(&self) -> u64 {
        let w = self.window;
        let sizes = [self.resolution[0], self.resolution[1], w.x0, w.y0, w.x1, w.y1];
        let state = sizes.iter().fold(0, |state, &n| hash_combine(state, n.into()));
        self.pixels.iter().flat_map(|p| p.0).fold(state, |state, value| hash_combine(state, value.to_bits().into()))
    }

    /// The value at column x, row y of the whole picture; none outside the window.
    pub fn get(&self, x: u32, y: u32) -> Option<Rgb> {
        let w = self.window;
        (w.x0 <= x && x < w.x1 && w.y0 <= y && y < w.y1).then(|| self.pixels[w.index(x, y)])
    }

    /// The window's pixels as a picture of their own, averaged over squares so that neither side is longer than `longest`.
    #[must_use]
    pub fn shrunk(&self, longest: u32) -> Self {
        let (width, height) = (self.window.width() as u32, self.window.height() as u32);
        let n = width.max(height).div_ceil(longest.max(1)).max(1);
        Self::from_fn([(width / n).max(1), (height / n).max(1)], |x, y| {
            let (mut sum, mut count) = (Rgb::BLACK, 0.0);
            for v in (y * n..((y + 1) * n).min(height)).map(|v| self.window.y0 + v) {
                for u in (x * n..((x + 1) * n).min(width)).map(|u| self.window.x0 + u) {
                    let pixel = self.pixels[self.window.index(u, v)];
                    if pixel.is_finite() {
                        sum += pixel;
                        count += 1.0;
                    }
                }
            }
            if count > 0.0 { sum * (1.0 / count) } else { Rgb::BLACK }
        })
    }

    /// The part of this picture inside `window`, which may be empty.
    #[must_use]
    pub fn cropped(&self, window: Window) -> Self {
        let window = self.window.intersection(window);
        let pixels = (0..window.area())
            .map(|i| {
                let [x, y] = window.pixel(i);
                self.pixels[self.window.index(x, y)]
            })
            .collect();
        Self { resolution: self.resolution, window, pixels }
    }
}
