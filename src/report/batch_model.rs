//! From the numbers of one row of a batch to a model, and to the values at one pair of points.

use crate::bssrdf::{
    Bssrdf, ChannelMedium, Entry, Exit, ModelName, ModelOptions, NormalisedDiffusion, SingleChannel, WidthFit,
};
use crate::math::{DVec3, Rgb, Vec3};
use crate::optics::{FresnelMoments, Medium};
use crate::{Error, Result};

/// Which model a batch evaluates.
#[derive(Clone, Copy, Debug)]
pub struct BatchOptions {
    /// The model.
    pub model: ModelName,
    /// How it is made; thickness and far index are a row's own.
    pub made: ModelOptions,
    /// The fit that makes a width of the columns `A` and `l`, model `normalised`.
    pub width: WidthFit,
    /// Rows with r: exit by the far face of the `slab`.
    pub transmitted: bool,
    /// 0 where the formula is negative, as rendering has it; else the formula's own value.
    pub clamped: bool,
    /// Append exact single scattering too: exitance of a plane [1/unit²] per entered flux.
    pub single: bool,
}

impl BatchOptions {
    /// `model` as a scene would use it.
    pub fn new(model: ModelName) -> Self {
        Self {
            model,
            made: ModelOptions::DEFAULT,
            width: WidthFit::DiffusionLength,
            transmitted: false,
            clamped: false,
            single: false,
        }
    }
}

/// How far a given direction or normal may be from unit length.
const UNIT_TOLERANCE: f64 = 1e-3;

/// The inputs of a row, as typed.
pub(super) struct Inputs {
    pub substance: Substance,
    /// n_inside / n_outside of the lit face.
    pub eta: f64,
    /// Of a slab [unit].
    pub thickness: Option<f64>,
    /// n_inside / n_outside of the far face of a slab.
    pub eta_far: Option<f64>,
}

/// What scatters.
pub(super) enum Substance {
    /// Coefficients [1/unit], `sigma_s` not reduced, and the mean cosine.
    Coefficients { sigma_s: f64, sigma_a: f64, g: f64 },
    /// Model `normalised`: the albedo A and the length l [unit] of its fit.
    Profile { albedo: f64, length: f64 },
}

impl Inputs {
    /// What tells media of one batch apart.
    pub fn key(&self) -> [u64; 6] {
        let far = [self.thickness, self.eta_far].map(|v| v.unwrap_or(0.0));
        let [a, b, c] = match self.substance {
            Substance::Coefficients { sigma_s, sigma_a, g } => [sigma_s, sigma_a, g],
            Substance::Profile { albedo, length } => [albedo, length, 0.0],
        };
        [a, b, c, self.eta, far[0], far[1]].map(f64::to_bits)
    }

    /// The model of the row.
    pub fn prepare(&self, options: BatchOptions) -> Result<ScaledModel> {
        if let Some(thickness) = self.thickness.filter(|t| *t <= 0.0) {
            return Err(Error::scene(format!("thickness = {thickness} is not positive")));
        }
        let (model, length, single) = match self.substance {
            Substance::Coefficients { sigma_s, sigma_a, g } => {
                let medium = ChannelMedium { sigma_s, sigma_a, g, eta: self.eta };
                let (model, length) = self.of_coefficients(&medium, options)?;
                let scaled = ChannelMedium { sigma_s: sigma_s * length, sigma_a: sigma_a * length, ..medium };
                (model, length, Some(SingleChannel::new(&scaled)))
            }
            Substance::Profile { albedo, length: l } => {
                let length = if l > 0.0 { l.log2().round().exp2() } else { 1.0 };
                let (a, l) = (Rgb::splat(albedo as f32), Rgb::splat((l / length) as f32));
                let normalised = options.made.exit_normalisation;
                let model = NormalisedDiffusion::from_albedo(options.width, a, l, self.eta as f32, normalised)?;
                (Box::new(model) as Box<dyn Bssrdf>, length, None)
            }
        };
        let normalised = model.name().normalises_exit(options.made.exit_normalisation);
        let eta = if options.transmitted { self.eta_far.unwrap_or(self.eta) } else { self.eta };
        let exit = if normalised { FresnelMoments::new(eta).four_c_phi_outside } else { 1.0 };
        Ok(ScaledModel { model, length, exit_factor: std::f64::consts::PI * exit, single })
    }

    /// The model and its unit of length.
    fn of_coefficients(&self, typed: &ChannelMedium, options: BatchOptions) -> Result<(Box<dyn Bssrdf>, f64)> {
        for (name, value) in [("sigma_s", typed.sigma_s), ("sigma_a", typed.sigma_a)] {
            if value < 0.0 {
                return Err(Error::scene(format!("{name} = {value} is negative")));
            }
        }
        let sigma_t_prime = typed.sigma_t_prime();
        let length = if sigma_t_prime > 0.0 { (-sigma_t_prime.log2()).round().exp2() } else { 1.0 };
        let per_length = |sigma: f64| Rgb::splat((sigma * length) as f32);
        let medium = Medium {
            sigma_a: per_length(typed.sigma_a),
            sigma_s: per_length(typed.sigma_s),
            g: typed.g,
            eta: self.eta as f32,
        }
        .checked()?;
        let thickness = self.thickness.map(|t| (t / length) as f32);
        let made = ModelOptions { thickness, eta_far: self.eta_far.map(|eta| eta as f32), ..options.made };
        Ok((options.model.build(&medium, &made)?, length))
    }
}

/// A model in a unit of length near its transport mean free path, so that no input leaves the range of f32.
pub(super) struct ScaledModel {
    model: Box<dyn Bssrdf>,
    /// That unit: a power of two, which moves no digit of the input.
    length: f64,
    /// M over S_d: π 4 C_phi(1/eta) of the face it leaves by, or π without exit normalisation.
    pub exit_factor: f64,
    /// None where the row has no coefficients.
    single: Option<SingleChannel>,
}

/// Entry and exit of a row, in the row's unit.
pub(super) struct EntryExit {
    x: [f64; 3],
    n_i: Vec3,
    n_o: Vec3,
    w: Vec3,
}

impl EntryExit {
    /// On the lit plane, or on the far face of a slab as thick as `through`.
    pub fn plane(r: f64, through: Option<f64>) -> Result<Self> {
        if r < 0.0 {
            return Err(Error::scene(format!("r = {r} is negative")));
        }
        let n_o = if through.is_some() { -Vec3::Z } else { Vec3::Z };
        Ok(Self { x: [r, 0.0, -through.unwrap_or(0.0)], n_i: Vec3::Z, n_o, w: -Vec3::Z })
    }

    pub fn general(v: &[f64; 12]) -> Result<Self> {
        let vector = |k: usize| [v[k], v[k + 1], v[k + 2]];
        let unit = |k: usize, name: &str| {
            let a = vector(k);
            let length = a.iter().map(|c| c * c).sum::<f64>().sqrt();
            if (length - 1.0).abs() > UNIT_TOLERANCE {
                return Err(Error::scene(format!("{name} has length {length}, not 1")));
            }
            Ok(Vec3::from(a.map(|c| c as f32)))
        };
        Ok(Self { x: vector(0), n_i: unit(3, "nix,niy,niz")?, n_o: unit(6, "nox,noy,noz")?, w: unit(9, "wx,wy,wz")? })
    }
}

impl ScaledModel {
    /// S_d [1/(unit² sr)] in the row's unit; `clamped` as rendering has it, else as the formula does.
    pub fn s_d(&self, place: &EntryExit, clamped: bool) -> f64 {
        let x = Vec3::from(place.x.map(|c| (c / self.length) as f32));
        let entry = Entry { x: Vec3::ZERO, n: place.n_i, w: place.w };
        let exit = Exit { x, n: place.n_o, w: place.n_o };
        let value = if clamped { self.model.eval(&entry, &exit) } else { self.model.eval_signed(&entry, &exit) };
        f64::from(value[0]) / (self.length * self.length)
    }

    /// Exitance by single scattering on the plane through the entry [1/unit²].
    pub fn single(&self, place: &EntryExit) -> f64 {
        let Some(single) = &self.single else { return 0.0 };
        let x = DVec3::from(place.x) / self.length;
        single.exitance(x, place.n_i.as_dvec3(), place.w.as_dvec3()) / (self.length * self.length)
    }
}
