//! `cargo run --release -p experiments -- NAME`: one comparison, its figures and its page.

fn main() -> std::process::ExitCode {
    experiments::main()
}
