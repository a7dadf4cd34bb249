//! What can be typed: one struct a section, every number checked alone. What needs meshes is checked in `load.rs`.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::camera_entry::{self, CameraEntry};
use super::environment::{self, EnvironmentEntry};
use super::lights::{self, LightSource};
use super::materials::{self, MaterialEntry};
use super::objects::{self, ObjectEntry};
use super::options::{FilterName, MethodOptions, RenderOptions};
use super::tree::{Fields, Node, Value};
use super::values::{UNIT, named_value, switch, unit, whole, whole_or_none};
use super::{Geometry, difference};
use crate::error::{Error, Result};
use crate::geometry::files_beside;
use crate::input;

/// A scene file whose numbers are in range and whose names exist. docs/scene-format.md lists every key.
#[derive(Clone, Debug)]
pub struct SceneFile {
    /// Where it was read from; meshes are looked for beside it.
    pub path: PathBuf,
    /// Length of one unit \[mm\]; `None` if the file does not say.
    pub unit_in_mm: Option<f64>,
    /// `[camera]`.
    pub camera: CameraEntry,
    /// `[[object]]`, in order.
    pub objects: Vec<ObjectEntry>,
    /// `[material.NAME]`, in order.
    pub materials: Vec<MaterialEntry>,
    /// `[environment]`; black without one.
    pub environment: EnvironmentEntry,
    /// `[[light]]`, in order: lights that are no surface.
    pub lights: Vec<LightSource>,
    /// `[method]`.
    pub method: MethodOptions,
    /// `[render]`.
    pub render: RenderOptions,
    root: Node,
}

/// Memory for each byte of a scene file while it is parsed; measured with 100 000 objects.
const BYTES_PER_BYTE: u128 = 100;

const SECTIONS: &[&str] = &["unit", "camera", "object", "material", "light", "environment", "method", "render"];

impl SceneFile {
    /// Reads and checks a scene file; meshes are not opened yet.
    ///
    /// # Errors
    /// A file error if it cannot be read; else a scene error that names the line, the key, what is expected.
    pub fn read(path: &Path) -> Result<Self> {
        let text = String::from_utf8(input::read_all(path, BYTES_PER_BYTE)?).map_err(|e| {
            let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
            Error::scene(format!("{}:{line}: not UTF-8 text; a scene file is TOML", path.display()))
        })?;
        Self::parse(&text, path)
    }

    /// The same from text; `path` is for messages and for the folder of meshes.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        Self::from_tree(Node::parse(text, path)?, path)
    }

    /// The file with options of the form `path.to.key=value` put over it, in order; lists count from 0
    /// (`object.0.material=marble`). A value that is no TOML is taken as text. It is made of what was typed: fields changed
    /// since then are not in it.
    ///
    /// # Errors
    /// A usage error if the form or a list's number is wrong; a scene error, naming the option, if the value is.
    pub fn with<S: AsRef<str>>(&self, overrides: &[S]) -> Result<Self> {
        let mut root = self.root.clone();
        for typed in overrides {
            root.set(typed.as_ref())?;
        }
        Self::from_tree(root, &self.path)
    }

    /// The scene as asked, overrides folded in, as TOML; for file headers.
    pub fn effective(&self) -> String {
        toml::to_string(&self.root.to_toml()).unwrap_or_else(|e| format!("# not writable as TOML: {e}"))
    }

    /// [`Self::effective`] without what decides no bit of a sample: how many there are, and how they are shown.
    pub fn decisive(&self) -> String {
        toml::to_string(&self.decisive_root().to_toml()).unwrap_or_else(|e| format!("# not writable as TOML: {e}"))
    }

    /// The first value that is not that of `other`, a scene as [`Self::decisive`] writes it: where it was typed, both
    /// values. `None` where `other` is no scene or the same one.
    pub fn difference(&self, other: &str) -> Option<String> {
        let there = Node::parse(other, &self.path).ok()?;
        let here = self.decisive_root();
        let found = difference::first(&here, &there)?;
        Some(format!("{}: {}", found.place.within(&self.path), found.values("here", "in the film")))
    }

    fn decisive_root(&self) -> Node {
        let mut root = self.root.clone();
        if let Value::Table(sections) = &mut root.value {
            for (_, section) in sections.iter_mut().filter(|(name, _)| name == "render") {
                if let Value::Table(keys) = &mut section.value {
                    keys.retain(|(key, _)| key != "spp" && key != "exposure");
                }
            }
            sections.retain(|(name, section)| {
                name != "render" || !matches!(&section.value, Value::Table(keys) if keys.is_empty())
            });
        }
        root
    }

    /// Every file that the scene names, with what it is: meshes once each, the picture of the environment, those of materials, and what meshes are read from beside their files.
    pub fn inputs(&self) -> Vec<(String, PathBuf)> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let mut seen = HashSet::new();
        let meshes = self.objects.iter().filter_map(|object| match &object.geometry {
            Geometry::Mesh(path) => Some((format!("the mesh of object {:?}", object.name), path)),
            _ => None,
        });
        let mut looked_at = HashSet::new();
        let beside = self.objects.iter().filter_map(|object| match &object.geometry {
            Geometry::Mesh(path) if looked_at.insert(path) => {
                Some((format!("a buffer of the mesh of object {:?}", object.name), files_beside(&folder.join(path))))
            }
            _ => None,
        });
        let beside = beside.flat_map(|(what, paths)| paths.into_iter().map(move |path| (what.clone(), path)));
        let sky = self.environment.image.iter().map(|path| ("the picture of [environment]".to_string(), path));
        let pictures = self.materials.iter().flat_map(|material| {
            material.images().map(|entry| (format!("the picture of material {:?}", material.name), &entry.image))
        });
        let all = meshes.chain(sky).chain(pictures).map(|(what, path)| (what, folder.join(path)));
        all.chain(beside).filter(|(_, path)| seen.insert(path.clone())).collect()
    }

    fn from_tree(root: Node, path: &Path) -> Result<Self> {
        let top = Fields::open(path, String::new(), &root)?;
        top.only("a scene", SECTIONS)?;
        let unit_in_mm = top.get("unit", UNIT, unit)?;
        let materials = materials::read(&top, unit_in_mm)?;
        let file = Self {
            path: path.to_path_buf(),
            unit_in_mm,
            camera: camera_entry::read(&top)?,
            objects: objects::read(&top, &materials)?,
            environment: environment::read(&top)?,
            lights: lights::read(&top, unit_in_mm)?,
            method: method(&top)?,
            render: render(&top)?,
            materials,
            root: root.clone(),
        };
        refuse_unknown_thickness(&file)?;
        Ok(file)
    }
}

/// Refuses a material whose model needs a thickness that neither it has nor each of its objects.
fn refuse_unknown_thickness(file: &SceneFile) -> Result<()> {
    for (number, material) in file.materials.iter().enumerate() {
        let Some(what) = &material.without_thickness else { continue };
        let mut objects = file.objects.iter().filter(|o| o.material == number).peekable();
        if objects.peek().is_none() || objects.any(|o| o.thickness.is_none()) {
            return Err(Error::scene(what.clone()));
        }
    }
    Ok(())
}

fn method(top: &Fields<'_>) -> Result<MethodOptions> {
    let Some(m) = top.table("method")? else { return Ok(MethodOptions::default()) };
    let keys = [
        "name",
        "radius",
        "rays",
        "light_samples",
        "cache_samples",
        "estimator",
        "cut_error",
        "model",
        "entry",
        "spread",
        "shape",
        "specular",
        "single",
        "bounces",
        "orders",
        "photons",
    ];
    m.only("[method]", &keys)?;
    Ok(MethodOptions {
        name: named_value(&m, "name")?,
        radius: m.get("radius", "a length above 0", |n| n.number().filter(|v| *v > 0.0))?,
        rays: whole(&m, "rays", 1 << 16)?,
        light_samples: whole(&m, "light_samples", 1 << 16)?,
        cache_samples: whole(&m, "cache_samples", 1 << 24)?,
        estimator: named_value(&m, "estimator")?,
        cut_error: m
            .get("cut_error", "a number from 1e-4 to 1", |n| n.number().filter(|v| (1e-4..=1.0).contains(v)))?,
        model: named_value(&m, "model")?,
        entry: named_value(&m, "entry")?,
        spread: named_value(&m, "spread")?,
        shape: named_value(&m, "shape")?,
        specular: switch(&m, "specular")?,
        single: switch(&m, "single")?,
        orders: named_value(&m, "orders")?,
        bounces: whole_or_none(&m, "bounces")?,
        photons: whole_or_none(&m, "photons")?,
    })
}

fn render(top: &Fields<'_>) -> Result<RenderOptions> {
    let Some(r) = top.table("render")? else { return Ok(RenderOptions::default()) };
    r.only("[render]", &["spp", "seed", "exposure", "filter", "filter_radius"])?;
    let filter = named_value(&r, "filter")?;
    let filter_radius = r.get("filter_radius", "a number of pixels from 0.25 to 8", |n| {
        n.number().filter(|v| (0.25..=8.0).contains(v))
    })?;
    if filter_radius.is_some() && filter.is_none_or(|f| f == FilterName::Box) {
        return Err(r.error_at(
            "filter_radius",
            "stands without a filter that has one: the box is the pixel itself; set filter = \"gaussian\" or \"blackman-harris\", or remove it",
        ));
    }
    Ok(RenderOptions {
        filter,
        filter_radius,
        spp: whole(&r, "spp", 1 << 24)?,
        seed: r.get("seed", "a whole number, not negative", |n| n.integer().and_then(|i| u64::try_from(i).ok()))?,
        exposure: r.get("exposure", "stops from -64 to 64", |n| n.number().filter(|v| v.abs() <= 64.0))?,
    })
}
