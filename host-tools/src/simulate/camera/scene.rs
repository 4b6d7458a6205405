//! Where a camera is, and what the light, the sensor and the vehicle do to its frame.

use eigenmark_core::landmark::Point;

use super::Motion;

/// Where the camera is and how bright it is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scene {
    /// Where the camera is on the map; the middle of the frame without tilt.
    pub place: Point,
    /// Heading in radians, clockwise from map-up to frame-up.
    pub heading_rad: f64,
    /// Altitude over nominal altitude.
    pub altitude_ratio: f64,
    /// Roll in radians, right side down: the camera looks left.
    pub roll_rad: f64,
    /// Pitch in radians, nose up: the camera looks ahead.
    pub pitch_rad: f64,
    /// Exponent of the brightness, 1 for none: level ↦ 255·(level/255)^gamma.
    pub gamma: f64,
    /// Standard deviation of the noise, in gray levels.
    pub noise: f64,
    /// Which way the camera goes during the exposure, in map pixels; `place` is the middle.
    pub motion_px: [f64; 2],
    /// What hides a part of the frame.
    pub occlusion: Option<Occlusion>,
}

/// A black square in a corner of the frame's square, such as a landing leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occlusion {
    /// The corner.
    pub corner: Corner,
    /// Share of the frame's square that it hides, 0 to 1.
    pub share: f64,
}

/// A corner of the frame's square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corner {
    /// Ahead, to the left.
    TopLeft,
    /// Ahead, to the right.
    TopRight,
    /// Behind, to the left.
    BottomLeft,
    /// Behind, to the right.
    BottomRight,
}

impl Scene {
    /// Exactly above a place: nominal heading, altitude and light, no tilt.
    #[must_use]
    pub fn nominal(place: Point) -> Self {
        Self {
            place,
            heading_rad: 0.0,
            altitude_ratio: 1.0,
            roll_rad: 0.0,
            pitch_rad: 0.0,
            gamma: 1.0,
            noise: 0.0,
            motion_px: [0.0; 2],
            occlusion: None,
        }
    }

    /// The scene some time later (or earlier).
    pub(super) fn later(&self, motion: &Motion, time_s: f64) -> Self {
        let [x, y] = motion.velocity_px_s;
        Self {
            place: Point {
                x_px: (f64::from(self.place.x_px) + time_s * x) as f32,
                y_px: (f64::from(self.place.y_px) + time_s * y) as f32,
            },
            heading_rad: self.heading_rad + time_s * motion.yaw_rad_s,
            altitude_ratio: self.altitude_ratio + time_s * motion.climb_per_s,
            roll_rad: self.roll_rad + time_s * motion.roll_rad_s,
            pitch_rad: self.pitch_rad + time_s * motion.pitch_rad_s,
            ..*self
        }
    }

    /// The scene at a share of the way that the camera goes, −½ to ½, standing still.
    pub(super) fn moved(&self, share: f64) -> Self {
        let [x, y] = self.motion_px;
        Self {
            place: Point {
                x_px: (f64::from(self.place.x_px) + share * x) as f32,
                y_px: (f64::from(self.place.y_px) + share * y) as f32,
            },
            motion_px: [0.0; 2],
            ..*self
        }
    }
}

impl Corner {
    /// All four.
    pub const ALL: [Self; 4] = [
        Self::TopLeft,
        Self::TopRight,
        Self::BottomLeft,
        Self::BottomRight,
    ];
}
