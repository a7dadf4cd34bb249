//! `[[object]]` as typed.

use glam::DMat4;
use std::collections::HashMap;
use std::path::PathBuf;

use super::materials::MaterialEntry;
use super::options::named;
use super::portion::{self, Asked, Portion};
use super::tree::{Fields, Node, Value};
use super::values::{named_value, switch, unknown, vector};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3};

/// One object.
#[derive(Clone, Debug)]
pub struct ObjectEntry {
    /// Name, for messages; unlike any other object's.
    pub name: String,
    /// Where its triangles come from.
    pub geometry: Geometry,
    /// Which of them, of a mesh file.
    pub portion: Portion,
    /// Index into the file's materials.
    pub material: usize,
    /// Which shading normals.
    pub normals: NormalsChoice,
    /// Exchange inside and outside.
    pub flip: bool,
    /// Where bodies overlap, the one of the higher priority is there.
    pub priority: i32,
    /// Its mesh is the middle of a sheet so thick \[unit\], > 0.
    pub thickness: Option<f64>,
    /// Name of the body that it is part of, where it names one: objects of one body have one material and one priority.
    pub body: Option<String>,
    /// From its own space into the scene's [unit]; has an inverse.
    pub transform: DAffine3,
    /// File and line, for messages.
    pub at: String,
}

/// Where triangles come from.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Geometry {
    /// A mesh file, as typed: relative to the scene file.
    Mesh(PathBuf),
    /// See [`crate::geometry::rectangle`].
    Rectangle {
        /// Middle \[unit\].
        centre: DVec3,
        /// Half of one edge \[unit\].
        edge_u: DVec3,
        /// Half of the other \[unit\]; the outside is where `edge_u` x `edge_v` points.
        edge_v: DVec3,
    },
    /// See [`crate::geometry::sphere`].
    Sphere {
        /// Middle \[unit\].
        centre: DVec3,
        /// Distance of the vertices from it \[unit\], > 0.
        radius: f64,
        /// Bands from pole to pole, 2 to 4096.
        rings: u32,
        /// Triangles around, 3 to 8192.
        segments: u32,
    },
}

named! {
    /// Which shading normals a mesh gets.
    NormalsChoice, "kind of normals",
    /// The file's where it has any, else the triangles' own.
    Auto = "auto",
    /// The triangles' own: flat.
    Geometric = "geometric",
    /// Computed: the mean about each position, weighted by angle.
    Smooth = "smooth"
}

const COMMON: [&str; 12] = [
    "name",
    "mesh",
    "shape",
    "part",
    "material",
    "materials",
    "normals",
    "flip",
    "priority",
    "body",
    "thickness",
    "transform",
];

const PRIORITY: &str = "a whole number; the higher one wins where bodies overlap";

/// All objects.
pub(super) fn read(top: &Fields<'_>, materials: &[MaterialEntry]) -> Result<Vec<ObjectEntry>> {
    let list = top.list("object")?;
    if list.is_empty() {
        return Err(top.missing("object", "at least one [[object]]"));
    }
    let mut out: Vec<ObjectEntry> = Vec::with_capacity(list.len());
    let numbers: HashMap<&str, usize> = materials.iter().zip(0..).map(|(m, i)| (m.name.as_str(), i)).collect();
    let mut taken: HashMap<String, String> = HashMap::with_capacity(list.len());
    let mut bodies: HashMap<String, usize> = HashMap::new();
    // The place in `list` of each: an entry may be several objects, of parts of its mesh.
    let mut typed = Vec::with_capacity(list.len());
    for (i, o) in list.iter().enumerate() {
        let geometry = geometry(o)?;
        let name = o.get("name", "a name in quotes", Node::text)?.map_or_else(|| format!("object {i}"), String::from);
        for Asked { portion, suffix, material: asked } in portion::read(o)? {
            let name = name.clone() + &suffix;
            if let Some(other) = taken.insert(name.clone(), o.at()) {
                return Err(o.error_at("name", format_args!("{name:?} is taken ({other}); give each object its own")));
            }
            let material = numbers.get(asked.as_str()).copied().ok_or_else(|| {
                let known: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
                let what = if known.is_empty() {
                    format!("{asked:?} does not exist; add a section [material.{asked}]")
                } else {
                    unknown(&asked, &known)
                };
                o.error_at(if o.has("materials") { "materials" } else { "material" }, what)
            })?;
            let thickness = o.get("thickness", "a number of units above 0", length)?;
            if thickness.is_some() && !materials[material].surface.is_translucent() {
                return Err(o.error_at("thickness", no_inside(&name, &asked)));
            }
            out.push(ObjectEntry {
                name,
                geometry: geometry.clone(),
                portion,
                material,
                normals: named_value(o, "normals")?.unwrap_or(NormalsChoice::Auto),
                flip: switch(o, "flip")?.unwrap_or(false),
                body: o.get("body", "a name in quotes", |n| n.text().filter(|t| !t.is_empty()))?.map(String::from),
                priority: o
                    .get("priority", PRIORITY, |n| n.integer().and_then(|i| i32::try_from(i).ok()))?
                    .unwrap_or(0),
                thickness,
                transform: transform(o)?,
                at: o.at(),
            });
            typed.push(i);
            let last = out.len() - 1;
            if let Some(body) = &out[last].body {
                let first = *bodies.entry(body.clone()).or_insert(last);
                is_one_body(o, body, [&out[first], &out[last]], materials)?;
            }
        }
    }
    let numbers: HashMap<&str, usize> = out.iter().zip(0..).map(|(entry, i)| (entry.name.as_str(), i)).collect();
    for group in grouped(&out).iter().filter(|group| group.len() > 1) {
        let (o, body) = (&list[typed[group[1]]], &out[group[1]].body);
        let other = body.as_ref().and_then(|body| numbers.get(body.as_str())).map(|i| &out[*i]);
        if let Some(other) = other.filter(|other| other.body != *body) {
            let what = format_args!(
                "{:?} is the name of an object that is not part of it ({}); give the body another name",
                other.name, other.at
            );
            return Err(o.error_at("body", what));
        }
    }
    Ok(out)
}

/// A length that f32 holds as well.
fn length(n: &Node) -> Option<f64> {
    n.number().filter(|v| (*v as f32).is_normal() && *v > 0.0)
}

fn no_inside(object: &str, material: &str) -> String {
    format!(
        "is that of a sheet of a translucent medium, and {object:?} is of {material:?}, which is none; leave it out, or give the \
         object a material of type \"translucent\""
    )
}

/// That `last`, read from `o`, can be part of `body`, whose first object is `first`.
fn is_one_body(
    o: &Fields<'_>,
    body: &str,
    [first, last]: [&ObjectEntry; 2],
    materials: &[MaterialEntry],
) -> Result<()> {
    let (name, material) = (&last.name, |entry: &ObjectEntry| &materials[entry.material]);
    if !material(last).surface.is_body() {
        let what = format_args!(
            "{body:?}: object {name:?} is of material {:?} ({}), behind which there is no medium; leave the key out, or take a \
             translucent or dielectric material",
            material(last).name,
            material(last).at
        );
        return Err(o.error_at("body", what));
    }
    if first.material != last.material {
        let what = format_args!(
            "{body:?} has one medium, but object {:?} is of material {:?} ({}) and object {name:?} of material {:?}; give both \
             the same material, or each a body of its own",
            first.name,
            material(first).name,
            first.at,
            material(last).name
        );
        return Err(o.error_at("body", what));
    }
    if let Some(sheet) = [first, last].into_iter().find(|entry| entry.thickness.is_some()) {
        let what = format_args!(
            "{body:?}: object {:?} ({}) has a `thickness`: a sheet is a body by itself; leave out one of the two keys",
            sheet.name, sheet.at
        );
        return Err(o.error_at("body", what));
    }
    if first.priority != last.priority {
        let what = format_args!(
            "{body:?} has one priority, but that of object {:?} is {} ({}) and that of object {name:?} is {}; give both the same",
            first.name, first.priority, first.at, last.priority
        );
        return Err(o.error_at("body", what));
    }
    Ok(())
}

/// The objects that are one in the world: those of one body, and each other one by itself; in the order of the first of each.
pub(super) fn grouped(objects: &[ObjectEntry]) -> Vec<Vec<usize>> {
    let (mut out, mut number): (Vec<Vec<usize>>, HashMap<&str, usize>) = (Vec::new(), HashMap::new());
    for (i, entry) in objects.iter().enumerate() {
        let next = out.len();
        let place = entry.body.as_deref().map_or(next, |body| *number.entry(body).or_insert(next));
        if place == next {
            out.push(Vec::new());
        }
        out[place].push(i);
    }
    out
}

fn geometry(o: &Fields<'_>) -> Result<Geometry> {
    const MESH: &str = "the path of a mesh file, relative to the scene file";
    const SHAPES: &[&str] = &["rectangle", "sphere"];
    let keys = |more: &[&'static str]| [&COMMON[..], more].concat();
    let shape = o.get("shape", "\"rectangle\" or \"sphere\"", Node::text)?;
    if o.has("mesh") && o.has("shape") {
        return Err(o.error_at("shape", "stands beside `mesh`; remove one"));
    }
    let point = "three numbers [x, y, z]";
    match shape {
        None => {
            o.only("an object with a mesh", &keys(&[]))?;
            let mesh = o.need("mesh", &format!("{MESH}; or a `shape`"), |n| n.text().filter(|t| !t.is_empty()))?;
            Ok(Geometry::Mesh(mesh.into()))
        }
        Some("rectangle") => {
            o.only("a rectangle", &keys(&["centre", "edge_u", "edge_v"]))?;
            let [centre, edge_u, edge_v] =
                [o.need("centre", point, vector)?, o.need("edge_u", point, vector)?, o.need("edge_v", point, vector)?];
            Ok(Geometry::Rectangle { centre, edge_u, edge_v })
        }
        Some("sphere") => {
            o.only("a sphere", &keys(&["centre", "radius", "rings", "segments"]))?;
            let count = |key: &str, low: i64, high: i64, default: u32| {
                let expected = format!("a whole number from {low} to {high}");
                let value = o.get(key, &expected, |n| n.integer().filter(|i| (low..=high).contains(i)));
                value.map(|v| v.map_or(default, |i| i as u32))
            };
            Ok(Geometry::Sphere {
                centre: o.need("centre", point, vector)?,
                radius: o.need("radius", "a length above 0", |n| n.number().filter(|v| *v > 0.0))?,
                rings: count("rings", 2, 4096, 64)?,
                segments: count("segments", 3, 8192, 128)?,
            })
        }
        Some(other) => Err(o.error_at("shape", unknown(other, SHAPES))),
    }
}

fn transform(o: &Fields<'_>) -> Result<DAffine3> {
    let Some(t) = o.table("transform")? else { return Ok(DAffine3::IDENTITY) };
    t.only("a transform", &["scale", "rotate", "translate", "matrix"])?;
    const MATRIX: &str = "3 rows of 3 numbers, or 4 rows of 4 with the last [0, 0, 0, 1]";
    let transform = if let Some(matrix) = t.get("matrix", MATRIX, matrix)? {
        if let Some(other) = ["scale", "rotate", "translate"].into_iter().find(|key| t.has(key)) {
            return Err(t.error_at(other, "stands beside `matrix`, which holds everything; remove one"));
        }
        matrix
    } else {
        let scale = t.get("scale", "one number or three, none 0", |n| {
            let v = n.number().map(DVec3::splat).or_else(|| vector(n))?;
            (v.x != 0.0 && v.y != 0.0 && v.z != 0.0).then_some(v)
        })?;
        let rotate = t.get("rotate", "degrees about x, y and z, three numbers", vector)?.unwrap_or(DVec3::ZERO);
        let linear = about(2, rotate.z) * about(1, rotate.y) * about(0, rotate.x);
        let translate = t.get("translate", "three numbers [x, y, z]", vector)?.unwrap_or(DVec3::ZERO);
        DAffine3::from_mat3_translation(linear * DMat3::from_diagonal(scale.unwrap_or(DVec3::ONE)), translate)
    };
    // Each column over its largest entry, so that no scale but only the shape of the map decides.
    let linear = transform.matrix3;
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis].map(|c| c / c.abs().max_element());
    let shape = DMat3::from_cols(x, y, z);
    if shape.determinant().abs() <= 1e-12
        || !shape.is_finite()
        || !linear.inverse().is_finite()
        || linear.determinant() == 0.0
    {
        let key = if t.has("matrix") { "matrix" } else { "scale" };
        return Err(
            t.error_at(key, "has no inverse: it flattens the object; expected a map that keeps its volume above 0")
        );
    }
    Ok(transform)
}

fn matrix(node: &Node) -> Option<DAffine3> {
    let Value::List(rows) = &node.value else { return None };
    match &rows[..] {
        [a, b, c] => {
            let rows = [a.numbers::<3>()?, b.numbers::<3>()?, c.numbers::<3>()?];
            Some(DAffine3::from_mat3(DMat3::from_cols_array_2d(&rows).transpose()))
        }
        [a, b, c, d] => {
            let rows = [a.numbers::<4>()?, b.numbers::<4>()?, c.numbers::<4>()?, d.numbers::<4>()?];
            let map = DMat4::from_cols_array_2d(&rows).transpose();
            (rows[3] == [0.0, 0.0, 0.0, 1.0]).then(|| DAffine3::from_mat4(map))
        }
        _ => None,
    }
}

/// Rotation by `degrees` about an axis, counter-clockwise seen from its tip; quarter turns are exact.
fn about(axis: usize, degrees: f64) -> DMat3 {
    let (s, c) = match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => other.to_radians().sin_cos(),
    };
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut columns = [[0.0; 3]; 3];
    columns[axis][axis] = 1.0;
    (columns[u][u], columns[u][v]) = (c, s);
    (columns[v][u], columns[v][v]) = (-s, c);
    DMat3::from_cols_array_2d(&columns)
}
