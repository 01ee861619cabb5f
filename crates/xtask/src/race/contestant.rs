//! A program that takes part: a process that is asked by lines of JSON and answers by lines of JSON.

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Where the programs are.
pub(super) struct Programs {
    /// The bench `race` of the library.
    pub(super) ours: PathBuf,
    /// The Python of the peers; `None` where there is none.
    pub(super) python: Option<PathBuf>,
    /// Whether that Python has torch.
    pub(super) torch: bool,
    /// The folder of the peers.
    pub(super) peers: PathBuf,
}

/// Which program it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Program {
    Ours,
    Jax,
    Torch,
}

impl Programs {
    /// Whether this one can take part.
    pub(super) fn has(&self, program: Program) -> bool {
        match program {
            Program::Ours => true,
            Program::Jax => self.python.is_some(),
            Program::Torch => self.python.is_some() && self.torch,
        }
    }

    fn command(&self, program: Program) -> Vec<String> {
        let show = |path: &PathBuf| path.display().to_string();
        let script = |name: &str| {
            let python = self.python.as_ref().map_or("python3".into(), show);
            vec![python, show(&self.peers.join(name))]
        };
        match program {
            Program::Ours => vec![show(&self.ours), "--race".into()],
            Program::Jax => script("jax_peer.py"),
            Program::Torch => script("torch_peer.py"),
        }
    }
}

/// How long a core is left alone before a lap: JAX's threads go on looking for work for some 15 ms after they have answered, on
/// the core of whoever is next. Several threads wake up on one core after it, and spread in a lap that does not count.
const REST: Duration = Duration::from_millis(50);

/// One running process.
pub(super) struct Contestant {
    name: String,
    threads: usize,
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    /// When it was started.
    pub(super) started: Instant,
}

/// What a contestant says when it has a task ready.
pub(super) struct Ready {
    pub(super) compile_ms: f64,
    /// What its first iterations gave.
    pub(super) check: Vec<f64>,
}

impl Contestant {
    /// Starts `program` on so many cores, and with as many threads.
    pub(super) fn start(
        programs: &Programs,
        program: Program,
        name: &str,
        threads: usize,
    ) -> Result<Self, String> {
        let line = [pin(threads), programs.command(program)].concat();
        let count = threads.to_string();
        let started = Instant::now();
        let mut child = Command::new(&line[0])
            .args(&line[1..])
            .env("RAYON_NUM_THREADS", &count)
            .env("OMP_NUM_THREADS", &count)
            .env("MKL_NUM_THREADS", &count)
            .env("JAX_PLATFORMS", "cpu")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| format!("{name} did not start: {e}: {}", line.join(" ")))?;
        let (Some(to), Some(from)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(format!("{name} has no standard input and output"));
        };
        Ok(Self {
            name: name.into(),
            threads,
            child,
            to,
            from: BufReader::new(from),
            started,
        })
    }

    /// Gives it a task and waits until that is ready.
    pub(super) fn prepare(&mut self, task: &Value) -> Result<Ready, String> {
        let reply = self.ask(&json!({ "task": task }))?;
        let ready = &reply["ready"];
        let check = ready["check"].as_array();
        let check = check.ok_or_else(|| self.said(&reply))?;
        Ok(Ready {
            compile_ms: ready["compile_ms"].as_f64().unwrap_or(0.0),
            check: check
                .iter()
                .map(|x| x.as_f64().unwrap_or(f64::NAN))
                .collect(),
        })
    }

    /// The mean time of one of so many iterations, ms, once the others have come to rest.
    pub(super) fn laps(&mut self, count: usize) -> Result<f64, String> {
        std::thread::sleep(REST);
        self.time(count)
    }

    /// The same where several threads have spread over their cores in a lap that does not count.
    pub(super) fn laps_in_motion(&mut self, count: usize) -> Result<f64, String> {
        std::thread::sleep(REST);
        if self.threads > 1 {
            self.time(count)?;
        }
        self.time(count)
    }

    /// The same at once: a whole fit, short beside the time that threads need to spread after a rest.
    pub(super) fn time(&mut self, count: usize) -> Result<f64, String> {
        let reply = self.ask(&json!({ "laps": count }))?;
        reply["ms"].as_f64().ok_or_else(|| self.said(&reply))
    }

    /// The task is over.
    pub(super) fn end(&mut self) -> Result<(), String> {
        self.say(&json!("end"))
    }

    /// The most memory that it has had so far, MiB.
    pub(super) fn peak_mib(&self) -> Option<f64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
        line.split_whitespace()
            .nth(1)?
            .parse()
            .ok()
            .map(|kib: f64| kib / 1024.0)
    }

    fn say(&mut self, request: &Value) -> Result<(), String> {
        writeln!(self.to, "{request}")
            .and_then(|()| self.to.flush())
            .map_err(|e| format!("{} does not listen: {e}", self.name))
    }

    fn ask(&mut self, request: &Value) -> Result<Value, String> {
        self.say(request)?;
        let mut line = String::new();
        let count = self.from.read_line(&mut line);
        if !matches!(count, Ok(1..)) {
            return Err(format!(
                "{} ended without an answer to {request}",
                self.name
            ));
        }
        serde_json::from_str(&line)
            .map_err(|e| format!("{} said '{}': {e}", self.name, line.trim()))
    }

    fn said(&self, reply: &Value) -> String {
        match reply["error"].as_str() {
            Some(message) => format!("{}: {message}", self.name),
            None => format!(
                "{} said {reply}, which is no answer to the question",
                self.name
            ),
        }
    }
}

impl Drop for Contestant {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The beginning of a command line that keeps a process on the first cores; empty where that is not possible.
fn pin(threads: usize) -> Vec<String> {
    let cores = cores();
    let works = || {
        Command::new("taskset")
            .arg("-V")
            .output()
            .is_ok_and(|o| o.status.success())
    };
    if cores.len() <= threads || !works() {
        return Vec::new();
    }
    let list: Vec<String> = cores[..threads].iter().map(usize::to_string).collect();
    vec!["taskset".into(), "-c".into(), list.join(",")]
}

/// The cores that this process may run on.
pub(super) fn cores() -> Vec<usize> {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let list = status
        .lines()
        .find_map(|l| l.strip_prefix("Cpus_allowed_list:"));
    let ranges = list
        .unwrap_or_default()
        .trim()
        .split(',')
        .filter_map(|range| {
            let (first, last) = range.split_once('-').unwrap_or((range, range));
            Some(first.parse::<usize>().ok()?..=last.parse::<usize>().ok()?)
        });
    ranges.flatten().collect()
}
