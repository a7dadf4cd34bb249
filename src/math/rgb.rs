//! A value per colour channel.

use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, MulAssign, Sub};

/// Red, green, blue: linear, one `f32` each. Arithmetic is per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rgb(pub [f32; 3]);

impl Rgb {
    /// Zero in each channel.
    pub const BLACK: Self = Self([0.0; 3]);
    /// One in each channel.
    pub const WHITE: Self = Self([1.0; 3]);

    /// The same value in each channel.
    pub const fn splat(value: f32) -> Self {
        Self([value; 3])
    }

    /// `f(c)` for channel c = 0, 1, 2.
    #[inline]
    pub fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self(std::array::from_fn(f))
    }

    /// `f` of each channel's value.
    #[inline]
    pub fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        Self(self.0.map(&mut f))
    }

    /// Largest channel.
    pub fn max(self) -> f32 {
        self.0[0].max(self.0[1]).max(self.0[2])
    }

    /// Smallest channel.
    pub fn min(self) -> f32 {
        self.0[0].min(self.0[1]).min(self.0[2])
    }

    /// Arithmetic mean of the channels.
    pub fn mean(self) -> f32 {
        (self.0[0] + self.0[1] + self.0[2]) / 3.0
    }

    /// The same where the sum of the channels may leave the range of f32.
    pub fn mean_f64(self) -> f64 {
        self.0.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0
    }

    /// True where no channel is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.iter().all(|v| v.is_finite())
    }

    /// True where every channel is exactly zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == [0.0; 3]
    }

    /// True where the three channels are equal.
    pub fn is_grey(self) -> bool {
        self.0[0] == self.0[1] && self.0[1] == self.0[2]
    }
}

impl From<[f32; 3]> for Rgb {
    fn from(value: [f32; 3]) -> Self {
        Self(value)
    }
}

impl Index<usize> for Rgb {
    type Output = f32;
    #[inline]
    fn index(&self, c: usize) -> &f32 {
        &self.0[c]
    }
}

impl IndexMut<usize> for Rgb {
    #[inline]
    fn index_mut(&mut self, c: usize) -> &mut f32 {
        &mut self.0[c]
    }
}

impl Add for Rgb {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::from_fn(|c| self[c] + other[c])
    }
}

impl AddAssign for Rgb {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Rgb {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::from_fn(|c| self[c] - other[c])
    }
}

impl Mul for Rgb {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self::from_fn(|c| self[c] * other[c])
    }
}

impl Mul<f32> for Rgb {
    type Output = Self;
    #[inline]
    fn mul(self, k: f32) -> Self {
        self.map(|v| v * k)
    }
}

impl MulAssign<f32> for Rgb {
    #[inline]
    fn mul_assign(&mut self, k: f32) {
        *self = *self * k;
    }
}

impl Div<f32> for Rgb {
    type Output = Self;
    #[inline]
    fn div(self, k: f32) -> Self {
        self.map(|v| v / k)
    }
}
