//! Properties that every surface has to have; a new kind joins by its line in `kinds`.
#![allow(clippy::unwrap_used)] // a test that cannot sample has failed

use marmor::geometry::SurfacePoint;
use marmor::math::{DVec3, Rgb, Vec3, hash, unit_f32};
use marmor::optics::{reflectance, refract};
use marmor::surface::{Boundary, Bsdf, Lambertian, Texture, Textured, Wrap};
use std::f64::consts::TAU;
use std::sync::Arc;

fn kinds() -> Vec<Box<dyn Bsdf>> {
    let albedo = Rgb([0.2, 0.5, 1.0]);
    let one = Arc::new(Texture::new("one".into(), 1, vec![albedo], Wrap::Repeat));
    vec![
        Box::new(Lambertian { albedo }),
        Box::new(Textured { albedo: one }),
        Box::new(Boundary { eta: 1.5 }),
        Box::new(Boundary { eta: 0.7 }),
    ]
}

fn number(i: u64) -> f32 {
    unit_f32((hash(i + 1) >> 32) as u32)
}

fn point() -> SurfacePoint {
    let n = Vec3::new(0.6, 0.0, 0.8);
    SurfacePoint { x: DVec3::ZERO, n_geometric: n, n, uv: [0.0; 2], error: 0.0 }
}

/// A unit vector on the side of the normal.
fn outside(i: u64) -> Vec3 {
    let v = Vec3::new(number(3 * i) - 0.5, number(3 * i + 1) - 0.5, number(3 * i + 2) - 0.5).normalize();
    if v.dot(point().n) < 0.0 { -v } else { v }
}

/// weight = f cosθ / pdf, each channel in [0, 1]; delta functions have neither f nor pdf.
#[test]
fn weights_are_f_cosine_over_pdf() {
    let at = point();
    for bsdf in kinds() {
        for i in 0..2000 {
            let (wo, u) = (outside(2 * i), [number(5 * i), number(5 * i + 1), number(5 * i + 2)]);
            let Some(s) = bsdf.sample(&at, wo, u) else { continue };
            let (f, pdf) = (bsdf.eval(&at, wo, s.wi), bsdf.pdf(&at, wo, s.wi));
            assert!((s.wi.length() - 1.0).abs() < 1e-5 && s.weight.max() <= 1.0 && s.weight.min() >= 0.0, "{bsdf:?}");
            if bsdf.is_delta() {
                assert!(f.is_black() && pdf == 0.0 && s.pdf == 0.0, "{bsdf:?}");
                continue;
            }
            assert!((s.pdf / pdf - 1.0).abs() < 1e-6, "{bsdf:?}");
            let weight = f * (at.n.dot(s.wi) / pdf);
            for c in 0..3 {
                assert!((weight[c] - s.weight[c]).abs() < 1e-5, "{bsdf:?}: {weight:?} {:?}", s.weight);
            }
        }
    }
}

/// By quadrature over the hemisphere: the density is 1, and even light comes back by the albedo.
#[test]
fn densities_and_albedos_are_integrals() {
    let at = point();
    let (right, up) = at.n.any_orthonormal_pair();
    for bsdf in kinds().iter().filter(|bsdf| !bsdf.is_delta()) {
        let (mut density, mut back, steps) = (0.0, [0.0; 3], 200);
        for i in 0..steps {
            let cos = (f64::from(i) + 0.5) / f64::from(steps);
            let sin = (1.0 - cos * cos).sqrt();
            for k in 0..steps {
                let phi = TAU * (f64::from(k) + 0.5) / f64::from(steps);
                let wi = right * (sin * phi.cos()) as f32 + up * (sin * phi.sin()) as f32 + at.n * cos as f32;
                let area = TAU / f64::from(steps).powi(2);
                density += area * f64::from(bsdf.pdf(&at, at.n, wi));
                let f = bsdf.eval(&at, at.n, wi);
                (0..3).for_each(|c| back[c] += area * cos * f64::from(f[c]));
            }
        }
        assert!((density - 1.0).abs() < 1e-4, "{bsdf:?}: {density}");
        (0..3).for_each(|c| assert!((back[c] - f64::from(bsdf.albedo()[c])).abs() < 1e-4, "{bsdf:?}: {back:?}"));
    }
}

/// A boundary mirrors its Fresnel share, from either side, and refracts the rest by Snell's law.
#[test]
fn boundaries_mirror_by_fresnel_and_refract_by_snell() {
    let at = point();
    for eta in [1.5_f32, 0.7] {
        for i in 0..40 {
            let wo = if i % 2 == 0 { outside(i) } else { -outside(i) };
            let (n, inside_over) = if wo.dot(at.n) > 0.0 { (at.n, eta) } else { (-at.n, 1.0 / eta) };
            let runs = 4000;
            let mut mirrored = 0.0;
            for k in 0..runs {
                let u = [(k as f32 + 0.5) / runs as f32, 0.0, 0.0];
                let s = Boundary { eta }.sample(&at, wo, u).unwrap();
                if s.wi.dot(n) > 0.0 {
                    mirrored += 1.0 / f64::from(runs);
                    assert!((s.wi - (2.0 * wo.dot(n) * n - wo)).length() < 1e-5);
                } else {
                    assert!((s.wi - refract(wo, n, inside_over).unwrap()).length() < 1e-6);
                }
            }
            assert!((mirrored - f64::from(reflectance(inside_over, wo.dot(n)))).abs() < 1e-3, "{eta} {i}: {mirrored}");
        }
    }
}
