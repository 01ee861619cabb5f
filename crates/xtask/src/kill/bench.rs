//! A folder with recordings, and processes that are started, ended and looked after in it.

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::Failure;

/// The recordings.
const RECORDINGS: [&str; 2] = [
    "simulate pendulum --trajectories 4 --duration 4 --step 0.02 --seed 1 --out free.csv",
    "simulate two-link-arm --drive 3 --friction 0.3 --trajectories 4 --duration 2 --step 0.02 --seed 5 --out forced.csv",
];

/// Looks at a process this often.
const LOOK: Duration = Duration::from_millis(2);

/// How a process is ended.
#[derive(Debug, Clone, Copy)]
pub(super) enum End {
    /// At once (SIGKILL).
    Kill,
    /// By Ctrl-C (SIGINT), and waited for so long.
    Interrupt(Duration),
}

/// The folder and the command.
pub(super) struct Bench {
    folder: PathBuf,
    command: PathBuf,
    /// Steps of the generator of moments: Knuth's MMIX.
    state: u64,
}

impl Drop for Bench {
    fn drop(&mut self) {
        // OK to ignore: what stays is in the folder for temporary files.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

impl Bench {
    pub(super) fn new(release: bool) -> Result<Self, Failure> {
        let profile = if release { "release" } else { "debug" };
        let root = crate::root();
        let target =
            std::env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), PathBuf::from);
        let command = target.join(profile).join("lagrangian");
        let bench = Self {
            folder: std::env::temp_dir().join(format!("lagrangian-kill-{}", std::process::id())),
            command: fs::canonicalize(&command)
                .map_err(|e| format!("{}: {e}", command.display()))?,
            state: 1,
        };
        fs::create_dir_all(&bench.folder).map_err(|e| e.to_string())?;
        RECORDINGS.iter().try_for_each(|line| bench.succeed(line))?;
        bench.derive_positions()?;
        Ok(bench)
    }

    /// Positions alone, from the recording of all signals.
    fn derive_positions(&self) -> Result<(), String> {
        let text = fs::read_to_string(self.folder.join("free.csv")).map_err(|e| e.to_string())?;
        let cells = |line: &str| line.split(',').take(3).collect::<Vec<_>>().join(",") + "\n";
        let text: String = text.lines().map(cells).collect();
        fs::write(self.folder.join("positions.csv"), text).map_err(|e| e.to_string())
    }

    fn prepare(&self, line: &str) -> Command {
        let mut command = Command::new(&self.command);
        command
            .current_dir(&self.folder)
            .args(line.split_whitespace());
        command
    }

    /// Starts a process that says nothing.
    pub(super) fn spawn(&self, line: &str) -> Result<Child, String> {
        let mut command = self.prepare(line);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
            .spawn()
            .map_err(|e| format!("`{line}` did not start: {e}"))
    }

    /// Runs a process; its exit code (−1 for a signal) and what it said.
    pub(super) fn run(&self, line: &str) -> Result<(i32, String), String> {
        outcome(&mut self.prepare(line), line)
    }

    /// [`Self::run`] where no file can become longer than so many blocks of 512 bytes.
    pub(super) fn run_in_room(&self, line: &str, blocks: u32) -> Result<(i32, String), String> {
        // Without the signal, which would end it, a write fails as on a full disk.
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" {line}");
        let mut shell = Command::new("sh");
        shell
            .current_dir(&self.folder)
            .arg("-c")
            .arg(script)
            .arg(&self.command);
        outcome(&mut shell, line)
    }

    pub(super) fn succeed(&self, line: &str) -> Result<(), String> {
        match self.run(line)? {
            // 1 is the verdict on a model of few steps.
            (0 | 1, message) if !message.contains("error:") || line.starts_with("fit") => Ok(()),
            (code, message) => Err(format!("`{line}` ended with {code}: {message}")),
        }
    }

    /// Starts a process, waits and ends it; its exit code, or none where it was killed or did not listen.
    pub(super) fn end_after(
        &self,
        line: &str,
        wait: Duration,
        how: End,
    ) -> Result<Option<i32>, String> {
        let (mut child, start) = (self.spawn(line)?, Instant::now());
        while start.elapsed() < wait {
            if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
                return Ok(Some(status.code().unwrap_or(-1)));
            }
            sleep(LOOK);
        }
        if let End::Interrupt(patience) = how {
            let pid = child.id().to_string();
            let _ = Command::new("kill").args(["-INT", &pid]).status();
            let asked = Instant::now();
            while asked.elapsed() < patience {
                if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
                    return Ok(Some(status.code().unwrap_or(-1)));
                }
                sleep(LOOK);
            }
        }
        child
            .kill()
            .and_then(|()| child.wait())
            .map_err(|e| e.to_string())?;
        Ok(None)
    }

    /// Steps of a fit of a kind that take about so many seconds.
    pub(super) fn steps(&self, kind: &str, seconds: f64) -> Result<usize, Failure> {
        self.remove("timed");
        self.succeed(&format!(
            "fit {kind} --seconds {seconds} --quiet --out timed"
        ))?;
        let text = fs::read_to_string(self.folder.join("timed/metrics.jsonl"));
        let text = text.map_err(|e| format!("`{kind}` left no metrics: {e}"))?;
        let last: Option<serde_json::Value> = text
            .lines()
            .last()
            .and_then(|line| serde_json::from_str(line).ok());
        let step = last.and_then(|line| line["step"].as_u64());
        Ok(step.map_or(20, |step| step.max(20) as usize))
    }

    /// A random time below so many seconds.
    pub(super) fn moment(&mut self, seconds: f64) -> Duration {
        self.state = self
            .state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        Duration::from_secs_f64(seconds * (self.state >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// The time after which a fit surely reads its data.
    pub(super) fn begun(&self) -> Duration {
        Duration::from_millis(300)
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.folder.join(name).is_file()
    }

    pub(super) fn remove(&self, name: &str) {
        // OK to ignore: it may not be there.
        let _ = fs::remove_dir_all(self.folder.join(name));
    }

    /// Waits until a file is there, or for ten seconds.
    pub(super) fn wait_for(&self, name: &str) {
        let start = Instant::now();
        while !self.has(name) && start.elapsed() < Duration::from_secs(10) {
            sleep(LOOK);
        }
    }

    pub(super) fn ends_with(&self, name: &str, end: &str) -> bool {
        let text = fs::read_to_string(self.folder.join(name)).unwrap_or_default();
        text.trim_end().ends_with(end)
    }

    /// The model of a run can be read, if there is one.
    pub(super) fn check_model(&self, run: &str) -> Result<(), Failure> {
        let model = format!("{run}/model.safetensors");
        if !self.has(&model) {
            return Ok(());
        }
        let line = format!("rollout {model} --q0 0.1 --qd0 0 --duration 0.01 --json");
        match self.run(&line)? {
            (0, _) => Ok(()),
            // Another number of coordinates, or no motion: it was read.
            (2, message) if !message.contains("cannot read the model") => Ok(()),
            (code, message) => Err(Failure::Work(format!(
                "`{line}` ended with {code}: {message}"
            ))),
        }
    }

    /// The weights of the model of a run: its file after the header.
    pub(super) fn weights(&self, run: &str) -> Result<Vec<u8>, Failure> {
        let path = self.folder.join(run).join("model.safetensors");
        let bytes = fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let header = bytes
            .first_chunk()
            .map_or(0, |length| u64::from_le_bytes(*length));
        let weights = bytes.get(8 + header as usize..).unwrap_or_default();
        Ok(weights.to_vec())
    }
}

fn outcome(command: &mut Command, line: &str) -> Result<(i32, String), String> {
    let output = command
        .output()
        .map_err(|e| format!("`{line}` did not start: {e}"))?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    Ok((output.status.code().unwrap_or(-1), message))
}
