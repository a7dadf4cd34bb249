//! Makes the meshes and pictures of the demo scenes, the same bytes on every run:
//!
//!     cargo run --release --example make_scenes [-- OUT_DIR [--cell MM]]
//!
//! OUT_DIR is `scenes` unless given. `--cell` is the edge of the cells that the lotus is cut with, and half the edge of those
//! of the jade ball; half of it gives four times as many triangles. Read first: `lotus.rs`, the hero; `polygonise.rs` turns it into triangles.
#![allow(clippy::print_stderr)] // a program of its own, outside the library

mod candles;
mod cornell;
mod improve;
mod leaf;
mod lotus;
mod mesh;
mod openwork;
mod polygonise;
mod shapes;
#[cfg(test)]
mod tests;
mod tholos;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use mesh::Mesh;

/// Edge of a cell of the lotus [mm]: a file of about 4 MB.
const CELL: f64 = 0.82;
/// The lotus in the repository has at least so many triangles.
const LEAST_TRIANGLES: usize = 50_000;

/// The picture on the leaf.
const LEAF: &str = "leaf/leaf.png";

/// A mesh and the file it goes to.
struct Part {
    /// Relative to the output folder.
    path: &'static str,
    title: &'static str,
    mesh: Mesh,
    /// Closed and outward; false for walls and flat lamps.
    solid: bool,
}

fn parts(cell: f64) -> Vec<Part> {
    let solid = |path, title, mesh| Part { path, title, mesh, solid: true };
    let open = |path, title, mesh| Part { path, title, mesh, solid: false };
    vec![
        solid("lotus/lotus.obj", "a lotus on a turned foot", polygonise::polygonise(&lotus::Lotus::new(), cell)),
        open("box/room.obj", "floor, ceiling and back wall", cornell::room()),
        open("box/left.obj", "left wall", cornell::left()),
        open("box/right.obj", "right wall", cornell::right()),
        solid("box/blocks.obj", "two blocks", cornell::blocks()),
        solid("box/knot.obj", "a trefoil knot", cornell::knot()),
        open("box/star.obj", "a lamp: a star facing down", cornell::star()),
        open("box/ring.obj", "a lamp: a ring facing +z", cornell::ring()),
        solid("tholos/tholos.obj", "a round temple", tholos::tholos()),
        solid("candles/tall.obj", "a tall candle", candles::candle(0)),
        solid("candles/middle.obj", "a candle of middle height", candles::candle(1)),
        solid("candles/low.obj", "a low candle", candles::candle(2)),
        solid("jade/ball.obj", "an openwork ball", polygonise::polygonise(&openwork::Openwork, 2.0 * cell)),
        open("leaf/leaf.obj", "a leaf: the middle of a sheet", leaf::leaf()),
        solid("leaf/twig.obj", "a twig", leaf::twig()),
        solid("jade/stand.obj", "a ring to stand a ball on", openwork::stand()),
    ]
}

/// One line about a mesh that holds what it must.
fn describe(part: &Part) -> Result<String, String> {
    if !part.solid {
        return Ok(format!("{}: {} triangles", part.path, part.mesh.triangles.len()));
    }
    let s = part.mesh.check_solid().map_err(|problem| format!("{}: {problem}", part.path))?;
    Ok(format!(
        "{}: {} triangles, closed, {:.1} cm³, smallest angle {:.2}°",
        part.path,
        s.triangles,
        s.volume / 1000.0,
        s.smallest_angle
    ))
}

fn write(out: &Path, part: &Part) -> Result<(), String> {
    let path = out.join(part.path);
    let folder = path.parent().unwrap_or(out);
    std::fs::create_dir_all(folder).map_err(|e| format!("cannot make {}: {e}", folder.display()))?;
    std::fs::write(&path, part.mesh.to_obj(part.title)).map_err(|e| format!("cannot write {}: {e}", path.display()))
}

fn run() -> Result<(), String> {
    let (mut out, mut cell) = (PathBuf::from("scenes"), CELL);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        if word == "--cell" {
            let value = words.next().and_then(|v| v.parse().ok());
            cell = value.filter(|v| (0.1..=1.0).contains(v)).ok_or("--cell wants a number of mm from 0.1 to 1")?;
        } else if word.starts_with('-') {
            return Err(format!("no option `{word}`; usage: make_scenes [OUT_DIR] [--cell MM]"));
        } else {
            out = word.into();
        }
    }
    for part in parts(cell) {
        // A closed pipe is no reason to stop.
        let _ = writeln!(std::io::stdout(), "{}", describe(&part)?);
        if part.path.starts_with("lotus") && cell <= CELL && part.mesh.triangles.len() < LEAST_TRIANGLES {
            return Err(format!("{}: fewer than {LEAST_TRIANGLES} triangles", part.path));
        }
        write(&out, &part)?;
    }
    let path = out.join(LEAF);
    write_png(&path, &leaf::picture()).map_err(|e| format!("cannot write {}: {e}", path.display()))
}

fn write_png(path: &Path, ([width, height], codes): &leaf::Picture) -> Result<(), Box<dyn std::error::Error>> {
    let mut encoder = png::Encoder::new(std::fs::File::create(path)?, *width, *height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    Ok(encoder.write_header()?.write_image_data(codes)?)
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}
