//! Random small errors of pose and light around a landmark.

use std::f64::consts::PI;

use eigenmark_core::{atlas::Atlas, landmark::Point, landmark::lattice::place};
use rand::{Rng, RngExt};

use crate::{
    map::Map,
    simulate::{Camera, Scene},
};

/// The largest deviation in each respect; each is drawn uniformly up to it, to both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Rotation, in radians.
    pub rotation_rad: f64,
    /// Shift in x and in y, as a share of the footprint.
    pub shift: f64,
    /// Altitude ratio, and its reciprocal.
    pub altitude_ratio: f64,
    /// Gamma, and its reciprocal.
    pub gamma: f64,
    /// Standard deviation of the noise, in gray levels.
    pub noise: f64,
}

/// Draws that are tried before a landmark counts as having no room on the map.
const TRIES: usize = 2000;

impl Deviation {
    /// As slight as a vehicle hovering at the landmark with a compass and a barometer: what calibration uses.
    pub const SLIGHT: Self = Self {
        rotation_rad: 2.0 * PI / 180.0,
        shift: 0.02,
        altitude_ratio: 1.02,
        gamma: 1.05,
        noise: 2.0,
    };

    /// About what the report found its landmarks to tolerate (section 3.5).
    pub const MODERATE: Self = Self {
        rotation_rad: 20.0 * PI / 180.0,
        shift: 0.15,
        altitude_ratio: 1.2,
        gamma: 2.0,
        noise: 8.0,
    };

    /// A random scene near landmark `landmark` (0-based) that lies on the map entirely; draws that do not are drawn
    /// again. `None` when the landmark's window has no room to deviate.
    pub fn draw(
        &self,
        map: &Map,
        atlas: &Atlas<'_>,
        landmark: usize,
        random: &mut impl Rng,
    ) -> Option<Scene> {
        let record = atlas.landmarks().records().get(landmark)?;
        let center = place(atlas.lattices(), record.view)?;
        let footprint_px = f64::from(atlas.header().footprint_px);
        (0..TRIES)
            .map(|_| self.around(center, footprint_px, random))
            .find(|scene| Camera::is_inside(map, footprint_px, scene))
    }

    fn around(&self, center: Point, footprint_px: f64, random: &mut impl Rng) -> Scene {
        let mut side = || random.random_range(-1.0..=1.0);
        let reach = self.shift * footprint_px;
        Scene {
            place: Point {
                x_px: (f64::from(center.x_px) + reach * side()) as f32,
                y_px: (f64::from(center.y_px) + reach * side()) as f32,
            },
            heading_rad: self.rotation_rad * side(),
            altitude_ratio: self.altitude_ratio.powf(side()),
            gamma: self.gamma.powf(side()),
            noise: self.noise * side().abs(),
            roll_rad: 0.0,
            pitch_rad: 0.0,
        }
    }
}
