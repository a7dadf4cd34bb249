//! Properties that every surface has to have; a new kind joins by its line in `kinds`.
#![allow(clippy::unwrap_used)] // a test that cannot sample has failed

use marmor::geometry::SurfacePoint;
use marmor::math::{DVec3, Rgb, Vec3, hash, unit_f32};
use marmor::optics::{FresnelMoments, reflectance, refract};
use marmor::surface::{
    Boundary, Bsdf, Colour, Conductor, Graded, Lambertian, METALS, OrenNayar, Plastic, Reflectance, RoughBoundary,
    RoughReflection, Texture, Textured, Wrap,
};
use std::f64::consts::TAU;
use std::sync::Arc;

fn kinds() -> Vec<Box<dyn Bsdf>> {
    let albedo = Rgb([0.2, 0.5, 1.0]);
    let one = Arc::new(Texture::new("one".into(), 1, vec![albedo], Wrap::Repeat));
    let mut kinds: Vec<Box<dyn Bsdf>> = vec![
        Box::new(Lambertian { albedo }),
        Box::new(Textured { albedo: one.clone(), roughness: 0.0 }),
        Box::new(Textured { albedo: one.clone(), roughness: 0.6 }),
        Box::new(Plastic::new(Colour::Picture(one), 1.5, 0.5)),
        Box::new(Boundary { eta: 1.5 }),
        Box::new(Boundary { eta: 0.7 }),
    ];
    // The least, and between two steps.
    for roughness in [0.0, 0.51] {
        let picture = Arc::new(Texture::new("grey".into(), 1, vec![Rgb::splat(roughness)], Wrap::Repeat));
        kinds.push(Box::new(Graded::new(picture.clone(), |r| Arc::new(Plastic::new(albedo, 1.5, r)))));
        kinds.push(Box::new(Graded::new(picture, |r| Arc::new(Conductor::new(METALS[2].1, r)))));
    }
    for roughness in [0.0, 0.15, 0.5, 1.0] {
        kinds.push(Box::new(OrenNayar::new(albedo, roughness)));
        kinds.push(Box::new(Plastic::new(albedo, 1.5, roughness)));
        kinds.push(Box::new(Conductor::new(Reflectance::Normal(albedo), roughness)));
        kinds.push(Box::new(Conductor::new(METALS[2].1, roughness)));
        kinds.extend(rough_boundaries(roughness).map(|b| Box::new(b) as Box<dyn Bsdf>));
        let reflections = rough_boundaries(roughness).map(|b| Box::leak(Box::new(b)));
        kinds.extend(reflections.map(|b| Box::new(RoughReflection(b)) as Box<dyn Bsdf>));
    }
    kinds
}

fn rough_boundaries(roughness: f32) -> impl Iterator<Item = RoughBoundary> {
    [1.5, 0.7].into_iter().filter_map(move |eta| RoughBoundary::new(eta, roughness))
}

/// Those that reflect all light, whatever their roughness.
fn white(roughness: f32) -> Vec<Box<dyn Bsdf>> {
    vec![
        Box::new(OrenNayar::new(Rgb::WHITE, roughness)),
        Box::new(Plastic::new(Rgb::WHITE, 1.5, roughness)),
        Box::new(Plastic::new(Rgb::WHITE, 1.1, roughness)),
        Box::new(Conductor::new(Reflectance::Normal(Rgb::WHITE), roughness)),
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

/// weight = f cosθ / pdf, each channel bounded; delta functions have neither f nor pdf.
#[test]
fn weights_are_f_cosine_over_pdf() {
    let at = point();
    for bsdf in kinds() {
        for i in 0..2000 {
            let (wo, u) = (outside(2 * i), [number(5 * i), number(5 * i + 1), number(5 * i + 2)]);
            let Some(s) = bsdf.sample(&at, wo, u) else { continue };
            let (f, pdf) = (bsdf.eval(&at, wo, s.wi), bsdf.pdf(&at, wo, s.wi));
            // Grooves seen along the surface throw light back to where it comes from.
            let grooves = bsdf.text().starts_with("rough diffuse");
            let most = if grooves { 1.2 / at.n.dot(wo).max(at.n.dot(s.wi)) } else { MOST };
            assert!(
                (s.wi.length() - 1.0).abs() < 1e-5 && s.weight.max() <= most && s.weight.min() >= 0.0,
                "{}",
                bsdf.text()
            );
            if bsdf.is_delta() || s.pdf == 0.0 {
                assert!((f.is_black() && pdf == 0.0 || !bsdf.is_delta()) && s.pdf == 0.0, "{}", bsdf.text());
                continue;
            }
            // What is below the surface counts nothing, unless it is a boundary.
            if at.n.dot(s.wi) <= 0.0 && !is_boundary(&*bsdf) {
                assert!(f.is_black() && s.weight.is_black(), "{}", bsdf.text());
                continue;
            }
            // A direction rounded twice, and densities that are steep in it.
            assert!((s.pdf / pdf - 1.0).abs() < 5e-3, "{}: {} {pdf} along {wo}", bsdf.text(), s.pdf);
            let weight = f * (at.n.dot(s.wi).abs() / pdf);
            for c in 0..3 {
                assert!(
                    (weight[c] - s.weight[c]).abs() < 5e-3,
                    "{}: {weight:?} {:?} along {wo}",
                    bsdf.text(),
                    s.weight
                );
            }
        }
    }
}

fn is_boundary(bsdf: &dyn Bsdf) -> bool {
    bsdf.text().contains("boundary")
}

/// The largest weight of a sample of a rough surface.
const MOST: f32 = 3.0;

/// Evenly spread numbers, for means with little noise: multiples of powers of the root of x⁴ = x + 1.
fn spread(n: u32) -> impl Iterator<Item = [f32; 3]> {
    let root: f64 = 1.220_744_084_605_759_5;
    let step = [1, 2, 3].map(|k| root.powi(-k));
    (1..=n).map(move |i| step.map(|s| (0.5 + f64::from(i) * s).fract().min(0.999_999_9) as f32))
}

/// Share of even light that leaves along the direction of this cosine.
fn sent_back(bsdf: &dyn Bsdf, cosine: f32, n: u32) -> [f64; 3] {
    let at = point();
    let (right, _) = at.n.any_orthonormal_pair();
    let wo = at.n * cosine + right * (1.0 - cosine * cosine).max(0.0).sqrt();
    let mut sum = [0.0; 3];
    for s in spread(n).filter_map(|u| bsdf.sample(&at, wo, u)).filter(|s| s.wi.dot(at.n) > 0.0) {
        (0..3).for_each(|c| sum[c] += f64::from(s.weight[c]) / f64::from(n));
    }
    sum
}

/// White surfaces lose no light, along any direction and whatever their roughness.
#[test]
fn white_surfaces_are_white_at_any_roughness() {
    for roughness in [0.0, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0] {
        for bsdf in white(roughness) {
            for cosine in [0.03, 0.1, 0.3, 0.6, 0.9, 1.0] {
                let [back, ..] = sent_back(&*bsdf, cosine, 150_000);
                assert!((back - 1.0).abs() < 3e-3, "{}, cosine {cosine}: {back}", bsdf.text());
            }
        }
    }
}

/// The albedo is the mean of what is sent back over all directions by their cosine.
#[test]
fn albedos_are_means_over_directions() {
    for bsdf in kinds().iter().filter(|bsdf| !bsdf.text().starts_with("smooth boundary")) {
        let (mut back, steps) = ([0.0; 3], 64);
        for i in 0..steps {
            let cosine = (f64::from(i) + 0.5) / f64::from(steps);
            let sent = sent_back(&**bsdf, cosine as f32, 4000);
            (0..3).for_each(|c| back[c] += 2.0 * cosine * sent[c] / f64::from(steps));
        }
        for c in 0..3 {
            let albedo = f64::from(bsdf.albedo()[c]);
            assert!((back[c] - albedo).abs() < 4e-3, "{}: {back:?} {albedo}", bsdf.text());
        }
    }
}

/// Boundaries lose no light either, from both sides, and let through what they say, as much as their moments are of.
#[test]
fn rough_boundaries_lose_no_light() {
    let at = point();
    let (right, _) = at.n.any_orthonormal_pair();
    for bsdf in [0.05, 0.2, 0.5, 0.8, 1.0].into_iter().flat_map(rough_boundaries) {
        for side in [1.0, -1.0] {
            for cosine in [0.03_f32, 0.1, 0.3, 0.6, 0.9, 1.0] {
                let wo = at.n * (side * cosine) + right * (1.0 - cosine * cosine).max(0.0).sqrt();
                let n = 150_000;
                let (mut all, mut through) = (0.0, 0.0);
                for s in spread(n).filter_map(|u| bsdf.sample(&at, wo, u)) {
                    let weight = f64::from(s.weight[0]) / f64::from(n);
                    all += weight;
                    through += if s.wi.dot(at.n) * side < 0.0 { weight } else { 0.0 };
                }
                assert!((all - 1.0_f64).abs() < 3e-3, "{}, cosine {cosine} of side {side}: {all}", bsdf.text());
                // Beside the critical angle what is told is read between the lines of a table.
                let told = f64::from(bsdf.passed(cosine));
                assert!(side < 0.0 || (through - told).abs() < 5e-3, "{}: {through}, told {told}", bsdf.text());
            }
        }
    }
}

/// Both sides of a rough boundary, seen from both.
#[test]
fn rough_boundaries_are_reciprocal() {
    let at = point();
    for bsdf in [0.2, 0.5, 1.0].into_iter().flat_map(rough_boundaries) {
        let any = |i: u64| if number(7 * i + 3) < 0.5 { outside(i) } else { -outside(i) };
        for i in 0..2000 {
            let (a, b) = (any(2 * i), any(2 * i + 1));
            // Radiance is over the square of the index; cosines behind the boundary count that square.
            let eta = if bsdf.text().contains("eta 1.5") { 1.5 } else { 0.7 };
            let squared = |w: Vec3| if w.dot(at.n) < 0.0 { eta * eta } else { 1.0 };
            let (there, back) = (bsdf.eval(&at, a, b)[0] / squared(b), bsdf.eval(&at, b, a)[0] / squared(a));
            assert!((there - back).abs() <= 2e-3 * there + 1e-5, "{}: {there} {back} along {a} {b}", bsdf.text());
        }
    }
}

/// The moments of a rough boundary are integrals of what samples do, and those of a smooth one where it is nearly that.
#[test]
fn rough_boundaries_have_the_moments_of_their_samples() {
    let at = point();
    let (right, _) = at.n.any_orthonormal_pair();
    for bsdf in [0.3, 0.7, 1.0].into_iter().flat_map(rough_boundaries) {
        let (mut first, mut second, steps) = (0.0, 0.0, 200);
        for i in 0..steps {
            let cosine = (f64::from(i) + 0.5) / f64::from(steps);
            let wo = -at.n * cosine as f32 + right * (1.0 - cosine * cosine).sqrt() as f32;
            let n = 4000;
            let back = |s: &marmor::surface::BsdfSample| s.wi.dot(at.n) < 0.0;
            let samples = spread(n).filter_map(|u| bsdf.sample(&at, wo, u)).filter(back);
            let share = samples.map(|s| f64::from(s.weight[0])).sum::<f64>() / f64::from(n);
            first += 2.0 * cosine * share / f64::from(steps);
            second += 3.0 * cosine * cosine * share / f64::from(steps);
        }
        let moments = bsdf.moments();
        let what = bsdf.text();
        assert!((moments.two_c1 - first).abs() < 3e-3, "{what}: {} {first}", moments.two_c1);
        assert!((moments.three_c2 - second).abs() < 3e-3, "{what}: {} {second}", moments.three_c2);
    }
    for eta in [1.5, 0.7] {
        let (rough, smooth) = (RoughBoundary::new(eta, 0.08).unwrap().moments(), FresnelMoments::new(f64::from(eta)));
        for (a, b) in [
            (rough.two_c1, smooth.two_c1),
            (rough.three_c2, smooth.three_c2),
            (rough.four_c_phi_outside, smooth.four_c_phi_outside),
        ] {
            assert!((a - b).abs() < 5e-3, "eta {eta}: {a} {b}");
        }
    }
}

/// Light goes back the way it came: f is the same both ways.
#[test]
fn surfaces_are_reciprocal() {
    let at = point();
    for bsdf in kinds() {
        for i in 0..500 {
            let (a, b) = (outside(2 * i), outside(2 * i + 1));
            let (there, back) = (bsdf.eval(&at, a, b), bsdf.eval(&at, b, a));
            (0..3).for_each(|c| {
                assert!((there[c] - back[c]).abs() <= 1e-4 * there[c] + 1e-6, "{}: {there:?} {back:?}", bsdf.text())
            });
        }
    }
}

/// Directions are drawn by their density: chi-square over rings and sectors, at normal incidence and grazing.
#[test]
fn directions_follow_their_density() {
    const RINGS: usize = 12;
    const SECTORS: usize = 16;
    const FINE: usize = 24;
    let at = point();
    let (right, up) = at.n.any_orthonormal_pair();
    // Lobes that the quadrature does not resolve would say nothing of the sampler.
    for bsdf in kinds().iter().filter(|bsdf| {
        !bsdf.is_delta() && !bsdf.text().contains("roughness 0.15") && !bsdf.text().contains("mean [0.0, ")
    }) {
        // Refraction turns directions by less than reflection does.
        let fine = if is_boundary(&**bsdf) { 4 * FINE } else { FINE };
        let below = if is_boundary(&**bsdf) { &[1.0_f32, -1.0][..] } else { &[1.0] };
        for (cosine, half) in [1.0_f32, 0.7, 0.2, 0.05].into_iter().flat_map(|c| below.iter().map(move |h| (c, *h))) {
            let wo = at.n * cosine + right * (1.0 - cosine * cosine).max(0.0).sqrt();
            let n = 120_000_u64;
            let (mut counts, mut expected) = ([0.0; RINGS * SECTORS], [0.0; RINGS * SECTORS]);
            for i in 0..n {
                let u = [number(3 * i), number(3 * i + 1), number(3 * i + 2)];
                let Some(s) = bsdf.sample(&at, wo, u).filter(|s| s.pdf > 0.0 && half * at.n.dot(s.wi) > 0.0) else {
                    continue;
                };
                let (z, phi) =
                    (f64::from(half * at.n.dot(s.wi)), f64::from(s.wi.dot(up)).atan2(f64::from(s.wi.dot(right))));
                let ring = ((z * RINGS as f64) as usize).min(RINGS - 1);
                let sector = ((phi / TAU).rem_euclid(1.0) * SECTORS as f64) as usize;
                counts[ring * SECTORS + sector.min(SECTORS - 1)] += 1.0;
            }
            for i in 0..RINGS * fine {
                let z = (i as f64 + 0.5) / (RINGS * fine) as f64;
                let r = (1.0 - z * z).sqrt();
                for k in 0..SECTORS * FINE {
                    let phi = TAU * (k as f64 + 0.5) / (SECTORS * FINE) as f64;
                    let wi = right * (r * phi.cos()) as f32
                        + up * (r * phi.sin()) as f32
                        + at.n * (f64::from(half) * z) as f32;
                    let area = TAU / (RINGS * fine * SECTORS * FINE) as f64;
                    expected[i / fine * SECTORS + k / FINE] += n as f64 * area * f64::from(bsdf.pdf(&at, wo, wi));
                }
            }
            let (mut chi, mut bins) = (0.0, 0);
            for (count, expected) in counts.iter().zip(&expected).filter(|(_, expected)| **expected > 10.0) {
                (chi, bins) = (chi + (count - expected) * (count - expected) / expected, bins + 1);
            }
            let limit = f64::from(bins) + 5.0 * (2.0 * f64::from(bins)).sqrt();
            // A boundary may send hardly any light to one of its sides.
            if counts.iter().sum::<f64>() < 0.02 * n as f64 {
                continue;
            }
            assert!(bins > 20 && chi < limit, "{}, cosine {cosine}: {chi} of {bins} bins", bsdf.text());
        }
    }
}

/// What metals are known to reflect: gold is yellow, copper red, silver hardly coloured, at normal incidence; all of it at grazing.
#[test]
fn metals_have_their_colour() {
    let of = |name: &str| METALS.iter().find(|(known, _)| *known == name).unwrap().1;
    for (name, wanted) in [
        ("gold", [0.85, 0.70, 0.35]),
        ("copper", [0.88, 0.60, 0.57]),
        ("silver", [0.94, 0.94, 0.93]),
        ("aluminium", [0.91, 0.91, 0.92]),
    ] {
        let (normal, grazing) = (of(name).at(1.0), of(name).at(0.0));
        (0..3).for_each(|c| {
            assert!((normal[c] - wanted[c]).abs() < 0.06 && grazing[c] > 0.999, "{name}: {normal:?} {grazing:?}")
        });
    }
    // By hand: |(n - 1 + ik) / (n + 1 + ik)|².
    let by_hand = |n: f32, k: f32| ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
    assert!((of("gold").at(1.0)[0] - by_hand(0.509, 3.192)).abs() < 1e-5);
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
