//! Random scenes of two to four translucent bodies, apart, touching and in one another: what `volume_path` accepts, which is most, it
//! traces without loss. `MARMOR_GEOMETRY_SCENES=10000` asks for more scenes than the suite has.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

mod rendering;
#[path = "../src/geometry/test_shapes.rs"]
mod shapes;

use marmor::geometry::{RawMesh, write_obj};
use marmor::integrator::{View, VolumePath, VolumePathOptions, traceable};
use marmor::math::{DAffine3, DVec3, hash, unit_f64};
use marmor::query::{self, Backend};
use marmor::scene::{Obstacle, ObstacleKind, Orders, Scene};
use marmor::tally::TOLERATED;
use rendering::{backends, load_in, mean_of, run};
use shapes::{cuboid, joined};

/// Numbers of one scene.
struct Dice(u64);

impl Dice {
    fn number(&mut self) -> f64 {
        self.0 += 1;
        unit_f64((hash(self.0) >> 32) as u32)
    }

    fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.number()
    }

    fn below(&mut self, n: u32) -> u32 {
        ((self.number() * f64::from(n)) as u32).min(n - 1)
    }

    fn direction(&mut self) -> DVec3 {
        let (z, phi) = (self.between(-1.0, 1.0), self.between(0.0, std::f64::consts::TAU));
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * phi.cos(), r * phi.sin(), z)
    }
}

fn torus(large: f64, small: f64, n: u32) -> RawMesh {
    let mut mesh = RawMesh::default();
    for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
        let [u, v] = [i, j].map(|k| std::f64::consts::TAU * f64::from(k) / f64::from(n));
        let r = large + small * v.cos();
        mesh.positions.push(DVec3::new(r * u.cos(), r * u.sin(), small * v.sin()));
        let at = |i: u32, j: u32| i % n * n + j % n;
        mesh.triangles.extend([[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
    }
    mesh
}

/// A body in its own place, the radius of a ball around it, and half its edges if it is a box.
#[derive(Clone)]
struct Body {
    mesh: RawMesh,
    centre: DVec3,
    radius: f64,
    half: Option<DVec3>,
}

fn body(dice: &mut Dice, boxes: bool) -> Body {
    let size = dice.between(0.5, 1.5);
    let (mesh, radius, half) = match if boxes { 0 } else { dice.below(3) } {
        0 => {
            let half = DVec3::new(dice.between(0.3, 1.0), dice.between(0.3, 1.0), dice.between(0.3, 1.0)) * size;
            (cuboid(DVec3::ZERO, half, 1 + dice.below(3), dice.below(2) == 0), half.length(), Some(half))
        }
        1 => {
            let mut ball = marmor::geometry::sphere(DVec3::ZERO, size, 6 + dice.below(6), 9 + dice.below(9));
            ball.normals = None;
            (ball, size, None)
        }
        _ => (torus(0.7 * size, 0.25 * size, 8 + dice.below(6)), 0.95 * size, None),
    };
    Body { mesh, centre: DVec3::ZERO, radius, half }
}

/// What a new body is to the one before.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Placed {
    Apart,
    /// A little above the gap that counts as none.
    Nearly,
    /// A part of a face in common.
    Face,
    /// Nothing but a part of an edge, or a corner.
    Edge,
    Equal,
    Overlap,
    Nested,
    /// Nested, and turned inwards, in one mesh.
    Cavity,
    /// A bar through it.
    Through,
}

const ALL: [Placed; 9] = [
    Placed::Apart,
    Placed::Nearly,
    Placed::Face,
    Placed::Edge,
    Placed::Equal,
    Placed::Overlap,
    Placed::Nested,
    Placed::Cavity,
    Placed::Through,
];

/// A body placed so with regard to `last`, a box where that is asked for.
fn place(dice: &mut Dice, last: &Body, how: Placed) -> Body {
    let mut new = body(dice, matches!(how, Placed::Face | Placed::Nearly | Placed::Edge));
    let half = last.half.unwrap_or(DVec3::splat(0.5 * last.radius));
    let axis = dice.below(3) as usize;
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let side = if dice.below(2) == 0 { 1.0 } else { -1.0 };
    let (reach, wide) =
        (new.half.unwrap_or_default(), |k: usize, new: &Body| half[k] + new.half.unwrap_or_default()[k]);
    match how {
        Placed::Apart => new.centre = dice.direction() * (last.radius + new.radius) * dice.between(1.001, 1.5),
        Placed::Face | Placed::Nearly => {
            let gap = if how == Placed::Face { 0.0 } else { 1e-4 * 10.0_f64.powf(dice.between(0.0, 2.0)) };
            new.centre[axis] = side * (half[axis] + reach[axis] + gap);
            for k in [u, v] {
                // Equal extents and one corner in common more often than by luck.
                new.centre[k] = match dice.below(3) {
                    0 => 0.0,
                    1 => half[k] - reach[k],
                    _ => 0.7 * wide(k, &new) * dice.between(-1.0, 1.0),
                };
            }
        }
        Placed::Edge => {
            new.centre[axis] = side * wide(axis, &new);
            new.centre[u] = wide(u, &new);
            new.centre[v] = [0.0, wide(v, &new), 0.5 * wide(v, &new)][dice.below(3) as usize];
        }
        Placed::Equal => new = Body { centre: DVec3::ZERO, ..last.clone() },
        Placed::Overlap => {
            new = Body { centre: DVec3::ZERO, ..last.clone() };
            new.centre = dice.direction() * 0.2 * last.radius;
        }
        Placed::Nested | Placed::Cavity => {
            // About the middle of the tube, if it is a torus.
            let tube = last.half.is_none()
                && last.mesh.positions.iter().all(|p| p.length() > 0.3 * last.radius && p.z.abs() < 0.6 * last.radius);
            let (at, scale) = if tube {
                (DVec3::X * 0.7 / 0.95 * last.radius, 0.1 * last.radius)
            } else {
                (DVec3::ZERO, 0.2 * half.min_element())
            };
            new.mesh.positions.iter_mut().for_each(|p| *p *= scale / new.radius);
            new.half = new.half.map(|h| h * scale / new.radius);
            (new.radius, new.centre) = (scale, at);
            if how == Placed::Cavity {
                new.mesh = new.mesh.flipped();
            }
        }
        Placed::Through => {
            let mut bar = DVec3::splat(0.2 * half.min_element());
            bar[axis] = 2.0 * last.radius;
            new = Body {
                mesh: cuboid(DVec3::ZERO, bar, 1 + dice.below(3), false),
                centre: DVec3::ZERO,
                radius: bar.length(),
                half: Some(bar),
            };
            if last.half.is_none() {
                new.centre = last.mesh.positions[0] * 0.999;
            } else if dice.below(2) == 0 {
                // Faces in one plane.
                new.centre[u] = half[u] - bar[u];
            }
        }
    }
    new.centre += last.centre;
    new
}

/// A scene, and what its bodies are to each other.
fn scene(number: u64) -> (Scene, Vec<Placed>) {
    let mut dice = Dice(number << 20);
    let mut bodies = vec![body(&mut dice, number.is_multiple_of(2))];
    let mut placed = Vec::new();
    let count = 1 + dice.below(3);
    let mut meshes = vec![vec![0_usize]];
    for i in 0..count {
        // Every kind as often as any other, and first of all where it is alone.
        let mut how = if i == 0 { ALL[(number % 9) as usize] } else { ALL[dice.below(9) as usize] };
        if matches!(how, Placed::Face | Placed::Nearly | Placed::Edge) && bodies.last().unwrap().half.is_none() {
            if i == 0 {
                bodies[0] = body(&mut dice, true);
            } else {
                // What that body is to the one before stays as it is.
                how = Placed::Apart;
            }
        }
        let new = place(&mut dice, bodies.last().unwrap(), how);
        bodies.push(new);
        placed.push(how);
        if how == Placed::Cavity || dice.below(3) == 0 {
            meshes.last_mut().unwrap().push(bodies.len() - 1);
        } else {
            meshes.push(vec![bodies.len() - 1]);
        }
    }
    // Turned, half of them.
    let turn = if dice.below(2) == 0 {
        glam::DMat3::IDENTITY
    } else {
        glam::DMat3::from_axis_angle(dice.direction(), dice.between(0.0, 6.0))
    };
    let folder = tempfile::tempdir().unwrap();
    let eta = [1.0, 1.3, 0.75][dice.below(3) as usize];
    let g = dice.between(-0.5, 0.8);
    let mut text = format!(
        "unit = \"mm\"\n[environment]\nradiance = 1\n[material.wax]\ntype = \"translucent\"\nsigma_s = {}\nsigma_a = 0\ng = {g}\neta = {eta}\n",
        dice.between(0.5, 4.0)
    );
    let (mut middle, mut far) = (DVec3::ZERO, 0.0_f64);
    for body in &bodies {
        middle += turn * body.centre / bodies.len() as f64;
    }
    for (k, parts) in meshes.iter().enumerate() {
        let mesh = parts
            .iter()
            .map(|&b| bodies[b].mesh.clone().placed(DAffine3::from_mat3_translation(turn, turn * bodies[b].centre)));
        let mesh = mesh.reduce(|a, b| joined(a, &b)).unwrap();
        far = mesh.positions.iter().map(|p| p.distance(middle)).fold(far, f64::max);
        let mut obj = Vec::new();
        write_obj(&mesh, &mut obj).unwrap();
        std::fs::write(folder.path().join(format!("{k}.obj")), obj).unwrap();
        text += &format!("[[object]]\nname = \"{k}\"\nmesh = \"{k}.obj\"\nmaterial = \"wax\"\n");
    }
    let eye = middle + dice.direction() * 4.0 * far;
    text += &format!(
        "[camera]\nposition = {:?}\nlook_at = {:?}\nfov = 20\nup = [0.3, 0.5, 0.8]\nresolution = [8, 8]\n[method]\nname = \"volume_path\"\n",
        eye.to_array(),
        middle.to_array()
    );
    (load_in(folder.path(), &text), placed)
}

#[test]
fn no_scene_is_both_accepted_and_wrong() {
    let count = std::env::var("MARMOR_GEOMETRY_SCENES").map_or(270, |n| n.parse().unwrap());
    let (mut accepted, mut told, mut paths, mut lost, mut worst) = (0, 0, 0, 0, 0.0_f64);
    let backends: Vec<Backend> = backends().collect();
    for number in 0..count {
        let (scene, placed) = scene(number);
        let refusals = traceable(&scene);
        let what = format!("scene {number}, {placed:?}: {refusals:?}");
        if let [how] = placed[..] {
            // A part that is in its mesh twice has every face twice, so that no face says where inside is: refused by name, with its
            // remedy. Two bodies are accepted in any place.
            let twice = how == Placed::Equal && scene.objects.len() == 1;
            let repeats = |o: &Obstacle| {
                o.kind == ObstacleKind::Faces && o.what.contains("repeat another") && o.remedy.contains("--repair")
            };
            assert!(refusals.is_empty() || twice && refusals.iter().all(repeats), "refused: {what}");
            assert!(!twice || !refusals.is_empty(), "accepted: {what}");
        }
        if !refusals.is_empty() {
            continue;
        }
        assert!(!scene.obstacles().iter().any(|o| o.kind == ObstacleKind::Unknown), "{what}");
        accepted += 1;
        let rays = query::build(backends[number as usize % backends.len()], &scene.meshes()).unwrap();
        let options = VolumePathOptions { orders: Orders::All, photons: 0, specular: true, seed: number };
        let method = VolumePath::new(&scene, options).unwrap();
        let render = |passes: u32| {
            let view = View { scene: &scene, rays: &*rays };
            let (film, outcome) = run(&method, view, number, 0..passes, &mut []);
            (film, outcome.tally.walk)
        };
        let (mut film, mut walk) = render(16);
        if walk.losses.total() as f64 > TOLERATED * walk.walks as f64 {
            // One of some hundred paths tells no share of a thousandth: many more decide.
            (film, walk) = render(2048);
        }
        (paths, lost) = (paths + walk.walks, lost + walk.losses.total());
        if walk.losses.total() as f64 > TOLERATED * walk.walks as f64 {
            // Of bodies that pass through each other, thin beyond the numbers of rays, it is told by name after the render.
            let said = marmor::integrator::lost(&walk, &scene);
            assert!(placed.len() > 1 && !said.is_empty(), "{said:?} in {what}");
            println!("scene {number}, {placed:?}: {said:?}");
            told += 1;
            continue;
        }
        let (mean, error) = mean_of(film.image().pixels.iter().map(|p| f64::from(p.mean())));
        // f32 in a sum of a thousand.
        assert!((mean - 1.0).abs() <= 5.0 * error + 1e-5, "{mean} +- {error} in {what}");
        worst = worst.max((mean - 1.0).abs());
    }
    println!(
        "{accepted} of {count} scenes accepted; {lost} of {paths} paths lost; furnaces off by {worst:.1e} at most"
    );
    assert!(accepted * 10 > count * 7, "{accepted} of {count}");
    assert!(told * 50 <= accepted, "{told} of {accepted} scenes lose paths");
}
