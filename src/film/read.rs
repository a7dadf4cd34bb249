//! Reading a picture, whatever kind of file it is.

use super::{FilePicture, Image, exr_read, hdr_read, srgb_read};
use crate::{Error, Result};
use std::path::Path;

impl FilePicture {
    /// Reads an EXR or a Radiance HDR file, whatever its name. Of an EXR file the channels `R`, `G`, `B`; without them,
    /// those of the only layer that has them, or the luminance `Y` as grey; with `layer`, channels `layer.R` and so on, or
    /// `R` and so on in a part of that name. Alpha and all else are ignored. Other primaries become those of Rec. 709,
    /// values below 0 among them. Pixels of the data window outside the display window (overscan) are left out.
    ///
    /// # Errors
    /// File: not there, of another kind, cut short, channels missing (with the names of those it has), kinds of data that
    /// are not read (deep data, subsampled channels, new compressions). Memory if it would not fit.
    pub fn read(path: &Path, layer: Option<&str>) -> Result<Self> {
        if exr_read::first_bytes(path)?.starts_with(b"#?") {
            return hdr_read::read(path, layer);
        }
        exr_read::read(path, layer)
    }

    /// Reads a picture that is laid on a surface: PNG or JPEG, taken as sRGB and decoded to linear Rec. 709, alpha ignored; or
    /// what [`FilePicture::read`] reads, which is linear. With `is_data` codes of PNG and JPEG are shares of the largest one, and no colours.
    ///
    /// # Errors
    /// As [`FilePicture::read`]; File for a JPEG in inks (CMYK).
    pub fn read_texture(path: &Path, layer: Option<&str>, is_data: bool) -> Result<Self> {
        let png = match exr_read::first_bytes(path)?[..] {
            [0x89, b'P', b'N', b'G'] => true,
            [0xff, 0xd8, ..] => false,
            [b'#', b'?', ..] | [0x76, 0x2f, 0x31, 0x01] => return Self::read(path, layer),
            [] => return Err(Error::file(path, "read", "the file is empty")),
            _ => {
                let what = "it is none of PNG, JPEG, EXR and Radiance HDR; save it as one of them";
                return Err(Error::file(path, "read", what));
            }
        };
        match layer {
            None => srgb_read::read(path, png, is_data),
            Some(layer) => {
                let kind = if png { "PNG" } else { "JPEG" };
                Err(Error::file(path, "read", format!("it is a {kind} file, which has no layers, nor `{layer}`")))
            }
        }
    }
}

impl Image {
    /// The picture of [`FilePicture::read`] alone.
    ///
    /// # Errors
    /// As there.
    pub fn read_exr(path: &Path) -> Result<Self> {
        Self::read_exr_layer(path, None)
    }

    /// The same of the layer `layer`.
    ///
    /// # Errors
    /// As [`FilePicture::read`].
    pub fn read_exr_layer(path: &Path, layer: Option<&str>) -> Result<Self> {
        FilePicture::read(path, layer).map(|read| read.image)
    }
}
