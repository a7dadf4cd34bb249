//! One mesh in every format that is read.
#![allow(dead_code)] // each test file uses its part

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
}

/// The same bytes, packed.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write as _;
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}
