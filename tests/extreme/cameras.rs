//! Cameras and pictures at the ends of what there is.

use super::harness::{BASE, backends, load, ok, refused, shots, warns, with};
use super::rendering::on;
use marmor::film::Window;
use marmor::integrator::{AmbientOcclusion, View};
use marmor::query::{self, Backend};
use marmor::render::{Aim, nothing_in_view, shares};

fn camera(from: &str, to: &str) -> marmor::Result<marmor::scene::Scene> {
    load(&with(&[(from, to)]))
}

#[test]
fn a_camera_inside_a_body_warns() {
    let scene =
        camera("position = [0, 1, 6]\nlook_at = [0, 0, 0]", "position = [0, 0, 0]\nlook_at = [0, 0, 1]").unwrap();
    warns(&scene, &["the camera stands inside object \"body\"", "black; take --method volume_path"]);
}

#[test]
fn a_camera_on_a_surface_warns() {
    let scene = camera("position = [0, 1, 6]", "position = [0, 0, 1]").unwrap();
    warns(&scene, &["the camera stands in the surface of object \"body\"", "move it by more than"]);
}

#[test]
fn a_camera_on_the_floor_ok() {
    ok(&camera("position = [0, 1, 6]\nlook_at = [0, 0, 0]", "position = [0, -1.5, 0]\nlook_at = [1, -1.5, 0]")
        .unwrap());
}

#[test]
fn a_view_parallel_to_up_refused() {
    refused(camera("position = [0, 1, 6]", "position = [0, 5, 0]"), &["parallel to up", "set `up`"]);
}

#[test]
fn a_view_nearly_parallel_to_up_ok() {
    ok(&camera("position = [0, 1, 6]", "position = [0, 6, 0.0001]").unwrap());
}

#[test]
fn a_camera_at_what_it_looks_at_refused() {
    refused(camera("position = [0, 1, 6]", "position = [0, 0, 0]"), &["the same point"]);
}

#[test]
fn a_view_of_179_9_degrees_ok() {
    ok(&camera("fov = 30", "fov = 179.9").unwrap());
}

#[test]
fn a_view_of_a_millionth_degree_ok() {
    ok(&camera("fov = 30", "fov = 1e-6").unwrap());
}

#[test]
fn a_view_of_180_degrees_refused() {
    refused(camera("fov = 30", "fov = 180"), &["`camera.fov` is 180"]);
}

#[test]
fn a_picture_of_one_pixel_ok() {
    ok(&camera("resolution = [8, 6]", "resolution = [1, 1]").unwrap());
}

#[test]
fn a_picture_of_one_row_ok() {
    ok(&camera("resolution = [8, 6]", "resolution = [500, 1]").unwrap());
}

#[test]
fn a_picture_without_pixels_refused() {
    refused(camera("resolution = [8, 6]", "resolution = [0, 6]"), &["1 to 65536"]);
}

#[test]
fn a_scene_without_objects_refused() {
    let text = BASE.split("[[object]]").next().unwrap().to_string() + "[environment]\nradiance = 1\n";
    refused(load(&text), &["object", "at least one [[object]]"]);
}

#[test]
fn a_camera_that_sees_nothing_warns() {
    let scene = camera("look_at = [0, 0, 0]", "look_at = [0, 1, 12]").unwrap();
    for backend in backends() {
        let aim = what_to_look_at(&scene, backend).unwrap();
        assert!(aim.object == "body" && aim.degrees > 90.0, "{aim:?}");
    }
    for shot in shots(&scene) {
        shot.assert_sound();
        let first = shot.image.pixels[0];
        assert!(shot.image.pixels.iter().all(|&p| p == first), "{}: the environment alone", shot.what);
    }
}

#[test]
fn a_camera_that_sees_less_than_a_pixel_ok() {
    let small = with(&[
        ("look_at = [0, 0, 0]", "look_at = [0.3, 0.5, 0]"),
        ("radius = 1", "radius = 1e-5"),
        ("[0, -1.5, 0]", "[0, -900, 0]"),
    ]);
    let scene = load(&small).unwrap();
    for backend in backends() {
        assert_eq!(what_to_look_at(&scene, backend), None);
    }
}

/// What the warning about an empty picture says.
fn what_to_look_at(scene: &marmor::scene::Scene, backend: Backend) -> Option<Aim> {
    let rays = query::build(backend, &scene.meshes()).unwrap();
    let view = View { scene, rays: &*rays };
    let window = Window::full(scene.camera.resolution);
    nothing_in_view(view, window, &shares(view, window))
}

#[test]
fn a_camera_in_a_closed_opaque_body_warns() {
    let around =
        "shape = \"sphere\"\ncentre = [0, 1, 6]\nradius = 0.5\nrings = 8\nsegments = 16\nmaterial = \"grey\"\n";
    let shut = format!("{BASE}[[object]]\nname = \"hood\"\n{around}");
    for shot in warns(&load(&shut).unwrap(), &["\"hood\": the camera is inside it", "no lamp is in it"]) {
        assert!(shot.image.pixels.iter().all(|p| p.is_black()), "{}", shot.what);
    }
    // Nor does a direction below a facet lead out of it, where only its interpolated normal looks up.
    let seen = load(&shut.replacen("resolution = [8, 6]", "resolution = [96, 96]", 1)).unwrap();
    let (film, _) = on(Backend::preferred(), &seen, &AmbientOcclusion { radius: f32::INFINITY, rays: 16 }, 1, 0..4);
    assert!(film.image().pixels.iter().all(|p| p.is_black()));
    // A lamp in it, or around all of it: a room.
    let room = shut.replacen("centre = [0, 4, 0]", "centre = [0, 1, 6.3]", 1);
    let room = room.replacen("edge_u = [1, 0, 0]\nedge_v = [0, 0, 1]", "edge_u = [0.1, 0, 0]\nedge_v = [0, 0, 0.1]", 1);
    assert!(!load(&room).unwrap().warnings.join("\n").contains("the camera is inside"));
}
