//! Triangle meshes and points on them. Not for: materials, rays (`query`).
//! Read first: `mesh.rs`; then `area_table.rs`, which picks points with equal chance per area, and `mesh_file.rs`, where files are read.

mod area_table;
mod box_tree;
mod builder;
mod clearance;
mod clip;
mod contact;
mod counted_bytes;
mod curvature;
mod doctor;
mod gltf;
mod gltf_data;
mod gltf_json;
mod loading;
mod mesh;
mod mesh_file;
mod morton;
mod obj;
mod obj_lines;
mod obj_remarks;
mod odd_polygons;
mod parts;
mod patches;
mod ply;
mod ply_header;
mod polygon;
mod polygon_fill;
mod portion;
mod raw_mesh;
mod shapes;
mod sheet;
mod solid;
mod stl;
#[cfg(test)]
mod test_shapes;
mod union;
mod weld;
mod winding;

use crate::math::DVec3;

pub use area_table::{AreaSample, AreaTable};
pub use clearance::Clearance;
pub use clip::{Side, reaches_into};
pub use contact::{Contact, Meeting, Seek, lying, meeting};
pub use curvature::Curvature;
pub use doctor::{Findings, Mended, examine, mended};
pub use loading::LOADING_BYTES;
pub use mesh::{CornerUv, Mesh, Normals, Precision, SurfacePoint};
pub use mesh_file::{MESH_ENDINGS, files_beside, load_mesh, load_mesh_with_uv};
pub use morton::morton_code;
pub use obj::write_obj;
pub use parts::{Label, PartKind, Parts};
pub use patches::{Facet, Facets, Patches};
pub use raw_mesh::{RawMesh, RawNormals};
pub use shapes::{rectangle, rectangle_uv, sphere, sphere_uv};
pub use sheet::{Blunted, MITER_LIMIT, NoSheet, Thick, thickened};
pub use solid::{Part, Seams, Solid};
pub use union::Union;
pub use weld::Seam;

/// The unit vector along `n`, or 0 of one without a direction; no length is too large or too small.
fn unit_or_zero(n: DVec3) -> DVec3 {
    (n / n.abs().max_element()).normalize_or_zero()
}

/// At most 40 characters of a line, for messages.
fn shown(line: &str) -> String {
    let line = line.trim();
    let mut text: String = line.chars().take(40).flat_map(char::escape_debug).collect();
    if line.chars().nth(40).is_some() {
        text.push_str("...");
    }
    text
}
