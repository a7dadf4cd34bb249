//! What becomes of radiance samples: sums per pixel, pictures, files, and figures that compare pictures.
//! Not for: how a sample is made, passes and threads (`render`), or records over time (`report`).
//! Read first: `sums.rs` (the film; its sums are `exact.rs`), then `output.rs` (saving) and `checkpoint.rs` (film files).
//! docs/output.md and docs/robustness.md tell users what is in the files.

mod atomic;
mod checkpoint;
mod exact;
mod exr_file;
mod exr_header;
mod exr_layers;
mod exr_read;
mod hdr_read;
mod image;
mod judge;
pub mod metrics;
mod output;
mod png_file;
mod primaries;
mod read;
mod self_error;
mod srgb_read;
mod sums;
mod variance;
mod window;

pub use exr_file::{Attribute, Layer, Metadata, source_date_epoch};
pub use exr_read::read_attributes;
pub use image::{FilePicture, Image};
pub use output::{Format, PngOptions, SaveReport, check_writable, png_bytes, save, save_with_layers};
pub use png_file::PngReport;
pub use window::Window;

// For the passes of `render` and for the program.
#[doc(hidden)]
pub use self::{
    atomic::{check_replaceable, write_atomically},
    checkpoint::{Checkpoint, Identity, checksum},
    judge::{Bias, Brightness, Judged, Judgement, Truth, brightness, judge},
    self_error::{FEWEST_PASSES, NoInterval, SelfError, SelfErrors, WorstPixel},
    sums::{BadSample, Counts, Film},
    variance::variance,
};
