//! The program as a user calls it: a folder with a small scene in it, a call, and what the call said.
#![allow(dead_code)] // each test file uses its part

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A ball of wax under a lamp, `resolution` pixels of it, with `more` TOML at the end.
pub fn ball(resolution: [u32; 2], more: &str) -> String {
    format!(
        r#"
unit = "mm"
[camera]
position = [0, 2, 6]
look_at = [0, 0, 0]
fov = 30
resolution = {resolution:?}
[[object]]
name = "ball"
shape = "sphere"
centre = [0, 0, 0]
radius = 1
rings = 16
segments = 32
material = "wax"
[[object]]
name = "lamp"
shape = "rectangle"
centre = [0, 5, 0]
edge_u = [2, 0, 0]
edge_v = [0, 0, 2]
material = "lamp"
[material.wax]
type = "translucent"
sigma_s_prime = [2, 3, 4]
sigma_a = [0.05, 0.1, 0.2]
eta = 1.3
[material.lamp]
type = "emissive"
radiance = 5
{more}"#
    )
}

/// The ball under an open sky, 24x16 pixels: what reports are tested with.
pub fn ball_under_sky() -> tempfile::TempDir {
    folder(&ball([24, 16], "[environment]\nradiance = 1\n[method]\ncache_samples = 200\n"))
}

/// A wall of 2 x 2 under a lamp from the left and one from the right; `more` stands between the wall and the right one.
pub fn two_lamps(radiance: f64, more: &str) -> String {
    let lamp = |name: &str, x: i32, half: f64, radiance: f64| {
        format!(
            "[[object]]\nname = \"{name}\"\nshape = \"rectangle\"\ncentre = [{x}, 0, 2]\nedge_u = [{half}, 0, {half}]\nedge_v = [0, {half}, 0]\n\
             material = \"{name}\"\n[material.{name}]\ntype = \"emissive\"\nradiance = {radiance}\ntwo_sided = true\n"
        )
    };
    let (left, right) = (lamp("left", -3, 0.5, 1e4), lamp("right", 3, 0.05, radiance));
    format!(
        "unit = \"mm\"\n[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov = 10\nresolution = [64, 48]\n\
         [[object]]\nshape = \"rectangle\"\ncentre = [0, 0, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 1, 0]\nmaterial = \"wall\"\n\
         [material.wall]\ntype = \"diffuse\"\nalbedo = 0.5\n{left}{right}{more}"
    )
}

/// A folder with `scene` as scene.toml.
pub fn folder(scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

/// The program in `folder`, not yet started.
pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_marmor"));
    command.current_dir(folder).args(arguments);
    command
}

/// Runs it to its end.
pub fn marmor(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// What it wrote, as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
