//! Keys of opaque surfaces: diffuse, plastic, conductor.

use super::textures::{self, Loader, TextureEntry};
use super::tree::{Fields, Node};
use super::values::{colour, rgb, unknown};
use crate::error::Result;
use crate::math::Rgb;
use crate::surface::{Bsdf, Colour, Conductor, Graded, Lambertian, METALS, OrenNayar, Plastic, Reflectance, Textured};
use std::sync::Arc;

const SHARE: &str = "one number or three from 0 to 1";
const ROUGHNESS: &str = "a number from 0, smooth, to 1";
const COAT: &str = "n of the coat over that of air, from 1 to 4";
const INDEX: &str = "one number or three from 0.01 to 30";
/// Refractive index of most plastics and glazes.
const ETA: f64 = 1.5;

/// An opaque surface as typed.
#[derive(Clone, Debug)]
pub(super) struct OpaqueEntry {
    kind: Kind,
    /// Until its picture is read, white.
    albedo: Rgb,
    /// The pictures of albedo and roughness.
    images: [Option<TextureEntry>; 2],
    roughness: f32,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Diffuse,
    /// With this index of the coat.
    Plastic(f32),
    Conductor(Reflectance),
}

const KEYS: [&str; 5] = ["type", "roughness", "normal", "bump", "opacity"];

impl OpaqueEntry {
    /// The surface of `kind`; `None` for a kind that is not opaque.
    pub(super) fn read(m: &Fields<'_>, kind: &str) -> Result<Option<Self>> {
        let keys = |own: &[&'static str]| -> Vec<&str> { KEYS.iter().chain(own).copied().collect() };
        let kind = match kind {
            "diffuse" => {
                m.only("a diffuse material", &keys(&["albedo"]))?;
                Kind::Diffuse
            }
            "plastic" => {
                m.only("a plastic material", &keys(&["albedo", "eta"]))?;
                let eta = m.get("eta", COAT, |n| n.number().filter(|v| (1.0..=4.0).contains(v)))?.unwrap_or(ETA);
                Kind::Plastic(eta as f32)
            }
            "conductor" => {
                m.only("a conductor", &keys(&["metal", "n", "k", "reflectance"]))?;
                Kind::Conductor(reflectance(m)?)
            }
            _ => return Ok(None),
        };
        let of_metal = matches!(kind, Kind::Conductor(_));
        let image = if of_metal { None } else { textures::read(m, "albedo")? };
        let albedo = if image.is_some() || of_metal { Rgb::WHITE } else { share(m, "albedo")? };
        let (rough, roughness) = if m.is_table("roughness") {
            (textures::read_data(m, "roughness", None)?.map(|(image, _)| image), 0.0)
        } else {
            let typed = m.get("roughness", ROUGHNESS, |n| n.number().filter(|v| (0.0..=1.0).contains(v)))?;
            (None, typed.unwrap_or(0.0))
        };
        Ok(Some(Self { kind, albedo, images: [image, rough], roughness: roughness as f32 }))
    }

    /// What it is without its pictures.
    pub(super) fn plain(&self) -> Arc<dyn Bsdf> {
        self.bsdf(&self.albedo.into(), self.roughness)
    }

    /// Its pictures.
    pub(super) fn images(&self) -> impl Iterator<Item = &TextureEntry> {
        self.images.iter().flatten()
    }

    /// With its pictures.
    pub(super) fn pictured(&self, loader: &mut Loader<'_>) -> Result<Arc<dyn Bsdf>> {
        let [albedo, roughness] = &self.images;
        let albedo = match albedo {
            Some(image) => Colour::Picture(loader.load(image)?),
            None => self.albedo.into(),
        };
        Ok(match roughness {
            Some(image) => Arc::new(Graded::new(loader.load(image)?, |roughness| self.bsdf(&albedo, roughness))),
            None => self.bsdf(&albedo, self.roughness),
        })
    }

    fn bsdf(&self, albedo: &Colour, roughness: f32) -> Arc<dyn Bsdf> {
        match (self.kind, albedo) {
            (Kind::Diffuse, Colour::Picture(albedo)) => Arc::new(Textured { albedo: albedo.clone(), roughness }),
            (Kind::Diffuse, Colour::Even(albedo)) if roughness == 0.0 => Arc::new(Lambertian { albedo: *albedo }),
            (Kind::Diffuse, Colour::Even(albedo)) => Arc::new(OrenNayar::new(*albedo, roughness)),
            (Kind::Plastic(eta), albedo) => Arc::new(Plastic::new(albedo.clone(), eta, roughness)),
            (Kind::Conductor(reflectance), _) => Arc::new(Conductor::new(reflectance, roughness)),
        }
    }
}

fn share(m: &Fields<'_>, key: &str) -> Result<Rgb> {
    let expected = if key == "albedo" { "one number or three from 0 to 1, or { image = \"FILE\" }" } else { SHARE };
    m.need(key, expected, |n| colour(n, |v| (0.0..=1.0).contains(&v))).map(rgb)
}

fn reflectance(m: &Fields<'_>) -> Result<Reflectance> {
    let index = |key| m.get(key, INDEX, |n| colour(n, |v| (0.01..=30.0).contains(&v))).map(|v| v.map(rgb));
    let metal = m.get("metal", "the name of a metal in quotes", Node::text)?;
    Ok(match (metal, index("n")?, index("k")?, m.has("reflectance")) {
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
    })
}
