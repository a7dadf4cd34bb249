//! Names the build (`MARMOR_BUILD`: a hash of what decides a bit of a picture), and compiles `wrapper/` against Embree 3 or 4
//! and writes its Rust declarations: the latter with the feature `embree` alone.
//!
//! Embree is looked for below `EMBREE_DIR` (`include/` and `lib/`) if that is set, else where the C compiler looks.

use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=MARMOR_BUILD={:016x}", fingerprint());
    #[cfg(feature = "embree")]
    if let Err(message) = embree::build() {
        println!("cargo::error={message}");
    }
}

/// FNV-1a over the sources, the locked dependencies, the target and the compiler. Neither time, folder, features nor
/// profile are in it: they change no picture.
fn fingerprint() -> u64 {
    let mut files = vec![PathBuf::from("Cargo.lock")];
    list(Path::new("src"), &mut files);
    list(Path::new("wrapper"), &mut files);
    files.sort();
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let compiler = std::process::Command::new(variable("RUSTC")).arg("--version").output();
    let mut parts = vec![variable("TARGET").into_bytes(), compiler.map(|o| o.stdout).unwrap_or_default()];
    for file in files {
        // A package from a registry has no Cargo.lock of its own.
        let Ok(bytes) = std::fs::read(&file) else { continue };
        parts.extend([file.display().to_string().replace('\\', "/").into_bytes(), bytes]);
    }
    for folder in ["Cargo.lock", "src", "wrapper"] {
        println!("cargo::rerun-if-changed={folder}");
    }
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for part in parts {
        for byte in (part.len() as u64).to_le_bytes().iter().chain(&part) {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    hash
}

/// All files below `folder`.
fn list(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() { list(&path, into) } else { into.push(path) }
    }
}

#[cfg(feature = "embree")]
mod embree {
    use std::path::{Path, PathBuf};
    use std::process::{Command, Stdio};

    const REMEDY: &str = "on Debian 12 and 13: `apt install libembree-dev libclang-dev`; another place: set EMBREE_DIR to the folder \
                          that holds its include/ and lib/";

    /// Where an Embree is, and which.
    struct Place {
        major: u32,
        /// Folders to name to compiler and linker; `None` for those they search anyway.
        include: Option<PathBuf>,
        lib: Option<PathBuf>,
    }

    pub fn build() -> Result<(), String> {
        println!("cargo::rerun-if-env-changed=EMBREE_DIR");
        let place = match std::env::var_os("EMBREE_DIR").filter(|dir| !dir.is_empty()) {
            Some(dir) => find_below(Path::new(&dir))?,
            None => find_in_system()?,
        };
        declarations()?;
        compile(&place)
    }

    /// The newest version below `dir` that has both headers and library.
    fn find_below(dir: &Path) -> Result<Place, String> {
        let include = dir.join("include");
        let shown = dir.display();
        let Some(major) = [4, 3].into_iter().find(|m| include.join(format!("embree{m}/rtcore.h")).is_file()) else {
            return Err(format!(
                "EMBREE_DIR={shown}: no include/embree4/rtcore.h or include/embree3/rtcore.h{} ({REMEDY})",
                older(&include)
            ));
        };
        let lib = libraries_below(dir).into_iter().find(|lib| {
            ["so", "dylib", "a", "lib"].iter().any(|end| {
                lib.join(format!("libembree{major}.{end}")).is_file()
                    || lib.join(format!("embree{major}.{end}")).is_file()
            })
        });
        match lib {
            Some(lib) => Ok(Place { major, include: Some(include), lib: Some(lib) }),
            None => {
                Err(format!("EMBREE_DIR={shown}: headers of Embree {major} but no lib/libembree{major}.so ({REMEDY})"))
            }
        }
    }

    /// `lib/` below `dir`, its other usual spellings, and Debian's folder for this machine.
    fn libraries_below(dir: &Path) -> Vec<PathBuf> {
        let mut folders = vec![dir.join("lib"), dir.join("lib64")];
        let arch = std::env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
        folders.push(dir.join(format!("lib/{arch}-linux-gnu")));
        folders
    }

    /// The newest version that the C compiler finds by itself.
    fn find_in_system() -> Result<Place, String> {
        let header = |name: &str| {
            try_c(&format!("#include <{name}/rtcore.h>\nint main(void) {{ return 0; }}\n"), &["-fsyntax-only"])
        };
        for major in [4, 3] {
            if header(&format!("embree{major}"))? {
                let program = format!(
                    "#include <embree{major}/rtcore.h>\nint main(void) {{ rtcReleaseDevice(rtcNewDevice(0)); return 0; }}\n"
                );
                if try_c(&program, &[&format!("-lembree{major}")])? {
                    return Ok(Place { major, include: None, lib: None });
                }
                return Err(format!(
                    "headers of Embree {major} are installed but programs cannot be linked with libembree{major} ({REMEDY})"
                ));
            }
        }
        let found = if header("embree2")? { ": Embree 2 is, which is too old" } else { "" };
        Err(format!("the feature `embree` needs Embree 3 or 4, which is not installed{found} ({REMEDY})"))
    }

    fn older(include: &Path) -> &'static str {
        if include.join("embree2/rtcore.h").is_file() { "; Embree 2 is there but too old" } else { "" }
    }

    /// Whether the C compiler accepts `program`.
    fn try_c(program: &str, arguments: &[&str]) -> Result<bool, String> {
        let out = out_dir();
        let source = out.join("probe.c");
        std::fs::write(&source, program).map_err(|e| format!("{}: cannot write: {e}", source.display()))?;
        let compiler = cc::Build::new()
            .cargo_metadata(false)
            .cargo_warnings(false)
            .try_get_compiler()
            .map_err(|e| no_compiler(&e))?;
        let mut command: Command = compiler.to_command();
        command.arg(&source).arg("-o").arg(out.join("probe")).args(arguments);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command.status().map(|s| s.success()).map_err(|e| no_compiler(&e))
    }

    fn no_compiler(cause: &dyn std::fmt::Display) -> String {
        let cause = cause.to_string().replace('\n', " ");
        format!("the feature `embree` needs a C compiler: {cause} (on Debian: `apt install gcc libc6-dev`)")
    }

    /// Rust declarations of the wrapper's own header.
    fn declarations() -> Result<(), String> {
        // bindgen panics if it cannot load libclang: ask first, quietly.
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let clang = std::panic::catch_unwind(bindgen::clang_version);
        std::panic::set_hook(hook);
        if clang.is_err() {
            return Err("the feature `embree` needs libclang, which is not found (on Debian 12 and 13: `apt install libclang-dev`; \
                        another place: set LIBCLANG_PATH to the folder that holds it)"
                .to_string());
        }
        let bindings = bindgen::Builder::default()
            .header("wrapper/marmor_embree.h")
            .allowlist_item("(marmor_|MARMOR_|Marmor).*")
            .rust_edition(bindgen::RustEdition::Edition2024)
            .derive_default(true)
            .generate()
            .map_err(|e| format!("wrapper/marmor_embree.h: {e}"))?;
        let file = out_dir().join("marmor_embree.rs");
        bindings.write_to_file(&file).map_err(|e| format!("{}: cannot write: {e}", file.display()))
    }

    fn compile(place: &Place) -> Result<(), String> {
        let major = place.major;
        let mut build = cc::Build::new();
        build.file("wrapper/marmor_embree.c").std("c11").warnings(true).extra_warnings(true);
        build.define("MARMOR_EMBREE_MAJOR", major.to_string().as_str());
        if let Some(include) = &place.include {
            build.include(include);
        }
        build.try_compile("marmor_embree").map_err(|e| {
            format!(
                "wrapper/marmor_embree.c does not compile with Embree {major}: {}",
                e.to_string().replace('\n', " ")
            )
        })?;
        if let Some(lib) = &place.lib {
            println!("cargo::rustc-link-search=native={}", lib.display());
            // So that programs find this very library when they run.
            println!("cargo::rustc-link-arg=-Wl,-rpath,{}", lib.display());
        }
        println!("cargo::rustc-link-lib=embree{major}");
        println!("cargo::rustc-link-lib=m");
        Ok(())
    }

    fn out_dir() -> PathBuf {
        PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR for build scripts"))
    }
}
