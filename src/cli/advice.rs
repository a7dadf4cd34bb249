//! What is said of a scene before it is rendered: how wrong the model of each body is expected to be, what to type for a
//! better one, and whether the camera sees anything. `check` says all of it, `render` a line for each body.

use super::setup::{Method, Prepared};
use marmor::bssrdf::{Unmeasured, measured_albedos};
use marmor::film::Window;
use marmor::integrator::{LocalShape, ModelOnBody, TOLERANCE, Trustworthiness, Verdict, View};
use marmor::render::{Aim, nothing_in_view, shares};
use marmor::scene::{ExitanceBy, Scene};
use marmor::words::{albedo, counted, digits, percent, short};
use serde_json::{Value, json};

/// Bodies that a render has a line for.
const MOST_LINES: usize = 3;

/// What is known before the first pass.
pub struct Advice<'a> {
    prepared: &'a Prepared,
    /// Of each object the share of the picture.
    pub shares: Vec<f64>,
    /// Where to look, if nothing is in the picture.
    pub empty: Option<Aim>,
    /// The whole picture, or a part of it.
    cropped: bool,
    /// The bodies that were looked at, those that fill the picture first.
    pub bodies: Vec<Trustworthiness>,
    /// Bodies that were not.
    more: usize,
}

impl<'a> Advice<'a> {
    /// Of the picture in `window`; of `most` bodies at most.
    pub fn new(prepared: &'a Prepared, view: View<'_>, window: Window, most: usize, tolerance: f64) -> Self {
        let scene = &prepared.scene;
        let shares = shares(view, window);
        let empty = nothing_in_view(view, window, &shares);
        let mut order = translucent(scene);
        if most < order.len() {
            order.sort_by(|a, b| shares[*b as usize].total_cmp(&shares[*a as usize]));
        }
        let more = order.len().saturating_sub(most);
        let of = |object: &u32| Trustworthiness::new(view, &LocalShape::new(scene, *object)?, tolerance);
        // No other method has a model or goes through a body.
        let judged = matches!(prepared.method, Method::Subsurface(_) | Method::VolumePath(_));
        let bodies = order.iter().take(most).filter(|_| judged).filter_map(of).collect();
        let cropped = window != Window::full(scene.camera.resolution);
        Self { prepared, shares, empty, cropped, bodies, more }
    }

    /// What a render says before it begins; with `silent` nothing.
    pub fn before_render(prepared: &'a Prepared, view: View<'_>, window: Window, silent: bool) -> Self {
        let advice = Self::new(prepared, view, window, MOST_LINES, TOLERANCE);
        if !silent {
            advice.warning().iter().for_each(|line| eprintln!("warning: {line}"));
            advice.lines().iter().for_each(|line| eprintln!("{line}"));
        }
        advice
    }

    /// That the picture is empty.
    pub fn warning(&self) -> Option<String> {
        let aim = self.empty.as_ref()?;
        let (scene, [x, y, z]) = (&self.prepared.scene, aim.at.to_array().map(|v| digits(v, 7)));
        let where_it_is = match aim.degrees {
            90.0.. => "lies behind the camera".into(),
            angle => format!("lies {angle:.0} degrees away from the direction of view"),
        };
        let (who, remedy) = if self.cropped {
            ("the crop shows", "render without --crop, or look there with ")
        } else {
            ("the camera sees", "to look at it: ")
        };
        let none = match scene.objects.len() {
            1 => "nothing of the one object".into(),
            n => format!("none of the {n} objects"),
        };
        Some(format!(
            "{}: {who} {none}, the background alone: {:?} {where_it_is}, at ({x}, {y}, {z}); {remedy}\
             -D camera.look_at=[{x},{y},{z}]",
            scene.name, aim.object
        ))
    }

    /// A line for each body, or one for all where no model is used.
    pub fn lines(&self) -> Vec<String> {
        if let Some(line) = self.without_models() {
            return vec![line];
        }
        let mut lines: Vec<String> = self.bodies.iter().map(|t| self.line(t)).collect();
        if self.more > 0 {
            let more = counted(self.more, "more translucent body", "more translucent bodies");
            lines.push(format!("and {more}: marmor check {}", self.prepared.scene.name));
        }
        lines
    }

    /// What other methods make of translucent bodies.
    pub fn without_models(&self) -> Option<String> {
        let bodies = translucent(&self.prepared.scene);
        let first = &self.prepared.scene.objects[*bodies.first()? as usize].name;
        let who = match bodies.len() {
            1 => format!("translucent {first:?}"),
            n => format!("{first:?} and {}", counted(n - 1, "other translucent body", "other translucent bodies")),
        };
        match &self.prepared.method {
            Method::Subsurface(_) => None,
            Method::VolumePath(_) => Some(format!("{who}: light is traced through, no model: what is wrong is noise")),
            Method::Direct(_) | Method::Path(_) => {
                let method = self.prepared.method.name();
                Some(format!(
                    "{who}: `{method}` paints it matt (Lambertian), no light goes through: --method subsurface"
                ))
            }
            Method::AmbientOcclusion(_) => {
                Some(format!("{who}: `ambient_occlusion` shows shapes alone, no material: --method subsurface"))
            }
        }
    }

    /// A body in one line: its model, the expected error of it, and what to type instead.
    pub fn line(&self, t: &Trustworthiness) -> String {
        if self.walks(t) {
            return format!("{}: {}", t.object, self.walked(t));
        }
        let own = t.own().map_or(String::new(), |own| match own.distribution {
            Some(error) => format!("model {}, expected error {}{}", name(own), percent(error), darker(t)),
            None => format!("model {}, its error is not known: {}", name(own), self.why_unknown(t, own)),
        });
        let mut choices = Vec::new();
        // Of a mesh that wants mending a warning has said how.
        if mend(t).is_none() {
            choices.extend(self.better(t).map(|(model, words)| format!("{words}: {}", share(model))));
            choices.extend(self.walk(t));
            choices.extend(trace(t, "right, but slower"));
        }
        choices.extend(self.not_walked(t).map(|why| format!("paths do not walk through it: {why}")));
        let choices: String = choices.into_iter().map(|choice| format!("; {choice}")).collect();
        format!("{}: {own}{choices}", t.object)
    }

    /// Whether paths walk through the body.
    fn walks(&self, t: &Trustworthiness) -> bool {
        matches!(&self.prepared.method, Method::Subsurface(s) if s.walks(t.index))
    }

    /// What is said of a body that they do walk through.
    fn walked(&self, t: &Trustworthiness) -> String {
        let inside = self.prepared.scene.surface(t.index).inside.as_ref();
        let model = inside.map_or("the model", |inside| inside.model_under_walks().name());
        format!(
            "paths walked through it say how much leaves where, `{model}` what is finer than a patch: within some percent and noise"
        )
    }

    /// Why they do not, where nobody has asked for that.
    fn not_walked(&self, t: &Trustworthiness) -> Option<String> {
        let Method::Subsurface(_) = &self.prepared.method else { return None };
        match self.prepared.scene.exitance_by(t.index, self.prepared.file.method.shape()) {
            ExitanceBy::ModelFor(why) if mend(t).is_none() => Some(why),
            _ => None,
        }
    }

    /// That the model need not be all, where paths can walk through the body.
    fn walk(&self, t: &Trustworthiness) -> Option<String> {
        let method = &self.prepared.file.method;
        let can = matches!(&self.prepared.method, Method::Subsurface(_))
            && !self.prepared.as_notes
            && method.bounces != Some(0)
            && self.prepared.scene.not_walkable(t.index).is_empty()
            && self.prepared.scene.long_walks(t.index).is_none();
        (can && t.verdict != Verdict::Trust).then(|| "--shape walked: within some percent".into())
    }

    /// A body in some lines, for `check`.
    pub fn paragraph(&self, t: &Trustworthiness) -> Vec<String> {
        let mut lines = vec![format!("{} (material {}):", t.object, t.material)];
        if self.walks(t) {
            lines.push(format!("  {}", self.walked(t)));
            lines.push("  its model alone, --shape half-space:".into());
        }
        lines.extend(self.not_walked(t).map(|why| format!("  paths do not walk through it: {why}")));
        if let (Some(own), true) = (t.own(), mend(t).is_some() || t.verdict == Verdict::NotMeasured) {
            lines.push(format!("  {} (chosen): error not known, of no model: {}", name(own), self.why_unknown(t, own)));
        } else {
            for model in &t.models {
                let what = match model.distribution {
                    Some(error) => format!("expected error {}{}", percent(error), self.more_of(t, model)),
                    None => format!("error not known: {}", self.why_unknown(t, model)),
                };
                let chosen = if model.chosen { " (chosen)" } else { "" };
                lines.push(format!("  {}{chosen}: {what}", name(model)));
            }
        }
        let albedo = range(t.alpha_prime);
        lines.push(match t.thickness {
            [Some(thin), Some(middle), Some(thick)] => format!(
                "  {} to {} transport mean free paths thick, median {}; reduced albedo {albedo}",
                digits(thin, 2),
                digits(thick, 2),
                digits(middle, 2)
            ),
            _ => format!("  reduced albedo {albedo}"),
        });
        if t.open > 0.005 && t.open < 0.995 {
            lines
                .push(format!("  on {} of its area nothing lies on the other side: the mesh is open", percent(t.open)));
        }
        if self.walks(t) {
            return lines;
        }
        let advice = self.advice(t);
        let so = if advice.is_empty() { vec!["trust the chosen model".into()] } else { advice };
        lines.extend(so.into_iter().map(|line| format!("  -> {line}")));
        lines
    }

    /// Everything about a body for a program to read.
    pub fn json(&self, t: &Trustworthiness) -> Value {
        let mut value = json!(t);
        value["sentence"] = self.line(t).into();
        value["take"] = self.take(t).into();
        value["walked"] = self.walks(t).into();
        value
    }

    /// What to do, in as many short parts as it takes; nothing where all is well.
    fn advice(&self, t: &Trustworthiness) -> Vec<String> {
        if let Some(how) = mend(t) {
            return vec![how.into()];
        }
        let Some(best) = t.models.first() else { return Vec::new() };
        let wrong = format!("{} errs by more than {} %", name(best), digits(100.0 * t.tolerance, 3));
        let mut said = Vec::new();
        match t.verdict {
            Verdict::Trust | Verdict::Open | Verdict::Unwelded | Verdict::InsideOut => {}
            Verdict::NotMeasured => said.push("nothing is known of how wrong the picture is".into()),
            Verdict::WhereThick => {
                let beyond = best.beyond.map_or(String::new(), |b| format!(" on {} of its area", percent(b)));
                said.push(format!("{wrong}{beyond}, where the body is thin or bends sharply"));
            }
            Verdict::TooThin => said.push(format!("too thin, or too sharply bent, for any model: even {wrong}")),
            Verdict::Nowhere => {
                said.push(format!("no model is right in this medium, whatever the thickness: even {wrong}"))
            }
        }
        said.extend(self.better(t).map(|(model, words)| format!("{} is better: {words}", name(model))));
        said.extend(trace(t, if t.verdict == Verdict::NotMeasured { "compare with it" } else { "right, but slower" }));
        said
    }

    /// The best model and the words that bring it, where changing to it is worth the while and its figure is good, or there is
    /// nothing better to be had.
    fn better<'t>(&self, t: &'t Trustworthiness) -> Option<(&'t ModelOnBody, String)> {
        let best = t.models.first().filter(|m| !m.chosen)?;
        let (own, least) = (t.own()?.distribution, best.distribution?);
        let good = least <= GOOD.max(t.tolerance) || t.untraceable.is_some();
        (good && own.is_none_or(|own| is_worth_it(own, least, t.tolerance))).then(|| (best, self.words(t, best)))
    }

    /// What to type for the better choice; none where there is none.
    fn take(&self, t: &Trustworthiness) -> Option<String> {
        let traced = t.verdict != Verdict::Trust && t.untraceable.is_none();
        if self.walks(t) {
            return None;
        }
        match t.verdict {
            Verdict::InsideOut | Verdict::Unwelded => Some("--repair".into()),
            Verdict::Open => None,
            _ if traced => Some(TRACE.into()),
            _ => self.better(t).map(|(_, words)| words),
        }
    }

    /// Options that give the body this model: by `--model` where that is about this body alone, or where the model is chosen
    /// for all of them already.
    fn words(&self, t: &Trustworthiness, model: &ModelOnBody) -> String {
        let set = |key: &str, value: &str| {
            let (name, plain) = (&t.material, |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-');
            match name.chars().all(plain) {
                true => format!("-D material.{name}.{key}={value}"),
                // -D takes everything up to the next dot for a name.
                false if !name.contains(['.', '=', '\'']) => format!("-D 'material.{name}.{key}={value}'"),
                false => format!("{key} = {value} in the section of material {name:?}"),
            }
        };
        let translucent = |m: &&marmor::scene::Material| m.surface.is_translucent();
        let alone = self.prepared.scene.materials.iter().filter(translucent).count() == 1;
        let for_all = alone || self.prepared.file.method.model.is_some();
        let mut words = vec![if for_all { format!("--model {}", model.model) } else { set("model", model.model) }];
        if model.calibrated {
            words.push(set("calibrated", "true"));
        }
        // A sheet has told its own.
        let told = self.prepared.scene.objects[t.index as usize].sheet.is_some();
        words.extend(model.thickness.filter(|_| !told).map(|t| set("thickness", &short(f64::from(t)))));
        let notes = if self.prepared.as_notes { " in place of --as-notes" } else { "" };
        words.join(" ") + notes
    }

    /// Why a model has no figure on a body.
    fn why_unknown(&self, t: &Trustworthiness, model: &ModelOnBody) -> String {
        let unit = |length: f32| format!("{} units", short(length.into()));
        match (t.verdict, model.unmeasured) {
            (Verdict::InsideOut, _) => "its faces look inwards".into(),
            (Verdict::Unwelded, _) => "its triangles do not share their corners".into(),
            (Verdict::Open, _) => "its mesh has no inside".into(),
            (_, Some(Unmeasured::Thin)) => "thinner than 1 transport mean free path, where no model holds".into(),
            (_, Some(Unmeasured::Albedo)) => {
                let [low, high] = measured_albedos(t.g);
                format!("measured for reduced albedos of {low} to {high}, here {}", range(t.alpha_prime))
            }
            (_, Some(Unmeasured::Index)) => format!("measured for eta 1 to 1.5, here {}", digits(t.eta, 4)),
            (_, Some(Unmeasured::Cosine)) => format!("measured for g 0 to 0.8, here {}", digits(t.g, 4)),
            (_, Some(Unmeasured::Model)) => match model.thickness {
                Some(thickness) => format!("most of the body is no slab of {}", unit(thickness)),
                None => "this model has not been measured".into(),
            },
            (_, Some(Unmeasured::Open) | None) => "there is no other side".into(),
        }
    }

    /// What a figure of a body is to be read with.
    fn more_of(&self, t: &Trustworthiness, model: &ModelOnBody) -> String {
        let mut more = if model.chosen { darker(t) } else { String::new() };
        if let Some(far) = model.far {
            let side = if far > 0.0 { "bright" } else { "dark" };
            more += &format!(", light from behind {} too {side}", percent(far.abs()));
        }
        more
    }
}

const GIVE_THICKNESS: &str = "give it a thickness: that of the object, or a closed mesh, both faces and the rim";
const WELD: &str = "weld its corners: --repair";
const TURN: &str = "turn its faces: --repair, or flip = true in the scene";
const TRACE: &str = "--method volume_path";

/// More than this of the light in the wrong place is not good: a model that errs by more is not advised where
/// `volume_path` can trace the body. `standard` errs by 15 to 40 % on a plane (docs/models.md).
const GOOD: f64 = 0.3;

/// Whether an error of `least` in place of `own` is worth a change of model: by a quarter less, or within the tolerance where
/// `own` is not; in both cases by more than the table behind the figures is wrong by.
fn is_worth_it(own: f64, least: f64, tolerance: f64) -> bool {
    own - least > 0.02 && (least <= 0.75 * own || least <= tolerance && own > tolerance)
}

/// What a body's mesh wants before any model can be judged on it.
fn mend(t: &Trustworthiness) -> Option<&'static str> {
    match t.verdict {
        Verdict::Open => Some(GIVE_THICKNESS),
        Verdict::Unwelded => Some(WELD),
        Verdict::InsideOut => Some(TURN),
        _ => None,
    }
}

/// What there is to say of path tracing, where no model will do.
fn trace(t: &Trustworthiness, what_for: &str) -> Option<String> {
    if t.verdict == Verdict::Trust {
        return None;
    }
    Some(match &t.untraceable {
        None => format!("{TRACE}: {what_for}"),
        Some(why) => format!("volume_path cannot trace it: {why}"),
    })
}

/// Numbers of the translucent objects.
fn translucent(scene: &Scene) -> Vec<u32> {
    let is = |object: &u32| scene.surface(*object).is_translucent();
    (0..scene.objects.len() as u32).filter(is).collect()
}

fn name(model: &ModelOnBody) -> String {
    format!("`{}`{}", model.model, if model.calibrated { " calibrated" } else { "" })
}

fn share(model: &ModelOnBody) -> String {
    model.distribution.map_or("an unknown share".into(), percent)
}

fn darker(t: &Trustworthiness) -> String {
    t.darker.map_or(String::new(), |d| format!(" (and {} darker, without exit normalisation)", percent(d)))
}

/// Two ends, or one number where they print alike.
fn range(ends: [f64; 2]) -> String {
    let [low, high] = ends.map(albedo);
    if low == high { low } else { format!("{low} to {high}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_model_is_worth_a_quarter_of_the_error_or_the_tolerance() {
        for (own, least, worth) in [
            (0.86, 0.68, false),
            (0.40, 0.22, true),
            (0.12, 0.06, true),
            (0.08, 0.065, false),
            (0.115, 0.09, true),
            (0.15, 0.12, false),
        ] {
            assert_eq!(is_worth_it(own, least, 0.1), worth, "{own} {least}");
        }
    }
}
