//! Reading OpenEXR of any layout: scan lines or tiles, half or float, one part or several, with layers or without, in any
//! primaries.

use super::exr_header::unreadable;
use super::exr_layers::{Choice, choose};
use super::primaries::Primaries;
use super::{Attribute, FilePicture, Image, Window};
use crate::math::Rgb;
use crate::words::counted;
use crate::{Error, ErrorKind, Result, input, memory};
use ::exr::image::FlatSamples;
use exr::prelude as exr;
use exr::{ReadChannels, ReadLayers};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Bytes of samples that one byte of file may stand for.
const MOST_COMPRESSION: u128 = 2048;

/// The largest finite number of 16 bits.
const LARGEST_HALF: f32 = 65504.0;

/// See [`FilePicture::read`].
pub(super) fn read(path: &Path, layer: Option<&str>) -> Result<FilePicture> {
    let meta = read_meta(path)?;
    let bytes = meta.headers.iter().map(|h| h.layer_size.0 as u128 * h.layer_size.1 as u128 * pixel_bytes(h)).sum();
    // No compression of EXR is better than this: a short file cannot ask for much memory.
    let length = std::fs::metadata(path).map_or(0, |m| m.len());
    if bytes > u128::from(length) * MOST_COMPRESSION {
        return Err(Error::file(path, "read", "the file is cut short or damaged: it is too small for its picture"));
    }
    let what = format!("{}: reading it", path.display());
    memory::require(bytes, memory::available(), &what, "use a smaller picture")?;
    let Choice { layer: chosen, remark } = choose(&meta.headers, layer)
        .map_err(|why| if why.is_empty() { no_channels(path, layer, &meta) } else { Error::file(path, "read", why) })?;
    let mut remarks: Vec<String> = remark.into_iter().collect();

    let all = exr::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_unbuffered(open(path)?)
        .map_err(|e| read_error(path, e))?;
    let display = all.attributes.display_window;
    let read = all
        .layer_data
        .iter()
        .find(|l| {
            l.attributes.layer_name == chosen.part
                && chosen.channels.iter().all(|n| l.channel_data.list.iter().any(|c| c.name.as_slice() == n))
        })
        .ok_or_else(|| no_channels(path, layer, &meta))?;
    let mut cut_off = 0_usize;
    let mut plane = |name: &Vec<u8>| -> Result<Vec<f32>> {
        let channel = read.channel_data.list.iter().find(|c| c.name.as_slice() == name);
        let samples = &channel.ok_or_else(|| no_channels(path, layer, &meta))?.sample_data;
        if samples.len() != read.size.area() {
            return Err(Error::file(path, "read", "it has subsampled channels, which are not supported"));
        }
        let values: Vec<f32> = samples.values_as_f32().collect();
        if matches!(samples, FlatSamples::F16(_)) {
            cut_off += values.iter().filter(|v| **v >= LARGEST_HALF).count();
        }
        Ok(values)
    };
    let planes = chosen.channels.iter().map(&mut plane).collect::<Result<Vec<_>>>()?;
    if cut_off > 0 {
        remarks.push(format!(
            "{} {LARGEST_HALF} or infinite, the end of its 16-bit numbers: what was brighter, a sun perhaps, was \
             cut off when it was saved; save it with 32-bit floats",
            counted(cut_off, "value is", "values are")
        ));
    }
    let conversion = match all.attributes.chromaticities {
        None => None,
        Some(c) => Primaries([c.red, c.green, c.blue, c.white].map(|v| [decimal(v.0), decimal(v.1)]))
            .to_rec709()
            .map_err(|why| Error::file(path, "read", why))?,
    };
    // A grey is white in its own primaries, which stays white.
    let conversion = conversion.filter(|_| planes.len() == 3).map(|(conversion, name)| {
        remarks.push(format!("its primaries are {name}; converted to those of Rec. 709"));
        conversion
    });
    if (all.attributes.pixel_aspect - 1.0).abs() > 1e-3 {
        remarks
            .push(format!("its pixels are {} times as wide as high, which is not heeded", all.attributes.pixel_aspect));
    }
    let pixel = |i: usize| {
        let rgb = Rgb::from_fn(|c| planes[c.min(planes.len() - 1)][i]);
        conversion.map_or(rgb, |conversion| conversion.apply(rgb))
    };
    let image = place(path, display, read.absolute_bounds(), pixel)?;
    let cube = read.attributes.environment_map == Some(::exr::meta::attribute::EnvironmentMap::Cube);
    Ok(FilePicture { image, remarks, cube })
}

/// The decimal number that was meant: chromaticities are typed with a few digits, and stored in 32 bits.
fn decimal(value: f32) -> f64 {
    (f64::from(value) * 1e6).round() / 1e6
}

/// The attributes of an EXR file's first part that hold a text or a number, by name; `marmor:*` among them.
///
/// # Errors
/// File, as [`Image::read_exr`].
pub fn read_attributes(path: &Path) -> Result<BTreeMap<String, Attribute>> {
    let meta = read_meta(path)?;
    let plain = |value: exr::AttributeValue| match value {
        exr::AttributeValue::Text(t) => Some(Attribute::Text(String::from_utf8_lossy(t.as_slice()).into_owned())),
        exr::AttributeValue::I32(v) => Some(Attribute::Number(v.into())),
        exr::AttributeValue::F32(v) => Some(Attribute::Number(v.into())),
        exr::AttributeValue::F64(v) => Some(Attribute::Number(v)),
        _ => None,
    };
    let first = meta.headers.first().into_iter();
    let named = first.flat_map(|h| h.all_named_attributes().map(|(n, v)| (String::from_utf8_lossy(n).into_owned(), v)));
    Ok(named.filter_map(|(name, value)| Some((name, plain(value)?))).collect())
}

fn open(path: &Path) -> Result<File> {
    input::open(path).map(|(file, _)| file)
}

/// The first bytes of a file, as many as tell its kind.
pub(super) fn first_bytes(path: &Path) -> Result<Vec<u8>> {
    let mut start = Vec::new();
    open(path)?.take(4).read_to_end(&mut start).map_err(|e| Error::file(path, "read", e))?;
    Ok(start)
}

fn read_meta(path: &Path) -> Result<exr::MetaData> {
    const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
    let start = first_bytes(path)?;
    if start != MAGIC {
        let what = match start.as_slice() {
            [] => "the file is empty",
            [0x89, b'P', b'N', b'G'] => "it is a PNG file; an EXR or Radiance HDR file is needed",
            [0xff, 0xd8, ..] => "it is a JPEG file; an EXR or Radiance HDR file is needed",
            [b'I', b'I', 42, 0] | [b'M', b'M', 0, 42] => "it is a TIFF file; an EXR or Radiance HDR file is needed",
            _ => "it is not an EXR file, nor a Radiance HDR file",
        };
        return Err(Error::file(path, "read", what));
    }
    if let Some(why) = unreadable(&mut BufReader::new(open(path)?)) {
        return Err(Error::file(path, "read", why));
    }
    exr::MetaData::read_from_buffered(BufReader::new(open(path)?), false).map_err(|e| read_error(path, e))
}

/// What `error` says to someone who does not know the crate.
fn read_error(path: &Path, error: exr::Error) -> Error {
    match error {
        exr::Error::Io(e) => Error::file(path, "read", e),
        exr::Error::NotSupported(what) => Error::file(path, "read", format!("not supported: {what}")),
        exr::Error::Invalid(what) if what.contains("missing bytes") => {
            Error::file(path, "read", "the file is cut short or damaged")
        }
        exr::Error::Invalid(what) => Error::file(path, "read", format!("the file is damaged: {what}")),
        exr::Error::Aborted => Error::file(path, "read", "stopped"),
    }
}

fn pixel_bytes(header: &::exr::meta::header::Header) -> u128 {
    header.channels.bytes_per_pixel as u128
}

fn no_channels(path: &Path, layer: Option<&str>, meta: &exr::MetaData) -> Error {
    let wanted = layer.map_or("R, G, B".to_string(), |l| format!("{l}.R, {l}.G, {l}.B"));
    let present = meta
        .headers
        .iter()
        .flat_map(|h| &h.channels.list)
        .map(|c| String::from_utf8_lossy(c.name.as_slice()).into_owned())
        .collect::<Vec<_>>()
        .join(", ");
    Error::file(path, "read", format!("it has no channels {wanted}, only {present}"))
}

/// An image of those pixels that lie in the display window, whose upper left corner becomes (0, 0).
fn place(
    path: &Path,
    display: exr::IntegerBounds,
    data: exr::IntegerBounds,
    pixel: impl Fn(usize) -> Rgb,
) -> Result<Image> {
    let side = |n: usize| {
        u32::try_from(n).map_err(|_| Error::new(ErrorKind::File, format!("{}: damaged display window", path.display())))
    };
    let resolution = [side(display.size.0)?, side(display.size.1)?];
    let shift = |data: i32, display: i32| i64::from(data) - i64::from(display);
    let (dx, dy) = (shift(data.position.0, display.position.0), shift(data.position.1, display.position.1));
    let inside = |at: i64, end: u32| at.clamp(0, i64::from(end)) as u32;
    let window = Window {
        x0: inside(dx, resolution[0]),
        y0: inside(dy, resolution[1]),
        x1: inside(dx + data.size.0 as i64, resolution[0]),
        y1: inside(dy + data.size.1 as i64, resolution[1]),
    };
    if window.is_empty() {
        return Err(Error::file(path, "read", "no pixel of it lies in its display window"));
    }
    let index = |[x, y]: [u32; 2]| (i64::from(y) - dy) as usize * data.size.0 + (i64::from(x) - dx) as usize;
    let pixels = (0..window.area()).map(|i| pixel(index(window.pixel(i)))).collect();
    Ok(Image { resolution, window, pixels })
}
