#[allow(dead_code, reason = "the commands that call it come with them")]
mod draw;

fn main() {}
