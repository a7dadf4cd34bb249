//! What a render tells of itself: records, one JSON line a pass.
//! Not for: printing (`cli`), pictures (`film`). Read first: `records.rs`; docs/records.md has the schema for users.

mod records;

pub use records::{ErrorFigures, Record, RecordFile};
