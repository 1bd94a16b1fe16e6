//! How the command ends: its exit codes, and the errors behind them.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use thiserror::Error;

/// How the command ended. The order is that of the codes: of several results the highest counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    Success = 0,
    Unexpected = 1,
    Usage = 2,
    BadInput = 3,
    NoPath = 4,
    NotConverged = 5,
    Unknown = 6,
}

impl Exit {
    const ALL: [Self; 7] = [
        Self::Success,
        Self::Unexpected,
        Self::Usage,
        Self::BadInput,
        Self::NoPath,
        Self::NotConverged,
        Self::Unknown,
    ];

    fn meaning(self) -> &'static str {
        match self {
            Self::Success => "success (also where the reader of the output stopped reading)",
            Self::Unexpected => "unexpected: a file could not be written, or taut has a fault",
            Self::Usage => "usage: an argument is unknown, or arguments contradict each other",
            Self::BadInput => "bad input: a file, an equation or a point cannot be used",
            Self::NoPath => "no path connects the two points",
            Self::NotConverged => {
                "the path did not converge to the tolerance; it is given as far as it got"
            }
            Self::Unknown => {
                "it is unknown whether a path exists, because the surface was not sampled all the way or no ray came there"
            }
        }
    }

    /// The table of codes for the help.
    pub fn help() -> String {
        let mut text = "Exit codes (with many pairs, the highest counts):".to_owned();
        for exit in Self::ALL {
            text += &format!("\n  {}  {}", exit as u8, exit.meaning());
        }
        text
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Why the command could not do its work.
#[derive(Debug, Error)]
pub enum Failure {
    /// Arguments that do not fit each other.
    #[error("{0}")]
    Usage(String),
    #[error(transparent)]
    Read(#[from] taut_io::ReadError),
    #[error(transparent)]
    Formula(#[from] taut_formula::FormulaError),
    /// The engine refused a surface.
    #[error("{surface}: {error}")]
    Surface {
        surface: String,
        error: taut_core::error::Error,
    },
    /// A surface on which what was asked for is not known.
    #[error("{surface}: {reason}")]
    Unfit { surface: String, reason: String },
    /// A start or end point that cannot be used.
    #[error("{end}: {reason}")]
    End { end: String, reason: String },
    #[error(transparent)]
    Write(#[from] taut_io::WriteError),
    #[error("{}: {error}", file.display())]
    Draw {
        file: PathBuf,
        error: taut_draw::DrawError,
    },
    #[error("standard output: cannot be written: {0}")]
    Output(#[from] io::Error),
    #[error("{count} threads cannot be started: {error}; ask for fewer with --threads")]
    Threads {
        count: usize,
        error: rayon::ThreadPoolBuildError,
    },
}

impl Failure {
    pub fn exit(&self) -> Exit {
        match self {
            Self::Output(error) if error.kind() == io::ErrorKind::BrokenPipe => Exit::Success,
            Self::Usage(_) => Exit::Usage,
            Self::Read(_)
            | Self::Formula(_)
            | Self::Surface { .. }
            | Self::Unfit { .. }
            | Self::End { .. } => Exit::BadInput,
            Self::Write(taut_io::WriteError::Io { .. }) => Exit::Unexpected,
            Self::Write(_) => Exit::Usage,
            Self::Draw { .. } | Self::Output(_) | Self::Threads { .. } => Exit::Unexpected,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_pipe_is_success() {
        let pipe = Failure::Output(io::ErrorKind::BrokenPipe.into());
        assert_eq!(pipe.exit(), Exit::Success);
        let disk = Failure::Output(io::ErrorKind::StorageFull.into());
        assert_eq!(disk.exit(), Exit::Unexpected);
    }

    #[test]
    fn the_help_lists_every_code_once() {
        for (code, line) in Exit::help().lines().skip(1).enumerate() {
            assert!(
                line.trim_start().starts_with(&format!("{code}  ")),
                "{line}"
            );
        }
        assert_eq!(Exit::help().lines().count(), 8);
    }
}
