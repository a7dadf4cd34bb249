//! Passes over tiles on all cores. Knows passes and pixels, nothing of methods or files: progress, limits and records
//! are observers called between passes with the clock stopped. Read first: [`run`].

use crate::error::Result;
use crate::film::{Film, Window};
use crate::integrator::{CameraRay, Integrator, Tally, View};
use crate::math::Rgb;
use crate::sampling::{Pairs, PixelStream};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Edge of a tile [pixels].
const TILE: u32 = 32;

/// What is asked of a render.
pub struct Job<'a> {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Stop after this many passes; a pass is one sample of each pixel.
    pub passes: Option<u32>,
    /// Stop after the pass that reaches this time of rendering.
    pub time: Option<Duration>,
    /// Set from outside to stop: the running pass is dropped, unless it is the first.
    pub cancel: &'a AtomicBool,
}

/// Where the time went [s]; writing and measuring are not in it.
#[derive(Clone, Copy, Debug, Default)]
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
}

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// All passes are done.
    Passes,
    /// Time is up.
    Time,
    /// Somebody set [`Job::cancel`].
    Cancelled,
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
    let tiles = tiles(film.window());
    let mut outcome = Outcome { stop: Stop::Passes, seconds: Seconds::default(), tally: Tally::default() };
    loop {
        outcome.stop = match job.passes {
            Some(passes) if film.passes() >= passes => Stop::Passes,
            _ if job.time.is_some_and(|limit| outcome.seconds.total() >= limit.as_secs_f64()) => Stop::Time,
            _ if job.cancel.load(Ordering::Relaxed) && film.passes() > 0 => Stop::Cancelled,
            _ => {
                if !render_pass(integrator, view, job, film, &tiles, &mut outcome) {
                    continue;
                }
                let progress = Progress { film, seconds: outcome.seconds, tally: &outcome.tally, job };
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
    let (pass, mut tally, start) = (film.passes(), Tally::default(), Instant::now());
    let shared = integrator.begin_pass(view, pass, &mut tally);
    let filled = Instant::now();
    let rendered: Vec<Option<(Vec<Rgb>, Tally)>> = tiles
        .par_iter()
        .map(|&tile| {
            let dropped = pass > 0 && job.cancel.load(Ordering::Relaxed);
            (!dropped).then(|| render_tile(integrator, view, job, tile, pass, &shared))
        })
        .collect();
    outcome.seconds.cache += (filled - start).as_secs_f64();
    outcome.seconds.gather += filled.elapsed().as_secs_f64();
    let Some(rendered) = rendered.into_iter().collect::<Option<Vec<_>>>() else { return false };
    for (&tile, (samples, work)) in tiles.iter().zip(rendered) {
        film.add(tile, &samples);
        tally += work;
    }
    outcome.tally += tally;
    film.end_pass();
    true
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
    let pixels = pixels(tile);
    let mut places = Pairs::with_capacity(pixels.len());
    let streams: Vec<PixelStream> = pixels
        .iter()
        .map(|&[x, y]| {
            let mut stream = PixelStream::new(job.seed, u64::from(y) * width + u64::from(x), pass);
            places.push(&mut stream);
            stream
        })
        .collect();
    let rays: Vec<CameraRay> = pixels
        .iter()
        .zip(places.numbers())
        .zip(streams)
        .map(|((&pixel, place), stream)| CameraRay { ray: camera.ray(pixel, place), stream })
        .collect();
    let (mut out, mut tally) = (vec![Rgb::BLACK; rays.len()], Tally::default());
    integrator.radiance(view, shared, &rays, &mut out, &mut tally);
    let mut by_row = vec![Rgb::BLACK; out.len()];
    for ([x, y], radiance) in pixels.into_iter().zip(out) {
        by_row[((y - tile.y0) * (tile.x1 - tile.x0) + x - tile.x0) as usize] = radiance;
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

/// `window` cut into tiles, row by row.
fn tiles(window: Window) -> Vec<Window> {
    let mut tiles = Vec::new();
    for y0 in (window.y0..window.y1).step_by(TILE as usize) {
        for x0 in (window.x0..window.x1).step_by(TILE as usize) {
            tiles.push(Window { x0, y0, x1: (x0 + TILE).min(window.x1), y1: (y0 + TILE).min(window.y1) });
        }
    }
    tiles
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
