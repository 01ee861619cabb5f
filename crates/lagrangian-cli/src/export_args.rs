//! The flags of `export`.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lagrangian export run --c controller
  lagrangian export ur10/model.safetensors --c ur10-c --name ur10
  lagrangian export run --fmu arm.fmu
  lagrangian export run --jax arm
  lagrangian export run --torch arm-torch
  cmake -S controller -B build && cmake --build build && ctest --test-dir build

The C has no dependencies but the mathematical library, takes no memory and keeps nothing between calls. docs/controllers.md shows how it is \
used from C, CasADi, FMI, Rust and Python. Modules for JAX and PyTorch hold functions of the weights and of states, which these libraries \
differentiate to any order, compile and map.")]
pub(crate) struct ExportArgs {
    /// A saved model, or the folder of its run
    #[arg(value_name = "MODEL")]
    pub(crate) model: PathBuf,

    /// Folder for the C, its example, its CMake project, and its declarations for CasADi and Rust
    #[arg(long, value_name = "FOLDER")]
    pub(crate) c: Option<PathBuf>,

    /// File for a functional mock-up unit of FMI 2.0, for co-simulation and model exchange; compiled for this machine where it has a C compiler
    #[arg(long, value_name = "FILE")]
    pub(crate) fmu: Option<PathBuf>,

    /// Folder for a module of JAX: functions of weights and states, with the weights beside it
    #[arg(long, value_name = "FOLDER")]
    pub(crate) jax: Option<PathBuf>,

    /// Folder for a module of PyTorch: functions of weights and states, with the weights beside it
    #[arg(long, value_name = "FOLDER")]
    pub(crate) torch: Option<PathBuf>,

    /// Version of FMI: only 2.0 is written
    #[arg(long, value_name = "VERSION", requires = "fmu", hide = true)]
    pub(crate) fmi: Option<String>,

    /// Prefix of all names in C, and name of a module of Python [default: from the name of the file or the run]
    #[arg(long, value_name = "NAME")]
    pub(crate) name: Option<String>,

    /// Replace existing files
    #[arg(long)]
    pub(crate) force: bool,
}
