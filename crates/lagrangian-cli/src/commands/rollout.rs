//! `lagrangian rollout`.

use std::process::ExitCode;

use anyhow::{Result, bail};

use super::Manner;
use crate::cli::RolloutArgs;

pub(super) fn run(_args: &RolloutArgs, _manner: Manner) -> Result<ExitCode> {
    bail!("`lagrangian rollout` is not part of this build yet")
}
