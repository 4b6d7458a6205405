//! Where the vehicle is in the plane of path integration, and how it moved.

use nalgebra::Matrix4;

use super::similarity::{Agreement, Similarity};
use crate::math::{MAX_ANGLE_RAD, sin_cos};

/// Covariance of x, y (sides), heading (radians) and the logarithm of the altitude ratio, in this order; or of
/// forward, right, yaw and the logarithm of the scale.
pub type Covariance = Matrix4<f32>;

/// A place, heading and altitude. Axes are those of the map: x right, y down; one *side* is what the frame's centered
/// square covers at altitude ratio 1, so sides times an atlas's footprint are map pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Placement {
    /// To the right on the map, in sides.
    pub x: f32,
    /// Down on the map, in sides.
    pub y: f32,
    /// Heading in radians, clockwise from map-up to frame-up, −π to π.
    pub heading_rad: f32,
    /// Actual over nominal altitude; positive.
    pub altitude_ratio: f32,
}

/// What happened between two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacement {
    /// The way along the heading of the earlier frame, in sides.
    pub forward: f32,
    /// The way across, to the right, in sides.
    pub right: f32,
    /// The turn, clockwise, in radians.
    pub yaw_rad: f32,
    /// Altitude at the later frame over altitude at the earlier.
    pub scale: f32,
    /// Of forward, right, yaw and the logarithm of the scale: the sum of those of both frames' fits. That is an upper
    /// bound, for part of their errors is the same: in slow flight the variance is a tenth of it, with a dozen pixels
    /// between two frames two thirds. Errors of successive displacements cancel, too: the covariance of many of them is
    /// [`Odometry::covariance`](super::Odometry::covariance), not their sum.
    pub covariance: Covariance,
    /// Corners that were found again.
    pub tracked: u8,
    /// Those of them that agree on the displacement.
    pub inliers: u8,
}

impl Placement {
    /// The origin, heading up, at nominal altitude.
    pub const ORIGIN: Self = Self {
        x: 0.0,
        y: 0.0,
        heading_rad: 0.0,
        altitude_ratio: 1.0,
    };

    /// Whether all numbers are finite, the heading is within [`MAX_ANGLE_RAD`], and the altitude is positive.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let numbers = [self.x, self.y, self.altitude_ratio];
        numbers.iter().all(|number| number.is_finite())
            && self.heading_rad.abs() <= MAX_ANGLE_RAD
            && self.altitude_ratio > 0.0
    }

    /// From ground positions below the vehicle to the plane.
    pub(super) fn similarity(&self) -> Similarity {
        let (sin, cos) = sin_cos(self.heading_rad);
        Similarity {
            turn: [self.altitude_ratio * cos, self.altitude_ratio * sin],
            shift: [self.x, self.y],
        }
    }

    pub(super) fn of(similarity: &Similarity) -> Self {
        let ([c, s], [x, y]) = (similarity.turn, similarity.shift);
        Self {
            x,
            y,
            heading_rad: libm::atan2f(s, c),
            altitude_ratio: crate::math::sqrt(similarity.scale_squared()),
        }
    }
}

/// The covariance of a similarity that was fit to pairs whose residuals are independent.
pub(super) fn of_fit(agreement: &Agreement) -> Covariance {
    let count = agreement.inliers.count_ones().max(1) as f32;
    let scale = agreement.similarity.scale_squared();
    // Of the angle, and of the logarithm of the scale.
    let turn = agreement.variance / (scale * agreement.spread);
    // The vehicle is as far from the middle of the points as this, so a turn moves it.
    let [x, y] = agreement.similarity.rotate(agreement.middle);
    let place = agreement.variance / count + turn * (x * x + y * y);
    let (along, across) = (-turn * x, -turn * y);
    Covariance::new(
        place, 0.0, -across, along, //
        0.0, place, along, across, //
        -across, along, turn, 0.0, //
        along, across, 0.0, turn,
    )
}

/// The covariance after a way [x, y] in the plane of what had this one before it: a wrong heading leads astray, a wrong
/// altitude makes the way too long.
pub(super) fn propagated(covariance: &Covariance, [x, y]: [f32; 2]) -> Covariance {
    let propagation = Covariance::new(
        1.0, 0.0, -y, x, //
        0.0, 1.0, x, y, //
        0.0, 0.0, 1.0, 0.0, //
        0.0, 0.0, 0.0, 1.0,
    );
    congruent(&propagation, covariance)
}

/// Turns the place of a covariance by the angle whose cosine and sine these are.
pub(super) fn turned(covariance: &Covariance, [cos, sin]: [f32; 2]) -> Covariance {
    let turn = Covariance::new(
        cos, -sin, 0.0, 0.0, //
        sin, cos, 0.0, 0.0, //
        0.0, 0.0, 1.0, 0.0, //
        0.0, 0.0, 0.0, 1.0,
    );
    congruent(&turn, covariance)
}

/// By · covariance · Byᵀ: once in flash, unrolled as it is.
#[inline(never)]
fn congruent(by: &Covariance, covariance: &Covariance) -> Covariance {
    by * covariance * by.transpose()
}

/// Whether a matrix can be a covariance: finite, nothing negative on its diagonal.
pub(super) fn is_covariance(covariance: &Covariance) -> bool {
    covariance.iter().all(|number| number.is_finite())
        && covariance.diagonal().iter().all(|&number| number >= 0.0)
}
