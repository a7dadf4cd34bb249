//! Several ways to render one scene, pass by pass in turns on equal time: shared by `converge` and `compare`.

use super::duration::duration;
use super::files::{Files, Remedy};
use super::observers::check_reference;
use super::setup::{MethodArgs, Prepared, prepare};
use super::{stdout, threads};
use marmor::film::{
    Checkpoint, Film, Format, Image, SelfError, Truth, Window, check_replaceable, judge, write_atomically,
};
use marmor::integrator::{Integrator as _, View, lost};
use marmor::query::RayQuery;
use marmor::render::{self, Job, Seconds, odd_counts};
use marmor::report::ErrorPoint;
use marmor::tally::Tally;
use marmor::words::counted;
use marmor::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Options that `converge` and `compare` have in common.
#[derive(clap::Args)]
pub struct RaceArgs {
    /// The scene file
    pub scene: PathBuf,
    /// Measure against this film file, which tells its own noise, or EXR, which does not, instead of a reference rendered for it
    #[arg(long, value_name = "FILM|EXR")]
    pub reference: Option<PathBuf>,
    /// Time of rendering for each of them, such as 20s
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "20s")]
    time_budget: Duration,
    /// Time of rendering for the reference [default: three times that of each]
    #[arg(long, value_name = "TIME", value_parser = duration)]
    reference_budget: Option<Duration>,
    /// Folder for the results; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub method: MethodArgs,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

impl RaceArgs {
    /// Makes the folder and runs `job` on the threads asked for.
    pub fn run<T: Send>(&self, job: impl FnOnce() -> Result<T> + Send) -> Result<T> {
        std::fs::create_dir_all(&self.output).map_err(|e| Error::file(&self.output, "make the folder", e))?;
        threads::with(self.threads, job)
    }

    /// Whether the files `names` can be written in the folder, and are neither each other nor what is read.
    pub fn check_files(&self, entrants: &[Entrant], names: &[String]) -> Result<()> {
        let mut files = Files::default();
        entrants.iter().for_each(|e| files.reads_scene(&e.prepared.file));
        self.reference.iter().for_each(|path| files.reads("the reference", path));
        for name in names {
            let path = self.output.join(name);
            check_replaceable(&path)?;
            files.writes("a file of the report", &path, Remedy::Say("name another folder by -o, and each method once"));
        }
        files.check()
    }

    /// Takes out those that an interruption left without a pass: a black picture is no result.
    pub fn leave_out_empty(&self, runners: &mut Vec<Runner<'_>>) {
        runners.retain(|runner| {
            let empty = runner.film.passes() == 0;
            if empty {
                self.say(&format!("`{}` has no pass yet and is left out", runner.entrant.name));
            }
            !empty
        });
    }

    /// The size of all pictures, of which there must be one; `reference` has to have it too.
    pub fn check_sizes(&self, entrants: &[Entrant], reference: Option<&Image>) -> Result<[u32; 2]> {
        let resolution = |e: &Entrant| e.prepared.scene.camera.resolution;
        let one = entrants.first().map_or([0, 0], resolution);
        if let Some(other) = entrants.iter().find(|e| resolution(e) != one) {
            let name = &other.name;
            return Err(Error::usage(format!("`{name}` has another resolution; pictures of one size are compared")));
        }
        if let Some((path, image)) = self.reference.as_ref().zip(reference) {
            check_reference(path, image, one, Window::full(one))?;
        }
        Ok(one)
    }

    /// A line on standard error, unless `--quiet`.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    /// Time of rendering for each [s].
    pub fn budget(&self) -> f64 {
        self.time_budget.as_secs_f64()
    }

    /// Time of rendering for the reference [s].
    pub fn reference_budget(&self) -> f64 {
        self.reference_budget.map_or(3.0 * self.budget(), |t| t.as_secs_f64())
    }

    /// One entrant for each of `specs`.
    pub fn entrants(&self, specs: &[String]) -> Result<Vec<Entrant>> {
        specs.iter().map(|spec| Entrant::new(spec, &self.scene, &self.method.variant(spec)?)).collect()
    }

    /// The entrant that renders the reference, named `name`, with the words of `spec` and a seed of its own.
    pub fn reference_entrant(&self, name: &str, spec: Option<&str>, salt: u64) -> Result<Entrant> {
        let method = spec.map_or_else(|| Ok(self.method.clone()), |spec| self.method.variant(spec))?;
        Entrant::new(name, &self.scene, &method.seeded(self.method.seed().unwrap_or(0) ^ salt))
    }

    /// A file of the report, under its name in the folder. A failure does not take the other files with it.
    pub fn write(&self, name: &str, text: &str, failed: &mut Failures) {
        failed.note(write_atomically(&self.output.join(name), |out| out.write_all(text.as_bytes())));
    }

    /// Says remarks, sentences and where the page is; `whole` is false after an interruption. Where files could not be written
    /// the table goes to standard output.
    ///
    /// # Errors
    /// The first failure, unless there was an interruption.
    pub fn conclude(
        &self,
        (remarks, sentences): (&[String], &[String]),
        table: &str,
        whole: bool,
        failed: Failures,
    ) -> Result<ExitCode> {
        remarks.iter().for_each(|remark| self.say(&format!("warning: {remark}")));
        sentences.iter().for_each(|sentence| self.say(sentence));
        match failed.0 {
            None => self.say(&format!("wrote {}", self.output.join("index.html").display())),
            Some(error) => {
                stdout::write(format_args!("{table}"));
                if whole {
                    return Err(error);
                }
                eprintln!("marmor: {error}");
            }
        }
        Ok(if whole { ExitCode::SUCCESS } else { ExitCode::from(super::INTERRUPTED) })
    }
}

/// The first of several files that could not be written.
#[derive(Default)]
pub struct Failures(Option<Error>);

impl Failures {
    /// Takes note of one outcome.
    pub fn note<T>(&mut self, outcome: Result<T>) {
        if let Err(error) = outcome {
            self.0.get_or_insert(error);
        }
    }
}

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
        let rays = scene.rays(entrant.prepared.backend)?;
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

    /// What answers rays in its scene.
    pub fn rays(&self) -> &dyn RayQuery {
        &*self.rays
    }

    /// One more pass; false if `cancel` was set.
    pub fn pass(&mut self, cancel: &AtomicBool) -> Result<bool> {
        let prepared = &self.entrant.prepared;
        let passes = self.film.passes() + 1;
        let job = Job { seed: prepared.seed, passes: Some(passes), time: None, cancel };
        let view = View { scene: &prepared.scene, rays: &*self.rays };
        let outcome = render::run(&prepared.method, view, &job, &mut self.film, &mut [])?;
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

    /// What there is to say of lost paths, if they are more than rounding explains; for the page and for the log.
    fn lost(&self) -> Vec<String> {
        let name = &self.entrant.name;
        let said = lost(&self.tally.walk, &self.entrant.prepared.scene);
        if self.tally.walk.lost_many() { said.iter().map(|s| format!("{name}: {s}.")).collect() } else { Vec::new() }
    }

    /// The names of the lights that its paths have met too seldom: its picture may lack them.
    pub fn not_met(&self) -> Vec<String> {
        let Prepared { method, scene, .. } = &self.entrant.prepared;
        method.lights(scene).not_met(&self.tally, self.film.counts().samples)
    }

    /// The errors as they are now.
    pub fn measure(&mut self, truth: &Truth) -> Result<ErrorPoint> {
        let judgement = judge(&self.film, &mut self.own, truth, None)?;
        let Some(judgement) = judgement else {
            return Err(Error::usage(format!("`{}`: no pixel is a finite number", self.entrant.name)));
        };
        Ok(ErrorPoint { samples: self.film.passes(), seconds: self.seconds.total(), judgement, told: self.own.last() })
    }

    /// How much was rendered of a reference, for people.
    pub fn made(&self) -> String {
        format!("another seed, {} samples of each pixel in {:.1} s", self.film.passes(), self.seconds.total())
    }

    /// What must be known of this render before its figures: samples left out, lights not met, paths lost, warnings of its scene. Whatever a
    /// run reports beside numbers goes here, and so to the top of the page and of the text.
    pub fn remarks(&self) -> Vec<String> {
        let name = &self.entrant.name;
        let counted = odd_counts(&self.film, &self.tally).into_iter().map(|what| format!("{name}: {what}"));
        let not_met = self.not_met();
        let not_met = (!not_met.is_empty()).then(|| {
            let names: Vec<String> = not_met.iter().map(|light| format!("\"{light}\"")).collect();
            format!(
                "{name}: not met yet: {}; too few paths found it, and figures with this picture are of one that may lack it: \
                 give more time",
                names.join(", ")
            )
        });
        let lost = self.lost();
        let warnings = self.entrant.prepared.scene.warnings.iter().map(ToString::to_string);
        counted.chain(not_met).chain(lost).chain(warnings).collect()
    }
}

/// What films are held against.
pub struct Reference {
    /// For people.
    pub text: String,
    pub truth: Truth,
    /// How it was rendered, for people; none where it was given.
    pub made: Option<String>,
    /// Of the render that made it.
    pub remarks: Vec<String>,
}

/// Remarks on all renders and their reference, each once: what a report puts first.
pub fn remarks(runners: &[Runner<'_>], reference: &Reference) -> Vec<String> {
    let not_finite = reference.truth.image.pixels.iter().filter(|p| !p.is_finite()).count();
    let not_finite = (not_finite > 0).then(|| {
        let pixels = counted(not_finite, "pixel", "pixels");
        format!("{pixels} of the reference without a finite value, counted nowhere")
    });
    let mut out: Vec<String> = Vec::new();
    let own = runners.iter().flat_map(Runner::remarks);
    for remark in not_finite.into_iter().chain(reference.remarks.iter().cloned()).chain(own) {
        if !out.contains(&remark) {
            out.push(remark);
        }
    }
    out
}

/// A reference that was rendered before: an EXR does not tell its noise, a film does.
pub fn stored(path: &Path) -> Result<Reference> {
    let text = path.file_name().map_or("stored picture".into(), |name| name.to_string_lossy().into_owned());
    if Format::of(path).is_ok_and(|format| format == Format::Film) {
        let film = Checkpoint::read(path)?.film;
        let text = format!("{text}, {}", counted(film.passes(), "sample", "samples"));
        let truth = Truth::of_film(&film, &mut SelfError::new());
        return Ok(Reference { text, truth, made: None, remarks: Vec::new() });
    }
    Ok(Reference { text, truth: Truth::picture(super::read_picture(path, None)?), made: None, remarks: Vec::new() })
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
        "{}, {}, {} {}",
        model.map_or("unknown processor", str::trim),
        counted(rayon::current_num_threads(), "thread", "threads"),
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
