//! Random numbers as pure functions of (seed, point, sample index, dimension), and what is warped from them.
//! Not for: what a number is used for. Read first: `stream.rs`.

mod cache_stream;
mod filter;
mod pairs;
mod sobol;
mod stream;
mod turn;
mod warp;

pub use cache_stream::{CacheStream, Points};
pub use filter::PixelFilter;
pub use pairs::Pairs;
pub use stream::PixelStream;
pub use turn::Turn;
pub use warp::{cosine_hemisphere, disk, hemisphere};
