//! A clock that only goes forward, on every target.

#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
pub use std::time::Instant;

#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
pub use page::Instant;

/// The clock of the page that runs the module: the standard library has none there.
#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
mod page {
    #![allow(unsafe_code, reason = "the declaration of a function of the page")]

    use std::time::Duration;

    #[link(wasm_import_module = "page")]
    unsafe extern "C" {
        /// Milliseconds since any moment, never going back: `performance.now`.
        safe fn now() -> f64;
    }

    /// A moment, as `std::time::Instant` is on other targets.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub struct Instant(Duration);

    impl Instant {
        /// This moment.
        #[must_use]
        pub fn now() -> Self {
            Self(Duration::try_from_secs_f64(now() / 1e3).unwrap_or_default())
        }

        /// The time since this moment.
        #[must_use]
        pub fn elapsed(&self) -> Duration {
            Self::now().saturating_duration_since(*self)
        }

        /// The time from an earlier moment to this one; zero where it is not earlier.
        #[must_use]
        pub fn saturating_duration_since(&self, earlier: Self) -> Duration {
            self.0.saturating_sub(earlier.0)
        }
    }
}
