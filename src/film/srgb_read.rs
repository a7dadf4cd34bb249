//! Reading PNG and JPEG, which are taken as sRGB: pictures that were painted or photographed, for textures.

use super::{FilePicture, Image, Window};
use crate::math::Rgb;
use crate::{Error, Result, input, memory};
use std::io::Cursor;
use std::path::Path;

/// Bytes of samples that one byte of file may stand for: Deflate packs 1032 into one; of JPEG a block of 8 x 8 takes a few bits.
const MOST_COMPRESSION: u128 = 2048;

/// The linear value of a code in [0, 1]: the piecewise curve of sRGB [IEC61966-2-1].
fn linear(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

/// A picture as it is in the file: codes in rows from the top down.
struct Codes {
    resolution: [u32; 2],
    /// Codes of each pixel: grey, grey and alpha, RGB, RGBA.
    channels: usize,
    bytes: Vec<u8>,
    /// 16 bits each, the higher byte first.
    wide: bool,
    remarks: Vec<String>,
}

/// See [`FilePicture::read_texture`].
pub(super) fn read(path: &Path, png: bool, is_data: bool) -> Result<FilePicture> {
    let linear = |code: f64| if is_data { code } else { linear(code) };
    let bytes = input::read_all(path, 1)?;
    let codes = if png { read_png(path, &bytes) } else { read_jpeg(path, &bytes) }?;
    let table: Vec<f32> = (0..256).map(|code| linear(f64::from(code) / 255.0) as f32).collect();
    let value = |i: usize| match codes.wide {
        false => table[usize::from(codes.bytes[i])],
        true => {
            let code = u16::from_be_bytes([codes.bytes[2 * i], codes.bytes[2 * i + 1]]);
            linear(f64::from(code) / 65535.0) as f32
        }
    };
    let (n, grey) = (codes.channels, codes.channels < 3);
    let window = Window::full(codes.resolution);
    let pixel = |p: usize| Rgb::from_fn(|c| value(n * p + if grey { 0 } else { c }));
    let pixels = (0..window.area()).map(pixel).collect();
    let mut remarks = codes.remarks;
    if codes.channels % 2 == 0 {
        remarks.push("its alpha is ignored".into());
    }
    Ok(FilePicture { image: Image { resolution: codes.resolution, window, pixels }, remarks, cube: false })
}

/// Whether a picture so large can be in the file, and has a place in memory.
fn check(path: &Path, [width, height]: [u32; 2], per_pixel: usize, length: usize) -> Result<()> {
    let area = u128::from(width) * u128::from(height);
    if area * per_pixel as u128 > length as u128 * MOST_COMPRESSION {
        return Err(Error::file(path, "read", "the file is cut short or damaged: it is too small for its picture"));
    }
    // Codes, what a decoder has besides, and the picture.
    let needed = area * (4 * per_pixel + size_of::<Rgb>()) as u128;
    memory::require(needed, memory::available(), &format!("{}: reading it", path.display()), "use a smaller picture")
}

fn read_png(path: &Path, bytes: &[u8]) -> Result<Codes> {
    let failed = |e: png::DecodingError| {
        let what = match e {
            png::DecodingError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => "is cut short".into(),
            e => format!("is damaged: {e}"),
        };
        Error::file(path, "read", format!("the file {what}"))
    };
    let limits = png::Limits { bytes: memory::available().map_or(usize::MAX, |b| b as usize) };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    let mut reader = decoder.read_info().map_err(failed)?;
    let (colour, depth) = reader.output_color_type();
    let (channels, wide) = (colour.samples(), depth == png::BitDepth::Sixteen);
    let resolution = [reader.info().width, reader.info().height];
    check(path, resolution, channels * if wide { 2 } else { 1 }, bytes.len())?;
    let mut remarks = Vec::new();
    let (gamma, srgb) = (reader.info().gama_chunk.map(|gamma| gamma.into_value()), reader.info().srgb.is_some());
    if let Some(gamma) = gamma.filter(|gamma| !srgb && (gamma - 1.0 / 2.2).abs() > 0.01) {
        remarks.push(format!("it has a gamma of its own ({gamma}), which is not heeded: it is taken as sRGB"));
    }
    let size = reader.output_buffer_size().ok_or_else(|| Error::file(path, "read", "it is too large"))?;
    let mut codes = vec![0; size];
    reader.next_frame(&mut codes).map_err(failed)?;
    Ok(Codes { resolution, channels, bytes: codes, wide, remarks })
}

fn read_jpeg(path: &Path, bytes: &[u8]) -> Result<Codes> {
    use jpeg_decoder::PixelFormat as F;
    let failed = |e: jpeg_decoder::Error| {
        let what = match e {
            jpeg_decoder::Error::Io(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                "the file is cut short".into()
            }
            jpeg_decoder::Error::Unsupported(what) => format!("not supported: {what:?}; save it as PNG"),
            e => format!("the file is damaged: {e}"),
        };
        Error::file(path, "read", what)
    };
    let mut decoder = jpeg_decoder::Decoder::new(Cursor::new(bytes));
    decoder.read_info().map_err(failed)?;
    let info = decoder.info().ok_or_else(|| Error::file(path, "read", "the file has no picture"))?;
    let (channels, wide) = match info.pixel_format {
        F::L8 => (1, false),
        F::L16 => (1, true),
        F::RGB24 => (3, false),
        F::CMYK32 => return Err(Error::file(path, "read", "it is in inks (CMYK); save it as RGB")),
    };
    let resolution = [info.width.into(), info.height.into()];
    check(path, resolution, channels, bytes.len())?;
    decoder.set_max_decoding_buffer_size(usize::MAX);
    let mut codes = decoder.decode().map_err(failed)?;
    if wide {
        // The decoder's are in the order of the machine.
        codes.chunks_exact_mut(2).for_each(|pair| {
            let code = u16::from_ne_bytes([pair[0], pair[1]]).to_be_bytes();
            pair.copy_from_slice(&code);
        });
    }
    Ok(Codes { resolution, channels, bytes: codes, wide, remarks: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::png_file::srgb_code;

    #[test]
    fn codes_are_decoded_by_the_curve_of_srgb() {
        assert!((linear(128.0 / 255.0) - 0.215_860_5).abs() < 1e-6);
        assert_eq!([linear(0.0), linear(1.0)], [0.0, 1.0]);
        for code in 0..=255_u8 {
            assert_eq!(srgb_code(linear(f64::from(code) / 255.0)), code);
        }
    }
}
