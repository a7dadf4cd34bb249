//! Photons of lamps that nearly touch a body, against what enters.

use super::*;
use crate::optics::FresnelMoments;
use crate::query::{self, Backend};
use crate::scene::SceneFile;
use std::f64::consts::PI;

/// Half edges of the body.
const HALF: [f64; 3] = [2.0, 1.5, 1.0];

/// A box of so dense a medium that all light is scattered at once and then nearly all absorbed, in a closed box of lamps of
/// radiance 1, `gap` away.
fn boxed(gap: f64, two_sided: bool) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let corner = |i: usize| {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| if i >> axis & 1 == 0 { -HALF[axis] } else { HALF[axis] });
        format!("v {x} {y} {z}\n")
    };
    let obj =
        (0..8).map(corner).collect::<String>() + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    std::fs::write(folder.path().join("box.obj"), obj).unwrap();
    let mut text = format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov = 15\nresolution = [8, 8]\n\
         [[object]]\nmesh = \"box.obj\"\nmaterial = \"m\"\n[material.m]\ntype = \"translucent\"\nsigma_s = 0.1\n\
         sigma_a = 999.9\ng = 0\neta = 1.3\n[material.lamp]\ntype = \"emissive\"\nradiance = 1\ntwo_sided = {two_sided}\n"
    );
    for axis in 0..3 {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [-1.0, 1.0] {
            let [mut centre, mut u, mut v] = [[0.0; 3]; 3];
            centre[axis] = side * (HALF[axis] + gap);
            u[next] = -side * (HALF[next] + gap);
            v[last] = HALF[last] + gap;
            text += &format!(
                "[[object]]\nshape = \"rectangle\"\ncentre = {centre:?}\nedge_u = {u:?}\nedge_v = {v:?}\nmaterial = \"lamp\"\n"
            );
        }
    }
    Scene::load(&SceneFile::parse(&text, &folder.path().join("scene.toml")).unwrap()).unwrap()
}

/// To 0.2 %: π times area times the mean transmittance, whichever of the three ways of drawing pairs has most of it.
#[test]
fn photons_of_near_lamps_carry_what_enters() {
    let area = 8.0 * (HALF[0] * HALF[1] + HALF[1] * HALF[2] + HALF[2] * HALF[0]);
    let expected = PI * area * FresnelMoments::new(1.3).four_c_phi_outside;
    for (gap, two_sided) in [(4.0, false), (0.3, true), (1e-2, false), (1e-3, true)] {
        let scene = boxed(gap, two_sided);
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        let view = View { scene: &scene, rays: &*rays };
        let options = VolumePathOptions { orders: Orders::All, photons: 50_000, specular: true, seed: 1 };
        let method = VolumePath::new(&scene, options).unwrap();
        let (source, body) = (method.sources[0].as_ref().unwrap(), method.bodies[0].as_ref().unwrap());
        let flux = |pass| {
            let cells = source.trace(view, body, &method.light.lights, pass, &mut Tally::default()).unwrap();
            let first = |i: u32| f64::from(cells.photons((i, i + 1))[0].flux[0]);
            (0..cells.len() as u32).map(first).sum::<f64>() / 1e-4
        };
        let found: Vec<f64> = (0..8).map(flux).collect();
        let mean = found.iter().sum::<f64>() / 8.0;
        let error = (found.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / 56.0).sqrt();
        println!("gap {gap}: {mean} +- {error}, {expected}");
        assert!(error < 4e-4 * expected, "gap {gap}: {mean} +- {error}, too noisy to say anything");
        assert!(
            (mean - expected).abs() < 5.0 * error + 3e-4 * expected,
            "gap {gap}: {mean} +- {error}, expected {expected}"
        );
    }
}
