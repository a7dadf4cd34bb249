//! The front door: a scene as typed becomes a picture, by the same steps as on the command line.

use super::method::{self, Method};
use super::{Backend, Job, Seconds, Tally, run};
use crate::bssrdf::ModelName;
use crate::error::{Error, Result};
use crate::film::{Film, Image, Window, variance};
use crate::integrator::{View, lost};
use crate::scene::{Estimator, Material, MethodName, Object, Scene, SceneFile, Shape, Translucent};
use crate::words::counted;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Samples per pixel where neither scene nor options say.
pub const DEFAULT_SPP: u32 = 64;

/// What is asked of a render beside the `[method]` and `[render]` of its scene. More may come: write
/// `Options { spp: Some(16), ..Options::default() }`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Samples per pixel, at least 1; if absent the scene's, else [`DEFAULT_SPP`].
    pub spp: Option<u32>,
    /// Stop after the pass that reaches this time of rendering, above 0; without `spp` it is the only limit.
    pub time: Option<Duration>,
    /// Seed of all random numbers; if absent the scene's, else 0.
    pub seed: Option<u64>,
    /// The pixels to render; all if absent.
    pub window: Option<Window>,
    /// What traces rays; if absent [`Backend::preferred`].
    pub backend: Option<Backend>,
    /// Mend meshes before use: no triangles without area or there twice, faces turned outwards.
    pub repair: bool,
    /// The lecture to the letter: standard dipole, independent samples, cosine-sampled directions, plain loop with rejection
    /// control, no exit normalisation. The method must be `subsurface`.
    pub as_notes: bool,
}

impl Options {
    /// Passes of a render of `scene`; without end where time alone is asked for.
    ///
    /// # Errors
    /// Usage for none, or no time.
    pub fn passes(&self, scene: &SceneFile) -> Result<Option<u32>> {
        if self.time == Some(Duration::ZERO) {
            return Err(Error::usage("no time makes no picture; ask for more than 0 s"));
        }
        match self.spp.or(scene.render.spp.filter(|_| self.time.is_none())) {
            Some(0) => Err(Error::usage("0 samples per pixel make no picture; ask for at least 1 with --spp")),
            None if self.time.is_none() => Ok(Some(DEFAULT_SPP)),
            asked => Ok(asked),
        }
    }
}

/// A picture, and how it came about.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Rendered {
    /// Mean radiance per pixel, in linear Rec. 709 and the unit of the scene's lights.
    pub image: Image,
    /// Variance of that mean per pixel and channel, the square of its standard error; none of fewer than two passes.
    pub variance: Option<Image>,
    /// Samples of each pixel.
    pub spp: u32,
    /// Time of rendering.
    pub seconds: Seconds,
    /// What the work cost.
    pub tally: Tally,
    /// What the picture is to be read with, one sentence each: the scene's warnings, samples left out, light not found.
    pub remarks: Vec<String>,
}

/// Renders a scene on all threads of the rayon pool that it is called in. The same scene, options and build give the same bits
/// on any number of threads, unless `time` ends it.
///
/// # Errors
/// Usage: options that make no picture, a backend that is not in this build. File and Scene: what [`Scene::load`] refuses.
/// Scene: a model that does not exist for its medium, bodies that `volume_path` cannot trace. Memory: what will not fit.
pub fn render(scene: &SceneFile, options: &Options) -> Result<Rendered> {
    let passes = options.passes(scene)?;
    let resolution = scene.camera.resolution;
    // Refuses what will not fit before meshes are read, which may take long.
    let mut film = Film::new(resolution, options.window.unwrap_or(Window::full(resolution)))?;
    let prepared = Prepared::new(scene.clone(), options)?;
    let rays = prepared.scene.rays(prepared.backend)?;
    let view = View { scene: &prepared.scene, rays: &*rays };
    let job = Job { seed: prepared.seed, passes, time: options.time, cancel: &AtomicBool::new(false) };
    let outcome = run(&prepared.method, view, &job, &mut film, &mut [])?;
    let (walk, scene) = (&outcome.tally.walk, &prepared.scene);
    let lost = if walk.lost_many() { lost(walk, scene) } else { Vec::new() };
    let found = odd_counts(&film, &outcome.tally).into_iter().chain(no_light(scene, &outcome.tally)).chain(lost);
    Ok(Rendered {
        image: film.image(),
        variance: variance(&film),
        spp: film.passes(),
        seconds: outcome.seconds,
        tally: outcome.tally,
        remarks: scene.warnings.iter().cloned().chain(found).collect(),
    })
}

/// Samples that are missing from a picture or below zero.
pub fn odd_counts(film: &Film, tally: &Tally) -> Vec<String> {
    let counts = film.counts();
    let causes = [
        (counts.non_finite, "samples are not finite and were left out"),
        (tally.gather.non_finite, "cached samples are not finite and were left out"),
        (counts.negative, "samples are below zero"),
    ];
    causes.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect()
}

/// That light fell on nothing translucent. Where there is no light, a lamp is inside, or a mesh has no inside or looks inwards, the
/// scene's warnings say why.
pub fn no_light(scene: &Scene, tally: &Tally) -> Option<String> {
    let gather = &tally.gather;
    let inside_out = |o: &Object| o.findings.inside_out() || o.findings.zero_area == o.findings.triangles;
    let told = || scene.is_dark() || !scene.obstacles().is_empty() || scene.objects.iter().any(inside_out);
    (gather.samples > 0 && gather.lit == 0 && !told()).then(|| {
        format!(
            "none of {} on translucent surfaces met any light: do the lights face them? (a light shines along its outward \
             normal; `two_sided = true` lets it shine both ways)",
            counted(gather.samples, "sample", "samples")
        )
    })
}

/// Everything before rays.
pub struct Prepared {
    /// As typed.
    pub file: SceneFile,
    /// As checked.
    pub scene: Scene,
    /// With its tables.
    pub method: Method,
    /// What will trace rays.
    pub backend: Backend,
    /// Seed of all random numbers.
    pub seed: u64,
    /// See [`Options::as_notes`].
    pub as_notes: bool,
    /// Whether meshes were mended.
    pub repair: bool,
    estimator: Estimator,
}

impl Prepared {
    /// Reads the meshes of a scene, checks it, and builds the tables of its method. Of the options, those on passes and pixels
    /// do not matter here.
    ///
    /// # Errors
    /// As [`render`].
    pub fn new(mut file: SceneFile, options: &Options) -> Result<Self> {
        let &Options { as_notes, repair, .. } = options;
        if as_notes {
            file.method.model = Some(ModelName::STANDARD);
            file.method.shape = Some(Shape::HalfSpace);
        }
        let mut scene = Scene::load_with(&file, repair)?;
        if as_notes {
            let name = file.method.name.unwrap_or_else(|| scene.default_method());
            if name != MethodName::Subsurface {
                let name = name.name();
                return Err(Error::usage(format!("--as-notes is about the method `subsurface`, not `{name}`")));
            }
            for material in &mut scene.materials {
                if let Some(t) = &mut material.surface.inside {
                    t.exit_normalisation = false;
                }
            }
        }
        let seed = options.seed.or(file.render.seed).unwrap_or(0);
        let method = Method::new(&scene, &file.method, as_notes, seed)?;
        let warnings = match &method {
            Method::VolumePath(paths) => paths.warnings(&scene),
            Method::Subsurface(subsurface) => subsurface.warnings(&scene),
            Method::Path(path) => path.warnings(&scene),
            _ => Vec::new(),
        };
        scene.warnings.extend(warnings);
        let backend = options.backend.unwrap_or(Backend::preferred());
        let estimator = method::estimator(&file.method, as_notes);
        Ok(Self { file, scene, method, backend, seed, as_notes, repair, estimator })
    }

    /// Method, estimator and models in a few words.
    pub fn describe(&self) -> String {
        let Method::Subsurface(_) = self.method else { return self.method.name().into() };
        let how = if self.as_notes { "as_notes" } else { self.estimator.name() };
        let models = self.models(|_, t| t.model.name().into());
        format!("{} ({how}, {models})", self.method.name())
    }

    /// What the EXR header says of the method.
    pub fn method_attributes(&self) -> Vec<(&'static str, String)> {
        let Method::Subsurface(_) = self.method else { return Vec::new() };
        vec![
            ("model", self.models(|name, t| format!("{name}: {}", t.model_text()))),
            ("estimator", self.estimator.name().into()),
            ("exitance", self.exitance()),
            ("asNotes", self.as_notes.to_string()),
        ]
    }

    /// What decides how much light leaves each translucent object.
    fn exitance(&self) -> String {
        let Method::Subsurface(method) = &self.method else { return String::new() };
        let of = |(i, o): (u32, &Object)| {
            let inside = self.scene.surface(i).inside.as_ref()?;
            let how =
                if method.walks(i) { format!("walks, {}", inside.model_under_walks().name()) } else { "model".into() };
            Some(format!("{}: {how}", o.name))
        };
        (0..).zip(&self.scene.objects).filter_map(of).collect::<Vec<_>>().join(", ")
    }

    /// Of each translucent material what `text` makes of its name and medium.
    fn models(&self, text: impl Fn(&str, &Translucent) -> String) -> String {
        let of = |m: &Material| Some(text(&m.name, m.surface.inside.as_ref()?));
        self.scene.materials.iter().filter_map(of).collect::<Vec<_>>().join(", ")
    }
}
