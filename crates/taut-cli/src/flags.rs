//! The command line as it is typed.

use clap::{Parser, Subcommand};
use clap_complete::Shell;

use crate::exit::Exit;
use crate::values::count;
use crate::{check, demo, exponential, field, fit, logarithm, matrix, path, sample};

const EXAMPLES: &str = "\
Examples:
  taut demo
      A path on a sheet rolled up seven times, next to the exact answer, with a picture.
  taut check scan.ply
      What the points are like, and what may go wrong with them.
  taut path scan.ply --from 12 --to 3400 --picture path.png
      The shortest path between two points of a scan.
  taut path --implicit '(sqrt(x^2 + y^2) - 1)^2 + z^2 = 0.16' --from 1.4,0,0 --to=-1.4,0,0 --tol 1e-12
      The same on a torus that is given by its equation, to twelve digits.
  taut field scan.ply --source 12 -o distances.ply --picture field.png
      The distance from a point of a scan to all others.
  taut path scan.las --class 2 --pairs pairs.txt --json > paths.jsonl
      A path for each line of pairs.txt, on the ground points of a LiDAR scan.";

/// Find geodesics, the shortest paths along a surface, from a scan or an equation.
///
/// A point cloud becomes a smooth surface. A first guess crosses it, and the guess is pulled taut
/// until its length is known to the tolerance. Lengths are in the units of the input.
#[derive(Debug, Parser)]
#[command(name = "taut", version, arg_required_else_help = true)]
#[command(after_help = EXAMPLES, after_long_help = examples(EXAMPLES))]
pub struct Flags {
    #[command(subcommand)]
    pub command: Command,
    /// Number of threads [default: as many as the machine has]; the results do not depend on it
    #[arg(long, global = true, value_name = "N", help_heading = "General")]
    #[arg(value_parser = count, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Write only errors to standard error, no notes and no progress
    #[arg(long, short, global = true, help_heading = "General")]
    pub quiet: bool,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Find the shortest path between points of a surface
    #[command(after_help = path::EXAMPLES)]
    #[command(after_long_help = examples(path::EXAMPLES))]
    Path(path::Flags),
    /// Find the distance from one or several sources to every point of a surface
    #[command(after_help = field::EXAMPLES)]
    #[command(after_long_help = examples(field::EXAMPLES))]
    Field(field::Flags),
    /// Find, for every point, the tangent vector at the source whose geodesic leads to it
    #[command(after_help = logarithm::EXAMPLES)]
    #[command(after_long_help = examples(logarithm::EXAMPLES))]
    Log(logarithm::Flags),
    /// Follow the geodesic that leaves a point in a direction
    #[command(after_help = exponential::EXAMPLES)]
    #[command(after_long_help = examples(exponential::EXAMPLES))]
    Exp(exponential::Flags),
    /// Find the distances of all pairs of many points, as a NumPy matrix
    #[command(after_help = matrix::EXAMPLES)]
    #[command(after_long_help = examples(matrix::EXAMPLES))]
    Matrix(matrix::Flags),
    /// Tell what a surface is like, and warn of what may go wrong
    Check(check::Flags),
    /// Fit a smooth surface to a scan and keep it in a file that every command takes as SURFACE
    #[command(after_help = fit::EXAMPLES)]
    #[command(after_long_help = examples(fit::EXAMPLES))]
    Fit(fit::Flags),
    /// Spread points over a surface, denser where it bends
    #[command(after_help = sample::EXAMPLES)]
    #[command(after_long_help = examples(sample::EXAMPLES))]
    Sample(sample::Flags),
    /// Find a path on a rolled-up sheet and compare it with the exact answer
    Demo(demo::Flags),
    /// Write completions for a shell to standard output
    Completions {
        /// The shell
        shell: Shell,
    },
}

/// Examples, and below them what exit codes mean.
fn examples(text: &str) -> String {
    format!("{text}\n\n{}", Exit::help())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Flags::command().debug_assert();
    }
}
