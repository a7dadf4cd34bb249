//! Passes over tiles on all cores: the loop itself, with observers called between passes and the clock stopped.

use crate::error::Result;
use crate::film::{Film, Window};
use crate::integrator::{CameraRay, Integrator, View};
use crate::math::Rgb;
use crate::sampling::{Pairs, PixelStream, Turn};
use crate::tally::Tally;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Edge of a tile [pixels].
const TILE: u32 = 32;

/// What is asked of a render.
pub struct Job<'a> {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Stop before the pass of this number, counted from 0; a pass is one sample of each pixel.
    pub passes: Option<u32>,
    /// Stop after the pass that reaches this time of rendering, not counting what an earlier run took.
    pub time: Option<Duration>,
    /// Set from outside to stop: the running pass is dropped, unless it is the first.
    pub cancel: &'a AtomicBool,
}

/// Where the time went \[s\]; writing and measuring are not in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct Seconds {
    /// Filling caches.
    pub cache: f64,
    /// Tracing, shading and gathering the tiles.
    pub gather: f64,
}

impl Seconds {
    /// All of rendering.
    pub fn total(&self) -> f64 {
        self.cache + self.gather
    }
}

/// What observers see after a pass.
pub struct Progress<'a> {
    /// The film so far.
    pub film: &'a Film,
    /// Time of all passes so far.
    pub seconds: Seconds,
    /// What of it earlier runs took \[s\].
    pub earlier: f64,
    /// Work of all passes so far.
    pub tally: &'a Tally,
    /// The job, for what is still to come.
    pub job: &'a Job<'a>,
}

/// Called after each pass with the clock stopped.
pub trait Observer {
    /// An error ends the render.
    ///
    /// # Errors
    /// Whatever the observer cannot do, such as writing a record.
    fn after_pass(&mut self, progress: &Progress<'_>) -> Result<()>;

    /// True once the render is as good as this observer wants it; asked after each pass.
    fn satisfied(&self) -> bool {
        false
    }
}

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// All passes are done.
    Passes,
    /// Time is up.
    Time,
    /// An observer is satisfied, such as one that waits for an error to be reached.
    Satisfied,
    /// Somebody set [`Job::cancel`].
    Cancelled,
}

/// Time and work of the passes of a film: what [`resume`] goes on from.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct Spent {
    /// Reading scenes and building trees and tables, once for each run \[s\].
    pub setup: f64,
    /// Time of all passes.
    pub seconds: Seconds,
    /// Work of all passes.
    pub tally: Tally,
}

impl Spent {
    /// Adds what another part of the render took.
    pub fn add(&mut self, other: &Self) {
        self.setup += other.setup;
        self.seconds.cache += other.seconds.cache;
        self.seconds.gather += other.seconds.gather;
        self.tally += other.tally;
    }
}

/// What a finished render has to tell.
#[derive(Debug)]
pub struct Outcome {
    /// Why it ended.
    pub stop: Stop,
    /// Time of all passes.
    pub seconds: Seconds,
    /// Work of all passes.
    pub tally: Tally,
}

/// Adds passes to `film` until the job's passes or time are used up. The film does not depend on the number of
/// threads of the rayon pool it is called in.
///
/// # Errors
/// Only what an observer returns.
pub fn run<I: Integrator>(
    integrator: &I,
    view: View<'_>,
    job: &Job<'_>,
    film: &mut Film,
    observers: &mut [&mut dyn Observer],
) -> Result<Outcome> {
    resume(integrator, view, job, film, Spent::default(), observers)
}

/// As [`run`] for a film with passes, which took `spent`: it goes on with the film's next pass.
///
/// # Errors
/// As [`run`].
pub fn resume<I: Integrator>(
    integrator: &I,
    view: View<'_>,
    job: &Job<'_>,
    film: &mut Film,
    spent: Spent,
    observers: &mut [&mut dyn Observer],
) -> Result<Outcome> {
    let tiles = tiles(film.window());
    let mut outcome = Outcome { stop: Stop::Passes, seconds: spent.seconds, tally: spent.tally };
    let earlier = spent.seconds.total();
    loop {
        outcome.stop = match job.passes {
            Some(passes) if film.next_pass() >= passes => Stop::Passes,
            _ if film.passes() >= Film::MOST_PASSES => Stop::Passes,
            _ if job.time.is_some_and(|limit| outcome.seconds.total() - earlier >= limit.as_secs_f64()) => Stop::Time,
            _ if observers.iter().any(|o| o.satisfied()) => Stop::Satisfied,
            _ if job.cancel.load(Ordering::Relaxed) && film.passes() > 0 => Stop::Cancelled,
            _ => {
                if !render_pass(integrator, view, job, film, &tiles, &mut outcome) {
                    continue;
                }
                let progress = Progress { film, seconds: outcome.seconds, earlier, tally: &outcome.tally, job };
                for observer in observers.iter_mut() {
                    observer.after_pass(&progress)?;
                }
                continue;
            }
        };
        return Ok(outcome);
    }
}

/// One sample of each pixel. Cancelled in its middle, it leaves the film as it was and says `false`, unless the film is
/// empty: a first pass is always finished.
fn render_pass<I: Integrator>(
    integrator: &I,
    view: View<'_>,
    job: &Job<'_>,
    film: &mut Film,
    tiles: &[Window],
    outcome: &mut Outcome,
) -> bool {
    let (pass, mut tally, start) = (film.next_pass(), Tally::default(), Instant::now());
    let first = film.passes() == 0;
    let shared = integrator.begin_pass(view, pass, &mut tally);
    let filled = Instant::now();
    let rendered: Vec<Option<(Vec<Rgb>, Tally)>> = tiles
        .par_iter()
        .map(|&tile| {
            let dropped = !first && job.cancel.load(Ordering::Relaxed);
            (!dropped).then(|| render_tile(integrator, view, job, tile, pass, &shared))
        })
        .collect();
    outcome.seconds.cache += (filled - start).as_secs_f64();
    let rendered = rendered.into_iter().collect::<Option<Vec<_>>>();
    if let Some(rendered) = rendered {
        let add = |(&tile, (samples, work))| {
            tally += work;
            (tile, samples)
        };
        film.add_pass(&tiles.iter().zip(rendered).map(add).collect::<Vec<_>>());
    } else {
        outcome.seconds.gather += filled.elapsed().as_secs_f64();
        return false;
    }
    outcome.seconds.gather += filled.elapsed().as_secs_f64();
    outcome.tally += tally;
    film.end_pass();
    true
}

/// One sample of one pixel as a render of any window computes it, with the work of its whole pass: to look at what a
/// count of odd samples names.
pub fn replay<I: Integrator>(
    integrator: &I,
    view: View<'_>,
    job: &Job<'_>,
    pixel: [u32; 2],
    pass: u32,
) -> (Rgb, Tally) {
    let mut tally = Tally::default();
    let shared = integrator.begin_pass(view, pass, &mut tally);
    let [x, y] = pixel;
    let tile = Window { x0: x, y0: y, x1: x + 1, y1: y + 1 };
    let (samples, work) = render_tile(integrator, view, job, tile, pass, &shared);
    tally += work;
    (samples[0], tally)
}

fn render_tile<I: Integrator>(
    integrator: &I,
    view: View<'_>,
    job: &Job<'_>,
    tile: Window,
    pass: u32,
    shared: &I::Pass,
) -> (Vec<Rgb>, Tally) {
    let camera = &view.scene.camera;
    let width = u64::from(camera.resolution[0]);
    let turn = Turn::of(job.seed, pass);
    let whole = if integrator.shares_tiles() { whole_tile(tile, camera.resolution) } else { tile };
    let pixels = pixels(whole);
    let mut places = Pairs::with_capacity(pixels.len());
    let streams: Vec<PixelStream> = pixels
        .iter()
        .map(|&[x, y]| {
            let mut stream = PixelStream::new(turn.seed, u64::from(y) * width + u64::from(x), turn.number);
            places.push(&mut stream);
            stream
        })
        .collect();
    let rays: Vec<CameraRay> = pixels
        .iter()
        .zip(places.numbers())
        .zip(streams)
        .map(|((&pixel, place), mut stream)| CameraRay { ray: camera.sample(pixel, place, &mut stream), stream })
        .collect();
    let (mut out, mut tally) = (vec![Rgb::BLACK; rays.len()], Tally::default());
    integrator.radiance(view, shared, &rays, &mut out, &mut tally);
    // Back into rows; of a whole tile only the part in the window.
    let mut by_row = vec![Rgb::BLACK; tile.area()];
    for ([x, y], radiance) in pixels.into_iter().zip(out) {
        if (tile.x0..tile.x1).contains(&x) && (tile.y0..tile.y1).contains(&y) {
            by_row[((y - tile.y0) * (tile.x1 - tile.x0) + x - tile.x0) as usize] = radiance;
        }
    }
    (by_row, tally)
}

/// The pixels of a tile in squares of eight by eight: neighbours in the list are neighbours in the picture, so that their
/// rays go well together.
fn pixels(tile: Window) -> Vec<[u32; 2]> {
    const SQUARE: usize = 8;
    let mut pixels = Vec::with_capacity(tile.area());
    for y0 in (tile.y0..tile.y1).step_by(SQUARE) {
        for x0 in (tile.x0..tile.x1).step_by(SQUARE) {
            for y in y0..tile.y1.min(y0 + SQUARE as u32) {
                pixels.extend((x0..tile.x1.min(x0 + SQUARE as u32)).map(|x| [x, y]));
            }
        }
    }
    pixels
}

/// The tile of the whole picture that `tile` of a crop lies in.
fn whole_tile(tile: Window, resolution: [u32; 2]) -> Window {
    let [x0, y0] = [tile.x0, tile.y0].map(|v| v / TILE * TILE);
    Window { x0, y0, x1: (x0 + TILE).min(resolution[0]), y1: (y0 + TILE).min(resolution[1]) }
}

/// `window` cut into tiles along the grid of the whole picture, row by row.
fn tiles(window: Window) -> Vec<Window> {
    let cuts = |from: u32, to: u32| {
        (from / TILE..to.div_ceil(TILE)).map(move |i| ((i * TILE).max(from), ((i + 1) * TILE).min(to)))
    };
    let row = |(y0, y1)| cuts(window.x0, window.x1).map(move |(x0, x1)| Window { x0, y0, x1, y1 });
    cuts(window.y0, window.y1).flat_map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_of_a_tile_is_listed_once() {
        let tile = Window { x0: 3, y0: 8, x1: 24, y1: 19 };
        let mut listed = pixels(tile);
        assert_eq!((listed[0], listed[8]), ([3, 8], [3, 9]));
        listed.sort_by_key(|&[x, y]| (y, x));
        let rows: Vec<[u32; 2]> = (8..19).flat_map(|y| (3..24).map(move |x| [x, y])).collect();
        assert_eq!(listed, rows);
    }
}
