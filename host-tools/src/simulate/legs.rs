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
pub struct Legs {
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
pub fn fly_legs(map: &Map, atlas: &Atlas<'_>, places: &[Point], flight: &Legs) -> Vec<Waypoint> {
    let camera = Camera::for_atlas(atlas);
    let mut frame = camera.frame();
    let mut localizer = Localizer::new(atlas.clone());
    let mut random = seeded(flight.seed, 0);
    along(places, flight.spacing_px)
        .into_iter()
        .map(|place| {
            let scene = Scene {
                heading_rad: flight.heading_rad * random.random_range(-1.0..=1.0),
                altitude_ratio: 1.0 + flight.altitude * random.random_range(-1.0..=1.0),
                noise: flight.noise,
                ..Scene::nominal(place)
            };
            camera.render(map, &scene, &mut random, &mut frame);
            Waypoint {
                place,
                fix: localizer.locate(&frame.as_frame()),
            }
        })
        .collect()
}

/// Points at most `spacing_px` apart on straight legs through `places`, both ends included.
fn along(places: &[Point], spacing_px: f64) -> Vec<Point> {
    let mut points = Vec::new();
    for leg in places.windows(2) {
        let (dx, dy) = (leg[1].x_px - leg[0].x_px, leg[1].y_px - leg[0].y_px);
        let steps = (f64::from(dx.hypot(dy)) / spacing_px).ceil().max(1.0) as u16;
        points.extend((0..steps).map(|i| {
            let t = f32::from(i) / f32::from(steps);
            Point {
                x_px: leg[0].x_px + t * dx,
                y_px: leg[0].y_px + t * dy,
            }
        }));
    }
    points.extend(places.last());
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legs_are_divided_evenly_and_end_at_their_places() {
        let at = |x_px| Point { x_px, y_px: 5.0 };
        let points = along(&[at(0.0), at(8.0), at(14.0)], 4.0);
        let across: Vec<f32> = points.iter().map(|point| point.x_px).collect();
        assert_eq!(across, [0.0, 4.0, 8.0, 11.0, 14.0]);
        assert_eq!(along(&[at(3.0)], 4.0), [at(3.0)]);
    }
}
