//! Which of several lights is asked.

use super::tree::{Pick, Tree};
use super::{Light, LightBounds, Reference};
use crate::math::{hash_combine, unit_f64};

/// More lights at places than these are chosen by a tree. With three it has 1.5 to 5 times less error in equal time (`benches/lights.rs`).
pub const FEW: usize = 2;

/// A choice among lights, which are numbered from 0: by power, or, where there are many, by what they may send to the place that asks.
pub struct Choice {
    /// Chance by power of each and of all before it.
    cumulative: Vec<f64>,
    tree: Option<Tree>,
}

impl Choice {
    /// Among `lights`, in their order; of more than `few` at places by a tree.
    pub fn new<'a>(lights: impl Iterator<Item = &'a dyn Light> + Clone, few: usize) -> Self {
        let bounds: Option<Vec<LightBounds>> = lights.clone().map(Light::bounds).collect();
        let tree = bounds.filter(|bounds| bounds.len() > few).map(|bounds| Tree::new(&bounds));
        Self { tree, ..Self::by_power(lights) }
    }

    /// Whatever their number, by power.
    pub fn by_power<'a>(lights: impl Iterator<Item = &'a dyn Light>) -> Self {
        let mut power = 0.0;
        let mut cumulative: Vec<f64> = lights
            .map(|light| {
                power += light.power();
                power
            })
            .collect();
        cumulative.iter_mut().for_each(|sum| *sum /= power);
        Self { cumulative, tree: None }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.cumulative.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.cumulative.is_empty()
    }

    /// Whether they are chosen by a tree.
    pub fn is_by_tree(&self) -> bool {
        self.tree.is_some()
    }

    /// One of them for `from`; `None` where none of them can shine there. `u` in [0, 1); of the other numbers of the draw, `more`, come
    /// the digits that a number in f32 lacks for a choice among many: it knows no chance below 2^-24.
    #[inline]
    pub fn pick(&self, from: &Reference, u: f32, more: [f32; 2]) -> Option<Pick> {
        match &self.tree {
            None => self.pick_by_power(u, more),
            Some(tree) => tree.pick(from, self.number(u, more)),
        }
    }

    /// The chance of number `light` by [`Self::pick`].
    #[inline]
    pub fn chance(&self, from: &Reference, light: usize) -> f64 {
        match &self.tree {
            None => self.share(light),
            Some(tree) => tree.chance(from, light),
        }
    }

    fn pick_by_power(&self, u: f32, more: [f32; 2]) -> Option<Pick> {
        let pick = self.number(u, more);
        let light = self.cumulative.partition_point(|&c| c <= pick).min(self.len().checked_sub(1)?);
        let (below, chance) = (self.below(light), self.share(light));
        Some(Pick { light, chance, left: (pick - below) / chance })
    }

    /// The share of number `light` in the power of all.
    pub fn share(&self, light: usize) -> f64 {
        self.cumulative[light] - self.below(light)
    }

    fn below(&self, light: usize) -> f64 {
        if light == 0 { 0.0 } else { self.cumulative[light - 1] }
    }

    fn number(&self, u: f32, more: [f32; 2]) -> f64 {
        if self.len() <= FEW {
            return u.into();
        }
        let [a, b] = more.map(|u| u64::from(u.to_bits()));
        let digits = unit_f64((hash_combine(a, b) >> 32) as u32);
        (f64::from(u) + digits / 16_777_216.0).min(1.0 - f64::EPSILON)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{hash, unit_f32};

    /// The digits that f32 lacks are even, and do not move a number past the next of f32.
    #[test]
    fn a_number_among_many_is_even_below_the_digits_of_f32() {
        let many = Choice { cumulative: vec![0.0; FEW + 1], tree: None };
        let (n, u) = (10_000_u64, 0.25_f32);
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..n {
            let more = [0, 1].map(|k| unit_f32((hash(2 * i + k + 1) >> 32) as u32));
            let digits = (many.number(u, more) - 0.25) * 16_777_216.0;
            assert!((0.0..1.0).contains(&digits));
            (sum, squares) = (sum + digits, squares + digits * digits);
        }
        let (mean, square) = (sum / n as f64, squares / n as f64);
        assert!((mean - 0.5).abs() < 6.0 * (12.0 * n as f64).sqrt().recip(), "{mean}");
        assert!((square - 1.0 / 3.0).abs() < 6.0 * (4.0 / 45.0 / n as f64).sqrt(), "{square}");
        let few = Choice { cumulative: vec![0.0; FEW], tree: None };
        assert_eq!(few.number(u, [0.3, 0.7]), 0.25);
        assert!(many.number(1.0, [0.3, 0.7]) < 1.0);
    }
}
