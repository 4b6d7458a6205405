//! Flights: the vehicle over the map in a closed loop with a pilot.
//!
//! ```text
//!   ground, light ─► camera, sensor ─► frame or none ─┐
//!                                                     ├─► Sight ─► Pilot ─► Command ─► vehicle ─► truth
//!   truth ─────────► instruments ────► readings ──────┘                                 ▲
//!                                                                                 wind ─┘
//! ```
//!
//! Air and vehicle are integrated in steps of at most 10 ms; the pilot is asked once per frame. What it thinks is kept
//! beside the truth.

mod fly;
mod guided;
mod pilot;
mod settings;
mod statistics;
mod totals;
mod way;

use serde::{Deserialize, Serialize};

pub use fly::{FlightError, Interrupted, fly, fly_all, fly_watched};
pub use guided::Guided;
pub use pilot::{Estimate, Pilot, Report, Sight};
pub use settings::{FlightSettings, Kidnapping};
pub use statistics::Statistics;
pub use totals::Totals;
pub use way::drawn_way;

use super::{Command, Readings, Truth};

/// A flight from start to end.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// What it was flown with.
    pub settings: FlightSettings,
    /// One step per frame.
    pub steps: Vec<Step>,
    /// How it ended.
    pub end: End,
}

/// What happened at one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Time since the start, in seconds.
    pub time_s: f32,
    /// Time since the step before, in seconds.
    pub step_s: f32,
    /// Whether the vehicle was carried elsewhere just before.
    pub kidnapped: bool,
    /// Where it really was, when that is known.
    pub truth: Option<Truth>,
    /// What the instruments read.
    pub readings: Readings,
    /// Whether a frame arrived.
    pub seen: bool,
    /// What the pilot commanded.
    pub command: Command,
    /// What the pilot thought.
    pub report: Report,
}

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// The pilot said that it had arrived, and it had.
    Arrived,
    /// The pilot said that it had arrived, and it had not.
    Mistaken,
    /// The place below the vehicle was no longer on the map.
    LeftMap,
    /// The time was up.
    OutOfTime,
}

#[cfg(test)]
mod tests;
