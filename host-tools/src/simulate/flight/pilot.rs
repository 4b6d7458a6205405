//! What steers, and what it thinks.

use eigenmark_core::{belief, landmark::Point, localizer::Fix};
use serde::{Deserialize, Serialize};

use crate::simulate::{CameraFrame, Command, Readings, Truth};

/// The longest word for a mission, in characters.
const MAX_WORD: usize = 100;

/// Whatever steers the vehicle.
pub trait Pilot {
    /// Decides on what to do until the next sight.
    fn decide(&mut self, sight: &Sight<'_>) -> Command;

    /// What it thinks after its last decision.
    fn report(&self) -> Report {
        Report::default()
    }

    /// Told the truth just before each decision: for pilots of tests, and to fly given ways. The vehicle's own software
    /// never knows.
    fn told(&mut self, _truth: &Truth) {}
}

/// What a pilot gets to see.
#[derive(Clone, Copy, Debug)]
pub struct Sight<'a> {
    /// Time since the start, in seconds.
    pub time_s: f32,
    /// Time since the sight before, in seconds.
    pub step_s: f32,
    /// The camera's frame, if it arrived.
    pub frame: Option<&'a CameraFrame>,
    /// What the instruments read.
    pub readings: Readings,
}

/// What a pilot thinks; each part may be absent. All numbers are finite.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Report {
    /// Where it takes itself to be.
    pub estimate: Option<Estimate>,
    /// Where path integration alone takes it to be.
    pub odometry: Option<Point>,
    /// What the frame alone said.
    pub fix: Option<Fix>,
    /// What it is doing, in a word of at most 100 characters.
    pub mission: Option<String>,
    /// It has arrived; this ends the flight.
    pub arrived: bool,
}

/// A position with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Where.
    pub position: Point,
    /// Variance along x, covariance, variance along y, in square map pixels.
    pub covariance_px2: Option<[f32; 3]>,
    /// Probability, 0 to 1, that this is about right.
    pub confidence: Option<f32>,
    /// Whether the pilot relies on it.
    pub confident: bool,
}

impl From<belief::Estimate> for Estimate {
    fn from(estimate: belief::Estimate) -> Self {
        Self {
            position: estimate.position,
            covariance_px2: Some(estimate.covariance_px2),
            confidence: Some(estimate.confidence),
            confident: estimate.is_confident(),
        }
    }
}

impl Report {
    /// The same without the parts in which a number is not finite, and with a short word for the mission.
    pub(crate) fn sane(self) -> Self {
        let is_point = |point: &Point| point.x_px.is_finite() && point.y_px.is_finite();
        let estimate = self
            .estimate
            .filter(|estimate| is_point(&estimate.position));
        let fix = self.fix.filter(|fix| {
            let numbers = [fix.distance, fix.second, fix.margin, fix.from_feature_space];
            is_point(&fix.place) && is_point(&fix.position) && numbers.iter().all(|x| x.is_finite())
        });
        let word = |mission: String| mission.chars().take(MAX_WORD).collect();
        Self {
            estimate: estimate.map(|estimate| Estimate {
                covariance_px2: estimate
                    .covariance_px2
                    .filter(|covariance| covariance.iter().all(|value| value.is_finite())),
                confidence: estimate
                    .confidence
                    .filter(|confidence| confidence.is_finite()),
                ..estimate
            }),
            odometry: self.odometry.filter(is_point),
            fix,
            mission: self.mission.map(word),
            arrived: self.arrived,
        }
    }
}
