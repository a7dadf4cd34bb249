//! Media by how they look: the colour asked for is the colour that comes out, of the medium and of a picture.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // a scene that does not load has failed; figures with --nocapture

mod rendering;

use marmor::integrator::{VolumePath, VolumePathOptions};
use marmor::math::GaussLegendre;
use marmor::optics::{ChannelOptics, HalfSpace, LOOKS, Medium, split};
use rendering::{film, load, mean_of};

fn text(unit: &str, keys: &str) -> String {
    format!(
        "unit = \"{unit}\"\n[camera]\nposition = [0, 0, 30]\nlook_at = [0, 0, 0]\nprojection = \"orthographic\"\nheight = 20\n\
         resolution = [24, 24]\n[[object]]\nname = \"ball\"\nshape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 10\nrings = 128\n\
         segments = 256\nnormals = \"geometric\"\nmaterial = \"it\"\n[environment]\nradiance = 1\n[material.it]\n\
         type = \"translucent\"\n{keys}"
    )
}

fn medium(unit: &str, keys: &str) -> Medium {
    load(&text(unit, keys)).surface(0).inside.as_ref().unwrap().medium
}

fn colour(medium: &Medium) -> [f64; 3] {
    let half_space = HalfSpace::new(medium.eta.into());
    ChannelOptics::of(medium).map(|k| half_space.even_reflectance(k.absorbed_prime))
}

#[test]
fn colour_and_length_are_those_of_the_medium() {
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|c| (a[c] / b[c] - 1.0).abs() < 1e-5);
    let paths = |m: &Medium| ChannelOptics::of(m).map(|k| k.transport_mean_free_path);
    let keys = "colour = [0.9, 0.5, 0.2]\nmean_free_path = [3, 2, 1]\neta = 1.4\n";
    for (keys, length) in [
        (keys.to_string(), [3.0, 2.0, 1.0]),
        (format!("{keys}g = 0.6"), [3.0, 2.0, 1.0]),
        (format!("{keys}per = \"mm\""), [0.3, 0.2, 0.1]),
        (format!("{keys}scale = 4"), [0.75, 0.5, 0.25]),
    ] {
        let medium = medium("cm", &keys);
        assert!(near(colour(&medium), [0.9, 0.5, 0.2]), "{keys}: {:?}", colour(&medium));
        assert!(near(paths(&medium), length), "{keys}: {:?}", paths(&medium));
    }
    assert_eq!(medium("cm", &format!("{keys}g = 0.6")).g, 0.6);
    for named in LOOKS {
        for more in ["", "\neta = 1.2"] {
            let medium = medium("cm", &format!("preset = \"{}\"{more}", named.name));
            assert!(near(colour(&medium), named.look.colour), "{}", named.name);
            assert!(near(paths(&medium), named.look.mean_free_path.map(|mm| mm / 10.0)), "{}", named.name);
        }
    }
    let source = |keys: &str| load(&text("mm", keys)).surface(0).inside.as_ref().unwrap().source.clone();
    assert_eq!(source("preset = \"Milk Glass\""), "milk_glass (a look, not measured)");
    assert_eq!(source("preset = \"marble\""), "marble [JMLH01]");
}

/// Parallel rays over the whole disc of a convex body see what leaves it, each direction by its cosine: under even light of radiance 1
/// the share of light that enters, times the colour.
#[test]
fn a_thick_ball_has_the_colour_under_even_light() {
    let wanted = [0.15, 0.4, 0.65];
    let keys = "colour = [0.15, 0.4, 0.65]\nmean_free_path = 0.01\neta = 1.4\n";
    let scene = load(&text("mm", keys));
    let entering = GaussLegendre::new(32).integrate_panels(0.0, 1.0, 8, |t| {
        let mu = t * t;
        2.0 * mu * split(1.4, mu).transmittance * 2.0 * t
    });
    // Rings and segments leave out little of the disc.
    let disc = std::f64::consts::PI / 4.0 * (1.0 - 1e-4);
    let options = |seed| VolumePathOptions { photons: 0, specular: false, seed, ..VolumePathOptions::default() };
    let runs: Vec<[f64; 3]> = (0..8)
        .map(|seed| {
            let method = VolumePath::new(&scene, options(seed)).unwrap();
            rendering::channels(&film(&method, &scene, 36, seed, &mut []).image())
        })
        .collect();
    for c in 0..3 {
        let found = mean_of(runs.iter().map(|run| (1.0 - (1.0 - run[c]) / disc) / entering));
        println!("colour {}: {:.5} +- {:.5}", wanted[c], found.0, found.1);
        assert!(found.1 < 0.006 * wanted[c], "too noisy: {found:?}");
        // Beside noise, 2e-3 for what the disc's rim and the body's curvature take.
        assert!((found.0 - wanted[c]).abs() < 4.0 * found.1 + 2e-3 * wanted[c], "{} came out as {found:?}", wanted[c]);
    }
}
