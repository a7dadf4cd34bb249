//! What the headers of an EXR file tell before anything is read: kinds of data that marmor does not read, by name.

use std::io::{self, BufRead, Read};

/// Longest name, and most bytes of an attribute that is looked into.
const MOST: usize = 1 << 20;

/// A channel's name and the steps of its samples across and down.
type Channel = (String, [i32; 2]);

/// What is looked for in a part's header.
#[derive(Default)]
struct Part {
    compression: Option<u8>,
    channels: Vec<Channel>,
    deep: bool,
}

/// Why the file cannot be read although it is sound, in words; `reader` stands at its beginning. None too where the headers
/// are damaged: whoever reads them says so.
pub(super) fn unreadable(reader: &mut impl BufRead) -> Option<String> {
    let parts = parts(reader).ok()?;
    if parts.iter().any(|part| part.deep) {
        let all = if parts.len() == 1 { "it holds" } else { "one of its parts holds" };
        return Some(format!("{all} deep data, which are not supported: flatten it"));
    }
    if let Some(code) = parts.iter().filter_map(|part| part.compression).find(|&code| code > 9) {
        let name = match code {
            10 => "HTJ2K256",
            11 => "HTJ2K32",
            12 => "LJ2K",
            13 => "ZSTD",
            _ => "a method that is new, or damaged",
        };
        return Some(format!(
            "it is compressed by {name} (code {code}), which marmor does not read; save it again with ZIP compression"
        ));
    }
    let mut channels = parts.iter().flat_map(|part| &part.channels);
    let named = |name: &str, ends: &[&str]| {
        let last = name.rsplit('.').next().unwrap_or(name);
        ends.contains(&last)
    };
    let has_rgb = parts.iter().flat_map(|part| &part.channels).any(|(name, _)| named(name, &["R", "G", "B"]));
    if !has_rgb && channels.any(|(name, _)| named(name, &["RY", "BY"])) {
        return Some("it holds luminance and chroma (Y, RY, BY), which are not read; save it as R, G, B".into());
    }
    let mut channels = parts.iter().flat_map(|part| &part.channels);
    channels.find(|(_, steps)| *steps != [1, 1]).map(|(name, [across, down])| {
        format!(
            "it has subsampled channels, which are not supported: `{name}` has one sample for {across} x {down} pixels"
        )
    })
}

fn parts(reader: &mut impl BufRead) -> io::Result<Vec<Part>> {
    let _magic = number(reader)?;
    let version = number(reader)?;
    let several = version & 0x1000 != 0;
    let mut parts = Vec::new();
    loop {
        let mut part = Part { deep: version & 0x800 != 0 && !several, ..Part::default() };
        let mut empty = true;
        while let Some(name) = text(reader)? {
            empty = false;
            let kind = text(reader)?.unwrap_or_default();
            let length = u64::try_from(number(reader)?).map_err(|_| io::ErrorKind::InvalidData)?;
            let mut value = Vec::new();
            let mut limited = reader.by_ref().take(length);
            match (name.as_str(), kind.as_str()) {
                ("compression" | "channels" | "type", "compression" | "chlist" | "string") if length <= MOST as u64 => {
                    limited.read_to_end(&mut value)?;
                }
                _ => drop(io::copy(&mut limited, &mut io::sink())?),
            }
            match name.as_str() {
                "compression" => part.compression = value.first().copied(),
                "channels" => part.channels = channels(&value)?,
                "type" => part.deep |= value.starts_with(b"deep"),
                _ => {}
            }
        }
        if !empty {
            parts.push(part);
        }
        if empty || !several {
            return Ok(parts);
        }
    }
}

/// Name, kind of number, three bytes more, steps across and down; and so on.
fn channels(mut bytes: &[u8]) -> io::Result<Vec<Channel>> {
    let mut channels = Vec::new();
    while let Some(name) = text(&mut bytes)? {
        number(&mut bytes)?;
        number(&mut bytes)?;
        channels.push((name, [number(&mut bytes)?, number(&mut bytes)?]));
    }
    Ok(channels)
}

fn number(reader: &mut impl Read) -> io::Result<i32> {
    let mut bytes = [0; 4];
    reader.read_exact(&mut bytes)?;
    Ok(i32::from_le_bytes(bytes))
}

/// A text that ends in 0; none if it is empty.
fn text(reader: &mut impl BufRead) -> io::Result<Option<String>> {
    let mut bytes = Vec::new();
    reader.by_ref().take(256).read_until(0, &mut bytes)?;
    if bytes.pop() != Some(0) {
        return Err(io::ErrorKind::InvalidData.into());
    }
    Ok(Some(String::from_utf8_lossy(&bytes).into_owned()).filter(|text| !text.is_empty()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(name: &str, kind: &str, value: &[u8]) -> Vec<u8> {
        let length = (value.len() as i32).to_le_bytes();
        [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &length, value].concat()
    }

    fn channels(of: &[(&str, i32)]) -> Vec<u8> {
        let each = |(name, step): &(&str, i32)| {
            let step = step.to_le_bytes();
            [name.as_bytes(), b"\0", &[1, 0, 0, 0, 0, 0, 0, 0], &step, &step].concat()
        };
        let all: Vec<u8> = of.iter().flat_map(each).chain([0]).collect();
        attribute("channels", "chlist", &all)
    }

    /// What is said of a file of these parts.
    fn said(version: i32, parts: &[Vec<u8>]) -> Option<String> {
        let mut bytes = [[0x76, 0x2f, 0x31, 0x01], version.to_le_bytes()].concat();
        parts.iter().for_each(|part| bytes.extend(part.iter().chain(&[0])));
        bytes.push(0);
        unreadable(&mut bytes.as_slice())
    }

    #[test]
    fn what_is_not_read_has_a_name() {
        let rgb = || channels(&[("B", 1), ("G", 1), ("R", 1)]);
        let compressed = |code: u8| attribute("compression", "compression", &[code]);
        let icc = attribute("iccProfile", "undecoded", &[7; 3000]);
        assert_eq!(said(2, &[[icc.clone(), rgb(), compressed(9)].concat()]), None);
        assert!(said(2, &[[icc, rgb(), compressed(13)].concat()]).unwrap().contains("ZSTD (code 13)"));
        let chroma = channels(&[("BY", 2), ("RY", 2), ("Y", 1)]);
        assert!(said(2, &[[compressed(3), chroma].concat()]).unwrap().contains("luminance and chroma"));
        let coarse = channels(&[("A", 1), ("B", 2), ("G", 1), ("R", 2)]);
        assert!(said(2, &[coarse]).unwrap().contains("`B` has one sample for 2 x 2 pixels"));
        assert!(said(2 | 0x800, &[rgb()]).unwrap().contains("it holds deep data"));
        let deep = [rgb(), attribute("type", "string", b"deepscanline")].concat();
        let flat = [rgb(), attribute("type", "string", b"scanlineimage")].concat();
        assert!(said(2 | 0x1000, &[flat.clone(), deep]).unwrap().contains("one of its parts holds deep data"));
        assert_eq!(said(2 | 0x1000, &[flat.clone(), flat]), None);
    }

    #[test]
    fn damage_is_left_to_others() {
        assert_eq!(unreadable(&mut &b""[..]), None);
        let long = attribute("x", "string", &[1; 40]);
        assert_eq!(said(2, &[long[..30].to_vec()]), None);
        assert_eq!(said(2, &[[b'a'; 600].to_vec()]), None);
        let negative = [&b"x\0string\0"[..], &(-5_i32).to_le_bytes()].concat();
        assert_eq!(said(2, &[negative]), None);
    }
}
