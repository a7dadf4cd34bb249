//! Mesh files of every kind that is read, told apart by the ending of their names; gzip is undone on the way.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::{RawMesh, gltf, obj, ply, stl};
use crate::error::{Error, Result};
use crate::input;
use flate2::bufread::MultiGzDecoder;

/// The endings of the names of mesh files that are read; `.gz` may follow each.
pub const MESH_ENDINGS: &[&str] = &["obj", "ply", "stl", "gltf", "glb"];

/// Reads the triangles of a mesh file: all its parts joined, vertices shared between them, unused vertices left out. Polygons are
/// cut into triangles, concave ones and those with a hole too. Texture coordinates (but see [`load_mesh_with_uv`]), colours and
/// materials are not read. What a user should hear of is in [`RawMesh::remarks`]. A face has the file's normals only where all its
/// corners have one.
///
/// # Errors
/// A file error if `path` cannot be read, or its gzip data are damaged. A scene error that names path and place (line, byte,
/// vertex or face) if the name has an unknown ending, a vertex is not finite or not a number, an index is of a vertex that does
/// not exist, or the file is cut short; one that names the path if there are no faces. A Memory error, found while reading, if the
/// mesh is more than what is available.
pub fn load_mesh(path: &Path) -> Result<RawMesh> {
    load(path, false)
}

/// As [`load_mesh`], with texture coordinates of the faces that have some at all their corners. Such that are not there or no
/// finite numbers count as missing.
///
/// # Errors
/// As [`load_mesh`].
pub fn load_mesh_with_uv(path: &Path) -> Result<RawMesh> {
    load(path, true)
}

/// Files beside `path` of which its mesh is read too, as buffers of glTF are. None where it cannot be read, which is said by [`load_mesh`].
pub fn files_beside(path: &Path) -> Vec<PathBuf> {
    match open(path) {
        Ok((source, ending)) if ["gltf", "glb"].contains(&ending.as_str()) => gltf::beside(source, path),
        _ => Vec::new(),
    }
}

/// What is in the file, unpacked, and the ending of its name.
fn open(path: &Path) -> Result<(Box<dyn BufRead>, String)> {
    let (file, _) = input::open(path)?;
    let (ending, packed) = ending(path);
    let file = BufReader::with_capacity(1 << 16, file);
    Ok(match packed {
        true => (Box::new(BufReader::with_capacity(1 << 16, Unpacked(MultiGzDecoder::new(file)))), ending),
        false => (Box::new(file), ending),
    })
}

fn load(path: &Path, uv: bool) -> Result<RawMesh> {
    let (source, ending) = open(path)?;
    match ending.as_str() {
        "obj" => obj::read(source, path, uv),
        "ply" => ply::read(source, path, uv),
        "stl" => stl::read(source, path, uv),
        "gltf" | "glb" => gltf::read(source, path, uv),
        _ => Err(Error::scene(format!(
            "{}: not a kind of mesh that is read; there are {}, each also with .gz after it",
            path.display(),
            MESH_ENDINGS.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(", ")
        ))),
    }
}

/// The ending in small letters, and whether the file is packed by gzip.
fn ending(path: &Path) -> (String, bool) {
    let of = |path: &Path| path.extension().map_or(String::new(), |e| e.to_string_lossy().to_ascii_lowercase());
    match of(path).as_str() {
        "gz" => (of(path.file_stem().unwrap_or_default().as_ref()), true),
        other => (other.to_string(), false),
    }
}

/// What gzip packed. Only what is asked for is unpacked: how much there will be is not known.
struct Unpacked(MultiGzDecoder<BufReader<File>>);

impl Read for Unpacked {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let damaged = |e: io::Error| {
            io::Error::new(e.kind(), format!("its gzip data are damaged or cut short ({e}); pack it again"))
        };
        self.0.read(into).map_err(damaged)
    }
}
