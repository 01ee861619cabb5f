//! `cargo xtask web`: the laboratory in the browser, in web/dist, and its tests in a real browser.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::browser::{self, Run};
use crate::{Failure, in_ci, plain, root, succeed, target};

pub(crate) const USAGE: &str = "\
web      builds the library as WebAssembly and the page around it in web/dist, and runs tests/browser/lab in Chromium; says what to
           install where something is missing
           --build  without the tests
           --store  stores anew how the views look, in tests/browser/pictures, and tests nothing else
           --where-possible  ends without a failure where a tool is missing, unless CI=true";

const TRIPLE: &str = "wasm32-unknown-unknown";
/// The most memory that the library takes in a tab: 1 GiB. Its stack: 4 MiB.
const LINKED: [&str; 2] = [
    "-Clink-arg=--max-memory=1073741824",
    "-Clink-arg=-zstack-size=4194304",
];
/// The tools of Debian, which build the standard library for WebAssembly from its source.
const DEBIAN: &str = "apt-get install rustc-web cargo-web rust-web-src rust-web-llvm lld-22";
/// The folder of its tests in `tests/browser`.
const FOLDER: &str = "lab";
const DEBIAN_SOURCE: &str = "/usr/lib/rustlib/src/rust/library";

/// How the page is built and tested.
#[derive(Debug, Default, PartialEq)]
struct Options {
    build_only: bool,
    where_possible: bool,
    run: Run,
}

pub(crate) fn main(flags: &[&str]) -> Result<(), Failure> {
    let options = options(flags)?;
    let tools = match Tools::ready(&options) {
        Ok(tools) => tools,
        Err(reason) if options.where_possible && !in_ci() => {
            eprintln!("xtask: web is skipped: {reason}");
            return Ok(());
        }
        Err(reason) => return Err(reason.into()),
    };
    let root = root();
    let module = library(&root, tools.toolchain)?;
    page(&root, &module)?;
    if let Some(browser) = tools.browser {
        browser::test(FOLDER, &browser, options.run, |_| ())?;
    }
    println!(
        "xtask: the laboratory is in {}",
        root.join("web/dist").display()
    );
    Ok(())
}

fn options(flags: &[&str]) -> Result<Options, Failure> {
    let mut options = Options::default();
    for flag in flags {
        match *flag {
            "--build" => options.build_only = true,
            "--store" => options.run = Run::StoredPictures,
            "--where-possible" => options.where_possible = true,
            other => {
                return Err(Failure::usage(
                    format!("web has no flag '{other}'"),
                    "web [--build | --store] [--where-possible]",
                ));
            }
        }
    }
    Ok(options)
}

/// What it needs beside Rust.
struct Tools {
    toolchain: Toolchain,
    /// The browser of the tests, where they are asked for.
    browser: Option<PathBuf>,
}

impl Tools {
    /// The tools, else what to install.
    fn ready(options: &Options) -> Result<Self, String> {
        let toolchain = Toolchain::found().ok_or_else(|| {
            format!("there is no Rust for WebAssembly: `rustup target add {TRIPLE}`, or {DEBIAN}")
        })?;
        browser::node()?;
        let browser = (!options.build_only).then(browser::ready).transpose()?;
        Ok(Self { toolchain, browser })
    }
}

/// Where a compiler for WebAssembly comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Toolchain {
    /// That of the project, with the target that rustup installs.
    Rustup,
    /// That of Debian beside it.
    Debian,
}

impl Toolchain {
    fn found() -> Option<Self> {
        let output = Command::new("rustc").args(["--print", "sysroot"]).output();
        let sysroot = output.ok().and_then(|o| String::from_utf8(o.stdout).ok());
        let library = |root: String| Path::new(root.trim()).join("lib/rustlib").join(TRIPLE);
        if sysroot.map(library).is_some_and(|library| library.exists()) {
            return Some(Self::Rustup);
        }
        let tools = [
            "/usr/bin/rustc",
            "/usr/bin/cargo",
            "/usr/bin/wasm-ld-22",
            DEBIAN_SOURCE,
        ];
        let all = tools.iter().all(|tool| Path::new(tool).exists());
        all.then_some(Self::Debian)
    }

    fn cargo(self) -> Command {
        match self {
            Self::Rustup => Command::new("cargo"),
            Self::Debian => {
                let mut cargo = Command::new("/usr/bin/cargo");
                let path = env::var("PATH").unwrap_or_default();
                cargo.env("PATH", format!("/usr/bin:{path}"));
                cargo
                    .env("RUSTC", "/usr/bin/rustc")
                    .env("RUSTC_BOOTSTRAP", "1");
                // The cargo that runs this chore names its own toolchain.
                cargo.env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO");
                let linker = "CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER";
                cargo.env(linker, "/usr/bin/wasm-ld-22");
                cargo
            }
        }
    }

    /// Arguments for a standard library that has to be built too.
    fn standard_library(self) -> &'static [&'static str] {
        match self {
            Self::Rustup => &[],
            // Small sorts: those of speed are a twentieth of the module.
            Self::Debian => &[
                "-Zbuild-std=std,panic_abort",
                "-Zbuild-std-features=optimize_for_size",
            ],
        }
    }

    /// Flags of the compiler that it alone has.
    fn flags(self) -> &'static [&'static str] {
        match self {
            Self::Rustup => &[],
            // Where in the source it panics says nothing to a visitor.
            Self::Debian => &["-Zlocation-detail=none"],
        }
    }
}

/// Builds the library; returns the module.
fn library(root: &Path, toolchain: Toolchain) -> Result<PathBuf, String> {
    let folder = target().join("web");
    let mut cargo = toolchain.cargo();
    // Were it a library of Rust as well, every dependency would be compiled twice: as machine code, and to be optimised with it.
    cargo.arg("rustc").args(toolchain.standard_library());
    cargo.args([
        "--target",
        TRIPLE,
        "--profile",
        "web",
        "--package",
        "lagrangian-web",
        "--lib",
        "--crate-type",
        "cdylib",
    ]);
    let flags = ["-Ctarget-feature=+simd128,+relaxed-simd"]
        .into_iter()
        .chain(LINKED)
        .chain(toolchain.flags().iter().copied());
    cargo.env("RUSTFLAGS", flags.collect::<Vec<_>>().join(" "));
    cargo.env("CARGO_TARGET_DIR", &folder);
    succeed(cargo.current_dir(root), "the library as WebAssembly")?;
    Ok(folder.join(TRIPLE).join("web").join("lagrangian_web.wasm"))
}

/// Builds the page around the module, and around the same one without relaxed SIMD.
fn page(root: &Path, module: &Path) -> Result<(), String> {
    let web = root.join("web");
    let place = web.join("wasm");
    fs::create_dir_all(&place).map_err(|e| format!("cannot make {}: {e}", place.display()))?;
    let relaxed = fs::read(module).map_err(|e| format!("cannot read {}: {e}", module.display()))?;
    let relaxed = plain::stripped(&relaxed)?;
    let plain = plain::plain(&relaxed)?;
    for (name, bytes) in [("relaxed.wasm", relaxed), ("plain.wasm", plain)] {
        let file = place.join(name);
        fs::write(&file, bytes).map_err(|e| format!("cannot write {}: {e}", file.display()))?;
    }
    browser::packages(&web)?;
    let mut build = Command::new("npm");
    build.args(["run", "build"]);
    succeed(build.current_dir(&web), "the page")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_read_and_others_are_refused() {
        let both = options(&["--build", "--where-possible"]);
        let expected = Options {
            build_only: true,
            where_possible: true,
            ..Options::default()
        };
        assert_eq!(both, Ok(expected));
        let stored = options(&["--store"]).map(|options| options.run);
        assert_eq!(stored, Ok(Run::StoredPictures));
        assert!(options(&["--quick"]).is_err());
    }
}
