//! Boxes along the axes.

use glam::{DVec3, Vec3};

/// A box along the axes: its lower and its upper corner, in f64 ([`Aabb`]) or f32 ([`Aabb32`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisBox<V> {
    /// Smallest coordinates.
    pub lower: V,
    /// Largest coordinates.
    pub upper: V,
}

/// A box of places.
pub type Aabb = AxisBox<DVec3>;

/// A box in f32.
pub type Aabb32 = AxisBox<Vec3>;

macro_rules! axis_box {
    ($vector:ty, $number:ty) => {
        impl AxisBox<$vector> {
            /// The box of nothing: whatever it is joined with is the sum.
            pub const EMPTY: Self = Self { lower: <$vector>::INFINITY, upper: <$vector>::NEG_INFINITY };

            /// The box around points.
            #[inline]
            pub fn around(points: impl IntoIterator<Item = $vector>) -> Self {
                let mut all = Self::EMPTY;
                points.into_iter().for_each(|p| all.grow(p));
                all
            }

            /// Takes in a point.
            #[inline]
            pub fn grow(&mut self, p: $vector) {
                (self.lower, self.upper) = (self.lower.min(p), self.upper.max(p));
            }

            /// The box around both.
            #[inline]
            #[must_use]
            pub fn join(self, other: Self) -> Self {
                Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
            }

            /// Whether nothing is in it.
            #[inline]
            pub fn is_empty(&self) -> bool {
                self.lower.cmpgt(self.upper).any()
            }

            /// Whether `p` is in it or on its rim.
            #[inline]
            pub fn contains(&self, p: $vector) -> bool {
                self.lower.cmple(p).all() && self.upper.cmpge(p).all()
            }

            /// Whether it is within `gap` of the other along each axis.
            #[inline]
            pub fn is_near(&self, other: &Self, gap: $number) -> bool {
                let gap = <$vector>::splat(gap);
                self.lower.cmple(other.upper + gap).all() && other.lower.cmple(self.upper + gap).all()
            }

            /// Distance to the other; 0 where they meet.
            pub fn distance(&self, other: &Self) -> $number {
                (self.lower - other.upper).max(other.lower - self.upper).max(<$vector>::ZERO).length()
            }

            /// Lengths of its edges.
            #[inline]
            pub fn extent(&self) -> $vector {
                self.upper - self.lower
            }

            /// The axis of its longest edge, the first of equals.
            #[inline]
            pub fn longest_axis(&self) -> usize {
                self.extent().max_position()
            }

            /// Its middle; halved before it is added, so that it cannot overflow.
            #[inline]
            pub fn centre(&self) -> $vector {
                0.5 * self.lower + 0.5 * self.upper
            }

            /// The largest coordinate of its points, without its sign.
            pub fn farthest(&self) -> $number {
                self.lower.abs().max(self.upper.abs()).max_element()
            }
        }
    };
}

axis_box!(DVec3, f64);
axis_box!(Vec3, f32);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_of_points_have_their_middle_their_edges_and_their_distances() {
        let one = Aabb::around([DVec3::new(1.0, -4.0, 0.0), DVec3::new(-1.0, 2.0, 3.0)]);
        assert_eq!((one.lower, one.upper), (DVec3::new(-1.0, -4.0, 0.0), DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!((one.extent(), one.centre()), (DVec3::new(2.0, 6.0, 3.0), DVec3::new(0.0, -1.0, 1.5)));
        assert_eq!((one.longest_axis(), one.farthest()), (1, 4.0));
        let other = Aabb::around([DVec3::new(4.0, 6.0, 1.0), DVec3::new(5.0, 7.0, 2.0)]);
        assert_eq!((one.distance(&other), other.distance(&one), one.distance(&one)), (5.0, 5.0, 0.0));
        assert!(one.is_near(&other, 4.0) && other.is_near(&one, 4.0) && !one.is_near(&other, 3.999));
        let both = one.join(other);
        assert!(both.contains(DVec3::new(5.0, 7.0, 3.0)) && !both.contains(DVec3::new(5.1, 7.0, 3.0)));
        assert_eq!((Aabb::EMPTY.join(one), Aabb::EMPTY.is_empty(), one.is_empty()), (one, true, false));
        let huge = Aabb::around([DVec3::splat(f64::MAX), DVec3::splat(0.5 * f64::MAX)]);
        assert_eq!(huge.centre(), DVec3::splat(0.75 * f64::MAX));
    }
}
