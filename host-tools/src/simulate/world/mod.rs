//! What surrounds the vehicle: the ground, the air and the light.
//!
//! **Notation.** The ground is the map, flat; x to the right, y down. Places are in map pixels, everything that moves
//! is in meters and seconds. Angles in radians, clockwise from map-up.

mod clouds;
mod light;
mod wind;

pub use clouds::Clouds;
pub use light::{Exposure, Light};
pub use wind::Wind;
pub(crate) use {clouds::Sky, light::Daylight, wind::Air};

use super::Camera;
use crate::map::Map;

/// Where flights take place, and with which camera.
#[derive(Clone, Copy, Debug)]
pub struct World<'a> {
    /// The ground.
    pub map: &'a Map,
    /// How large it is: meters per map pixel, positive.
    pub meters_per_px: f64,
    /// The camera; its footprint tells the nominal altitude.
    pub camera: Camera,
}

impl World<'_> {
    /// The altitude above the ground at which the camera's square covers its footprint, in meters.
    #[must_use]
    pub fn nominal_altitude_m(&self) -> f64 {
        let half_m = self.camera.footprint_px() / 2.0 * self.meters_per_px;
        half_m / (self.camera.field_of_view_rad() / 2.0).tan()
    }

    /// Whether a position is on the map.
    #[must_use]
    pub fn is_on_map(&self, [x, y]: [f64; 2]) -> bool {
        let (width, height) = (f64::from(self.map.width()), f64::from(self.map.height()));
        (0.0..width).contains(&x) && (0.0..height).contains(&y)
    }
}
