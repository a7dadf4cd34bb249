//! What shines from all around: as typed, and as rendered.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::tree::Fields;
use super::values::{RADIANCE, colour, rgb};
use crate::error::{Error, Result};
use crate::film::{FilePicture, Image};
use crate::math::Rgb;
use crate::words::{counted, either};

/// `[environment]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnvironmentEntry {
    /// Radiance, or what the picture's is multiplied by; black without the section.
    pub radiance: Rgb,
    /// An EXR or Radiance HDR file of all directions, looked for beside the scene file.
    pub image: Option<PathBuf>,
    /// The layer of an EXR file that has several.
    pub layer: Option<String>,
    /// Turns the picture about the y axis \[degrees\], counterclockwise as seen from above.
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
    /// Counterclockwise turn of the picture about the y axis as seen from above \[turns\].
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
    e.only("[environment]", &["radiance", "image", "layer", "turn"])?;
    let image: Option<PathBuf> =
        e.get("image", "the name of an EXR or HDR file", super::tree::Node::text)?.map(PathBuf::from);
    let radiance = e.get("radiance", RADIANCE, |n| colour(n, |v| v >= 0.0))?.map(rgb);
    Ok(EnvironmentEntry {
        radiance: match (radiance, &image) {
            (Some(radiance), _) => radiance,
            (None, Some(_)) => Rgb::splat(1.0),
            (None, None) => return Err(e.missing("radiance", RADIANCE)),
        },
        image,
        layer: e.get("layer", "the name of a layer", super::tree::Node::text)?.map(String::from),
        turn: e.get("turn", "degrees from -360 to 360", |n| n.number().filter(|d| d.abs() <= 360.0))?.unwrap_or(0.0),
    })
}

/// No light is as bright; programs write such numbers for want of a value.
const FILLER: f32 = 1e30;

impl EnvironmentEntry {
    /// Reads the picture, which is looked for in `folder`; what is odd about it goes to `said`.
    pub(super) fn load(&self, folder: &Path, said: &mut Vec<String>) -> Result<Environment> {
        let turn = (self.turn / 360.0) as f32;
        let Some(path) = self.image.as_ref().map(|name| folder.join(name)) else {
            return Ok(Environment { radiance: self.radiance, image: None, turn });
        };
        let read = FilePicture::read(&path, self.layer.as_deref()).map_err(|e| e.within("[environment]"))?;
        if read.cube {
            let why = "it holds the six sides of a cube; an environment needs longitude and latitude";
            return Err(Error::file(&path, "use", why).within("[environment]"));
        }
        said.extend(read.remarks.iter().map(|remark| format!("{}: {remark}", path.display())));
        let mut image = read.image;
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
        let (mut negative, mut nan, mut infinite) = (0_u64, 0_u64, 0_u64);
        for value in image.pixels.iter_mut().flat_map(|p| &mut p.0) {
            let count = match *value {
                v if v.is_nan() => &mut nan,
                v if v < 0.0 => &mut negative,
                v if v.is_infinite() => &mut infinite,
                _ => continue,
            };
            (*count, *value) = (*count + 1, 0.0);
        }
        let dropped = negative + nan + infinite;
        if dropped > 0 {
            said.push(format!(
                "{}: {} negative or not finite ({negative} negative, {nan} not a number, {infinite} infinite) and {} as 0",
                path.display(),
                counted(dropped, "value is", "values are"),
                either(dropped, "counts", "count")
            ));
        }
        self.in_range(&path, &image, said)?;
        Ok(Environment { radiance: self.radiance, image: Some(Arc::new(image)), turn })
    }

    /// Whether all of the picture times the factor is in the range of f32; pixels near its end are said.
    fn in_range(&self, path: &Path, image: &Image, said: &mut Vec<String>) -> Result<()> {
        let bright = |i: usize| image.pixels[i].max();
        let Some(brightest) = (0..image.pixels.len()).max_by(|&a, &b| bright(a).total_cmp(&bright(b))) else {
            return Ok(());
        };
        let name = |i: usize| {
            let ([x, y], [r, g, b]) = (image.window.pixel(i), image.pixels[i].0);
            format!("pixel {x},{y} is ({r:e}, {g:e}, {b:e})")
        };
        if let Some(i) = (0..image.pixels.len()).find(|&i| !(self.radiance * image.pixels[i]).is_finite()) {
            let [r, g, b] = self.radiance.0;
            let why = format!(
                "{}, which times radiance = ({r:e}, {g:e}, {b:e}) is beyond single precision ({:e}): use a smaller `radiance`",
                name(i),
                f32::MAX
            );
            return Err(Error::file(path, "use", why).within("[environment]"));
        }
        if bright(brightest) > FILLER {
            let what = "if that stands for a value that is missing, mend the picture: it outshines all others";
            said.push(format!("{}: {}; {what}", path.display(), name(brightest)));
        }
        Ok(())
    }
}
