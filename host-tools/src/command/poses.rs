//! The poses of frames: a CSV file with a header line and the columns `frame`, `heading_deg`, `altitude_ratio`, and, if
//! the camera was tilted, `roll_deg` and `pitch_deg`; in any order, beside any others.

use std::{
    fs::File,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail, ensure};
use eigenmark_core::preprocess::{Pose, PoseError};

const FRAME: &str = "frame";
const HEADING: &str = "heading_deg";
const ALTITUDE: &str = "altitude_ratio";
const ROLL: &str = "roll_deg";
const PITCH: &str = "pitch_deg";

/// What a CSV file says, in its order.
#[derive(Debug)]
pub struct Poses {
    path: PathBuf,
    rows: Vec<(String, Pose)>,
}

/// A pose in the units that people use.
#[derive(Clone, Copy, Debug)]
pub struct Degrees {
    pub heading: f64,
    pub altitude_ratio: f64,
    pub roll: f64,
    pub pitch: f64,
    pub field_of_view: f64,
}

impl Degrees {
    pub fn pose(&self) -> Result<Pose, PoseError> {
        let radians = |degrees: f64| degrees.to_radians() as f32;
        Pose::new(radians(self.heading), self.altitude_ratio as f32)?.tilted(
            radians(self.roll),
            radians(self.pitch),
            radians(self.field_of_view),
        )
    }
}

impl Poses {
    /// Reads a file; `field_of_view` is the camera's, in degrees.
    pub fn read(path: &Path, field_of_view: f64) -> anyhow::Result<Self> {
        let name = path.display();
        let file = File::open(path).with_context(|| format!("{name}: cannot read the poses"))?;
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(file);
        let header = reader.headers().with_context(|| name.to_string())?.clone();
        let position = |column: &str| header.iter().position(|found| found == column);
        let needed = |column: &str| {
            position(column).with_context(|| {
                let found = header.iter().collect::<Vec<_>>().join(",");
                format!("{name}: line 1: expected a column {column}, found '{found}'")
            })
        };
        let (frame, heading, altitude) = (needed(FRAME)?, needed(HEADING)?, needed(ALTITUDE)?);
        let (roll, pitch) = (position(ROLL), position(PITCH));

        let mut rows: Vec<(String, Pose)> = Vec::new();
        for record in reader.records() {
            let record = record.with_context(|| name.to_string())?;
            let line = record.position().map_or(0, csv::Position::line);
            ensure!(
                record.len() == header.len(),
                "{name}: line {line}: expected {} columns, found {}",
                header.len(),
                record.len()
            );
            let cell = |column: usize| record.get(column).unwrap_or_default();
            let number = |column: usize| -> anyhow::Result<f64> {
                cell(column).parse().map_err(|_| {
                    let (column, found) = (&header[column], cell(column));
                    anyhow::anyhow!(
                        "{name}: line {line}: {column}: expected a number, found '{found}'"
                    )
                })
            };
            let degrees = Degrees {
                heading: number(heading)?,
                altitude_ratio: number(altitude)?,
                roll: roll.map_or(Ok(0.0), number)?,
                pitch: pitch.map_or(Ok(0.0), number)?,
                field_of_view,
            };
            let pose = degrees
                .pose()
                .with_context(|| format!("{name}: line {line}"))?;
            let frame = cell(frame);
            ensure!(
                !rows.iter().any(|(known, _)| known == frame),
                "{name}: line {line}: expected one pose per frame, found {frame} again"
            );
            rows.push((frame.to_owned(), pose));
        }
        if rows.is_empty() {
            bail!("{name}: expected at least one frame, found none");
        }
        Ok(Self {
            path: path.to_owned(),
            rows,
        })
    }

    /// Every frame: its name in the file, where it lies, and its pose.
    pub fn all(self) -> Vec<(String, PathBuf, Pose)> {
        let folder = self.path.parent().unwrap_or(Path::new("")).to_owned();
        self.rows
            .into_iter()
            .map(|(name, pose)| {
                let path = folder.join(&name);
                (name, path, pose)
            })
            .collect()
    }

    /// The pose of a frame by its name as it is, or by its file name.
    pub fn of(&self, frame: &str) -> anyhow::Result<Pose> {
        let file_name = Path::new(frame).file_name().and_then(|name| name.to_str());
        [Some(frame), file_name]
            .into_iter()
            .flatten()
            .find_map(|name| self.rows.iter().find(|(row, _)| row == name))
            .map(|&(_, pose)| pose)
            .with_context(|| {
                format!(
                    "{}: expected a line for the frame {frame}, found none",
                    self.path.display()
                )
            })
    }
}
