//! What of a glTF file's JSON bears on its geometry, and the container that GLB files are.

use serde::Deserialize;
use serde::de::IgnoredAny;

/// The file as typed: nothing is checked, indices may be of what is not there.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Root {
    pub asset: Asset,
    #[serde(default)]
    pub extensions_required: Vec<String>,
    pub scene: Option<usize>,
    #[serde(default)]
    pub scenes: Vec<SceneNodes>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<View>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    pub materials: Vec<Named>,
    #[serde(default)]
    pub cameras: Vec<IgnoredAny>,
    #[serde(default)]
    pub animations: Vec<IgnoredAny>,
    #[serde(default)]
    pub skins: Vec<IgnoredAny>,
    #[serde(default)]
    pub extensions: Extensions,
}

#[derive(Deserialize, Default)]
pub(super) struct Extensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights: Option<Lights>,
}

#[derive(Deserialize)]
pub(super) struct Lights {
    #[serde(default)]
    pub lights: Vec<IgnoredAny>,
}

#[derive(Deserialize)]
pub(super) struct Asset {
    pub version: String,
}

#[derive(Deserialize)]
pub(super) struct Named {
    pub name: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct SceneNodes {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub name: Option<String>,
    pub mesh: Option<usize>,
    #[serde(default)]
    pub children: Vec<usize>,
    /// Column by column.
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    /// A quaternion x, y, z, w.
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub name: Option<String>,
    #[serde(default)]
    pub primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub attributes: Attributes,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    /// 0 to 6: points, lines, a loop and a strip of these, triangles, a strip and a fan of these.
    pub mode: Option<u32>,
    #[serde(default)]
    pub targets: Vec<IgnoredAny>,
}

/// Numbers of accessors.
#[derive(Deserialize, Default)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(super) struct Attributes {
    pub position: Option<usize>,
    pub normal: Option<usize>,
    #[serde(rename = "TEXCOORD_0")]
    pub texcoord: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: u64,
}

/// The most that JSON takes when it is read \[bytes\]: by its objects and by what lists hold, which may take two letters each.
pub(super) fn bytes_as_read(json: &[u8]) -> usize {
    let (mut objects, mut items) = (0_usize, 0_usize);
    for byte in json {
        objects += usize::from(*byte == b'{');
        items += usize::from(*byte == b',');
    }
    // Lists grow to twice what they hold.
    json.len() + 2 * (objects * size_of::<Node>() + items * size_of::<String>())
}

/// The JSON of a file, and the bytes beside it in a GLB file.
///
/// # Errors
/// What is wrong with the container.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let Some(rest) = bytes.strip_prefix(b"glTF") else { return Ok((bytes, None)) };
    let word = |at: usize| {
        let four = rest.get(at..at + 4).and_then(|b| b.try_into().ok());
        four.map(u32::from_le_bytes).ok_or_else(|| cut_short(bytes.len()))
    };
    let version = word(0)?;
    if version != 2 {
        return Err(format!("it is of version {version} of GLB; version 2 is read: export again as glTF 2"));
    }
    let (mut json, mut binary, mut at) = (None, None, 8);
    while at < rest.len() {
        let (length, kind) = (word(at)? as usize, word(at + 4)?);
        let chunk = rest.get(at + 8..).and_then(|rest| rest.get(..length)).ok_or_else(|| cut_short(bytes.len()))?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            // Others are for programs that know them.
            _ => {}
        }
        at += 8 + length;
    }
    Ok((json.ok_or("it has no JSON; export it again")?, binary))
}

fn cut_short(length: usize) -> String {
    format!("the file ends within a chunk (after {length} bytes); copy or export it again")
}
