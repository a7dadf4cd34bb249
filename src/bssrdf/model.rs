//! The models by name: what a scene or a command line may ask for.

use super::Bssrdf;
use crate::error::{Error, Result};
use crate::optics::{FresnelMoments, Medium};

/// A row of the registry: what is known of a model before it is made of a medium.
#[non_exhaustive]
pub struct ModelKind {
    /// The name in scene files and on the command line.
    pub name: &'static str,
    /// What it heeds beside the exit normalisation.
    pub takes: &'static [ModelOption],
    /// Whether it has the exit factor 1/(4 C_phi(1/η)) always.
    pub own_exit_factor: bool,
    /// The head of its columns in the table of measured errors; `None` where nothing has been measured.
    pub evidence: fn(&ModelOptions) -> Option<&'static str>,
    /// Makes it of a medium.
    pub build: fn(&Medium, &ModelOptions) -> Result<Box<dyn Bssrdf>>,
}

impl ModelKind {
    /// A model without options of its own, of whose error nothing is known.
    pub const fn new(name: &'static str, build: fn(&Medium, &ModelOptions) -> Result<Box<dyn Bssrdf>>) -> Self {
        Self { name, takes: &[], own_exit_factor: false, evidence: |_| None, build }
    }
}

/// Extinction in the near-field correction κ = 1 - exp(-2 σ (d_r + t)). Published code differs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KappaExtinction {
    /// σ_t′. Nearer to the truth in the near field.
    #[default]
    Reduced,
    /// σ_t, not reduced. For g > 0 nearer to the truth in the total: 1 to 3 % off at g = 0.8 and albedos from 0.9
    /// to 0.999, where the reduced one is 5 to 14 % low. The same for g = 0.
    Full,
}

/// What only some models heed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelOption {
    /// [`ModelOptions::thickness`].
    Thickness,
    /// [`ModelOptions::eta_far`].
    EtaFar,
    /// [`ModelOptions::calibrated`].
    Calibrated,
    /// [`ModelOptions::kappa`] in full.
    KappaFull,
    /// Albedo and length of a fit in place of a medium, see [`super::NormalisedDiffusion::from_albedo`].
    Width,
    /// Light that leaves by the far face, see [`super::Slab::transmitted`].
    Transmitted,
    /// [`ModelOptions::boundary`].
    Boundary,
}

/// What a model is made with beside its medium. Each heeds what [`ModelKind::takes`] says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelOptions {
    /// Divide S_d by 4 C_phi(1/η), so that the exit Fresnel factor loses no energy; off, dipoles give R_d / π as \[JMLH01\]
    /// prints it.
    pub exit_normalisation: bool,
    /// Thickness of the object \[unit\]; the models of half spaces do not heed it.
    pub thickness: Option<f32>,
    /// n_inside / n_outside of the far face of a slab; that of the lit face if absent.
    pub eta_far: Option<f32>,
    /// Scale the model to the true albedo of the half space.
    pub calibrated: bool,
    /// The extinction in the near-field correction of photon beams.
    pub kappa: KappaExtinction,
    /// Moments of a boundary that is not smooth; those of a smooth one if absent.
    pub boundary: Option<FresnelMoments>,
}

impl ModelOptions {
    /// A half space, normalised, as published otherwise.
    pub const DEFAULT: Self = Self {
        exit_normalisation: true,
        thickness: None,
        eta_far: None,
        calibrated: false,
        kappa: KappaExtinction::Reduced,
        boundary: None,
    };

    /// Moments of the boundary of `medium`.
    pub fn moments(&self, medium: &Medium) -> FresnelMoments {
        self.boundary.unwrap_or_else(|| FresnelMoments::new(f64::from(medium.eta)))
    }

    /// A sheet of `thickness` \[unit\].
    pub fn thick(thickness: f32) -> Self {
        Self { thickness: Some(thickness), ..Self::DEFAULT }
    }
}

impl Default for ModelOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A registered model.
#[derive(Clone, Copy)]
pub struct ModelName(pub(super) &'static ModelKind);

/// Declares the models, a file each with a `MODEL`, and registers them in that order.
macro_rules! registry {
    ($($model:ident),+ $(,)?) => {
        $(mod $model;)+

        impl ModelName {
            /// All models, and `auto` last.
            pub const ALL: &'static [Self] = &[$(Self(&$model::MODEL)),+];
        }
    };
}
pub(super) use registry;

impl ModelName {
    /// All but `auto`.
    pub fn models() -> impl Iterator<Item = Self> + Clone {
        Self::ALL.iter().copied().filter(|name| *name != Self::AUTO)
    }

    /// The models of a half space: those that heed no thickness.
    pub fn half_spaces() -> impl Iterator<Item = Self> + Clone {
        Self::models().filter(|name| !name.takes(ModelOption::Thickness))
    }

    /// The name in scene files and on the command line.
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// Whether it heeds `option`.
    pub fn takes(self, option: ModelOption) -> bool {
        self.0.takes.contains(&option)
    }

    /// What has measured its error, see [`ModelKind::evidence`].
    pub fn evidence(self, options: &ModelOptions) -> Option<&'static str> {
        (self.0.evidence)(options)
    }

    /// Whether S_d is divided by 4 C_phi(1/η).
    pub fn normalises_exit(self, asked: bool) -> bool {
        asked || self.0.own_exit_factor
    }

    /// The model of `medium`.
    ///
    /// # Errors
    /// A slab without a thickness, and all that [`super::Slab::between`] refuses.
    pub fn build(self, medium: &Medium, options: &ModelOptions) -> Result<Box<dyn Bssrdf>> {
        if options.boundary.is_some() && self != Self::AUTO && !self.takes(ModelOption::Boundary) {
            return Err(Error::scene(format!(
                "the model `{}` knows of smooth boundaries alone: take `standard`, `better` or `normalised`, name no model, or leave out `roughness`",
                self.name()
            )));
        }
        (self.0.build)(medium, options)
    }
}

/// Names are as good as what they name.
impl PartialEq for ModelName {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for ModelName {}

impl std::fmt::Debug for ModelName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for ModelName {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.iter().copied().find(|m| m.name() == name).ok_or_else(|| {
            let hint = crate::error::did_you_mean(name, Self::ALL.iter().map(|m| m.name()));
            Error::usage(format!("no BSSRDF model `{name}`{hint}"))
        })
    }
}

/// Every model of `medium`, those of a sheet five transport mean free paths thick: for tests and comparisons.
///
/// # Errors
/// A medium that no slab can be made of.
pub fn all_models(medium: &Medium, exit_normalisation: bool) -> Result<Vec<Box<dyn Bssrdf>>> {
    let paths = medium.transport_mean_free_path().0.into_iter().filter(|l| l.is_finite());
    let thickness = Some(5.0 * paths.fold(0.0, f32::max));
    let options = ModelOptions { exit_normalisation, thickness, ..ModelOptions::DEFAULT };
    ModelName::models().map(|name| name.build(medium, &options)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Entry, Exit, choose};
    use super::*;
    use crate::math::{Rgb, Vec3};

    #[test]
    fn names_are_read_back_and_a_slip_is_met_with_the_nearest() {
        for name in ModelName::ALL {
            assert_eq!(name.name().parse::<ModelName>().unwrap(), *name);
        }
        let slip = "standart".parse::<ModelName>().unwrap_err().to_string();
        assert!(slip.contains("did you mean `standard`"), "{slip}");
    }

    #[test]
    fn a_slab_has_a_thickness_and_auto_becomes_a_model() {
        let medium = Medium::reduced(Rgb::splat(2.0), Rgb::splat(0.01), 1.3).unwrap();
        let make = |name: ModelName, thickness| {
            let model = name.build(&medium, &ModelOptions { thickness, ..ModelOptions::DEFAULT });
            model.map(|model| model.name())
        };
        assert!(make(ModelName::SLAB, None).unwrap_err().to_string().contains("thickness"));
        assert!(make(ModelName::SLAB, Some(0.4)).is_err());
        assert_eq!(make(ModelName::SLAB, Some(3.0)).unwrap(), ModelName::SLAB);
        assert_eq!(make(ModelName::AUTO, Some(3.0)).unwrap(), ModelName::SLAB);
        assert_eq!(make(ModelName::AUTO, None).unwrap(), choose(&medium, None).name);
        for name in ModelName::half_spaces() {
            assert_eq!(make(name, None).unwrap(), name);
        }
    }

    /// A boundary that lets more through keeps less light in, and models that know of none but smooth ones say so.
    #[test]
    fn models_take_the_moments_of_a_boundary() {
        let medium = Medium::reduced(Rgb::splat(2.0), Rgb::splat(0.2), 1.5).unwrap();
        // All that is not totally reflected goes through.
        let critical = (1.0_f64 - 1.0 / 2.25).sqrt();
        let boundary = Some(FresnelMoments::of_transmittance(1.0, 1.5, |mu| if mu > critical { 1.0 } else { 0.0 }));
        let with = |name: ModelName| name.build(&medium, &ModelOptions { boundary, ..ModelOptions::DEFAULT });
        let without = |name: ModelName| name.build(&medium, &ModelOptions::DEFAULT).unwrap();
        for name in [ModelName::STANDARD, ModelName::BETTER, ModelName::NORMALISED, ModelName::AUTO] {
            assert!(with(name).unwrap().total()[0] > 1.01 * without(name).total()[0], "{name:?}");
        }
        // By hand: (α′/2) (exp(-s) + exp(-s z_v)), A = (1 + 2 C_1) / (1 - 2 C_1) with 2 C_1 = 1 - 1 / 2.25.
        let (alpha, a) = (2.0_f64 / 2.2, (2.0 - 1.0 / 2.25) * 2.25);
        let s = (3.0 * (1.0 - alpha)).sqrt();
        let total = 0.5 * alpha * ((-s).exp() + (-s * (1.0 + 4.0 / 3.0 * a)).exp());
        assert!((f64::from(with(ModelName::STANDARD).unwrap().total()[0]) / total - 1.0).abs() < 1e-5);
        assert_eq!(with(ModelName::AUTO).unwrap().name(), ModelName::STANDARD);
        for name in [ModelName::BEAM, ModelName::DIRECTIONAL] {
            assert!(with(name).err().unwrap().to_string().contains("smooth boundaries alone"), "{name:?}");
        }
    }

    #[test]
    fn exit_normalisation_divides_s_d_and_leaves_the_exitance() {
        let medium = Medium::reduced(Rgb::splat(2.0), Rgb::splat(0.01), 1.5).unwrap();
        for name in [ModelName::STANDARD, ModelName::BETTER, ModelName::NORMALISED] {
            let [on, off] = [true, false].map(|exit_normalisation| {
                name.build(&medium, &ModelOptions { exit_normalisation, ..ModelOptions::DEFAULT }).unwrap()
            });
            let (on, off) = (on.radial().unwrap(), off.radial().unwrap());
            let (entry, exit) =
                (Entry { x: Vec3::ZERO, n: Vec3::Z, w: -Vec3::Z }, Exit { x: Vec3::X, n: Vec3::Z, w: Vec3::Z });
            let ratio = off.eval(&entry, &exit)[0] / on.eval(&entry, &exit)[0];
            // 4 C_phi(1/1.5)
            assert!((ratio - 0.908_222).abs() < 1e-6, "{name:?}: {ratio}");
            assert!((on.exitance(1.0)[0] / off.exitance(1.0)[0] - 1.0).abs() < 1e-6, "{name:?}");
        }
    }
}
