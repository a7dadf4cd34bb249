//! What is left of a triangle between planes.

use crate::math::DVec3;

/// A plane of which one side counts.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// A point of it [unit].
    pub at: DVec3,
    /// Towards the side that counts, of any length above 0.
    pub normal: DVec3,
}

/// Whether anything of a triangle is left when what lies outside of one of `sides` is cut off.
pub fn reaches_into(triangle: [DVec3; 3], sides: &[Side]) -> bool {
    let mut polygon = triangle.to_vec();
    for side in sides {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, &p) in polygon.iter().enumerate() {
            let next = polygon[(i + 1) % polygon.len()];
            let [a, b] = [p, next].map(|q| (q - side.at).dot(side.normal));
            if a > 0.0 {
                kept.push(p);
            }
            if (a > 0.0) != (b > 0.0) {
                kept.push(p + (next - p) * (a / (a - b)));
            }
        }
        polygon = kept;
    }
    !polygon.is_empty()
}
