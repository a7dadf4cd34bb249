//! Disks, folders and files that do not do what they should, through the real binary.
#![cfg(all(feature = "cli", unix))]

use super::harness::BASE;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!("{BASE}[method]\nname = \"direct\"\n[render]\nspp = 2\n");
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_marmor")).current_dir(folder).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn refused(output: &Output, code: i32, words: &[&str]) {
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{told}");
    for word in words {
        assert!(told.contains(word), "`{word}` in {told}");
    }
    assert!(!told.contains("panicked"), "{told}");
}

fn render(folder: &Path, more: &[&str]) -> Output {
    run(folder, &[&["render", "scene.toml", "-q"], more].concat())
}

/// Files may have 512 bytes (`ulimit -f`; the shell makes a refused write an error instead of a signal): the old picture
/// stays, and nothing half-written is left.
#[test]
fn a_full_disk_refused() {
    let folder = folder();
    let folder = folder.path();
    assert!(render(folder, &["-o", "x.exr"]).status.success());
    let old = fs::read(folder.join("x.exr")).unwrap();
    let line =
        format!("trap '' XFSZ; ulimit -f 1; exec {} render scene.toml -o x.exr --spp 3", env!("CARGO_BIN_EXE_marmor"));
    let output = Command::new("sh").current_dir(folder).args(["-c", &line]).output().unwrap();
    refused(&output, 4, &["x.exr", "cannot write", "unchanged"]);
    assert!(fs::read(folder.join("x.exr")).unwrap() == old);
    let left: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

/// A checkpoint that cannot be written does not end the render.
#[test]
fn a_full_disk_for_a_checkpoint_warns() {
    let folder = folder();
    let line = format!(
        "trap '' XFSZ; ulimit -f 1; exec {} render scene.toml -o x.png --spp 2000 --checkpoint-every 0.001s",
        env!("CARGO_BIN_EXE_marmor")
    );
    let output = Command::new("sh").current_dir(folder.path()).args(["-c", &line]).output().unwrap();
    let told = text(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert!(told.contains("x.film") && told.contains("the render goes on"), "{told}");
    assert!(folder.path().join("x.png").exists());
}

/// A folder in which nobody can make a file, root neither.
#[cfg(target_os = "linux")]
#[test]
fn a_read_only_folder_refused() {
    refused(&render(folder().path(), &["-o", "/proc/x.exr"]), 4, &["/proc/x.exr", "no new file can be made"]);
}

#[test]
fn a_folder_in_place_of_the_picture_refused() {
    let folder = folder();
    fs::create_dir(folder.path().join("x.exr")).unwrap();
    refused(&render(folder.path(), &["-o", "x.exr"]), 4, &["x.exr", "it is a folder"]);
}

#[test]
fn a_folder_that_is_not_there_refused() {
    refused(&render(folder().path(), &["-o", "gone/x.exr"]), 4, &["gone", "does not exist"]);
}

#[test]
fn a_device_in_place_of_the_picture_refused() {
    let folder = folder();
    std::os::unix::fs::symlink("/dev/null", folder.path().join("x.exr")).unwrap();
    refused(&render(folder.path(), &["-o", "x.exr"]), 4, &["neither a file nor a folder"]);
}

#[test]
fn zero_samples_refused() {
    refused(&render(folder().path(), &["--spp", "0"]), 2, &["at least 1"]);
}

#[test]
fn one_sample_ok() {
    let folder = folder();
    assert!(render(folder.path(), &["--spp", "1", "-o", "x.exr", "--strict"]).status.success());
}

/// 268 million pixels: what they need is told by `check`, and by an error before anything is rendered where there is not
/// that much.
#[test]
fn a_picture_of_16384_squared_refused() {
    let folder = folder();
    let huge = ["-D", "camera.resolution=[16384,16384]"];
    let output = run(folder.path(), &[&["check", "scene.toml", "--json"], &huge[..]].concat());
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let film = 16384 * 16384 * marmor::film::Film::BYTES_PER_PIXEL as u64;
    assert_eq!(told["film_bytes"], film);
    // Where there is memory for it, ask for more than any machine has.
    let enough = told["available_bytes"].as_u64().is_none_or(|bytes| bytes > film);
    let size = if enough { "camera.resolution=[65536,65536]" } else { huge[1] };
    let begin = std::time::Instant::now();
    refused(&render(folder.path(), &["-D", size, "-o", "x.exr"]), 6, &["the film of", "GB", "--crop"]);
    assert!(begin.elapsed().as_secs() < 5, "before the start");
    assert!(!folder.path().join("x.exr").exists());
}

/// The same picture as a part of it.
#[test]
fn a_crop_of_a_picture_of_16384_squared_ok() {
    let folder = folder();
    let part = ["-D", "camera.resolution=[16384,16384]", "--crop", "8000,8000,8010,8010", "-o", "x.exr"];
    let output = render(folder.path(), &part);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(marmor::film::Image::read_exr(&folder.path().join("x.exr")).unwrap().resolution, [16384, 16384]);
}

/// A film file with `edit` made to its bytes, and what `--resume` and `merge` say to it.
fn film_file(edit: impl Fn(&mut Vec<u8>), code: i32, words: &[&str]) {
    let folder = folder();
    let folder = folder.path();
    assert!(render(folder, &["-o", "x.film"]).status.success());
    let mut bytes = fs::read(folder.join("x.film")).unwrap();
    edit(&mut bytes);
    fs::write(folder.join("x.film"), bytes).unwrap();
    refused(&render(folder, &["-o", "x.film", "--resume", "--spp", "4"]), code, words);
    refused(&run(folder, &["merge", "x.film", "-o", "y.exr"]), code, words);
    assert!(!folder.join("y.exr").exists());
}

#[test]
fn a_truncated_film_file_refused() {
    film_file(|bytes| bytes.truncate(bytes.len() / 2), 4, &["x.film", "cut short"]);
}

#[test]
fn a_damaged_film_file_refused() {
    film_file(|bytes| *bytes.last_mut().unwrap() ^= 1, 4, &["x.film", "checksum"]);
}

#[test]
fn an_empty_film_file_refused() {
    film_file(Vec::clear, 4, &["x.film", "no film file"]);
}

#[test]
fn a_film_file_of_another_scene_refused() {
    let folder = folder();
    let folder = folder.path();
    assert!(render(folder, &["-o", "x.film"]).status.success());
    let other = ["-o", "x.film", "--resume", "-D", "material.lamp.radiance=6"];
    refused(&render(folder, &other), 2, &["x.film", "scene, line", "radiance = 5", "radiance = 6"]);
    assert!(render(folder, &[&other[2..], &["-o", "y.film", "--samples-range", "2..4"]].concat()).status.success());
    refused(&run(folder, &["merge", "x.film", "y.film", "-o", "y.exr"]), 2, &["y.film", "scene, line"]);
}

#[test]
fn no_film_file_to_resume_from_ok() {
    let folder = folder();
    assert!(render(folder.path(), &["-o", "x.exr", "--resume"]).status.success());
}

/// Brackets within brackets end in an error, not in the end of the stack.
#[test]
fn a_scene_nested_a_hundred_thousand_deep_refused() {
    let folder = folder();
    let deep = format!("x = {}", "[".repeat(100_000));
    fs::write(folder.path().join("scene.toml"), deep).unwrap();
    refused(&render(folder.path(), &[]), 3, &["scene.toml:1", "not TOML"]);
}

#[test]
fn more_threads_than_processors_anywhere_refused() {
    refused(&render(folder().path(), &["--threads", "1000000"]), 2, &["at most 4096"]);
}

/// More samples than memory holds are refused before one is made.
#[cfg(target_os = "linux")]
#[test]
fn a_cache_beyond_memory_refused() {
    let folder = folder();
    let line = format!(
        "ulimit -v 1500000; exec {} render scene.toml -o x.exr --method subsurface -D method.cache_samples=16777216",
        env!("CARGO_BIN_EXE_marmor")
    );
    let output = Command::new("sh").current_dir(folder.path()).args(["-c", &line]).output().unwrap();
    refused(&output, 6, &["the cache of 16777216 samples", "GB", "cache_samples"]);
}

/// 67 million triangles in two numbers.
#[cfg(target_os = "linux")]
#[test]
fn a_sphere_beyond_memory_refused() {
    let folder = folder();
    let line = format!(
        "ulimit -v 1500000; exec {} check scene.toml -D object.0.rings=4096 -D object.0.segments=8192",
        env!("CARGO_BIN_EXE_marmor")
    );
    let output = Command::new("sh").current_dir(folder.path()).args(["-c", &line]).output().unwrap();
    refused(&output, 6, &["object \"body\" of 67092480 triangles", "GB", "fewer rings"]);
}

/// Whoever reads what is said may leave.
#[test]
fn a_closed_standard_error_ok() {
    let folder = folder();
    let line = format!("exec {} render scene.toml -o x.exr -v 2>&-", env!("CARGO_BIN_EXE_marmor"));
    let status = Command::new("sh").current_dir(folder.path()).args(["-c", &line]).status().unwrap();
    assert!(status.success());
    let line = format!("{} check scene.toml | true", env!("CARGO_BIN_EXE_marmor"));
    assert!(Command::new("sh").current_dir(folder.path()).args(["-c", &line]).status().unwrap().success());
}

/// The library is loaded by the system, which names it; a build without the feature says how to get one.
#[test]
fn no_embree_at_run_time_refused() {
    let folder = folder();
    let folder = folder.path();
    if cfg!(not(feature = "embree")) {
        refused(&render(folder, &["--backend", "embree"]), 2, &["embree", "rebuild with `--features embree`"]);
        return;
    }
    // This program with another name in place of the library's.
    let mut bytes = fs::read(env!("CARGO_BIN_EXE_marmor")).unwrap();
    let name = b"libembree";
    let at: Vec<usize> = (0..bytes.len() - name.len()).filter(|&i| &bytes[i..i + name.len()] == name).collect();
    at.iter().for_each(|&i| bytes[i + 3..i + 9].copy_from_slice(b"nowher"));
    let program = folder.join("marmor");
    fs::write(&program, bytes).unwrap();
    fs::set_permissions(&program, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let output = Command::new(&program).args(["check", "scene.toml"]).current_dir(folder).output().unwrap();
    refused(&output, 127, &["libnowher"]);
}
