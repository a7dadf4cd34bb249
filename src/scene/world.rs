//! The checked world: everything in scene units, relative to the scene's centre.

use super::{Body, Camera, Environment, Insides, LightSource, ObstacleKind};
use crate::bssrdf::{Bssrdf, ModelName, ModelOption, ModelOptions, choose_behind};
use crate::error::Result;
use crate::geometry::{Findings, Mesh};
use crate::math::{DVec3, Rgb};
use crate::optics::Medium;
use crate::surface::{Boundary, Bsdf, Colour, Lambertian, Relief, RoughBoundary, Texture};
use std::sync::Arc;

/// A scene whose numbers have been checked.
pub struct Scene {
    /// Where it came from, for messages.
    pub name: String,
    /// Length of one unit \[mm\]; `None` if the file does not say.
    pub unit_in_mm: Option<f64>,
    /// Where the scene's own origin lies in file coordinates \[unit\]: the centre of the translucent objects, or of all where
    /// there are none. Numbers are finest there.
    pub centre: DVec3,
    /// The camera.
    pub camera: Camera,
    /// All surfaces; index = mesh index of a ray backend.
    pub objects: Vec<Object>,
    /// The bodies of the objects, one for each; `None` where an object bounds none.
    pub bodies: Vec<Option<Arc<Body>>>,
    /// All materials; objects point into this list.
    pub materials: Vec<Material>,
    /// Light from every direction that meets no surface; black without one.
    pub environment: Environment,
    /// Lights that are no surface.
    pub lights: Vec<LightSource>,
    /// Why rays are traced in f64, where they are: the object that f32 cannot hold, with its numbers.
    pub why_double: Option<String>,
    /// Oddities a user should hear of, in order of the file.
    pub warnings: Vec<String>,
    /// What is inside what, once somebody has asked.
    pub insides: Insides,
}

/// A mesh with a material: an object of the scene file, or several that are one body.
pub struct Object {
    /// Name in the scene file; of several objects, that of their body.
    pub name: String,
    /// Names of the objects of the scene file that it is made of.
    pub parts: Vec<String>,
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
    /// Where bodies overlap, the one of the higher priority is there.
    pub priority: i32,
    /// Thickness of the sheet that was made of an open mesh \[unit\]; `None` where the mesh is as in the file.
    pub sheet: Option<f64>,
}

/// A surface by name.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the scene file.
    pub name: String,
    /// What it does with light.
    pub surface: Surface,
}

/// What a surface does with light: what it reflects and lets through, what it sends out, what is behind it.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Reflection and transmission.
    pub bsdf: Arc<dyn Bsdf>,
    /// What it sends out; of a lamp.
    pub emission: Option<Emission>,
    /// The scattering medium where the outward normal does not point; of a translucent body.
    pub inside: Option<Translucent>,
    /// What is there of a clear body.
    pub clear: Option<Dielectric>,
    /// What bends its shading normals.
    pub relief: Option<Arc<Relief>>,
    /// Chance that it is there at a point, the red channel; of opaque surfaces.
    pub opacity: Option<Arc<Texture>>,
}

/// The inside of a clear body: it refracts and absorbs, but does not scatter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Refractive index, that of air being 1.
    pub eta: f32,
    /// Absorption [1/unit].
    pub sigma_a: Rgb,
}

/// Constant radiance of a lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance [same unit as the environment].
    pub radiance: Rgb,
    /// Both faces shine, not only the outward one.
    pub two_sided: bool,
}

impl Surface {
    /// Lambertian, both sides alike; `albedo` in [0, 1].
    pub fn diffuse(albedo: Rgb) -> Self {
        Self::opaque(Arc::new(Lambertian { albedo }))
    }

    /// An opaque surface of any kind.
    pub fn opaque(bsdf: Arc<dyn Bsdf>) -> Self {
        Self { bsdf, emission: None, inside: None, clear: None, relief: None, opacity: None }
    }

    /// A lamp, which reflects nothing.
    pub fn emissive(emission: Emission) -> Self {
        Self { emission: Some(emission), ..Self::opaque(Arc::new(Lambertian::BLACK)) }
    }

    /// A scattering medium behind its boundary.
    pub fn translucent(inside: Translucent) -> Self {
        let bsdf: Arc<dyn Bsdf> = match &inside.rough {
            Some(rough) => rough.clone(),
            None => Arc::new(Boundary { eta: inside.medium.eta }),
        };
        Self { inside: Some(inside), ..Self::opaque(bsdf) }
    }

    /// A clear body behind a smooth boundary.
    pub fn dielectric(clear: Dielectric) -> Self {
        Self { clear: Some(clear), ..Self::opaque(Arc::new(Boundary { eta: clear.eta })) }
    }

    /// The pictures on it, for which points need texture coordinates.
    pub fn pictures(&self) -> impl Iterator<Item = &Arc<Texture>> {
        let tint = self.inside.as_ref().and_then(|inside| inside.tint.as_ref()?.picture());
        let relief = self.relief.as_ref().map(|relief| relief.texture());
        self.bsdf.textures().into_iter().chain(tint).chain(relief).chain(&self.opacity)
    }

    /// What fills the body behind it; of translucent and clear bodies.
    pub fn medium(&self) -> Option<Medium> {
        let clear = |c: &Dielectric| Medium { sigma_a: c.sigma_a, sigma_s: Rgb::BLACK, g: 0.0, eta: c.eta };
        self.inside.as_ref().map(|t| t.medium).or_else(|| self.clear.as_ref().map(clear))
    }

    /// Whether it bounds a body of some medium, translucent or clear.
    pub fn is_body(&self) -> bool {
        self.inside.is_some() || self.clear.is_some()
    }

    /// Whether light goes in and is scattered there.
    pub fn is_translucent(&self) -> bool {
        self.inside.is_some()
    }

    /// Whether it is neither a lamp nor the boundary of a body.
    pub fn is_opaque(&self) -> bool {
        self.emission.is_none() && !self.is_body()
    }

    /// Whether it is opaque, and reflects alike into all directions.
    pub fn is_lambertian(&self) -> bool {
        self.is_opaque() && self.bsdf.is_lambertian()
    }

    /// Whether it sends out any light.
    pub fn shines(&self) -> bool {
        self.emission.is_some_and(|e| !e.radiance.is_black())
    }
}

/// A medium and the model asked for it.
#[derive(Clone, Debug)]
pub struct Translucent {
    /// Coefficients per scene unit.
    pub medium: Medium,
    /// BSSRDF model asked for.
    pub model: ModelName,
    /// Thickness of a slab \[unit\], for the models `slab` and `auto`.
    pub thickness: Option<f32>,
    /// The model `directional` scaled to the true albedo.
    pub calibrated: bool,
    /// Divide S_d by 4 C_phi(1/eta), so that the exit Fresnel factor loses no energy.
    pub exit_normalisation: bool,
    /// Its boundary, if that is not smooth.
    pub rough: Option<Arc<RoughBoundary>>,
    /// Pigment on its boundary: share in [0, 1] of each channel that passes, each time.
    pub tint: Option<Colour>,
    /// Where the numbers come from, for logs and headers.
    pub source: String,
}

impl Scene {
    /// The bodies of `objects`, for [`Self::bodies`].
    pub fn bodies_of(objects: &[Object], materials: &[Material]) -> Vec<Option<Arc<Body>>> {
        let of = |(index, o): (u32, &Object)| {
            materials[o.material].surface.medium()?;
            let body = Body::new(index, &o.parts, &o.mesh, &o.findings)?;
            Some(Arc::new(Body { thickness: body.thickness.map(|t| o.sheet.unwrap_or(t)), ..body }))
        };
        (0..).zip(objects).map(of).collect()
    }

    /// Whether an obstacle of this kind concerns one of [`Self::objects`].
    pub fn has(&self, object: &Object, kind: ObstacleKind) -> bool {
        self.obstacles().iter().any(|o| o.kind == kind && o.objects.contains(&object.name))
    }

    /// Whether any of its bodies is clear: refracts and absorbs, but does not scatter.
    pub fn has_clear_bodies(&self) -> bool {
        self.objects.iter().any(|o| self.materials[o.material].surface.clear.is_some())
    }

    /// Whether nothing sends out light: no emissive object, no other light, no environment.
    pub fn is_dark(&self) -> bool {
        let shines = |o: &Object| self.materials[o.material].surface.shines();
        let lit = self.lights.iter().any(|light| !light.kind.amount().is_black());
        self.environment.is_black() && !lit && !self.objects.iter().any(shines)
    }

    /// The body behind the surface of an object.
    #[inline]
    pub fn body(&self, object: u32) -> Option<&Arc<Body>> {
        self.bodies[object as usize].as_ref()
    }

    /// The surface of an object.
    #[inline]
    pub fn surface(&self, object: u32) -> &Surface {
        &self.materials[self.objects[object as usize].material].surface
    }
}

impl Translucent {
    /// Lays pigment on the boundary.
    pub fn dye(&mut self, tint: Colour) {
        self.source = format!("{}, tint {}", self.source, tint.text());
        self.tint = Some(tint);
    }

    /// The model asked for, of this medium.
    ///
    /// # Errors
    /// A slab without a thickness, or one that is too thin for its medium.
    pub fn build(&self) -> Result<Box<dyn Bssrdf>> {
        self.model.build(&self.medium, &self.options())
    }

    /// The model that says what is finer than walks tell: the one asked for, or the smoothest. Which one it is hardly matters there
    /// (docs/shape.md), and `standard` has light of every order in one sum without noise of its own.
    pub fn model_under_walks(&self) -> ModelName {
        if self.model == ModelName::AUTO { ModelName::STANDARD } else { self.model }
    }

    /// What the model is made with.
    pub fn options(&self) -> ModelOptions {
        let &Self { exit_normalisation, thickness, calibrated, .. } = self;
        let boundary = self.rough.as_ref().map(|rough| rough.moments());
        ModelOptions { exit_normalisation, thickness, calibrated, boundary, ..ModelOptions::DEFAULT }
    }

    /// The model as logs and file headers name it: with its variant, and for `auto` the choice and the reason.
    pub fn model_text(&self) -> String {
        let name = self.model.name();
        match self.thickness {
            _ if self.model == ModelName::AUTO => choose_behind(&self.medium, &self.options()).to_string(),
            _ if self.calibrated && self.model.takes(ModelOption::Calibrated) => format!("{name} (calibrated)"),
            Some(thickness) if self.model.takes(ModelOption::Thickness) => format!("{name} ({thickness} unit thick)"),
            _ => name.into(),
        }
    }
}
