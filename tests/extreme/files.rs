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
    refused(&render(folder, &other), 2, &["x.film", "-D material.lamp.radiance=6", "is 6 here, 5 in the film"]);
    // A line of the user's own file.
    let text = fs::read_to_string(folder.join("scene.toml")).unwrap();
    let line = 1 + text.lines().position(|l| l.starts_with("fov")).unwrap();
    fs::write(folder.join("other.toml"), text.replace("fov = 30", "fov = 29")).unwrap();
    let words = format!("other.toml:{line}: `camera.fov` is 29 here, 30 in the film");
    refused(&run(folder, &["render", "other.toml", "-q", "-o", "x.film", "--resume"]), 2, &["x.film", &words]);
    assert!(render(folder, &[&other[2..], &["-o", "y.film", "--samples-range", "2..4"]].concat()).status.success());
    refused(
        &run(folder, &["merge", "x.film", "y.film", "-o", "y.exr"]),
        2,
        &["y.film", "radiance", "5 in x.film, 6 in y.film"],
    );
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
    let folder = folder();
    refused(&render(folder.path(), &["--threads", "1000000"]), 2, &["at most 4096"]);
    refused(&render(folder.path(), &["--threads", "0"]), 2, &["at least 1"]);
    for command in [["converge", "--methods"], ["compare", "--models"]] {
        let arguments = [command[0], "scene.toml", command[1], "standard", "-o", "out", "--threads", "1000000"];
        refused(&run(folder.path(), &arguments), 2, &["--threads 1000000", "at most 4096"]);
    }
    let mut check = Command::new(env!("CARGO_BIN_EXE_marmor"));
    let output =
        check.current_dir(folder.path()).args(["check", "scene.toml"]).env("RAYON_NUM_THREADS", "1000000").output();
    refused(&output.unwrap(), 2, &["RAYON_NUM_THREADS=1000000", "at most 4096"]);
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

/// A picture in the place of the scene's own: the default name, links of both kinds, another spelling.
#[test]
fn outputs_over_inputs_refused() {
    let folder = folder();
    let folder = folder.path();
    let scene = fs::read_to_string(folder.join("scene.toml")).unwrap();
    fs::write(folder.join("sky.toml"), scene.replace("radiance = 0.1", "image = \"sky.exr\"")).unwrap();
    assert!(render(folder, &["-o", "sky.exr"]).status.success());
    let inputs = || ["sky.toml", "sky.exr"].map(|name| fs::read(folder.join(name)).unwrap());
    let before = inputs();
    fs::hard_link(folder.join("sky.exr"), folder.join("hard.exr")).unwrap();
    std::os::unix::fs::symlink("sky.exr", folder.join("soft.exr")).unwrap();
    fs::create_dir(folder.join("sub")).unwrap();
    let cases: [(&[&str], &[&str]); 12] = [
        (&[], &["sky.exr", "over the picture of [environment]", "-o sky-2.exr"]),
        (&["-o", "sub/../sky.exr"], &["over the picture of [environment] (sky.exr)"]),
        (&["-o", "hard.exr"], &["over the picture of [environment]"]),
        (&["-o", "soft.exr"], &["over the picture of [environment]"]),
        (&["-o", "x.exr", "-o", "./x.exr"], &["same file as the picture", "-o ./x-2.exr"]),
        (&["-o", "x.exr", "--stats", "sky.toml"], &["over the scene file", "--stats sky-2.toml"]),
        (&["-o", "x.exr", "--records", "sky.toml"], &["over the scene file", "--records sky-2.toml"]),
        (&["-o", "x.exr", "--records", "sky.exr"], &["over the picture of [environment]"]),
        (&["-o", "x.exr", "--records", "x.exr"], &["same file as the picture"]),
        (&["-o", "x.exr", "--records", "r", "--stats", "r"], &["same file as the file of --records"]),
        (&["-o", "x.exr", "--records", "x.film"], &["same file as the file of --records"]),
        (&["-o", "hard.exr", "--reference", "sky.exr"], &["over the picture of [environment]"]),
    ];
    for (more, words) in cases {
        refused(&run(folder, &[&["render", "sky.toml", "-q"], more].concat()), 2, words);
    }
    fs::write(folder.join("mine.txt"), "of something else\n").unwrap();
    let over = run(folder, &["render", "sky.toml", "-q", "-o", "x.exr", "--records", "mine.txt"]);
    refused(&over, 4, &["mine.txt", "a file of something else"]);
    assert!(inputs() == before && !folder.join("x.exr").exists());
    assert_eq!(fs::read_to_string(folder.join("mine.txt")).unwrap(), "of something else\n");
}

#[test]
fn results_over_their_parts_refused() {
    let folder = folder();
    let folder = folder.path();
    assert!(render(folder, &["-o", "a.film"]).status.success());
    refused(&run(folder, &["merge", "a.film", "-o", "./a.film"]), 2, &["over a part (a.film)", "-o ./a-2.film"]);
    assert!(run(folder, &["merge", "a.film", "-o", "b.film", "-q"]).status.success());
}

/// Mended meshes are named after objects, which may be the names of the meshes themselves, or fall together.
#[test]
fn mended_meshes_over_meshes_refused() {
    let folder = folder();
    let folder = folder.path();
    let object = |name: &str| format!("[[object]]\nname = \"{name}\"\nmesh = \"rock.obj\"\nmaterial = \"grey\"\n");
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 4 3\n";
    fs::write(folder.join("rock.obj"), mesh).unwrap();
    let scene = fs::read_to_string(folder.join("scene.toml")).unwrap();
    let check = |objects: &[&str]| {
        let objects: String = objects.iter().map(|name| object(name)).collect();
        fs::write(folder.join("rock.toml"), format!("{scene}{objects}")).unwrap();
        run(folder, &["check", "rock.toml", "--write-mended", "."])
    };
    refused(&check(&["rock"]), 2, &["rock.obj", "over the mesh of object \"rock\"", "another folder"]);
    refused(&check(&["a b", "a_b"]), 2, &["a_b.obj", "same file as the mended mesh of object \"a b\""]);
    assert_eq!(fs::read_to_string(folder.join("rock.obj")).unwrap(), mesh);
    assert!(!folder.join("a_b.obj").exists());
    assert!(check(&["stone"]).status.success() && folder.join("stone.obj").exists());
}

/// Files may have 4096 bytes: the picture is there, the records are whole lines, and the exit code tells.
#[test]
fn a_full_disk_for_records_warns() {
    let folder = folder();
    let folder = folder.path();
    let line = format!(
        "trap '' XFSZ; ulimit -f 8; exec {} render scene.toml -o x.png --spp 20 --records r.jsonl",
        env!("CARGO_BIN_EXE_marmor")
    );
    let output = Command::new("sh").current_dir(folder).args(["-c", &line]).output().unwrap();
    refused(&output, 4, &["warning: r.jsonl", "the render goes on", "lines of the records are missing"]);
    assert!(folder.join("x.png").exists());
    let records = fs::read_to_string(folder.join("r.jsonl")).unwrap();
    assert!(records.ends_with('\n') && records.lines().count() < 20);
    assert!(records.lines().all(|line| serde_json::from_str::<serde_json::Value>(line).is_ok()));
}

/// Statistics that cannot be written cost no picture either.
#[test]
fn a_full_disk_for_statistics_warns() {
    let folder = folder();
    let folder = folder.path();
    let line = format!(
        "trap '' XFSZ; ulimit -f 2; exec {} render scene.toml -o x.png --stats s.json",
        env!("CARGO_BIN_EXE_marmor")
    );
    let output = Command::new("sh").current_dir(folder).args(["-c", &line]).output().unwrap();
    refused(&output, 4, &["statistics: s.json", "cannot write"]);
    assert!(folder.join("x.png").exists() && !folder.join("s.json").exists());
}

/// What would only be found when the picture is done.
#[test]
fn what_the_picture_cannot_have_refused() {
    let folder = folder();
    let folder = folder.path();
    assert!(render(folder, &["-o", "r.exr"]).status.success());
    let cases: [(&[&str], &[&str]); 6] = [
        (&["--reference", "r.exr", "-D", "camera.resolution=[9,6]"], &["it is 8x6", "the picture will be 9x6"]),
        (&["--reference", "r.exr", "--crop", "0,0,3,3"], &["--reference r.exr", "0,0,3,3"]),
        (&["--exposure", "nan"], &["stops from -64 to 64"]),
        (&["--exposure", "-65"], &["stops from -64 to 64"]),
        (&["--crop", "0,0,9,6"], &["leaves the picture of 8x6"]),
        (&["--layers", "variance", "--spp", "1"], &["at least 2 samples"]),
    ];
    for (more, words) in cases {
        refused(&render(folder, &[&["-o", "x.exr", "--records", "x.jsonl"], more].concat()), 2, words);
    }
    assert!(!folder.join("x.exr").exists() && !folder.join("x.jsonl").exists(), "before a pass");
    for option in ["--records", "--stats"] {
        refused(&render(folder, &["-o", "x.exr", option, "gone/x"]), 4, &["gone", "does not exist"]);
    }
    refused(&run(folder, &["merge", "r.film", "--exposure", "inf", "-o", "x.png"]), 2, &["stops from -64 to 64"]);
    refused(&run(folder, &["check", "scene.toml", "--tolerance", "nan"]), 2, &["share of the light"]);
}

/// Nobody waits for a pipe, and nothing is read that has no end.
#[test]
fn pipes_and_devices_refused() {
    let folder = folder();
    let folder = folder.path();
    for name in ["p.toml", "p.exr", "p.film", "p.jsonl"] {
        assert!(Command::new("mkfifo").current_dir(folder).arg(name).status().unwrap().success());
    }
    let cases: [&[&str]; 9] = [
        &["check", "/dev/zero"],
        &["check", "p.toml"],
        &["render", "scene.toml", "-o", "x.exr", "--reference", "p.exr"],
        &["render", "scene.toml", "-o", "x.exr", "-D", "environment.image=p.exr"],
        &["render", "scene.toml", "-o", "x.exr", "--records", "p.jsonl"],
        &["render", "scene.toml", "-o", "x.exr", "--stats", "p.jsonl"],
        &["diff", "p.exr", "/dev/zero"],
        &["merge", "p.film", "-o", "x.exr"],
        &["converge", "scene.toml", "--methods", "all", "-o", "out", "--reference", "p.exr"],
    ];
    for arguments in cases {
        let output = run(folder, arguments);
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{arguments:?}: {told}");
        assert!(told.contains("regular file") || told.contains("neither a file nor a folder"), "{told}");
    }
}

/// Every command that prints says so when it could not, and says nothing when its reader has seen enough.
#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_refused() {
    let folder = folder();
    let folder = folder.path();
    assert!(render(folder, &["-o", "x.exr"]).status.success());
    let cases: [&[&str]; 9] = [
        &["materials"],
        &["materials", "--json"],
        &["check", "scene.toml"],
        &["check", "scene.toml", "--json"],
        &["profile", "--material", "marble"],
        &["diff", "x.exr", "x.exr"],
        &["render", "scene.toml", "--pixel", "1,1"],
        &["--help"],
        &["--version"],
    ];
    for arguments in cases {
        let to = |file: fs::File| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_marmor"));
            command.current_dir(folder).args(arguments).stdout(file).output().unwrap()
        };
        refused(
            &to(fs::File::options().write(true).open("/dev/full").unwrap()),
            4,
            &["standard output", "cannot write"],
        );
        let line = format!("{} {} | true", env!("CARGO_BIN_EXE_marmor"), arguments.join(" "));
        let line = format!("set -o pipefail; {line}");
        let output = Command::new("bash").current_dir(folder).args(["-c", &line]).output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{line}: {}", text(&output.stderr));
    }
}

/// As many as this parse, load and are looked at in a second or two; names compared in pairs would take minutes of this
/// processor, and the system ends what takes more than one.
#[cfg(target_os = "linux")]
#[test]
fn a_hundred_thousand_objects_ok() {
    let folder = tempfile::tempdir().unwrap();
    let head = "unit = \"mm\"\n[camera]\nposition = [0, 0, 10]\nlook_at = [0, 0, 0]\nfov = 30\nresolution = [8, 8]\n";
    let sky = "[environment]\nradiance = 1\n";
    let objects: String = (0..100_000)
        .map(|i| {
            let place = format!("centre = [{}, {}, 0]\nedge_u = [0.3, 0, 0]\nedge_v = [0, 0.3, 0]", i % 300, i / 300);
            format!("[[object]]\nname = \"o{i}\"\nshape = \"rectangle\"\n{place}\nmaterial = \"m{i}\"\n")
        })
        .collect();
    let materials: String =
        (0..100_000).map(|i| format!("[material.m{i}]\ntype = \"diffuse\"\nalbedo = 0.5\n")).collect();
    fs::write(folder.path().join("scene.toml"), format!("{head}{objects}{materials}{sky}")).unwrap();
    let line = format!("ulimit -t 60; exec {} check scene.toml", env!("CARGO_BIN_EXE_marmor"));
    let output = Command::new("sh").current_dir(folder.path()).args(["-c", &line]).output().unwrap();
    assert!(output.status.success(), "{:?}: {}", output.status, text(&output.stderr));
    assert!(text(&output.stdout).contains("  o99999: 2 triangles"));
}
