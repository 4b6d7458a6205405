//! Ways at random, for flights that are to see much of a map.

use eigenmark_core::landmark::Point;
use rand::RngExt;

use crate::simulate::{World, chance::Cause};

/// The least distance to the map's edges, in views' sides: whatever the heading, a level view at 1.2 times the nominal
/// altitude is on the map, with some room for turns.
const MARGIN: f64 = 1.0;

/// What of a map's side the margin is at most.
const MAX_MARGIN: f64 = 0.3;

/// The shortest leg, as a share of the longest possible.
const SHORTEST: f64 = 0.25;

/// Points that are drawn before one is taken that is too near.
const TRIES: u32 = 100;

/// The most points of a way.
const MAX_POINTS: usize = 10_000;

/// A way of straight legs, at least `length_m` long, that keeps away from the map's edges.
#[must_use]
pub fn drawn_way(world: &World<'_>, length_m: f64, seed: u64) -> Vec<Point> {
    let mut random = Cause::Way.random(seed, 0);
    let sides = [world.map.width(), world.map.height()].map(f64::from);
    let margin = |side: f64| (MARGIN * world.camera.footprint_px()).min(MAX_MARGIN * side);
    let rooms = sides.map(|side| side - 2.0 * margin(side));
    let shortest_px = SHORTEST * rooms[0].hypot(rooms[1]);
    let mut drawn = || {
        let [x, y] = [0, 1]
            .map(|axis: usize| margin(sides[axis]) + rooms[axis] * random.random_range(0.0..=1.0));
        Point {
            x_px: x as f32,
            y_px: y as f32,
        }
    };
    let mut last = drawn();
    let mut way = vec![last];
    let mut length_px = 0.0;
    while length_px * world.meters_per_px < length_m && way.len() < MAX_POINTS {
        let distance = |to: Point| f64::from((to.x_px - last.x_px).hypot(to.y_px - last.y_px));
        let mut next = drawn();
        for _ in 1..TRIES {
            if distance(next) >= shortest_px {
                break;
            }
            next = drawn();
        }
        length_px += distance(next);
        way.push(next);
        last = next;
    }
    way
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{map::Map, simulate::Camera};

    #[test]
    fn ways_are_long_enough_on_the_map_and_drawn_from_the_seed() {
        let map = Map::from_luminance("gray", image::GrayImage::new(800, 400));
        let world = World {
            map: &map,
            meters_per_px: 0.5,
            camera: Camera::sized(80, 60, 100.0),
        };
        for seed in 0..20 {
            let way = drawn_way(&world, 1_000.0, seed);
            let legs = way
                .windows(2)
                .map(|leg| f64::from((leg[1].x_px - leg[0].x_px).hypot(leg[1].y_px - leg[0].y_px)));
            let legs: Vec<f64> = legs.collect();
            assert!(legs.iter().sum::<f64>() >= 2_000.0);
            assert!(legs.iter().all(|&leg| leg > 150.0));
            for point in &way {
                assert!((100.0..=700.0).contains(&point.x_px));
                assert!((100.0..=300.0).contains(&point.y_px));
            }
            assert_eq!(way, drawn_way(&world, 1_000.0, seed));
            assert_ne!(way, drawn_way(&world, 1_000.0, seed + 1));
        }
    }
}
