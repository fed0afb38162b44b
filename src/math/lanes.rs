//! SIMD multiversioning, the only file that dispatches on the CPU (floor 0).
//!
//! A kernel is a plain branch-free loop in an `#[inline(always)]` function. [`run`] compiles it once for each SIMD
//! level (SSE2, SSE4.2, AVX2, AVX-512 on x86-64) and runs the best one the machine has, so a wheel built for baseline
//! x86-64 is fast everywhere. Rust never contracts `a * b + c` by itself, and our kernels use no `mul_add`, no libm
//! transcendental and no saturating cast, so every level gives the same bits: `tests/house/test_processes.py` and
//! `tests/hard/test_*_bits.py` demand it.

use std::sync::atomic::{AtomicU8, Ordering};

use fearless_simd::{Level, Simd, dispatch};

use crate::error::{Error, Result};

/// Index into [`available`] plus one; zero means the best level.
static FORCED: AtomicU8 = AtomicU8::new(0);

#[cfg(target_arch = "x86_64")]
fn ladder() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    let mut all = Vec::new();
    all.extend(best.as_sse2().map(|t| ("sse2", t.level())));
    all.extend(best.as_sse4_2().map(|t| ("sse4.2", t.level())));
    all.extend(best.as_avx2().map(|t| ("avx2", t.level())));
    all.extend(best.as_avx512().map(|t| ("avx512", t.level())));
    all
}

#[cfg(not(target_arch = "x86_64"))]
fn ladder() -> Vec<(&'static str, Level)> {
    vec![("native", Level::new())]
}

/// Names of the SIMD levels of this machine, lowest first.
pub fn available() -> Vec<&'static str> {
    ladder().into_iter().map(|(name, _)| name).collect()
}

/// Name of the level in use.
pub fn current() -> &'static str {
    let all = ladder();
    match FORCED.load(Ordering::Relaxed) {
        0 => all.last().map_or("scalar", |l| l.0),
        k => all[k as usize - 1].0,
    }
}

/// Use one level for every later call (`None`: the best again). For tests and benchmarks.
pub fn force(name: Option<&str>) -> Result<()> {
    let index = match name {
        None => 0,
        Some(name) => {
            let all = available();
            1 + all.iter().position(|&n| n == name).ok_or_else(|| Error::Data {
                name: "level",
                reason: format!("must be one of {all:?} on this machine, got {name:?}"),
            })?
        }
    };
    FORCED.store(index as u8, Ordering::Relaxed);
    Ok(())
}

/// Run a kernel at the level in use. `kernel` and all it calls must be `#[inline(always)]`.
#[inline]
pub fn run<R>(kernel: impl FnOnce() -> R) -> R {
    let level = match FORCED.load(Ordering::Relaxed) {
        0 => Level::new(),
        k => ladder()[k as usize - 1].1,
    };
    dispatch!(level, simd => simd.vectorize(kernel))
}
