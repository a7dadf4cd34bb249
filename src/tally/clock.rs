//! Where the time of a render goes.

use std::time::Instant;

/// Seconds by what they were spent on. Before the tiles, by the clock while all threads work; in the tiles, summed over the
/// threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct Clock {
    /// Looking at the scene before the first pass, by the clock.
    pub survey: f64,
    /// Filling caches with their rays, by the clock.
    pub fill: f64,
    /// Building trees over them, by the clock.
    pub tree: f64,
    /// Paths that walk through bodies, and what leaves their patches, by the clock.
    pub walks: f64,
    /// Rays of the camera and of the near field, of all threads.
    pub rays: f64,
    /// The near field but for its rays, of all threads.
    pub near: f64,
    /// Sums over caches, of all threads.
    pub gather: f64,
}

impl Clock {
    /// Does `work` and adds what it took to one of the times.
    #[inline]
    pub fn time<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let done = work();
        *seconds += start.elapsed().as_secs_f64();
        done
    }
}

adds_up!(Clock { survey, fill, tree, walks, rays, near, gather });
