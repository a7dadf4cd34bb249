//! Photons in cubes of space, to find those within reach of a point.

use crate::math::{Aabb, DVec3, Rgb, Vec3};

/// Light scattered at a point.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// The point [unit].
    pub x: DVec3,
    /// Unit direction in which the light came.
    pub w: Vec3,
    /// Flux that is scattered [radiance unit x sr x unit²]; all photons of a pass together stand for the whole.
    pub flux: Rgb,
}

/// Photons sorted by the cube they lie in.
pub struct Cells {
    lo: DVec3,
    edge: f32,
    size: [usize; 3],
    /// Photons before each cube, and their number.
    starts: Vec<u32>,
    photons: Vec<Photon>,
    reach: f32,
    yielding: f32,
}

/// Cubes at most; beyond, they become larger than half the reach.
const MOST_CELLS: f64 = 4e6;

impl Cells {
    /// `photons` for queries of radius `reach` [unit], whose connections yield to the walk by `yielding` [unit²]: see
    /// [`super::connect::walked_mis_weight`].
    pub fn new(photons: Vec<Photon>, reach: f32, yielding: f32) -> Self {
        let bounds = Aabb::around(photons.iter().map(|p| p.x));
        if photons.is_empty() {
            return Self { lo: DVec3::ZERO, edge: 1.0, size: [0; 3], starts: vec![0], photons, reach, yielding };
        }
        let side = bounds.extent().as_vec3().max(Vec3::splat(1e-6 * reach));
        let finest = (side.x as f64 * side.y as f64 * side.z as f64 / MOST_CELLS).cbrt() as f32;
        let longest = side.max_element() / 1000.0;
        let edge = (0.5 * reach).max(finest).max(longest);
        let size = (side / edge).to_array().map(|n| n as usize + 1);
        let starts = vec![0; size.iter().product::<usize>() + 1];
        let mut cells = Self { lo: bounds.lower, edge, size, starts, photons, reach, yielding };
        let homes: Vec<u32> = cells.photons.iter().map(|p| cells.home(p.x)).collect();
        for &home in &homes {
            cells.starts[home as usize + 1] += 1;
        }
        for i in 1..cells.starts.len() {
            cells.starts[i] += cells.starts[i - 1];
        }
        let mut next = cells.starts.clone();
        let mut sorted = vec![Photon { x: DVec3::ZERO, w: Vec3::ZERO, flux: Default::default() }; cells.photons.len()];
        for (photon, &home) in cells.photons.iter().zip(&homes) {
            sorted[next[home as usize] as usize] = *photon;
            next[home as usize] += 1;
        }
        cells.photons = sorted;
        cells
    }

    fn home(&self, x: DVec3) -> u32 {
        let cell = (x - self.lo).as_vec3() / self.edge;
        let [i, j, k] = [0, 1, 2].map(|a| (cell[a].max(0.0) as usize).min(self.size[a] - 1));
        ((k * self.size[1] + j) * self.size[0] + i) as u32
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// Rows of cubes that hold every photon within reach of `x`, as ranges of photons; into `rows`. Their number.
    pub fn near(&self, x: DVec3, rows: &mut Vec<(u32, u32)>) -> u32 {
        rows.clear();
        if self.photons.is_empty() {
            return 0;
        }
        let centre = (x - self.lo).as_vec3() / self.edge;
        let reach = self.reach / self.edge;
        let range = |axis: usize, reach: f32| {
            let n = self.size[axis] as f32;
            let (from, to) = ((centre[axis] - reach).floor(), (centre[axis] + reach).floor());
            if to < 0.0 || from >= n { 0..0 } else { from.max(0.0) as usize..to.min(n - 1.0) as usize + 1 }
        };
        let gap = |axis: usize, cell: usize| {
            let at = cell as f32;
            (at - centre[axis]).max(centre[axis] - at - 1.0).max(0.0)
        };
        let mut count = 0;
        for k in range(2, reach) {
            for j in range(1, reach) {
                let (dy, dz) = (gap(1, j), gap(2, k));
                let left = reach * reach - dy * dy - dz * dz;
                if left <= 0.0 {
                    continue;
                }
                let cells = range(0, left.sqrt());
                if cells.is_empty() {
                    continue;
                }
                let row = (k * self.size[1] + j) * self.size[0];
                let (from, to) = (self.starts[row + cells.start], self.starts[row + cells.end]);
                if to > from {
                    rows.push((from, to));
                    count += to - from;
                }
            }
        }
        count
    }

    /// Photons of a range that [`Self::near`] gave.
    #[inline]
    pub fn photons(&self, row: (u32, u32)) -> &[Photon] {
        &self.photons[row.0 as usize..row.1 as usize]
    }

    /// Queries reach this far [unit].
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// How far a connection's share yields to the walk's [unit²].
    pub fn yielding(&self) -> f32 {
        self.yielding
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rgb, hash, unit_f32};

    #[test]
    fn every_photon_within_reach_is_in_the_rows() {
        let at = |i: u64| {
            let u = |d: u64| f64::from(unit_f32((hash(3 * i + d + 1) >> 32) as u32));
            DVec3::new(9.0 * u(0), 4.0 * u(1) - 2.0, 0.3 * u(2))
        };
        let photons: Vec<Photon> =
            (0..5000).map(|i| Photon { x: at(i), w: Vec3::Z, flux: Rgb::splat(i as f32) }).collect();
        let cells = Cells::new(photons.clone(), 0.7, 1.0);
        let mut rows = Vec::new();
        for i in 0..200 {
            let x = at(i + 9000) * 1.2 - 0.4;
            let count = cells.near(x, &mut rows);
            let found: Vec<f32> = rows.iter().flat_map(|&r| cells.photons(r)).map(|p| p.flux[0]).collect();
            assert_eq!(found.len(), count as usize);
            for p in &photons {
                assert!(p.x.distance(x) > 0.7 || found.contains(&p.flux[0]), "{x}: {:?} is missing", p.x);
            }
        }
        assert_eq!(Cells::new(Vec::new(), 1.0, 1.0).near(DVec3::ZERO, &mut rows), 0);
    }
}
