//! The vehicle: a blimp that is told where to head and how fast, and goes there as wind and inertia let it.
//!
//! **Notation.** Position in map pixels, velocities in meters per second along the map's axes (x right, y down), angles
//! in radians: heading clockwise from map-up, roll right side down, pitch nose up.

mod hull;
mod swing;

use eigenmark_core::{landmark::Point, mission};
use serde::{Deserialize, Serialize};

pub(crate) use hull::{Vehicle, wrapped};

/// How a blimp flies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Blimp {
    /// Airspeed at full speed, in meters per second.
    pub cruise_m_s: f64,
    /// Time constant of the airspeed ahead, at cruise, in seconds.
    pub surge_time_s: f64,
    /// Time constant of slipping sideways through the air, at cruise, in seconds.
    pub sway_time_s: f64,
    /// Largest rate of turn, in radians per second.
    pub turn_rad_s: f64,
    /// Rate of turn asked for per radian of heading error, per second.
    pub turn_gain: f64,
    /// Time constant of the rate of turn, in seconds.
    pub turn_time_s: f64,
    /// Bounds of the altitude over nominal altitude; it wanders between them.
    pub altitude_ratio: [f64; 2],
    /// How long the altitude takes to forget where it was, in seconds.
    pub altitude_time_s: f64,
    /// Standard deviation of roll and pitch in turbulent air, in radians.
    pub swing_rad: f64,
    /// Period of the swing, in seconds.
    pub swing_period_s: f64,
    /// Damping of the swing over critical damping.
    pub swing_damping: f64,
    /// Share of the plumb line's inclination under acceleration that the hull takes on.
    pub lean: f64,
    /// What roll and pitch never reach, in radians; zero keeps the vehicle level.
    pub tilt_limit_rad: f64,
}

impl Blimp {
    /// The same blimp kept at its altitude and level.
    #[must_use]
    pub fn level() -> Self {
        Self {
            altitude_ratio: [1.0; 2],
            tilt_limit_rad: 0.0,
            ..Self::default()
        }
    }
}

impl Default for Blimp {
    /// A blimp of a few meters: 6 m/s, 20° per second, altitude 0.85 to 1.2 of nominal, tilt to 8°.
    fn default() -> Self {
        Self {
            cruise_m_s: 6.0,
            surge_time_s: 3.0,
            sway_time_s: 1.0,
            turn_rad_s: 20.0_f64.to_radians(),
            turn_gain: 0.8,
            turn_time_s: 0.5,
            altitude_ratio: [0.85, 1.2],
            altitude_time_s: 20.0,
            swing_rad: 2.5_f64.to_radians(),
            swing_period_s: 4.0,
            swing_damping: 0.2,
            lean: 0.25,
            tilt_limit_rad: 8.0_f64.to_radians(),
        }
    }
}

/// What the vehicle is told to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Where to head, in radians clockwise from map-up: what the compass is to read. Without a compass, the heading itself.
    pub heading_rad: f32,
    /// How fast through the air, 0 to 1 of cruise.
    pub speed: f32,
}

impl From<mission::Command> for Command {
    fn from(command: mission::Command) -> Self {
        Self {
            heading_rad: command.heading_rad,
            speed: command.speed,
        }
    }
}

/// Where the vehicle really is, and how it moves. A recording need not tell more than the position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Where it is on the map, in map pixels.
    pub position_px: [f64; 2],
    /// Its velocity over the ground, in meters per second along the map's axes.
    #[serde(default)]
    pub velocity_m_s: [f64; 2],
    /// Its heading, in radians clockwise from map-up, in −π..=π.
    #[serde(default)]
    pub heading_rad: f64,
    /// How fast that grows, in radians per second.
    #[serde(default)]
    pub yaw_rad_s: f64,
    /// Actual over nominal altitude.
    #[serde(default = "one")]
    pub altitude_ratio: f64,
    /// How fast that grows, per second.
    #[serde(default)]
    pub climb_per_s: f64,
    /// Roll in radians, right side down.
    #[serde(default)]
    pub roll_rad: f64,
    /// How fast that grows, in radians per second.
    #[serde(default)]
    pub roll_rad_s: f64,
    /// Pitch in radians, nose up.
    #[serde(default)]
    pub pitch_rad: f64,
    /// How fast that grows, in radians per second.
    #[serde(default)]
    pub pitch_rad_s: f64,
}

/// The altitude ratio of a recording that tells none.
fn one() -> f64 {
    1.0
}

impl Truth {
    /// Standing still and level at nominal altitude, heading map-up.
    #[cfg(test)]
    pub(super) fn still(position_px: [f64; 2]) -> Self {
        Self {
            position_px,
            velocity_m_s: [0.0; 2],
            heading_rad: 0.0,
            yaw_rad_s: 0.0,
            altitude_ratio: 1.0,
            climb_per_s: 0.0,
            roll_rad: 0.0,
            roll_rad_s: 0.0,
            pitch_rad: 0.0,
            pitch_rad_s: 0.0,
        }
    }

    /// Where it is on the map.
    #[must_use]
    pub fn place(&self) -> Point {
        let [x, y] = self.position_px;
        Point {
            x_px: x as f32,
            y_px: y as f32,
        }
    }
}
