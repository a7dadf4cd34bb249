//! What becomes of a film: pictures, and film files to go on with.

use super::layers::Layers;
use super::setup::Prepared;
use marmor::Result;
use marmor::film::{
    Attribute, Checkpoint, Film, Format, Identity, Metadata, PngOptions, Window, save_with_layers, source_date_epoch,
};
use marmor::render::Spent;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Where a film goes, and what its files say of it.
pub struct Outputs<'a> {
    /// Files asked for.
    pub paths: Vec<PathBuf>,
    /// What decides every bit of the film.
    pub identity: Identity,
    /// What pictures say of their making, but for what the film itself knows.
    pub attributes: Vec<(String, String)>,
    /// Stops for a PNG.
    pub exposure: f64,
    /// What an EXR holds beside the picture.
    pub layers: Layers<'a>,
}

impl<'a> Outputs<'a> {
    /// Of a render of `prepared` on a backend that calls itself `backend`.
    pub fn new(
        prepared: &Prepared,
        backend: &str,
        window: Window,
        paths: Vec<PathBuf>,
        exposure: f64,
        layers: Layers<'a>,
    ) -> Self {
        let mut attributes: Vec<(String, String)> = [
            ("scene", prepared.file.effective()),
            ("method", prepared.method.name().into()),
            ("backend", backend.into()),
            ("seed", prepared.seed.to_string()),
            ("build", build()),
        ]
        .map(|(key, value)| (key.to_string(), value))
        .into();
        attributes.extend(prepared.method_attributes().into_iter().map(|(key, value)| (key.to_string(), value)));
        Self { paths, identity: identity(prepared, backend, window), attributes, exposure, layers }
    }

    /// Writes every file, also those after one that fails. What a PNG or a layer could not hold is in the lines returned.
    ///
    /// # Errors
    /// The first failure.
    pub fn save(&self, film: &Film, spent: &Spent) -> Result<Vec<String>> {
        let metadata = Metadata {
            samples_per_pixel: film.passes(),
            render_seconds: Some(spent.seconds.total()),
            created: source_date_epoch(),
            attributes: self.all_attributes(film, spent),
        };
        let image = film.image();
        // A layer that cannot be made does not take the picture with it.
        let ((layers, mut said), mut failed) = match self.layers.of(film) {
            Ok(layers) => (layers, None),
            Err(error) => (Default::default(), Some(error)),
        };
        for path in &self.paths {
            let saved = match Format::of(path)? {
                Format::Film => self.save_film(path, film, spent, false).map(|()| None),
                _ => save_with_layers(&image, &layers, path, &metadata, PngOptions { exposure: self.exposure })
                    .map(|report| report.png),
            };
            match saved {
                Ok(Some(png)) if png.above_one + png.below_zero + png.nan > 0 => said.push(format!(
                    "{}: of the channel values {} are above 1, {} below 0, {} no numbers",
                    path.display(),
                    png.above_one,
                    png.below_zero,
                    png.nan
                )),
                Ok(_) => {}
                Err(error) => {
                    failed.get_or_insert(error);
                }
            }
        }
        failed.map_or(Ok(said), Err)
    }

    /// Writes the film itself; a `checkpoint` is one that nobody asked for and that may be taken away.
    pub fn save_film(&self, path: &Path, film: &Film, spent: &Spent, checkpoint: bool) -> Result<()> {
        let progress = json!({ "spent": spent, "exposure": self.exposure, "checkpoint": checkpoint });
        Checkpoint::write(path, film, &self.identity, &self.attributes, progress)
    }

    fn all_attributes(&self, film: &Film, spent: &Spent) -> Vec<(String, Attribute)> {
        let text = |key: &str, value: String| (format!("marmor:{key}"), Attribute::Text(value));
        let counts = film.counts();
        let mut list: Vec<_> = self.attributes.iter().map(|(key, value)| text(key, value.clone())).collect();
        list.push(text("sampleRange", film.ranges_text()));
        list.push(text("nonFinite", counts.non_finite.to_string()));
        list.push(text("negative", counts.negative.to_string()));
        list.push(text("clamped", spent.tally.gather.clamped.to_string()));
        list.push(text("nonFiniteCached", spent.tally.gather.non_finite.to_string()));
        list
    }
}

/// Time and work of a film file, its PNG's exposure.
pub fn progress(of: &Checkpoint) -> (Spent, f64) {
    let spent = of.progress.get("spent").and_then(|v| serde_json::from_value(v.clone()).ok()).unwrap_or_default();
    let exposure = of.progress.get("exposure").and_then(serde_json::Value::as_f64).filter(|e| e.abs() <= 64.0);
    (spent, exposure.unwrap_or(0.0))
}

/// Whether a film file was written on the way, under a name that nobody gave.
pub fn is_checkpoint(film: &Checkpoint) -> bool {
    film.progress.get("checkpoint").and_then(serde_json::Value::as_bool) == Some(true)
}

/// Version and build of this program: other sources, dependencies or compilers may give other bits.
fn build() -> String {
    format!("{} ({})", env!("CARGO_PKG_VERSION"), env!("MARMOR_BUILD"))
}

/// Everything that decides a bit of the sums.
fn identity(prepared: &Prepared, backend: &str, window: Window) -> Identity {
    let scene = &prepared.scene;
    let [width, height] = scene.camera.resolution;
    let mut facts = vec![
        ("build", build()),
        ("method", prepared.method.name().into()),
        ("backend", backend.into()),
        ("seed", prepared.seed.to_string()),
        ("the lecture's form", prepared.as_notes.to_string()),
        ("meshes mended", prepared.repair.to_string()),
        ("scene", prepared.file.decisive()),
        // After the scene, which has a line to name.
        ("picture", format!("{width}x{height} pixels, of these {window}")),
    ]
    .into_iter()
    .map(|(name, value)| (name.to_string(), value))
    .collect::<Vec<_>>();
    facts.extend(scene.objects.iter().map(|o| {
        let (vertices, triangles) = (o.mesh.positions.len(), o.mesh.triangles.len());
        let hash = o.mesh.fingerprint();
        (format!("mesh of {}", o.name), format!("{vertices} vertices, {triangles} triangles, hash {hash:016x}"))
    }));
    if let (Some(image), Some(name)) = (&scene.environment.image, &prepared.file.environment.image) {
        let [width, height] = image.resolution;
        let what = format!("{}, {width}x{height} pixels, hash {:016x}", name.display(), image.fingerprint());
        facts.push(("picture of the environment".into(), what));
    }
    for material in &scene.materials {
        for (number, texture) in material.surface.pictures().enumerate() {
            let [width, height] = texture.resolution();
            let what = format!("{}, {width}x{height} pixels, hash {:016x}", texture.name(), texture.fingerprint());
            let which = if number > 0 { format!("picture {} of", number + 1) } else { "picture of".into() };
            facts.push((format!("{which} material {}", material.name), what));
        }
    }
    facts.push(("centre of the scene".into(), scene.centre.to_string()));
    Identity(facts)
}
