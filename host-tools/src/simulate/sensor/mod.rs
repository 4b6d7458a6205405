//! From what the camera sees to the frame that arrives: vignetting, clouds' shadows, exposure, noise; rows read one
//! after another while the vehicle moves; frames that are torn or never arrive.
//!
//! **Order.** Light is what the map shows, times what vignetting, clouds and gain leave of it, cut at white; then come
//! gamma and noise. A frame whose time it is not to arrive is not rendered at all.
//!
//! **Chance.** Each frame has generators of its own: what happens to one frame changes no other.

mod imager;
mod vignette;

use serde::{Deserialize, Serialize};

pub(crate) use imager::Imager;

use super::Shutter;

/// What the camera's sensor and its link do to frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Share of the light that is lost in the corners of the frame, 0 to 1; towards them it grows as 1 − cos⁴ of the angle to
    /// the axis.
    pub vignetting: f64,
    /// Standard deviation of the noise, in gray levels.
    pub noise: f64,
    /// When rows gather light.
    pub shutter: Shutter,
    /// Share of the frames that do not arrive.
    pub dropped: f64,
    /// Share of the frames whose lower part is the one of the frame before.
    pub torn: f64,
}

impl Sensor {
    /// A sensor that shows the map as it is.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            vignetting: 0.0,
            noise: 0.0,
            shutter: Shutter::INSTANT,
            dropped: 0.0,
            torn: 0.0,
        }
    }
}

impl Default for Sensor {
    /// A small rolling-shutter camera in daylight: exposure 8 ms, readout 25 ms, noise of 3 levels, 30 % less light in
    /// the corners; 5 % of its frames are lost, 1 % torn.
    fn default() -> Self {
        Self {
            vignetting: 0.3,
            noise: 3.0,
            shutter: Shutter {
                exposure_s: 0.008,
                readout_s: 0.025,
            },
            dropped: 0.05,
            torn: 0.01,
        }
    }
}

#[cfg(test)]
mod tests;
