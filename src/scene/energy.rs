//! Where a model sends out more light than has entered, by its own nature or by the shape it is used on: said before a
//! render, with the factor and a remedy.

use super::Translucent;
use super::body::Shape;
use crate::bssrdf::{Bssrdf, Conditions, ModelName, ModelOption, SingleScattering, expected_error};
use crate::math::Rgb;
use crate::optics::{ChannelOptics, Medium};
use crate::words::{digits, percent, short};

/// Excess of light that is said. On a plane, models of a half space err by up to 0.12 themselves (`beam` at η = 1).
const EXCESS: f64 = 0.15;
/// The same in media that have not been measured.
const UNMEASURED_EXCESS: f64 = 0.05;
/// A slab is another one where its thickness differs from the body's by more than this factor.
const OTHER_SLAB: f64 = 1.25;
/// Thickness from which `slab` is to be trusted [transport mean free paths].
const SLAB_FROM: f64 = 2.0;

/// Why `volume_path` is no remedy for the object; see [`super::Scene::untraceable`].
type Untraceable<'a> = dyn Fn() -> Option<String> + 'a;

/// What is to say of the energy of an object's model; nothing where it is as good as on a plane.
pub(super) fn of(
    t: &Translucent,
    (shape, is_sheet): (Option<Shape>, bool),
    untraceable: &Untraceable<'_>,
) -> Vec<String> {
    let Ok(model) = t.build() else { return Vec::new() };
    let sheet = shape.as_ref().and_then(|shape| too_thin(t, &*model, (shape, is_sheet), untraceable));
    // A thin body is the larger error, and has one remedy.
    let nature = if sheet.is_none() { by_nature(t, &*model, untraceable) } else { None };
    sheet.into_iter().chain(nature).chain(shape.and_then(|shape| other_slab(t, &*model, &shape, untraceable))).collect()
}

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// The largest of a number of each channel, and in words which channel's it is, where they differ.
fn largest(medium: &Medium, values: impl Iterator<Item = (usize, f64)>) -> Option<(String, f64)> {
    let (c, value) = values.max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((if medium.is_grey() { String::new() } else { format!(" in {}", CHANNELS[c]) }, value))
}

/// `volume_path`, where it can trace the body, and what else would do.
fn remedy(other: Option<String>, untraceable: &Untraceable<'_>) -> String {
    match (untraceable(), other) {
        (None, None) => "take method `volume_path`".into(),
        (None, Some(words)) => format!("take method `volume_path`, or {words}"),
        (Some(_), Some(words)) => words,
        (Some(why), None) => format!("`volume_path` cannot trace it: {why}"),
    }
}

/// A model of a half space lets light out through both faces of a sheet as if each were the only one.
fn too_thin(
    t: &Translucent,
    model: &dyn Bssrdf,
    (shape, is_sheet): (&Shape, bool),
    untraceable: &Untraceable<'_>,
) -> Option<String> {
    if model.name().takes(ModelOption::Thickness) {
        return None;
    }
    let (eta, optics) = (f64::from(t.medium.eta), ChannelOptics::of(&t.medium));
    let scatters = |k: &ChannelOptics| k.alpha_prime > 0.0;
    let place = |k: &ChannelOptics| Conditions::new(k, eta, shape.thickness, shape.curvature);
    // Beyond the table its nearest end.
    let error =
        |place: Conditions| expected_error(model.name(), &t.options(), &place.nearest_measured()).unwrap_or_default();
    let here = |k: &ChannelOptics| error(place(k));
    let factor = |k: &ChannelOptics| 1.0 + here(k).total;
    let plane = |k: &ChannelOptics| 1.0 + error(Conditions::new(k, eta, f64::INFINITY, 0.0)).total;
    let each = || optics.iter().enumerate().filter(|(_, k)| scatters(k));
    let thickness = shape.thickness;
    let path = each().map(|(_, k)| k.transport_mean_free_path).fold(0.0, f64::max);
    let head = format!(
        "`{}` is a model of a half space, and the body is some {} units thick, {} transport mean free paths",
        model.name().name(),
        short(thickness),
        digits(thickness / path, 3)
    );
    // Worse than the same medium in a body without end.
    let brighter = largest(&t.medium, each().filter(|(_, k)| factor(k) > plane(k)).map(|(c, k)| (c, factor(k))));
    if let Some((channel, factor)) = brighter.filter(|(_, factor)| *factor > 1.0 + EXCESS) {
        let words = |is_sheet| match is_sheet {
            true => "take model `slab`".to_string(),
            false => format!("take model `slab` with thickness = {} if it is flat", short(thickness)),
        };
        let slab = (thickness > SLAB_FROM * path).then(|| words(is_sheet));
        let measured = each().all(|(_, k)| place(k) == place(k).nearest_measured());
        let (about, like) = if measured {
            ("up to", "")
        } else {
            ("some", ", as in the nearest medium and thickness that are measured")
        };
        return Some(format!(
            "{head}: where all sides are lit it sends out {about} {factor:.2} times the light that it should{channel}{like}; {}",
            remedy(slab, untraceable)
        ));
    }
    let (channel, error) = largest(&t.medium, each().map(|(c, k)| (c, here(k).distribution)))?;
    (thickness < path).then(|| {
        format!(
            "{head}: {} of the light or more comes out in the wrong places{channel}; {}",
            percent(error),
            remedy(None, untraceable)
        )
    })
}

/// More than all of the light, on a plane and without any absorption: `directional` as published, and models that add
/// single scattering to a sum of all other orders that knows nothing of the phase function.
fn by_nature(t: &Translucent, model: &dyn Bssrdf, untraceable: &Untraceable<'_>) -> Option<String> {
    let clear = Translucent { medium: Medium { sigma_a: Rgb::BLACK, ..t.medium }, model: model.name(), ..t.clone() };
    let total = furnace(&clear.medium, &*clear.build().ok()?);
    let (channel, factor) = largest(&t.medium, (0..3).map(|c| (c, f64::from(total[c]))))?;
    // What no table knows is held to what the model says of itself.
    let optics = ChannelOptics::of(&t.medium);
    let plane = |k: &ChannelOptics| Conditions::new(k, t.medium.eta.into(), f64::INFINITY, 0.0);
    let measured = optics.iter().all(|k| expected_error(model.name(), &t.options(), &plane(k)).is_ok());
    let excess = if measured { EXCESS } else { UNMEASURED_EXCESS };
    (factor > 1.0 + excess).then(|| {
        let (name, Medium { g, eta, .. }) = (model.name().name(), t.medium);
        let keeps = |other: Translucent| {
            other.build().is_ok_and(|model| f64::from(furnace(&other.medium, &*model).max()) <= 1.0 + excess)
        };
        let uncalibrated = model.name().takes(ModelOption::Calibrated) && !t.calibrated;
        let why = match model.claims().first_order {
            _ if uncalibrated => "as published".to_string(),
            true => format!("at g = {g} and eta = {eta}"),
            false => format!("with single scattering beside it, at g = {g} and eta = {eta}"),
        };
        let remedy = if uncalibrated && keeps(Translucent { calibrated: true, ..clear.clone() }) {
            let beam = keeps(Translucent { model: ModelName::BEAM, ..clear.clone() });
            format!("set calibrated = true{}", if beam { ", or take model `beam`" } else { "" })
        } else {
            let standard = keeps(Translucent { model: ModelName::STANDARD, ..clear.clone() })
                .then(|| "take model `standard`, which has all orders and no more than all light".to_string());
            remedy(standard, untraceable)
        };
        format!(
            "`{name}` {why} does not conserve energy: of a plane of this medium without absorption {factor:.2} times the \
             light that has entered comes back{channel}, and with absorption it is too bright as well; {remedy}"
        )
    })
}

/// What comes back of what has entered a plane along the normal, single scattering included where the renderer adds it.
fn furnace(medium: &Medium, model: &dyn Bssrdf) -> Rgb {
    let total = model.total();
    if model.claims().first_order { total } else { total + SingleScattering::new(medium).total() }
}

/// A slab of another thickness than the body's.
fn other_slab(t: &Translucent, model: &dyn Bssrdf, shape: &Shape, untraceable: &Untraceable<'_>) -> Option<String> {
    let told = f64::from(t.thickness.filter(|_| model.name().takes(ModelOption::Thickness))?);
    let ratio = told / shape.thickness;
    (!(1.0 / OTHER_SLAB..=OTHER_SLAB).contains(&ratio)).then(|| {
        format!(
            "`slab` is told a thickness of {} units, and the body is some {} units thick: what it reflects and lets \
             through is that of another sheet; {}",
            short(told),
            short(shape.thickness),
            remedy(Some("set `thickness`".into()), untraceable)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bssrdf::ModelName;
    use crate::geometry::{examine, rectangle, sphere};
    use crate::math::DVec3;
    use crate::scene::Object;
    use std::f64::consts::PI;

    fn object(mesh: &crate::geometry::RawMesh) -> Object {
        let mesh = mesh.recentred(DVec3::ZERO);
        let findings = examine(&mesh);
        Object {
            name: String::new(),
            parts: Vec::new(),
            mesh,
            at: String::new(),
            material: 0,
            flipped: false,
            findings,
            priority: 0,
            sheet: None,
        }
    }

    fn shape(object: &Object) -> Option<Shape> {
        Shape::of(&object.mesh, &object.findings)
    }

    /// Six rectangles, their corners at the same places.
    fn cuboid(half: [f64; 3]) -> Object {
        let mut all = crate::geometry::RawMesh::default();
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let along = |i: usize| DVec3::from_array(std::array::from_fn(|k| if k == i { half[k] } else { 0.0 }));
                let (u, v) = (along((axis + 1) % 3), along((axis + 2) % 3));
                let face = rectangle(along(axis) * side, u * side, v);
                let base = all.positions.len() as u32;
                all.positions.extend(&face.positions);
                all.triangles.extend(face.triangles.iter().map(|t| t.map(|i| base + i)));
            }
        }
        object(&all)
    }

    #[test]
    fn sheets_rods_and_balls_have_their_thickness_and_curvature() {
        let of = |object: &Object| shape(object).unwrap();
        let close = |a: f64, b: f64| (a - b).abs() < 0.03 * b.abs() + 1e-3;
        let ball = of(&object(&sphere(DVec3::ONE, 2.0, 48, 96)));
        assert!(close(ball.thickness, 4.0) && close(ball.curvature, 0.5), "{ball:?}");
        let sheet = of(&cuboid([100.0, 0.1, 100.0]));
        assert!(close(sheet.thickness, 0.2) && sheet.curvature < 0.02, "{sheet:?}");
        // A square rod of width w: 2V/S = w/2, M/S = π/4w.
        let rod = of(&cuboid([1.0, 300.0, 1.0]));
        assert!(close(rod.thickness, 1.0 / (1.0 - PI / 8.0)) && close(rod.curvature, PI / 8.0), "{rod:?}");
        // ∫ H dA of a box is π times the sum of its edges.
        let found = cuboid([1.0, 2.0, 3.0]).findings;
        assert!((found.bend.unwrap() / (12.0 * PI) - 1.0).abs() < 1e-6, "{found:?}");
        assert_eq!(shape(&object(&rectangle(DVec3::ZERO, DVec3::X, DVec3::Y))), None);
    }

    #[test]
    fn what_is_thick_and_flat_in_a_plain_medium_is_not_said() {
        let medium = Medium::reduced(Rgb::splat(2.0), Rgb::splat(0.01), 1.3).unwrap();
        let of = |model| Translucent {
            medium,
            model,
            thickness: None,
            calibrated: false,
            exit_normalisation: true,
            tint: None,
            rough: None,
            source: String::new(),
        };
        let (thick, thin) = (cuboid([50.0, 20.0, 50.0]), cuboid([50.0, 0.2, 50.0]));
        for model in [ModelName::STANDARD, ModelName::BETTER, ModelName::BEAM, ModelName::NORMALISED, ModelName::AUTO] {
            assert_eq!(super::of(&of(model), (shape(&thick), false), &|| None), Vec::<String>::new(), "{model:?}");
            let said = super::of(&of(model), (shape(&thin), false), &|| None).join("\n");
            assert!(
                said.contains("model of a half space") && said.contains("0.804 transport mean free paths"),
                "{said}"
            );
            assert!(said.ends_with("take method `volume_path`"), "{said}");
            let crossed =
                super::of(&of(model), (shape(&thin), false), &|| Some("it passes through itself".into())).join("\n");
            assert!(crossed.ends_with("`volume_path` cannot trace it: it passes through itself"));
        }
        assert!(super::of(&of(ModelName::DIRECTIONAL), (shape(&thick), false), &|| None)[0].contains("1.24 times"));
    }

    /// Below and above the range of the table: said from 5 % on, with the model's own total and no remedy that is no better.
    #[test]
    fn media_that_no_table_covers_are_held_to_what_the_model_claims() {
        let thick = cuboid([50.0, 20.0, 50.0]);
        let of = |model, sigma_a, eta| Translucent {
            medium: Medium::reduced(Rgb::splat(2.0), Rgb::splat(sigma_a), eta).unwrap(),
            model,
            thickness: None,
            calibrated: false,
            exit_normalisation: true,
            tint: None,
            rough: None,
            source: String::new(),
        };
        let said = |model, eta| super::of(&of(model, 0.01, eta), (shape(&thick), false), &|| None).join("\n");
        for (model, eta, why) in [
            (ModelName::BETTER, 0.7, "with single scattering beside it, at g = 0 and eta = 0.7"),
            (ModelName::DIRECTIONAL, 1.9, "as published"),
        ] {
            let clear = of(model, 0.0, eta);
            let total = furnace(&clear.medium, &*clear.build().unwrap())[0];
            assert!(
                total > 1.05 && total < 1.15,
                "{model:?}: below what is said where a table covers the medium: {total}"
            );
            let words = said(model, eta);
            assert!(words.contains(why) && words.contains(&format!("{total:.2} times")), "{words}");
        }
        for (model, eta) in [(ModelName::STANDARD, 0.7), (ModelName::STANDARD, 1.9), (ModelName::BETTER, 1.3)] {
            assert_eq!(said(model, eta), "");
        }
        // Backwards, `beam` with single scattering beside it makes light too.
        for (g, remedy) in [(0.0, "; set calibrated = true, or take model `beam`"), (-0.999, "; set calibrated = true")]
        {
            let mut t = of(ModelName::DIRECTIONAL, 0.0, 1.3);
            t.medium.g = g;
            let words = super::of(&t, (shape(&thick), false), &|| None).join("\n");
            assert!(words.ends_with(remedy), "{words}");
        }
    }
}
