//! Signed numbers as colours: blue below zero, white at zero, red above; told apart by colour-blind readers and in grey
//! prints by the numbers on the bar.

use crate::film::Image;
use crate::math::Rgb;
use std::fmt::Write as _;

/// Dark blue, blue, white, orange, dark red in sRGB, at -1, -1/2, 0, 1/2, 1 [after the scale RdBu of ColorBrewer].
const STOPS: [[f32; 3]; 5] =
    [[5.0, 48.0, 97.0], [67.0, 147.0, 195.0], [247.0, 247.0, 247.0], [214.0, 96.0, 77.0], [103.0, 0.0, 31.0]];

/// The colour of `t` in sRGB, 0..255; beyond -1..1 the ends.
fn colour(t: f32) -> [f32; 3] {
    let t = if t.is_nan() { 0.0 } else { t.clamp(-1.0, 1.0) };
    let at = (t + 1.0) * 2.0;
    let i = (at as usize).min(3);
    std::array::from_fn(|c| STOPS[i][c] + (at - i as f32) * (STOPS[i + 1][c] - STOPS[i][c]))
}

/// sRGB 0..255 to linear, so that a PNG of the picture has the colour.
fn linear(srgb: [f32; 3]) -> Rgb {
    Rgb(srgb.map(|v| {
        let v = v / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    }))
}

/// The mean of the three channels of `image` as colours; `range` is where they end.
pub fn false_colours(image: &Image, range: f32) -> Image {
    let pixel = |p: &Rgb| linear(colour((p[0] + p[1] + p[2]) / (3.0 * range)));
    Image { resolution: image.resolution, window: image.window, pixels: image.pixels.iter().map(pixel).collect() }
}

/// The bar of the colours as SVG, labelled in percent.
pub fn colour_bar(range: f32) -> String {
    let mut out = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 58\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\">\n",
    );
    out.push_str("<defs><linearGradient id=\"bar\">");
    for (i, [r, g, b]) in STOPS.into_iter().enumerate() {
        let _ = write!(out, "<stop offset=\"{}%\" stop-color=\"rgb({r:.0},{g:.0},{b:.0})\"/>", 25 * i);
    }
    out.push_str("</linearGradient></defs>\n<rect x=\"20\" y=\"6\" width=\"600\" height=\"22\" fill=\"url(#bar)\"/>\n");
    for i in 0..5 {
        let value = range * 100.0 * (i as f32 / 2.0 - 1.0);
        let sign = if value > 0.0 { "+" } else { "" };
        let (x, anchor) = (20.0 + 150.0 * i as f32, ["start", "middle", "middle", "middle", "end"][i]);
        let label = format!("{sign}{}", round(value)).replace('-', "−");
        let _ = writeln!(out, "<text x=\"{x}\" y=\"46\" text-anchor=\"{anchor}\" fill=\"#222222\">{label} %</text>");
    }
    out.push_str("</svg>");
    out
}

fn round(value: f32) -> String {
    if (value - value.round()).abs() < 1e-3 { format!("{value:.0}") } else { format!("{value:.1}") }
}

/// 1, 2 or 5 times a power of ten, at least the share 0.99 of the absolute values (means of the channels) in `images`.
pub fn common_range<'a>(images: impl IntoIterator<Item = &'a Image>) -> f32 {
    let mut values: Vec<f32> = images
        .into_iter()
        .flat_map(|image| image.pixels.iter().map(|p| ((p[0] + p[1] + p[2]) / 3.0).abs()))
        .filter(|v| v.is_finite())
        .collect();
    values.sort_by(f32::total_cmp);
    let wanted = values.get(values.len() * 99 / 100).copied().unwrap_or(0.0).clamp(1e-3, 1e3);
    let power = 10_f32.powf(wanted.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|&v| v >= wanted * 0.999).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_is_white_and_the_sign_has_its_side() {
        assert_eq!(colour(0.0), STOPS[2]);
        assert_eq!(colour(-7.0), STOPS[0]);
        assert_eq!(colour(1.0), STOPS[4]);
        let [r, _, b] = colour(0.5);
        assert!(r > b);
        assert_eq!(colour(f32::NAN), STOPS[2]);
    }

    #[test]
    fn the_range_is_a_round_number_that_holds_almost_all() {
        let image = Image::from_fn([10, 10], |x, y| Rgb::splat((x + 10 * y) as f32 * 0.001));
        assert!((common_range([&image]) - 0.1).abs() < 1e-6);
        assert!(colour_bar(0.1).contains("+10 %") && colour_bar(0.1).contains("−10 %"));
    }
}
