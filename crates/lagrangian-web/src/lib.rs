//! The library for a page in a browser: converts requests in JSON, optionally with the bytes of a file, to answers in JSON.
//!
//! The page runs this crate as WebAssembly in a worker (`exports`), and tests run it natively: everything below
//! [`Session::answer`] is shared. A request that cannot be served is an [`Error`] whose message ends with the remedy; no
//! content of a page or a file can cause a panic, and every size is bounded by [`limits`] before memory is allocated.
//!
//! ```
//! use lagrangian_web::{Message, Session};
//!
//! let mut session = Session::default();
//! let asked = r#"{"ask": "simulate", "by": {"system": "pendulum"}, "q0": [1.0], "qd0": [0.0], "duration": 2.0}"#;
//! let answer = session.answer(&Message::text(asked))?;
//! assert!(answer.text.contains(r#""energy":["#));
//! # Ok::<(), lagrangian_web::Error>(())
//! ```

#![forbid(unsafe_op_in_unsafe_fn)]

mod error;
mod experiment;
pub mod exports;
mod fitting;
pub mod limits;
mod motion;
mod recordings;
mod request;
mod run;
mod session;
mod speed;
mod system;

pub use error::{Error, Result};
pub use exports::reply;
pub use session::{Message, Session};
