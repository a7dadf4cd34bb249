//! PNG: 8 bits per channel for looking at, by a fixed curve.

use super::Image;
use serde::Serialize;
use std::io::Write;

/// Channel values that 8 bits could not hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PngReport {
    /// Above 1 after exposure; written as 255. Infinity is among them.
    pub above_one: u64,
    /// Below 0; written as 0.
    pub below_zero: u64,
    /// Not numbers; written as 0.
    pub nan: u64,
}

/// The 8-bit code of a linear value: the piecewise curve of sRGB [IEC61966-2-1], rounded to the nearest code.
/// Values outside 0..1 take the nearest end; NaN takes 0.
pub(super) fn srgb_code(linear: f64) -> u8 {
    let linear = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

/// Writes the pixels of `image`'s window, scaled by 2^`exposure`.
pub(super) fn encode(image: &Image, exposure: f64, to: impl Write) -> Result<PngReport, png::EncodingError> {
    let mut report = PngReport::default();
    let scale = exposure.exp2();
    let mut codes = Vec::with_capacity(image.pixels.len() * 3);
    for value in image.pixels.iter().flat_map(|pixel| pixel.0) {
        let value = f64::from(value) * scale;
        report.above_one += u64::from(value > 1.0);
        report.below_zero += u64::from(value < 0.0);
        report.nan += u64::from(value.is_nan());
        codes.push(srgb_code(value));
    }
    let mut encoder = png::Encoder::new(to, image.window.width() as u32, image.window.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    encoder.add_text_chunk("Software".into(), super::exr_file::software())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&codes)?;
    writer.finish()?;
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_agree_with_values_worked_out_by_hand() {
        // 0.5 -> 1.055 * 0.5^(1/2.4) - 0.055 = 0.735357 -> 187.516; 0.18 -> 0.461356 -> 117.646;
        // 0.001 -> 0.01292 -> 3.295; 0.0031308 -> 0.040450 -> 10.315; 0.9 -> 0.954687 -> 243.445.
        let known = [(0.0, 0), (0.001, 3), (0.003_130_8, 10), (0.18, 118), (0.5, 188), (0.9, 243), (1.0, 255)];
        for (linear, code) in known {
            assert_eq!(srgb_code(linear), code, "{linear}");
        }
        assert_eq!([srgb_code(-1.0), srgb_code(7.0), srgb_code(f64::INFINITY), srgb_code(f64::NAN)], [0, 255, 255, 0]);
    }

    #[test]
    fn every_code_is_the_nearest_to_its_own_value() {
        for code in 0..=255_u8 {
            let s = f64::from(code) / 255.0;
            let linear = if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
            assert_eq!(srgb_code(linear), code);
        }
    }
}
