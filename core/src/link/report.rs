//! What became of a frame, told to whoever watches.

use serde::{Deserialize, Serialize};

use crate::{
    belief::Estimate,
    localizer::Fix,
    mission::{Command, State},
};

/// What became of one frame of the camera. Angles and lengths as in [`navigator`](crate::navigator).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Number of the frame since the start, from 0.
    pub sequence: u32,
    /// Time since the start when the frame was taken, in milliseconds.
    pub time_ms: u32,
    /// Time since the frame before, in seconds.
    pub step_s: f32,
    /// From the frame to the command, in microseconds.
    pub took_us: u32,
    /// What the camera gave.
    pub camera: Camera,
    /// Heading that the autopilot told, in radians clockwise from map-up.
    pub heading_rad: Option<f32>,
    /// Roll and pitch that the autopilot told, in radians.
    pub tilt_rad: Option<(f32, f32)>,
    /// Actual over nominal altitude that the autopilot told.
    pub altitude_ratio: Option<f32>,
    /// Where the vehicle is believed to be.
    pub estimate: Option<Estimate>,
    /// Where path integration takes it to be, from where it started: x right, y down, in map pixels.
    pub odometry_px: [f32; 2],
    /// The nearest landmark.
    pub fix: Option<Fix>,
    /// Why there is no fix, or why it does not count.
    pub refusal: Option<Refusal>,
    /// Where the mission stands.
    pub state: State,
    /// What the autopilot was asked to do.
    pub command: Command,
    /// Damaged packets and messages of both links since the start.
    pub damaged: u32,
}

/// What the camera gave for a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Camera {
    /// A frame.
    Frame,
    /// None in time.
    Late,
    /// One with too few pixels.
    Short,
    /// One that was overwritten while it was read, or whose bytes make no picture.
    Torn,
    /// Nothing answers where it should be.
    Absent,
}

/// Why a fix does not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// No slot holds a valid atlas.
    NoAtlas,
    /// The camera gave no frame.
    NoFrame,
    /// The frame shows nothing to go by.
    Flat,
    /// The frame shows less than half of the view that landmarks are compared with.
    Outside,
    /// It looks like a view of somewhere else.
    Unknown,
}

impl Refusal {
    /// The reason in words, of at most 50 characters.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::NoAtlas => "no valid atlas in any slot",
            Self::NoFrame => "no frame from the camera",
            Self::Flat => "frame is flat",
            Self::Outside => "frame shows less than half of a view",
            Self::Unknown => "view is like nothing on the map",
        }
    }
}
