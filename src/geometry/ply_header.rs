//! The header of a PLY file: its elements and their properties, in the order of the file.

use super::counted_bytes::CountedBytes;
use crate::error::{Result, did_you_mean};

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    const NAMES: [(&'static str, Self); 16] = [
        ("char", Self::I8),
        ("uchar", Self::U8),
        ("short", Self::I16),
        ("ushort", Self::U16),
        ("int", Self::I32),
        ("uint", Self::U32),
        ("float", Self::F32),
        ("double", Self::F64),
        ("int8", Self::I8),
        ("uint8", Self::U8),
        ("int16", Self::I16),
        ("uint16", Self::U16),
        ("int32", Self::I32),
        ("uint32", Self::U32),
        ("float32", Self::F32),
        ("float64", Self::F64),
    ];

    /// What a binary file takes for it [bytes].
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The number at the start of `bytes`, which hold as many as it takes; f64 has every value of every type.
    pub(super) fn of(self, bytes: &[u8], encoding: Encoding) -> f64 {
        let mut eight = [0; 8];
        let n = self.size();
        eight[..n].copy_from_slice(&bytes[..n]);
        if encoding == Encoding::BigEndian {
            eight[..n].reverse();
        }
        let low = u64::from_le_bytes(eight);
        match self {
            Self::I8 => (low as i8).into(),
            Self::U8 => (low as u8).into(),
            Self::I16 => (low as i16).into(),
            Self::U16 => (low as u16).into(),
            Self::I32 => (low as i32).into(),
            Self::U32 => (low as u32).into(),
            Self::F32 => f32::from_bits(low as u32).into(),
            Self::F64 => f64::from_bits(low),
        }
    }
}

/// A property of an element: one number, or a list of them behind its length.
#[derive(Clone, Debug)]
pub(super) struct Property {
    pub name: String,
    /// The type of a list's length; `None` of one number.
    pub length: Option<Number>,
    pub number: Number,
}

/// One kind of element, and how often it follows.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub name: String,
    /// As the file says: nothing is asked of memory for it.
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// The place of the first property of one of these names.
    pub(super) fn find(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|p| names.contains(&p.name.as_str()))
    }
}

/// What the header says.
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
}

/// More of either in one header is no mesh.
const MOST: usize = 1024;

/// Reads up to and with `end_header`.
///
/// # Errors
/// A scene error with the line that is wrong.
pub(super) fn read(file: &mut CountedBytes<'_>) -> Result<Header> {
    const CUT: &str = "the header ends without `end_header`; copy or export the file again";
    let first = file.next_line()?.map(|line| line.trim_ascii_end() == "ply");
    match first {
        Some(true) => {}
        Some(false) => return Err(file.wrong_line("no PLY file: it does not begin with `ply`")),
        None => return Err(file.wrong("no faces: the file is empty; export the surface as polygons")),
    }
    let (mut encoding, mut elements) = (None, Vec::<Element>::new());
    loop {
        let Some(line) = file.next_line()? else { return Err(file.wrong_line(CUT)) };
        let words: Vec<String> = line.split_ascii_whitespace().take(6).map(str::to_owned).collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        match words[..] {
            ["comment" | "obj_info", ..] | [] => {}
            ["format", name, version] => {
                let known = match name {
                    "ascii" => Some(Encoding::Ascii),
                    "binary_little_endian" => Some(Encoding::LittleEndian),
                    "binary_big_endian" => Some(Encoding::BigEndian),
                    _ => None,
                };
                let (Some(known), "1.0") = (known, version) else {
                    let there = "there are ascii, binary_little_endian and binary_big_endian, all 1.0";
                    return Err(file.wrong_line(format_args!("the format {name:?} {version:?} is not known; {there}")));
                };
                if encoding.is_some_and(|other| other != known) {
                    return Err(file.wrong_line("a second `format`; export again"));
                }
                encoding = Some(known);
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    let what = format_args!("{count:?} is no number of elements; expected a whole number from 0");
                    return Err(file.wrong_line(what));
                };
                if elements.iter().any(|e| e.name == name) || elements.len() == MOST {
                    return Err(file.wrong_line(format_args!("a second element {name:?}; export again")));
                }
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", "list", length, number, name] => {
                let (length, number) = (kind(file, length)?, kind(file, number)?);
                if !length.is_whole() {
                    return Err(file.wrong_line("the length of a list must be a whole number; export again"));
                }
                add(file, &mut elements, Property { name: name.into(), length: Some(length), number })?;
            }
            ["property", number, name] if number != "list" => {
                let number = kind(file, number)?;
                add(file, &mut elements, Property { name: name.into(), length: None, number })?;
            }
            ["end_header"] => break,
            _ => {
                let what = format!("`{}` is no line of a PLY header; export again", super::shown(file.current()));
                return Err(file.wrong_line(what));
            }
        }
    }
    let Some(encoding) = encoding else { return Err(file.wrong_line("the header has no `format`; export again")) };
    if let Some(bare) = elements.iter().find(|e| e.properties.is_empty() && e.count > 0) {
        return Err(file.wrong_line(format_args!("element {:?} has no properties; export again", bare.name)));
    }
    Ok(Header { encoding, elements })
}

fn add(file: &CountedBytes<'_>, elements: &mut [Element], property: Property) -> Result<()> {
    let Some(element) = elements.last_mut() else {
        return Err(file.wrong_line("a property before any element; export again"));
    };
    if element.find(&[&property.name]).is_some() || element.properties.len() == MOST {
        let what = format_args!("a second property {:?} of element {:?}; export again", property.name, element.name);
        return Err(file.wrong_line(what));
    }
    element.properties.push(property);
    Ok(())
}

fn kind(file: &CountedBytes<'_>, typed: &str) -> Result<Number> {
    let found = Number::NAMES.iter().find(|(name, _)| *name == typed).map(|(_, number)| *number);
    found.ok_or_else(|| {
        let names = || Number::NAMES.iter().map(|(name, _)| *name);
        let there = names().collect::<Vec<_>>().join(", ");
        file.wrong_line(format_args!("no type {typed:?}{}; there are {there}", did_you_mean(typed, names())))
    })
}
