//! `lagrangian lab`: the laboratory in the browser.

use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result};
use serde_json::json;

use super::OutputMode;
use crate::cli::LabArgs;
use crate::interrupt;
use crate::lab::{Page, Server};
use crate::output;

pub(super) fn run(args: &LabArgs, mode: OutputMode) -> Result<ExitCode> {
    let page = Page::new(args.folder.as_deref())?;
    let server = Server::new(page).context("cannot listen on this machine")?;
    interrupt::listen()?;
    let address = server.address();
    mode.print(&json!({ "command": "lab", "address": address }), || {
        format!("the laboratory is at {address} (Ctrl-C ends it; only this machine can reach it)\n")
    })?;
    if !args.no_open && !opened(&address) && !mode.json {
        output::print("no browser could be opened: open that address in one\n")?;
    }
    server.run().context("cannot serve the page")?;
    Ok(ExitCode::SUCCESS)
}

/// Opens the address in the browser of this person, where there is one.
fn opened(address: &str) -> bool {
    let (program, before): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("cmd", &["/C", "start", ""])
    } else {
        ("xdg-open", &[])
    };
    let mut command = Command::new(program);
    command.args(before).arg(address);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    // In a process group of its own, so that Ctrl-C ends the laboratory and not the browser.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn().is_ok()
}
