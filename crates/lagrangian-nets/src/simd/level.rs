//! The instruction set of the kernels: the fastest of this CPU, or the one that the program sets when it starts.
//!
//! The choice is the only state that the crate keeps for the whole process; it changes results only by rounding
//! (ADR 0051).

use std::fmt;
use std::sync::atomic::{AtomicU8, Ordering};

use crate::{Error, Result};

/// An instruction set that the kernels are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Portable code without particular instructions; not needed by a module of WebAssembly with vectors.
    #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
    Portable,
    /// AVX2 and FMA (x86-64-v3).
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 F and DQ.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// NEON, which is part of AArch64.
    #[cfg(target_arch = "aarch64")]
    Neon,
    /// Vectors of WebAssembly; a module compiled with them requires them.
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    Simd128,
}

/// All levels of this architecture, the fastest first.
const ALL: &[Level] = &[
    #[cfg(target_arch = "x86_64")]
    Level::Avx512,
    #[cfg(target_arch = "x86_64")]
    Level::Avx2,
    #[cfg(target_arch = "aarch64")]
    Level::Neon,
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    Level::Simd128,
    #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
    Level::Portable,
];

/// Index in [`ALL`] of the level in use, plus one; 0 before the first kernel runs.
static CHOSEN: AtomicU8 = AtomicU8::new(0);

impl Level {
    /// Name of the level in settings and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
            Self::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => "avx512",
            #[cfg(target_arch = "aarch64")]
            Self::Neon => "neon",
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => "simd128",
        }
    }

    /// Level of this name, if this CPU has it.
    ///
    /// # Errors
    /// [`Error::UnknownLevel`] for an unknown name or a level that the CPU lacks, with the names of those that it has.
    pub fn from_name(name: &str) -> Result<Self> {
        let own = levels().into_iter().find(|level| level.name() == name);
        own.ok_or_else(|| missing(name))
    }

    /// Whether this CPU has the instructions of the level.
    fn is_there(self) -> bool {
        match self {
            #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_there()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
            }
            #[cfg(target_arch = "aarch64")]
            Self::Neon => true,
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => true,
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

fn missing(name: &str) -> Error {
    let names: Vec<&str> = levels().into_iter().map(Level::name).collect();
    Error::UnknownLevel {
        name: name.into(),
        known: names.join(", "),
    }
}

/// Instruction sets that this machine can run, the fastest first.
#[must_use]
pub fn levels() -> Vec<Level> {
    let there = ALL.iter().copied().filter(|level| level.is_there());
    there.collect()
}

/// Instruction set that kernels run with: that of [`set_level`], else the fastest of [`levels`].
#[inline]
#[must_use]
pub fn level() -> Level {
    match CHOSEN.load(Ordering::Relaxed).checked_sub(1) {
        Some(place) => ALL[usize::from(place)],
        None => first(),
    }
}

/// The fastest level, stored for later calls.
#[cold]
fn first() -> Level {
    let best = ALL.iter().position(|level| level.is_there());
    // OK because the last level needs no instructions; another thread stores the same, and `set_level` wins over both.
    let place = best.unwrap_or(ALL.len() - 1);
    let _ = CHOSEN.compare_exchange(0, code(place), Ordering::Relaxed, Ordering::Relaxed);
    level()
}

fn code(place: usize) -> u8 {
    // OK because there are fewer levels than values of a byte.
    u8::try_from(place + 1).unwrap_or(u8::MAX)
}

/// Runs all kernels of this process with `level` from now on, on every thread.
///
/// Call it when the program starts: a running computation continues with other roundings, so that its bits match
/// neither level.
///
/// # Errors
/// [`Error::UnknownLevel`] for a level that this CPU lacks.
pub fn set_level(level: Level) -> Result<()> {
    match ALL.iter().position(|known| *known == level) {
        Some(place) if level.is_there() => {
            CHOSEN.store(code(place), Ordering::Relaxed);
            Ok(())
        }
        _ => Err(missing(level.name())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_of_this_machine_is_found_by_its_name_and_the_fastest_comes_first() {
        let all = levels();
        assert_eq!(all.last(), Some(&Level::Portable));
        assert_eq!(all.first(), Some(&level()));
        for found in all {
            assert_eq!(Level::from_name(found.name()).ok(), Some(found));
        }
    }

    #[test]
    fn a_level_that_is_not_there_is_refused_with_those_that_are() {
        for name in ["", "AVX2", "sse2", "avx1024"] {
            let error = Level::from_name(name).err().map(|e| e.to_string());
            let error = error.unwrap_or_default();
            assert!(error.contains(&format!("'{name}'")) && error.ends_with("portable"));
        }
    }
}
