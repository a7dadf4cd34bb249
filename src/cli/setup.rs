//! From a scene file and the options over it to a checked scene and a method: shared by `render` and `check`.

use marmor::bssrdf::ModelName;
use marmor::film::Film;
use marmor::integrator::{
    AmbientOcclusion, Direct, Part, Subsurface, SubsurfaceOptions, View, VolumePath, VolumePathOptions,
};
use marmor::query::Backend;
use marmor::render::{self, Job, Observer, Outcome};
use marmor::sampling::Points;
use marmor::scene::{
    EntrySampling, Estimator, MethodName, MethodOptions, Orders, Scene, SceneFile, Spread, Surface, default_photons,
};
use marmor::{Error, Result};
use std::path::Path;

/// Options that decide what is computed.
#[derive(Clone, clap::Args)]
pub struct MethodArgs {
    /// ambient_occlusion, direct, subsurface or volume_path [default: the scene's, else subsurface if anything is translucent]
    #[arg(long, value_name = "NAME")]
    method: Option<MethodName>,
    /// BSSRDF model of all translucent materials [default: each material's own]
    #[arg(long, value_name = "NAME")]
    model: Option<ModelName>,
    /// How the sum over the sample cache is estimated
    #[arg(long, value_name = "NAME")]
    estimator: Option<Estimator>,
    /// Ray backend: embree or bvh [default: embree if built in]
    #[arg(long, value_name = "NAME")]
    backend: Option<Backend>,
    /// The lecture to the letter: standard dipole, independent samples, cosine-sampled directions, plain loop with
    /// rejection control, no exit normalisation
    #[arg(long, conflicts_with_all = ["model", "estimator"])]
    as_notes: bool,
    /// Seed of all random numbers [default: the scene's, else 0]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Mend meshes before use: no triangles without area or there twice, faces turned outwards
    #[arg(long)]
    repair: bool,
    /// Override a value of the scene file, such as camera.fov=30 or material.wax.eta=1.4; may be given more than once
    #[arg(short = 'D', value_name = "KEY=VALUE")]
    define: Vec<String>,
}

/// A method with its tables.
pub enum Method {
    AmbientOcclusion(AmbientOcclusion),
    Direct(Box<Direct>),
    Subsurface(Box<Subsurface>),
    VolumePath(Box<VolumePath>),
}

impl Method {
    /// The name on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::AmbientOcclusion(_) => MethodName::AmbientOcclusion.name(),
            Self::Direct(_) => MethodName::Direct.name(),
            Self::Subsurface(_) => MethodName::Subsurface.name(),
            Self::VolumePath(_) => MethodName::VolumePath.name(),
        }
    }

    /// [`render::run`] with this method.
    pub fn run(
        &self,
        view: View<'_>,
        job: &Job<'_>,
        film: &mut Film,
        observers: &mut [&mut dyn Observer],
    ) -> Result<Outcome> {
        match self {
            Self::AmbientOcclusion(m) => render::run(m, view, job, film, observers),
            Self::Direct(m) => render::run(&**m, view, job, film, observers),
            Self::Subsurface(m) => render::run(&**m, view, job, film, observers),
            Self::VolumePath(m) => render::run(&**m, view, job, film, observers),
        }
    }

    /// Memory of what a pass shares [bytes].
    pub fn pass_bytes(&self, view: View<'_>) -> u64 {
        use marmor::integrator::Integrator as _;
        match self {
            Self::AmbientOcclusion(m) => m.pass_bytes(view),
            Self::Direct(m) => m.pass_bytes(view),
            Self::Subsurface(m) => m.pass_bytes(view),
            Self::VolumePath(m) => m.pass_bytes(view),
        }
    }

    /// Tables over the triangles of translucent objects [bytes/triangle].
    pub fn bytes_per_triangle(&self) -> u64 {
        match self {
            Self::AmbientOcclusion(_) | Self::Direct(_) => 0,
            Self::Subsurface(_) => 40,
            Self::VolumePath(_) => 90,
        }
    }

    /// What was built and what was left out.
    pub fn parts(&self, scene: &Scene) -> Vec<Part> {
        use marmor::integrator::Integrator as _;
        let mut parts = match self {
            Self::AmbientOcclusion(m) => m.parts(scene),
            Self::Direct(m) => m.parts(scene),
            Self::Subsurface(m) => m.parts(scene),
            Self::VolumePath(m) => m.parts(scene),
        };
        parts.push(Part::double_precision(scene));
        parts
    }
}

/// Everything before rays.
pub struct Prepared {
    pub file: SceneFile,
    pub scene: Scene,
    pub method: Method,
    pub backend: Backend,
    pub seed: u64,
    pub as_notes: bool,
    /// Whether meshes were mended.
    pub repair: bool,
    estimator: Estimator,
}

impl Prepared {
    /// Method, estimator and models in a few words.
    pub fn describe(&self) -> String {
        match self.method {
            Method::Subsurface(_) => {
                let models: Vec<&str> = self
                    .scene
                    .materials
                    .iter()
                    .filter_map(|m| match &m.surface {
                        Surface::Translucent(t) => Some(t.model.name()),
                        _ => None,
                    })
                    .collect();
                let how = if self.as_notes { "as_notes" } else { self.estimator.name() };
                format!("{} ({how}, {})", self.method.name(), models.join(", "))
            }
            _ => self.method.name().into(),
        }
    }

    /// What the EXR header says of the method.
    pub fn method_attributes(&self) -> Vec<(&'static str, String)> {
        let Method::Subsurface(_) = self.method else { return Vec::new() };
        let models: Vec<String> = self
            .scene
            .materials
            .iter()
            .filter_map(|m| match &m.surface {
                Surface::Translucent(t) => Some(format!("{}: {}", m.name, t.model_text())),
                _ => None,
            })
            .collect();
        vec![
            ("model", models.join(", ")),
            ("estimator", self.estimator.name().into()),
            ("asNotes", self.as_notes.to_string()),
        ]
    }
}

/// Reads the meshes of a scene and checks it, and builds the tables of its method.
pub fn prepare(file: SceneFile, args: &MethodArgs) -> Result<Prepared> {
    let mut scene = Scene::load_with(&file, args.repair)?;
    if args.as_notes {
        for material in &mut scene.materials {
            if let Surface::Translucent(t) = &mut material.surface {
                t.exit_normalisation = false;
            }
        }
    }
    let seed = file.render.seed.unwrap_or(0);
    let default = if args.as_notes { Estimator::Notes } else { Estimator::Cut };
    let estimator = if args.as_notes { default } else { file.method.estimator.unwrap_or(default) };
    let method = build(&scene, &file.method, args.as_notes, estimator, seed)?;
    if let Method::VolumePath(m) = &method {
        let warnings = m.warnings(&scene);
        scene.warnings.extend(warnings);
    }
    let backend = args.backend.unwrap_or(Backend::preferred());
    Ok(Prepared { method, backend, seed, as_notes: args.as_notes, repair: args.repair, estimator, scene, file })
}

impl MethodArgs {
    /// The scene file with the options in it.
    pub fn read(&self, path: &Path) -> Result<SceneFile> {
        SceneFile::read(path)?.with(&self.overrides())
    }

    /// The options as they are typed, for a line that runs the same again.
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut put = |option: &str, value: Option<String>| {
            if let Some(value) = value {
                words.extend([option.to_string(), value]);
            }
        };
        put("--method", self.method.map(|m| m.name().into()));
        put("--model", self.model.map(|m| m.name().into()));
        put("--estimator", self.estimator.map(|e| e.name().into()));
        put("--backend", self.backend.map(|b| b.name().into()));
        for define in &self.define {
            put("-D", Some(format!("'{define}'")));
        }
        if self.repair {
            words.push("--repair".into());
        }
        if self.as_notes {
            words.push("--as-notes".into());
        }
        words
    }

    /// These options with those of `spec` over them: names joined by `+`, each of an estimator, a model, a backend or a
    /// method, or `as_notes`, a number of cached samples a pass, or `KEY=VALUE` of the scene (`cut_error=0.1` is
    /// `method.cut_error=0.1`).
    pub fn variant(&self, spec: &str) -> Result<Self> {
        let mut args = self.clone();
        for word in spec.split('+').map(str::trim) {
            if let Ok(estimator) = word.parse() {
                args.estimator = Some(estimator);
            } else if let Ok(model) = word.parse() {
                args.model = Some(model);
            } else if let Ok(backend) = word.parse() {
                args.backend = Some(backend);
            } else if let Ok(method) = word.parse() {
                args.method = Some(method);
            } else if word == "as_notes" {
                args.as_notes = true;
            } else if let Ok(samples) = word.parse::<u32>() {
                args.define.push(format!("method.cache_samples={samples}"));
            } else if let Some((key, _)) = word.split_once('=') {
                args.define.push(if key.contains('.') { word.into() } else { format!("method.{word}") });
            } else {
                return Err(Error::usage(unknown_word(spec, word)));
            }
        }
        if args.as_notes && (args.model.is_some() || args.estimator.is_some()) {
            return Err(Error::usage(format!("`{spec}`: as_notes has its own model and estimator")));
        }
        Ok(args)
    }

    /// The same with another seed.
    pub fn seeded(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }

    /// The seed asked for here, if any.
    pub fn seed(&self) -> Option<u64> {
        self.seed
    }

    /// The options as keys of the scene file, so that messages, warnings and file headers know them; `-D` comes last.
    fn overrides(&self) -> Vec<String> {
        let mut keys = Vec::new();
        let mut put = |key: &str, value: Option<String>| keys.extend(value.map(|v| format!("{key}={v}")));
        put("method.name", self.method.map(|m| m.name().into()));
        let model = if self.as_notes { Some(ModelName::Standard) } else { self.model };
        put("method.model", model.map(|m| m.name().into()));
        put("method.estimator", self.estimator.map(|e| e.name().into()));
        put("render.seed", self.seed.map(|s| s.to_string()));
        keys.extend(self.define.iter().cloned());
        keys
    }
}

fn unknown_word(spec: &str, word: &str) -> String {
    let names = |all: Vec<&'static str>| all;
    let mut known = names(Estimator::ALL.iter().map(|v| v.name()).collect());
    known.extend(ModelName::ALL.iter().map(|v| v.name()));
    known.extend(Backend::ALL.iter().map(|v| v.name()));
    known.extend(MethodName::ALL.iter().map(|v| v.name()));
    known.push("as_notes");
    let hint = marmor::error::did_you_mean(word, known.iter().copied());
    let all = known.join(", ");
    format!("`{spec}`: nothing is called `{word}`{hint}; there are {all}, a number of samples, or key=value")
}

fn build(scene: &Scene, options: &MethodOptions, as_notes: bool, estimator: Estimator, seed: u64) -> Result<Method> {
    let name = options.name.unwrap_or_else(|| scene.default_method());
    if as_notes && name != MethodName::Subsurface {
        return Err(Error::usage(format!("--as-notes is about the method `subsurface`, not `{}`", name.name())));
    }
    let light_samples = options.light_samples.unwrap_or(1);
    Ok(match name {
        MethodName::AmbientOcclusion => Method::AmbientOcclusion(AmbientOcclusion {
            radius: options.radius.map_or(f32::INFINITY, |r| r as f32),
            rays: options.rays.unwrap_or(4),
        }),
        MethodName::Direct => Method::Direct(Direct::new(scene, light_samples)?.into()),
        MethodName::Subsurface => {
            let (entry, points) = if as_notes {
                (EntrySampling::Cosine, Points::Independent)
            } else {
                (options.entry.unwrap_or(EntrySampling::Light), Points::Sobol)
            };
            let options = SubsurfaceOptions {
                cache_samples: options.cache_samples.unwrap_or(estimator.default_samples()),
                estimator,
                cut_error: options.cut_error.map(|e| e as f32),
                entry,
                points,
                spread: if as_notes { Spread::Area } else { options.spread.unwrap_or(Spread::Seen) },
                specular: options.specular.unwrap_or(true),
                single: options.single.unwrap_or(true),
                light_samples,
                seed,
            };
            Method::Subsurface(Box::new(Subsurface::new(scene, options)?))
        }
        MethodName::VolumePath => {
            let options = VolumePathOptions {
                orders: options.orders.unwrap_or(Orders::All),
                photons: options.photons.unwrap_or_else(|| default_photons(scene.camera.resolution)),
                specular: options.specular.unwrap_or(true),
                seed,
            };
            Method::VolumePath(Box::new(VolumePath::new(scene, options)?))
        }
    })
}
