//! Rows of a CSV in, the same rows with S_d out: the models' rendering code for scripts and tests.

use crate::bssrdf::{
    Bssrdf, ChannelMedium, DirectionalDipole, Entry, Exit, KappaExtinction, Model, ModelName, ModelVisitor,
    PhotonBeamDiffusion, SingleChannel, Slab,
};
use crate::error::did_you_mean;
use crate::math::{DVec3, Rgb, Vec3};
use crate::optics::{FresnelMoments, Medium};
use crate::{Error, Result};
use std::collections::HashMap;
use std::fmt::Write as _;

/// Media whose models are kept; rows of a table come back to few media, and memory stays flat if they do not.
const KEPT_MODELS: usize = 1024;
/// How far a given direction or normal may be from unit length.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Which model a batch evaluates.
#[derive(Clone, Copy, Debug)]
pub struct BatchOptions {
    /// The model.
    pub model: ModelName,
    /// See [`Model::new`].
    pub exit_normalisation: bool,
    /// `directional` scaled to the true albedo.
    pub calibrated: bool,
    /// The extinction in the near-field correction of `beam`.
    pub kappa: KappaExtinction,
    /// Rows with r: exit by the far face of the `slab`.
    pub transmitted: bool,
    /// Append exact single scattering too: exitance of a plane [1/unit²] per entered flux.
    pub single: bool,
}

impl BatchOptions {
    /// `model` as a scene would use it.
    pub fn new(model: ModelName) -> Self {
        Self {
            model,
            exit_normalisation: true,
            calibrated: false,
            kappa: KappaExtinction::default(),
            transmitted: false,
            single: false,
        }
    }
}

/// Evaluates rows under one header.
pub struct Batch {
    options: BatchOptions,
    columns: Columns,
    models: HashMap<[u64; 6], Prepared>,
    last: [u64; 6],
    fields: Vec<(usize, usize)>,
}

/// A model in a unit of length near its transport mean free path, so that no input leaves the range of f32.
struct Prepared {
    model: Model,
    /// That unit: a power of two, which moves no digit of the input.
    length: f64,
    /// M over S_d: π 4 C_phi(1/eta) of the face it leaves by, or π without exit normalisation.
    exit_factor: f64,
    single: SingleChannel,
}

/// Where the inputs stand in a row.
struct Columns {
    sigma_s: usize,
    sigma_a: usize,
    g: usize,
    eta: usize,
    thickness: Option<usize>,
    eta_far: Option<usize>,
    place: Place,
    count: usize,
}

enum Place {
    /// Distance on a plane, normal incidence.
    Plane(usize),
    /// x_o - x_i, normals at entry and exit, refracted direction inside.
    General([usize; 12]),
}

const GENERAL: [&str; 12] = ["x", "y", "z", "nix", "niy", "niz", "nox", "noy", "noz", "wx", "wy", "wz"];

impl Batch {
    /// A batch of rows under `header`.
    ///
    /// # Errors
    /// A usage error that names the columns that are missing.
    pub fn new(header: &str, options: BatchOptions) -> Result<Self> {
        let mut fields = Vec::new();
        split(header, &mut fields);
        let names: Vec<&str> = fields.iter().map(|&(a, b)| field(header, a, b)).collect();
        let columns = Columns::new(&names, options.model)?;
        Ok(Self { options, columns, models: HashMap::new(), last: [0; 6], fields })
    }

    /// Names of the columns that [`Self::row`] appends, with the comma before each.
    pub fn appended(&self) -> String {
        let exitance = if matches!(self.columns.place, Place::Plane(_)) { ",exitance" } else { "" };
        format!(",S_d{exitance}{}", if self.options.single { ",single" } else { "" })
    }

    /// Writes `row` with its results to `out`, without a line end. S_d is in 1/(unit² sr), exitance in 1/unit² per
    /// entered flux, the unit being that of the row's coefficients.
    ///
    /// # Errors
    /// A scene error that names the column and what is wrong with it; the caller knows the line.
    pub fn row(&mut self, row: &str, out: &mut String) -> Result<()> {
        split(row, &mut self.fields);
        if self.fields.len() != self.columns.count {
            let (found, expected) = (self.fields.len(), self.columns.count);
            return Err(Error::scene(format!("{found} fields where the header has {expected}")));
        }
        let fields = &self.fields;
        let number = |column: usize, name: &str| {
            let text = field(row, fields[column].0, fields[column].1);
            match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(Error::scene(format!("{name} = `{text}` is not a finite number"))),
            }
        };
        let columns = &self.columns;
        let medium = Inputs {
            sigma_s: number(columns.sigma_s, "sigma_s")?,
            sigma_a: number(columns.sigma_a, "sigma_a")?,
            g: number(columns.g, "g")?,
            eta: number(columns.eta, "eta")?,
            thickness: columns.thickness.map(|c| number(c, "thickness")).transpose()?,
            eta_far: columns.eta_far.map(|c| number(c, "eta_far")).transpose()?,
        };
        let place = match &columns.place {
            Place::Plane(r) => {
                Position::plane(number(*r, "r")?, medium.thickness.filter(|_| self.options.transmitted))?
            }
            Place::General(at) => {
                let mut v = [0.0; 12];
                for ((value, &column), name) in v.iter_mut().zip(at).zip(GENERAL) {
                    *value = number(column, name)?;
                }
                Position::general(&v)?
            }
        };
        let exitance_too = matches!(columns.place, Place::Plane(_));

        let key = medium.key();
        if key != self.last || self.models.is_empty() {
            if !self.models.contains_key(&key) {
                if self.models.len() >= KEPT_MODELS {
                    self.models.clear();
                }
                self.models.insert(key, medium.prepare(self.options)?);
            }
            self.last = key;
        }
        let prepared = &self.models[&key];
        let s_d = prepared.s_d(&place);
        out.push_str(row);
        let _ = write!(out, ",{s_d:.9e}");
        if exitance_too {
            let _ = write!(out, ",{:.9e}", s_d * prepared.exit_factor);
        }
        if self.options.single {
            let _ = write!(out, ",{:.9e}", prepared.single(&place));
        }
        Ok(())
    }
}

impl Columns {
    fn new(names: &[&str], model: ModelName) -> Result<Self> {
        let at = |name: &str| names.iter().position(|n| *n == name);
        let mut missing: Vec<String> = Vec::new();
        let mut need = |name: &str| {
            at(name).unwrap_or_else(|| {
                let end = if name.ends_with(')') { "" } else { "`" };
                missing.push(format!("`{name}{end}{}", did_you_mean(name, names.iter().copied())));
                0
            })
        };
        let (sigma_s, sigma_a, g, eta) = (need("sigma_s"), need("sigma_a"), need("g"), need("eta"));
        let place = if GENERAL.iter().any(|name| at(name).is_some()) && at("r").is_none() {
            Place::General(GENERAL.map(&mut need))
        } else {
            let either = at("r").map_or("r` (or `x,y,z,nix,niy,niz,nox,noy,noz,wx,wy,wz`)", |_| "r");
            Place::Plane(need(either))
        };
        let (slab, heeds) = (model == ModelName::Slab, model == ModelName::Slab || model == ModelName::Auto);
        let thickness = if slab { Some(need("thickness")) } else { at("thickness").filter(|_| heeds) };
        let eta_far = at("eta_far").filter(|_| slab);
        if missing.is_empty() {
            return Ok(Self { sigma_s, sigma_a, g, eta, thickness, eta_far, place, count: names.len() });
        }
        Err(Error::usage(format!("standard input, line 1: the header lacks {}", missing.join(", "))))
    }
}

/// The medium of a row, as typed.
struct Inputs {
    sigma_s: f64,
    sigma_a: f64,
    g: f64,
    eta: f64,
    thickness: Option<f64>,
    eta_far: Option<f64>,
}

impl Inputs {
    fn key(&self) -> [u64; 6] {
        let far = [self.thickness, self.eta_far].map(|v| v.unwrap_or(0.0));
        [self.sigma_s, self.sigma_a, self.g, self.eta, far[0], far[1]].map(f64::to_bits)
    }

    fn prepare(&self, options: BatchOptions) -> Result<Prepared> {
        for (name, value) in [("sigma_s", self.sigma_s), ("sigma_a", self.sigma_a)] {
            if value < 0.0 {
                return Err(Error::scene(format!("{name} = {value} is negative")));
            }
        }
        if let Some(thickness) = self.thickness.filter(|t| *t <= 0.0) {
            return Err(Error::scene(format!("thickness = {thickness} is not positive")));
        }
        let sigma_t_prime = self.sigma_s * (1.0 - self.g) + self.sigma_a;
        let length = if sigma_t_prime > 0.0 { (-sigma_t_prime.log2()).round().exp2() } else { 1.0 };
        let per_length = |sigma: f64| Rgb::splat((sigma * length) as f32);
        let medium = Medium {
            sigma_a: per_length(self.sigma_a),
            sigma_s: per_length(self.sigma_s),
            g: self.g,
            eta: self.eta as f32,
        }
        .checked()?;
        let thickness = self.thickness.map(|t| (t / length) as f32);
        let eta_far = self.eta_far.unwrap_or(self.eta);
        let normalised = options.exit_normalisation;
        let model = match (options.model, thickness) {
            (ModelName::Directional, _) => Model::Directional(DirectionalDipole::new(&medium, options.calibrated)),
            (ModelName::Beam, _) => Model::Beam(PhotonBeamDiffusion::new(&medium, normalised, options.kappa)),
            (ModelName::Slab, Some(thickness)) => {
                Model::Slab(Box::new(Slab::between(&medium, thickness, eta_far as f32, normalised)?))
            }
            (name, thickness) => Model::with_thickness(name, &medium, thickness, normalised)?,
        };
        // The directional dipole has the factor as published.
        let normalised = normalised || model.name() == ModelName::Directional;
        let eta = if options.transmitted { eta_far } else { self.eta };
        let exit = if normalised { FresnelMoments::new(eta).four_c_phi_outside } else { 1.0 };
        let single = SingleChannel::new(&ChannelMedium {
            sigma_s: self.sigma_s * length,
            sigma_a: self.sigma_a * length,
            g: self.g,
            eta: self.eta,
        });
        Ok(Prepared { model, length, exit_factor: std::f64::consts::PI * exit, single })
    }
}

/// Entry and exit of a row, in the row's unit.
struct Position {
    x: [f64; 3],
    n_i: Vec3,
    n_o: Vec3,
    w: Vec3,
}

impl Position {
    /// On the lit plane, or on the far face of a slab as thick as `through`.
    fn plane(r: f64, through: Option<f64>) -> Result<Self> {
        if r < 0.0 {
            return Err(Error::scene(format!("r = {r} is negative")));
        }
        let n_o = if through.is_some() { -Vec3::Z } else { Vec3::Z };
        Ok(Self { x: [r, 0.0, -through.unwrap_or(0.0)], n_i: Vec3::Z, n_o, w: -Vec3::Z })
    }

    fn general(v: &[f64; 12]) -> Result<Self> {
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

impl Prepared {
    /// S_d [1/(unit² sr)] in the row's unit.
    fn s_d(&self, place: &Position) -> f64 {
        struct Eval(Entry, Exit);
        impl ModelVisitor for Eval {
            type Out = Rgb;
            fn visit<B: Bssrdf>(self, model: &B) -> Rgb {
                model.eval(&self.0, &self.1)
            }
        }
        let x = Vec3::from(place.x.map(|c| (c / self.length) as f32));
        let entry = Entry { x: Vec3::ZERO, n: place.n_i, w: place.w };
        let exit = Exit { x, n: place.n_o, w: place.n_o };
        f64::from(self.model.visit(Eval(entry, exit))[0]) / (self.length * self.length)
    }

    /// Exitance by single scattering on the plane through the entry [1/unit²].
    fn single(&self, place: &Position) -> f64 {
        let x = DVec3::from(place.x) / self.length;
        self.single.exitance(x, place.n_i.as_dvec3(), place.w.as_dvec3()) / (self.length * self.length)
    }
}

/// Start and end of each field of a CSV row; commas inside double quotes do not separate.
fn split(row: &str, fields: &mut Vec<(usize, usize)>) {
    fields.clear();
    let (mut start, mut quoted) = (0, false);
    for (i, byte) in row.bytes().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b',' if !quoted => {
                fields.push((start, i));
                start = i + 1;
            }
            _ => {}
        }
    }
    fields.push((start, row.len()));
}

/// A field without the blanks and quotes around it.
fn field(row: &str, start: usize, end: usize) -> &str {
    row[start..end].trim().trim_matches('"')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(header: &str, rows: &[&str]) -> Result<Vec<String>> {
        run_with(BatchOptions::new(ModelName::Standard), header, rows)
    }

    fn run_with(options: BatchOptions, header: &str, rows: &[&str]) -> Result<Vec<String>> {
        let mut batch = Batch::new(header, options)?;
        rows.iter()
            .map(|row| {
                let mut out = String::new();
                batch.row(row, &mut out).map(|()| out)
            })
            .collect()
    }

    fn last(row: &str) -> f64 {
        row.rsplit(',').next().unwrap().parse().unwrap()
    }

    /// Standard dipole in f64, written out anew; A for eta = 1.3 from the closed form of the moment.
    fn r_d(s: f64, a: f64, r: f64) -> f64 {
        let f_dr = 0.444_457_4;
        let (t, big_a) = (s + a, (1.0 + f_dr) / (1.0 - f_dr));
        let (tr, zr) = ((3.0 * a * t).sqrt(), 1.0 / t);
        let pole = |z: f64| {
            let d = r.hypot(z);
            z * (1.0 + tr * d) * (-tr * d).exp() / (d * d * d)
        };
        s / t / (4.0 * std::f64::consts::PI) * (pole(zr) + pole(zr + 4.0 / 3.0 * big_a / t))
    }

    #[test]
    fn exitance_is_the_dipole_of_the_row_in_any_unit() {
        let header = "id,eta,r,sigma_a,note,g,sigma_s";
        for unit in [1e-6, 1.0, 1e6] {
            let (s, a, r) = (2.0 * unit, 0.01 * unit, 3.0 / unit);
            let row = format!("7,1.3,{r},{a},\"x, y\",0.5,{}", 2.0 * s);
            let out = run(header, &[&row]).unwrap().remove(0);
            assert!(out.starts_with(&row));
            let expected = r_d(s, a, r);
            assert!((last(&out) / expected - 1.0).abs() < 2e-6, "{out}: {expected}");
        }
    }

    #[test]
    fn both_forms_of_a_row_agree() {
        let plane = run("sigma_s,sigma_a,g,eta,r", &["1,0.1,0,1.3,2"]).unwrap().remove(0);
        let header = format!("sigma_s,sigma_a,g,eta,{}", GENERAL.join(","));
        let general = run(&header, &["1,0.1,0,1.3,0,2,0,0,0,1,0,0,1,0,0,-1"]).unwrap().remove(0);
        let s_d: f64 = plane.split(',').nth(5).unwrap().parse().unwrap();
        assert_eq!(s_d, last(&general));
    }

    #[test]
    fn what_is_wrong_with_a_row_is_said() {
        let header = "sigma_s,sigma_a,g,eta,r";
        for (row, word) in [
            ("1,0.1,0,1.3", "4 fields where the header has 5"),
            ("1,x,0,1.3,2", "sigma_a = `x`"),
            ("1,-0.1,0,1.3,2", "sigma_a = -0.1 is negative"),
            ("1,0.1,1,1.3,2", "mean cosine"),
            ("1,0.1,0,0,2", "eta = 0"),
            ("1,0.1,0,1.3,-2", "r = -2 is negative"),
            ("1,0.1,0,1.3,NaN", "r = `NaN`"),
        ] {
            let message = run(header, &[row]).unwrap_err().to_string();
            assert!(message.contains(word), "{row}: {message}");
        }
        let message = run("sigma_s,sigma_A,g,eta,r", &[]).unwrap_err().to_string();
        assert!(message.contains("lacks `sigma_a` (did you mean `sigma_A`?)"), "{message}");
        assert!(run("sigma_s,sigma_a,g,eta,x,y", &[]).unwrap_err().to_string().contains("`nix`"));
    }

    #[test]
    fn media_without_scattering_or_anything_have_values() {
        let rows = ["0,1,0,1.3,1", "0,0,0,1.3,1", "1,0,0,1.3,1", "1,0,0.999999999,1.3,1", "1,1e-12,0,1,0"];
        for out in run("sigma_s,sigma_a,g,eta,r", &rows).unwrap() {
            assert!(last(&out) >= 0.0 && last(&out).is_finite(), "{out}");
        }
    }

    #[test]
    fn a_slab_needs_its_thickness_and_has_two_faces() {
        let mut options = BatchOptions::new(ModelName::Slab);
        let missing = run_with(options, "sigma_s,sigma_a,g,eta,r", &[]).unwrap_err().to_string();
        assert!(missing.contains("lacks `thickness`"), "{missing}");
        let header = "sigma_s,sigma_a,g,eta,r,thickness,eta_far";
        let row = ["2,0.01,0,1.3,0.7,3,1.3"];
        let reflected = last(&run_with(options, header, &row).unwrap()[0]);
        options.transmitted = true;
        let transmitted = last(&run_with(options, header, &row).unwrap()[0]);
        assert!(transmitted > 0.0 && transmitted < reflected, "{transmitted} against {reflected}");
        let thin = run_with(options, header, &["2,0.01,0,1.3,0.7,0.1,1.3"]).unwrap_err().to_string();
        assert!(thin.contains("thickness"), "{thin}");
    }

    #[test]
    fn single_scattering_is_appended_on_request() {
        let mut options = BatchOptions::new(ModelName::Beam);
        options.single = true;
        let batch = Batch::new("sigma_s,sigma_a,g,eta,r", options).unwrap();
        assert_eq!(batch.appended(), ",S_d,exitance,single");
        // A row of the table of exact values, the coefficients in another unit.
        let [mm, m] = [1.0, 1e-3].map(|unit| {
            let row = format!("{},{},0.5,1.3,{}", 10.0 * unit, unit, 0.1 / unit);
            last(&run_with(options, "sigma_s,sigma_a,g,eta,r", &[&row]).unwrap()[0]) / (unit * unit)
        });
        assert!(mm > 0.0 && (m / mm - 1.0).abs() < 1e-9);
    }

    #[test]
    fn more_media_than_are_kept() {
        let rows: Vec<String> = (0..3 * KEPT_MODELS).map(|i| format!("{},0.1,0,1.3,1", 1 + i % 2000)).collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let out = run("sigma_s,sigma_a,g,eta,r", &rows).unwrap();
        assert_eq!(last(&out[0]), last(&out[2000]));
    }
}
