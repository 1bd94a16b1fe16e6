//! The command `taut`: raw flags, checked settings, the library, and what it answers as text.

mod answer;
mod check;
mod clouds;
mod correction;
mod demo;
mod equations;
mod exit;
mod exponential;
mod facts;
mod field;
mod fit;
mod flags;
mod located;
mod logarithm;
mod matrix;
mod models;
mod numbers;
mod output;
mod outputs;
mod pairs;
mod path;
mod picture;
mod progress;
mod ready;
mod sample;
mod signals;
mod sites;
mod source;
mod surface;
mod values;

use std::io::Write;
use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use exit::{Exit, Failure};
use flags::{Command, Flags};
use progress::Progress;

fn main() -> ExitCode {
    let flags = Flags::parse();
    signals::watch();
    let exit = run(flags).unwrap_or_else(|failure| {
        if failure.exit() != Exit::Success {
            progress::say(&failure.to_string());
        }
        failure.exit()
    });
    exit.into()
}

fn run(flags: Flags) -> Result<Exit, Failure> {
    let count = flags.threads.unwrap_or(0);
    let threads = rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build()
        .map_err(|error| Failure::Threads { count, error })?;
    let progress = Progress::new(flags.quiet);
    threads.install(|| match flags.command {
        Command::Path(flags) => path::run(&flags, &progress),
        Command::Field(flags) => field::run(&flags, &progress),
        Command::Log(flags) => logarithm::run(&flags, &progress),
        Command::Exp(flags) => exponential::run(&flags, &progress),
        Command::Matrix(flags) => matrix::run(&flags, &progress),
        Command::Check(flags) => check::run(&flags, &progress),
        Command::Fit(flags) => fit::run(&flags, &progress),
        Command::Sample(flags) => sample::run(&flags, &progress),
        Command::Demo(flags) => demo::run(&flags, &progress),
        Command::Completions { shell } => completions(shell),
    })
}

fn completions(shell: clap_complete::Shell) -> Result<Exit, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Flags::command(), "taut", &mut script);
    std::io::stdout().write_all(&script)?;
    Ok(Exit::Success)
}
