//! `[material.NAME]` as typed.

use super::tree::{Fields, Node};
use super::values::{self, RADIANCE, UNIT, colour, named_value, rgb, switch, unit, unknown};
use super::{Dielectric, Emission, Surface, TextureEntry, Translucent, opaque, textures};
use crate::bssrdf::ModelName;
use crate::error::Result;
use crate::math::Rgb;
use crate::optics::{Look, Medium, Preset};
use crate::surface::{Bsdf as _, RoughBoundary};
use std::sync::Arc;

/// One material, its coefficients already per scene unit.
#[derive(Clone, Debug)]
pub struct MaterialEntry {
    /// Name in the scene file.
    pub name: String,
    /// The kind and its numbers.
    pub surface: Surface,
    /// The picture that its albedo is, of a diffuse one; [`Self::surface`] is white then.
    pub albedo_image: Option<TextureEntry>,
    /// File and line, for messages.
    pub at: String,
    /// What is wrong with it unless each of its objects has a `thickness`.
    pub(super) without_thickness: Option<String>,
}

const KINDS: &[&str] = &["translucent", "dielectric", "diffuse", "plastic", "conductor", "emissive"];
const COEFFICIENT: &str = "one number or three in 1/unit, none negative";
const G: &str = "a number above -1 and below 1";
const ETA: &str = "n_inside / n_outside, a number above 0";

/// All materials; `unit_in_mm` is the scene's, millimetres if it does not say.
pub(super) fn read(top: &Fields<'_>, unit_in_mm: Option<f64>) -> Result<Vec<MaterialEntry>> {
    let Some(table) = top.table("material")? else { return Ok(Vec::new()) };
    let entries = table.tables().map(|entry| {
        let (name, m) = entry?;
        let kind = m.need(
            "type",
            "\"translucent\", \"dielectric\", \"diffuse\", \"plastic\", \"conductor\" or \"emissive\"",
            Node::text,
        )?;
        let (mut without_thickness, mut albedo_image) = (None, None);
        textures::refuse_elsewhere(&m, (kind == "diffuse").then_some("albedo"))?;
        let surface = match kind {
            "translucent" => translucent(&m, unit_in_mm.unwrap_or(1.0), &mut without_thickness)?,
            "diffuse" => {
                albedo_image = textures::read(&m, "albedo")?;
                opaque::diffuse(&m, albedo_image.is_some())?
            }
            "conductor" => opaque::conductor(&m)?,
            "plastic" => opaque::plastic(&m)?,
            "emissive" => {
                m.only("an emissive material", &["type", "radiance", "two_sided"])?;
                let radiance = m.need("radiance", RADIANCE, |n| colour(n, |v| v >= 0.0))?;
                let two_sided = switch(&m, "two_sided")?.unwrap_or(false);
                Surface::emissive(Emission { radiance: rgb(radiance), two_sided })
            }
            "dielectric" => dielectric(&m, unit_in_mm.unwrap_or(1.0))?,
            "mirror" => {
                let what = "a mirror is type = \"conductor\" with `reflectance = 1`, or with a `metal`";
                return Err(m.error_at("type", what));
            }
            other => return Err(m.error_at("type", unknown(other, KINDS))),
        };
        Ok(MaterialEntry { name: name.to_string(), surface, albedo_image, at: m.at(), without_thickness })
    });
    entries.collect()
}

/// Clear glass, water, air: refraction, and absorption if there is any.
fn dielectric(m: &Fields<'_>, unit_in_mm: f64) -> Result<Surface> {
    m.only("a dielectric material", &["type", "sigma_a", "eta", "per"])?;
    let eta = m.need("eta", ETA, refractive_index)? as f32;
    let per = m.get("per", UNIT, unit)?;
    let sigma_a = m.get("sigma_a", COEFFICIENT, |n| colour(n, |v| v >= 0.0))?.unwrap_or([0.0; 3]);
    let sigma_a = rgb(sigma_a.map(|v| per.map_or(v, |per| v * (unit_in_mm / per))));
    let medium = Medium { sigma_a, sigma_s: Rgb::BLACK, g: 0.0, eta };
    let medium = medium.checked().map_err(|e| m.error(format!("{e}; see `per`")))?;
    Ok(Surface::dielectric(Dielectric { eta, sigma_a: medium.sigma_a }))
}

fn refractive_index(n: &Node) -> Option<f64> {
    n.number().filter(|v| (*v as f32).is_normal() && *v > 0.0)
}

fn translucent(m: &Fields<'_>, unit_in_mm: f64, without_thickness: &mut Option<String>) -> Result<Surface> {
    let keys = [
        "type",
        "preset",
        "sigma_s_prime",
        "sigma_s",
        "sigma_a",
        "colour",
        "mean_free_path",
        "g",
        "eta",
        "per",
        "scale",
        "model",
        "thickness",
        "calibrated",
        "exit_normalisation",
        "roughness",
    ];
    m.only("a translucent material", &keys)?;
    let scale = m.get("scale", "a number above 0", |n| n.number().filter(|v| *v > 0.0))?.unwrap_or(1.0);
    let eta = m.get("eta", ETA, refractive_index)?;
    let (mut medium, source) = match m.get("preset", "the name of a measured medium or of a look", Node::text)? {
        Some(name) => preset(m, name, unit_in_mm, eta)?,
        None if m.has("colour") || m.has("mean_free_path") => {
            (look(m, unit_in_mm, eta)?, format!("{}, from its colour", m.at()))
        }
        None => (numbers(m, unit_in_mm, eta)?, m.at()),
    };
    if scale != 1.0 {
        let scaled = |c: Rgb| c.map(|v| (f64::from(v) * scale) as f32);
        (medium.sigma_a, medium.sigma_s) = (scaled(medium.sigma_a), scaled(medium.sigma_s));
    }
    let medium = medium.checked().map_err(|e| m.error(format!("{e}; see `per` and `scale`")))?;
    let positive = |n: &Node| n.number().filter(|v| (*v as f32).is_normal() && *v > 0.0);
    let roughness = m.get("roughness", "a number from 0 to 1", |n| n.number().filter(|v| (0.0..=1.0).contains(v)))?;
    let rough = roughness.and_then(|roughness| RoughBoundary::new(medium.eta, roughness as f32));
    let source = match &rough {
        Some(rough) => format!("{source}, {}", rough.text()),
        None => source,
    };
    let translucent = Translucent {
        medium,
        rough: rough.map(Arc::new),
        model: named_value(m, "model")?.unwrap_or(ModelName::AUTO),
        thickness: m.get("thickness", "a number of units above 0", positive)?.map(|v| v as f32),
        calibrated: switch(m, "calibrated")?.unwrap_or(false),
        exit_normalisation: switch(m, "exit_normalisation")?.unwrap_or(true),
        source,
    };
    match translucent.build().map_err(|e| m.error(e)) {
        Err(e) if translucent.model == ModelName::SLAB && translucent.thickness.is_none() => {
            *without_thickness = Some(format!("{e}, or a `thickness` of each open mesh that it is the material of"));
        }
        built => drop(built?),
    }
    Ok(Surface::translucent(translucent))
}

/// A named medium; its colour, if it has one, whatever `eta`.
fn preset(m: &Fields<'_>, name: &str, unit_in_mm: f64, eta: Option<f64>) -> Result<(Medium, String)> {
    let preset = Preset::find_or_explain(name).map_err(|e| m.error_at("preset", format_args!("is wrong: {e}")))?;
    for key in ["sigma_s_prime", "sigma_s", "sigma_a", "colour", "mean_free_path", "g", "per"] {
        if m.has(key) {
            return Err(
                m.error_at(key, "stands beside `preset`, which has its own; remove one (`eta` and `scale` may stay)")
            );
        }
    }
    Ok(match preset {
        Preset::Measured(measured) => {
            let medium = measured.medium(unit_in_mm);
            let eta = eta.map_or(medium.eta, |eta| eta as f32);
            (Medium { eta, ..medium }, format!("{name} [{}]", measured.source))
        }
        Preset::Look(look) => {
            let medium = look.medium(unit_in_mm, eta).map_err(|e| m.error(e))?;
            (medium, format!("{} (a look, not measured)", look.name))
        }
    })
}

/// A medium from how it looks.
fn look(m: &Fields<'_>, unit_in_mm: f64, eta: Option<f64>) -> Result<Medium> {
    if let Some(key) = ["sigma_s_prime", "sigma_s", "sigma_a"].into_iter().find(|key| m.has(key)) {
        return Err(m.error_at(
            key,
            "stands beside `colour` and `mean_free_path`, of which it follows; give one or the others",
        ));
    }
    let expected =
        "one number or three, from 0 to below 1: what absorbs nothing has `sigma_a` = 0 in place of a colour";
    let colour = m.need("colour", expected, |n| values::colour(n, |v| (0.0..1.0).contains(&v)))?;
    let length = |n: &Node| values::colour(n, |v| v > 0.0 && (v as f32).is_normal());
    let lengths = m.need("mean_free_path", "one length or three above 0", length)?;
    let per = m.get("per", UNIT, unit)?;
    let mean_free_path = lengths.map(|l| per.map_or(l, |per| l * (per / unit_in_mm)));
    let eta = eta.ok_or_else(|| m.missing("eta", ETA))?;
    let look = Look { colour, mean_free_path, g: cosine(m)?.unwrap_or(0.0), eta };
    look.medium().map_err(|e| m.error(format!("{e}; see `per` and `mean_free_path`")))
}

/// The mean cosine, if it is there.
fn cosine(m: &Fields<'_>) -> Result<Option<f64>> {
    m.get("g", G, |n| n.number().filter(|v| *v > -1.0 && *v < 1.0 && (*v as f32).abs() < 1.0))
}

/// A medium from coefficients; without a preset none of them has a default, except that reduced scattering may come
/// without `g`.
fn numbers(m: &Fields<'_>, unit_in_mm: f64, eta: Option<f64>) -> Result<Medium> {
    let coefficient = |n: &Node| colour(n, |v| v >= 0.0);
    let per = m.get("per", UNIT, unit)?;
    let (reduced, full) =
        (m.get("sigma_s_prime", COEFFICIENT, coefficient)?, m.get("sigma_s", COEFFICIENT, coefficient)?);
    let g = cosine(m)?;
    let (sigma_s, g) = match (reduced, full, g) {
        (Some(_), Some(_), _) => {
            return Err(m.error_at("sigma_s", "stands beside `sigma_s_prime`, which is sigma_s (1 - g); remove one"));
        }
        (Some(reduced), None, g) => {
            let g = g.unwrap_or(0.0);
            (reduced.map(|v| v / (1.0 - g)), g)
        }
        (None, Some(full), Some(g)) => (full, g),
        (None, Some(_), None) => return Err(m.missing("g", &format!("{G}, beside `sigma_s`"))),
        (None, None, _) => {
            return Err(m.missing(
                "sigma_s_prime",
                &format!("{COEFFICIENT}; or `sigma_s` and `g`, `colour` and `mean_free_path`, or a `preset`"),
            ));
        }
    };
    let sigma_a = m.need("sigma_a", COEFFICIENT, coefficient)?;
    let eta = eta.ok_or_else(|| m.missing("eta", ETA))?;
    let per_unit = |v: [f64; 3]| rgb(v.map(|v| per.map_or(v, |per| v * (unit_in_mm / per))));
    Ok(Medium { sigma_a: per_unit(sigma_a), sigma_s: per_unit(sigma_s), g, eta: eta as f32 })
}
