//! `[material.NAME]` as typed.

use super::opaque::OpaqueEntry;
use super::textures::Loader;
use super::tree::{Fields, Node};
use super::values::{self, RADIANCE, UNIT, colour, named_value, rgb, switch, unit, unknown};
use super::{Dielectric, Emission, Surface, TextureEntry, Translucent, textures};
use crate::bssrdf::ModelName;
use crate::error::{Error, Result};
use crate::math::Rgb;
use crate::optics::{Look, Medium, Preset};
use crate::surface::{Bsdf as _, Colour, Relief, RoughBoundary, Texture};
use std::sync::Arc;

/// One material, its coefficients already per scene unit.
#[derive(Clone, Debug)]
pub struct MaterialEntry {
    /// Name in the scene file.
    pub name: String,
    /// The kind and its numbers.
    pub surface: Surface,
    /// Its pictures; until they are read [`Self::surface`] has something in their place.
    pub(super) pictures: Pictures,
    /// File and line, for messages.
    pub at: String,
    /// What is wrong with it unless each of its objects has a `thickness`.
    pub(super) without_thickness: Option<String>,
}

/// Pictures as typed.
#[derive(Clone, Debug, Default)]
pub(super) struct Pictures {
    opaque: Option<OpaqueEntry>,
    /// Tint of a boundary.
    tint: Option<TextureEntry>,
    /// Colour of a translucent body, the rest of whose look, and factor of whose coefficients, are these.
    colour: Option<(TextureEntry, Look, f64)>,
    /// A normal map and its strength.
    normal: Option<(TextureEntry, f32)>,
    /// A height map and its height.
    bump: Option<(TextureEntry, f32)>,
    /// What is there of an opaque surface.
    opacity: Option<TextureEntry>,
}

impl Pictures {
    /// Those that stand beside colours.
    fn read(m: &Fields<'_>, opaque: Option<OpaqueEntry>) -> Result<Self> {
        let normal = textures::read_data(m, "normal", Some("strength"))?;
        let bump = textures::read_data(m, "bump", Some("height"))?;
        if bump.as_ref().is_some_and(|(_, height)| height.is_none()) {
            return Err(m.error_at("bump", "has no `height`: how high the picture's 1 is, in units"));
        }
        if normal.is_some() && bump.is_some() {
            return Err(m.error_at("bump", "stands beside `normal`; remove one of them"));
        }
        let opacity = textures::read_data(m, "opacity", None)?.map(|(image, _)| image);
        let with = |default: f64| move |(image, v): (TextureEntry, Option<f64>)| (image, v.unwrap_or(default) as f32);
        Ok(Self { opaque, normal: normal.map(with(1.0)), bump: bump.map(with(0.0)), opacity, ..Self::default() })
    }
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
        let mut without_thickness = None;
        let places: &[&str] = match kind {
            "diffuse" | "plastic" => &["albedo", "roughness", "normal", "bump", "opacity"],
            "conductor" => &["roughness", "normal", "bump", "opacity"],
            "translucent" => &["tint", "colour", "normal", "bump"],
            _ => &[],
        };
        textures::refuse_elsewhere(&m, places)?;
        let opaque = OpaqueEntry::read(&m, kind)?;
        let plain = opaque.as_ref().map(OpaqueEntry::plain);
        let mut pictures = Pictures::read(&m, opaque)?;
        let surface = match kind {
            "translucent" => translucent(&m, unit_in_mm.unwrap_or(1.0), (&mut without_thickness, &mut pictures))?,
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
            other => plain.map(Surface::opaque).ok_or_else(|| m.error_at("type", unknown(other, KINDS)))?,
        };
        Ok(MaterialEntry { name: name.to_string(), surface, pictures, at: m.at(), without_thickness })
    });
    entries.collect()
}

impl MaterialEntry {
    /// The pictures on it.
    pub fn images(&self) -> impl Iterator<Item = &TextureEntry> {
        let Pictures { opaque, tint, colour, normal, bump, opacity } = &self.pictures;
        let relief = normal.iter().chain(bump).map(|(image, _)| image);
        let inside = tint.iter().chain(colour.iter().map(|(image, ..)| image));
        opaque.iter().flat_map(OpaqueEntry::images).chain(inside).chain(relief).chain(opacity)
    }

    /// The surface with its pictures.
    ///
    /// # Errors
    /// A picture that cannot be read, or that is no colour of a body.
    pub(super) fn pictured(&self, loader: &mut Loader<'_>) -> Result<Surface> {
        let Pictures { opaque, tint, colour, normal, bump, opacity } = &self.pictures;
        let mut surface = self.surface.clone();
        if let Some(opaque) = opaque.as_ref().filter(|opaque| opaque.images().next().is_some()) {
            surface.bsdf = opaque.pictured(loader)?;
        }
        if let (Some(image), Some(inside)) = (tint, &mut surface.inside) {
            inside.dye(Colour::Picture(loader.load(image)?));
        }
        if let (Some((image, look, scale)), Some(inside)) = (colour, &mut surface.inside) {
            coloured(inside, image, loader.load(image)?, (*look, *scale))
                .map_err(|what| Error::scene(format!("{}: {what}", image.at)))?;
        }
        if let Some((image, strength)) = normal {
            surface.relief = Some(Arc::new(Relief::Normals(loader.load(image)?, *strength)));
        }
        if let Some((image, height)) = bump {
            surface.relief = Some(Arc::new(Relief::Heights(loader.load(image)?, *height)));
        }
        if let Some(image) = opacity {
            surface.opacity = Some(loader.load(image)?);
        }
        Ok(surface)
    }
}

/// Gives a body the colours of a picture: the medium of its brightest ones, and pigment.
fn coloured(
    inside: &mut Translucent,
    image: &TextureEntry,
    texture: Arc<Texture>,
    (look, scale): (Look, f64),
) -> std::result::Result<(), String> {
    let largest = texture.largest();
    if let Some(c) = (0..3).find(|&c| largest[c] <= 0.0 || largest[c] >= 1.0) {
        return Err(format!(
            "the largest {} of {} is {}: a colour is above 0 and below 1 where it is brightest; give a `scale`, as 0.9, or take `tint`",
            ["red", "green", "blue"][c],
            image.image.display(),
            largest[c]
        ));
    }
    let look = Look { colour: largest.0.map(f64::from), ..look };
    let medium = look.medium().map_err(|e| e.to_string())?;
    inside.medium = scaled(medium, scale).checked().map_err(|e| e.to_string())?;
    // What enters and leaves at one point has been through the pigment twice.
    inside.dye(Colour::Picture(Arc::new(texture.map(|t| Rgb::from_fn(|c| (t[c] / largest[c]).sqrt())))));
    inside.build().map_err(|e| e.to_string())?;
    Ok(())
}

/// With both coefficients multiplied.
fn scaled(medium: Medium, scale: f64) -> Medium {
    let by = |c: Rgb| if scale == 1.0 { c } else { c.map(|v| (f64::from(v) * scale) as f32) };
    Medium { sigma_a: by(medium.sigma_a), sigma_s: by(medium.sigma_s), ..medium }
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

fn translucent(
    m: &Fields<'_>,
    unit_in_mm: f64,
    (without_thickness, pictures): (&mut Option<String>, &mut Pictures),
) -> Result<Surface> {
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
        "tint",
        "normal",
        "bump",
    ];
    m.only("a translucent material", &keys)?;
    let scale = m.get("scale", "a number above 0", |n| n.number().filter(|v| *v > 0.0))?.unwrap_or(1.0);
    let eta = m.get("eta", ETA, refractive_index)?;
    let colours = textures::read(m, "colour")?;
    let mut by_colour = None;
    let (medium, source) = match m.get("preset", "the name of a measured medium or of a look", Node::text)? {
        Some(name) => preset(m, name, unit_in_mm, eta)?,
        None if m.has("colour") || m.has("mean_free_path") => {
            let look = look(m, unit_in_mm, eta, colours.is_some())?;
            by_colour = colours.map(|image| (image, look, scale));
            let medium = look.medium().map_err(|e| m.error(format!("{e}; see `per` and `mean_free_path`")))?;
            (medium, format!("{}, from its colour", m.at()))
        }
        None => (numbers(m, unit_in_mm, eta)?, m.at()),
    };
    let medium = scaled(medium, scale).checked().map_err(|e| m.error(format!("{e}; see `per` and `scale`")))?;
    let positive = |n: &Node| n.number().filter(|v| (*v as f32).is_normal() && *v > 0.0);
    let roughness = m.get("roughness", "a number from 0 to 1", |n| n.number().filter(|v| (0.0..=1.0).contains(v)))?;
    let rough = roughness.and_then(|roughness| RoughBoundary::new(medium.eta, roughness as f32));
    let source = match &rough {
        Some(rough) => format!("{source}, {}", rough.text()),
        None => source,
    };
    let tints = textures::read(m, "tint")?;
    let share = |n: &Node| colour(n, |v| (0.0..=1.0).contains(&v));
    let tint = match &tints {
        None => m.get("tint", "one number or three from 0 to 1, or { image = \"FILE\" }", share)?,
        Some(_) => None,
    };
    if let (Some(_), true) = (&by_colour, m.has("tint")) {
        return Err(
            m.error_at("tint", "stands beside a picture for `colour`, which tints the boundary: remove one of them")
        );
    }
    (pictures.tint, pictures.colour) = (tints, by_colour);
    let mut translucent = Translucent {
        medium,
        rough: rough.map(Arc::new),
        tint: None,
        model: named_value(m, "model")?.unwrap_or(ModelName::AUTO),
        thickness: m.get("thickness", "a number of units above 0", positive)?.map(|v| v as f32),
        calibrated: switch(m, "calibrated")?.unwrap_or(false),
        exit_normalisation: switch(m, "exit_normalisation")?.unwrap_or(true),
        source,
    };
    if let Some(share) = tint {
        translucent.dye(Colour::Even(rgb(share)));
    }
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

/// How a medium looks; with a picture for its colour, some colour until that is read.
fn look(m: &Fields<'_>, unit_in_mm: f64, eta: Option<f64>, has_picture: bool) -> Result<Look> {
    if let Some(key) = ["sigma_s_prime", "sigma_s", "sigma_a"].into_iter().find(|key| m.has(key)) {
        return Err(m.error_at(
            key,
            "stands beside `colour` and `mean_free_path`, of which it follows; give one or the others",
        ));
    }
    let expected =
        "one number or three, from 0 to below 1: what absorbs nothing has `sigma_a` = 0 in place of a colour";
    let typed = |n: &Node| values::colour(n, |v| (0.0..1.0).contains(&v));
    let colour = if has_picture { [0.5; 3] } else { m.need("colour", expected, typed)? };
    let length = |n: &Node| values::colour(n, |v| v > 0.0 && (v as f32).is_normal());
    let lengths = m.need("mean_free_path", "one length or three above 0", length)?;
    let per = m.get("per", UNIT, unit)?;
    let mean_free_path = lengths.map(|l| per.map_or(l, |per| l * (per / unit_in_mm)));
    let eta = eta.ok_or_else(|| m.missing("eta", ETA))?;
    Ok(Look { colour, mean_free_path, g: cosine(m)?.unwrap_or(0.0), eta })
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
