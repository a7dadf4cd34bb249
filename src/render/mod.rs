//! From a scene to a picture: [`render`] does it in one call.
//! Passes over tiles on all cores; progress, limits and records are observers between passes. Not for: files, how light goes
//! (`integrator`). Read first: `front.rs`; then `method.rs` (what a scene asks for), `passes.rs` (the loop).

mod first_hit;
mod framing;
mod front;
mod method;
mod passes;

#[doc(inline)]
pub use crate::cache::{Clock, GatherTally};
#[doc(inline)]
pub use crate::integrator::{Tally, WalkTally};
#[doc(inline)]
pub use crate::query::{Backend, RayTally};
#[doc(hidden)]
pub use first_hit::{Seen, first_hit};
#[doc(hidden)]
pub use framing::{Aim, nothing_in_view, shares};
pub use front::{DEFAULT_SPP, Options, Rendered, render};
#[doc(hidden)]
pub use front::{Prepared, no_light, odd_counts};
#[doc(hidden)]
pub use method::{Method, Shared};
pub use passes::Seconds;
#[doc(hidden)]
pub use passes::{Job, Observer, Outcome, Progress, Spent, Stop, replay, resume, run};
