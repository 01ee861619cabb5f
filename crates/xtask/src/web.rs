//! `cargo xtask web`: the laboratory in the browser, in web/dist, and its tests in a real browser.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{Failure, root, succeed, target};

pub(crate) const USAGE: &str = "\
web      builds the library as WebAssembly and the page around it in web/dist, and runs tests/browser/lab in Chromium; says what to
           install where something is missing
           --build  without the tests
           --where-possible  ends without a failure where a tool is missing, unless CI=true";

const TRIPLE: &str = "wasm32-unknown-unknown";
/// The most memory that the library takes in a tab: 1 GiB. Its stack: 4 MiB.
const LINKED: [&str; 2] = [
    "-Clink-arg=--max-memory=1073741824",
    "-Clink-arg=-zstack-size=4194304",
];
/// The tools of Debian, which build the standard library for WebAssembly from its source.
const DEBIAN: &str = "apt-get install rustc-web cargo-web rust-web-src lld-22";
const DEBIAN_SOURCE: &str = "/usr/lib/rustlib/src/rust/library";

/// How the page is built and tested.
#[derive(Debug, Default, PartialEq)]
struct Options {
    build_only: bool,
    where_possible: bool,
}

pub(crate) fn main(flags: &[&str]) -> Result<(), Failure> {
    let options = options(flags)?;
    let missing = missing(&options);
    if !missing.is_empty() {
        let text = missing.join("; ");
        if options.where_possible && env::var("CI").as_deref() != Ok("true") {
            eprintln!("xtask: web is skipped: {text}");
            return Ok(());
        }
        return Err(text.into());
    }
    let root = root();
    let module = library(&root)?;
    page(&root, &module)?;
    if !options.build_only {
        tests(&root)?;
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
            "--where-possible" => options.where_possible = true,
            other => {
                return Err(Failure::usage(
                    format!("web has no flag '{other}'"),
                    "web [--build] [--where-possible]",
                ));
            }
        }
    }
    Ok(options)
}

/// What has to be installed first.
fn missing(options: &Options) -> Vec<String> {
    let mut missing = Vec::new();
    if Toolchain::found().is_none() {
        missing.push(format!(
            "no Rust for WebAssembly is here: `rustup target add {TRIPLE}`, or {DEBIAN}"
        ));
    }
    if !runs("npm") {
        missing.push("npm is not here: install Node.js 20 or later".into());
    }
    if !options.build_only && chromium().is_none() {
        missing.push(
            "no Chromium is here: apt-get install chromium, or say where it is by CHROMIUM".into(),
        );
    }
    missing
}

fn runs(program: &str) -> bool {
    let output = Command::new(program).arg("--version").output();
    output.is_ok_and(|output| output.status.success())
}

fn chromium() -> Option<PathBuf> {
    let named = env::var_os("CHROMIUM").map(PathBuf::from);
    let usual = ["chromium", "chromium-browser", "google-chrome"];
    let usual = usual.map(|name| Path::new("/usr/bin").join(name));
    named.into_iter().chain(usual).find(|path| path.exists())
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
            Self::Debian => &["-Zbuild-std=std,panic_abort"],
        }
    }
}

/// Builds the library; returns the module.
fn library(root: &Path) -> Result<PathBuf, String> {
    let toolchain = Toolchain::found().ok_or("no Rust for WebAssembly is here")?;
    let folder = target().join("web");
    let mut cargo = toolchain.cargo();
    cargo.arg("build").args(toolchain.standard_library());
    cargo.args([
        "--target",
        TRIPLE,
        "--profile",
        "web",
        "--package",
        "lagrangian-web",
        "--lib",
    ]);
    let flags = ["-Ctarget-feature=+simd128"].into_iter().chain(LINKED);
    cargo.env("RUSTFLAGS", flags.collect::<Vec<_>>().join(" "));
    cargo.env("CARGO_TARGET_DIR", &folder);
    succeed(cargo.current_dir(root), "the library as WebAssembly")?;
    Ok(folder.join(TRIPLE).join("web").join("lagrangian_web.wasm"))
}

/// Builds the page around the module.
fn page(root: &Path, module: &Path) -> Result<(), String> {
    let web = root.join("web");
    let place = web.join("wasm");
    fs::create_dir_all(&place).map_err(|e| format!("cannot make {}: {e}", place.display()))?;
    fs::copy(module, place.join("lagrangian.wasm"))
        .map_err(|e| format!("cannot copy {}: {e}", module.display()))?;
    npm(
        &web,
        &["ci", "--no-fund", "--no-audit"],
        "the packages of web",
    )?;
    npm(&web, &["run", "build"], "the page")
}

/// Runs the tests in a browser.
fn tests(root: &Path) -> Result<(), String> {
    let folder = root.join("tests/browser");
    npm(
        &folder,
        &["ci", "--no-fund", "--no-audit"],
        "the packages of tests/browser",
    )?;
    let mut files: Vec<PathBuf> = fs::read_dir(folder.join("lab"))
        .map_err(|e| format!("cannot read {}: {e}", folder.display()))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.to_string_lossy().ends_with(".test.mjs"))
        .collect();
    files.sort();
    let mut node = Command::new("node");
    node.args(["--test", "--test-concurrency=1"]).args(files);
    if let Some(place) = chromium() {
        node.env("CHROMIUM", place);
    }
    succeed(
        node.current_dir(&folder),
        "the tests of the laboratory in a browser",
    )
}

fn npm(folder: &Path, arguments: &[&str], what: &str) -> Result<(), String> {
    succeed(
        Command::new("npm").args(arguments).current_dir(folder),
        what,
    )
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
        };
        assert_eq!(both, Ok(expected));
        assert!(options(&["--quick"]).is_err());
    }
}
