//! What is odd about the polygons of a mesh file, in one sentence for each kind.

use super::polygon::Shape;
use crate::words::{counted, either};

/// A polygon with corners farther off its plane than this share of its size, the root of its area, is said to be not
/// plane: what lies between the corners is then a guess. A square folded along its diagonal by 30 degrees has 0.093, the
/// quads of a modelled head 0.02 in the median.
const BENT: f64 = 0.1;

/// Polygons of a file that are odd, to be said in one sentence each.
pub(super) struct OddPolygons {
    /// Where a polygon stands, before its number: "in line".
    place: &'static str,
    polygons: usize,
    crossing: usize,
    first_crossing: usize,
    bent: usize,
    most_bent: (f64, usize),
}

impl OddPolygons {
    /// `place` tells where a polygon stands, before its number: "in line".
    pub(super) fn new(place: &'static str) -> Self {
        Self { place, polygons: 0, crossing: 0, first_crossing: 0, bent: 0, most_bent: (0.0, 0) }
    }

    /// Counts a polygon at the place number `number`.
    pub(super) fn count(&mut self, shape: Shape, number: usize) {
        self.polygons += 1;
        if shape.crosses {
            self.crossing += 1;
            if self.crossing == 1 {
                self.first_crossing = number;
            }
        }
        if shape.off_plane > BENT {
            self.bent += 1;
            if shape.off_plane > self.most_bent.0 {
                self.most_bent = (shape.off_plane, number);
            }
        }
    }

    /// What there is to say.
    pub(super) fn remarks(&self) -> impl Iterator<Item = String> {
        let (all, remedy) =
            (counted(self.polygons, "polygon", "polygons"), "cut them into triangles in the modelling program");
        let crossing = (self.crossing > 0).then(|| {
            let (n, place, first) = (self.crossing, self.place, self.first_crossing);
            let (cross, are) = (either(n, "crosses or covers itself", "cross or cover themselves"), either(n, "is", "are"));
            let they_wind = either(n, "it winds", "they wind");
            format!(
                "{n} of {all} {cross} (the first {place} {first}) and {are} filled wherever {they_wind} round a point; {remedy}"
            )
        });
        let bent = (self.bent > 0).then(|| {
            let (n, place, (off, number)) = (self.bent, self.place, self.most_bent);
            format!(
                "{n} of {all} {} not plane (corners up to {off:.2} of the polygon's size off its plane, {place} {number}): \
                 the surface between their corners is a guess; {remedy}",
                either(n, "is", "are")
            )
        });
        crossing.into_iter().chain(bent)
    }
}
