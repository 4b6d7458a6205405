//! Along a leg.

use micromath::F32Ext;

use super::{Command, Mission};
use crate::{belief::Estimate, landmark::Point, math::wrapped, route::Leg};

/// The integral of the cross-track error turns the course by at most this share of the lookahead: 45°.
const MAX_INTEGRAL: f32 = 1.0;

/// Slowest share of the cruising speed on a leg: a vehicle without way cannot be steered.
const LEAST_SPEED: f32 = 0.3;

impl Mission {
    /// Aims at a point ahead on the leg.
    pub(super) fn follow(&mut self, leg: &Leg, estimate: &Estimate, step_s: f32) {
        let (along, across) = on_leg(leg, estimate.position);
        let lookahead = self.limits.lookahead_px.max(f32::MIN_POSITIVE);
        let aim = across + self.integral_px;
        // Grows slowly while the error is large, so that it does not swing over.
        let rate = self.limits.integral_gain * across * lookahead * lookahead
            / (lookahead * lookahead + aim * aim);
        let reach = MAX_INTEGRAL * lookahead;
        self.integral_px = (self.integral_px + rate * step_s.max(0.0)).clamp(-reach, reach);
        // micromath's arc tangent is off by at most 0.3°, far less than headings are.
        let turn = F32Ext::atan2(-aim, lookahead);
        let rest = leg.length_px() - along;
        let past_end = rest < 0.0;
        let heading = if past_end {
            // Straight back to the end, which the wind keeps from it.
            let to_end = Leg {
                start: estimate.position,
                ..*leg
            };
            to_end.heading_rad()
        } else {
            leg.heading_rad() + turn
        };
        self.command = Command {
            heading_rad: wrapped(heading),
            speed: (rest.abs() / lookahead).clamp(LEAST_SPEED, 1.0),
        };
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
