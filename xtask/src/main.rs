//! Project chores: `cargo xtask test` runs everything that must pass.

mod picture;
mod test;

use std::process::ExitCode;

const USAGE: &str = "\
Usage: cargo xtask test

test  formatting, lints, all tests, doc tests, documentation, and the demo with its picture;
      stops at the first failure with its exit code";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [command] if command == "test" => test::run(),
        _ => {
            eprintln!("{USAGE}");
            ExitCode::from(2)
        }
    }
}
