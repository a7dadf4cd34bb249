//! One mesh in every format that is read, and files of it.
#![allow(dead_code)] // each test file uses its part

use marmor::Error;
use marmor::geometry::{RawMesh, load_mesh_with_uv};
use std::fmt::Write as _;

/// Vertices with everything a format may have of them, each number one of f32, and polygons over them.
#[derive(Clone, Default)]
pub struct Shape {
    pub positions: Vec<[f32; 3]>,
    /// As many as positions, or none.
    pub normals: Vec<[f32; 3]>,
    /// As many as positions, or none; v upwards.
    pub uv: Vec<[f32; 2]>,
    pub faces: Vec<Vec<u32>>,
}

impl Shape {
    /// A box about the origin whose sides are grids of `n` times `n` quads, rims shared; bulged, its normals those of a ball.
    pub fn bulged(n: u32) -> Self {
        let mut shape = Self::default();
        let mut number = std::collections::HashMap::new();
        for axis in 0..3 {
            for side in [-1, 1] {
                let mut vertex = |i: u32, j: u32| {
                    let mut at = [0; 3];
                    at[axis] = side * n as i32;
                    at[(axis + 1) % 3] = 2 * i as i32 - n as i32;
                    at[(axis + 2) % 3] = 2 * j as i32 - n as i32;
                    *number.entry(at).or_insert_with(|| {
                        let p = at.map(|x| x as f32 / n as f32);
                        let r = 1.0 + 0.25 * p.iter().map(|x| x * x).sum::<f32>().sqrt();
                        shape.positions.push(p.map(|x| (64.0 * 8.0 * x / r).round() / 64.0));
                        shape.normals.push(p.map(|x| (64.0 * x).round() / 64.0));
                        shape.uv.push([(p[0] + 2.0) / 4.0, (p[1] + p[2] / 2.0 + 2.0) / 4.0]);
                        shape.positions.len() as u32 - 1
                    })
                };
                for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                    let mut quad = vec![vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                    if side < 0 {
                        quad.reverse();
                    }
                    shape.faces.push(quad);
                }
            }
        }
        shape
    }

    /// The same with each face a fan of triangles, without normals and texture coordinates: what STL can hold.
    pub fn bare(&self) -> Self {
        let fan = |face: &Vec<u32>| (2..face.len()).map(|i| vec![face[0], face[i - 1], face[i]]).collect::<Vec<_>>();
        let faces = self.faces.iter().flat_map(fan).collect();
        Self { positions: self.positions.clone(), faces, ..Self::default() }
    }

    /// OBJ; each corner names its vertex, its texture coordinates and its normal by one number.
    pub fn obj(&self) -> Vec<u8> {
        let mut out = String::new();
        self.positions.iter().for_each(|p| writeln!(out, "v {} {} {}", p[0], p[1], p[2]).unwrap());
        self.uv.iter().for_each(|p| writeln!(out, "vt {} {}", p[0], p[1]).unwrap());
        self.normals.iter().for_each(|p| writeln!(out, "vn {} {} {}", p[0], p[1], p[2]).unwrap());
        for face in &self.faces {
            out += "f";
            for i in face.iter().map(|i| i + 1) {
                match (self.uv.is_empty(), self.normals.is_empty()) {
                    (true, true) => write!(out, " {i}").unwrap(),
                    (false, true) => write!(out, " {i}/{i}").unwrap(),
                    (true, false) => write!(out, " {i}//{i}").unwrap(),
                    (false, false) => write!(out, " {i}/{i}/{i}").unwrap(),
                }
            }
            out += "\n";
        }
        out.into_bytes()
    }

    /// The header of a PLY file, with `names` for texture coordinates.
    pub fn ply_header(&self, format: &str, names: [&str; 2]) -> String {
        let mut out = format!("ply\nformat {format} 1.0\ncomment a test\nelement vertex {}\n", self.positions.len());
        let mut properties = vec!["x", "y", "z"];
        if !self.normals.is_empty() {
            properties.extend(["nx", "ny", "nz"]);
        }
        if !self.uv.is_empty() {
            properties.extend(names);
        }
        properties.iter().for_each(|name| writeln!(out, "property float {name}").unwrap());
        write!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header\n", self.faces.len()).unwrap();
        out
    }

    fn vertex(&self, i: usize) -> Vec<f32> {
        let mut all = self.positions[i].to_vec();
        all.extend(self.normals.get(i).into_iter().flatten());
        all.extend(self.uv.get(i).into_iter().flatten());
        all
    }

    /// PLY as text.
    pub fn ply_ascii(&self) -> Vec<u8> {
        let mut out = self.ply_header("ascii", ["s", "t"]);
        let line = |numbers: Vec<String>| numbers.join(" ") + "\n";
        for i in 0..self.positions.len() {
            out += &line(self.vertex(i).iter().map(f32::to_string).collect());
        }
        for face in &self.faces {
            out += &line([face.len() as u32].iter().chain(face).map(u32::to_string).collect());
        }
        out.into_bytes()
    }

    /// PLY as bytes.
    pub fn ply_binary(&self, big: bool) -> Vec<u8> {
        let format = if big { "binary_big_endian" } else { "binary_little_endian" };
        let mut out = self.ply_header(format, ["texture_u", "texture_v"]).into_bytes();
        let four = |out: &mut Vec<u8>, bits: u32| out.extend(if big { bits.to_be_bytes() } else { bits.to_le_bytes() });
        for i in 0..self.positions.len() {
            self.vertex(i).iter().for_each(|x| four(&mut out, x.to_bits()));
        }
        for face in &self.faces {
            out.push(face.len() as u8);
            face.iter().for_each(|i| four(&mut out, *i));
        }
        out
    }

    fn corners(&self) -> impl Iterator<Item = [[f32; 3]; 3]> {
        self.faces.iter().map(|f| [f[0], f[1], f[2]].map(|i| self.positions[i as usize]))
    }

    /// STL as text, of triangles.
    pub fn stl_ascii(&self) -> Vec<u8> {
        let mut out = String::from("solid a test\n");
        for corners in self.corners() {
            out += "  facet normal 0 0 0\n    outer loop\n";
            corners.iter().for_each(|p| writeln!(out, "      vertex {} {:e} {}", p[0], p[1], p[2]).unwrap());
            out += "    endloop\n  endfacet\n";
        }
        (out + "endsolid a test\n").into_bytes()
    }

    /// STL as bytes, of triangles; its header begins as text does.
    pub fn stl_binary(&self) -> Vec<u8> {
        let mut out = b"solid by a program that puts the word there too".to_vec();
        out.resize(80, b' ');
        out.extend((self.faces.len() as u32).to_le_bytes());
        for corners in self.corners() {
            out.extend([0; 12]);
            corners.iter().flatten().for_each(|x| out.extend(x.to_le_bytes()));
            out.extend([0; 2]);
        }
        out
    }

    /// What a glTF file has in its buffer, and the JSON that says so: one node of one mesh; `buffer` is its entry. Faces become
    /// fans of triangles.
    pub fn gltf(&self, buffer: &str) -> (String, Vec<u8>) {
        let fans: Vec<u32> =
            self.faces.iter().flat_map(|f| (2..f.len()).flat_map(|i| [f[0], f[i - 1], f[i]])).collect();
        let n = self.positions.len();
        let (mut bytes, mut views, mut accessors, mut attributes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut add = |name: &str, kind: &str, component: u32, count: usize, own: Vec<u8>| {
            let at = views.len();
            views.push(format!("{{\"buffer\":0,\"byteOffset\":{},\"byteLength\":{}}}", bytes.len(), own.len()));
            accessors.push(format!(
                "{{\"bufferView\":{at},\"componentType\":{component},\"count\":{count},\"type\":\"{kind}\"}}"
            ));
            attributes.push(format!("\"{name}\":{at}"));
            bytes.extend(own);
        };
        let floats = |all: Vec<f32>| all.iter().flat_map(|x| x.to_le_bytes()).collect();
        add("POSITION", "VEC3", 5126, n, floats(self.positions.iter().flatten().copied().collect()));
        if !self.normals.is_empty() {
            add("NORMAL", "VEC3", 5126, n, floats(self.normals.iter().flatten().copied().collect()));
        }
        if !self.uv.is_empty() {
            add("TEXCOORD_0", "VEC2", 5126, n, floats(self.uv.iter().flat_map(|[u, v]| [*u, 1.0 - v]).collect()));
        }
        add("", "SCALAR", 5125, fans.len(), fans.iter().flat_map(|i| i.to_le_bytes()).collect());
        attributes.pop();
        let json = format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
             \"meshes\":[{{\"primitives\":[{{\"attributes\":{{{}}},\"indices\":{}}}]}}],\"accessors\":[{}],\
             \"bufferViews\":[{}],\"buffers\":[{{{buffer}\"byteLength\":{}}}]}}",
            attributes.join(","),
            views.len() - 1,
            accessors.join(","),
            views.join(","),
            bytes.len()
        );
        (json, bytes)
    }

    /// glTF in one piece.
    pub fn glb(&self) -> Vec<u8> {
        let (json, bytes) = self.gltf("");
        glb(&json, &bytes)
    }
}

/// A GLB file of these chunks.
pub fn glb(json: &str, bytes: &[u8]) -> Vec<u8> {
    let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, chunk, blank) in [(b"JSON", json.as_bytes(), b' '), (b"BIN\0", bytes, 0)] {
        out.extend((chunk.len().next_multiple_of(4) as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
        out.resize(out.len().next_multiple_of(4), blank);
    }
    let length = (out.len() as u32).to_le_bytes();
    out[8..12].copy_from_slice(&length);
    out
}

/// Bytes as base64.
pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for three in bytes.chunks(3) {
        let all = three.iter().enumerate().fold(0_u32, |all, (i, b)| all | u32::from(*b) << (16 - 8 * i));
        (0..=three.len()).for_each(|i| out.push(LETTERS[(all >> (18 - 6 * i)) as usize % 64].into()));
        out += &"=".repeat(3 - three.len());
    }
    out
}

/// The same bytes, packed.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write as _;
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

/// A folder with a file of this name, and its path.
pub fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// The mesh that a file of this name is read as.
pub fn read(name: &str, bytes: &[u8]) -> Result<RawMesh, Error> {
    load_mesh_with_uv(&written(name, bytes).1)
}

/// Positions, triangles, normals and texture coordinates, to the bit.
pub fn bits(mesh: &RawMesh) -> String {
    let normals = mesh.normals.as_ref().map(|n| (&n.vectors, &n.triangles));
    format!("{:?}", (&mesh.positions, &mesh.triangles, normals, &mesh.uv))
}
