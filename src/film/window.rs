//! A rectangle of pixels.

use serde::{Deserialize, Serialize};

/// Pixels with x0 <= x < x1 and y0 <= y < y1; (0, 0) is the upper left pixel of the whole picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Window {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// Column after the last.
    pub x1: u32,
    /// Row after the last.
    pub y1: u32,
}

impl Window {
    /// All pixels of a picture of `resolution` = [width, height].
    pub fn full(resolution: [u32; 2]) -> Self {
        Self { x0: 0, y0: 0, x1: resolution[0], y1: resolution[1] }
    }

    /// Columns.
    pub fn width(self) -> usize {
        self.x1.saturating_sub(self.x0) as usize
    }

    /// Rows.
    pub fn height(self) -> usize {
        self.y1.saturating_sub(self.y0) as usize
    }

    /// Number of pixels; does not overflow where `usize` has 64 bits.
    pub fn area(self) -> usize {
        self.width() * self.height()
    }

    /// True without a pixel.
    pub fn is_empty(self) -> bool {
        self.width() == 0 || self.height() == 0
    }

    /// True where every pixel of `other` is one of ours.
    pub fn contains(self, other: Self) -> bool {
        other.is_empty() || (self.x0 <= other.x0 && other.x1 <= self.x1 && self.y0 <= other.y0 && other.y1 <= self.y1)
    }

    /// The pixels of both; empty where there are none.
    pub fn intersection(self, other: Self) -> Self {
        let (x0, y0) = (self.x0.max(other.x0), self.y0.max(other.y0));
        Self { x0, y0, x1: self.x1.min(other.x1).max(x0), y1: self.y1.min(other.y1).max(y0) }
    }

    /// Position [x, y] of the pixel at row-major `index` within this window.
    pub fn pixel(self, index: usize) -> [u32; 2] {
        debug_assert!(index < self.area());
        [self.x0 + (index % self.width()) as u32, self.y0 + (index / self.width()) as u32]
    }

    /// Row-major index within this window of the pixel at x, y, which must be inside.
    pub fn index(self, x: u32, y: u32) -> usize {
        debug_assert!(self.x0 <= x && x < self.x1 && self.y0 <= y && y < self.y1);
        (y - self.y0) as usize * self.width() + (x - self.x0) as usize
    }
}

impl std::fmt::Display for Window {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{},{},{},{}", self.x0, self.y0, self.x1, self.y1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn index_and_pixel_are_inverse_in_row_major_order() {
        let window = Window { x0: 3, y0: 5, x1: 7, y1: 8 };
        assert_eq!(window.area(), 12);
        assert_eq!(window.pixel(5), [4, 6]);
        for i in 0..window.area() {
            let [x, y] = window.pixel(i);
            assert_eq!(window.index(x, y), i);
        }
    }

    #[test]
    fn disjoint_windows_share_no_pixel() {
        let a = Window { x0: 0, y0: 0, x1: 4, y1: 4 };
        let b = Window { x0: 6, y0: 1, x1: 8, y1: 3 };
        assert!(a.intersection(b).is_empty() && b.intersection(a).is_empty());
        assert_eq!(a.intersection(Window { x0: 2, y0: 3, x1: 9, y1: 9 }), Window { x0: 2, y0: 3, x1: 4, y1: 4 });
        assert!(a.contains(Window { x0: 0, y0: 3, x1: 4, y1: 4 }) && !a.contains(b));
    }
}
