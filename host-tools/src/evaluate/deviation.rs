//! Random small errors of pose and light around a landmark.

use std::f64::consts::PI;

use eigenmark_core::landmark::{Point, Survey};
use rand::{Rng, RngExt};
use serde::Serialize;

use crate::{
    map::Map,
    simulate::{Camera, Corner, Occlusion, Scene},
};

/// The largest deviation in each respect; each is drawn uniformly up to it, to both sides: angles, shifts, hidden shares
/// and noise themselves, altitude and gamma by their logarithm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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
    /// Roll and pitch, in radians.
    pub tilt_rad: f64,
    /// Way during the exposure in x and in y, as a share of the footprint.
    pub motion: f64,
    /// Hidden share of the frame's square.
    pub occlusion: f64,
}

/// Draws that are tried before a landmark counts as having no room on the map.
pub(super) const TRIES: usize = 2000;

impl Deviation {
    /// None at all.
    pub const NONE: Self = Self {
        rotation_rad: 0.0,
        shift: 0.0,
        altitude_ratio: 1.0,
        gamma: 1.0,
        noise: 0.0,
        tilt_rad: 0.0,
        motion: 0.0,
        occlusion: 0.0,
    };

    /// As slight as a vehicle hovering at the landmark with a compass and a barometer: what calibration uses.
    pub const SLIGHT: Self = Self {
        rotation_rad: 2.0 * PI / 180.0,
        shift: 0.02,
        altitude_ratio: 1.02,
        gamma: 1.05,
        noise: 2.0,
        ..Self::NONE
    };

    /// About what the report found its landmarks to tolerate (section 3.5).
    pub const MODERATE: Self = Self {
        rotation_rad: 20.0 * PI / 180.0,
        shift: 0.15,
        altitude_ratio: 1.2,
        gamma: 2.0,
        noise: 8.0,
        ..Self::NONE
    };

    /// A blimp in the wind with a compass that wanders: moderate, and tilted, in motion, and with something in the way.
    pub const ROUGH: Self = Self {
        tilt_rad: 8.0 * PI / 180.0,
        motion: 0.05,
        occlusion: 0.05,
        ..Self::MODERATE
    };

    /// What is left when a vehicle flies by its compass, its barometer and its horizon, and its frames were levelled by
    /// them.
    pub const FLIGHT: Self = Self {
        rotation_rad: 10.0 * PI / 180.0,
        shift: 0.15,
        altitude_ratio: 1.1,
        gamma: 2.0,
        noise: 6.0,
        tilt_rad: 2.0 * PI / 180.0,
        motion: 0.02,
        occlusion: 0.0,
    };

    /// The same, but at least so much that views between the headings and altitudes of a survey are among those around
    /// them.
    #[must_use]
    pub fn covering(self, survey: &Survey) -> Self {
        let between = |pair: &[f32]| f64::from(pair[1] / pair[0]).sqrt();
        let altitudes = survey.altitudes.windows(2).map(between);
        let rotation_rad = match survey.headings {
            1 => self.rotation_rad,
            headings => self.rotation_rad.max(PI / f64::from(headings)),
        };
        Self {
            rotation_rad,
            altitude_ratio: altitudes.fold(self.altitude_ratio, f64::max),
            ..self
        }
    }

    /// A random scene around a nominal one, of which `camera` shows nothing beyond the map, and how many were drawn until one
    /// was like that. `None` when none is, in many tries.
    pub fn draw(
        &self,
        map: &Map,
        camera: &Camera,
        nominal: &Scene,
        random: &mut impl Rng,
    ) -> Option<(Scene, usize)> {
        (1..=TRIES)
            .map(|tries| (self.around(nominal, camera.footprint_px(), random), tries))
            .find(|(scene, _)| camera.is_on_map(map, scene))
    }

    fn around(&self, nominal: &Scene, footprint_px: f64, random: &mut impl Rng) -> Scene {
        let center = nominal.place;
        let mut side = || random.random_range(-1.0..=1.0);
        let reach = self.shift * footprint_px;
        let place = Point {
            x_px: (f64::from(center.x_px) + reach * side()) as f32,
            y_px: (f64::from(center.y_px) + reach * side()) as f32,
        };
        let scene = Scene {
            heading_rad: nominal.heading_rad + self.rotation_rad * side(),
            altitude_ratio: nominal.altitude_ratio * self.altitude_ratio.powf(side()),
            gamma: self.gamma.powf(side()),
            noise: self.noise * side().abs(),
            ..Scene::nominal(place)
        };
        if self.tilt_rad == 0.0 && self.motion == 0.0 && self.occlusion == 0.0 {
            return scene;
        }
        let way = self.motion * footprint_px;
        Scene {
            roll_rad: self.tilt_rad * side(),
            pitch_rad: self.tilt_rad * side(),
            motion_px: [way * side(), way * side()],
            occlusion: Some(Occlusion {
                share: self.occlusion * side().abs(),
                corner: Corner::ALL[random.random_range(0..Corner::ALL.len())],
            }),
            ..scene
        }
    }
}
