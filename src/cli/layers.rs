//! `--layers`: what an EXR holds beside the picture, and where each layer comes from.

use super::setup::{Method, Prepared};
use marmor::film::{Film, Image, Layer, variance};
use marmor::integrator::{FirstOrder, View};
use marmor::render::{self, Aov, Job, first_hit};
use marmor::{Error, Result};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

/// What an EXR may hold beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum LayerName {
    /// Variance of each pixel's mean
    Variance,
    /// Reflectance of what the camera sees first
    Albedo,
    /// Shading normal there, towards the camera
    #[value(name = "N")]
    Normal,
    /// Its position in the scene's coordinates
    #[value(name = "P")]
    Position,
    /// Its distance along the direction of view
    #[value(name = "Z")]
    Depth,
    /// The part of the picture that is light scattered once, beside models that leave it out
    Single,
    /// Expected error of the material's model there
    Validity,
}

impl LayerName {
    fn name(self) -> &'static str {
        match self {
            Self::Variance => "variance",
            Self::Albedo => "albedo",
            Self::Normal => "N",
            Self::Position => "P",
            Self::Depth => "Z",
            Self::Single => "single",
            Self::Validity => "validity",
        }
    }

    /// The name of the layer in a file, and of its channels.
    fn channels(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Variance => ("Variance", &["R", "G", "B"]),
            Self::Albedo | Self::Single => (self.name(), &["R", "G", "B"]),
            Self::Normal | Self::Position => (self.name(), &["X", "Y", "Z"]),
            Self::Depth => ("", &["Z"]),
            Self::Validity => (self.name(), &["Y", "thickness", "curvature"]),
        }
    }

    fn aov(self) -> Option<Aov> {
        match self {
            Self::Albedo => Some(Aov::Albedo),
            Self::Normal => Some(Aov::Normal),
            Self::Position => Some(Aov::Position),
            Self::Depth => Some(Aov::Depth),
            Self::Validity => Some(Aov::Validity),
            Self::Variance | Self::Single => None,
        }
    }
}

/// Makes layers. Those of the film's sums need the film alone, others the scene too.
pub struct Layers<'a> {
    names: Vec<LayerName>,
    scene: Option<(&'a Prepared, View<'a>)>,
    /// What does not change from pass to pass.
    made: Mutex<Vec<(LayerName, Image)>>,
}

impl<'a> Layers<'a> {
    /// The layers `names`, each once, of a film whose scene is at hand; without it layers that need it are refused.
    ///
    /// # Errors
    /// Usage for a layer that cannot be made, before any time is spent.
    pub fn new(names: &[LayerName], scene: Option<(&'a Prepared, View<'a>)>) -> Result<Self> {
        let mut once: Vec<LayerName> = Vec::new();
        for name in names {
            if !once.contains(name) {
                once.push(*name);
            }
        }
        for name in &once {
            let name_text = name.name();
            match (name, &scene) {
                (LayerName::Variance, _) => {}
                (_, None) => {
                    return Err(Error::usage(format!(
                        "--layers {name_text}: film files hold sums of the picture alone; ask for it where the scene is: \
                         `marmor render SCENE --spp 1 --layers {name_text}` gives the same layer{}",
                        if *name == LayerName::Single { ", but for its noise" } else { "" }
                    )));
                }
                (LayerName::Single, Some((prepared, _)))
                    if !matches!(prepared.method, Method::Subsurface(_))
                        || prepared.file.method.single == Some(false) =>
                {
                    return Err(Error::usage(
                        "--layers single is a part of the method `subsurface`, unless `single = false`; with \
                             `volume_path`, ask for -D method.orders='\"1\"'",
                    ));
                }
                _ => {}
            }
        }
        Ok(Self { names: once, scene, made: Mutex::new(Vec::new()) })
    }

    /// All layers of `film`, and a line for each that its passes are too few for.
    ///
    /// # Errors
    /// Those of making them, such as memory.
    pub fn of(&self, film: &Film) -> Result<(Vec<Layer>, Vec<String>)> {
        let (mut layers, mut said) = (Vec::new(), Vec::new());
        for &name in &self.names {
            match self.image(name, film)? {
                Some(image) => {
                    let (layer, channels) = name.channels();
                    layers.push(Layer { name: layer.into(), channels, image });
                }
                None => said.push(format!(
                    "warning: --layers {} is left out: it needs an even and an odd pass, there are {}",
                    name.name(),
                    film.ranges_text()
                )),
            }
        }
        Ok((layers, said))
    }

    /// Refuses layers that a film of the passes `range` can never have.
    ///
    /// # Errors
    /// Usage.
    pub fn check(&self, range: std::ops::Range<u32>) -> Result<()> {
        if self.names.contains(&LayerName::Variance) && range.len() < 2 {
            return Err(Error::usage("--layers variance needs at least 2 samples per pixel"));
        }
        Ok(())
    }

    fn image(&self, name: LayerName, film: &Film) -> Result<Option<Image>> {
        match (name, name.aov(), &self.scene) {
            (_, Some(what), Some((_, view))) => Ok(Some(self.once(name, || first_hit(*view, film.window(), what)))),
            (LayerName::Single, _, Some((prepared, view))) => single(prepared, *view, film).map(Some),
            _ => Ok(variance(film)),
        }
    }

    /// The picture made before, or by `make`.
    fn once(&self, name: LayerName, make: impl FnOnce() -> Image) -> Image {
        let mut made = self.made.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, image)) = made.iter().find(|(n, _)| *n == name) {
            return image.clone();
        }
        let image = make();
        made.push((name, image.clone()));
        image
    }
}

/// Light scattered once, of the very passes that are in `film`: rendered again by the same numbers.
fn single(prepared: &Prepared, view: View<'_>, film: &Film) -> Result<Image> {
    let method = FirstOrder::new(view.scene, prepared.seed)?;
    let mut whole: Option<Film> = None;
    for range in film.ranges().iter().filter(|r| !r.is_empty()) {
        let mut part = Film::new(film.resolution(), film.window())?.starting_at(range.start);
        let go_on = AtomicBool::new(false);
        let job = Job { seed: prepared.seed, passes: Some(range.end), time: None, cancel: &go_on };
        render::run(&method, view, &job, &mut part, &mut [])?;
        match &mut whole {
            Some(whole) => whole.join(&part)?,
            None => whole = Some(part),
        }
    }
    whole.map(|film| film.image()).ok_or_else(|| Error::usage("--layers single: the film has no passes"))
}
