//! Saving a picture by the ending of its name.

use super::{Image, Layer, Metadata, PngReport, atomic, exr_file, png_file};
use crate::{Error, Result};
use serde::Serialize;
use std::io;
use std::path::Path;

/// Kinds of picture files that are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Linear radiance, `f32`.
    Exr,
    /// 8 bits per channel, for looking at.
    Png,
    /// The sums themselves, to go on with or to merge: see [`super::Checkpoint`].
    Film,
}

impl Format {
    /// The kind that `path` ends in; capitals count as small letters.
    ///
    /// # Errors
    /// Usage for any other ending.
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            Some("film") => Ok(Self::Film),
            _ => Err(Error::usage(format!(
                "{}: the name of a picture ends in .exr (linear, for measuring), .png (8 bits, for looking at) or .film (sums, to go \
                 on with or to merge)",
                path.display()
            ))),
        }
    }
}

/// How a PNG is made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PngOptions {
    /// Stops: radiance is multiplied by 2^exposure before the curve. Never chosen automatically.
    pub exposure: f64,
}

/// What saving did to the values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SaveReport {
    /// For a PNG: channel values that 8 bits could not hold. An EXR loses nothing.
    pub png: Option<PngReport>,
}

/// Writes `image` to `path` as EXR or PNG, by its ending, so that the file is the old or the new one at any time.
/// A PNG of a crop holds the crop alone.
///
/// # Errors
/// Usage for another ending or an exposure that is not a number; File if it cannot be written.
pub fn save(image: &Image, path: &Path, metadata: &Metadata, png: PngOptions) -> Result<SaveReport> {
    save_with_layers(image, &[], path, metadata, png)
}

/// The same with further layers in an EXR; a PNG has no place for them.
///
/// # Errors
/// As [`save`]; Usage if a layer has another window.
pub fn save_with_layers(
    image: &Image,
    layers: &[Layer],
    path: &Path,
    metadata: &Metadata,
    png: PngOptions,
) -> Result<SaveReport> {
    match Format::of(path)? {
        Format::Exr => {
            if let Some(layer) = layers.iter().find(|layer| layer.image.window != image.window) {
                return Err(Error::usage(format!("the layer `{}` has another window than the picture", layer.name)));
            }
            let mut channels: Vec<exr_file::Channel> = exr_file::channels(image);
            for layer in layers {
                channels.extend(exr_file::layer_channels(layer));
            }
            let bytes = exr_file::encode(image.resolution, image.window, channels, metadata)
                .map_err(|e| e.within(path.display()))?;
            atomic::write_atomically(path, |file| file.write_all(&bytes))?;
            Ok(SaveReport { png: None })
        }
        Format::Png => {
            if !png.exposure.is_finite() {
                return Err(Error::usage(format!("exposure {} is not a number of stops", png.exposure)));
            }
            let mut report = PngReport::default();
            atomic::write_atomically(path, |file| {
                report = png_file::encode(image, png.exposure, file).map_err(io::Error::from)?;
                Ok(())
            })?;
            Ok(SaveReport { png: Some(report) })
        }
        Format::Film => Err(Error::usage(format!("{}: a film file holds sums, not a picture", path.display()))),
    }
}

/// The bytes of a PNG file of `image`, scaled by 2^`exposure` (a finite number of stops).
///
/// # Errors
/// Usage for a picture that PNG cannot hold, such as an empty one.
pub fn png_bytes(image: &Image, exposure: f64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    png_file::encode(image, exposure, &mut bytes)
        .map_err(|e| Error::usage(format!("cannot make a PNG of this picture: {e}")))?;
    Ok(bytes)
}

/// Whether [`save`] could write `path` now: its ending, its folder, the file in its place. Ask before a render, not
/// after it. Leaves nothing behind.
///
/// # Errors
/// As [`save`].
pub fn check_writable(path: &Path) -> Result<()> {
    Format::of(path)?;
    atomic::check_replaceable(path)
}
