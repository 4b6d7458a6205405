//! Runs a firmware binary on the emulated board: cargo's runner for the target.
//!
//! `board FIRMWARE [--atlas FILE [--atlas FILE]]`: plain output goes to stdout, logs to stderr. Without `--atlas`, the
//! first slot holds the report's table of all 83 views of the built-in city; `cycles` then runs once for every set of
//! tables that it measures.

use std::{env, path::PathBuf, process::ExitCode};

use anyhow::{Context, Result, bail, ensure};
use eigenmark::{atlas::AtlasBuffer, map::Map, output::Progress};
use eigenmark_core::link::{Reply, Request};
use eigenmark_tests::{
    board::{Board, Log},
    tables,
};

fn main() -> Result<ExitCode> {
    let mut arguments = env::args_os().skip(1);
    let firmware = PathBuf::from(
        arguments
            .next()
            .context("usage: board FIRMWARE [--atlas FILE]…")?,
    );
    let mut atlases = Vec::new();
    while let Some(argument) = arguments.next() {
        match argument.to_str() {
            Some("--atlas") => {
                let path = PathBuf::from(arguments.next().context("--atlas: expected a file")?);
                atlases.push(AtlasBuffer::read(&path)?);
            }
            _ => bail!("{}: expected --atlas FILE", argument.display()),
        }
    }
    let is = |name: &str| firmware.file_stem().is_some_and(|stem| stem == name);
    let flashes = match atlases {
        _ if !atlases.is_empty() => vec![atlases],
        _ if is("cycles") => tables::of_cycles(&Progress::Stderr)?,
        _ => vec![vec![tables::report(&Progress::Stderr)?]],
    };
    for atlases in flashes {
        ensure!(
            atlases.len() <= 2,
            "a board has two slots, {} atlases are given",
            atlases.len()
        );
        let board = atlases
            .iter()
            .fold(Board::flashed(&firmware), |board, atlas| {
                board.with_atlas(atlas)
            });
        if is("navigator") {
            return show_fixes(&board);
        }
        let code = board.run(print)?;
        if code != 0 {
            return Ok(ExitCode::from(u8::try_from(code).unwrap_or(1)));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The navigator serves the link for ever: show it some frames of the built-in city and what it answers.
fn show_fixes(board: &Board) -> Result<ExitCode> {
    let mut running = board.start(print)?;
    let identity = running.ask(&Request::Identify)?;
    println!("{identity:?}");
    let city = Map::city();
    for sequence in 0..5 {
        let (x, y) = (100 + sequence * 300, 500);
        let window = image::imageops::crop_imm(city.luminance(), x, y, 200, 200).to_image();
        let request = Request::Locate {
            sequence,
            width: 200,
            height: 200,
            pixels: window.as_raw(),
        };
        match running.ask(&request)? {
            Reply::Fix { fix: Some(fix), .. } => {
                println!("frame around ({}, {}): {fix:?}", x + 100, y + 100);
            }
            other => println!("frame around ({}, {}): {other:?}", x + 100, y + 100),
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn print(log: Log) {
    match log.level {
        None => println!("{}", log.text),
        Some(level) => eprintln!("[{level}] {}", log.text),
    }
}
