//! Reports and pictures as a recording that `simulate --replay` reads.
//!
//! A report becomes a step; its frame is on record when the picture came whole. Pictures come after their reports, so
//! steps wait for them for a while. There is no truth in it.

use std::{collections::VecDeque, path::Path, time::Duration};

use eigenmark_core::{atlas::Atlas, landmark::Point, link::Report, slots::Setup};

use super::Picture;
use crate::{
    output::OutputError,
    simulate::{self, CameraFrame, Estimate, Ground, Header, Readings, Recorder, Step},
};

/// Steps that wait for their pictures, at most: ten seconds at ten reports per second, or two megabytes of frames.
const MAX_WAITING: usize = 100;

/// Size of frames when no picture came, in pixels.
const DEFAULT_FRAME_PX: [u16; 2] = [160, 120];

/// A flight that is being logged; nothing is left of one that is not finished.
#[derive(Debug)]
pub struct FlightLog {
    recorder: Recorder,
    waiting: VecDeque<Waiting>,
    frame_px: Option<[u16; 2]>,
    last: Option<Last>,
    steps: u64,
    frames: u64,
}

/// The last step.
#[derive(Clone, Copy, Debug)]
struct Last {
    sequence: u32,
    time_ms: u32,
    time_s: f64,
    now: Duration,
}

#[derive(Debug)]
struct Waiting {
    sequence: u32,
    step: Step,
    frame: Option<CameraFrame>,
}

impl FlightLog {
    /// Begins a log that will have the name `target`, of a flight over `map` by `atlas`.
    ///
    /// # Errors
    /// When that cannot be written, or exists and is not empty.
    pub fn create(target: &Path, map: Ground, atlas: &Atlas<'_>) -> Result<Self, OutputError> {
        let header = Header::of_board(map, atlas, Setup::default(), DEFAULT_FRAME_PX);
        Ok(Self {
            recorder: Recorder::create(target, header)?,
            waiting: VecDeque::new(),
            frame_px: None,
            last: None,
            steps: 0,
            frames: 0,
        })
    }

    /// Adds a report that came at `now`.
    ///
    /// # Errors
    /// When a step cannot be written.
    pub fn report(
        &mut self,
        report: &Report,
        restarted: bool,
        now: Duration,
    ) -> Result<(), OutputError> {
        // From now on, other reports have the numbers of those that wait.
        let may_wait = if restarted { 0 } else { MAX_WAITING };
        while self.waiting.len() >= may_wait.max(1) {
            self.write_first()?;
        }
        let step = self.step(report, restarted, now);
        self.waiting.push_back(Waiting {
            sequence: report.sequence,
            step,
            frame: None,
        });
        self.steps += 1;
        Ok(())
    }

    /// Adds a picture to the step of its report, if that waits for one; all pictures must have the size of the first.
    pub fn picture(&mut self, picture: &Picture) {
        let size = [picture.frame.width, picture.frame.height];
        let of_report = |it: &&mut Waiting| it.sequence == picture.sequence && it.frame.is_none();
        let Some(waiting) = self.waiting.iter_mut().find(of_report) else {
            return;
        };
        if *self.frame_px.get_or_insert(size) == size {
            waiting.frame = Some(picture.frame.clone());
            self.frames += 1;
        }
    }

    /// Steps, and how many of them have frames.
    #[must_use]
    pub fn counts(&self) -> [u64; 2] {
        [self.steps, self.frames]
    }

    /// Ends the log: from now on it is there. A board that said who it is has told its setup and its atlas's CRC.
    ///
    /// # Errors
    /// When it cannot be written, or something got its name meanwhile.
    pub fn finish(mut self, setup: Option<Setup>, crc: Option<u32>) -> Result<(), OutputError> {
        while !self.waiting.is_empty() {
            self.write_first()?;
        }
        let header = self.recorder.header_mut();
        if let Some(setup) = setup.filter(Setup::is_valid) {
            header.meters_per_px = setup.meters_per_px.into();
            header.field_of_view_rad = setup.field_of_view_rad.into();
        }
        header.atlas_crc = crc.or(header.atlas_crc);
        header.frame_px = self.frame_px.unwrap_or(DEFAULT_FRAME_PX);
        self.recorder.finish(None)
    }

    fn write_first(&mut self) -> Result<(), OutputError> {
        match self.waiting.pop_front() {
            Some(first) => self.recorder.add(&first.step, first.frame.as_ref()),
            None => Ok(()),
        }
    }

    fn step(&mut self, report: &Report, restarted: bool, now: Duration) -> Step {
        let seconds = |ms: u32| f64::from(ms) / 1000.0;
        let told = if report.step_s.is_finite() {
            report.step_s
        } else {
            0.0
        };
        let (time_s, step_s) = match self.last {
            None => (seconds(report.time_ms), told),
            // Its clock began anew: ours says how long that took.
            Some(last) if restarted => {
                let passed_s = now.saturating_sub(last.now).as_secs_f64();
                (last.time_s + passed_s, passed_s as f32)
            }
            Some(last) => {
                let passed_s = seconds(report.time_ms.saturating_sub(last.time_ms));
                let is_next = report.sequence == last.sequence.wrapping_add(1);
                let step_s = if is_next { told } else { passed_s as f32 };
                (last.time_s + passed_s, step_s)
            }
        };
        self.last = Some(Last {
            sequence: report.sequence,
            time_ms: report.time_ms,
            time_s,
            now,
        });
        let finite = |value: &f32| value.is_finite();
        let [x_px, y_px] = report.odometry_px;
        let command = simulate::Command::from(report.command);
        let is_command = command.heading_rad.is_finite() && command.speed.is_finite();
        let thought = simulate::Report {
            estimate: report.estimate.map(Estimate::from),
            odometry: Some(Point { x_px, y_px }),
            fix: report.fix,
            mission: Some(report.state.name().to_owned()),
            arrived: false,
        };
        Step {
            time_s: time_s as f32,
            step_s,
            kidnapped: false,
            truth: None,
            readings: Readings {
                heading_rad: report.heading_rad.filter(finite),
                tilt_rad: report
                    .tilt_rad
                    .filter(|(roll, pitch)| finite(roll) && finite(pitch)),
                altitude_ratio: report.altitude_ratio.filter(finite),
            },
            seen: false,
            command: if is_command {
                command
            } else {
                simulate::Command::default()
            },
            report: thought.sane(),
        }
    }
}
