//! Pictures on surfaces.

use crate::math::{Rgb, hash_combine};

/// What is beyond the edges of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// The colour of the edge.
    Clamp,
}

/// A picture that is laid on a surface by its texture coordinates: (0, 0) is the lower left corner, (1, 1) the upper right one.
pub struct Texture {
    name: String,
    width: u32,
    height: u32,
    /// Rows from the top down; each channel in [0, 1].
    texels: Vec<Rgb>,
    wrap: Wrap,
    mean: Rgb,
}

impl Texture {
    /// Of `texels` in rows of `width` from the top down, at least one, each channel in [0, 1]. `name` is for messages.
    pub fn new(name: String, width: u32, texels: Vec<Rgb>, wrap: Wrap) -> Self {
        debug_assert!(width > 0 && !texels.is_empty() && texels.len().is_multiple_of(width as usize));
        debug_assert!(texels.iter().flat_map(|t| t.0).all(|v| (0.0..=1.0).contains(&v)));
        let n = texels.len() as f64;
        let mean = |c: usize| (texels.iter().map(|t| f64::from(t[c])).sum::<f64>() / n) as f32;
        let (height, mean) = (texels.len() as u32 / width, Rgb::from_fn(mean));
        Self { name, width, height, texels, wrap, mean }
    }

    /// Its value at texture coordinates, interpolated between the middles of the four nearest texels.
    pub fn at(&self, uv: [f32; 2]) -> Rgb {
        let (columns, right) = self.nearest(uv[0], self.width);
        // Rows run down, v upwards.
        let (rows, down) = self.nearest(1.0 - uv[1], self.height);
        let row = |y: usize| {
            let [a, b] = columns.map(|x| self.texels[y * self.width as usize + x]);
            a * (1.0 - right) + b * right
        };
        row(rows[0]) * (1.0 - down) + row(rows[1]) * down
    }

    /// The two texels whose middles `at` lies between, of `count` over the width of the picture, and how near it is to the second.
    fn nearest(&self, at: f32, count: u32) -> ([usize; 2], f32) {
        let at = match self.wrap {
            Wrap::Repeat => at - at.floor(),
            Wrap::Clamp => at.clamp(0.0, 1.0),
        };
        let at = if at.is_nan() { 0.0 } else { at };
        let place = f64::from(at) * f64::from(count) - 0.5;
        let (below, count) = (place.floor(), i64::from(count));
        let index = |i: i64| match self.wrap {
            Wrap::Repeat => i.rem_euclid(count) as usize,
            Wrap::Clamp => i.clamp(0, count - 1) as usize,
        };
        ([index(below as i64), index(below as i64 + 1)], (place - below) as f32)
    }

    /// Derivatives of the red channel by both texture coordinates: of differences over one texel.
    pub fn slope(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let [w, h] = self.resolution().map(|n| n as f32);
        let (du, dv) = (0.5 / w, 0.5 / h);
        [
            (self.at([u + du, v])[0] - self.at([u - du, v])[0]) * w,
            (self.at([u, v + dv])[0] - self.at([u, v - dv])[0]) * h,
        ]
    }

    /// What `check` says of it.
    pub fn text(&self) -> String {
        format!("{}, {} x {} pixels, mean {:?}", self.name, self.width, self.height, self.mean.0)
    }

    /// Each texel made into another, in [0, 1].
    pub fn map(&self, of: impl Fn(Rgb) -> Rgb) -> Self {
        Self::new(self.name.clone(), self.width, self.texels.iter().map(|t| of(*t)).collect(), self.wrap)
    }

    /// The largest texel of each channel.
    pub fn largest(&self) -> Rgb {
        self.texels.iter().fold(Rgb::BLACK, |most, t| Rgb::from_fn(|c| most[c].max(t[c])))
    }

    /// Mean of all texels.
    pub fn mean(&self) -> Rgb {
        self.mean
    }

    /// The picture's file, as it was named.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// [width, height] in texels.
    pub fn resolution(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Memory of its texels.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.texels)
    }

    /// A hash of every bit of it.
    pub fn fingerprint(&self) -> u64 {
        let start = hash_combine(u64::from(self.width), u64::from(self.wrap == Wrap::Clamp));
        self.texels.iter().flat_map(|t| t.0).fold(start, |state, v| hash_combine(state, v.to_bits().into()))
    }
}

impl std::fmt::Debug for Texture {
    /// Without its texels.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Texture({:?}, {} x {}, {:?})", self.name, self.width, self.height, self.wrap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows of three greys, the upper one 0, 0.1, 0.2.
    fn greys(wrap: Wrap) -> Texture {
        let texels = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5].map(Rgb::splat).to_vec();
        Texture::new("greys".into(), 3, texels, wrap)
    }

    #[track_caller]
    fn is(texture: &Texture, uv: [f32; 2], value: f32) {
        let found = texture.at(uv)[0];
        assert!((found - value).abs() < 1e-6, "{uv:?}: {found} for {value}");
    }

    #[test]
    fn the_first_row_is_at_the_top() {
        for wrap in [Wrap::Repeat, Wrap::Clamp] {
            let texture = greys(wrap);
            for (k, value) in [0.3, 0.4, 0.5, 0.0, 0.1, 0.2].into_iter().enumerate() {
                is(&texture, [(k % 3) as f32 / 3.0 + 1.0 / 6.0, 0.25 + 0.5 * (k / 3) as f32], value);
            }
            is(&texture, [0.5, 0.5], 0.25);
            assert!((texture.mean()[1] - 0.25).abs() < 1e-7);
        }
    }

    #[test]
    fn beyond_the_edges_it_repeats_or_stays() {
        let (repeat, clamp) = (greys(Wrap::Repeat), greys(Wrap::Clamp));
        for [u, v] in [[0.2, 0.7], [0.5, 0.1], [0.9, 0.9]] {
            for [i, k] in [[1.0, 0.0], [-1.0, 2.0], [7.0, -3.0]] {
                is(&repeat, [u + i, v + k], repeat.at([u, v])[0]);
            }
        }
        // Half-way between the last texel and the first one again, and on the edge itself.
        is(&repeat, [0.0, 0.75], 0.1);
        is(&repeat, [1.0, 0.75], 0.1);
        is(&clamp, [0.0, 0.75], 0.0);
        is(&clamp, [9.0, 0.75], 0.2);
        is(&clamp, [0.5, -4.0], 0.4);
        is(&clamp, [0.5, f32::INFINITY], 0.1);
        // Numbers that have no place do no harm.
        for wild in [f32::NAN, f32::INFINITY, -1e30, 1e38, f32::MIN_POSITIVE, -f32::MIN_POSITIVE] {
            for texture in [&repeat, &clamp] {
                assert!(texture.at([wild, wild]).is_finite(), "{wild}");
            }
        }
    }
}
