//! Writing OpenEXR: linear `f32` channels by name, and what they are in attributes.

use super::{Image, Window};
use crate::{Error, Result};
use exr::prelude as exr;
use std::collections::BTreeMap;
use std::io::Cursor;

/// A fact about a picture, in the file's own header. Names without a colon are shared with other programs; our
/// own start with `marmor:`.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// UTF-8 text, of any length.
    Text(String),
    /// A whole number. Written as decimal digits in a text: EXR's own integers end at 2^31.
    Count(u64),
    /// A number.
    Number(f64),
}

/// A picture beside the main one in an EXR file, such as `NAME.R`, `NAME.G`, `NAME.B`.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Before the dot; without a name there is no dot.
    pub name: String,
    /// What stands after the dot, one to three of the picture's channels.
    pub channels: &'static [&'static str],
    /// Of the same window as the main picture.
    pub image: Image,
}

/// What a picture's file says about itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Samples per pixel: attribute `samplesPerPixel`.
    pub samples_per_pixel: u32,
    /// Time spent on the picture \[s\]: attribute `renderTimeSeconds`. Left out where `created` is set, for such
    /// files are meant to be the same every time.
    pub render_seconds: Option<f64>,
    /// When the picture was made [s since 1970, UTC]: attribute `capDate`. See [`source_date_epoch`].
    pub created: Option<u64>,
    /// Further attributes by name, such as `marmor:seed`.
    pub attributes: Vec<(String, Attribute)>,
}

/// A plane of samples with its full name: `R`, or `sss.R` in a layer.
pub(super) struct Channel {
    pub name: String,
    /// One per pixel of the window, in row-major order.
    pub samples: Vec<f32>,
}

/// The environment's `SOURCE_DATE_EPOCH` [s since 1970]: the only time that our files may carry. None if unset or
/// not a whole number.
pub fn source_date_epoch() -> Option<u64> {
    std::env::var("SOURCE_DATE_EPOCH").ok()?.trim().parse().ok()
}

/// Name and version of this program, as its files give it.
pub(super) fn software() -> String {
    concat!("marmor ", env!("CARGO_PKG_VERSION")).into()
}

/// The channels of `image`: `R`, `G`, `B`.
pub(super) fn channels(image: &Image) -> Vec<Channel> {
    planes(image, &["R", "G", "B"], str::to_string)
}

/// The channels of a layer.
pub(super) fn layer_channels(layer: &Layer) -> Vec<Channel> {
    let name = |c: &str| if layer.name.is_empty() { c.to_string() } else { format!("{}.{c}", layer.name) };
    planes(&layer.image, layer.channels, name)
}

fn planes(image: &Image, channels: &[&str], name: impl Fn(&str) -> String) -> Vec<Channel> {
    let plane = |c: usize| image.pixels.iter().map(|pixel| pixel[c]).collect();
    channels.iter().take(3).enumerate().map(|(c, channel)| Channel { name: name(channel), samples: plane(c) }).collect()
}

/// The bytes of an EXR file of one part: scan lines, ZIP over 16 lines (lossless). The same arguments give the
/// same bytes. `resolution` becomes the display window, `window` the data window.
///
/// # Errors
/// Usage for an attribute or a size that EXR cannot hold.
pub(super) fn encode(
    resolution: [u32; 2],
    window: Window,
    channels: Vec<Channel>,
    metadata: &Metadata,
) -> Result<Vec<u8>> {
    let limit = (i32::MAX / 2) as u32;
    if resolution.iter().any(|&n| n >= limit) {
        return Err(Error::usage(format!("an EXR file holds less than {limit} pixels in a row or column")));
    }
    let size = |w: u32, h: u32| exr::Vec2(w as usize, h as usize);
    let mut shared = exr::ImageAttributes::with_size(size(resolution[0], resolution[1]));
    shared.pixel_aspect = 1.0;
    let mut own = exr::LayerAttributes {
        layer_position: exr::Vec2(window.x0 as i32, window.y0 as i32),
        software_name: Some(text(&software())),
        ..Default::default()
    };
    if let Some(seconds) = metadata.created {
        own.capture_date = Some(text(&date(seconds)));
        own.utc_offset = Some(0.0);
    }
    own.other = attributes(metadata)?;
    let planes = channels.into_iter().map(|c| exr::AnyChannel::new(text(&c.name), exr::FlatSamples::F32(c.samples)));
    let encoding = exr::Encoding {
        compression: exr::Compression::ZIP16,
        blocks: exr::Blocks::ScanLines,
        line_order: exr::LineOrder::Increasing,
    };
    let data_size = exr::Vec2(window.width(), window.height());
    let layer = exr::Layer::new(data_size, own, encoding, exr::AnyChannels::sort(planes.collect()));
    let mut bytes = Vec::new();
    // One thread: the crate's own pool would not heed `--threads`.
    exr::WritableImage::write(&exr::Image::new(shared, layer))
        .non_parallel()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|e| Error::usage(format!("cannot make an EXR file of this picture: {e}")))?;
    sort_attributes(&mut bytes)
        .ok_or_else(|| Error::usage("cannot make an EXR file: its header is not as expected"))?;
    Ok(bytes)
}

type Attributes = std::collections::HashMap<exr::Text, exr::AttributeValue>;

fn attributes(metadata: &Metadata) -> Result<Attributes> {
    let samples = i32::try_from(metadata.samples_per_pixel).unwrap_or(i32::MAX);
    let mut all = Attributes::new();
    all.insert(text("samplesPerPixel"), exr::AttributeValue::I32(samples));
    if let (Some(seconds), None) = (metadata.render_seconds, metadata.created) {
        all.insert(text("renderTimeSeconds"), exr::AttributeValue::F32(seconds as f32));
    }
    for (name, value) in &metadata.attributes {
        if name.is_empty() || name.len() > 255 || name.contains('\0') {
            return Err(Error::usage(format!("EXR attribute `{name}`: a name has 1 to 255 bytes, none of them zero")));
        }
        let value = match value {
            Attribute::Text(value) => exr::AttributeValue::Text(text(value)),
            Attribute::Count(value) => exr::AttributeValue::Text(text(&value.to_string())),
            Attribute::Number(value) => exr::AttributeValue::F64(*value),
        };
        if all.insert(text(name), value).is_some() {
            return Err(Error::usage(format!("EXR attribute `{name}` is given twice")));
        }
    }
    Ok(all)
}

/// UTF-8, as other programs take EXR strings; the crate's own conversion would refuse what is not Latin-1.
fn text(s: &str) -> exr::Text {
    exr::Text::from_slice_unchecked(s.as_bytes())
}

/// `YYYY:MM:DD hh:mm:ss` in UTC, the form of `capDate`.
fn date(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // Days from 0000-03-01 in eras of 400 years = 146097 days; years start in March, so that leap days come last.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let (day, month) = (day - (153 * month + 2) / 5 + 1, if month < 10 { month + 3 } else { month - 9 });
    let year = era * 400 + year + u64::from(month <= 2);
    format!("{year:04}:{month:02}:{day:02} {:02}:{:02}:{:02}", second / 3600, second / 60 % 60, second % 60)
}

/// Puts the header's attributes in order of their names. The crate keeps them in a hash map, whose order changes
/// from run to run; the header's length, and so every offset after it, stays. None if the header is not one.
fn sort_attributes(bytes: &mut [u8]) -> Option<()> {
    const AFTER_MAGIC_AND_VERSION: usize = 8;
    let mut sorted = BTreeMap::new();
    let mut at = AFTER_MAGIC_AND_VERSION;
    while *bytes.get(at)? != 0 {
        let name = at..terminated(bytes, at)?;
        let kind_end = terminated(bytes, name.end)?;
        let length = u32::from_le_bytes(bytes.get(kind_end..kind_end + 4)?.try_into().ok()?);
        let end = kind_end + 4 + length as usize;
        sorted.insert(bytes[name].to_vec(), bytes.get(at..end)?.to_vec());
        at = end;
    }
    let header = sorted.into_values().flatten().collect::<Vec<_>>();
    bytes.get_mut(AFTER_MAGIC_AND_VERSION..at)?.copy_from_slice(&header);
    Some(())
}

/// The position after the zero that ends the string at `start`.
fn terminated(bytes: &[u8], start: usize) -> Option<usize> {
    bytes.get(start..)?.iter().position(|&b| b == 0).map(|length| start + length + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(date(0), "1970:01:01 00:00:00");
        assert_eq!(date(951_782_399), "2000:02:28 23:59:59"); // `date -u -d @951782399`
        assert_eq!(date(951_782_400), "2000:02:29 00:00:00");
        assert_eq!(date(1_704_067_199), "2023:12:31 23:59:59");
        assert_eq!(date(4_107_542_400), "2100:03:01 00:00:00");
    }

    #[test]
    fn the_same_picture_has_the_same_bytes_with_any_number_of_attributes_and_layers() {
        let image = Image::from_fn([33, 17], |x, y| Rgb([x as f32 * 0.1, y as f32, 1e-3]));
        let bytes = || {
            let attributes = (0..40).map(|i| (format!("marmor:a{i}"), Attribute::Count(i))).collect();
            let metadata = Metadata { samples_per_pixel: 4, attributes, ..Default::default() };
            let layer = Layer { name: "sss".into(), channels: &["R", "G"], image: image.clone() };
            let planes = channels(&image).into_iter().chain(layer_channels(&layer)).collect();
            encode(image.resolution, image.window, planes, &metadata).unwrap()
        };
        assert_eq!(bytes(), bytes());
    }
}
