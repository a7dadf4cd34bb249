//! OBJ files through `tobj`: positions in f64, polygons cut into triangles, groups joined.

use std::io::{BufRead, Write};
use std::path::Path;

use super::obj_lines::ObjLines;
use super::odd_polygons::OddPolygons;
use super::polygon::triangulate;
use super::{Parts, RawMesh, RawNormals};
use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::words::counted;

/// Reads an OBJ file, with texture coordinates if `uv`; a missing MTL file is no error. See [`super::load_mesh`].
pub(super) fn read(source: impl BufRead, path: &Path, uv: bool) -> Result<RawMesh> {
    parse(&mut ObjLines::new(source, uv), path)
}

/// Writes a mesh as OBJ, every digit of it.
///
/// # Errors
/// What the system says.
pub fn write_obj(mesh: &RawMesh, out: &mut dyn Write) -> std::io::Result<()> {
    for p in &mesh.positions {
        writeln!(out, "v {:?} {:?} {:?}", p.x, p.y, p.z)?;
    }
    for [u, v] in mesh.uv.iter().flatten().flatten().flatten() {
        writeln!(out, "vt {u:?} {v:?}")?;
    }
    for n in mesh.normals.iter().flat_map(|n| &n.vectors) {
        writeln!(out, "vn {:?} {:?} {:?}", n.x, n.y, n.z)?;
    }
    let mut written = 0;
    for (i, t) in mesh.triangles.iter().enumerate() {
        let normals = mesh.normals.as_ref().and_then(|n| n.triangles[i]);
        let has_uv = mesh.uv.as_ref().is_some_and(|uv| uv[i].is_some());
        write!(out, "f")?;
        for corner in 0..3 {
            write!(out, " {}", t[corner] + 1)?;
            match (has_uv, normals.map(|n| n[corner] + 1)) {
                (false, None) => {}
                (false, Some(n)) => write!(out, "//{n}")?,
                (true, None) => write!(out, "/{}", written + corner + 1)?,
                (true, Some(n)) => write!(out, "/{}/{n}", written + corner + 1)?,
            }
        }
        writeln!(out)?;
        written += if has_uv { 3 } else { 0 };
    }
    Ok(())
}

fn parse<R: BufRead>(lines: &mut ObjLines<R>, path: &Path) -> Result<RawMesh> {
    let options = tobj::LoadOptions { triangulate: false, ..tobj::LoadOptions::default() };
    let loaded = tobj::load_obj_buf(lines, &options, |_| Err(tobj::LoadError::OpenFileFailed));
    // What the reader of lines found first; tobj's own complaints carry no line.
    if let Some(cause) = lines.failed_read() {
        return Err(Error::file(path, "read", cause));
    }
    if let Some(error) = lines.out_of_memory() {
        return Err(error.within(path.display()));
    }
    let at = |line: usize, what: &str| Error::scene(format!("{}:{line}: {what}", path.display()));
    if let Some((line, what)) = lines.complaint() {
        return Err(at(line, &what));
    }
    use tobj::LoadError::{FaceNormalOutOfBounds, FaceVertexOutOfBounds};
    if matches!(loaded, Ok(_) | Err(FaceVertexOutOfBounds | FaceNormalOutOfBounds))
        && let Some((line, what)) = lines.never_defined()
    {
        return Err(at(line, &what));
    }
    let (models, _) = loaded.map_err(|e| at(lines.line(), &explain(e, lines.current())))?;
    let mut out = RawMesh::default();
    // The reader of lines drops `o`, `g` and `usemtl`, so there is at most one model.
    if let Some(model) = models.into_iter().next() {
        out = cut(&model.mesh, lines);
    }
    out.remarks.splice(0..0, lines.remarks());
    if out.triangles.is_empty() {
        return Err(Error::scene(format!(
            "{}: no faces: {}; export the surface as polygons (`v` and `f` lines)",
            path.display(),
            if lines.line() == 0 {
                "the file is empty".into()
            } else if lines.vertices() == 0 {
                "and no vertices either; is it an OBJ file?".into()
            } else {
                format!(
                    "{}, {}",
                    counted(lines.vertices(), "vertex", "vertices"),
                    counted(lines.ignored(), "point or line", "points and lines")
                )
            }
        )));
    }
    Ok(out)
}

/// The triangles of the faces, with the normals and texture coordinates of those that have them.
fn cut<R: BufRead>(mesh: &tobj::Mesh, lines: &ObjLines<R>) -> RawMesh {
    let mut out = RawMesh {
        positions: mesh.positions.chunks_exact(3).map(|p| DVec3::new(p[0], p[1], p[2])).collect(),
        normals: vectors(mesh, lines.has_normals()).map(|vectors| RawNormals { vectors, triangles: Vec::new() }),
        uv: lines.uv().filter(|uv| uv.is_used()).map(|_| Vec::new()),
        ..RawMesh::default()
    };
    let mut polygon_lines = lines.polygon_lines().iter();
    let (mut corners, mut triangles, mut odd) = (Vec::new(), Vec::new(), OddPolygons::new("in line"));
    let labelled = lines.labelled();
    let mut runs = labelled.runs().iter().peekable();
    let mut runs_out = Vec::with_capacity(labelled.runs().len());
    let mut start = 0;
    for (face, &has_normals) in lines.has_normals().iter().enumerate() {
        // Without arities all faces are triangles.
        let arity = mesh.face_arities.get(face).map_or(3, |&n| n as usize);
        let of = |indices: &[u32], t: [u32; 3]| t.map(|i| indices[start + i as usize]);
        if let Some((_, label)) = runs.next_if(|(first, _)| *first as usize == face) {
            runs_out.push((out.triangles.len() as u32, *label));
        }
        triangles.clear();
        if arity == 3 {
            triangles.push([0, 1, 2]);
        } else {
            corners.clear();
            corners.extend(mesh.indices[start..start + arity].iter().map(|&i| out.positions[i as usize]));
            let shape = triangulate(&corners, &mut triangles);
            odd.count(shape, polygon_lines.next().copied().unwrap_or(0));
        }
        out.triangles.extend(triangles.iter().map(|&t| of(&mesh.indices, t)));
        if let Some(normals) = &mut out.normals {
            let usable = |t: &[u32; 3]| has_normals && t.iter().all(|&i| normals.vectors[i as usize] != DVec3::ZERO);
            // tobj makes up an index where a corner has none.
            normals.triangles.extend(triangles.iter().map(|&t| Some(of(&mesh.normal_indices, t)).filter(usable)));
        }
        if let (Some(uv), Some(typed)) = (&mut out.uv, lines.uv()) {
            uv.extend(triangles.iter().map(|t| typed.of(t.map(|i| start + i as usize))));
        }
        start += arity;
    }
    out.parts = Parts::new(labelled.labels().to_vec(), runs_out);
    out.remarks = odd.remarks().collect();
    out
}

/// The file's normals, if any face has them; 0 stands for one without a direction.
fn vectors(mesh: &tobj::Mesh, has: &[bool]) -> Option<Vec<DVec3>> {
    let unit = |n: &[f64]| super::unit_or_zero(DVec3::new(n[0], n[1], n[2]));
    has.contains(&true).then(|| mesh.normals.chunks_exact(3).map(unit).collect())
}

/// tobj's complaint in words that say what to mend.
fn explain(error: tobj::LoadError, line: &str) -> String {
    use tobj::LoadError as E;
    let (what, remedy) = match error {
        E::PositionParseError => ("no vertex", "expected `v x y z`, three numbers with decimal points"),
        E::NormalParseError => ("no normal", "expected `vn x y z`, three numbers with decimal points"),
        E::FaceParseError | E::InvalidPolygon => ("no face", "expected `f` and at least three vertex numbers"),
        E::FaceVertexOutOfBounds | E::FaceNormalOutOfBounds => ("a face of vertices that do not exist", "export again"),
        other => return format!("not readable as OBJ: {other}"),
    };
    format!("{what} in `{}`; {remedy}", super::shown(line))
}
