//! The mesh files of a scene, each read once, and what its objects have of them.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::file::SceneFile;
use super::objects::{Geometry, ObjectEntry};
use super::portion::{Portion, joined};
use crate::error::{Error, Result};
use crate::geometry::{Parts, RawMesh, load_mesh, load_mesh_with_uv};

/// Mesh files that have been read and are still asked for.
pub(super) struct MeshFiles {
    read: HashMap<PathBuf, RawMesh>,
    /// How many objects still ask for each.
    uses: HashMap<PathBuf, usize>,
    /// Files of objects that have a picture.
    with_uv: HashSet<PathBuf>,
    /// Files of several parts of which it has been said that they are one object.
    said_joined: HashSet<PathBuf>,
}

impl MeshFiles {
    /// Those that the scene names, relative to `folder`; none is read yet.
    pub(super) fn new(file: &SceneFile, folder: &Path) -> Self {
        let mut out =
            Self { read: HashMap::new(), uses: HashMap::new(), with_uv: HashSet::new(), said_joined: HashSet::new() };
        for entry in &file.objects {
            let Geometry::Mesh(path) = &entry.geometry else { continue };
            let path = folder.join(path);
            if file.materials[entry.material].images().next().is_some() {
                out.with_uv.insert(path.clone());
            }
            *out.uses.entry(path).or_default() += 1;
        }
        out
    }

    /// What `entry` has of the file at `path`, in its own space; what is to be said of the file goes to `said`, once.
    ///
    /// # Errors
    /// As of [`load_mesh`], and of a part that is not there.
    pub(super) fn take(
        &mut self,
        file: &SceneFile,
        entry: &ObjectEntry,
        path: &Path,
        said: &mut Vec<String>,
    ) -> Result<RawMesh> {
        let within = |e: Error| e.within(format_args!("{}: object {:?}", entry.at, entry.name));
        let mut mesh = match self.read.remove(path) {
            Some(mesh) => mesh,
            None => {
                let load = if self.with_uv.contains(path) { load_mesh_with_uv } else { load_mesh };
                let mesh = load(path).map_err(within)?;
                said.extend(mesh.remarks.iter().map(|remark| format!("{}: {remark}", path.display())));
                mesh
            }
        };
        let left = self.uses.entry(path.to_path_buf()).or_default();
        *left = left.saturating_sub(1);
        if entry.portion == Portion::Whole && self.said_joined.insert(path.to_path_buf()) {
            let what = joined(&mesh.parts, &file.materials[entry.material].name);
            said.extend(what.map(|what| format!("{}: {what}", path.display())));
        }
        // The last one takes it: a large mesh is not there twice.
        if *left == 0 && entry.portion == Portion::Whole {
            mesh.parts = Parts::default();
            return Ok(mesh);
        }
        let found = entry.portion.of(&mesh, path).map_err(within)?;
        if *left > 0 {
            self.read.insert(path.to_path_buf(), mesh);
        }
        Ok(found)
    }
}

impl ObjectEntry {
    /// What the object has of a mesh file, before its transform, with texture coordinates; `None` of a shape. `folder` is the scene
    /// file's.
    ///
    /// # Errors
    /// As of [`load_mesh`], and of a part that is not there.
    pub fn read_mesh(&self, folder: &Path) -> Result<Option<RawMesh>> {
        let Geometry::Mesh(path) = &self.geometry else { return Ok(None) };
        let path = folder.join(path);
        let mesh = load_mesh_with_uv(&path)?;
        if self.portion == Portion::Whole { Ok(Some(mesh)) } else { self.portion.of(&mesh, &path).map(Some) }
    }
}
