//! Reference tables: reading them, and the bar that models are held to. Media and directions for tests of models.
#![allow(dead_code)] // each test file uses its part
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

use marmor::bssrdf::{Bssrdf, ChannelMedium, Entry, Exit};
use marmor::math::{Rgb, Vec3};
use marmor::optics::Medium;
use proptest::prelude::*;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// One row of a CSV file by column name.
pub struct Row {
    names: Arc<HashMap<String, usize>>,
    cells: Vec<String>,
}

impl Row {
    pub fn text(&self, name: &str) -> &str {
        &self.cells[*self.names.get(name).unwrap_or_else(|| panic!("no column `{name}`"))]
    }

    pub fn has(&self, name: &str) -> bool {
        self.names.contains_key(name)
    }

    pub fn number(&self, name: &str) -> f64 {
        self.text(name).parse().unwrap_or_else(|_| panic!("`{}` in `{name}`", self.text(name)))
    }
}

fn read(path: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut lines = text.lines().filter(|line| !line.is_empty());
    let cells = |line: &str| line.split(',').map(str::to_string).collect::<Vec<_>>();
    let header = cells(lines.next().unwrap());
    let names = Arc::new(header.into_iter().enumerate().map(|(i, name)| (name, i)).collect::<HashMap<_, _>>());
    let rows: Vec<_> = lines.map(|line| Row { names: names.clone(), cells: cells(line) }).collect();
    assert!(!rows.is_empty(), "{} is empty", path.display());
    rows
}

/// A file of tests/data.
pub fn table(name: &str) -> Vec<Row> {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name))
}

/// The file `name` of the folder in `MARMOR_REFERENCE_DIR`, the whole tables that tests/data has samples of; `None`
/// where the variable is not set.
pub fn whole_table(name: &str) -> Option<Vec<Row>> {
    std::env::var_os("MARMOR_REFERENCE_DIR").map(|folder| read(&Path::new(&folder).join(name)))
}

/// Runs `check` on the committed rows of `file`, and on the whole table where there is one.
pub fn both(file: &str, check: impl Fn(&str, &[Row])) {
    check(file, &table(file));
    if let Some(rows) = whole_table(file) {
        check(&format!("whole {file}"), &rows);
    }
}

/// The medium of a row. Tables of models that see reduced scattering only have `sigma_s_red`: g = 0.
pub fn channel(row: &Row) -> ChannelMedium {
    let reduced = row.has("sigma_s_red");
    ChannelMedium {
        sigma_s: row.number(if reduced { "sigma_s_red" } else { "sigma_s" }),
        sigma_a: row.number("sigma_a"),
        g: if reduced { 0.0 } else { row.number("g") },
        eta: row.number("eta"),
    }
}

/// The same medium in three channels; nothing is checked.
pub fn grey(sigma_s: f32, sigma_a: f32, g: f64, eta: f32) -> Medium {
    Medium { sigma_s: Rgb::splat(sigma_s), sigma_a: Rgb::splat(sigma_a), g, eta }
}

/// Channels do not know each other: each has the value and the total of a grey medium of its own.
pub fn channels_are_grey_media<M: Bssrdf>(medium: &Medium, model: impl Fn(&Medium) -> M, entry: &Entry, exit: &Exit) {
    let all = model(medium);
    for c in 0..3 {
        let one = model(&grey(medium.sigma_s[c], medium.sigma_a[c], medium.g, medium.eta));
        assert_eq!(all.eval(entry, exit)[c], one.eval(entry, exit)[0]);
        assert_eq!(all.total()[c], one.total()[0]);
    }
}

/// Unit vectors.
pub fn direction() -> impl Strategy<Value = Vec3> {
    (-1.0_f32..=1.0, 0.0_f32..6.3).prop_map(|(z, phi)| {
        let s = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(s * phi.cos(), s * phi.sin(), z)
    })
}

/// A pair of points and a medium, anything that a caller may ask.
#[derive(Debug)]
pub struct AnyInput {
    pub medium: Medium,
    /// Exit minus entry.
    pub x: Vec3,
    pub w: Vec3,
    pub n_i: Vec3,
    pub n_o: Vec3,
}

/// Coefficients and distances over 12 and 30 decades, and the degenerate cases: nothing absorbs, nothing scatters, the
/// same point, an exit straight below the entry, one on the ray.
pub fn any_input() -> impl Strategy<Value = AnyInput> {
    let media = (-14.0_f32..14.0, -14.0_f32..14.0, -0.99_f64..0.999_999_9, 0.4_f32..4.0);
    (media, [direction(), direction(), direction(), direction()], -40.0_f32..30.0, 0..7).prop_map(
        |((log_s, log_a, g, eta), [x, w, n_i, n_o], log_r, case)| {
            let mut medium = grey(log_s.exp(), log_a.exp(), g, eta);
            let mut x = x * log_r.exp();
            match case {
                0 => medium.sigma_a = Rgb::BLACK,
                1 => medium.sigma_s = Rgb::BLACK,
                2 => x = Vec3::ZERO,
                3 => x = n_i * log_r.exp(),
                4 => x = w * log_r.exp(),
                _ => {}
            }
            medium.sigma_a.0[1] *= 3.0;
            AnyInput { medium, x, w, n_i, n_o }
        },
    )
}

/// Relative errors of f32 results against a table.
#[derive(Default)]
pub struct Score {
    errors: Vec<(f64, String)>,
    not_finite: Vec<String>,
    beyond: usize,
}

impl Score {
    /// One row. Values outside the range of normal f32 have to come out as finite numbers, no more.
    pub fn add(&mut self, row: &Row, value: f32, truth: f64) {
        let label = format!("{} {value:e} {truth:e}", row.text("id"));
        if !value.is_finite() {
            self.not_finite.push(label);
        } else if truth != 0.0 && !(f64::from(f32::MIN_POSITIVE)..=f64::from(f32::MAX)).contains(&truth.abs()) {
            self.beyond += 1;
        } else if truth == 0.0 {
            self.errors.push((if value == 0.0 { 0.0 } else { f64::INFINITY }, label));
        } else {
            self.errors.push(((f64::from(value) / truth - 1.0).abs(), label));
        }
    }

    /// Relative error below 2e-5 in 99.5 % of the rows and below 1e-3 in all; nothing NaN or infinite.
    pub fn hold(mut self, name: &str) {
        self.errors.sort_by(|a, b| b.0.total_cmp(&a.0));
        let share =
            |bar: f64| 100.0 * self.errors.iter().filter(|e| e.0 < bar).count() as f64 / self.errors.len() as f64;
        let (fine, coarse) = (share(2e-5), share(1e-3));
        println!(
            "{name}: {} rows, {} beyond f32; < 2e-5: {fine:.3} %, < 1e-3: {coarse:.3} %, largest {:?}",
            self.errors.len(),
            self.beyond,
            &self.errors[..5.min(self.errors.len())]
        );
        assert!(self.not_finite.is_empty(), "{name}: {:?}", self.not_finite);
        assert!(fine >= 99.5 && coarse >= 100.0, "{name}: {:?}", &self.errors[..20.min(self.errors.len())]);
    }
}
