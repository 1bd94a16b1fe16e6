//! Notes and progress on standard error.

use std::borrow::Cow;
use std::io::{IsTerminal, Write};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work shorter than this shows no progress.
const PATIENCE: Duration = Duration::from_secs(1);
/// What is shown of work whose amount is not known, and of work that is counted.
const STEP: &str = "{spinner} {msg} {elapsed}";
const COUNT: &str = "{spinner} {msg} {wide_bar} {pos}/{len} {eta}";
const TICK: Duration = Duration::from_millis(120);

/// What the command says on standard error while it works.
pub struct Progress {
    bar: ProgressBar,
    quiet: bool,
    /// Dropping it calls off the showing of the bar.
    _patience: Option<Sender<()>>,
}

impl Progress {
    /// Shows progress once the work has taken a second, on a terminal, unless `quiet`.
    pub fn new(quiet: bool) -> Self {
        let bar = ProgressBar::hidden();
        style(&bar, STEP);
        let shown = !quiet && std::io::stderr().is_terminal();
        let patience = shown.then(|| show_later(bar.clone()));
        Self {
            bar,
            quiet,
            _patience: patience,
        }
    }

    /// Names the step that is under way.
    pub fn step(&self, name: impl Into<Cow<'static, str>>) {
        style(&self.bar, STEP);
        self.bar.set_message(name);
    }

    /// Starts counting `total` pieces of work.
    pub fn count_to(&self, total: usize) {
        self.bar.set_position(0);
        self.bar.set_length(total as u64);
        style(&self.bar, COUNT);
    }

    /// So many pieces more are done.
    pub fn done(&self, pieces: usize) {
        self.bar.inc(pieces as u64);
    }

    /// Tells the user something worth knowing that is no error.
    pub fn note(&self, text: &str) {
        if !self.quiet {
            self.bar.suspend(|| say(text));
        }
    }

    /// Takes the bar away before results appear on the same terminal.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.clear();
    }
}

/// A line of taut's on standard error, whose absence is no reason to fail.
pub fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "taut: {text}");
}

fn style(bar: &ProgressBar, template: &str) {
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
}

fn show_later(bar: ProgressBar) -> Sender<()> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        if receiver.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) && !bar.is_finished() {
            bar.set_draw_target(ProgressDrawTarget::stderr());
            bar.enable_steady_tick(TICK);
        }
    });
    sender
}
