//! `lagrangian demo`.

use std::process::ExitCode;

use anyhow::{Result, bail};

use super::Manner;
use crate::cli::DemoArgs;

pub(super) fn run(_args: &DemoArgs, _manner: Manner) -> Result<ExitCode> {
    bail!("`lagrangian demo` is not part of this build yet")
}
