//! A short flight along straight legs, located frame by frame.

use eigenmark_core::{
    atlas::Atlas,
    landmark::Point,
    localizer::{Fix, Localizer},
};
use rand::RngExt;

use super::{Camera, Scene, seeded};
use crate::map::Map;

/// What the vehicle does between landmarks.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Distance between two frames, in map pixels.
    pub spacing_px: f64,
    /// Largest error of heading, in radians.
    pub heading_rad: f64,
    /// Largest relative error of altitude.
    pub altitude: f64,
    /// Standard deviation of the sensor's noise, in gray levels.
    pub noise: f64,
    /// Seed of the deviations.
    pub seed: u64,
}

/// One frame of a flight.
#[derive(Clone, Copy, Debug)]
pub struct Waypoint {
    /// Where the vehicle really was.
    pub place: Point,
    /// What the core said.
    pub fix: Option<Fix>,
}

/// Flies along straight legs through `places`, and locates every frame.
#[must_use]
pub fn fly(map: &Map, atlas: &Atlas<'_>, places: &[Point], flight: &Flight) -> Vec<Waypoint> {
    let camera = Camera::for_atlas(atlas);
    let mut frame = camera.frame();
    let mut localizer = Localizer::new(atlas.clone());
    let mut random = seeded(flight.seed, 0);
    let mut waypoints = Vec::new();
    for leg in places.windows(2) {
        let (dx, dy) = (
            f64::from(leg[1].x_px - leg[0].x_px),
            f64::from(leg[1].y_px - leg[0].y_px),
        );
        let frames = (dx.hypot(dy) / flight.spacing_px).ceil().max(1.0);
        for i in 0..frames as u32 {
            let t = (f64::from(i) / frames) as f32;
            let place = Point {
                x_px: leg[0].x_px + t * (leg[1].x_px - leg[0].x_px),
                y_px: leg[0].y_px + t * (leg[1].y_px - leg[0].y_px),
            };
            let scene = Scene {
                heading_rad: flight.heading_rad * random.random_range(-1.0..=1.0),
                altitude_ratio: 1.0 + flight.altitude * random.random_range(-1.0..=1.0),
                noise: flight.noise,
                ..Scene::nominal(place)
            };
            camera.render(map, &scene, &mut random, &mut frame);
            waypoints.push(Waypoint {
                place,
                fix: localizer.locate(&frame.as_frame()),
            });
        }
    }
    waypoints
}
