//! A picture of all directions, and a table of where it shines.

use crate::film::Image;
use crate::math::{Rgb, Vec3};
use std::f32::consts::PI;
use std::f64::consts::{PI as PI64, TAU as TAU64};
use std::sync::Arc;

/// A picture of all directions, interpolated between its pixels' centres. A patch is what lies between four of them; the
/// first and the last row of patches, half as high, lie between a row of pixels and a pole.
pub(super) struct Picture {
    image: Arc<Image>,
    pub(super) width: usize,
    pub(super) height: usize,
    /// Turn about the y axis [turns].
    turn: f32,
    /// Chance of each row of patches and of all above it.
    rows: Vec<f64>,
    /// Chance within its row of each patch and of all to its left.
    columns: Vec<f32>,
    /// Cosines of the angles from +y between the rows.
    cosines: Vec<f64>,
    /// Over all directions and the channels.
    pub(super) mean: f64,
}

impl Picture {
    pub(super) fn new(image: Arc<Image>, turn: f32) -> Self {
        let [width, height] = image.resolution.map(|n| n as usize);
        let cosine = |k: usize| match k {
            0 => 1.0,
            k if k > height => -1.0,
            k => ((k as f64 - 0.5) / height as f64 * PI64).cos(),
        };
        let cosines: Vec<f64> = (0..=height + 1).map(cosine).collect();
        let mut picture = Self {
            image,
            width,
            height,
            turn,
            rows: Vec::with_capacity(height + 1),
            columns: Vec::with_capacity((height + 1) * width),
            cosines,
            mean: 0.0,
        };
        let mut total = 0.0;
        for k in 0..=height {
            let mut row = 0.0;
            let sums = (0..width).map(|i| {
                row += picture.values(k, i).iter().sum::<f64>();
                row
            });
            let sums: Vec<f64> = sums.collect();
            // A row without light gets even shares, which nothing picks.
            let share =
                |(i, sum): (usize, f64)| if row > 0.0 { sum / row } else { (i + 1) as f64 / width as f64 } as f32;
            picture.columns.extend(sums.into_iter().enumerate().map(share));
            total += row * (picture.cosines[k] - picture.cosines[k + 1]);
            picture.rows.push(total);
        }
        for row in &mut picture.rows {
            *row /= total;
        }
        // Of four corners each, and of 2π / width for each cosine.
        picture.mean = total / (8.0 * width as f64);
        picture
    }

    pub(super) fn is_black(&self) -> bool {
        !self.rows.last().is_some_and(|last| last.is_finite())
    }

    /// The pixels at the corners of patch `i` of row `k`: upper left, upper right, lower left, lower right.
    #[inline]
    fn corners(&self, k: usize, i: usize) -> [Rgb; 4] {
        let (above, below) = (k.saturating_sub(1), k.min(self.height - 1));
        let right = if i + 1 < self.width { i + 1 } else { 0 };
        let at = |row: usize, column: usize| self.image.pixels[row * self.width + column];
        [at(above, i), at(above, right), at(below, i), at(below, right)]
    }

    /// Means over the channels at the corners of the patch `i` of row `k`, in the order of [`Self::corners`].
    #[inline]
    pub(super) fn values(&self, k: usize, i: usize) -> [f64; 4] {
        self.corners(k, i).map(Rgb::mean_f64)
    }

    /// Where in the row `k` of patches the cosine `y` from +y lies, even in solid angle.
    #[inline]
    pub(super) fn down(&self, k: usize, y: f32) -> f64 {
        ((self.cosines[k] - f64::from(y)) / (self.cosines[k] - self.cosines[k + 1])).clamp(0.0, 1.0)
    }

    /// Solid angle of each patch of row `k` [sr].
    pub(super) fn solid_angle(&self, k: usize) -> f64 {
        TAU64 / self.width as f64 * (self.cosines[k] - self.cosines[k + 1])
    }

    /// Row and column of the patch in the direction `w`, and the place in it, to the right and downwards.
    #[inline]
    pub(super) fn patch(&self, w: Vec3) -> (usize, usize, [f32; 2]) {
        // As atan2 counts, +z is half a turn and +x a quarter.
        let across = (w.x.atan2(-w.z) / (2.0 * PI) + self.turn).rem_euclid(1.0) * self.width as f32 - 0.5;
        let down = w.x.hypot(w.z).atan2(w.y) / PI * self.height as f32 + 0.5;
        let column = across.floor();
        let k = (down.max(0.0) as usize).min(self.height);
        let i = if column < 0.0 { self.width - 1 } else { (column as usize).min(self.width - 1) };
        (k, i, [(across - column).clamp(0.0, 1.0), (down - k as f32).clamp(0.0, 1.0)])
    }

    pub(super) fn at(&self, w: Vec3) -> Rgb {
        let (k, i, [x, y]) = self.patch(w);
        let [a, b, c, d] = self.corners(k, i);
        (a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y
    }

    /// Chance of the patch `i` in row `k`, and of those before the row and the column.
    fn chance(&self, k: usize, i: usize) -> ([f64; 2], [f32; 2]) {
        let above = if k == 0 { 0.0 } else { self.rows[k - 1] };
        let row = &self.columns[k * self.width..(k + 1) * self.width];
        let left = if i == 0 { 0.0 } else { row[i - 1] };
        ([above, self.rows[k]], [left, row[i]])
    }

    /// A direction from which light comes: a patch by its mean radiance times its solid angle, evenly in it.
    pub(super) fn sample(&self, [u, v]: [f32; 2]) -> Vec3 {
        let pick = f64::from(u);
        let k = self.rows.partition_point(|&c| c <= pick).min(self.height);
        let row = &self.columns[k * self.width..(k + 1) * self.width];
        let i = row.partition_point(|&c| c <= v).min(self.width - 1);
        let ([above, rows], [left, columns]) = self.chance(k, i);
        let y = ((pick - above) / (rows - above)).clamp(0.0, 1.0);
        let x = f64::from(((v - left) / (columns - left)).clamp(0.0, 1.0));
        self.direction(k, i, [x, y])
    }

    /// The direction at the place `x`, `y` in [0, 1] of the patch `i` of row `k`; even numbers are even in solid angle.
    pub(super) fn direction(&self, k: usize, i: usize, [x, y]: [f64; 2]) -> Vec3 {
        let cosine = self.cosines[k] + y * (self.cosines[k + 1] - self.cosines[k]);
        let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
        let angle = TAU64 * ((i as f64 + 0.5 + x) / self.width as f64 - f64::from(self.turn));
        Vec3::new((sine * angle.sin()) as f32, cosine as f32, (-sine * angle.cos()) as f32)
    }

    /// Chance per solid angle [1/sr] of `w` by [`Self::sample`].
    pub(super) fn pdf(&self, w: Vec3) -> f32 {
        let (k, i, _) = self.patch(w);
        let ([above, rows], [left, columns]) = self.chance(k, i);
        ((rows - above) * f64::from(columns - left) / self.solid_angle(k)) as f32
    }
}
