//! Words on a command line that say what is computed, as options and keys of the scene: shared by all commands that render.

use marmor::bssrdf::ModelName;
use marmor::query::Backend;
use marmor::render::Options;
pub use marmor::render::{Method, Prepared};
use marmor::scene::{Estimator, MethodName, SceneFile, Shape};
use marmor::{Error, Result};
use std::path::Path;

/// Options that decide what is computed.
#[derive(Clone, clap::Args)]
pub struct MethodArgs {
    /// ambient_occlusion, direct, path, subsurface or volume_path [default: the scene's, else subsurface if anything is translucent]
    #[arg(long, value_name = "NAME")]
    method: Option<MethodName>,
    /// BSSRDF model of all translucent materials [default: each material's own]
    #[arg(long, value_name = "NAME")]
    model: Option<ModelName>,
    /// How the sum over the sample cache is estimated
    #[arg(long, value_name = "NAME")]
    estimator: Option<Estimator>,
    /// What decides how much light leaves bodies where: half-space (the model alone) or walked (paths through the body itself)
    /// [default: the scene's, else half-space]
    #[arg(long, value_name = "NAME")]
    shape: Option<Shape>,
    /// Ray backend: embree or bvh [default: embree if built in]
    #[arg(long, value_name = "NAME")]
    backend: Option<Backend>,
    /// The lecture to the letter: standard dipole, independent samples, cosine-sampled directions, plain loop with
    /// rejection control, no exit normalisation
    #[arg(long, conflicts_with_all = ["model", "estimator", "shape"])]
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

/// [`Prepared::new`] with the options that decide what is computed.
pub fn prepare(file: SceneFile, args: &MethodArgs) -> Result<Prepared> {
    Prepared::new(file, &args.options())
}

impl MethodArgs {
    /// The scene file with the options in it.
    pub fn read(&self, path: &Path) -> Result<SceneFile> {
        SceneFile::read(path)?.with(&self.overrides())
    }

    /// What is no key of the scene file.
    pub fn options(&self) -> Options {
        Options { backend: self.backend, repair: self.repair, as_notes: self.as_notes, ..Options::default() }
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
        put("--shape", self.shape.map(|s| s.name().into()));
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

    /// These options with those of `spec` over them: names joined by `+`, each of an estimator, a model, a shape, a backend or a
    /// method, or `as_notes`, a number of cached samples a pass, or `KEY=VALUE` of the scene (`cut_error=0.1` is
    /// `method.cut_error=0.1`).
    pub fn variant(&self, spec: &str) -> Result<Self> {
        let mut args = self.clone();
        for word in spec.split('+').map(str::trim) {
            if let Ok(estimator) = word.parse() {
                args.estimator = Some(estimator);
            } else if let Ok(model) = word.parse() {
                args.model = Some(model);
            } else if let Ok(shape) = word.parse() {
                args.shape = Some(shape);
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
        if args.as_notes && (args.model.is_some() || args.estimator.is_some() || args.shape.is_some()) {
            return Err(Error::usage(format!("`{spec}`: as_notes has its own model, estimator and shape")));
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
        let model = if self.as_notes { Some(ModelName::STANDARD) } else { self.model };
        put("method.model", model.map(|m| m.name().into()));
        put("method.estimator", self.estimator.map(|e| e.name().into()));
        let shape = if self.as_notes { Some(Shape::HalfSpace) } else { self.shape };
        put("method.shape", shape.map(|s| s.name().into()));
        put("render.seed", self.seed.map(|s| s.to_string()));
        keys.extend(self.define.iter().cloned());
        keys
    }
}

fn unknown_word(spec: &str, word: &str) -> String {
    let names = |all: Vec<&'static str>| all;
    let mut known = names(Estimator::ALL.iter().map(|v| v.name()).collect());
    known.extend(ModelName::ALL.iter().map(|v| v.name()));
    known.extend(Shape::ALL.iter().map(|v| v.name()));
    known.extend(Backend::ALL.iter().map(|v| v.name()));
    known.extend(MethodName::ALL.iter().map(|v| v.name()));
    known.push("as_notes");
    let hint = marmor::error::did_you_mean(word, known.iter().copied());
    let all = known.join(", ");
    format!("`{spec}`: nothing is called `{word}`{hint}; there are {all}, a number of samples, or key=value")
}
