//! The machine and the versions of all that took part.

use std::fs;
use std::process::Command;

use serde_json::{Value, json};

use super::contestant::{Contestant, Program, Programs, cores};
use super::venv;

/// What a reader must know to compare: CPU, cores, its FMA peak, system, compilers and packages.
pub(super) fn describe(programs: &Programs) -> Result<Value, String> {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |name: &str| {
        info.lines()
            .find_map(|l| l.strip_prefix(name)?.split_once(':'))
    };
    let cpu = field("model name").map_or("unknown", |(_, value)| value.trim());
    let rustc = Command::new("rustc").arg("-V").output();
    let rustc = rustc.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned());
    let peers: serde_json::Map<String, Value> = match &programs.python {
        Some(python) => venv::versions(python)
            .into_iter()
            .map(|(k, v)| (k, json!(v)))
            .collect(),
        None => serde_json::Map::new(),
    };
    let [single, double] = peak(programs)?;
    Ok(json!({
        "cpu": cpu, "cores": cores().len(), "system": std::env::consts::OS, "architecture": std::env::consts::ARCH,
        "fma_peak_f32_gflops": single, "fma_peak_f64_gflops": double,
        "rustc": rustc.unwrap_or_else(|_| "unknown".into()), "peers": peers,
    }))
}

/// Fused multiply–adds of one core as operations a second, in f32 and f64, GFLOP/s.
pub(super) fn peak(programs: &Programs) -> Result<[f64; 2], String> {
    let mut ours = Contestant::start(programs, Program::Ours, "ours", 1)?;
    let found = ours.prepare(&json!({ "name": "peak" }))?.check;
    <[f64; 2]>::try_from(found)
        .map_err(|found| format!("the FMA peak of two precisions is {found:?}"))
}
