//! A line of the log.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::simulate::{Command, Readings, Report, Step, Truth};

/// A step as the log holds it.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Line<'a> {
    time_s: f32,
    step_s: f32,
    #[serde(default)]
    kidnapped: bool,
    /// Name of the file in `frames`, or null.
    pub(super) frame: Option<Cow<'a, str>>,
    #[serde(default)]
    readings: Readings,
    #[serde(default)]
    truth: Option<Truth>,
    #[serde(default)]
    command: Command,
    #[serde(default)]
    report: Cow<'a, Report>,
}

impl<'a> Line<'a> {
    pub(super) fn of(step: &'a Step, frame: Option<&'a str>) -> Self {
        Self {
            time_s: step.time_s,
            step_s: step.step_s,
            kidnapped: step.kidnapped,
            frame: frame.map(Cow::Borrowed),
            readings: step.readings,
            truth: step.truth,
            command: step.command,
            report: Cow::Borrowed(&step.report),
        }
    }

    /// What is wrong with it, if read from a file.
    pub(super) fn check(&self) -> Result<(), String> {
        let Readings {
            heading_rad,
            tilt_rad,
            altitude_ratio,
        } = self.readings;
        let (roll, pitch) = tilt_rad.unzip();
        let readings = [heading_rad, roll, pitch, altitude_ratio];
        let told = [Some(self.time_s), Some(self.step_s)];
        if !readings
            .into_iter()
            .chain(told)
            .flatten()
            .all(f32::is_finite)
        {
            return Err("a number is out of range".to_owned());
        }
        // Only the name of a file, on every system.
        let is_name = |name: &str| {
            let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
            !name.is_empty()
                && name.len() <= 100
                && !name.starts_with('.')
                && name.chars().all(is_plain)
        };
        match &self.frame {
            Some(name) if !is_name(name) => {
                let found: String = name.chars().take(100).collect();
                Err(format!(
                    "expected the name of a file in frames, found {found:?}"
                ))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn into_step(self) -> Step {
        Step {
            time_s: self.time_s,
            step_s: self.step_s,
            kidnapped: self.kidnapped,
            truth: self.truth,
            readings: self.readings,
            seen: self.frame.is_some(),
            command: self.command,
            report: self.report.into_owned(),
        }
    }
}
