//! Along a route.

use core::f32::consts::{FRAC_PI_2, TAU};

use super::{Command, Limits, Mission, Situation};
use crate::{
    belief::Estimate,
    landmark::Point,
    math::{heading_of, wrapped},
    route::{Leg, Router, TopologicalMap},
};

/// Slowest share of the cruising speed before the goal: a vehicle without way cannot be steered.
const LEAST_SPEED: f32 = 0.3;

/// Share of the cruising speed while it turns back.
const TURNING_SPEED: f32 = 0.5;

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
        let lookahead = self.limits.lookahead_px.max(f32::MIN_POSITIVE);
        let speed = (aim.left_px / lookahead).clamp(LEAST_SPEED, 1.0);
        let now = course_of(situation);
        let turn = wrapped(course - now);
        if turn.abs() <= FRAC_PI_2 {
            self.turn_back = None;
            return self.go(course, situation, speed);
        }
        // Once begun on one side, it ends there.
        let side = *self.turn_back.get_or_insert_with(|| {
            let inside = self.limits.way_inside(position);
            f32::copysign(1.0, inside.map_or(turn, |inside| wrapped(inside - now)))
        });
        self.go(now + FRAC_PI_2 * side, situation, speed.min(TURNING_SPEED));
    }

    /// Circles on, in ever wider circles.
    pub(super) fn search(&mut self, situation: &Situation, position: Point) {
        if self.searched_s == 0.0 {
            self.course_rad = course_of(situation);
            let inside = self
                .limits
                .way_inside(position)
                .map(|way| wrapped(way - self.course_rad));
            self.is_left = inside.is_some_and(|turn| turn < 0.0);
        }
        let circle_s = self.limits.circle_s.max(f32::MIN_POSITIVE);
        // Of no number, the smaller is the other one.
        let step_s = situation.step_s.max(0.0).min(circle_s);
        self.searched_s = (self.searched_s + step_s).min(f32::MAX);
        let turn = TAU * step_s / (circle_s + self.searched_s);
        self.course_rad = wrapped(self.course_rad + if self.is_left { -turn } else { turn });
        self.go(self.course_rad, situation, self.limits.searching_speed);
    }

    /// Heads into the wind so that the vehicle goes that way.
    fn go(&mut self, course_rad: f32, situation: &Situation, speed: f32) {
        self.command = Command {
            heading_rad: wrapped(course_rad - drift_of(situation)),
            speed,
        };
    }
}

impl Limits {
    /// The course away from the borders of the map that are near; `None` when none is.
    fn way_inside(&self, position: Point) -> Option<f32> {
        let map_px = self.map_px?;
        let [right, down] = [0, 1].map(|axis| {
            let at = if axis == 0 {
                position.x_px
            } else {
                position.y_px
            };
            let is_near = |room: f32| room < self.border_px;
            f32::from(is_near(at)) - f32::from(is_near(map_px[axis] - at))
        });
        (right != 0.0 || down != 0.0).then(|| heading_of(right, down))
    }
}

/// Drift angle as far as it is held against.
fn drift_of(situation: &Situation) -> f32 {
    wrapped(situation.drift_rad).clamp(-MAX_DRIFT_RAD, MAX_DRIFT_RAD)
}

/// The present course over ground.
fn course_of(situation: &Situation) -> f32 {
    wrapped(situation.heading_rad) + drift_of(situation)
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
