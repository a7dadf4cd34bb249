//! OBJ files through `tobj`: positions in f64, polygons cut into triangles, groups joined.

use std::path::Path;

use crate::error::{Error, Result};
use crate::math::DVec3;

/// What an OBJ file holds, before any transform.
pub struct ObjMesh {
    /// Positions as typed, in f64.
    pub positions: Vec<DVec3>,
}

/// Reads a file.
///
/// # Errors
/// A file error names the path; a malformed one names the line too.
pub fn load_obj(path: &Path) -> Result<ObjMesh> {
    Err(Error::file(path, "read", "not yet written"))
}
