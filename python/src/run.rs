//! Long work away from the interpreter: it can be interrupted, and goes on in a forked process.

use std::collections::HashMap;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// How often the interpreter is asked whether the user has interrupted.
const PATIENCE: Duration = Duration::from_millis(20);

/// Pools by the process that made them and their number of threads; 0 is as many as there are
/// cores.
type Pools = HashMap<(u32, usize), Arc<ThreadPool>>;

static POOLS: Mutex<Option<Pools>> = Mutex::new(None);

/// A pool of this process. Threads do not survive a fork, so a forked process makes its own and
/// never waits for those of its parent.
fn pool(threads: usize) -> PyResult<Arc<ThreadPool>> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let pools = pools.get_or_insert_default();
    let key = (std::process::id(), threads);
    if let Some(pool) = pools.get(&key) {
        return Ok(Arc::clone(pool));
    }
    // Without a handler a panic would end the process; with it the caller hears that no answer
    // comes.
    let builder = ThreadPoolBuilder::new().panic_handler(|_| ());
    let built = builder.num_threads(threads).build();
    let built = built.map_err(|error| {
        PyRuntimeError::new_err(format!("{threads} threads cannot be started: {error}"))
    })?;
    let pool = Arc::new(built);
    pools.insert(key, Arc::clone(&pool));
    Ok(pool)
}

/// The answer of some work on a number of threads, without the interpreter's lock. An interrupt
/// ends the call at once; the work itself, which cannot be stopped, ends unheard.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let (send, receive) = channel();
    pool.spawn(move || {
        // Nobody listens after an interrupt.
        let _ = send.send(work());
    });
    let receive = Mutex::new(receive);
    loop {
        let answer = py.detach(|| {
            let receive = receive.lock().unwrap_or_else(PoisonError::into_inner);
            receive.recv_timeout(PATIENCE)
        });
        match answer {
            Ok(answer) => return Ok(answer),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err(
                    "a fault of taut's: the work ended without an answer; please report it",
                ));
            }
        }
    }
}
