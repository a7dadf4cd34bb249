//! Boundaries, constants and distance-only models against high-precision tables: tests/data/README.md says where the
//! rows come from. With `MARMOR_REFERENCE_DIR` set, against the whole tables.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // a table that cannot be read is a failed test; scores are shown

mod support;

use marmor::bssrdf::{BetterDipole, NormalisedDiffusion, Radial, Slab, StandardDipole, WidthFit};
use marmor::math::Rgb;
use marmor::optics::{AlbedoCurve, AlbedoLaw, FresnelMoments, Medium, Reduced, split};
use support::{Row, Score, both};

fn medium(row: &Row, eta: &str) -> Medium {
    let coefficient = |name: &str| Rgb::splat(row.number(name) as f32);
    Medium::reduced(coefficient("sigma_s_red"), coefficient("sigma_a"), row.number(eta) as f32).unwrap()
}

#[test]
fn the_boundary() {
    both("fresnel.csv", |name, rows| {
        let (mut r, mut t, mut cosine) = (Score::default(), Score::default(), Score::default());
        for row in rows {
            let got = split(row.number("eta_t_over_i"), row.number("cos_i"));
            r.add(row, got.reflectance as f32, row.number("R"));
            t.add(row, got.transmittance as f32, row.number("T"));
            cosine.add(row, got.cosine as f32, row.number("cos_t"));
        }
        r.hold(&format!("{name} R"));
        t.hold(&format!("{name} T"));
        cosine.hold(&format!("{name} cos_t"));
    });
}

#[test]
fn constants_of_a_boundary() {
    both("constants.csv", |name, rows| {
        let mut worst = 0.0_f64;
        for row in rows {
            let m = FresnelMoments::new(row.number("eta"));
            for (column, got) in [
                ("twoC1", m.two_c1),
                ("threeC2", m.three_c2),
                ("C_phi", m.c_phi),
                ("C_E", m.c_e),
                ("A_mixed", m.a_mixed()),
                ("A_groenhuis", m.a_groenhuis()),
                ("four_Cphi_inv", m.four_c_phi_outside),
            ] {
                let error = (got / row.number(column) - 1.0).abs();
                assert!(error < 1e-9, "{name} {} {column}: {got}", row.text("id"));
                worst = worst.max(error);
            }
        }
        println!("{name}: {} rows, largest relative error {worst:.1e}", rows.len());
    });
}

#[test]
fn standard_dipole() {
    both("standard.csv", |name, rows| {
        let mut score = Score::default();
        for row in rows {
            let model = StandardDipole::new(&medium(row, "eta"), true);
            score.add(row, model.exitance(row.number("r") as f32)[0], row.number("Rd"));
        }
        score.hold(name);
    });
}

#[test]
fn better_dipole() {
    both("better.csv", |name, rows| {
        let mut score = Score::default();
        for row in rows {
            let model = BetterDipole::new(&medium(row, "eta"), true);
            score.add(row, model.exitance(row.number("r") as f32)[0], row.number("Rd_multiple"));
        }
        score.hold(name);
    });
}

#[test]
fn normalised_diffusion() {
    both("normdiff.csv", |name, rows| {
        let (mut score, mut worst) = (Score::default(), 0.0_f64);
        for row in rows {
            let fit = match row.text("variant") {
                "searchlight" => WidthFit::Searchlight,
                "diffuse" => WidthFit::Diffuse,
                _ => WidthFit::DiffusionLength,
            };
            assert!((fit.s(row.number("A")) / row.number("s") - 1.0).abs() < 1e-12);
            let splat = |column: &str| Rgb::splat(row.number(column) as f32);
            let model = NormalisedDiffusion::from_albedo(fit, splat("A"), splat("l"), 1.3, true).unwrap();
            score.add(row, model.exitance(row.number("r") as f32)[0], row.number("Rd"));
            // The width has the rounding of A and l in it, the integral of the distribution has not.
            let (cdf, r) = (model.cdf(0, row.number("r")), row.number("quantile_u"));
            let radius = model.sample_radius(0, row.number("u"));
            worst = worst.max((cdf - row.number("cdf_r")).abs());
            worst = worst.max(if r == 0.0 { radius } else { (radius / r - 1.0).abs() });
        }
        println!("{name}: largest error of distribution and quantile {worst:.1e}");
        assert!(worst < 1e-5, "{name}: {worst}");
        score.hold(name);
    });
}

#[test]
fn slab() {
    both("multipole.csv", |name, rows| {
        let (mut reflected, mut transmitted, mut total) = (Score::default(), Score::default(), 0.0_f64);
        for row in rows {
            let thickness = row.number("thickness");
            let made = Slab::between(&medium(row, "eta_top"), thickness as f32, row.number("eta_bottom") as f32, true);
            let relative = thickness * (row.number("sigma_s_red") + row.number("sigma_a"));
            let Ok(model) = made else {
                assert!(relative < 1.0011, "{name} {}: refused", row.text("id"));
                continue;
            };
            let r = row.number("r") as f32;
            // The tables are of the published formula, whose light is not all scattered in the slab.
            let [r_share, t_share] = model.scattered().map(|share| share[0]);
            reflected.add(row, model.exitance(r)[0] / r_share, row.number("Rd"));
            let (total_r, total_t) = (marmor::bssrdf::Bssrdf::total(&model)[0], model.total_transmitted()[0]);
            if t_share == 0.0 {
                assert!(total_t == 0.0 && model.transmitted(r)[0] == 0.0);
                continue;
            }
            transmitted.add(row, model.transmitted(r)[0] / t_share, row.number("Td"));
            for (got, column) in [(total_r / r_share, "Rd_total"), (total_t / t_share, "Td_total")] {
                let exact = row.number(column);
                if exact.abs() > 1e-37 {
                    let error = (f64::from(got) / exact - 1.0).abs();
                    assert!(error < 1e-4, "{name} {} {column}: {got}", row.text("id"));
                    total = total.max(error);
                }
            }
        }
        println!("{name}: largest relative error of the totals {total:.1e}");
        reflected.hold(&format!("{name} R"));
        transmitted.hold(&format!("{name} T"));
    });
}

#[test]
fn totals_of_a_half_space() {
    both("albedo_normal.csv", |name, rows| {
        for row in rows {
            let reduced = Reduced::new(row.number("sigma_s_red"), row.number("sigma_a"));
            for (law, column) in [(AlbedoLaw::Standard, "R_standard"), (AlbedoLaw::Better, "R_better_multiple")] {
                let got = AlbedoCurve::new(law, row.number("eta")).total(&reduced);
                assert!((got / row.number(column) - 1.0).abs() < 1e-9, "{name} {} {column}: {got}", row.text("id"));
            }
        }
    });
}
