//! Along a route.

use super::{Command, Mission, Situation};
use crate::{
    belief::Estimate,
    landmark::Point,
    math::{heading_of, wrapped},
    route::{Leg, Router, TopologicalMap},
};

/// Slowest share of the cruising speed before the goal: a vehicle without way cannot be steered.
const LEAST_SPEED: f32 = 0.3;

/// Headings are turned into the wind by at most this, in radians: 80°.
const MAX_DRIFT_RAD: f32 = 1.4;

/// Legs that are looked ahead, at most.
const MAX_LEGS_AHEAD: usize = 16;

/// Where to go next.
pub(super) struct Aim {
    point: Point,
    /// Length of the route from there to the end that is seen, in map pixels.
    left_px: f32,
}

impl Mission {
    /// The point of the route that is a lookahead ahead.
    pub(super) fn aim<const PLACES: usize>(
        &self,
        leg: &Leg,
        position: Point,
        map: &TopologicalMap<'_>,
        router: &Router<PLACES>,
    ) -> Aim {
        let mut leg = *leg;
        let mut ahead = on_leg(&leg, position).0.max(0.0) + self.limits.lookahead_px;
        for _ in 0..MAX_LEGS_AHEAD {
            let length = leg.length_px();
            if ahead < length {
                return on(&leg, ahead / length);
            }
            let Some(next) = router.next_leg(map, leg.to) else {
                break;
            };
            ahead -= length;
            leg = next;
        }
        Aim {
            point: leg.end,
            left_px: position.distance_px(leg.end),
        }
    }

    /// The point of a leg that is a lookahead ahead, or its end.
    pub(super) fn aim_on(&self, leg: &Leg, position: Point) -> Aim {
        let length = leg.length_px();
        let ahead = on_leg(leg, position).0.max(0.0) + self.limits.lookahead_px;
        on(leg, if ahead < length { ahead / length } else { 1.0 })
    }

    /// Heads for a point.
    pub(super) fn pursue(&mut self, aim: &Aim, situation: &Situation, estimate: &Estimate) {
        let position = estimate.position;
        let course = heading_of(
            aim.point.x_px - position.x_px,
            aim.point.y_px - position.y_px,
        );
        let drift = wrapped(situation.drift_rad).clamp(-MAX_DRIFT_RAD, MAX_DRIFT_RAD);
        let lookahead = self.limits.lookahead_px.max(f32::MIN_POSITIVE);
        self.command = Command {
            heading_rad: wrapped(course - drift),
            speed: (aim.left_px / lookahead).clamp(LEAST_SPEED, 1.0),
        };
    }
}

/// A share of a leg from its start, with more of the route after it.
fn on(leg: &Leg, share: f32) -> Aim {
    let point = Point {
        x_px: leg.start.x_px + share * (leg.end.x_px - leg.start.x_px),
        y_px: leg.start.y_px + share * (leg.end.y_px - leg.start.y_px),
    };
    Aim {
        point,
        left_px: f32::MAX,
    }
}

/// How far along a leg, and to the right of it, a point is, in map pixels.
pub(super) fn on_leg(leg: &Leg, point: Point) -> (f32, f32) {
    let length = leg.length_px();
    let (x, y) = (point.x_px - leg.start.x_px, point.y_px - leg.start.y_px);
    if length <= 0.0 {
        return (0.0, 0.0);
    }
    let (east, south) = (
        (leg.end.x_px - leg.start.x_px) / length,
        (leg.end.y_px - leg.start.y_px) / length,
    );
    (x * east + y * south, y * east - x * south)
}
