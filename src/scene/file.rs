//! What can be typed: one struct a section, every number checked alone. What needs meshes is checked in `load.rs`.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::environment::{self, EnvironmentEntry};
use super::lights::{self, LightSource};
use super::materials::{self, MaterialEntry};
use super::objects::{self, ObjectEntry};
use super::options::{MethodOptions, RenderOptions, named};
use super::tree::{Fields, Node, Value};
use super::values::{UNIT, named_value, switch, unit, unit_vector, vector, whole, whole_or_none};
use super::{Geometry, difference};
use crate::error::{Error, Result};
use crate::input;
use crate::math::DVec3;

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

/// `[camera]`.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraEntry {
    /// Pinhole \[unit\].
    pub position: DVec3,
    /// A point in the middle of the picture \[unit\].
    pub look_at: DVec3,
    /// Upwards in the picture, of any length; need not be orthogonal to the view.
    pub up: DVec3,
    /// Full angle of view \[degrees\], in (0, 180).
    pub fov: f64,
    /// The side of the picture that `fov` spans.
    pub fov_axis: FovAxis,
    /// Pixels across and down, 1 to 65536 each.
    pub resolution: [u32; 2],
}

named! {
    /// A side of the picture.
    FovAxis, "side of the picture",
    /// Bottom to top.
    Vertical = "vertical",
    /// Left to right.
    Horizontal = "horizontal",
    /// Whichever has fewer pixels.
    Smaller = "smaller"
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

    /// Every file that the scene names, with what it is: meshes once each, the picture of the environment.
    pub fn inputs(&self) -> Vec<(String, PathBuf)> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let mut seen = HashSet::new();
        let meshes = self.objects.iter().filter_map(|object| match &object.geometry {
            Geometry::Mesh(path) => Some((format!("the mesh of object {:?}", object.name), path)),
            _ => None,
        });
        let sky = self.environment.image.iter().map(|path| ("the picture of [environment]".to_string(), path));
        let all = meshes.chain(sky).map(|(what, path)| (what, folder.join(path)));
        all.filter(|(_, path)| seen.insert(path.clone())).collect()
    }

    fn from_tree(root: Node, path: &Path) -> Result<Self> {
        let top = Fields::open(path, String::new(), &root)?;
        top.only("a scene", SECTIONS)?;
        let unit_in_mm = top.get("unit", UNIT, unit)?;
        let materials = materials::read(&top, unit_in_mm)?;
        let file = Self {
            path: path.to_path_buf(),
            unit_in_mm,
            camera: camera(&top)?,
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

fn camera(top: &Fields<'_>) -> Result<CameraEntry> {
    let expected = "a [camera] with position, look_at, fov and resolution";
    let c = top.table("camera")?.ok_or_else(|| top.missing("camera", expected))?;
    c.only("[camera]", &["position", "look_at", "up", "fov", "fov_axis", "resolution"])?;
    let point = "three numbers [x, y, z]";
    let side = |v: f64| (1.0..=65536.0).contains(&v) && v.fract() == 0.0;
    let camera = CameraEntry {
        position: c.need("position", point, vector)?,
        look_at: c.need("look_at", point, vector)?,
        up: c
            .get("up", "three numbers [x, y, z], not all 0", |n| vector(n).filter(|v| *v != DVec3::ZERO))?
            .unwrap_or(DVec3::Y),
        fov: c.need("fov", "degrees above 0 and below 180", |n| n.number().filter(|v| *v > 0.0 && *v < 180.0))?,
        fov_axis: named_value(&c, "fov_axis")?.unwrap_or(FovAxis::Vertical),
        resolution: c.need("resolution", "[width, height], each a whole number from 1 to 65536", |n| {
            n.numbers::<2>().filter(|wh| wh.iter().all(|v| side(*v))).map(|wh| wh.map(|v| v as u32))
        })?,
    };
    let view = unit_vector(camera.look_at - camera.position).ok_or_else(|| {
        c.error_at("look_at", "is the same point as `camera.position`; expected a point in front of the camera")
    })?;
    let aside = unit_vector(camera.up).map_or(0.0, |up| up.cross(view).length());
    if aside < 1e-6 {
        return Err(c.error_at(
            if c.has("up") { "up" } else { "look_at" },
            format_args!("leaves the view parallel to up ({}); set `up` to another direction", camera.up),
        ));
    }
    Ok(camera)
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
    r.only("[render]", &["spp", "seed", "exposure"])?;
    Ok(RenderOptions {
        spp: whole(&r, "spp", 1 << 24)?,
        seed: r.get("seed", "a whole number, not negative", |n| n.integer().and_then(|i| u64::try_from(i).ok()))?,
        exposure: r.get("exposure", "stops from -64 to 64", |n| n.number().filter(|v| v.abs() <= 64.0))?,
    })
}
