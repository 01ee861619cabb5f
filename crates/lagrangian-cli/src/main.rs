//! The command `lagrangian`.

use std::env;
use std::process::ExitCode;

fn main() -> ExitCode {
    lagrangian_cli::main(env::args_os().skip(1)).into()
}
