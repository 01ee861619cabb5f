//! The laboratory in the browser, served from this binary.
//!
//! Only this machine can reach it: the server listens on the loopback address, on a port that the system chooses, and answers only
//! requests that name it (docs/adr/0108). What it serves is a table that is made before the first request, so that no path of a
//! request is ever a path of the disk.

mod answer;
mod page;
mod server;

pub(crate) use page::Page;
pub(crate) use server::Server;
