//! The seconds that training takes, whatever else the machine does.

/// What the seconds of [`seconds`] are.
#[cfg(unix)]
pub(super) const NAME: &str = "processor time of the process, one thread at work";
#[cfg(not(unix))]
pub(super) const NAME: &str = "wall clock";

/// Processor time of this process so far, s.
#[cfg(unix)]
pub(super) fn seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Seconds since the first call.
#[cfg(not(unix))]
pub(super) fn seconds() -> f64 {
    use std::sync::OnceLock;
    use std::time::Instant;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}
