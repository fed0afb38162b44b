//! The one way into the cores: threads, signals, progress and forks.
//!
//! [`quick`] is for kernels that end within about 50 ms; [`long`] polls signals every 20 ms, reports progress and
//! stops when Python raises. Both release the GIL. The rayon pool is keyed by process id: a child forked after the
//! first call makes its own, because the parent's threads do not exist there.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::error::{Error, Result};
use crate::job::Job;

struct Threads {
    wanted: Option<usize>,
    pool: Option<(u32, usize, Arc<ThreadPool>)>,
}

/// Locked only while attached to the interpreter and never across a call out of this file. `os.fork` holds the GIL, so
/// no other thread can own this lock at the moment of a fork.
static THREADS: Mutex<Threads> = Mutex::new(Threads { wanted: None, pool: None });

fn default_threads() -> usize {
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.trim().parse::<usize>().ok());
    // Otherwise what the affinity mask and the cgroup's quota allow.
    asked.filter(|&n| n > 0).unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)).min(1024)
}

fn lock() -> std::sync::MutexGuard<'static, Threads> {
    THREADS.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Threads used by every later call.
#[pyfunction]
pub(crate) fn get_num_threads() -> usize {
    lock().wanted.unwrap_or_else(default_threads)
}

/// Set the number of threads; `None` returns to the default.
#[pyfunction]
#[pyo3(signature = (threads))]
pub(crate) fn set_num_threads(threads: Option<usize>) -> PyResult<()> {
    if threads.is_some_and(|n| n == 0 || n > 1024) {
        return Err(PyValueError::new_err(format!("threads must be in [1, 1024] [1], got {}", threads.unwrap_or(0))));
    }
    lock().wanted = threads;
    Ok(())
}

fn pool() -> PyResult<(usize, Option<Arc<ThreadPool>>)> {
    let mut state = lock();
    let threads = state.wanted.unwrap_or_else(default_threads);
    if threads == 1 {
        return Ok((1, None));
    }
    let pid = std::process::id();
    if let Some((owner, size, pool)) = &state.pool
        && *owner == pid
        && *size == threads
    {
        return Ok((threads, Some(pool.clone())));
    }
    let fresh = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("pleinair-{i}"))
        .build()
        .map_err(|e| PyRuntimeError::new_err(format!("cannot start {threads} threads: {e}")))?;
    let fresh = Arc::new(fresh);
    if let Some((owner, _, old)) = state.pool.replace((pid, threads, fresh.clone()))
        && owner != pid
    {
        // The parent's pool: its threads are not in this process, and dropping it would wait for them.
        std::mem::forget(old);
    }
    Ok((threads, Some(fresh)))
}

/// Python's exception for an error of the core.
pub(crate) fn to_py(error: &Error) -> PyErr {
    match error {
        Error::Interrupted => PyKeyboardInterrupt::new_err("interrupted"),
        _ => PyValueError::new_err(error.to_string()),
    }
}

fn guarded<T>(work: impl FnOnce(&Job) -> Result<T>, job: &Job) -> PyResult<T> {
    match catch_unwind(AssertUnwindSafe(|| work(job))) {
        Ok(result) => result.map_err(|e| to_py(&e)),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("unknown");
            Err(PyRuntimeError::new_err(format!("internal error, please report it: {text}")))
        }
    }
}

/// Run a kernel that ends within about 50 ms. `elements` decides whether waking other threads is worth it.
pub(crate) fn quick<T: Send>(
    py: Python<'_>,
    elements: usize,
    work: impl FnOnce(&Job) -> Result<T> + Send,
) -> PyResult<T> {
    if elements < 1 << 15 {
        return py.detach(|| guarded(work, &Job::serial()));
    }
    let (threads, pool) = pool()?;
    let job = Job::new(threads);
    py.detach(|| match pool {
        None => guarded(work, &job),
        Some(pool) => pool.install(|| guarded(work, &job)),
    })
}

/// [`quick`] or [`long`], by the cost in elementary steps: about 1 ns each.
pub(crate) fn sized<T: Send>(py: Python<'_>, steps: usize, work: impl FnOnce(&Job) -> Result<T> + Send) -> PyResult<T> {
    if steps < 1 << 25 { quick(py, steps, work) } else { long(py, None, work) }
}

/// Run long work: signals are polled every 20 ms, `progress(done, total)` is called as it advances, and an exception
/// from either cancels the work, which then ends within one chunk.
pub(crate) fn long<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Job) -> Result<T> + Send,
) -> PyResult<T> {
    let (threads, pool) = pool()?;
    let job = Job::new(threads);
    let progress: Option<Py<PyAny>> = progress.map(|p| p.clone().unbind());
    py.detach(|| {
        std::thread::scope(|scope| {
            let (send, receive) = mpsc::channel();
            let job = &job;
            scope.spawn(move || {
                let result = match pool {
                    None => guarded(work, job),
                    Some(pool) => pool.install(|| guarded(work, job)),
                };
                // The receiver lives until this message has come.
                let _ = send.send(result);
            });
            let mut raised = None;
            let mut reported = (0, 0);
            loop {
                let ended = match receive.recv_timeout(Duration::from_millis(20)) {
                    Ok(result) => Some(result),
                    Err(mpsc::RecvTimeoutError::Timeout) => None,
                    Err(mpsc::RecvTimeoutError::Disconnected) => {
                        Some(Err(PyRuntimeError::new_err("internal error: the worker thread is gone")))
                    }
                };
                if raised.is_none() {
                    let now = job.progress();
                    let news = now != reported && now.1 > 0;
                    reported = now;
                    let outcome = Python::attach(|py| {
                        py.check_signals()?;
                        match &progress {
                            Some(callback) if news => callback.call1(py, (now.0.min(now.1), now.1)).map(|_| ()),
                            _ => Ok(()),
                        }
                    });
                    if let Err(error) = outcome {
                        job.cancel();
                        raised = Some(error);
                    }
                }
                if let Some(result) = ended {
                    return match raised {
                        Some(error) => Err(error),
                        None => result,
                    };
                }
            }
        })
    })
}

/// Work for the tests of this file: `steps` chunks of about `milliseconds` each.
#[pyfunction]
#[pyo3(signature = (steps, milliseconds, progress=None))]
pub(crate) fn _spin(
    py: Python<'_>,
    steps: usize,
    milliseconds: u64,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<u64> {
    long(py, progress, |job| {
        job.expect(steps as u64);
        let done = job.map(steps, |_| {
            let start = std::time::Instant::now();
            while start.elapsed() < Duration::from_millis(milliseconds) {
                std::hint::spin_loop();
            }
            job.advance(1)?;
            Ok(1_u64)
        })?;
        Ok(done.iter().sum())
    })
}
