//! Recorded flights.
//!
//! A recording is a directory, whole or absent:
//!
//! | file | holds |
//! | --- | --- |
//! | `flight.json` | a [`Header`]: format and version, map, atlas, scale, camera, settings, how it ended |
//! | `log.jsonl` | one JSON object per step: time, readings, truth, command, report, and the name of its frame or null |
//! | `frames/` | the frames that arrived, as 8-bit gray PNG |
//!
//! A log that somebody else wrote, say of a real flight, needs of each step `time_s`, `step_s` and `frame`, and of the
//! truth, if it tells any, its `position_px`; the rest may be missing. Without truth there are no errors to measure.
//!
//! Numbers are written with as many digits as it takes to read the same bits again, so a pilot that sees a recording
//! thinks exactly what it thought in flight.
//!
//! **Limits.** Reading holds one line (at most 64 KiB) and one frame in memory; whatever the files contain, the answer
//! is a step or an error that names the file and the line.

mod header;
mod line;
mod read;
mod write;

use std::path::PathBuf;

pub use header::{Ground, Header};
pub use read::Recording;
pub use write::{Recorder, fly_recorded};

use super::{FlightError, Interrupted};
use crate::{map::MapError, output::OutputError};

const HEADER: &str = "flight.json";
const LOG: &str = "log.jsonl";
const FRAMES: &str = "frames";

/// Why a flight cannot be recorded, or a recording not be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The flight cannot be flown.
    #[error(transparent)]
    Flight(#[from] FlightError),
    /// The recording cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A file cannot be read.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// `flight.json` is not the header of a recording.
    #[error("{}: not the header of a recorded flight: {reason}", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A line of the log is not a step.
    #[error("{}: line {line} is not a step: {reason}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// A frame of a step cannot be read.
    #[error("{}: line {line}: {source}", path.display())]
    Frame {
        /// The log.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What is wrong with the frame.
        source: MapError,
    },
    /// The log does not have as many steps as the header says.
    #[error("{}: expected {expected} steps, found {found}", path.display())]
    Count {
        /// The log.
        path: PathBuf,
        /// How many the header says.
        expected: u64,
        /// How many there are.
        found: u64,
    },
}

impl From<Interrupted<OutputError>> for RecordError {
    fn from(error: Interrupted<OutputError>) -> Self {
        match error {
            Interrupted::Flight(error) => Self::Flight(error),
            Interrupted::Watcher(error) => Self::Output(error),
        }
    }
}

#[cfg(test)]
mod tests;
