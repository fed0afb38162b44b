//! A piece of work: how many threads it may use, how far it is, and whether it should stop (floor 0).
//!
//! Kernels never call rayon themselves: they cut their output into chunks and hand them to [`Job::chunks`] or
//! [`Job::map`]. A chunk sees only its own output and shared read-only input, so the bits of the result do not depend
//! on the number of threads. Between chunks the cancel flag is read; keep a chunk below about 20 ms so that Ctrl-C is
//! felt at once.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use crate::error::{Error, Result};

/// Threads, progress and cancellation of one call.
#[derive(Debug)]
pub struct Job {
    threads: usize,
    cancelled: AtomicBool,
    done: AtomicU64,
    total: AtomicU64,
}

impl Job {
    /// A job for at most `threads` threads. With more than one, the caller must have entered a rayon pool of that size.
    pub fn new(threads: usize) -> Self {
        Self {
            threads: threads.max(1),
            cancelled: AtomicBool::new(false),
            done: AtomicU64::new(0),
            total: AtomicU64::new(0),
        }
    }

    /// A job on the calling thread alone that nobody can cancel.
    pub fn serial() -> Self {
        Self::new(1)
    }

    /// How many threads may be used.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Ask the work to stop.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// `Err(Interrupted)` once [`cancel`](Self::cancel) has been called.
    pub fn check(&self) -> Result<()> {
        if self.cancelled.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// State how many steps there will be.
    pub fn expect(&self, total: u64) {
        self.total.store(total, Ordering::Relaxed);
    }

    /// Count `steps` as done and check for cancellation.
    pub fn advance(&self, steps: u64) -> Result<()> {
        self.done.fetch_add(steps, Ordering::Relaxed);
        self.check()
    }

    /// `(done, total)` in steps.
    pub fn progress(&self) -> (u64, u64) {
        (self.done.load(Ordering::Relaxed), self.total.load(Ordering::Relaxed))
    }

    /// Run `work(index, chunk)` over `data` cut into chunks of `size` elements (the last may be shorter).
    pub fn chunks<T: Send>(
        &self,
        data: &mut [T],
        size: usize,
        work: impl Fn(usize, &mut [T]) -> Result<()> + Sync,
    ) -> Result<()> {
        let size = size.max(1);
        let one = |(index, chunk): (usize, &mut [T])| {
            self.check()?;
            work(index, chunk)
        };
        if self.threads == 1 || data.len() <= size {
            data.chunks_mut(size).enumerate().try_for_each(one)
        } else {
            data.par_chunks_mut(size).enumerate().try_for_each(one)
        }
    }

    /// Collect `work(index)` for `0..count`, in order.
    pub fn map<R: Send>(&self, count: usize, work: impl Fn(usize) -> Result<R> + Sync) -> Result<Vec<R>> {
        let one = |index: usize| {
            self.check()?;
            work(index)
        };
        if self.threads == 1 || count <= 1 {
            (0..count).map(one).collect()
        } else {
            (0..count).into_par_iter().with_max_len(1).map(one).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cancelled_job_stops_between_bands() {
        let job = Job::serial();
        let mut data = vec![0_u8; 10];
        let seen = AtomicU64::new(0);
        let result = job.chunks(&mut data, 2, |index, _| {
            seen.fetch_add(1, Ordering::Relaxed);
            if index == 1 {
                job.cancel();
            }
            Ok(())
        });
        assert_eq!(result, Err(Error::Interrupted), "the third band must not start");
        assert_eq!(seen.load(Ordering::Relaxed), 2, "two chunks ran");
    }

    #[test]
    fn bands_cover_everything_once() {
        let mut data = vec![0_u32; 103];
        Job::serial()
            .chunks(&mut data, 10, |index, chunk| {
                for (k, x) in chunk.iter_mut().enumerate() {
                    *x += (index * 10 + k) as u32 + 1;
                }
                Ok(())
            })
            .expect("nothing fails");
        assert!(data.iter().enumerate().all(|(i, &x)| x == i as u32 + 1), "each element once");
    }
}
