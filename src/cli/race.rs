//! Several ways to render one scene, pass by pass in turns on equal time: shared by `converge` and `compare`.

use super::setup::{MethodArgs, Prepared, prepare};
use marmor::film::metrics;
use marmor::film::{Film, Image, SelfError, Window};
use marmor::integrator::{Tally, View};
use marmor::query::{self, RayQuery};
use marmor::render::{Job, Seconds};
use marmor::report::ErrorPoint;
use marmor::{Error, Result};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A way to render, with its scene and tables.
pub struct Entrant {
    /// As typed.
    pub name: String,
    pub prepared: Prepared,
    /// Reading the scene and building tables, without the rays' tree [s].
    seconds_prepare: f64,
}

impl Entrant {
    /// Reads the scene and builds the tables for `spec`.
    pub fn new(name: &str, scene: &Path, args: &MethodArgs) -> Result<Self> {
        let begin = Instant::now();
        let prepared = args
            .read(scene)
            .and_then(|file| prepare(file, args))
            .map_err(|e| e.within(format_args!("method `{name}`")))?;
        Ok(Self { name: name.into(), prepared, seconds_prepare: begin.elapsed().as_secs_f64() })
    }
}

/// An entrant on its way.
pub struct Runner<'a> {
    pub entrant: &'a Entrant,
    rays: Box<dyn RayQuery + 'a>,
    pub film: Film,
    /// Scene, tables and tree [s].
    pub seconds_setup: f64,
    /// Of all passes.
    pub seconds: Seconds,
    pub tally: Tally,
    pub own: SelfError,
    next: u32,
}

impl<'a> Runner<'a> {
    /// Builds the tree.
    pub fn new(entrant: &'a Entrant) -> Result<Self> {
        let begin = Instant::now();
        let scene = &entrant.prepared.scene;
        let rays = query::build(entrant.prepared.backend, &scene.meshes())?;
        let resolution = scene.camera.resolution;
        Ok(Self {
            film: Film::new(resolution, Window::full(resolution))?,
            rays,
            seconds_setup: entrant.seconds_prepare + begin.elapsed().as_secs_f64(),
            seconds: Seconds::default(),
            tally: Tally::default(),
            own: SelfError::new(),
            next: 2,
            entrant,
        })
    }

    /// One more pass; false if `cancel` was set.
    pub fn pass(&mut self, cancel: &AtomicBool) -> Result<bool> {
        let prepared = &self.entrant.prepared;
        let passes = self.film.passes() + 1;
        let job = Job { seed: prepared.seed, passes: Some(passes), time: None, cancel };
        let view = View { scene: &prepared.scene, rays: &*self.rays };
        let outcome = prepared.method.run(view, &job, &mut self.film, &mut [])?;
        self.seconds.cache += outcome.seconds.cache;
        self.seconds.gather += outcome.seconds.gather;
        self.tally += outcome.tally;
        Ok(self.film.passes() == passes && !cancel.load(Ordering::Relaxed))
    }

    /// Lets the error follow the film, in steps that cost little.
    pub fn follow(&mut self) -> Result<()> {
        if self.film.passes() >= self.next {
            self.next = self.film.passes() + 1 + self.film.passes() / 8;
            self.own.measure(&self.film);
        }
        Ok(())
    }

    /// The errors as they are now; none before the halves tell.
    pub fn measure(&mut self, reference: &Image) -> Result<Option<ErrorPoint>> {
        let Some(own) = self.own.measure(&self.film).and_then(|e| e.relmse) else { return Ok(None) };
        let errors = metrics::compare(&self.film.image(), reference, None)?.whole;
        let Some(relmse) = errors.relmse else {
            return Err(Error::usage("the reference is black: no relative error"));
        };
        Ok(Some(ErrorPoint {
            samples: self.film.passes(),
            seconds: self.seconds.total(),
            measured: relmse.value,
            own: own.value,
            width: own.interval.map(|[low, high]| (high / low).ln() / 2.0),
        }))
    }
}

/// Passes in turns until each entrant has used `budget` seconds of its own; `after` is called after each pass. The one
/// that has used the least goes next, so that whatever else the machine does meets all alike.
pub fn race(
    runners: &mut [Runner<'_>],
    budget: f64,
    cancel: &AtomicBool,
    mut after: impl FnMut(usize, &mut Runner<'_>) -> Result<()>,
) -> Result<bool> {
    loop {
        let next = (0..runners.len()).min_by(|&a, &b| {
            let seconds = |i: usize| runners[i].seconds.total();
            seconds(a).total_cmp(&seconds(b))
        });
        let Some(next) = next.filter(|&i| runners[i].seconds.total() < budget) else { return Ok(true) };
        if !runners[next].pass(cancel)? {
            return Ok(false);
        }
        after(next, &mut runners[next])?;
    }
}

/// The processor, its threads and the system, for people.
pub fn machine() -> String {
    let cpus = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpus.lines().find_map(|l| l.strip_prefix("model name")).and_then(|l| l.split(':').nth(1));
    format!(
        "{}, {} threads, {} {}",
        model.map_or("unknown processor", str::trim),
        rayon::current_num_threads(),
        std::env::consts::OS,
        std::env::consts::ARCH
    )
}

/// The command as typed, with the program's name and version; folders of the program itself are left out.
pub fn command() -> String {
    let quoted = |word: String| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,+:[]".contains(c);
        if word.chars().all(plain) { word } else { format!("'{word}'") }
    };
    let words: Vec<String> = std::env::args().skip(1).map(quoted).collect();
    format!("marmor {} (version {})", words.join(" "), env!("CARGO_PKG_VERSION"))
}
