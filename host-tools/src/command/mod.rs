//! One file per command: what the user typed → a resolved plan → a call of the library → print.

mod board;
mod choices;
mod compare;
mod convert;
mod demo;
mod evaluate;
mod experiment;
mod flash;
mod inspect;
mod localize;
mod merge;
mod monitor;
mod poses;
mod route;
mod segment;
mod settings;
mod simulate;
mod train;

use std::{
    io::{self, Write},
    process::ExitCode,
};

use clap::{Parser, Subcommand, error::ErrorKind};

/// Exit code of a criterion that was stated and is not met.
const UNMET: u8 = 1;

/// Exit code of unusable input or usage.
const UNUSABLE: u8 = 2;

/// The command did its work, and a criterion that was stated is not met.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Unmet(String);

/// Where a blimp or drone is, from one downward camera, on one microcontroller.
#[derive(Debug, Parser)]
#[command(
    name = "eigenmark",
    version,
    after_help = "Without a command, `demo` runs."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Cmd),
    Segment(segment::Cmd),
    Train(train::Cmd),
    Merge(merge::Cmd),
    Compare(compare::Cmd),
    Evaluate(evaluate::Cmd),
    Experiment(experiment::Cmd),
    Localize(localize::Cmd),
    Inspect(inspect::Cmd),
    Route(route::Cmd),
    Simulate(simulate::Cmd),
    Convert(convert::Cmd),
    Flash(flash::Cmd),
    Monitor(monitor::Cmd),
}

/// Parses the command line and runs it.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let result = match cli
        .command
        .unwrap_or_else(|| Command::Demo(demo::Cmd::default()))
    {
        Command::Demo(cmd) => cmd.run(),
        Command::Segment(cmd) => cmd.run(),
        Command::Train(cmd) => cmd.run(),
        Command::Merge(cmd) => cmd.run(),
        Command::Compare(cmd) => cmd.run(),
        Command::Evaluate(cmd) => cmd.run(),
        Command::Experiment(cmd) => cmd.run(),
        Command::Localize(cmd) => cmd.run(),
        Command::Inspect(cmd) => cmd.run(),
        Command::Route(cmd) => cmd.run(),
        Command::Simulate(cmd) => cmd.run(),
        Command::Convert(cmd) => cmd.run(),
        Command::Flash(cmd) => cmd.run(),
        Command::Monitor(cmd) => cmd.run(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", one_line(&told(&error)));
            ExitCode::from(if error.is::<Unmet>() { UNMET } else { UNUSABLE })
        }
    }
}

/// Help goes to stdout as it is; a usage error is one line on stderr.
fn usage(error: &clap::Error) -> ExitCode {
    if matches!(
        error.kind(),
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion
    ) {
        // Nothing can be done when even help cannot be written.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let text = error.to_string();
    let what = text.split("\n\n").next().unwrap_or_default();
    eprintln!("{}; try --help", one_line(what));
    ExitCode::from(UNUSABLE)
}

/// An error and its causes, as far as they say more.
fn told(error: &anyhow::Error) -> String {
    error
        .chain()
        .map(ToString::to_string)
        .fold(String::new(), |told, cause| {
            if told.contains(&cause) {
                told
            } else if told.is_empty() {
                cause
            } else {
                format!("{told}: {cause}")
            }
        })
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A reader that has seen enough (`eigenmark … | head`) is no failure.
fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<io::Error>())
        .any(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

/// Prints one JSON object on a line of its own.
fn print_json(out: &mut impl Write, value: &impl serde::Serialize) -> anyhow::Result<()> {
    writeln!(out, "{}", serde_json::to_string(value)?)?;
    Ok(())
}
