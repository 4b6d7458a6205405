//! Runs a firmware binary on the emulated board: cargo's runner for the target.
//!
//! With `EIGENMARK_CHIP` set (`STM32F405RGTx`, `STM32H743VITx`) it is run on hardware instead, through `probe-rs`.
//!
//! `board FIRMWARE [--atlas FILE [--atlas FILE]]`: plain output goes to stdout, logs to stderr. Without `--atlas`, the
//! first slot holds the report's table of all 83 views of the built-in city; `cycles` then runs once for every set of
//! tables that it measures.

use std::{
    env,
    ffi::OsStr,
    path::{Path, PathBuf},
    process::{Command, ExitCode},
};

use anyhow::{Context, Result, bail, ensure};
use eigenmark::{atlas::AtlasBuffer, map::Map, output::Progress, simulate::CameraFrame};
use eigenmark_core::link::{Reply, Request};
use eigenmark_tests::{
    board::{Board, Log},
    tables,
};

/// Names the chip of a board at a probe, as probe-rs calls it: firmware is then run there.
const CHIP: &str = "EIGENMARK_CHIP";

const PROBE_RS: &str = "probe-rs";

fn main() -> Result<ExitCode> {
    let mut arguments = env::args_os().skip(1);
    let firmware = PathBuf::from(
        arguments
            .next()
            .context("usage: board FIRMWARE [--atlas FILE]…")?,
    );
    if let Some(chip) = env::var_os(CHIP) {
        return run_on_hardware(&firmware, &chip);
    }
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
        let board = Board::flashed(&firmware)?;
        for (slot, atlas) in atlases.iter().enumerate() {
            board.flash_atlas(slot, atlas)?;
        }
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

/// Writes the firmware to a chip through a probe, and shows its log.
fn run_on_hardware(firmware: &Path, chip: &OsStr) -> Result<ExitCode> {
    let status = Command::new(PROBE_RS)
        .args(["run", "--chip"])
        .arg(chip)
        .arg(firmware)
        .status()
        .with_context(|| format!("{PROBE_RS} (cargo install probe-rs-tools --locked)"))?;
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    Ok(ExitCode::from(code.unwrap_or(1)))
}

/// The navigator flies for ever: show it some frames of the built-in city and what it answers.
fn show_fixes(board: &Board) -> Result<ExitCode> {
    let mut running = board.start(print)?;
    let identity = running.ask(&Request::Identify)?;
    println!("{identity:?}");
    let city = Map::city();
    for sequence in 0..5 {
        let (x, y) = (100 + sequence * 300, 500);
        let (left, top) = (x + 40, y + 40);
        let window = image::imageops::crop_imm(city.luminance(), left, top, 120, 120).to_image();
        let frame = CameraFrame {
            pixels: window.into_raw(),
            width: 120,
            height: 120,
        };
        match running.locate(sequence, &frame)? {
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
