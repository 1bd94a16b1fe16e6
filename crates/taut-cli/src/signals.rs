//! Signals that end the process: what is unfinished goes first.

/// Takes unfinished files away when the process is told to end, and lets writing beyond the largest
/// size of a file that is allowed fail as on a full disk.
#[cfg(unix)]
pub fn watch() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    // Without a handler the process would be ended; with one the write is refused.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    let wanted = [SIGHUP, SIGINT, SIGTERM];
    let ending: Vec<_> = wanted.into_iter().filter(|s| !is_ignored(*s)).collect();
    if let Ok(mut signals) = Signals::new(ending) {
        std::thread::spawn(move || {
            if let Some(signal) = signals.forever().next() {
                taut_io::discard_unfinished();
                let _ = emulate_default_handler(signal);
            }
        });
    }
}

/// Elsewhere they end the process as ever.
#[cfg(not(unix))]
pub fn watch() {}

/// Whether whoever started the process wants it to go on in spite of a signal, as `nohup` does.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else {
        return false;
    };
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
