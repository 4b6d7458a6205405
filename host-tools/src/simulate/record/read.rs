//! Reading a recording, and showing it to a pilot.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read},
    path::{Path, PathBuf},
};

use super::{FRAMES, HEADER, Header, LOG, RecordError, line::Line};
use crate::{
    map::load,
    simulate::{CameraFrame, Pilot, Sight, Step},
};

/// The longest header, in bytes.
const MAX_HEADER_BYTES: u64 = 1 << 20;

/// The longest line of a log, in bytes.
const MAX_LINE_BYTES: u64 = 1 << 16;

/// A recorded flight.
#[derive(Clone, Debug)]
pub struct Recording {
    directory: PathBuf,
    header: Header,
}

impl Recording {
    /// Opens the recording in a directory.
    ///
    /// # Errors
    /// When there is none, or its header is not one.
    pub fn open(directory: &Path) -> Result<Self, RecordError> {
        let path = directory.join(HEADER);
        let file = open(&path)?;
        let mut bytes = Vec::new();
        file.take(MAX_HEADER_BYTES + 1)
            .read_to_end(&mut bytes)
            .map_err(reading(&path))?;
        let header = if bytes.len() as u64 > MAX_HEADER_BYTES {
            Err(format!("longer than {MAX_HEADER_BYTES} bytes"))
        } else {
            let header = serde_json::from_slice(&bytes).map_err(|error| error.to_string());
            header.and_then(|header: Header| header.check().map(|()| header))
        };
        Ok(Self {
            directory: directory.to_owned(),
            header: header.map_err(|reason| RecordError::Header { path, reason })?,
        })
    }

    /// What it says about the whole flight.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Shows the recorded sights to a pilot, whatever it commands. Gives the recorded steps with what this pilot
    /// commanded and thought.
    ///
    /// # Errors
    /// When a file cannot be read, is damaged, or is not what the header says.
    pub fn replay(&self, pilot: &mut impl Pilot) -> Result<Vec<Step>, RecordError> {
        let mut steps = Vec::new();
        self.each(|mut step, frame| {
            if let Some(truth) = &step.truth {
                pilot.told(truth);
            }
            step.command = pilot.decide(&Sight {
                time_s: step.time_s,
                step_s: step.step_s,
                frame,
                readings: step.readings,
            });
            step.report = pilot.report().sane();
            steps.push(step);
        })?;
        Ok(steps)
    }

    /// The steps as they were recorded.
    ///
    /// # Errors
    /// When a file cannot be read, is damaged, or is not what the header says.
    pub fn steps(&self) -> Result<Vec<Step>, RecordError> {
        let mut steps = Vec::new();
        self.each(|step, _| steps.push(step))?;
        Ok(steps)
    }

    /// Hands over each step with its frame, one after another.
    ///
    /// # Errors
    /// When a file cannot be read, is damaged, or is not what the header says.
    pub fn each(
        &self,
        mut show: impl FnMut(Step, Option<&CameraFrame>),
    ) -> Result<(), RecordError> {
        let path = self.directory.join(LOG);
        let mut log = BufReader::new(open(&path)?);
        let mut text = Vec::new();
        let expected = self.header.steps;
        for line in 1.. {
            text.clear();
            let length = (&mut log)
                .take(MAX_LINE_BYTES + 1)
                .read_until(b'\n', &mut text)
                .map_err(reading(&path))? as u64;
            if length == 0 {
                let found = line - 1;
                if found == expected {
                    return Ok(());
                }
                return Err(RecordError::Count {
                    path,
                    expected,
                    found,
                });
            }
            let damaged = |reason: String| RecordError::Line {
                path: path.clone(),
                line,
                reason,
            };
            if length > MAX_LINE_BYTES {
                return Err(damaged(format!("longer than {MAX_LINE_BYTES} bytes")));
            }
            if line > expected {
                return Err(damaged(format!("expected {expected} lines")));
            }
            let parsed: Line<'_> =
                serde_json::from_slice(&text).map_err(|error| damaged(error.to_string()))?;
            parsed.check().map_err(damaged)?;
            let frame = match &parsed.frame {
                Some(name) => Some(self.frame(&path, line, name)?),
                None => None,
            };
            show(parsed.into_step(), frame.as_ref());
        }
        Ok(())
    }

    /// The frame of a step, checked.
    fn frame(&self, log: &Path, line: u64, name: &str) -> Result<CameraFrame, RecordError> {
        let path = self.directory.join(FRAMES).join(name);
        let picture = load(&path).map_err(|source| RecordError::Frame {
            path: log.to_owned(),
            line,
            source,
        })?;
        let [width, height] = self.header.frame_px;
        if [picture.width(), picture.height()] != [width, height].map(u32::from) {
            return Err(RecordError::Line {
                path: log.to_owned(),
                line,
                reason: format!(
                    "expected frames of {width}×{height} pixels, found {}×{} in {}",
                    picture.width(),
                    picture.height(),
                    path.display()
                ),
            });
        }
        Ok(CameraFrame {
            pixels: picture.into_raw(),
            width,
            height,
        })
    }
}

fn open(path: &Path) -> Result<File, RecordError> {
    File::open(path).map_err(reading(path))
}

fn reading(path: &Path) -> impl Fn(io::Error) -> RecordError + use<> {
    let path = path.to_owned();
    move |source| RecordError::Read {
        path: path.clone(),
        source,
    }
}
