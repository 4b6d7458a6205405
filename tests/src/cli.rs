//! The built command line, run as a person would.

use std::{
    path::PathBuf,
    process::{Command, Output},
    sync::OnceLock,
};

use anyhow::{Context, Result, ensure};

use crate::maps::workspace;

/// Path of the `eigenmark` binary, built on first use: from the whole workspace, so that
/// dependencies have the features they have in tests, and need not be compiled again.
///
/// # Panics
/// When it does not build.
pub fn eigenmark() -> &'static PathBuf {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        build(&["--bin", "eigenmark"])
            .expect("eigenmark builds")
            .remove(0)
    })
}

/// Runs the command line with arguments.
///
/// # Panics
/// When it does not start.
pub fn run(arguments: &[&str]) -> Output {
    Command::new(eigenmark())
        .args(arguments)
        .output()
        .expect("eigenmark starts")
}

/// Builds binaries of the workspace; gives their paths.
///
/// # Errors
/// When cargo fails.
pub fn build(arguments: &[&str]) -> Result<Vec<PathBuf>> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .current_dir(workspace())
        .args(["build", "--message-format=json-render-diagnostics"])
        .args(arguments)
        .output()
        .context("cargo starts")?;
    ensure!(
        output.status.success(),
        "cargo build failed:\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let paths = String::from_utf8(output.stdout)?
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter_map(|message| message["executable"].as_str().map(PathBuf::from))
        .collect::<Vec<_>>();
    ensure!(!paths.is_empty(), "cargo build made no executable");
    Ok(paths)
}
