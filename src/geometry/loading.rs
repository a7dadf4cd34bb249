//! What a mesh may take while it is read: bounds on its counts, its lines and its memory.

use crate::error::Result;
use crate::memory;

/// Memory while a mesh is read, looked at and put into a tree [bytes/triangle], at its most; measured with a million that have
/// normals. `cli/need.rs` tells it apart by what takes it.
pub const LOADING_BYTES: usize = 265;

/// The same of texture coordinates, where they are asked for: as typed, and of each corner.
const UV_BYTES: usize = 72;

/// Longer than any real line, polygons of a million corners included; keeps a binary file from being read as text.
pub(super) const MAX_LINE: usize = 1 << 24;

/// This many vertices, normals or triangles are refused, so that indices stay below 2^32.
pub(super) const MAX_COUNT: usize = 1 << 31;

/// Looks at the memory there is while a mesh grows. What a file says of its own size is not asked.
pub(super) struct Budget {
    bytes_each: usize,
    /// Entries at which memory is looked at next.
    look_at: usize,
}

impl Budget {
    /// With `uv` texture coordinates are kept.
    pub(super) fn new(uv: bool) -> Self {
        Self { bytes_each: LOADING_BYTES + if uv { UV_BYTES } else { 0 }, look_at: 1 << 20 }
    }

    /// That there is memory to read on, where `count` vertices or triangles are there: as much again as these need.
    ///
    /// # Errors
    /// Memory.
    pub(super) fn check(&mut self, count: usize) -> Result<()> {
        if count < self.look_at {
            return Ok(());
        }
        self.look_at = 2 * count;
        let needed = count as u128 * self.bytes_each as u128;
        let what = format!("a mesh of {count} or more vertices or triangles");
        memory::require(needed, memory::available(), &what, "use a coarser mesh")
    }
}

/// That there are `bytes` for a file and what is made of it.
///
/// # Errors
/// Memory.
pub(super) fn require_bytes(bytes: usize) -> Result<()> {
    // Asking the system takes longer than reading a small file.
    if bytes < 1 << 24 {
        return Ok(());
    }
    memory::require(bytes as u128, memory::available(), "a mesh file that is read whole", "use a coarser mesh")
}
