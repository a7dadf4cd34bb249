//! Pencil beams into slabs, half spaces and balls by the path code of the renderer, and where they come out.
#![allow(dead_code)] // each test and bench uses its part
#![allow(clippy::unwrap_used)] // a mesh of this file that a backend refuses has failed

use marmor::bssrdf::ModelName;
use marmor::geometry::{Findings, Mesh, RawMesh, sphere};
use marmor::integrator::{Left, View, VolumePath, VolumePathOptions};
use marmor::math::{DVec3, Rgb, Vec3, hash};
use marmor::optics::Medium;
use marmor::query::{self, Backend, Ray, RayQuery};
use marmor::scene::{Camera, Insides, Material, Object, Orders, Scene, Surface, Translucent};
use marmor::tally::WalkTally;
use std::ops::Range;

/// Where beams enter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// The top z = 0 of a box, at the origin.
    Slab { thickness: f32, half_width: f32 },
    /// Anywhere on a ball about the origin.
    Ball { radius: f32 },
}

/// A body of one medium.
pub struct Body {
    pub shape: Shape,
    scene: Scene,
}

/// Sum and sum of squares of weights.
#[derive(Clone, Copy, Default)]
pub struct Sum {
    n: f64,
    squares: f64,
}

impl Sum {
    /// One path's weight.
    pub fn add(&mut self, w: f64) {
        self.n += w;
        self.squares += w * w;
    }

    /// The paths of both.
    pub fn join(&mut self, other: &Self) {
        self.n += other.n;
        self.squares += other.squares;
    }

    /// Mean over `paths` and its standard error.
    pub fn mean(&self, paths: f64) -> (f64, f64) {
        let mean = self.n / paths;
        (mean, ((self.squares / paths - mean * mean).max(0.0) / paths).sqrt())
    }
}

/// Light that came out.
#[derive(Clone, Copy, Debug)]
pub struct Out {
    /// Straight distance from the entry [unit].
    pub chord: f32,
    /// Distance from the entry along the plane of the entry [unit].
    pub r: f32,
    /// Whether it left a slab through the far face.
    pub far: bool,
    /// Share of the light that entered.
    pub weight: f32,
    /// Times scattered.
    pub order: u32,
}

impl Body {
    pub fn new(shape: Shape, medium: Medium) -> Self {
        let mesh = match shape {
            Shape::Slab { thickness, half_width } => slab(thickness, half_width),
            // Steps of three degrees and less: the facets of a large ball are flat to a hundredth of a mean free path.
            Shape::Ball { radius } => {
                let rings = (24.0 * radius.sqrt()).clamp(64.0, 192.0) as u32;
                ball(sphere(DVec3::ZERO, radius.into(), rings, 2 * rings))
            }
        };
        let camera = Camera::new([1, 1], DVec3::splat(-1e6), Vec3::NEG_Z, Vec3::Y, 1.0, 1.0).unwrap();
        let translucent = Translucent {
            medium,
            model: ModelName::STANDARD,
            thickness: None,
            calibrated: false,
            exit_normalisation: true,
            tint: None,
            rough: None,
            source: String::new(),
        };
        let objects = vec![Object {
            name: "body".into(),
            parts: vec!["body".into()],
            at: String::new(),
            mesh,
            material: 0,
            flipped: false,
            findings: Findings::default(),
            priority: 0,
            sheet: None,
        }];
        let materials = vec![Material { name: "body".into(), surface: Surface::translucent(translucent) }];
        let scene = Scene {
            name: "pencil".into(),
            unit_in_mm: None,
            centre: DVec3::ZERO,
            camera,
            bodies: Scene::bodies_of(&objects, &materials),
            objects,
            materials,
            environment: Rgb::BLACK.into(),
            lights: Vec::new(),
            why_double: None,
            warnings: Vec::new(),
            insides: Insides::default(),
        };
        Self { shape, scene }
    }

    /// What leaves of the paths with these numbers; each number is a path of its own for a given `seed`.
    pub fn run(&self, paths: Range<u64>, seed: u64, mut each: impl FnMut(Out)) -> WalkTally {
        let rays = query::build(Backend::preferred(), &self.scene.meshes()).unwrap();
        let view = View { scene: &self.scene, rays: &*rays };
        let options = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed };
        let method = VolumePath::new(&self.scene, options).unwrap();
        let mut tally = WalkTally::default();
        for i in paths {
            let key = hash(seed << 40 | i);
            let (start, w) = self.entry(&*rays, key);
            let Some(left) = method.pencil(view, 0, (start, w), 0.5, key, &mut tally) else { continue };
            each(self.out(start, w, &left));
        }
        tally
    }

    fn entry(&self, rays: &dyn RayQuery, key: u64) -> (DVec3, Vec3) {
        match self.shape {
            Shape::Slab { thickness, .. } => (DVec3::new(0.0, 0.0, -1e-6 * f64::from(thickness)), Vec3::NEG_Z),
            Shape::Ball { radius } => {
                let number = |k: u64| (hash(key ^ k) >> 40) as f32 / (1 << 24) as f32;
                let (z, phi) = (2.0 * number(0x5eed) - 1.0, std::f32::consts::TAU * number(0xface));
                let s = (1.0 - z * z).sqrt();
                let towards = -Vec3::new(s * phi.cos(), s * phi.sin(), z);
                let hit = rays.closest(&Ray::new((towards * (-2.0 * radius)).as_dvec3(), towards)).unwrap();
                let at = self.scene.objects[0].mesh.point(hit.triangle, hit.u, hit.v);
                (at.leave(-at.n_geometric), -at.n_geometric)
            }
        }
    }

    fn out(&self, start: DVec3, w: Vec3, left: &Left) -> Out {
        let x = (left.x - start).as_vec3();
        let r = (x - w * x.dot(w)).length();
        let far = matches!(self.shape, Shape::Slab { thickness, .. } if left.x.z < -0.5 * f64::from(thickness));
        Out { chord: x.length(), r, far, weight: left.weight[0], order: left.order }
    }
}

/// A box below z = 0.
fn slab(thickness: f32, half: f32) -> Mesh {
    let [thickness, half] = [thickness, half].map(f64::from);
    let mut positions = Vec::new();
    for z in [0.0, -thickness] {
        positions
            .extend([[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, y]| DVec3::new(x, y, z)));
    }
    let faces = [[0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}

fn ball(made: RawMesh) -> Mesh {
    Mesh { positions: made.positions, triangles: made.triangles, ..Mesh::default() }
}
