//! Rows of a CSV in, the same rows with S_d out: the models' rendering code for scripts and tests.

use super::batch_model::{BatchOptions, EntryExit, Inputs, ScaledModel, Substance};
use crate::bssrdf::{ModelName, ModelOption};
use crate::error::did_you_mean;
use crate::{Error, Result};
use std::collections::HashMap;
use std::fmt::Write as _;

/// Media whose models are kept; rows of a table come back to few media, and memory stays flat if they do not.
const KEPT_MODELS: usize = 1024;

/// Evaluates rows under one header.
pub struct Batch {
    options: BatchOptions,
    columns: InputColumns,
    models: HashMap<[u64; 6], ScaledModel>,
    last: [u64; 6],
    fields: Vec<(usize, usize)>,
}

/// Where the inputs stand in a row.
struct InputColumns {
    substance: SubstanceColumns,
    /// Absent only beside `A` and `l`, where it is 1.
    eta: Option<usize>,
    thickness: Option<usize>,
    eta_far: Option<usize>,
    place: PlaceColumns,
    count: usize,
}

enum SubstanceColumns {
    /// sigma_s, sigma_a, g.
    Coefficients([usize; 3]),
    /// A, l.
    Profile([usize; 2]),
}

enum PlaceColumns {
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
        let columns = InputColumns::new(&names, options.model)?;
        if options.single && matches!(columns.substance, SubstanceColumns::Profile(_)) {
            return Err(Error::usage("single scattering needs sigma_s, sigma_a and g, not `A` and `l`"));
        }
        Ok(Self { options, columns, models: HashMap::new(), last: [0; 6], fields })
    }

    /// Names of the columns that [`Self::row`] appends, with the comma before each.
    pub fn appended(&self) -> String {
        let exitance = if matches!(self.columns.place, PlaceColumns::Plane(_)) { ",exitance" } else { "" };
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
        let substance = match columns.substance {
            SubstanceColumns::Coefficients([s, a, g]) => Substance::Coefficients {
                sigma_s: number(s, "sigma_s")?,
                sigma_a: number(a, "sigma_a")?,
                g: number(g, "g")?,
            },
            SubstanceColumns::Profile([a, l]) => {
                Substance::Profile { albedo: number(a, "A")?, length: number(l, "l")? }
            }
        };
        let medium = Inputs {
            substance,
            eta: columns.eta.map_or(Ok(1.0), |c| number(c, "eta"))?,
            thickness: columns.thickness.map(|c| number(c, "thickness")).transpose()?,
            eta_far: columns.eta_far.map(|c| number(c, "eta_far")).transpose()?,
        };
        let place = match &columns.place {
            PlaceColumns::Plane(r) => {
                EntryExit::plane(number(*r, "r")?, medium.thickness.filter(|_| self.options.transmitted))?
            }
            PlaceColumns::General(at) => {
                let mut v = [0.0; 12];
                for ((value, &column), name) in v.iter_mut().zip(at).zip(GENERAL) {
                    *value = number(column, name)?;
                }
                EntryExit::general(&v)?
            }
        };
        let exitance_too = matches!(columns.place, PlaceColumns::Plane(_));

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
        let s_d = prepared.s_d(&place, self.options.clamped);
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

impl InputColumns {
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
        let profile = model.takes(ModelOption::Width) && at("sigma_s").is_none() && at("A").is_some();
        let (substance, eta) = if profile {
            (SubstanceColumns::Profile(["A", "l"].map(&mut need)), at("eta"))
        } else {
            let coefficients = ["sigma_s", "sigma_a", "g"].map(&mut need);
            (SubstanceColumns::Coefficients(coefficients), Some(need("eta")))
        };
        let place = if GENERAL.iter().any(|name| at(name).is_some()) && at("r").is_none() {
            PlaceColumns::General(GENERAL.map(&mut need))
        } else {
            let either = at("r").map_or("r` (or `x,y,z,nix,niy,niz,nox,noy,noz,wx,wy,wz`)", |_| "r");
            PlaceColumns::Plane(need(either))
        };
        let two_faces = model.takes(ModelOption::EtaFar);
        let thickness = at("thickness").filter(|_| model.takes(ModelOption::Thickness));
        let thickness = if two_faces { Some(need("thickness")) } else { thickness };
        let eta_far = at("eta_far").filter(|_| two_faces);
        if missing.is_empty() {
            return Ok(Self { substance, eta, thickness, eta_far, place, count: names.len() });
        }
        Err(Error::usage(format!("standard input, line 1: the header lacks {}", missing.join(", "))))
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
    use crate::bssrdf::WidthFit;

    fn run(header: &str, rows: &[&str]) -> Result<Vec<String>> {
        run_with(BatchOptions::new(ModelName::STANDARD), header, rows)
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
        let mut options = BatchOptions::new(ModelName::SLAB);
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
        let mut options = BatchOptions::new(ModelName::BEAM);
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
    fn albedo_and_length_stand_for_coefficients() {
        let mut options = BatchOptions::new(ModelName::NORMALISED);
        // A (exp(-r/d) + exp(-r/3d)) / (8π d r) with d = l / s(A).
        for (fit, s) in
            [(WidthFit::Searchlight, 1.539), (WidthFit::Diffuse, 1.715), (WidthFit::DiffusionLength, 3.583_521)]
        {
            options.width = fit;
            let (a, l, r) = (0.5, 2e-5_f64, 1e-5);
            let out = last(&run_with(options, "A,l,r", &[&format!("{a},{l},{r}")]).unwrap()[0]);
            let d: f64 = l / s;
            let expected = a * ((-r / d).exp() + (-r / (3.0 * d)).exp()) / (8.0 * std::f64::consts::PI * d * r);
            assert!((out / expected - 1.0).abs() < 1e-5, "{fit:?}: {out} {expected}");
        }
        assert!(run_with(options, "A,r", &[]).unwrap_err().to_string().contains("lacks `l`"));
        assert!(run_with(options, "A,l,r", &["1.5,1,1"]).unwrap_err().to_string().contains("albedo 1.5"));
        options.single = true;
        assert!(run_with(options, "A,l,r", &[]).is_err());
    }

    #[test]
    fn negative_values_of_a_formula_are_printed_unless_clamped() {
        // Far out between unlike boundaries, and an exit where the image outweighs the source.
        let slab = ("sigma_s,sigma_a,g,eta,r,thickness,eta_far", "1,0.0001,0,2.5,5,1.5,1.5");
        let header = format!("sigma_s,sigma_a,g,eta,{}", GENERAL.join(","));
        let directional = (header.as_str(), "0.01,0.032,0,1,-12,0,0,0,0,1,0,0,1,0.932039,0,-0.362358");
        for (model, (header, row)) in [(ModelName::SLAB, slab), (ModelName::DIRECTIONAL, directional)] {
            let mut options = BatchOptions::new(model);
            let signed = last(&run_with(options, header, &[row]).unwrap()[0]);
            options.clamped = true;
            let clamped = last(&run_with(options, header, &[row]).unwrap()[0]);
            assert!(signed < 0.0 && clamped == 0.0, "{model:?}: {signed} {clamped}");
        }
    }

    #[test]
    fn more_media_than_are_kept() {
        let rows: Vec<String> = (0..3 * KEPT_MODELS).map(|i| format!("{},0.1,0,1.3,1", 1 + i % 2000)).collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let out = run("sigma_s,sigma_a,g,eta,r", &rows).unwrap();
        assert_eq!(last(&out[0]), last(&out[2000]));
    }
}
