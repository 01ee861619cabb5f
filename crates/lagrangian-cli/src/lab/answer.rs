//! Requests of a browser, and their answers: as much of HTTP/1.1 as a page of static files needs.

use super::Page;

/// What the page may do: run its own scripts and WebAssembly, and talk to nobody.
const POLICY: &str = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data:; \
    connect-src 'self'; worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; object-src 'none'";

/// What the page around a report may do stands in its file; only the laboratory shows it.
const AROUND_REPORTS: (&str, &str) = ("report.html", "frame-ancestors 'self'");

/// An answer.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Answer<'p> {
    /// The head, with the empty line after it.
    pub(super) head: String,
    /// The body.
    pub(super) body: &'p [u8],
}

/// The answer to the head of a request that came to `port`.
pub(super) fn answer<'p>(head: &str, page: &'p Page, port: u16) -> Answer<'p> {
    let mut lines = head.lines();
    let mut words = lines.next().unwrap_or_default().split(' ');
    let (method, target) = (
        words.next().unwrap_or_default(),
        words.next().unwrap_or_default(),
    );
    let mut hosts = lines.filter_map(host);
    let only = hosts.next().filter(|_| hosts.next().is_none());
    if !only.is_some_and(|host| is_this_machine(host, port)) {
        // A page of the web whose name was made to point here.
        return refusal("403 Forbidden");
    }
    if !matches!(method, "GET" | "HEAD") {
        return refusal("405 Method Not Allowed");
    }
    let path = target.split(['?', '#']).next().unwrap_or_default();
    let found = path
        .strip_prefix('/')
        .and_then(|name| Some((name, page.file(name)?)));
    let Some((name, body)) = found else {
        return refusal("404 Not Found");
    };
    let policy = match name == AROUND_REPORTS.0 {
        true => AROUND_REPORTS.1,
        false => POLICY,
    };
    let head = written("200 OK", media_type(name), policy, body.len());
    let body = if method == "HEAD" { &[] } else { body };
    Answer { head, body }
}

/// The host that a line of a head names.
fn host(line: &str) -> Option<&str> {
    let (name, value) = line.split_once(':')?;
    name.eq_ignore_ascii_case("host").then(|| value.trim())
}

fn is_this_machine(host: &str, port: u16) -> bool {
    ["127.0.0.1", "localhost"]
        .iter()
        .any(|own| host.eq_ignore_ascii_case(&format!("{own}:{port}")))
}

fn refusal<'p>(status: &str) -> Answer<'p> {
    Answer {
        head: written(status, "text/plain; charset=utf-8", POLICY, 0),
        body: &[],
    }
}

fn written(status: &str, media_type: &str, policy: &str, length: usize) -> String {
    format!(
        "HTTP/1.1 {status}\r\nContent-Type: {media_type}\r\nContent-Length: {length}\r\n\
         Content-Security-Policy: {policy}\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nCache-Control: no-cache\r\nConnection: close\r\n\r\n"
    )
}

/// The media type of a file; WebAssembly is compiled while it comes only with its own.
fn media_type(name: &str) -> &'static str {
    match name
        .rsplit_once('.')
        .map_or("html", |(_, extension)| extension)
    {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "svg" => "image/svg+xml",
        "wasm" => "application/wasm",
        "json" => "application/json",
        "webmanifest" => "application/manifest+json",
        "png" => "image/png",
        _ => "application/octet-stream",
    }
}
