//! Every row of the catalogue that lists a reflectance must reproduce it. The reference is the transfer equation for
//! isotropic scattering under a Fresnel boundary (`optics::HalfSpace`), solved without diffusion theory and held to
//! Monte Carlo beside its code.
#![allow(clippy::unwrap_used)] // a test whose row is missing has failed

use marmor::optics::{CATALOGUE, ChannelOptics, Coefficients, HalfSpace, Trust, find};

/// How far a printed reflectance may be from the reference.
const TOLERANCE: f64 = 0.02;

#[test]
fn every_listed_reflectance_is_reproduced() {
    let mut rows = 0;
    for row in CATALOGUE {
        let Some(listed) = row.reflectance else { continue };
        rows += 1;
        let reference = row.reflectance_isotropic();
        for (c, (ours, theirs)) in std::iter::zip(reference, listed.value).enumerate() {
            assert!((ours - theirs).abs() <= TOLERANCE, "{} channel {c}: {ours:.4}, listed {theirs}", row.name);
        }
    }
    assert_eq!(rows, 12);
}

#[test]
fn a_slip_of_ten_in_any_absorption_is_noticed() {
    let mut tried = 0;
    for row in CATALOGUE {
        let Some(listed) = row.reflectance else { continue };
        let boundary = HalfSpace::new(row.eta);
        for c in 0..3 {
            let (s, a) = (row.sigma_s_prime_per_mm()[c], row.sigma_a_per_mm()[c]);
            for slip in [0.1, 10.0] {
                let slipped = boundary.reflectance(ChannelOptics::new(s, a * slip, 0.0).absorbed_prime);
                // Where almost nothing or almost everything comes back, a slip moves the reflectance by less than the
                // tolerance; and no absorption has no digits to slip.
                let (dark, bright) = (listed.value[c] < 0.03, listed.value[c] > 0.97 && slip < 1.0);
                if a == 0.0 || dark || bright {
                    continue;
                }
                tried += 1;
                let off = (slipped - listed.value[c]).abs();
                assert!(off > TOLERANCE, "{} channel {c}: absorption x {slip} goes unnoticed ({off:.4})", row.name);
            }
        }
    }
    assert_eq!(tried, 61);
}

/// The same rows, multiplied out by hand for the undiluted liquids as another public list has them [PJH16].
#[test]
fn dilution_is_undone_in_the_right_unit() {
    let cases = [
        ("lowfat_milk", [0.89187, 1.5136, 2.532], [0.002875, 0.00575, 0.0115]),
        ("espresso", [0.72378, 0.84557, 1.0247], [4.7984, 6.5751, 8.8493]),
        ("sprite", [6.0306e-6, 6.4139e-6, 6.5504e-6], [0.001886, 0.0018308, 0.0020025]),
        ("white_grapefruit_juice", [0.22826, 0.23998, 0.32748], [0.0138, 0.018831, 0.056781]),
        ("pacific_ocean_surface_water", [0.0001764, 0.00032095, 0.00019617], [0.031845, 0.031324, 0.030147]),
    ];
    for (name, sigma_s_prime, sigma_a) in cases {
        let row = find(name).unwrap();
        for c in 0..3 {
            let (s, a) = (row.sigma_s_prime_per_mm()[c], row.sigma_a_per_mm()[c]);
            assert!((s / sigma_s_prime[c] - 1.0).abs() < 2e-4, "{name} channel {c}: σ_s′ {s}");
            assert!((a / sigma_a[c] - 1.0).abs() < 2e-4, "{name} channel {c}: σ_a {a}");
        }
    }
}

#[test]
fn rows_are_physical_and_say_where_they_come_from() {
    for row in CATALOGUE {
        assert!(!row.source.is_empty() && !row.table.is_empty() && !row.provenance.is_empty());
        assert!((1.0..2.0).contains(&row.eta));
        for c in 0..3 {
            assert!(row.sigma_s_prime_per_mm()[c] >= 0.0 && row.sigma_a_per_mm()[c] >= 0.0, "{}", row.name);
            assert!((0.0..1.0).contains(&row.g()[c]));
        }
        if let Coefficients::Tank { sigma_t_per_100_mm, sigma_s_per_100_mm, .. } = row.coefficients {
            assert!(std::iter::zip(sigma_t_per_100_mm, sigma_s_per_100_mm).all(|(t, s)| s <= t), "{}", row.name);
        }
    }
}

#[test]
fn the_sources_are_in_the_list_of_references() {
    let references = include_str!("../docs/references.md");
    for row in CATALOGUE {
        let keys = row.provenance.split('[').skip(1).filter_map(|rest| rest.split(']').next());
        for key in keys.chain([row.source]).chain(row.reflectance.map(|r| r.source)) {
            assert!(references.contains(&format!("**[{key}]**")), "{}: [{key}] is not in docs/references.md", row.name);
        }
    }
}

#[test]
fn the_count_of_rows_outside_diffusion_is_what_the_manual_says() {
    let outside = CATALOGUE.iter().filter(|m| m.optics().iter().any(ChannelOptics::outside_diffusion)).count();
    assert_eq!((outside, CATALOGUE.len()), (28, 47));
    assert_eq!(find("wholemilk").unwrap().trust(), Trust::Diffusion);
    assert_eq!(find("chicken2").unwrap().trust(), Trust::WithSingleScattering);
    assert_eq!(find("ketchup").unwrap().trust(), Trust::PathTracing);
    assert!(include_str!("../docs/materials.md").contains("28 of the 47 rows"));
}
