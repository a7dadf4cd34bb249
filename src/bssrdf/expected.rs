//! How wrong a model is expected to be at a place of a body: a table measured against paths through the medium, and the
//! rule that reads it. `benches/validity.rs` makes the table; docs/models.md has it in words.

use super::{ModelName, ModelOptions};
use crate::optics::ChannelOptics;
use serde::Serialize;
use std::sync::OnceLock;

/// Errors of a model at a place, relative to all light that leaves after a narrow beam has entered there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExpectedError {
    /// Of the total, signed: above 0 the model is too bright.
    pub total: f64,
    /// Of the distribution: the sum of absolute errors over all rings around the beam, at least |`total`|. Light that
    /// passes unscattered is in it, for no model has it.
    pub distribution: f64,
    /// Of the light that leaves far from its entry, signed: through the far face of a sheet, from the other half of a ball,
    /// beyond 10 transport mean free paths on a plane. None where there is too little to tell.
    pub far: Option<f64>,
}

/// What decides it: one channel of a medium, and the shape around a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Reduced albedo, 0 to 1.
    pub alpha_prime: f64,
    /// Mean cosine of the phase function.
    pub g: f64,
    /// n_inside / n_outside.
    pub eta: f64,
    /// Way along the inward normal to the other side [transport mean free paths]; infinite in a half space, NaN where there
    /// is no other side.
    pub thickness: f64,
    /// Mean curvature [1 / transport mean free path]: 1 / radius on a ball, 0 on a plane, below 0 in a hollow.
    pub curvature: f64,
}

impl Conditions {
    /// A place of thickness \[unit\] and mean curvature [1/unit] in one channel of a medium.
    pub fn new(optics: &ChannelOptics, eta: f64, thickness: f64, curvature: f64) -> Self {
        let path = optics.transport_mean_free_path;
        Self {
            alpha_prime: optics.alpha_prime,
            g: optics.g,
            eta,
            thickness: thickness / path,
            curvature: curvature * path,
        }
    }

    /// The nearest place that the table has, of the same shape; itself where it has been measured.
    /// What is thinner or clearer errs by more.
    pub fn nearest_measured(self) -> Self {
        let g = self.g.clamp(0.0, FORWARD.1);
        let [low, high] = measured_albedos(g);
        let thickness = if self.thickness < SIZES[0] { SIZES[0] } else { self.thickness };
        Self {
            alpha_prime: self.alpha_prime.clamp(low, high),
            g,
            eta: self.eta.clamp(ETAS[0], ETAS[2]),
            thickness,
            // A ball stays a ball.
            curvature: if thickness == self.thickness {
                self.curvature
            } else {
                self.curvature * self.thickness / thickness
            },
        }
    }
}

/// Sizes of slabs and balls in the table [transport mean free paths]; a half space is the end of both rows.
const SIZES: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
/// Refractive indices of the rows with g = 0.
const ETAS: [f64; 3] = [1.0, 1.3, 1.5];
/// The index and the mean cosine of the other rows.
const FORWARD: (f64, f64) = (1.3, 0.8);

/// Why there is no figure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Unmeasured {
    /// The model, here: `auto` before it has chosen, a slab of another thickness or too thin for one.
    Model,
    /// Reduced albedo beyond [`measured_albedos`].
    Albedo,
    /// n_inside / n_outside beyond 1 to 1.5.
    Index,
    /// Mean cosine beyond 0 to 0.8.
    Cosine,
    /// Thinner than 1 transport mean free path: any model of a body is further from the truth than in the table.
    Thin,
    /// No other side: a sheet, a hole, faces that look inwards.
    Open,
}

/// The error of `model` at `place`, where it has been measured.
///
/// The table has slabs of thickness H, balls of radius R and the half space. A place of thickness H and mean curvature
/// 1/R is read as
///
///   R ≤ H/2   the ball of radius R
///   R > H/2   w ball(H/2) + (1 - w) slab(H), w = H / 2R
///
/// so that a ball gives the row of its ball, a sheet that of its slab, a plane that of the half space, and what is between
/// them lies between. Hollows count as flat. Between rows: linear in ln(1 - α′), in ln(size) up to 50 transport mean free
/// paths and in 1/size beyond, in η and in g. A ball of a radius below 1 counts as one of 1.
///
/// # Errors
/// Where nothing has been measured.
pub fn expected_error(
    model: ModelName,
    options: &ModelOptions,
    place: &Conditions,
) -> std::result::Result<ExpectedError, Unmeasured> {
    let head = model.evidence(options).ok_or(Unmeasured::Model)?;
    let column = table().models.iter().position(|m| *m == head).ok_or(Unmeasured::Model)?;
    if !(ETAS[0] - SLACK..=ETAS[2] + SLACK).contains(&place.eta) {
        return Err(Unmeasured::Index);
    }
    if !(-SLACK..=FORWARD.1 + SLACK).contains(&place.g) {
        return Err(Unmeasured::Cosine);
    }
    let (table, g) = (table(), place.g.max(0.0));
    let eta = place.eta.clamp(ETAS[0], ETAS[2]);
    let i = if eta < ETAS[1] { 0 } else { 1 };
    let at = (eta - ETAS[i]) / (ETAS[i + 1] - ETAS[i]);
    let read = |medium: usize| table.media[medium].shape(column, place);
    let mut error = if at > 0.0 { mix(read(i), read(i + 1), at) } else { read(i) }?;
    if g > 0.0 {
        let (plain, forward) = (read(1)?, read(ETAS.len())?);
        let more = g / FORWARD.1;
        error.total += more * (forward.total - plain.total);
        error.distribution += more * (forward.distribution - plain.distribution);
        error.far =
            error.far.zip(forward.far.zip(plain.far)).map(|(far, (with, without))| far + more * (with - without));
        error.distribution = error.distribution.max(error.total.abs()).max(0.0);
    }
    Ok(error)
}

/// Least and largest reduced albedo of the table, for a mean cosine of `g`.
pub fn measured_albedos(g: f64) -> [f64; 2] {
    let albedos = &table().media[if g > 0.0 { ETAS.len() } else { 1 }].albedos;
    [albedos[0], albedos[albedos.len() - 1]]
}

/// A number of single precision may miss the end of a range by this.
const SLACK: f64 = 1e-5;

type Read = std::result::Result<ExpectedError, Unmeasured>;

fn mix(a: Read, b: Read, at: f64) -> Read {
    let (a, b) = (a?, b?);
    Ok(ExpectedError {
        total: a.total + at * (b.total - a.total),
        distribution: a.distribution + at * (b.distribution - a.distribution),
        far: match (a.far, b.far) {
            (Some(a), Some(b)) => Some(a + at * (b - a)),
            (a, b) => {
                if at < 0.5 {
                    a
                } else {
                    b
                }
            }
        },
    })
}

/// Rows of one η and g.
#[derive(Default)]
struct Shapes {
    /// α′, ascending.
    albedos: Vec<f64>,
    /// By column, then shape: the half space, slabs, balls; then albedo. None where the model does not exist.
    errors: Vec<Vec<Vec<Option<ExpectedError>>>>,
}

/// One for each of [`ETAS`], and [`FORWARD`].
struct Table {
    /// Heads of the models' columns, in their order.
    models: Vec<&'static str>,
    media: Vec<Shapes>,
}

impl Shapes {
    fn shape(&self, column: usize, place: &Conditions) -> Read {
        if place.thickness.is_nan() {
            return Err(Unmeasured::Open);
        }
        let thickness = place.thickness;
        if thickness < SIZES[0] * (1.0 - SLACK) {
            return Err(Unmeasured::Thin);
        }
        let curvature = if place.curvature.is_finite() { place.curvature.max(0.0) } else { 0.0 };
        let weight = 0.5 * thickness * curvature;
        let slab = |h: f64| self.sized(column, 1, h, place.alpha_prime);
        let ball = |r: f64| self.sized(column, 1 + SIZES.len(), r, place.alpha_prime);
        if curvature == 0.0 {
            slab(thickness)
        } else if weight >= 1.0 {
            ball(1.0 / curvature)
        } else {
            mix(slab(thickness), ball(0.5 * thickness), weight)
        }
    }

    /// Of the rows that begin at `first`, the size `size`.
    fn sized(&self, column: usize, first: usize, size: f64, alpha_prime: f64) -> Read {
        let row = |i: usize| self.albedo(column, if i < SIZES.len() { first + i } else { 0 }, alpha_prime);
        let last = SIZES.len() - 1;
        if size <= SIZES[0] {
            return row(0);
        }
        if size >= SIZES[last] {
            return mix(row(last + 1), row(last), SIZES[last] / size);
        }
        let i = SIZES.iter().rposition(|&s| s <= size).unwrap_or(0);
        let at = (size / SIZES[i]).ln() / (SIZES[i + 1] / SIZES[i]).ln();
        if at > 0.0 { mix(row(i), row(i + 1), at) } else { row(i) }
    }

    fn albedo(&self, column: usize, shape: usize, alpha_prime: f64) -> Read {
        let (errors, albedos) = (&self.errors[column][shape], &self.albedos);
        let (first, last) = (albedos[0], albedos[albedos.len() - 1]);
        // Linear in ln(1 - α′): a hundredth of 1 - α′ is nothing.
        if alpha_prime.is_nan() || alpha_prime < first - SLACK || 1.0 - alpha_prime < 0.99 * (1.0 - last) {
            return Err(Unmeasured::Albedo);
        }
        let read = |i: usize| errors[i].ok_or(Unmeasured::Model);
        let i = albedos.partition_point(|&a| a <= alpha_prime);
        if i == 0 || i == albedos.len() {
            return read(i.max(1) - 1);
        }
        let depth = |a: f64| (1.0 - a).ln();
        let at = (depth(alpha_prime) - depth(albedos[i - 1])) / (depth(albedos[i]) - depth(albedos[i - 1]));
        mix(read(i - 1), read(i), at)
    }
}

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| read(include_str!("expected.csv")))
}

/// Columns before those of the models.
const KEYS: usize = 6;

/// The file is our own: a cell that is no number is a model that does not exist there.
fn read(text: &'static str) -> Table {
    let heads = text.lines().next().unwrap_or("").split(',').skip(KEYS);
    let models: Vec<&str> = heads.filter_map(|head| head.strip_suffix("_total")).collect();
    let count = models.len();
    let media = ETAS.map(|eta| (eta, 0.0)).into_iter().chain([FORWARD]);
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let number = |row: &[&str], i: usize| row.get(i).and_then(|c| c.parse::<f64>().ok());
    let shape = |row: &[&str]| {
        let size = SIZES.iter().position(|&s| number(row, 3) == Some(s)).unwrap_or(0);
        match row.get(2) {
            Some(&"slab") => 1 + size,
            Some(&"ball") => 1 + SIZES.len() + size,
            _ => 0,
        }
    };
    let of = |(eta, g): (f64, f64)| {
        let mine = || rows.iter().filter(move |row| (number(row, 0), number(row, 1)) == (Some(eta), Some(g)));
        let mut albedos: Vec<f64> = mine().filter_map(|row| number(row, 4)).collect();
        albedos.sort_by(f64::total_cmp);
        albedos.dedup();
        let mut errors = vec![vec![vec![None; albedos.len()]; 1 + 2 * SIZES.len()]; count];
        for row in mine() {
            let Some(albedo) = albedos.iter().position(|&a| number(row, 4) == Some(a)) else { continue };
            for (column, errors) in errors.iter_mut().enumerate() {
                let cell = |k: usize| number(row, KEYS + 2 * column + k);
                let far = number(row, KEYS + 2 * count + column);
                if let (Some(total), Some(distribution)) = (cell(0), cell(1)) {
                    errors[shape(row)][albedo] = Some(ExpectedError { total, distribution, far });
                }
            }
        }
        // A slab so thick that it is a half space is the standard dipole.
        let at = |head: &str| models.iter().position(|m| *m == head);
        if let (Some(slab), Some(standard)) = (at("slab"), at("standard")) {
            errors[slab][0] = errors[standard][0].clone();
        }
        Shapes { albedos, errors }
    };
    let media = media.map(of).collect();
    Table { models, media }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(alpha_prime: f64, thickness: f64, curvature: f64) -> Conditions {
        Conditions { alpha_prime, g: 0.0, eta: 1.3, thickness, curvature }
    }

    /// By the head of the columns.
    fn error_of(head: &str, place: &Conditions) -> std::result::Result<ExpectedError, Unmeasured> {
        let options = ModelOptions { calibrated: head == "calibrated", ..ModelOptions::DEFAULT };
        let is = |model: &&ModelName| model.evidence(&options) == Some(head);
        expected_error(*ModelName::ALL.iter().find(is).unwrap(), &options, place)
    }

    /// Cells of the file, by the words that begin its row.
    fn row(head: &str) -> Vec<f64> {
        let line = include_str!("expected.csv").lines().find(|l| l.starts_with(head)).unwrap();
        line.split(',').skip(KEYS).map(|c| c.parse().unwrap_or(f64::NAN)).collect()
    }

    #[test]
    fn rows_of_the_table_are_given_back() {
        for (head, place) in [
            ("1.3,0,half,0,0.9,", place(0.9, f64::INFINITY, 0.0)),
            ("1.3,0,slab,5,0.999,", place(0.999, 5.0, 0.0)),
            ("1.3,0,ball,2,0.7,", place(0.7, 4.0, 0.5)),
            ("1.3,0,ball,50,0.99,", place(0.99, 1000.0, 0.02)),
            ("1.5,0,slab,10,0.97,", Conditions { eta: 1.5, ..place(0.97, 10.0, -3.0) }),
            ("1,0,half,0,0.5,", Conditions { eta: 1.0, ..place(0.5, f64::INFINITY, f64::NAN) }),
            ("1.3,0.8,ball,10,0.9,", Conditions { g: 0.8, ..place(0.9, 20.0, 0.1) }),
        ] {
            let cells = row(head);
            for (k, column) in table().models.iter().enumerate() {
                if cells[2 * k].is_nan() {
                    continue;
                }
                let error = error_of(column, &place).unwrap();
                let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
                assert!(
                    close(error.total, cells[2 * k]) && close(error.distribution, cells[2 * k + 1]),
                    "{head} {error:?}"
                );
                let far = cells[2 * table().models.len() + k];
                assert!(error.far.map_or(far.is_nan(), |e| close(e, far)), "{head} {error:?} {far}");
            }
        }
    }

    /// A model that named the columns of another would tell that one's errors.
    #[test]
    fn columns_are_those_of_the_models_after_which_they_are_named() {
        for head in &table().models {
            let calibrated = *head == "calibrated";
            let options = ModelOptions { calibrated, ..ModelOptions::DEFAULT };
            let name = if calibrated { "directional" } else { head };
            let model = ModelName::ALL.iter().find(|model| model.name() == name).unwrap();
            assert_eq!(model.evidence(&options), Some(*head));
        }
    }

    #[test]
    fn every_row_is_there_and_no_model_is_wrong_by_less_than_its_total() {
        let table = table();
        assert_eq!(table.media.iter().map(|m| m.albedos.len()).collect::<Vec<_>>(), [10, 10, 10, 7]);
        for medium in &table.media {
            for (k, shapes) in medium.errors.iter().enumerate() {
                for (shape, errors) in shapes.iter().enumerate() {
                    for e in errors {
                        // The slab of one transport mean free path is the only thing that does not exist.
                        assert!(e.is_some() != (table.models[k] == "slab" && shape == 1), "{k} {shape}");
                        assert!(e.is_none_or(|e| e.distribution + 2e-3 >= e.total.abs()), "{k} {shape} {e:?}");
                    }
                }
            }
        }
    }

    /// A sheet of thickness 10 that bends with a radius of 20: a quarter of the way to the ball that has its thickness.
    #[test]
    fn a_bent_sheet_lies_between_the_sheet_and_the_ball() {
        let (sheet, ball) = (row("1.3,0,slab,10,0.9,"), row("1.3,0,ball,5,0.9,"));
        let error = error_of("standard", &place(0.9, 10.0, 0.05)).unwrap();
        let column = 2 * table().models.iter().position(|m| *m == "standard").unwrap();
        let expected = 0.75 * sheet[column] + 0.25 * ball[column];
        assert!((error.total - expected).abs() < 1e-9, "{error:?} {expected}");
    }

    #[test]
    fn between_rows_the_error_has_no_steps() {
        for model in ["standard", "beam"] {
            let mut last = None;
            for i in 0..4000 {
                let thickness = 10f64.powf(f64::from(i) / 1000.0);
                let error = error_of(model, &place(0.95, thickness, 0.05)).unwrap().distribution;
                assert!(last.is_none_or(|l: f64| (l - error).abs() < 0.02), "{thickness}: {last:?} {error}");
                last = Some(error);
            }
            for far in [1e6, f64::INFINITY] {
                let error = |far, bent| error_of(model, &place(0.95, far, bent)).unwrap().distribution;
                assert!((error(far, 1e-9) - error(f64::INFINITY, 0.0)).abs() < 1e-4);
            }
        }
    }

    /// No figure is made up: not beyond the table, not for what is no model of it.
    #[test]
    fn what_has_not_been_measured_has_no_figure() {
        let sound = place(0.9, 10.0, 0.0);
        let of = |model, place: Conditions| expected_error(model, &ModelOptions::DEFAULT, &place).err();
        let beam = |place| of(ModelName::BEAM, place);
        assert_eq!(beam(sound), None);
        for alpha_prime in [0.0, 0.29, 0.99992, 1.0, f64::NAN] {
            assert_eq!(beam(Conditions { alpha_prime, ..sound }), Some(Unmeasured::Albedo), "{alpha_prime}");
        }
        for eta in [0.67, 0.99, 1.51, f64::NAN] {
            assert_eq!(beam(Conditions { eta, ..sound }), Some(Unmeasured::Index), "{eta}");
        }
        for g in [-0.999, -0.01, 0.81, f64::NAN] {
            assert_eq!(beam(Conditions { g, ..sound }), Some(Unmeasured::Cosine), "{g}");
        }
        assert_eq!(
            beam(Conditions { g: 0.4, alpha_prime: 0.4, ..sound }),
            Some(Unmeasured::Albedo),
            "g = 0.8 begins at 0.5"
        );
        assert_eq!(beam(Conditions { thickness: f64::NAN, ..sound }), Some(Unmeasured::Open));
        assert_eq!(beam(Conditions { thickness: 0.99, ..sound }), Some(Unmeasured::Thin));
        assert_eq!(of(ModelName::AUTO, sound), Some(Unmeasured::Model));
        assert_eq!(of(ModelName::SLAB, Conditions { thickness: 1.5, ..sound }), Some(Unmeasured::Model));
        assert_eq!(of(ModelName::SLAB, sound), None);
        // The nearest end has.
        for place in [
            Conditions { g: 0.4, alpha_prime: 0.1, ..sound },
            Conditions { alpha_prime: 1.0, g: -0.9, ..sound },
            Conditions { eta: 2.0, thickness: 0.01, curvature: 100.0, ..sound },
            Conditions { eta: 0.7, g: 0.99, ..sound },
        ] {
            let nearest = place.nearest_measured();
            assert!(beam(place).is_some() && beam(nearest).is_none(), "{place:?} {nearest:?}");
            assert_eq!(place.thickness * place.curvature, nearest.thickness * nearest.curvature);
        }
        assert_eq!(sound.nearest_measured(), sound);
        // Single precision may not throw out the ends.
        let ends =
            Conditions { eta: f64::from(1.5_f32), alpha_prime: f64::from(0.3_f32), g: f64::from(-0.0_f32), ..sound };
        assert_eq!(beam(ends), None);
        assert_eq!(beam(Conditions { alpha_prime: 1.0 - 0.999e-4, ..sound }), None);
        assert_eq!((measured_albedos(0.0), measured_albedos(0.5)), ([0.3, 0.9999], [0.5, 0.9999]));
    }
}
