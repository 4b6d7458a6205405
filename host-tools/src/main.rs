//! The `eigenmark` command line. Results on stdout, progress on stderr; exit 0 done, 1 a stated criterion was not met,
//! 2 unusable input or usage.

mod command;

use std::process::ExitCode;

fn main() -> ExitCode {
    command::run()
}
