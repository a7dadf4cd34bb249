//! Reading Radiance HDR (`.hdr`, `.pic`): RGBE and XYZE, flat or with either run-length code, in any orientation. Our own,
//! since the crate `image` refuses XYZE and all orientations but one, and leaves the exposure in.

use super::primaries::{Conversion, Primaries, XYZ};
use super::{FilePicture, Image, Window};
use crate::math::Rgb;
use crate::{Error, Result, input, memory};
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// Longest line of a header, and of all of it.
const MOST_LINE: u64 = 1 << 16;
const MOST_HEADER: usize = 1 << 20;

/// Lumens per watt by which XYZE files stand above RGBE ones.
const EFFICACY: f64 = 179.0;

/// See [`FilePicture::read`].
pub(super) fn read(path: &Path, layer: Option<&str>) -> Result<FilePicture> {
    let failed = |why: String| Error::file(path, "read", why);
    if let Some(layer) = layer {
        return Err(failed(format!("it is a Radiance HDR file, which has no layers, nor `{layer}`")));
    }
    let mut reader = BufReader::new(input::open(path)?.0);
    let header = Header::read(&mut reader).map_err(failed)?;
    let area = u128::from(header.lines) * u128::from(header.length);
    let what = format!("{}: reading it", path.display());
    memory::require(2 * area * size_of::<Rgb>() as u128, memory::available(), &what, "use a smaller picture")?;
    let (conversion, mut remarks) = header.conversion().map_err(failed)?;

    let factor = header.factors.map(|f| 1.0 / f);
    // Grows with what is read, so that a short file cannot ask for much.
    let mut stored: Vec<Rgb> = Vec::new();
    let mut line = vec![[0_u8; 4]; header.length as usize];
    for n in 0..header.lines {
        scan_line(&mut reader, &mut line).map_err(|e| {
            let what = if e.kind() == io::ErrorKind::UnexpectedEof { "is cut short" } else { "is damaged" };
            failed(format!("the file {what} in line {n} of its {} lines of pixels", header.lines))
        })?;
        stored.extend(line.iter().map(|code| {
            let value = radiance(*code);
            let rgb = Rgb::from_fn(|c| (value[c] * factor[c]) as f32);
            conversion.map_or(rgb, |conversion| conversion.apply(rgb))
        }));
    }
    if header.factors != [1.0; 3] {
        let [r, g, b] = header.factors;
        let by = if r == g && g == b { format!("{r}") } else { format!("{r}, {g}, {b}") };
        remarks.push(format!("its values were divided by the exposure that it names ({by})"));
    }
    let resolution = header.resolution();
    let at = |i: usize| stored[header.place(Window::full(resolution).pixel(i))];
    let pixels = (0..stored.len()).map(at).collect();
    let image = Image { resolution, window: Window::full(resolution), pixels };
    Ok(FilePicture { image, remarks, cube: false })
}

/// What is in the lines before the pixels.
struct Header {
    xyz: bool,
    /// What the radiance was multiplied by.
    factors: [f64; 3],
    primaries: Option<Primaries>,
    aspect: f64,
    /// Lines of the header that say how the picture is to be seen or taken, as they are written.
    ignored: Vec<String>,
    /// Lines of pixels, and pixels in each.
    lines: u32,
    length: u32,
    /// Lines are columns of the picture.
    columns: bool,
    /// From right to left, and from the bottom up.
    leftwards: bool,
    upwards: bool,
}

impl Header {
    fn read(reader: &mut impl BufRead) -> std::result::Result<Self, String> {
        let mut header = Self {
            xyz: false,
            factors: [1.0; 3],
            primaries: None,
            aspect: 1.0,
            ignored: Vec::new(),
            lines: 0,
            length: 0,
            columns: false,
            leftwards: false,
            upwards: false,
        };
        let mut read = 0;
        loop {
            let text = text_line(reader)?;
            read += text.len() + 1;
            if read > MOST_HEADER {
                return Err("its header has no end; is it a Radiance HDR file?".into());
            }
            if text.is_empty() {
                break;
            }
            // Lines that begin with a blank are those of pictures that this one was made from.
            if let Some((name, value)) = text.split_once('=') {
                header.take(name, value.trim()).map_err(|()| format!("its header has `{}`", shown(&text)))?;
            }
        }
        header.size(&text_line(reader)?)?;
        Ok(header)
    }

    fn take(&mut self, name: &str, value: &str) -> std::result::Result<(), ()> {
        let numbers = || {
            let all = value.split_whitespace().map(str::parse::<f64>).collect::<std::result::Result<Vec<_>, _>>();
            all.map_err(|_| ())
        };
        let factor = |f: f64| if f.is_finite() && f > 0.0 { Ok(f) } else { Err(()) };
        match name {
            "FORMAT" => match value {
                "32-bit_rle_rgbe" => self.xyz = false,
                "32-bit_rle_xyze" => self.xyz = true,
                _ => return Err(()),
            },
            "EXPOSURE" => {
                let [by] = numbers()?[..] else { return Err(()) };
                let by = factor(by)?;
                self.factors = self.factors.map(|f| f * by);
            }
            "COLORCORR" => {
                let [r, g, b] = numbers()?[..] else { return Err(()) };
                for (f, by) in self.factors.iter_mut().zip([r, g, b]) {
                    *f *= factor(by)?;
                }
            }
            "PRIMARIES" => {
                let [rx, ry, gx, gy, bx, by, wx, wy] = numbers()?[..] else { return Err(()) };
                self.primaries = Some(Primaries([[rx, ry], [gx, gy], [bx, by], [wx, wy]]));
            }
            "PIXASPECT" => {
                let [aspect] = numbers()?[..] else { return Err(()) };
                self.aspect *= factor(aspect)?;
            }
            "GAMMA" | "VIEW" => self.ignored.push(shown(&format!("{name}={value}"))),
            _ => {}
        }
        self.factors.iter().try_for_each(|&f| factor(f).map(drop))
    }

    /// The line that ends the header: `-Y 512 +X 1024`.
    fn size(&mut self, text: &str) -> std::result::Result<(), String> {
        let wrong =
            || format!("its size is `{}`; expected `-Y HEIGHT +X WIDTH`, or other signs and order", shown(text));
        let words: Vec<&str> = text.split_whitespace().collect();
        let [first, lines, second, length] = words[..] else { return Err(wrong()) };
        let number = |word: &str| word.parse::<u32>().ok().filter(|n| (1..=1 << 20).contains(n)).ok_or_else(wrong);
        (self.lines, self.length) = (number(lines)?, number(length)?);
        self.columns = matches!((first, second), ("+X" | "-X", "+Y" | "-Y"));
        if !self.columns && !matches!((first, second), ("+Y" | "-Y", "+X" | "-X")) {
            return Err(wrong());
        }
        self.leftwards = [first, second].contains(&"-X");
        self.upwards = [first, second].contains(&"+Y");
        Ok(())
    }

    /// [width, height].
    fn resolution(&self) -> [u32; 2] {
        if self.columns { [self.lines, self.length] } else { [self.length, self.lines] }
    }

    /// Where a pixel of the picture stands among those of the file.
    fn place(&self, [x, y]: [u32; 2]) -> usize {
        let [width, height] = self.resolution();
        let x = if self.leftwards { width - 1 - x } else { x };
        let y = if self.upwards { height - 1 - y } else { y };
        let (line, at) = if self.columns { (x, y) } else { (y, x) };
        line as usize * self.length as usize + at as usize
    }

    /// To Rec. 709, if that is not what it is, and what there is to say.
    fn conversion(&self) -> std::result::Result<(Option<Conversion>, Vec<String>), String> {
        let mut remarks = Vec::new();
        if (self.aspect - 1.0).abs() > 1e-3 {
            remarks.push(format!("its pixels are {} times as high as wide, which is not heeded", self.aspect));
        }
        if !self.ignored.is_empty() {
            remarks.push(format!("its header has `{}`, which is not heeded", self.ignored.join("`, `")));
        }
        let primaries = if self.xyz { Some(XYZ) } else { self.primaries };
        let found = primaries.map_or(Ok(None), Primaries::to_rec709)?;
        let conversion = found.map(|(conversion, name)| {
            let scale = if self.xyz { 1.0 / EFFICACY } else { 1.0 };
            let by = if self.xyz { " and divided by 179 lm/W" } else { "" };
            remarks.push(format!("its primaries are {name}; converted to those of Rec. 709{by}"));
            conversion.scaled(scale)
        });
        Ok((conversion, remarks))
    }
}

fn shown(text: &str) -> String {
    text.chars().take(40).flat_map(char::escape_debug).collect()
}

/// A line of the header without its end.
fn text_line(reader: &mut impl BufRead) -> std::result::Result<String, String> {
    let mut bytes = Vec::new();
    let read = reader.by_ref().take(MOST_LINE).read_until(b'\n', &mut bytes);
    read.map_err(|e| e.to_string())?;
    if bytes.pop() != Some(b'\n') {
        return Err("the file is cut short in its header".into());
    }
    if bytes.last() == Some(&b'\r') {
        bytes.pop();
    }
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The value of a code: a mantissa for each channel, and the exponent that they share. Radiance itself adds half a step to
/// each mantissa; nobody else does, and then codes of 1 are no longer 1.
fn radiance([r, g, b, e]: [u8; 4]) -> [f64; 3] {
    let step = if e == 0 { 0.0 } else { (f64::from(e) - 136.0).exp2() };
    [r, g, b].map(|m| f64::from(m) * step)
}

/// The codes of one line.
fn scan_line(reader: &mut impl BufRead, line: &mut [[u8; 4]]) -> io::Result<()> {
    let first = quad(reader)?;
    let new = (8..1 << 15).contains(&line.len()) && first[..2] == [2, 2] && first[2] < 128;
    if !new {
        return old_line(reader, line, first);
    }
    if usize::from(first[2]) << 8 | usize::from(first[3]) != line.len() {
        return Err(io::ErrorKind::InvalidData.into());
    }
    // Each channel by itself: a count above 128 repeats one byte, another copies as many.
    for channel in 0..4 {
        let mut at = 0;
        while at < line.len() {
            let [count, value] = bytes(reader)?;
            let (run, copied) =
                if count > 128 { (usize::from(count - 128), 0) } else { (1, usize::from(count).wrapping_sub(1)) };
            // A count of 0 would go on for ever.
            if count == 0 || run.saturating_add(copied) > line.len() - at {
                return Err(io::ErrorKind::InvalidData.into());
            }
            line[at..at + run].iter_mut().for_each(|code| code[channel] = value);
            at += run;
            for code in &mut line[at..at + copied] {
                [code[channel]] = bytes(reader)?;
            }
            at += copied;
        }
    }
    Ok(())
}

/// Codes one by one; (1, 1, 1, n) repeats the last n times, and the next such 256 n times.
fn old_line(reader: &mut impl BufRead, line: &mut [[u8; 4]], first: [u8; 4]) -> io::Result<()> {
    let (mut at, mut shift, mut code) = (0, 0, first);
    loop {
        if code[..3] == [1, 1, 1] {
            let run = usize::from(code[3]) << shift;
            if at == 0 || shift > 16 || run > line.len() - at {
                return Err(io::ErrorKind::InvalidData.into());
            }
            let last = line[at - 1];
            line[at..at + run].fill(last);
            (at, shift) = (at + run, shift + 8);
        } else {
            line[at] = code;
            (at, shift) = (at + 1, 0);
        }
        if at == line.len() {
            return Ok(());
        }
        code = quad(reader)?;
    }
}

fn bytes<const N: usize>(reader: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn quad(reader: &mut impl Read) -> io::Result<[u8; 4]> {
    bytes(reader)
}
