//! The laboratory as a browser sees it, and as a page that means harm does.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use super::workbench::Workbench;

/// A laboratory that is served, until it is dropped.
struct Lab {
    child: Child,
    port: u16,
}

impl Drop for Lab {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Lab {
    /// Serves a page of three files; beside its folder is one that is nobody's business.
    fn new(bench: &Workbench) -> Self {
        Self::serve(bench, |command| {
            command.args(["lab", "--folder", "page", "--no-open"]);
        })
    }

    /// The same, by these arguments.
    fn serve(bench: &Workbench, set: impl FnOnce(&mut Command)) -> Self {
        std::fs::create_dir_all(bench.path("page/assets")).unwrap();
        bench.write("page/index.html", "<title>laboratory</title>");
        bench.write("page/report.html", "<title>report</title>");
        bench.write("page/assets/library.wasm", "\0asm");
        bench.write("page/.secret.txt", "secret");
        bench.write("secret.txt", "secret");
        let mut command = bench.command("");
        set(&mut command);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        out.read_line(&mut line).unwrap();
        let address = line.split("http://127.0.0.1:").nth(1).unwrap();
        let port = address.split('/').next().unwrap().parse().unwrap();
        Self { child, port }
    }

    /// The answer to a request as it goes over the wire.
    fn ask(&self, request: &str) -> String {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(30)))
            .unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn get(&self, path: &str) -> String {
        self.ask(&format!(
            "GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n",
            self.port
        ))
    }
}

#[test]
fn the_laboratory_serves_its_page_with_a_policy_and_the_types_that_browsers_need() {
    let bench = Workbench::new();
    let lab = Lab::new(&bench);
    let page = lab.get("/");
    assert!(page.starts_with("HTTP/1.1 200") && page.ends_with("<title>laboratory</title>"));
    assert!(page.contains("script-src 'self' 'wasm-unsafe-eval'") && page.contains("nosniff"));
    let report = lab.get("/report.html");
    assert!(report.contains("frame-ancestors 'self'") && !report.contains("script-src"));
    let library = lab.get("/assets/library.wasm?v=1");
    assert!(library.contains("Content-Type: application/wasm") && library.ends_with("\0asm"));
}

#[test]
fn nothing_beside_the_page_is_served() {
    let bench = Workbench::new();
    let lab = Lab::new(&bench);
    for path in [
        "/../secret.txt",
        "/.secret.txt",
        "/assets/../../secret.txt",
        "/%2e%2e/secret.txt",
        "//secret.txt",
        "/..%2fsecret.txt",
        "secret.txt",
        "/\\..\\secret.txt",
        "*",
    ] {
        let answer = lab.get(path);
        assert!(answer.starts_with("HTTP/1.1 404"), "{path}: {answer}");
        assert!(!answer.contains("secret\n") && answer.ends_with("\r\n\r\n"));
    }
}

#[test]
fn a_page_of_the_web_whose_name_points_here_gets_nothing() {
    let bench = Workbench::new();
    let lab = Lab::new(&bench);
    for host in ["evil.example", "127.0.0.1", "127.0.0.1:1", ""] {
        let answer = lab.ask(&format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n"));
        assert!(answer.starts_with("HTTP/1.1 403"), "{host}: {answer}");
    }
    // Its own name beside the right one, or the right one where no head is any more.
    let own = format!("Host: localhost:{}\r\n", lab.port);
    for other in [format!("{own}\r\n"), format!("\r\n{own}\r\n")] {
        let answer = lab.ask(&format!("GET / HTTP/1.1\r\nHost: evil.example\r\n{other}"));
        assert!(answer.starts_with("HTTP/1.1 403"), "{other}: {answer}");
    }
    let posted = lab.ask(&format!("POST / HTTP/1.1\r\n{own}\r\n"));
    assert!(posted.starts_with("HTTP/1.1 405"));
    // What is no request gets no answer, and the next one is served.
    assert_eq!(lab.ask(&"x".repeat(40_000)), "");
    assert!(lab.get("/").starts_with("HTTP/1.1 200"));
}

/// Ctrl-C goes to all processes of a group, and is meant for the laboratory alone.
#[cfg(target_os = "linux")]
#[test]
fn the_browser_is_opened_in_a_process_group_of_its_own() {
    use std::os::unix::fs::PermissionsExt;

    let bench = Workbench::new();
    bench.write(
        "xdg-open",
        "#!/bin/sh\ncut -d' ' -f5 /proc/$$/stat > group\nmv group opened\n",
    );
    let executable = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(bench.path("xdg-open"), executable).unwrap();
    let path = std::env::var("PATH").unwrap();
    let lab = Lab::serve(&bench, |command| {
        command.args(["lab", "--folder", "page"]);
        command.env("PATH", format!("{}:{path}", bench.path("").display()));
    });
    let opened = || bench.path("opened").is_file();
    (0..6000)
        .take_while(|_| !opened())
        .for_each(|_| std::thread::sleep(Duration::from_millis(10)));
    let opened = String::from_utf8(bench.read("opened")).unwrap();
    let own = std::fs::read_to_string(format!("/proc/{}/stat", lab.child.id())).unwrap();
    assert_ne!(Some(opened.trim()), own.split(' ').nth(4));
}

#[test]
fn a_folder_without_a_page_is_refused_with_how_to_build_one() {
    let bench = Workbench::new();
    std::fs::create_dir(bench.path("empty")).unwrap();
    let outcome = bench.run("lab --no-open --folder empty");
    assert_eq!(outcome.code, 2);
    assert!(outcome.stderr.contains("holds no index.html"));
    assert!(outcome.stderr.contains("cargo xtask web"));
    // A page and much beside it: each file is small enough, all of them are not.
    for name in ["index.html", "a.wasm", "b.wasm"] {
        let file = std::fs::File::create(bench.path(&format!("empty/{name}"))).unwrap();
        file.set_len(30 << 20).unwrap();
    }
    let message = bench.refuse("lab --no-open --folder empty");
    assert!(message.contains("more than a page"), "{message}");
    let message = bench.refuse("lab --no-open --folder absent");
    assert!(
        message.contains("hint: ") && message.contains("--folder web/dist"),
        "{message}"
    );
}
