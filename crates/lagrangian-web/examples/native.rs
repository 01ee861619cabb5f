//! Speed of the library outside of a browser. Runs requests of the page natively, one JSON object a line on standard input.
//!
//! `echo '{"ask":"speed"}' | RAYON_NUM_THREADS=1 cargo run --release -p lagrangian-web --example native [avx2]`

use std::io::{BufRead, Write};

use lagrangian_web::{Message, Session};
use nets::simd::{Level, set_level};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    if let Some(name) = std::env::args().nth(1) {
        set_level(Level::from_name(&name)?)?;
    }
    let (mut session, mut out) = (Session::default(), std::io::stdout());
    for line in std::io::stdin().lock().lines() {
        match session.answer(&Message::text(&line?)) {
            Ok(answer) => writeln!(out, "{}", answer.text)?,
            Err(error) => writeln!(out, "error: {error}")?,
        }
    }
    Ok(())
}
