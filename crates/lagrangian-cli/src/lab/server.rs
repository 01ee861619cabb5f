//! The server: one thread for each connection, on the loopback address alone.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use super::Page;
use super::answer::answer;
use crate::interrupt;

/// The longest head of a request, bytes.
const MOST_HEAD: usize = 16 << 10;
/// How long a request may take to come, and how long a part of the answer may take to go.
const PATIENCE: Duration = Duration::from_secs(10);
/// Connections at a time: a browser opens six.
const MOST_CONNECTIONS: usize = 64;
/// How often the server looks whether it is to end, and the rest after a connection that could not be taken.
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
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub(crate) fn run(self) -> io::Result<()> {
        // It waits for connections, and ends with the program.
        thread::Builder::new().spawn(move || self.accept())?;
        while !interrupt::is_pressed() {
            thread::sleep(TICK);
        }
        Ok(())
    }

    fn accept(&self) {
        let open = Arc::new(AtomicUsize::new(0));
        loop {
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
    stream.set_write_timeout(Some(PATIENCE))?;
    let head = read_head(&mut stream, PATIENCE)?;
    let answer = answer(&head, page, port);
    stream.write_all(answer.head.as_bytes())?;
    stream.write_all(answer.body)?;
    stream.flush()
}

/// The head of a request, to the empty line after it, where all of it comes within this time.
fn read_head(stream: &mut TcpStream, patience: Duration) -> io::Result<String> {
    let begun = Instant::now();
    let (mut head, mut chunk) = (Vec::new(), [0; 2048]);
    loop {
        if let Some(end) = head.windows(4).position(|end| end == b"\r\n\r\n") {
            head.truncate(end);
            return String::from_utf8(head).map_err(|_| io::ErrorKind::InvalidData.into());
        }
        // Where no time is left this is an error.
        stream.set_read_timeout(Some(patience.saturating_sub(begun.elapsed())))?;
        let count = stream.read(&mut chunk)?;
        head.extend_from_slice(&chunk[..count]);
        if count == 0 || head.len() > MOST_HEAD {
            return Err(io::ErrorKind::InvalidData.into());
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn a_request_that_comes_a_letter_at_a_time_is_not_waited_for() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let address = listener.local_addr().unwrap();
        let slow = thread::spawn(move || {
            let mut stream = TcpStream::connect(address).unwrap();
            while stream.write_all(b"x").is_ok() {
                thread::sleep(Duration::from_millis(20));
            }
        });
        let (mut stream, _) = listener.accept().unwrap();
        let head = read_head(&mut stream, Duration::from_millis(300));
        // Without an end of its patience it would read to the longest head.
        assert_ne!(head.unwrap_err().kind(), io::ErrorKind::InvalidData);
        drop(stream);
        slow.join().unwrap();
    }
}
