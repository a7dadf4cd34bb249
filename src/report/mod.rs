//! Numbers -> records, tables and plots. Not for: printing (`cli`), pictures (`film`), or computing what is shown.
//! Read first: `records.rs` (one JSON line a pass; docs/records.md has the schema for users); `profile.rs` (M(r) of models
//! against the Monte Carlo truth) with `plot.rs` (the SVG writer); `batch.rs` evaluates the rows of a CSV.
//! `convergence.rs` (error against run time; `curve.rs` has one method's, `verdict.rs` the sentences) and `comparison.rs` (models against a truth) make pages with `page.rs`.

mod axis;
mod batch;
mod batch_model;
mod comparison;
mod convergence;
mod curve;
mod false_colour;
mod monte_carlo;
mod page;
mod plot;
mod profile;
mod records;
mod verdict;

pub use axis::{Axis, Scale};
pub use batch::Batch;
pub use batch_model::BatchOptions;
pub use comparison::{Compared, Figures, ModelComparison, Part as PicturePart};
pub use convergence::Convergence;
pub use curve::{Curve as ErrorCurve, Fit, Point as ErrorPoint, Reached};
pub use false_colour::{colour_bar, common_range, false_colours};
pub use monte_carlo::{Bin, Run, channel_run};
pub use page::{Page, Picture};
pub use plot::{COLOURS, DASHES, End, Figure, Panel, Row, Series, Stroke};
pub use profile::{Curve, Profile};
pub use records::{ErrorFigures, Record, RecordFile, SelfFigures};
pub use verdict::Standing;
