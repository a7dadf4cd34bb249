//! Meshes and rays for the backends to agree on.

use marmor::geometry::Mesh;
use marmor::math::{DVec3, Vec3, hash_combine, unit_f32};
use marmor::query::Ray;

/// Numbers from a seed.
pub struct PathSampler {
    seed: u64,
    next: u64,
}

impl PathSampler {
    pub fn new(seed: u64) -> Self {
        Self { seed, next: 0 }
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        self.next += 1;
        unit_f32((hash_combine(self.seed, self.next) >> 32) as u32)
    }

    /// In the cube from -1 to 1.
    pub fn point(&mut self) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| 2.0 * self.unit() - 1.0))
    }

    /// A unit vector, any direction alike.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.point();
            if p.length_squared() > 1e-2 && p.length_squared() < 1.0 {
                return p.normalize();
            }
        }
    }

    pub fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f32) as usize).min(n - 1)
    }
}

pub fn mesh_of(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Mesh {
    let mut mesh = Mesh::default();
    for corners in triangles {
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(corners.map(|p| p.as_dvec3()));
        mesh.triangles.push([base, base + 1, base + 2]);
    }
    mesh
}

/// Triangles of many sizes in the cube from -1 to 1.
pub fn soup(draws: &mut PathSampler, n: usize) -> Mesh {
    mesh_of((0..n).map(|_| {
        let (at, size) = (draws.point(), 0.02 + 0.5 * draws.unit().powi(3));
        [0; 3].map(|_| at + draws.point() * size)
    }))
}

pub fn placed(mesh: &Mesh, scale: f32, offset: Vec3) -> Mesh {
    let place = |p: &DVec3| (p.as_vec3() * scale + offset).as_dvec3();
    Mesh { positions: mesh.positions.iter().map(place).collect(), ..mesh.clone() }
}

/// From around the cube to a point in it, with directions of any length.
pub fn rays(draws: &mut PathSampler, n: usize, scale: f32, offset: Vec3) -> Vec<Ray> {
    (0..n)
        .map(|_| {
            let (from, to) = (draws.direction() * 2.5 * draws.unit() * scale + offset, draws.point() * scale + offset);
            Ray::new(from.as_dvec3(), (to - from) * (0.1 + 3.0 * draws.unit()))
        })
        .collect()
}

/// A closed, star-shaped surface about the origin: a sphere of radius 1 with bumps, `rings` by 2 `rings` cells.
pub fn bumpy_sphere(rings: u32) -> Mesh {
    let sectors = 2 * rings;
    let at = |ring: u32, sector: u32| {
        let theta = std::f32::consts::PI * ring as f32 / rings as f32;
        let phi = std::f32::consts::TAU * sector as f32 / sectors as f32;
        let bump = 1.0 + 0.1 * (5.0 * phi).sin() * (7.0 * theta).sin() * theta.sin();
        (Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()) * bump).as_dvec3()
    };
    let mut mesh = Mesh::default();
    mesh.positions.push(at(0, 0));
    mesh.positions.extend((1..rings).flat_map(|r| (0..sectors).map(move |s| at(r, s))));
    mesh.positions.push(at(rings, 0));
    let last = mesh.positions.len() as u32 - 1;
    let index = |ring: u32, sector: u32| match ring {
        0 => 0,
        r if r == rings => last,
        r => 1 + (r - 1) * sectors + sector % sectors,
    };
    for ring in 0..rings {
        for sector in 0..sectors {
            let [a, b] = [index(ring, sector), index(ring, sector + 1)];
            let [c, d] = [index(ring + 1, sector), index(ring + 1, sector + 1)];
            if ring > 0 {
                mesh.triangles.push([a, b, c]);
            }
            if ring + 1 < rings {
                mesh.triangles.push([b, d, c]);
            }
        }
    }
    mesh
}
