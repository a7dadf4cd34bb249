//! What the program says of lamps, sheets and lost paths: before the render, after it, by its exit code, and on the pages.
#![allow(clippy::unwrap_used)] // a call of this file that does not start has failed

mod command;

use command::{folder, marmor, text};

/// A box without its side towards the camera's left below, one of 200 squares of its top.
fn leaky(folder: &std::path::Path) {
    let n = 10_u32;
    let mut mesh = String::new();
    for z in [1.0, -1.0] {
        for k in 0..(n + 1) * (n + 1) {
            let at = |i: u32| 0.2 * f64::from(i) - 1.0;
            mesh += &format!("v {} {} {z}\n", at(k % (n + 1)), at(k / (n + 1)));
        }
    }
    let at = |i: u32, j: u32, below: u32| below * (n + 1) * (n + 1) + i * (n + 1) + j + 1;
    for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
        if (i, j) != (5, 5) {
            mesh += &format!("f {} {} {} {}\n", at(i, j, 0), at(i, j + 1, 0), at(i + 1, j + 1, 0), at(i + 1, j, 0));
        }
        mesh += &format!("f {} {} {} {}\n", at(i, j, 1), at(i + 1, j, 1), at(i + 1, j + 1, 1), at(i, j + 1, 1));
    }
    for k in 0..n {
        for (a, b) in [((0, k), (0, k + 1)), ((k, n), (k + 1, n)), ((n, k + 1), (n, k)), ((k + 1, 0), (k, 0))] {
            mesh += &format!("f {} {} {} {}\n", at(a.0, a.1, 1), at(b.0, b.1, 1), at(b.0, b.1, 0), at(a.0, a.1, 0));
        }
    }
    std::fs::write(folder.join("leaky.obj"), mesh).unwrap();
}

const LEAKY: &str = "unit = \"mm\"\n[camera]\nposition = [0.3, 0.2, 6]\nlook_at = [0, 0, 0]\nfov = 15\nresolution = [16, 16]\n\
                     [[object]]\nname = \"crate\"\nmesh = \"leaky.obj\"\nmaterial = \"wax\"\n[environment]\nradiance = 1\n[material.wax]\n\
                     type = \"translucent\"\nsigma_s_prime = 3\nsigma_a = 0.01\neta = 1.3\n";

#[test]
fn many_lost_paths_are_a_warning_an_exit_code_and_a_footnote() {
    let folder = folder(LEAKY);
    let folder = folder.path();
    leaky(folder);
    for backend in marmor::query::Backend::ALL.into_iter().filter(|b| b.is_built_in()) {
        let call = [
            "render",
            "scene.toml",
            "--method",
            "volume_path",
            "--spp",
            "8",
            "-o",
            "a.exr",
            "--backend",
            backend.name(),
        ];
        let plain = marmor(folder, &call);
        let said = text(&plain.stderr);
        assert!(plain.status.success(), "{said}");
        assert!(said.contains("object \"crate\": 4 edges belong to one triangle alone, the rims of holes"), "{said}");
        assert_eq!(said.matches("rims of holes").count(), 1, "{said}");
        let line = said.lines().find(|l| l.contains("were lost at object \"crate\"")).unwrap();
        assert!(line.starts_with("warning: ") && line.contains("holes of its mesh (4 edges"), "{line}");
        // Counts of paths that are there.
        let numbers: Vec<u64> = line.split(' ').filter_map(|w| w.parse().ok()).collect();
        assert!(numbers[0] > 0 && numbers[1] >= 2048 && numbers[0] < numbers[1] / 10, "{line}");
        std::fs::remove_file(folder.join("a.exr")).unwrap();
        let strict = marmor(folder, &[&call[..], &["--strict"]].concat());
        assert_eq!(strict.status.code(), Some(5), "{}", text(&strict.stderr));
        assert!(folder.join("a.exr").exists() && text(&strict.stderr).contains("--strict: "));
    }
    for (command, what) in [("compare", "--models"), ("converge", "--methods")] {
        let call = [command, "scene.toml", what, "beam", "--time-budget", "200ms", "-o", command];
        let more: &[&str] = if command == "converge" { &["--method", "volume_path"] } else { &[] };
        let call = [&call[..], more].concat();
        let made = marmor(folder, &call);
        if command == "converge" && !made.status.success() {
            panic!("{}", text(&made.stderr));
        }
        assert!(text(&made.stderr).contains("were lost at object \"crate\""), "{command}: {}", text(&made.stderr));
        let page = std::fs::read_to_string(folder.join(command).join("index.html")).unwrap();
        assert!(page.contains("were lost at object"), "{command}");
    }
}

fn glow(method: &str) -> (bool, String) {
    let scene = command::ball([8, 8], "").replace(
        "shape = \"rectangle\"\ncentre = [0, 5, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 0, 2]",
        "shape = \"sphere\"\ncentre = [0, 0, 0]\nradius = 0.3\nrings = 8\nsegments = 16",
    );
    // A model without the first order would have that by paths, which meet the lamp.
    let scene = scene.replace("eta = 1.3", "eta = 1.3\nmodel = \"standard\"");
    let folder = folder(&scene);
    let call = marmor(folder.path(), &["render", "scene.toml", "--method", method, "--spp", "16", "-o", "a.exr"]);
    let said = text(&call.stderr);
    assert!(call.status.success(), "{said}");
    let image = marmor::film::Image::read_exr(&folder.path().join("a.exr")).unwrap();
    (image.pixels.iter().any(|p| p.min() > 0.0), said)
}

/// The only lamp is inside the only body: light by paths; by a model none, and not for want of `two_sided`.
#[test]
fn a_lamp_inside_glows_or_is_said() {
    let (lit, said) = glow("volume_path");
    assert!(lit && !said.contains("warning"), "{said}");
    let (lit, said) = glow("subsurface");
    assert!(!lit && said.contains("lamp \"lamp\" lies inside object \"ball\""), "{said}");
    assert!(said.contains("--method volume_path") && !said.contains("two_sided"), "{said}");
}

#[test]
fn a_sheet_is_refused_or_said() {
    let sheet = LEAKY.replace("leaky.obj", "leaf.obj");
    let folder = folder(&sheet);
    std::fs::write(folder.path().join("leaf.obj"), "v -1 -1 0\nv 1 -1 0\nv 1 1 0.3\nv -1 1 0.2\nf 1 2 3 4\n").unwrap();
    let call = |method: &str| {
        marmor(folder.path(), &["render", "scene.toml", "--method", method, "--spp", "1", "-o", "a.exr"])
    };
    let refused = call("volume_path");
    let said = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(3), "{said}");
    assert!(said.contains("\"crate\": an open sheet has no inside") && said.contains("give it a thickness"), "{said}");
    assert!(!folder.path().join("a.exr").exists());
    let said = text(&call("subsurface").stderr);
    assert!(said.contains("an open sheet has no inside") && !said.contains("two_sided"), "{said}");
}
