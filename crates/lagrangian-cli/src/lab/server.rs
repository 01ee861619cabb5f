//! The server: one thread for each connection, on the loopback address alone.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use super::Page;
use super::answer::answer;
use crate::interrupt;

/// The longest head of a request, bytes.
const MOST_HEAD: usize = 16 << 10;
/// How long a connection may say nothing.
const PATIENCE: Duration = Duration::from_secs(10);
/// Connections at a time: a browser opens six.
const MOST_CONNECTIONS: usize = 64;
/// How often the server looks whether it is to end.
const TICK: Duration = Duration::from_millis(50);

/// A server that listens.
#[derive(Debug)]
pub(crate) struct Server {
    listener: TcpListener,
    page: Arc<Page>,
    port: u16,
}

impl Server {
    /// Listens on a port that the system chooses.
    ///
    /// # Errors
    /// Those of the operating system.
    pub(crate) fn new(page: Page) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        listener.set_nonblocking(true)?;
        Ok(Self {
            port: listener.local_addr()?.port(),
            page: Arc::new(page),
            listener,
        })
    }

    /// Where the page is.
    pub(crate) fn address(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port)
    }

    /// Serves until Ctrl-C.
    pub(crate) fn run(&self) {
        let open = Arc::new(AtomicUsize::new(0));
        while !interrupt::is_pressed() {
            let Ok((stream, _)) = self.listener.accept() else {
                thread::sleep(TICK);
                continue;
            };
            if open.fetch_add(1, Ordering::Relaxed) >= MOST_CONNECTIONS {
                open.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            let (page, port, counted) = (Arc::clone(&self.page), self.port, Arc::clone(&open));
            let served = thread::Builder::new().spawn(move || {
                // OK because a connection that breaks is the browser's to open again.
                let _ = serve(stream, &page, port);
                counted.fetch_sub(1, Ordering::Relaxed);
            });
            if served.is_err() {
                open.fetch_sub(1, Ordering::Relaxed);
            }
        }
    }
}

fn serve(mut stream: TcpStream, page: &Page, port: u16) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let head = read_head(&mut stream)?;
    let answer = answer(&head, page, port);
    stream.write_all(answer.head.as_bytes())?;
    stream.write_all(answer.body)?;
    stream.flush()
}

/// The head of a request, to the empty line after it.
fn read_head(stream: &mut impl Read) -> io::Result<String> {
    let (mut head, mut chunk) = (Vec::new(), [0; 2048]);
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        let count = stream.read(&mut chunk)?;
        head.extend_from_slice(&chunk[..count]);
        if count == 0 || head.len() > MOST_HEAD {
            return Err(io::ErrorKind::InvalidData.into());
        }
    }
    String::from_utf8(head).map_err(|_| io::ErrorKind::InvalidData.into())
}
