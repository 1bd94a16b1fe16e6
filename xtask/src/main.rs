//! Project chores: `cargo xtask test` runs everything that must pass, `cargo xtask fuzz` looks for inputs that fail.

mod fuzz;
mod picture;
mod test;

use std::process::ExitCode;

const USAGE: &str = "\
Usage: cargo xtask test
       cargo xtask fuzz --minutes N [TARGET ...]

test  formatting, lints, all tests, doc tests, documentation, and the demo with its picture;
      stops at the first failure with its exit code
fuzz  fuzzes each target (all of fuzz/fuzz_targets where none is named) for N minutes, as many at a time as there are
      cores; tells executions and coverage of each, and the inputs that failed";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [command] if command == "test" => test::run(),
        [command, rest @ ..] if command == "fuzz" => match fuzz::Settings::parse(rest) {
            Ok(settings) => fuzz::run(&settings),
            Err(reason) => usage(&reason),
        },
        _ => usage("expected test or fuzz"),
    }
}

fn usage(reason: &str) -> ExitCode {
    eprintln!("{reason}\n{USAGE}");
    ExitCode::from(2)
}
