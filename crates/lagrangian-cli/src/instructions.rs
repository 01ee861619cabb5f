//! The CPU instructions of the kernels: the best available ones, unless the environment names others.

use std::env;

use anyhow::Result;
use nets::simd::{Level, level, levels, set_level};

use crate::failure::Context;

/// The variable of the environment that names an instruction set.
const VARIABLE: &str = "LAGRANGIAN_SIMD";

/// Selects the instruction set that the environment names, if it does.
pub(crate) fn choose() -> Result<()> {
    let Some(name) = env::var_os(VARIABLE) else {
        return Ok(());
    };
    let name = name.to_string_lossy();
    let set = Level::from_name(&name).and_then(set_level);
    Ok(set.context(
        format!("{VARIABLE}={name}"),
        format!("give {VARIABLE} one of these names, or unset it to use the fastest"),
    )?)
}

/// The version, with the instructions in use and the available ones.
pub(crate) fn version() -> String {
    let names: Vec<&str> = levels().into_iter().map(Level::name).collect();
    format!(
        "{}\ninstructions: {} (this CPU has {}; {VARIABLE}=NAME takes another)",
        env!("CARGO_PKG_VERSION"),
        level(),
        names.join(", ")
    )
}
