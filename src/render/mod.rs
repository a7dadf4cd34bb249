//! From a scene to a picture: [`render`] does it in one call.
//! Passes over tiles on all cores; progress, limits and records are observers between passes. Not for: files, how light goes
//! (`integrator`). Read first: `front.rs`; then `method.rs` (what a scene asks for), `passes.rs` (the loop).

mod first_hit;
mod framing;
mod front;
mod method;
mod passes;

#[doc(inline)]
pub use crate::{
    query::Backend,
    tally::{Clock, GatherTally, RayTally, Tally, WalkTally},
};
pub use front::{DEFAULT_SPP, Options, Rendered, render};
pub use passes::Seconds;

// For the program and the tests.
#[doc(hidden)]
pub use self::{
    first_hit::{Aov, first_hit},
    framing::{Aim, nothing_in_view, shares},
    front::{Prepared, no_light, odd_counts},
    method::Method,
    passes::{Job, Observer, Outcome, Progress, Spent, Stop, replay, resume, run},
};
