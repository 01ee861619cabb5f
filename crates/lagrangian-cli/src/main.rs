//! The command line of `lagrangian`.

#[allow(
    dead_code,
    unused_imports,
    reason = "the commands that call it come with them"
)]
mod draw;

fn main() {}
