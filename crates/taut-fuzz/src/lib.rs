//! What must hold for any input whatever: a target is a function of bytes that panics where it does
//! not hold.
//!
//! `fuzz/` calls the targets with inputs that a fuzzer makes up, the tests of this crate with those
//! kept in `fuzz/corpus` (well-formed ones, and others that reach far) and in `fuzz/found` (those
//! that once failed), each in a folder by the target's name.

#![expect(
    clippy::unwrap_used,
    reason = "as in a test, a panic is how a failure is told"
)]

mod bytes;
mod clouds;
mod copies;
mod edits;
mod formulas;
mod lists;
mod models;
mod readers;

use std::time::Duration;

use bytes::Bytes;

/// No input may take more CPU time than this. The time that passes on the clock is not limited
/// here, because it is long for any input when the machine is busy.
const LONGEST: Duration = Duration::from_secs(10);

/// Something to call with any bytes.
#[derive(Clone, Copy)]
pub struct Target {
    /// The name of its folders and of its program in `fuzz/`.
    pub name: &'static str,
    /// Panics where what must hold does not.
    run: fn(&[u8]),
}

macro_rules! targets {
    ($($name:ident: $function:path,)*) => {
        /// Every target.
        pub const TARGETS: &[Target] = &[$(Target { name: stringify!($name), run: $function },)*];
    };
}

targets! {
    ply: readers::ply,
    obj: readers::obj,
    off: readers::off,
    stl: readers::stl,
    xyz: readers::xyz,
    csv: readers::csv,
    pcd: readers::pcd,
    las: readers::las,
    copies: copies::copies,
    e57: readers::e57,
    npy: readers::npy,
    lists: lists::lists,
    formula: formulas::formula,
    model: models::model,
    edits: edits::edits,
    atlas: clouds::atlas,
    field: clouds::field,
    fit: clouds::fit,
}

/// Calls the target of a name.
///
/// # Panics
/// Where what must hold does not, where the input takes more than ten seconds of CPU time, and
/// where there is no such target.
pub fn run(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|target| target.name == name);
    let target = target.expect("a target of this name");
    within(LONGEST, || (target.run)(bytes));
}

/// Does some work, and panics if that took more CPU time than allowed.
fn within(longest: Duration, work: impl FnOnce()) {
    let begun = cpu_time();
    work();
    let spent = cpu_time() - begun;
    assert!(
        spent <= longest,
        "the input took {spent:?} of CPU time, and no input may take more than {longest:?}"
    );
}

/// The CPU time that all threads of this process have taken so far.
#[cfg(unix)]
fn cpu_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.try_into().expect("a time since the process began")
}

/// Other systems are not asked for the CPU time, so inputs are not limited there.
#[cfg(not(unix))]
fn cpu_time() -> Duration {
    Duration::ZERO
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn time_spent_at_work_is_limited_and_time_spent_waiting_is_not() {
        let longest = Duration::from_millis(50);
        within(longest, || std::thread::sleep(2 * longest));
        let work = || {
            let begun = cpu_time();
            while cpu_time() - begun <= longest {}
        };
        assert!(std::panic::catch_unwind(|| within(longest, work)).is_err());
    }
}
