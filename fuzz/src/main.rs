//! Changes the files of a corpus at random, and gives them to a target: `cargo xtask fuzz` runs it for all of them.
//!
//! An input is kept for further changes where it is refused with words that were not met before. A panic, an execution above
//! [`LONGEST`] or [`MOST_MEMORY`] and the death of the process are faults: the input is saved, with the command that repeats it.

mod memory;
mod options;

use std::collections::HashSet;
use std::fs;
use std::io::{self, Seek, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use fuzz::{Outcome, Target, mutate};
use options::{Limit, Options};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// An execution that takes longer is a fault, also when it is repeated: another program may have been in the way.
const LONGEST: Duration = Duration::from_secs(2);
/// An execution that takes longer is not waited for.
const PATIENCE: Duration = Duration::from_secs(30);
/// An execution that takes more memory is a fault, bytes.
const MOST_MEMORY: usize = 512 << 20;
/// Inputs that are kept beside the corpus.
const MOST_KEPT: usize = 4096;
/// Stack of a thread of Rust that nobody asked for another one.
const STACK: usize = 2 << 20;

/// The last panic: where, and what it says.
static PANIC: Mutex<String> = Mutex::new(String::new());

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match Options::read(&words).and_then(|options| run(&options)) {
        Ok(summary) => {
            println!("{summary}");
            ExitCode::SUCCESS
        }
        Err(fault) => {
            eprintln!("fuzz: {fault}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the target on a thread of its own, which is watched.
fn run(options: &Options) -> Result<String, String> {
    std::panic::set_hook(Box::new(|panic| {
        *PANIC.lock().unwrap_or_else(|e| e.into_inner()) = panic.to_string();
    }));
    let (alive, beats) = mpsc::channel();
    let current = Current::open(options)?;
    let path = current.path.clone();
    let options = options.clone();
    rayon::broadcast(|_| take_workspace());
    let worker = thread::Builder::new().stack_size(STACK).spawn(move || {
        take_workspace();
        match &options.repeat {
            Some(file) => repeat(&options, file, current),
            None => Fuzzer::new(&options, current)?.run(&options, &alive),
        }
    });
    let worker = worker.map_err(|e| format!("no thread: {e}"))?;
    loop {
        match beats.recv_timeout(PATIENCE) {
            Ok(()) => {}
            Err(RecvTimeoutError::Timeout) if !worker.is_finished() => {
                let path = path.display();
                return Err(format!("no end after {} s: {path}", PATIENCE.as_secs()));
            }
            Err(_) => break,
        }
    }
    worker
        .join()
        .map_err(|_| "the driver itself panicked".to_string())?
}

/// Products of matrices keep a workspace for each thread, twice the processor's last cache, of which they touch what they
/// need: hundreds of megabytes that no input has asked for.
fn take_workspace() {
    let ones = faer::Mat::<f64>::ones(64, 64);
    let mut product = ones.clone();
    let (replace, sequential) = (faer::Accum::Replace, faer::Par::Seq);
    faer::linalg::matmul::matmul(&mut product, replace, &ones, &ones, 1.0, sequential);
}

/// Executes one file, and says what came of it.
fn repeat(options: &Options, file: &Path, mut current: Current) -> Result<String, String> {
    let bytes = fs::read(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let start = Instant::now();
    let outcome = execute(options.target, &bytes, &mut current)?;
    let outcome = outcome.map_or_else(|why| format!("refused: {why}"), |()| "accepted".into());
    Ok(format!("{outcome} ({:?})", start.elapsed()))
}

/// The input under execution, in a file that outlives the process.
struct Current {
    path: PathBuf,
    file: fs::File,
}

impl Current {
    fn open(options: &Options) -> Result<Self, String> {
        let (folder, name) = (&options.faults, options.target.name);
        let path = folder.join(format!("{name}-{}", std::process::id()));
        let file = fs::create_dir_all(folder).and_then(|()| fs::File::create(&path));
        let file = file.map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(Self { path, file })
    }

    fn hold(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.rewind()?;
        self.file.write_all(bytes)?;
        self.file.set_len(bytes.len() as u64)
    }

    /// No fault was found.
    fn close(self) {
        // OK to ignore: an old input is no harm.
        let _ = fs::remove_file(self.path);
    }
}

/// Executes one input; what is at fault, with the file that holds it.
fn execute(target: Target, bytes: &[u8], current: &mut Current) -> Result<Outcome, String> {
    current
        .hold(bytes)
        .map_err(|e| format!("{}: {e}", current.path.display()))?;
    let fault = |what: String| Err(format!("{what}\n  input: {}", current.path.display()));
    let mut quickest = Duration::MAX;
    let mut outcome = Ok(());
    for attempt in 0..3 {
        let (before, start) = (memory::reset(), Instant::now());
        // Reading it costs more than most executions.
        let busy = (attempt > 0).then(processor_time);
        outcome = match catch_unwind(AssertUnwindSafe(|| (target.run)(bytes))) {
            Ok(outcome) => outcome,
            Err(_) => {
                let said = PANIC.lock().unwrap_or_else(|e| e.into_inner());
                return fault(said.clone());
            }
        };
        let elapsed = start.elapsed();
        let worked = busy.map(|busy| processor_time().saturating_sub(busy));
        // Where the system does not tell, none is counted.
        let worked = worked.filter(|worked| !worked.is_zero());
        quickest = quickest.min(worked.map_or(elapsed, |worked| worked.min(elapsed)));
        let taken = memory::most().saturating_sub(before);
        if taken > MOST_MEMORY {
            return fault(format!("an execution took {} MB", taken >> 20));
        }
        if quickest < LONGEST {
            break;
        }
    }
    match quickest < LONGEST {
        true => Ok(outcome),
        false => fault(format!("an execution took {quickest:?}")),
    }
}

/// The time that the processors have worked for this process, which a busy machine does not stretch; 0 where the
/// system does not tell.
fn processor_time() -> Duration {
    let about = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = about.rsplit(") ").next().unwrap_or_default();
    let ticks = after_name.split(' ').skip(11).take(2);
    let ticks: u64 = ticks.filter_map(|ticks| ticks.parse::<u64>().ok()).sum();
    Duration::from_millis(10 * ticks)
}

/// What is known of a run.
struct Fuzzer {
    target: Target,
    current: Current,
    inputs: Vec<Vec<u8>>,
    met: HashSet<String>,
    executions: u64,
    accepted: u64,
}

impl Fuzzer {
    fn new(options: &Options, current: Current) -> Result<Self, String> {
        let folder = options.corpus.join(options.target.name);
        let files = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let mut paths: Vec<PathBuf> = files.filter_map(|file| Some(file.ok()?.path())).collect();
        paths.sort();
        let inputs = paths.iter().map(fs::read).collect::<io::Result<Vec<_>>>();
        let inputs = inputs.map_err(|e| format!("{}: {e}", folder.display()))?;
        match inputs.is_empty() {
            true => Err(format!("{} holds no file", folder.display())),
            false => Ok(Self {
                target: options.target,
                current,
                inputs,
                met: HashSet::new(),
                executions: 0,
                accepted: 0,
            }),
        }
    }

    fn run(mut self, options: &Options, alive: &mpsc::Sender<()>) -> Result<String, String> {
        let (start, mut beat) = (Instant::now(), Instant::now());
        for input in self.inputs.clone() {
            self.meet(input)?;
        }
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        let goes_on = |fuzzer: &Self| match options.limit {
            Limit::Seconds(seconds) => start.elapsed().as_secs_f64() < seconds,
            Limit::Executions(executions) => fuzzer.executions < executions,
        };
        while goes_on(&self) {
            let input = mutate::mutant(&mut rng, &self.inputs, self.target.text);
            self.meet(input)?;
            if beat.elapsed() > Duration::from_secs(1) {
                beat = Instant::now();
                // OK to ignore: nobody listens once the program ends.
                let _ = alive.send(());
            }
        }
        let (name, all, accepted) = (self.target.name, self.executions, self.accepted);
        let (refusals, seconds) = (self.met.len(), start.elapsed().as_secs_f64());
        self.current.close();
        Ok(format!(
            "{name}: {all} executions in {seconds:.0} s, {accepted} accepted, {refusals} kinds of refusals, no fault"
        ))
    }

    /// Executes an input, and keeps it where its refusal is a new one.
    fn meet(&mut self, input: Vec<u8>) -> Result<(), String> {
        self.executions += 1;
        match execute(self.target, &input, &mut self.current)? {
            Ok(()) => self.accepted += 1,
            Err(why) => {
                if self.met.len() < MOST_KEPT && self.met.insert(kind(&why)) {
                    self.inputs.push(input);
                }
            }
        }
        Ok(())
    }
}

/// A refusal without what differs from one file to the next: numbers, and what is quoted.
fn kind(refusal: &str) -> String {
    let outside = refusal.split(['\'', '"', '`']).step_by(2);
    let letters = outside.flat_map(str::chars).filter(|c| c.is_alphabetic());
    // What comes later may be a list of what was read.
    letters.take(50).collect()
}
