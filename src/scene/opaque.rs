//! Keys of opaque surfaces: diffuse, plastic, conductor.

use super::Surface;
use super::tree::{Fields, Node};
use super::values::{colour, rgb, unknown};
use crate::error::Result;
use crate::math::Rgb;
use crate::surface::{Conductor, METALS, OrenNayar, Plastic, Reflectance};
use std::sync::Arc;

const SHARE: &str = "one number or three from 0 to 1";
const ROUGHNESS: &str = "a number from 0, smooth, to 1";
const COAT: &str = "n of the coat over that of air, from 1 to 4";
const INDEX: &str = "one number or three from 0.01 to 30";
/// Refractive index of most plastics and glazes.
const ETA: f64 = 1.5;

fn share(m: &Fields<'_>, key: &str) -> Result<Rgb> {
    m.need(key, SHARE, |n| colour(n, |v| (0.0..=1.0).contains(&v))).map(rgb)
}

fn roughness(m: &Fields<'_>, default: f64) -> Result<f32> {
    let typed = m.get("roughness", ROUGHNESS, |n| n.number().filter(|v| (0.0..=1.0).contains(v)))?;
    Ok(typed.unwrap_or(default) as f32)
}

/// `has_picture`: its albedo is one, and white until that is read.
pub(super) fn diffuse(m: &Fields<'_>, has_picture: bool) -> Result<Surface> {
    m.only("a diffuse material", &["type", "albedo", "roughness"])?;
    let expected = "one number or three from 0 to 1, or { image = \"FILE\" }";
    let typed = |n: &Node| colour(n, |v| (0.0..=1.0).contains(&v));
    let albedo = if has_picture { Rgb::WHITE } else { rgb(m.need("albedo", expected, typed)?) };
    let roughness = roughness(m, 0.0)?;
    if has_picture && roughness > 0.0 {
        return Err(
            m.error_at("roughness", "stands beside a picture; a rough surface has one albedo: remove one of them")
        );
    }
    Ok(if roughness == 0.0 {
        Surface::diffuse(albedo)
    } else {
        Surface::opaque(Arc::new(OrenNayar::new(albedo, roughness)))
    })
}

pub(super) fn plastic(m: &Fields<'_>) -> Result<Surface> {
    m.only("a plastic material", &["type", "albedo", "eta", "roughness"])?;
    let eta = m.get("eta", COAT, |n| n.number().filter(|v| (1.0..=4.0).contains(v)))?.unwrap_or(ETA);
    Ok(Surface::opaque(Arc::new(Plastic::new(share(m, "albedo")?, eta as f32, roughness(m, 0.0)?))))
}

pub(super) fn conductor(m: &Fields<'_>) -> Result<Surface> {
    m.only("a conductor", &["type", "metal", "n", "k", "reflectance", "roughness"])?;
    let index = |key| m.get(key, INDEX, |n| colour(n, |v| (0.01..=30.0).contains(&v))).map(|v| v.map(rgb));
    let metal = m.get("metal", "the name of a metal in quotes", Node::text)?;
    let reflectance = match (metal, index("n")?, index("k")?, m.has("reflectance")) {
        (Some(name), None, None, false) => {
            let known: Vec<&str> = METALS.iter().map(|(name, _)| *name).collect();
            let found = METALS.iter().find(|(known, _)| *known == name);
            found.ok_or_else(|| m.error_at("metal", unknown(name, &known)))?.1
        }
        (None, Some(n), Some(k), false) => Reflectance::Index { n, k },
        (None, None, None, true) => Reflectance::Normal(share(m, "reflectance")?),
        (None, None, None, false) => {
            return Err(m.missing("metal", "the name of a metal; or `n` and `k`, or `reflectance`"));
        }
        _ => {
            let what = "a conductor has one of `metal`, `n` with `k`, and `reflectance`; remove the others";
            return Err(m.error(what));
        }
    };
    Ok(Surface::opaque(Arc::new(Conductor::new(reflectance, roughness(m, 0.0)?))))
}
