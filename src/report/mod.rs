//! Numbers -> tables and plots. Not for: measuring anything; what is shown here was computed before.
//! Read first: `profile.rs` (M(r) of models against the Monte Carlo truth), then `plot.rs` (the SVG writer);
//! `batch.rs` evaluates the rows of a CSV.

mod batch;
mod monte_carlo;
mod plot;
mod profile;

pub use batch::{Batch, BatchOptions};
pub use monte_carlo::{Bin, Run, channel_run};
pub use plot::{Axis, COLOURS, DASHES, Figure, Panel, Row, Scale, Series, Stroke};
pub use profile::{Curve, Profile};
