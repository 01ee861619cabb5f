//! Tests of the recordings through their public interface, as one program: the library is compiled into it once.

mod archives;
mod bad_files;
mod check;
mod check_forces;
mod check_mistakes;
mod constraints;
mod derivatives;
mod foreign_exports;
mod formats;
