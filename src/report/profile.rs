//! M(r): what leaves a half space at distance r from a normal pencil beam, by several models, beside the Monte Carlo
//! truth where the project has it. One table, one plot.

use super::axis::{Axis, Scale};
use super::monte_carlo::{Bin, Run, channel_run};
use super::plot::{COLOURS, DASHES, Figure, Panel, Row, Series, Stroke};
use crate::bssrdf::{Bssrdf, ChannelMedium, Entry, Exit, SingleChannel};
use crate::math::{DVec3, Vec3};
use crate::optics::{ChannelOptics, FresnelMoments, HalfSpace, Measured, Medium};
use crate::words::{albedo, digits};
use std::f64::consts::PI;
use std::fmt::Write as _;

const CHANNELS: [&str; 3] = ["red", "green", "blue"];
/// Points at which the flux of a model through a ring is summed; rings are narrow.
const RING_POINTS: usize = 8;

/// Radial profiles of one medium, per flux that entered.
pub struct Profile {
    title: String,
    medium: Medium,
    unit: String,
    unit_in_mm: f64,
    r: Vec<f64>,
    runs: [Option<&'static Run>; 3],
    curves: Vec<Curve>,
}

/// One model's profile.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name of the model, with what was added to it.
    pub name: String,
    /// M [1/unit²] at the profile's radii, per channel.
    pub exitance: Vec<[f64; 3]>,
    /// Flux through each ring of the Monte Carlo run, per channel; empty without a run.
    ring_flux: [Vec<f64>; 3],
    /// Total reflectance as the model states it.
    pub total: [f64; 3],
}

impl Profile {
    /// A profile without curves of `medium`, whose unit is called `unit` and is `unit_in_mm` millimetres long, at radii
    /// `r` [unit]. `material`, if `medium` is a row of the catalogue, brings the Monte Carlo runs.
    pub fn new(
        medium: Medium,
        (unit, unit_in_mm): (&str, f64),
        material: Option<&Measured>,
        r: Option<Vec<f64>>,
    ) -> Self {
        let r = r.unwrap_or_else(|| geometric(default_range(&medium), 200));
        let runs = std::array::from_fn(|c| material.and_then(|m| channel_run(m.name, c)));
        let title = material.map_or("Medium".to_owned(), |m| format!("{} [{}]", m.name, m.source));
        Self { title, medium, unit: unit.to_owned(), unit_in_mm, r, runs, curves: Vec::new() }
    }

    /// Radii [unit].
    pub fn radii(&self) -> &[f64] {
        &self.r
    }

    /// The curves so far.
    pub fn curves(&self) -> &[Curve] {
        &self.curves
    }

    /// Adds `model` under `name`, with exact single scattering where the model leaves it out; the curve's name says so.
    pub fn add(&mut self, name: &str, model: &dyn Bssrdf) {
        let exit_factor = PI * FresnelMoments::new(f64::from(self.medium.eta)).four_c_phi_outside;
        let entry = Entry { x: Vec3::ZERO, n: Vec3::Z, w: -Vec3::Z };
        let single: Option<[SingleChannel; 3]> = (!model.claims().first_order)
            .then(|| std::array::from_fn(|c| SingleChannel::new(&ChannelMedium::of(&self.medium, c))));
        let exitance = |r: f64| -> [f64; 3] {
            let s_d = model.eval(&entry, &Exit { x: Vec3::new(r as f32, 0.0, 0.0), n: Vec3::Z, w: Vec3::Z });
            std::array::from_fn(|c| {
                let once = single.map_or(0.0, |s| s[c].exitance(DVec3::new(r, 0.0, 0.0), DVec3::Z, -DVec3::Z));
                f64::from(s_d[c]) * exit_factor + once
            })
        };
        let ring_flux =
            std::array::from_fn(|c| self.rings(self.runs[c]).map(|ring| ring_sum(&ring, |r| exitance(r)[c])).collect());
        let total = model.total();
        self.curves.push(Curve {
            name: if single.is_some() { format!("{name} + single") } else { name.to_owned() },
            exitance: self.r.iter().map(|&r| exitance(r)).collect(),
            ring_flux,
            total: std::array::from_fn(|c| f64::from(total[c]) + single.map_or(0.0, |s| s[c].total())),
        });
    }

    /// Rings of a run with radii in the profile's unit.
    fn rings<'a>(&self, run: Option<&'a Run>) -> impl Iterator<Item = Bin> + use<'a> {
        let per_mm = 1.0 / self.unit_in_mm;
        run.into_iter().flat_map(Run::bins).map(move |b| Bin { r_min: b.r_min * per_mm, r_max: b.r_max * per_mm, ..b })
    }

    /// Total reflectance of channel `c`: the transfer equation for isotropic scattering with the reduced coefficients.
    pub fn reference_total(&self, c: usize) -> f64 {
        HalfSpace::new(f64::from(self.medium.eta)).reflectance(self.optics()[c].absorbed_prime)
    }

    fn optics(&self) -> [ChannelOptics; 3] {
        ChannelOptics::of(&self.medium)
    }

    /// Channels that differ: one for a grey medium.
    fn channels(&self) -> std::ops::Range<usize> {
        0..if self.medium.is_grey() { 1 } else { 3 }
    }

    fn channel_name(&self, c: usize) -> &'static str {
        if self.medium.is_grey() { "grey" } else { CHANNELS[c] }
    }

    /// A table with one row per curve, channel and radius, and one per ring of the Monte Carlo runs (at the ring's mean
    /// radius, with its standard error). Totals are comments at the head.
    pub fn to_csv(&self) -> String {
        let unit = &self.unit;
        let mut out = String::new();
        let _ = writeln!(out, "# {}", self.title);
        let _ =
            writeln!(out, "# exitance M [1/{unit}^2] of a half space per entered flux, normal incidence; r [{unit}]");
        for c in self.channels() {
            let k = self.optics()[c];
            let name = self.channel_name(c);
            let _ = writeln!(
                out,
                "# {name}: reduced albedo {}, transport mean free path {} {unit}, diffusion length {} {unit}",
                digits(k.alpha_prime, 8),
                short(k.transport_mean_free_path),
                short(k.diffusion_length)
            );
            let _ = writeln!(out, "# total,transfer equation,{name},{}", digits(self.reference_total(c), 6));
            for curve in &self.curves {
                let _ = writeln!(out, "# total,{},{name},{}", curve.name, digits(curve.total[c], 6));
            }
        }
        out.push_str("curve,channel,r,exitance,standard_error\n");
        for curve in &self.curves {
            for c in self.channels() {
                let name = self.channel_name(c);
                for (r, m) in std::iter::zip(&self.r, &curve.exitance) {
                    let _ = writeln!(out, "{},{name},{r:.6e},{:.6e},", curve.name, m[c]);
                }
            }
        }
        for c in self.channels() {
            for ring in self.rings(self.runs[c]) {
                let area = ring.area();
                let (flux, error) = (ring.flux() / area, ring.error / area);
                let name = self.channel_name(c);
                let _ = writeln!(out, "monte_carlo,{name},{:.6e},{flux:.6e},{error:.3e}", mean_radius(&ring));
            }
        }
        out
    }

    /// The profiles over logarithmic axes, a panel for each channel, and below each the ratio to the Monte Carlo run
    /// where there is one.
    pub fn to_svg(&self) -> String {
        let unit = &self.unit;
        let any_run = self.channels().any(|c| self.runs[c].is_some());
        let x = |label: String| Axis { label, min: self.r[0], max: self.r[self.r.len() - 1], scale: Scale::Log };
        let (y_min, y_max) = self.exitance_range();
        let r_label = format!("distance r [{unit}]");
        let mut upper = Vec::new();
        let mut lower = Vec::new();
        for c in self.channels() {
            upper.push(Panel {
                title: self.panel_title(c),
                x: x(if any_run { String::new() } else { r_label.clone() }),
                y: Axis {
                    label: format!("exitance M(r) per entered flux [1/{unit}²]"),
                    min: y_min,
                    max: y_max,
                    scale: Scale::Log,
                },
                series: self.exitance_series(c),
                notes: self.total_notes(c),
            });
            lower.push(Panel {
                title: String::new(),
                x: x(r_label.clone()),
                y: Axis { label: "model / Monte Carlo".to_owned(), min: 0.0, max: 2.0, scale: Scale::Linear },
                series: self.ratio_series(c),
                notes: if self.runs[c].is_none() { vec!["no Monte Carlo run".to_owned()] } else { Vec::new() },
            });
        }
        let mut rows = vec![Row { height: 380.0, panels: upper }];
        if any_run {
            rows.push(Row { height: 150.0, panels: lower });
        }
        let mut legend: Vec<(Stroke, String)> =
            self.curves.iter().enumerate().map(|(i, curve)| (line(i), curve.name.clone())).collect();
        let mut footnotes = vec!["Half space, normal incidence, per flux that entered.".to_owned()];
        if any_run {
            legend.push((TRUTH, "Monte Carlo, all orders".to_owned()));
            footnotes.push(
                "Monte Carlo: transfer equation with isotropic scattering and the reduced coefficients, 2e7 photons a channel; \
                 bars are standard errors; ratios are of fluxes through the same rings."
                    .to_owned(),
            );
        }
        let title = format!("{}: radial profile", self.title);
        let g = self.medium.g;
        let subtitle = format!("η = {}, g = {}", self.medium.eta, g);
        Figure { title, subtitle, rows, legend, footnotes, ..Figure::default() }.to_svg()
    }

    fn panel_title(&self, c: usize) -> String {
        let k = self.optics()[c];
        let length =
            |value: f64| if value.is_finite() { format!("{} {}", short(value), self.unit) } else { "∞".into() };
        format!(
            "{}: α′ = {}, ℓ′ = {}, 1/σₜᵣ = {}",
            self.channel_name(c),
            albedo(k.alpha_prime),
            length(k.transport_mean_free_path),
            length(k.diffusion_length)
        )
    }

    fn total_notes(&self, c: usize) -> Vec<String> {
        let mut notes = vec!["total reflectance".to_owned()];
        match self.runs[c] {
            Some(run) => notes.push(format!("  Monte Carlo {}", albedo(run.reflectance))),
            None => notes.push(format!("  transfer equation {}", albedo(self.reference_total(c)))),
        }
        notes.extend(self.curves.iter().map(|curve| format!("  {} {}", curve.name, albedo(curve.total[c]))));
        notes
    }

    fn exitance_series(&self, c: usize) -> Vec<Series> {
        let mut all: Vec<Series> = self
            .curves
            .iter()
            .enumerate()
            .map(|(i, curve)| {
                let points = std::iter::zip(&self.r, &curve.exitance).map(|(&r, m)| (r, m[c], 0.0)).collect();
                Series { stroke: line(i), points }
            })
            .collect();
        let points = self
            .rings(self.runs[c])
            .map(|ring| (mean_radius(&ring), ring.flux() / ring.area(), ring.error / ring.area()))
            .collect();
        all.push(Series { stroke: TRUTH, points });
        all
    }

    fn ratio_series(&self, c: usize) -> Vec<Series> {
        let one = vec![(self.r[0], 1.0, 0.0), (self.r[self.r.len() - 1], 1.0, 0.0)];
        let mut all = vec![Series { stroke: Stroke::Line { colour: "#222222", dash: "1 3" }, points: one }];
        for (i, curve) in self.curves.iter().enumerate() {
            let points = std::iter::zip(self.rings(self.runs[c]), &curve.ring_flux[c])
                .map(|(ring, flux)| (mean_radius(&ring), flux / ring.flux(), 0.0))
                .collect();
            all.push(Series { stroke: line(i), points });
        }
        all
    }

    /// Decades that hold the curves and the truth, at most nine of them.
    fn exitance_range(&self) -> (f64, f64) {
        let (r_min, r_max) = (self.r[0], self.r[self.r.len() - 1]);
        let channels = self.channels();
        let curves = self.curves.iter().flat_map(|curve| &curve.exitance).flat_map(|m| m[channels.clone()].to_vec());
        let truth = self.channels().flat_map(|c| {
            self.rings(self.runs[c]).filter(|b| b.r_max < r_max && b.r_min > r_min).map(|b| b.flux() / b.area())
        });
        let positive = curves.chain(truth).filter(|m| m.is_finite() && *m > 0.0);
        let (low, high) = positive.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), m| (low.min(m), high.max(m)));
        if high <= 0.0 {
            return (1e-6, 1.0);
        }
        let top = 10f64.powf(high.log10().ceil());
        (10f64.powf(low.log10().floor()).clamp(top * 1e-9, top * 0.01), top)
    }
}

const TRUTH: Stroke = Stroke::Points { colour: "#222222" };

fn line(i: usize) -> Stroke {
    Stroke::Line { colour: COLOURS[i % COLOURS.len()], dash: DASHES[i % DASHES.len()] }
}

/// Radius at which a smooth profile has about its mean over the ring.
fn mean_radius(ring: &Bin) -> f64 {
    (0.5 * (ring.r_min * ring.r_min + ring.r_max * ring.r_max)).sqrt()
}

/// Flux through `ring` of the exitance `m`, which may have an integrable pole at r = 0.
fn ring_sum(ring: &Bin, m: impl Fn(f64) -> f64) -> f64 {
    // Equal steps in r, each with its own area: the sum of r M is smooth where M goes as 1/r.
    let step = (ring.r_max - ring.r_min) / RING_POINTS as f64;
    (0..RING_POINTS)
        .map(|i| {
            let r = ring.r_min + (i as f64 + 0.5) * step;
            2.0 * PI * r * m(r) * step
        })
        .sum()
}

/// `n` radii from `range.0` to `range.1`, both included, in equal ratios.
fn geometric(range: (f64, f64), n: usize) -> Vec<f64> {
    let ratio = range.1 / range.0;
    (0..n).map(|i| range.0 * ratio.powf(i as f64 / (n - 1) as f64)).collect()
}

/// From a hundredth of the shortest transport mean free path to where the widest channel has faded.
fn default_range(medium: &Medium) -> (f64, f64) {
    let channels = ChannelOptics::of(medium);
    let there = channels.iter().filter(|k| k.transport_mean_free_path.is_finite());
    let low = there.clone().map(|k| 0.01 * k.transport_mean_free_path).fold(f64::INFINITY, f64::min);
    let reach = |k: &ChannelOptics| (100.0 * k.transport_mean_free_path).min(15.0 * k.diffusion_length);
    let high = there.map(reach).fold(0.0, f64::max);
    if high > low { (low, high) } else { (0.01, 100.0) }
}

/// Three significant digits.
fn short(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return value.to_string();
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    if value.abs() < 1e-4 || value.abs() >= 1e5 { format!("{value:.2e}") } else { format!("{value:.digits$}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bssrdf::StandardDipole;
    use crate::optics::find;

    #[test]
    fn the_curve_has_the_total_of_the_model() {
        let row = find("marble").unwrap();
        let medium = row.medium(1.0);
        let mut profile = Profile::new(medium, ("mm", 1.0), Some(row), Some(geometric((1e-4, 400.0), 4000)));
        profile.add("standard", &StandardDipole::new(&medium, true));
        let curve = &profile.curves()[0];
        for c in 0..3 {
            let r = profile.radii();
            let sum: f64 = (1..r.len())
                .map(|i| {
                    let middle = (r[i] * curve.exitance[i][c] + r[i - 1] * curve.exitance[i - 1][c]) / 2.0;
                    2.0 * PI * middle * (r[i] - r[i - 1])
                })
                .sum();
            assert!((sum / curve.total[c] - 1.0).abs() < 2e-4, "channel {c}: {sum} against {}", curve.total[c]);
        }
    }

    #[test]
    fn rings_of_the_plot_are_those_of_the_unit() {
        let row = find("marble").unwrap();
        let flux = |unit_in_mm: f64| {
            let medium = row.medium(unit_in_mm);
            let mut profile = Profile::new(medium, ("unit", unit_in_mm), Some(row), None);
            profile.add("standard", &StandardDipole::new(&medium, true));
            profile.curves()[0].ring_flux[1].clone()
        };
        for (mm, cm) in std::iter::zip(flux(1.0), flux(10.0)) {
            assert!((mm / cm - 1.0).abs() < 1e-5);
        }
        // The standard dipole has the right colour of marble: within 2 % over the rings of the run.
        let run = channel_run("marble", 1).unwrap();
        let (model, truth): (f64, f64) = (flux(1.0).iter().sum(), run.bins().map(|b| b.flux()).sum());
        assert!((model / truth - 1.0).abs() < 0.02, "{model} against {truth}");
    }

    #[test]
    fn lengths_are_short() {
        assert_eq!(["12300", "0.123", "1.23", "1.23e-5"], [12300.0, 0.1234, 1.234, 1.234e-5].map(short));
    }
}
