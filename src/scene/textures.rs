//! Pictures on surfaces: as typed, and as rendered.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::tree::{Fields, Node};
use super::values::{colour, rgb};
use crate::error::{Error, Result};
use crate::film::{FilePicture, Image};
use crate::math::Rgb;
use crate::surface::{Texture, Wrap};
use crate::words::either;

/// `{ image = ... }` in the place of a colour.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureEntry {
    /// A PNG, JPEG, EXR or Radiance HDR file, looked for beside the scene file.
    pub image: PathBuf,
    /// The layer of an EXR file that has several.
    pub layer: Option<String>,
    /// What its values are multiplied by, not negative.
    pub scale: Rgb,
    /// What is beyond its edges.
    pub wrap: Wrap,
    /// Whether it is numbers, not colours: codes of PNG and JPEG are then shares of the largest one.
    pub is_data: bool,
    /// File and line, for messages.
    pub at: String,
}

const FILES: &str = "the name of a PNG, JPEG, EXR or HDR file";

/// The picture under `key`, if it is a table.
pub(super) fn read(m: &Fields<'_>, key: &str) -> Result<Option<TextureEntry>> {
    if !m.is_table(key) {
        return Ok(None);
    }
    let Some(t) = m.table(key)? else { return Ok(None) };
    t.only("a picture on a surface", &["image", "layer", "scale", "wrap"])?;
    picture(m, key, &t, false).map(Some)
}

/// The picture of numbers under `key`, if there is one, and the number under `more` beside its file.
pub(super) fn read_data(m: &Fields<'_>, key: &str, more: Option<&str>) -> Result<Option<(TextureEntry, Option<f64>)>> {
    if !m.has(key) {
        return Ok(None);
    }
    if !m.is_table(key) {
        return Err(m.error_at(key, "is a picture: { image = \"FILE\" }"));
    }
    let Some(t) = m.table(key)? else { return Ok(None) };
    let keys: Vec<&str> = ["image", "layer", "scale", "wrap"].into_iter().chain(more).collect();
    t.only("a picture of numbers on a surface", &keys)?;
    let number = match more {
        None => None,
        Some(more) => t.get(more, "a number", |n| n.number().filter(|v| (*v as f32).is_finite()))?,
    };
    Ok(Some((picture(m, key, &t, true)?, number)))
}

fn picture(m: &Fields<'_>, key: &str, t: &Fields<'_>, is_data: bool) -> Result<TextureEntry> {
    let scale = t.get("scale", "one number or three, none negative", |n| colour(n, |v| v >= 0.0))?;
    let wrap = |n: &Node| match n.text()? {
        "repeat" => Some(Wrap::Repeat),
        "clamp" => Some(Wrap::Clamp),
        _ => None,
    };
    Ok(TextureEntry {
        image: t.need("image", FILES, |n| n.text().filter(|t| !t.is_empty()))?.into(),
        layer: t.get("layer", "the name of a layer", Node::text)?.map(String::from),
        scale: scale.map_or(Rgb::WHITE, rgb),
        wrap: t.get("wrap", "\"repeat\" or \"clamp\"", wrap)?.unwrap_or_default(),
        is_data,
        at: m.at_key(key),
    })
}

/// Refuses pictures under all keys but these.
pub(super) fn refuse_elsewhere(m: &Fields<'_>, places: &[&str]) -> Result<()> {
    match m.keys().find(|key| m.is_table(key) && !places.contains(key)) {
        Some(key) => Err(m.error_at(
            key,
            "is a table: pictures are for `albedo` and `roughness` of opaque surfaces, and `tint` or `colour` of type = \"translucent\"; give numbers",
        )),
        None => Ok(()),
    }
}

/// Reads pictures, those alike once.
pub(super) struct Loader<'a> {
    folder: &'a Path,
    said: &'a mut Vec<String>,
    known: Vec<(TextureEntry, Arc<Texture>)>,
}

impl<'a> Loader<'a> {
    /// Of those that are looked for in `folder`; what is odd about them goes to `said`.
    pub(super) fn new(folder: &'a Path, said: &'a mut Vec<String>) -> Self {
        Self { folder, said, known: Vec::new() }
    }

    /// The picture that is `typed`.
    pub(super) fn load(&mut self, typed: &TextureEntry) -> Result<Arc<Texture>> {
        let alike = TextureEntry { at: String::new(), ..typed.clone() };
        if let Some((_, texture)) = self.known.iter().find(|(other, _)| *other == alike) {
            return Ok(texture.clone());
        }
        let texture = Arc::new(typed.load(self.folder, self.said)?);
        self.known.push((alike, texture.clone()));
        Ok(texture)
    }
}

impl TextureEntry {
    /// Reads the picture, which is looked for in `folder`; what is odd about it goes to `said`.
    fn load(&self, folder: &Path, said: &mut Vec<String>) -> Result<Texture> {
        let path = folder.join(&self.image);
        let read =
            FilePicture::read_texture(&path, self.layer.as_deref(), self.is_data).map_err(|e| e.within(&self.at))?;
        said.extend(read.remarks.iter().map(|remark| format!("{}: {remark}", path.display())));
        let mut image = read.image;
        let [width, height] = image.resolution;
        if image.window.area() as u64 != u64::from(width) * u64::from(height) {
            let why = "its data window leaves out part of the picture; save all of it";
            return Err(Error::file(&path, "use", why).within(&self.at));
        }
        self.scale_within(&path, &mut image, said);
        Ok(Texture::new(self.image.display().to_string(), width, image.pixels, self.wrap))
    }

    /// Multiplied by the factor, and no less than 0 and no more than 1; it is said how much is not.
    fn scale_within(&self, path: &Path, image: &mut Image, said: &mut Vec<String>) {
        let (mut negative, mut above, mut nan, mut largest) = (0_u64, 0_u64, 0_u64, 1.0_f32);
        for pixel in &mut image.pixels {
            *pixel = self.scale * *pixel;
            for value in &mut pixel.0 {
                match *value {
                    v if v.is_nan() => (nan, *value) = (nan + 1, 0.0),
                    v if v < 0.0 => (negative, *value) = (negative + 1, 0.0),
                    v if v > 1.0 => (above, largest, *value) = (above + 1, largest.max(v), 1.0),
                    _ => {}
                }
            }
        }
        let all = image.pixels.len() as u64 * 3;
        let odd = negative + above + nan;
        if odd > 0 {
            let most = if above > 0 { format!(", the largest {largest}") } else { String::new() };
            said.push(format!(
                "{}: {}: {odd} of {all} values {} no albedo and {} taken as the nearest one ({negative} below 0, {above} above 1{most}, \
                 {nan} not a number); mend the picture{}",
                self.at,
                path.display(),
                either(odd as usize, "is", "are"),
                either(odd as usize, "is", "are"),
                if above > 0 { ", or use a smaller `scale`" } else { "" }
            ));
        }
    }
}
