//! Work that is not lost: checkpoints, going on, parts of a render, signals.

use super::duration::duration;
use super::files::free_name;
use super::outputs::{Outputs, is_checkpoint, progress};
use marmor::film::{Checkpoint, Film, Format, Identity, Window, check_writable};
use marmor::render::{Observer, Progress, Spent, Stop};
use marmor::scene::SceneFile;
use marmor::{Error, Result};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Options that let a render end early and go on, or be done in parts.
#[derive(clap::Args)]
pub struct KeepArgs {
    /// Write a film file each time this much time has gone by, between two passes
    #[arg(long, value_name = "TIME", value_parser = duration)]
    checkpoint_every: Option<Duration>,
    /// Go on from the film file of the same render; without one, start as usual
    #[arg(long)]
    resume: bool,
    /// Render the passes A up to but not including B alone; `marmor merge` joins the film files of such parts
    #[arg(long, value_name = "A..B", value_parser = range, conflicts_with = "spp")]
    pub samples_range: Option<Range<u32>>,
}

/// Where a render's film file is.
pub struct FilmFile {
    /// An output that ends in `.film`, else a name beside the first picture.
    pub path: PathBuf,
    /// Whether it is an output.
    asked: bool,
    /// A film file that is there already and that nobody said to go on from: it stays as it is.
    pub passed_by: Option<PathBuf>,
}

/// Writes film files while a render runs.
pub struct Keeper<'a> {
    outputs: &'a Outputs<'a>,
    every: Option<Duration>,
    last: Instant,
    hangup: Arc<AtomicBool>,
    /// Where the film file is.
    pub file: &'a FilmFile,
    /// Whether what is there, or will be, is a checkpoint that nobody asked for.
    ours: bool,
    /// Whether there is one.
    exists: bool,
    /// Reading the scene and building what it needs, in all runs [s].
    pub setup: f64,
    complained: bool,
}

impl KeepArgs {
    /// The film file of a render with these outputs.
    pub fn film_file(&self, outputs: &[PathBuf]) -> FilmFile {
        if let Some(asked) = outputs.iter().find(|p| Format::of(p).is_ok_and(|f| f == Format::Film)) {
            return FilmFile { path: asked.clone(), asked: true, passed_by: None };
        }
        let path = outputs.first().cloned().unwrap_or_default().with_extension("film");
        if self.resume || std::fs::symlink_metadata(&path).is_err() {
            return FilmFile { path, asked: false, passed_by: None };
        }
        FilmFile { path: free_name(&path, |_| false), asked: false, passed_by: Some(path) }
    }

    /// Whether the film file can be written, where one will be; what is there stays.
    pub fn check(&self, film: &FilmFile) -> Result<()> {
        if self.checkpoint_every.is_some() || self.resume {
            check_writable(&film.path)?;
        }
        if let (Some(other), Some(_)) = (&film.passed_by, self.checkpoint_every) {
            eprintln!(
                "warning: {} is there already and stays as it is, --resume would go on from it; checkpoints go to {}",
                other.display(),
                film.path.display()
            );
        }
        Ok(())
    }

    /// The film to start with, empty or from its file, what it took so far, and its keeper.
    pub fn start<'a>(
        &self,
        outputs: &'a Outputs<'a>,
        film_file: &'a FilmFile,
        scene: &SceneFile,
        window: Window,
        end: Option<u32>,
    ) -> Result<(Film, Spent, Keeper<'a>)> {
        let path = &film_file.path;
        let first = self.samples_range.as_ref().map_or(0, |r| r.start);
        let there = self.resume && path.try_exists().map_err(|e| Error::file(path, "read", e))?;
        let (film, spent, ours) = if there {
            let read = Checkpoint::read(path)?;
            belongs(&read.identity, &outputs.identity, scene, path)?;
            let [run] = read.film.ranges() else {
                let what = format!("its film has the passes {}, with a gap; it cannot go on", read.film.ranges_text());
                return Err(Error::usage(format!("{}: {what}", path.display())));
            };
            if run.start != first || end.is_some_and(|end| run.end > end) {
                let end = end.map_or("..".into(), |end| end.to_string());
                return Err(Error::usage(format!(
                    "{}: its film has the passes {}..{}, but {first}..{end} are asked for; ask for more, or remove it",
                    path.display(),
                    run.start,
                    run.end
                )));
            }
            let ours = !film_file.asked && is_checkpoint(&read);
            let spent = progress(&read).0;
            (read.film, spent, ours)
        } else {
            (Film::new(scene.camera.resolution, window)?.starting_at(first), Spent::default(), false)
        };
        let keeper = Keeper {
            outputs,
            every: self.checkpoint_every,
            last: Instant::now(),
            hangup: on_hangup(),
            file: film_file,
            ours: ours || !there && !film_file.asked,
            exists: there,
            setup: 0.0,
            complained: false,
        };
        Ok((film, spent, keeper))
    }
}

/// Refuses to go on from a film of something else, naming where the user said so.
fn belongs(there: &Identity, here: &Identity, scene: &SceneFile, path: &Path) -> Result<()> {
    let Some(fact) = there.differs(here) else { return Ok(()) };
    let in_scene = (fact == "scene").then(|| scene.difference(there.get(fact)?)).flatten();
    let what = in_scene.or_else(|| there.difference(here)).unwrap_or_default();
    let remedy = match fact {
        "build" => "go on with the program that made it, or render anew",
        _ => "ask for what it is of, or render under another name",
    };
    Err(Error::usage(format!("{}: its film is of another picture: {what}; {remedy}", path.display())))
}

impl Keeper<'_> {
    /// What is left to do at the end: an interrupted render leaves its film file, a finished one takes its checkpoint away.
    /// A film file that somebody asked for, now or when it was made, stays. The name of a film file that stays and that
    /// nobody asked for.
    pub fn finish(&self, stop: Stop, film: &Film, spent: &Spent) -> Result<Option<&FilmFile>> {
        if self.file.asked {
            return Ok(None);
        }
        if stop == Stop::Cancelled {
            self.save_film(film, spent)?;
            return Ok(Some(self.file));
        }
        if self.ours && self.exists {
            // The pictures are written; a file that cannot be removed is no loss.
            let _ = std::fs::remove_file(&self.file.path);
        }
        Ok(None)
    }

    /// Keeps the work of a render whose pictures could not be written; the error says where, if that works.
    pub fn rescue(&self, error: Error, film: &Film, spent: &Spent) -> Error {
        match self.save_film(film, spent) {
            Ok(()) => {
                let kept = format!("{error}; the work is kept in {}, for --resume", self.file.path.display());
                Error::new(error.kind(), kept)
            }
            Err(_) => error,
        }
    }

    fn save_film(&self, film: &Film, spent: &Spent) -> Result<()> {
        self.outputs.save_film(&self.file.path, film, spent, self.ours)
    }

    /// Tells of a file that could not be written; the render goes on, and the next time may be better.
    fn complain(&mut self, error: &Error) {
        if !self.complained {
            eprintln!("warning: {error}; the render goes on");
        }
        self.complained = true;
    }
}

impl Observer for Keeper<'_> {
    fn after_pass(&mut self, progress: &Progress<'_>) -> Result<()> {
        let spent = Spent { setup: self.setup, seconds: progress.seconds, tally: *progress.tally };
        let asked = self.hangup.swap(false, Ordering::Relaxed);
        if asked {
            match self.outputs.save(progress.film, &spent) {
                Ok(_) => eprintln!("pass {}: wrote what there is, as SIGHUP asks", progress.film.passes()),
                Err(error) => self.complain(&error),
            }
        }
        if asked || self.every.is_some_and(|every| self.last.elapsed() >= every) {
            match self.save_film(progress.film, &spent) {
                Ok(()) => (self.exists, self.complained) = (true, false),
                Err(error) => self.complain(&error),
            }
            self.last = Instant::now();
        }
        Ok(())
    }
}

/// SIGINT, SIGTERM and SIGUSR1 set the flag; a second SIGINT or SIGTERM ends the program at once.
pub fn cancel_on_signals() -> Arc<AtomicBool> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let flag = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal finds the flag unset and only sets it.
        let both = signal_hook::flag::register_conditional_shutdown(signal, 130, Arc::clone(&flag))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&flag)));
        complain_of(signal, both);
    }
    // What cluster schedulers send ahead of the end; often more than once.
    #[cfg(unix)]
    complain_of(
        signal_hook::consts::SIGUSR1,
        signal_hook::flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&flag)),
    );
    flag
}

fn on_hangup() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    complain_of(
        signal_hook::consts::SIGHUP,
        signal_hook::flag::register(signal_hook::consts::SIGHUP, Arc::clone(&flag)),
    );
    flag
}

fn complain_of(signal: i32, registered: std::io::Result<signal_hook::SigId>) {
    if let Err(error) = registered {
        eprintln!("warning: cannot listen for signal {signal}, it will lose the picture: {error}");
    }
}

/// `A..B` with A < B.
fn range(text: &str) -> std::result::Result<Range<u32>, String> {
    let parts = text.split_once("..").and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
    match parts {
        Some((a, b)) if a < b && b - a <= Film::MOST_PASSES => Ok(a..b),
        _ => Err(format!("expected A..B, whole numbers with A < B and at most {} passes", Film::MOST_PASSES)),
    }
}
