//! `lagrangian fit`.

use std::process::ExitCode;

use anyhow::{Result, bail};

use super::Manner;
use crate::fit_args::FitArgs;

pub(super) fn run(_args: &FitArgs, _manner: Manner) -> Result<ExitCode> {
    bail!("`lagrangian fit` is not part of this build yet")
}
