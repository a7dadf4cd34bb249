//! What shines from all around: as typed, and as rendered.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::file::{RADIANCE, colour, rgb};
use super::tree::Fields;
use crate::error::{Error, Result};
use crate::film::Image;
use crate::math::Rgb;

/// `[environment]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnvironmentEntry {
    /// Radiance, or what the picture's is multiplied by; black without the section.
    pub radiance: Rgb,
    /// An EXR of all directions, looked for beside the scene file.
    pub image: Option<PathBuf>,
    /// Turns the picture about the y axis [degrees], counterclockwise as seen from above.
    pub turn: f64,
}

/// Light from every direction that meets no surface.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Radiance [W/(m² sr) or any linear unit], or the factor of the picture's.
    pub radiance: Rgb,
    /// All directions, in equal steps of longitude to the right and of latitude downwards: +y is the upper edge, +z the
    /// middle, +x a quarter from the left. No value is negative or not finite.
    pub image: Option<Arc<Image>>,
    /// Counterclockwise turn of the picture about the y axis as seen from above [turns].
    pub turn: f32,
}

impl Environment {
    /// Whether no light comes from it.
    pub fn is_black(&self) -> bool {
        self.radiance.is_black() || self.image.as_ref().is_some_and(|i| i.pixels.iter().all(|p| p.is_black()))
    }
}

impl From<Rgb> for Environment {
    /// The same radiance from everywhere.
    fn from(radiance: Rgb) -> Self {
        Self { radiance, image: None, turn: 0.0 }
    }
}

pub(super) fn read(top: &Fields<'_>) -> Result<EnvironmentEntry> {
    let Some(e) = top.table("environment")? else { return Ok(EnvironmentEntry::default()) };
    e.only("[environment]", &["radiance", "image", "turn"])?;
    let image: Option<PathBuf> = e.get("image", "the name of an EXR file", super::tree::Node::text)?.map(PathBuf::from);
    let radiance = e.get("radiance", RADIANCE, |n| colour(n, |v| v >= 0.0))?.map(rgb);
    Ok(EnvironmentEntry {
        radiance: match (radiance, &image) {
            (Some(radiance), _) => radiance,
            (None, Some(_)) => Rgb::splat(1.0),
            (None, None) => return Err(e.missing("radiance", RADIANCE)),
        },
        image,
        turn: e.get("turn", "degrees from -360 to 360", |n| n.number().filter(|d| d.abs() <= 360.0))?.unwrap_or(0.0),
    })
}

impl EnvironmentEntry {
    /// Reads the picture, which is looked for in `folder`; what is odd about it goes to `said`.
    pub(super) fn load(&self, folder: &Path, said: &mut Vec<String>) -> Result<Environment> {
        let turn = (self.turn / 360.0) as f32;
        let Some(path) = self.image.as_ref().map(|name| folder.join(name)) else {
            return Ok(Environment { radiance: self.radiance, image: None, turn });
        };
        let mut image = Image::read_exr(&path).map_err(|e| e.within("[environment]"))?;
        if image.window.area() != image.resolution.iter().map(|&n| n as usize).product::<usize>() {
            let why = "its data window leaves out part of the picture; an environment needs all directions";
            return Err(Error::file(&path, "use", why));
        }
        let [width, height] = image.resolution;
        if u64::from(width) != 2 * u64::from(height) {
            said.push(format!(
                "{}: {width} x {height} pixels: longitude and latitude are expected, twice as wide as high",
                path.display()
            ));
        }
        let mut dropped = 0_u64;
        for value in image.pixels.iter_mut().flat_map(|p| &mut p.0) {
            if !(value.is_finite() && *value >= 0.0) {
                (*value, dropped) = (0.0, dropped + 1);
            }
        }
        if dropped > 0 {
            let what = "values are negative or not finite and count as 0";
            said.push(format!("{}: {dropped} {what}", path.display()));
        }
        Ok(Environment { radiance: self.radiance, image: Some(Arc::new(image)), turn })
    }
}
