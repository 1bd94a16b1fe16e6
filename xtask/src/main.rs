//! Project chores: `cargo xtask test` runs everything that must pass, `cargo xtask fuzz` looks for
//! inputs that fail, `cargo xtask golden` tells whether a change altered an answer, and `cargo
//! xtask arrows` whether modules use only what they may.

mod arrows;
mod fuzz;
mod golden;
mod picture;
mod python;
mod temporary;
mod test;

use std::process::ExitCode;

const USAGE: &str = "\
Usage: cargo xtask test
       cargo xtask fuzz --minutes N [TARGET ...]
       cargo xtask golden [--write]
       cargo xtask arrows

test    arrows, formatting, lints, all tests, doc tests, documentation, and the demo with its picture;
        stops at the first failure with its exit code
fuzz    fuzzes each target (all of fuzz/fuzz_targets where none is named) for N minutes, as many at a time as there are
        cores; tells executions and coverage of each, and the inputs that failed
golden  builds the command, runs short jobs and compares the checksums of their outputs with those in
        xtask/golden.txt; --write stores new ones. A change that moves code leaves all sums as they are, one that is
        meant to alter answers stores new sums and says which and why. The sums are those of x86-64 Linux: elsewhere
        functions such as sin round otherwise, so compare before and after a change on one machine
arrows  tells which modules use what docs/ARCHITECTURE.md does not let them use, and which files use each other in a circle";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [command] if command == "test" => test::run(),
        [command, rest @ ..] if command == "fuzz" => match fuzz::Settings::parse(rest) {
            Ok(settings) => fuzz::run(&settings),
            Err(reason) => usage(&reason),
        },
        [command] if command == "golden" => golden::run(false),
        [command, flag] if command == "golden" && flag == "--write" => golden::run(true),
        [command] if command == "arrows" => arrows::run(),
        [command, ..] if command == "golden" => {
            usage("golden: expected nothing or --write behind it")
        }
        _ => usage("expected test, fuzz, golden or arrows"),
    }
}

fn usage(reason: &str) -> ExitCode {
    eprintln!("{reason}\n{USAGE}");
    ExitCode::from(2)
}
