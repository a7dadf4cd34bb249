//! `[[light]]` as typed: lights that are no surface. Lamps with a surface are emissive objects; what shines from all around is `[environment]`.

use std::collections::HashMap;
use std::f64::consts::PI;

use super::tree::{Fields, Node};
use super::values::{RADIANCE, UNIT, colour, rgb, unit, unit_vector, unknown, vector};
use crate::error::Result;
use crate::math::{DVec3, Rgb};

/// A light that is no surface.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSource {
    /// Name, for messages; unlike any other light's.
    pub name: String,
    /// Where it is and how it shines.
    pub kind: LightKind,
    /// File and line, for messages.
    pub at: String,
}

/// Kinds of light that are no surface. Places are as typed in a file, and relative to the scene's centre in a [`super::Scene`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LightKind {
    /// A disk far away.
    Sun {
        /// Unit vector to its middle.
        towards: DVec3,
        /// Across its direction [radiance unit x sr].
        irradiance: Rgb,
        /// Half of its angular diameter \[rad\], above 0 and below π/2.
        half_angle: f64,
    },
    /// Parallel light.
    Distant {
        /// Unit vector to where it comes from.
        towards: DVec3,
        /// Across its direction [radiance unit x sr].
        irradiance: Rgb,
    },
    /// A place that shines alike into all directions.
    Point {
        /// The place \[unit\].
        position: DVec3,
        /// [radiance unit x unit²].
        intensity: Rgb,
    },
    /// A place that shines into a cone.
    Spot {
        /// The place \[unit\].
        position: DVec3,
        /// Unit vector along the axis of the cone.
        axis: DVec3,
        /// Along the axis [radiance unit x unit²].
        intensity: Rgb,
        /// Cosines of the angles to the axis where it begins to fade and where it is dark, the first larger.
        cosines: [f64; 2],
    },
}

/// Angular diameter of the sun as seen from the Earth, in the mean [degrees].
const SUN: f64 = 0.53;
/// Full angle of a spot's cone [degrees].
const CONE: f64 = 40.0;
/// Share of it, from its rim, in which a spot fades.
const PENUMBRA: f64 = 0.2;
/// A spot whose rim is sharper has the cosines of its two angles in one.
const SHARPEST: f64 = 1e-6;

const KINDS: &[&str] = &["sun", "distant", "point", "spot"];
const POINT: &str = "three numbers [x, y, z]";
const DIRECTION: &str = "three numbers [x, y, z], not all 0: where its light goes";

/// All lights that are no surface; `unit_in_mm` is the scene's, millimetres if it does not say.
pub(super) fn read(top: &Fields<'_>, unit_in_mm: Option<f64>) -> Result<Vec<LightSource>> {
    let list = top.list("light")?;
    let mut taken: HashMap<String, String> = HashMap::with_capacity(list.len());
    let one = |(i, l): (usize, &Fields<'_>)| {
        let name = l.get("name", "a name in quotes", Node::text)?.map_or_else(|| format!("light {i}"), String::from);
        if let Some(other) = taken.insert(name.clone(), l.at()) {
            return Err(l.error_at("name", format_args!("{name:?} is taken ({other}); give each light its own")));
        }
        let kind = match l.need("type", "\"sun\", \"distant\", \"point\" or \"spot\"", Node::text)? {
            "sun" => {
                l.only("a sun", &["name", "type", "direction", "irradiance", "angle"])?;
                let angle = "degrees from 0.01 to below 180; for parallel light take type = \"distant\"";
                let diameter = l.get("angle", angle, |n| n.number().filter(|d| (1e-2..180.0).contains(d)))?;
                let half_angle = 0.5 * diameter.unwrap_or(SUN).to_radians();
                LightKind::Sun { towards: -direction(l)?, irradiance: amount(l, "irradiance", 1.0)?, half_angle }
            }
            "distant" => {
                l.only("a distant light", &["name", "type", "direction", "irradiance"])?;
                LightKind::Distant { towards: -direction(l)?, irradiance: amount(l, "irradiance", 1.0)? }
            }
            "point" => {
                l.only("a point light", &["name", "type", "position", "intensity", "power", "per"])?;
                let position = l.need("position", POINT, vector)?;
                LightKind::Point { position, intensity: intensity(l, unit_in_mm, 4.0 * PI)? }
            }
            "spot" => {
                let keys = [
                    "name",
                    "type",
                    "position",
                    "direction",
                    "look_at",
                    "cone",
                    "penumbra",
                    "intensity",
                    "power",
                    "per",
                ];
                l.only("a spot", &keys)?;
                spot(l, unit_in_mm)?
            }
            other => return Err(l.error_at("type", unknown(other, KINDS))),
        };
        Ok(LightSource { name, kind, at: l.at() })
    };
    list.iter().enumerate().map(one).collect()
}

fn spot(l: &Fields<'_>, unit_in_mm: Option<f64>) -> Result<LightKind> {
    let position = l.need("position", POINT, vector)?;
    let axis = match l.get("look_at", POINT, vector)? {
        Some(_) if l.has("direction") => {
            return Err(l.error_at("direction", "stands beside `look_at`, which says the same; remove one"));
        }
        Some(to) => unit_vector(to - position)
            .ok_or_else(|| l.error_at("look_at", "is the same point as `position`; expected a point in its light"))?,
        None => direction(l)?,
    };
    let cone = l.get("cone", "degrees above 0 and up to 180", |n| n.number().filter(|d| *d > 0.0 && *d <= 180.0))?;
    let penumbra =
        l.get("penumbra", "a share of the cone from 0 to 1", |n| n.number().filter(|p| (0.0..=1.0).contains(p)))?;
    let half = 0.5 * cone.unwrap_or(CONE).to_radians();
    let inner = half * (1.0 - penumbra.unwrap_or(PENUMBRA).max(SHARPEST));
    let cosines = [inner.cos(), half.cos()];
    if cosines[0] as f32 <= cosines[1] as f32 {
        return Err(l.error_at("cone", "with this `penumbra` is narrower than single precision; widen one of them"));
    }
    // The fading part has half of the light of an even one.
    let solid_angle = 2.0 * PI * (1.0 - 0.5 * (cosines[0] + cosines[1]));
    Ok(LightKind::Spot { position, axis, intensity: intensity(l, unit_in_mm, solid_angle)?, cosines })
}

fn direction(l: &Fields<'_>) -> Result<DVec3> {
    l.need("direction", DIRECTION, |n| vector(n).and_then(unit_vector))
}

/// The colour `key` times `factor`, in the range of f32.
fn amount(l: &Fields<'_>, key: &str, factor: f64) -> Result<Rgb> {
    let within = |v: f64| v >= 0.0 && ((v * factor) as f32).is_finite();
    Ok(rgb(l.need(key, RADIANCE, |n| colour(n, within))?.map(|v| v * factor)))
}

/// `intensity`, or `power` over the solid angle that it goes to [sr]; of a length of `per`, or else the scene's.
fn intensity(l: &Fields<'_>, unit_in_mm: Option<f64>, solid_angle: f64) -> Result<Rgb> {
    let per = l.get("per", UNIT, unit)?.map_or(1.0, |per| per / unit_in_mm.unwrap_or(1.0));
    match (l.has("intensity"), l.has("power")) {
        (true, true) => Err(l.error_at("power", "stands beside `intensity`, which says the same; remove one")),
        (false, true) => amount(l, "power", per * per / solid_angle),
        _ => amount(l, "intensity", per * per),
    }
}

impl LightKind {
    /// The same with places relative to `centre`.
    #[must_use]
    pub(super) fn relative_to(self, centre: DVec3) -> Self {
        match self {
            Self::Point { position, intensity } => Self::Point { position: position - centre, intensity },
            Self::Spot { position, axis, intensity, cosines } => {
                Self::Spot { position: position - centre, axis, intensity, cosines }
            }
            far => far,
        }
    }

    /// Where it is; `None` of what is far away.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(*position),
            Self::Sun { .. } | Self::Distant { .. } => None,
        }
    }

    /// Irradiance across its direction, or intensity.
    pub fn amount(&self) -> Rgb {
        match self {
            Self::Sun { irradiance, .. } | Self::Distant { irradiance, .. } => *irradiance,
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => *intensity,
        }
    }

    /// What `check` says of it; `centre` is the scene's.
    pub fn text(&self, centre: DVec3) -> String {
        let three = |v: DVec3| v.to_array().map(crate::words::short).join(", ");
        let place = |x: DVec3| three(x + centre);
        match self {
            Self::Sun { towards, irradiance, half_angle } => format!(
                "sun, {} degrees across, from ({}), irradiance {:?}",
                crate::words::short(2.0 * half_angle.to_degrees()),
                three(*towards),
                irradiance.0
            ),
            Self::Distant { towards, irradiance } => {
                format!("distant, from ({}), irradiance {:?}", three(*towards), irradiance.0)
            }
            Self::Point { position, intensity } => {
                format!("point at ({}), intensity {:?}", place(*position), intensity.0)
            }
            Self::Spot { position, axis, intensity, cosines } => format!(
                "spot at ({}) along ({}), cone of {} degrees, intensity {:?}",
                place(*position),
                three(*axis),
                crate::words::short(2.0 * cosines[1].acos().to_degrees()),
                intensity.0
            ),
        }
    }
}
