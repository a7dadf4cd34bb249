//! glTF 2 files, as text (`.gltf`) and in one piece (`.glb`): the meshes of the nodes of their scene.

use super::builder::Builder;
use super::gltf_data::{Data, SCALAR, VEC2, VEC3, file_of};
use super::gltf_json::{Node, Primitive, Root, bytes_as_read, split};
use super::loading::{Budget, MAX_COUNT, require_bytes};
use super::{Label, RawMesh, unit_or_zero};
use crate::error::{Error, Result};
use crate::math::{DAffine3, DVec3};
use crate::words::counted;
use glam::{DMat4, DQuat};
use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};

/// Extensions that a file may require: what they change is not read, or is read as it stands.
const HARMLESS: &[&str] =
    &["KHR_mesh_quantization", "KHR_texture_transform", "KHR_lights_punctual", "KHR_texture_basisu"];

/// The same, by the beginnings of their names.
const HARMLESS_KINDS: &[&str] = &["KHR_materials_", "EXT_texture_", "KHR_animation_", "KHR_node_visibility"];

/// Reads a glTF file; see [`super::load_mesh`]. Each node's mesh is placed by its node and those above it. Faces are labelled by
/// their node (object), mesh (group) and material.
pub(super) fn read(mut source: Box<dyn BufRead + '_>, path: &Path, uv: bool) -> Result<RawMesh> {
    let wrong = |what: String| Error::scene(format!("{}: {what}", path.display()));
    let bytes = read_all(&mut source, path)?;
    if bytes.is_empty() {
        return Err(wrong("no faces: the file is empty; export the surface again".into()));
    }
    let (json, binary) = split(&bytes).map_err(wrong)?;
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    require_bytes(bytes_as_read(json)).map_err(|e| e.within(path.display()))?;
    let root: Root =
        serde_json::from_slice(json).map_err(|e| wrong(format!("no glTF: {e}; export again as glTF 2")))?;
    if !root.asset.version.starts_with("2.") {
        return Err(wrong(format!("it is glTF {:?}; version 2 is read: export again", root.asset.version)));
    }
    let unknown = |name: &&String| {
        !HARMLESS.contains(&name.as_str()) && !HARMLESS_KINDS.iter().any(|kind| name.starts_with(kind))
    };
    if let Some(name) = root.extensions_required.iter().find(unknown) {
        return Err(wrong(format!("it requires the extension {name:?}, which is not read; export without it")));
    }
    let mut gltf = Gltf {
        root: &root,
        path,
        data: Data::new(&root, path, binary),
        builder: Builder::new(uv, "at triangle"),
        budget: Budget::new(uv),
        uv,
        left_out: 0,
        at_rest: false,
    };
    for (node, transform) in placed(&root).map_err(wrong)? {
        gltf.node(node, transform)?;
    }
    let mut remarks = gltf.remarks();
    if gltf.builder.count() == 0 {
        let nodes = counted(root.nodes.len(), "node", "nodes");
        return Err(wrong(format!("no faces: no mesh with triangles in {nodes}; export the surface again")));
    }
    let mut mesh = gltf.builder.finish();
    remarks.append(&mut mesh.remarks);
    mesh.remarks = remarks;
    Ok(mesh)
}

/// All bytes, as far as there is memory for them.
/// The buffers of a glTF file that are files of their own.
pub(super) fn beside(mut source: Box<dyn BufRead + '_>, path: &Path) -> Vec<PathBuf> {
    let Ok(bytes) = read_all(&mut source, path) else { return Vec::new() };
    let Ok((json, _)) = split(&bytes) else { return Vec::new() };
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    if require_bytes(bytes_as_read(json)).is_err() {
        return Vec::new();
    }
    let Ok(root) = serde_json::from_slice::<Root>(json) else { return Vec::new() };
    root.buffers.iter().filter_map(|buffer| file_of(buffer.uri.as_deref()?, path)).collect()
}

fn read_all(source: &mut dyn BufRead, path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    loop {
        let before = bytes.len();
        // As much again as is there, so that no more than half of it is copied.
        let most = before.max(1 << 20) as u64;
        source.take(most).read_to_end(&mut bytes).map_err(|e| Error::file(path, "read", e))?;
        if bytes.len() == before {
            return Ok(bytes);
        }
        require_bytes(3 * bytes.len()).map_err(|e| e.within(path.display()))?;
    }
}

/// The nodes of the scene that have a mesh, each with where it is, in the order of the file's tree.
fn placed(root: &Root) -> std::result::Result<Vec<(usize, DAffine3)>, String> {
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|node| &node.children) {
        match is_child.get_mut(*child) {
            None => return Err(format!("no node {child}: there are {}; export again", root.nodes.len())),
            Some(true) => return Err(format!("node {child} is a child twice; export again")),
            Some(free) => *free = true,
        }
    }
    let all: Vec<usize> = (0..root.nodes.len()).filter(|&node| !is_child[node]).collect();
    let scene = root.scenes.get(root.scene.unwrap_or(0));
    let first = scene.map_or(&all, |scene| &scene.nodes);
    let mut open: Vec<(usize, DAffine3)> = first.iter().rev().map(|&node| (node, DAffine3::IDENTITY)).collect();
    let (mut out, mut seen) = (Vec::new(), vec![false; root.nodes.len()]);
    while let Some((index, above)) = open.pop() {
        let Some(node) = root.nodes.get(index) else {
            return Err(format!("no node {index}: there are {}; export again", root.nodes.len()));
        };
        // Nodes are children once, so only a scene that names one twice, or one below another, comes here.
        if std::mem::replace(&mut seen[index], true) {
            return Err(format!("node {index} is in the scene twice; export again"));
        }
        let own =
            transform(node).ok_or_else(|| format!("node {index} has a matrix that is not affine; export again"))?;
        let here = above * own;
        if node.mesh.is_some() {
            out.push((index, here));
        }
        open.extend(node.children.iter().rev().map(|&child| (child, here)));
    }
    Ok(out)
}

/// From a node's space into that of the node above; `None` of a projection, or where numbers overflow.
fn transform(node: &Node) -> Option<DAffine3> {
    let map = if let Some(matrix) = node.matrix {
        let m = DMat4::from_cols_array(&matrix);
        (m.row(3) == glam::DVec4::W).then(|| DAffine3::from_mat4(m))?
    } else {
        let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let turn = DQuat::from_xyzw(x, y, z, w);
        let turn = if turn.length() > 0.0 { turn.normalize() } else { DQuat::IDENTITY };
        let (scale, shift) = (node.scale.unwrap_or([1.0; 3]), node.translation.unwrap_or_default());
        DAffine3::from_scale_rotation_translation(scale.into(), turn, shift.into())
    };
    map.is_finite().then_some(map)
}

struct Gltf<'a> {
    root: &'a Root,
    path: &'a Path,
    data: Data<'a>,
    builder: Builder,
    budget: Budget,
    uv: bool,
    /// Primitives of points and lines.
    left_out: usize,
    /// Some mesh has shapes that it may be turned into.
    at_rest: bool,
}

impl Gltf<'_> {
    fn node(&mut self, index: usize, transform: DAffine3) -> Result<()> {
        let root = self.root;
        let node = &root.nodes[index];
        let Some(number) = node.mesh else { return Ok(()) };
        let Some(mesh) = root.meshes.get(number) else {
            return Err(
                self.wrong(format!("node {index} has mesh {number}: there are {}; export again", root.meshes.len()))
            );
        };
        let name = |name: &Option<String>, kind: &str, number: usize| {
            name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("{kind} {number}"))
        };
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let material =
                primitive.material.map(|m| name(&root.materials.get(m).and_then(|m| m.name.clone()), "material", m));
            self.builder.label(Label {
                object: Some(name(&node.name, "node", index)),
                groups: vec![name(&mesh.name, "mesh", number)],
                material,
            });
            let triangles = self.triangles(primitive, transform).map_err(|wrong| match wrong {
                Wrong::Here(what) => self.wrong(format!("mesh {number}, primitive {i}: {what}")),
                Wrong::Told(error) => error,
            })?;
            let mirrored = transform.matrix3.determinant() < 0.0;
            for mut t in triangles {
                if mirrored {
                    t.swap(1, 2);
                }
                let place = self.builder.count();
                self.builder.face(&t, None, place);
            }
        }
        Ok(())
    }

    fn wrong(&self, what: String) -> Error {
        Error::scene(format!("{}: {what}", self.path.display()))
    }

    /// Adds the vertices of a primitive; its triangles by the builder's numbers of these.
    fn triangles(&mut self, primitive: &Primitive, transform: DAffine3) -> std::result::Result<Vec<[u32; 3]>, Wrong> {
        let here = |what: &str| Wrong::Here(what.into());
        let mode = primitive.mode.unwrap_or(4);
        let position = primitive.attributes.position.filter(|_| mode >= 4);
        let Some(position) = position else {
            self.left_out += 1;
            return Ok(Vec::new());
        };
        self.at_rest |= !primitive.targets.is_empty();
        let positions = self.data.elements::<3>(position, VEC3, false)?;
        let count = positions.len();
        let vertices = &mut self.builder.vertices;
        let base = vertices.positions.len();
        if base + count >= MAX_COUNT {
            return Err(here("2^31 vertices; split the mesh"));
        }
        let placed = |p: DVec3| if transform == DAffine3::IDENTITY { p } else { transform.transform_point3(p) };
        for (i, p) in positions.into_iter().enumerate() {
            let p = placed(DVec3::from_array(p));
            if !p.is_finite() {
                return Err(Wrong::Here(format!("vertex {i} is not finite; mend it or export again")));
            }
            vertices.positions.push(p);
        }
        if let Some(normal) = primitive.attributes.normal {
            let normals = self.data.elements::<3>(normal, VEC3, false)?;
            if normals.len() != count {
                return Err(here("not as many normals as vertices; export again"));
            }
            if !normals.iter().flatten().all(|x| x.is_finite()) {
                return Err(here("a normal that is not finite; mend it or export again"));
            }
            vertices_of(&mut self.builder, base, normals, transform);
        }
        if let (Some(texcoord), true) = (primitive.attributes.texcoord, self.uv) {
            let uv = self.data.elements::<2>(texcoord, VEC2, false)?;
            if uv.len() != count {
                return Err(here("not as many texture coordinates as vertices; export again"));
            }
            let all = &mut self.builder.vertices.uv;
            all.resize(base, [f32::NAN; 2]);
            // v goes down in glTF.
            all.extend(uv.into_iter().map(|[u, v]| [u as f32, (1.0 - v) as f32]));
        }
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => {
                let typed = self.data.elements::<1>(indices, SCALAR, true)?;
                if let Some([wrong]) = typed.iter().find(|[i]| *i >= count as f64) {
                    let what = format!("vertex number {wrong}, but there are {count}, counted from 0; export again");
                    return Err(Wrong::Here(what));
                }
                typed.into_iter().map(|[i]| base as u32 + i as u32).collect()
            }
            None => (base as u32..(base + count) as u32).collect(),
        };
        let n = corners.len();
        let triangles: Vec<[u32; 3]> = match mode {
            4 if !n.is_multiple_of(3) => {
                return Err(Wrong::Here(format!("{n} corners of triangles, which is no multiple of 3; export again")));
            }
            4 => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            // Every other triangle of a strip runs the other way.
            5 => (2..n)
                .map(|i| if i % 2 == 0 { [i - 2, i - 1, i] } else { [i - 1, i - 2, i] })
                .map(|t| t.map(|i| corners[i]))
                .collect(),
            6 => (2..n).map(|i| [corners[0], corners[i - 1], corners[i]]).collect(),
            other => return Err(Wrong::Here(format!("mode {other} is not known; export again"))),
        };
        let all = self.builder.count() + triangles.len();
        if all >= MAX_COUNT {
            return Err(here("2^31 triangles; split the mesh"));
        }
        self.budget.check(all.max(base + count)).map_err(|e| e.within(self.path.display()))?;
        Ok(triangles)
    }

    /// What the file has and is not read.
    fn remarks(&self) -> Vec<String> {
        let root = self.root;
        let lights = root.extensions.lights.as_ref().map_or(0, |lights| lights.lights.len());
        let not_taken = [
            (root.materials.len(), "material", "materials"),
            (root.cameras.len(), "camera", "cameras"),
            (lights, "light", "lights"),
        ];
        let not_taken: Vec<String> =
            not_taken.iter().filter(|(n, ..)| *n > 0).map(|(n, one, many)| counted(*n, one, many)).collect();
        let mut out = Vec::new();
        if !not_taken.is_empty() {
            out.push(format!(
                "only meshes are taken from it, and not its {}: the scene file has its own",
                not_taken.join(", ")
            ));
        }
        if !root.skins.is_empty() || !root.animations.is_empty() || self.at_rest {
            out.push("its skins, animations and morph targets are not read: meshes are as they rest".into());
        }
        if root.scenes.len() > 1 {
            let (which, all) = (root.scene.unwrap_or(0), root.scenes.len());
            out.push(format!("of its {all} scenes number {which} is read"));
        }
        if self.left_out > 0 {
            let what = counted(self.left_out, "primitive of points or lines is", "primitives of points or lines are");
            out.push(format!("{what} left out"));
        }
        out
    }
}

/// Adds the normals of the vertices from number `base` on.
fn vertices_of(builder: &mut Builder, base: usize, normals: Vec<[f64; 3]>, transform: DAffine3) {
    let all = &mut builder.vertices.normals;
    all.resize(base, DVec3::ZERO);
    let turn = transform.matrix3.inverse().transpose();
    all.extend(normals.into_iter().map(|n| {
        let n = unit_or_zero(DVec3::from_array(n));
        let n = if transform == DAffine3::IDENTITY { n } else { unit_or_zero(turn * n) };
        // A map that flattens has no normals.
        if n.is_finite() { n } else { DVec3::ZERO }
    }));
}

/// What is wrong with a primitive.
enum Wrong {
    /// To be told with its place.
    Here(String),
    /// Told already.
    Told(Error),
}

impl From<Error> for Wrong {
    fn from(error: Error) -> Self {
        Self::Told(error)
    }
}
