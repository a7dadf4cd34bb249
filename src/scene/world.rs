//! The checked world: everything in scene units, relative to the scene's centre.

use super::{Camera, Environment, Insides, Obstacle, ObstacleKind, Remark, doctor};
use crate::bssrdf::{DirectionalDipole, Model, ModelName, choose};
use crate::error::Result;
use crate::geometry::{Findings, Mesh};
use crate::math::{DVec3, Rgb};
use crate::optics::Medium;

/// A scene whose numbers have been checked.
pub struct Scene {
    /// Where it came from, for messages.
    pub name: String,
    /// Length of one unit [mm]; `None` if the file does not say.
    pub unit_in_mm: Option<f64>,
    /// Where the scene's own origin lies in file coordinates [unit]: the centre of the translucent objects, or of all where
    /// there are none. Numbers are finest there.
    pub centre: DVec3,
    /// The camera.
    pub camera: Camera,
    /// All surfaces; index = mesh index of a ray backend.
    pub objects: Vec<Object>,
    /// All materials; objects point into this list.
    pub materials: Vec<Material>,
    /// Light from every direction that meets no surface; black without one.
    pub environment: Environment,
    /// Why rays are traced in f64, where they are: the object that f32 cannot hold, with its numbers.
    pub why_double: Option<String>,
    /// Oddities a user should hear of, in order of the file.
    pub warnings: Vec<String>,
    /// What is inside what, once somebody has asked.
    pub insides: Insides,
}

/// A mesh with a material.
pub struct Object {
    /// Name in the scene file.
    pub name: String,
    /// The mesh in scene space.
    pub mesh: Mesh,
    /// Where it stands in the scene file, for messages.
    pub at: String,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Whether its faces were turned over by `flip = true`.
    pub flipped: bool,
    /// What is wrong with the mesh.
    pub findings: Findings,
}

/// What a surface does to light.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the scene file.
    pub name: String,
    /// The kind and its numbers.
    pub surface: Surface,
}

/// Kinds of surface.
#[derive(Clone, Debug)]
pub enum Surface {
    /// Lambertian, both sides alike; `albedo` in [0, 1].
    Diffuse {
        /// Reflected over incident flux.
        albedo: Rgb,
    },
    /// Sends out constant radiance, reflects nothing.
    Emissive {
        /// Radiance [same unit as the environment].
        radiance: Rgb,
        /// Both faces shine, not only the outward one.
        two_sided: bool,
    },
    /// A scattering medium behind a smooth boundary.
    Translucent(Translucent),
}

/// A medium and the model asked for it.
#[derive(Clone, Debug)]
pub struct Translucent {
    /// Coefficients per scene unit.
    pub medium: Medium,
    /// BSSRDF model asked for.
    pub model: ModelName,
    /// Thickness of a slab [unit], for the models `slab` and `auto`.
    pub thickness: Option<f32>,
    /// The model `directional` scaled to the true albedo.
    pub calibrated: bool,
    /// Divide S_d by 4 C_phi(1/eta), so that the exit Fresnel factor loses no energy.
    pub exit_normalisation: bool,
    /// Where the numbers come from, for logs and headers.
    pub source: String,
}

impl Scene {
    /// What there is to say about the mesh of one of [`Self::objects`]; nothing if it is sound.
    pub fn remarks(&self, object: &Object) -> Vec<Remark> {
        let mut remarks = doctor::remarks(object, &self.materials[object.material].surface);
        // Of a sheet its obstacle says it all.
        let sheet = |o: &Obstacle| o.kind == ObstacleKind::Sheet && o.objects.contains(&object.name);
        if object.findings.open_edges > 0 && self.obstacles().iter().any(sheet) {
            remarks.retain(|r| !r.text.contains("rims of holes"));
        }
        remarks
    }

    /// The surface of an object.
    #[inline]
    pub fn surface(&self, object: u32) -> &Surface {
        &self.materials[self.objects[object as usize].material].surface
    }
}

impl Translucent {
    /// The model asked for, of this medium.
    ///
    /// # Errors
    /// A slab without a thickness, or one that is too thin for its medium.
    pub fn build(&self) -> Result<Model> {
        if self.model == ModelName::Directional && self.calibrated {
            return Ok(Model::Directional(DirectionalDipole::new(&self.medium, true)));
        }
        Model::with_thickness(self.model, &self.medium, self.thickness, self.exit_normalisation)
    }

    /// The model as logs and file headers name it: with its variant, and for `auto` the choice and the reason.
    pub fn model_text(&self) -> String {
        match self.model {
            ModelName::Auto => choose(&self.medium, self.thickness).to_string(),
            ModelName::Directional if self.calibrated => "directional (calibrated)".into(),
            ModelName::Slab => format!("slab ({} unit thick)", self.thickness.unwrap_or(f32::NAN)),
            name => name.name().into(),
        }
    }
}
