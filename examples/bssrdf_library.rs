//! marmor as a library of BSSRDFs, without the renderer's command line: evaluate a model, draw exit points from its
//! profile, and find the medium that has a wanted colour.
//!
//! ```text
//! cargo run --example bssrdf_library --no-default-features --features bvh
//! ```
#![allow(clippy::print_stdout)] // an example shows its results

use marmor::bssrdf::{Bssrdf as _, Entry, Exit, ModelName, ModelOptions, StandardDipole};
use marmor::optics::{self, AlbedoCurve, AlbedoLaw, ChannelOptics, FresnelMoments, Medium, Trust};
use marmor::{Result, Rgb, Vec3};
use std::f64::consts::PI;

fn main() -> Result<()> {
    let marble = optics::find_or_explain("marble")?;
    // Lengths are in the unit you choose; here millimetres.
    let medium = marble.medium(1.0);
    println!("{} from [{}], eta {}", marble.name, marble.source, marble.eta);

    evaluate(&medium)?;
    sample_a_radius(&medium);
    invert_a_colour()?;
    Ok(())
}

/// S_d between two points of a plane, by every model of a half space.
fn evaluate(medium: &Medium) -> Result<()> {
    let (up, r) = (Vec3::Z, 1.0);
    // Light arrives along the normal; `w` is its direction *inside*, after refraction.
    let entry = Entry { x: Vec3::ZERO, n: up, w: -up };
    let exit = Exit { x: Vec3::new(r, 0.0, 0.0), n: up, w: up };
    println!("\nS_d at r = {r} mm [1/(mm² sr)]:");
    for name in ModelName::half_spaces() {
        let value = name.build(medium, &ModelOptions::DEFAULT)?.eval(&entry, &exit);
        println!("  {:<12} {:>10.3e} {:>10.3e} {:>10.3e}", name.name(), value[0], value[1], value[2]);
    }
    let trust = Trust::of(&ChannelOptics::of(medium));
    println!("models to trust for this medium: {trust}");
    Ok(())
}

/// Exit distances with density proportional to r M(r): the profile of the green channel is tabulated, summed, and
/// the sum is inverted. The mean of M over its own samples estimates an integral; here the share of light that leaves
/// within one millimetre.
fn sample_a_radius(medium: &Medium) {
    let model = StandardDipole::new(medium, true);
    let exit_factor = PI * FresnelMoments::new(f64::from(medium.eta)).four_c_phi_outside;
    let entry = Entry { x: Vec3::ZERO, n: Vec3::Z, w: -Vec3::Z };
    let exitance = |r: f64| {
        let exit = Exit { x: Vec3::new(r as f32, 0.0, 0.0), n: Vec3::Z, w: Vec3::Z };
        f64::from(model.eval(&entry, &exit)[1]) * exit_factor
    };
    let green = ChannelOptics::of(medium)[1];
    let (n, r_max) = (4096, 30.0 * green.diffusion_length);
    // Denser towards the beam, where the profile is steep.
    let radius = |i: usize| r_max * (i as f64 / n as f64).powi(3);
    let mut sum = vec![0.0; n + 1];
    for i in 0..n {
        let (a, b) = (radius(i), radius(i + 1));
        sum[i + 1] = sum[i] + exitance(0.5 * (a + b)) * PI * (b * b - a * a);
    }
    let sample = |u: f64| {
        let i = sum.partition_point(|s| *s <= u * sum[n]).clamp(1, n);
        let within = (u * sum[n] - sum[i - 1]) / (sum[i] - sum[i - 1]);
        // Uniform over the ring's area.
        let (a, b) = (radius(i - 1), radius(i));
        (a * a + within * (b * b - a * a)).sqrt()
    };
    println!("\ngreen profile of `standard`: total {:.4}, closed form {:.4}", sum[n], model.total()[1]);
    let quantiles = [0.1, 0.5, 0.9].map(sample);
    println!(
        "10, 50 and 90 % of the light leave within {:.3}, {:.3} and {:.3} mm",
        quantiles[0], quantiles[1], quantiles[2]
    );
    let samples = 10_000;
    let near = (0..samples).filter(|&i| sample((f64::from(i) + 0.5) / f64::from(samples)) < 1.0).count();
    println!("within 1 mm: {:.1} %", 100.0 * near as f64 / f64::from(samples));
}

/// The medium whose half space has a wanted diffuse colour, at a chosen transport mean free path.
fn invert_a_colour() -> Result<()> {
    let (eta, mean_free_path) = (1.3, 0.5);
    let curve = AlbedoCurve::new(AlbedoLaw::Standard, eta);
    println!("\ncolour -> coefficients [1/mm] at a transport mean free path of {mean_free_path} mm:");
    for colour in [0.9, 0.5, 0.1] {
        let reduced = curve.invert(colour)?;
        let (s, a) = (reduced.sigma_s_prime / mean_free_path, reduced.sigma_a / mean_free_path);
        let medium = Medium::reduced(Rgb::splat(s as f32), Rgb::splat(a as f32), eta as f32)?;
        let back = StandardDipole::new(&medium, true).total()[0];
        println!("  {colour}: sigma_s' {s:.4}, sigma_a {a:.5}; its total is {back:.4}");
    }
    Ok(())
}
