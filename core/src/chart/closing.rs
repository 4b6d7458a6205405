//! What a place seen again says about path integration.

use nalgebra::{Matrix2, Matrix4x2, Vector2, Vector4};

use super::SIDE_PX;
use crate::{
    landmark::Point,
    track::{BoardOdometry, Covariance, Placement},
};

/// How far from a place it is seen again: standard deviation along each axis, in sides. Twice what views that look the same
/// are apart, for those that look the same by chance.
const SPREAD: f32 = 0.2;

/// Places farther away than so many standard deviations are not plausible.
const GATE: f32 = 2.0;

/// Whether a vehicle that takes itself to be `here` may be at a place that it made when it knew its place to `then`.
pub(super) fn is_plausible(here: Point, now: &Covariance, place: Point, then: &Covariance) -> bool {
    let since = now - then;
    let variance = ((since.m11 + since.m22) / 2.0).max(0.0) + SPREAD * SPREAD;
    let distance = here.distance_px(place) / SIDE_PX;
    distance * distance <= GATE * GATE * variance
}

/// Corrects path integration by a place: `offset` (x, y, in sides) leads to it from where the vehicle took itself to be
/// when it saw it; `then` is the covariance with which the place was made.
/// Returns whether anything was corrected: a place that is known no better than the vehicle says nothing.
pub(super) fn correct(odometry: &mut BoardOdometry, offset: [f32; 2], then: &Covariance) -> bool {
    let now = odometry.covariance();
    let since = now - then;
    let own = SPREAD * SPREAD;
    let (xx, xy, yy) = (since.m11 + own, since.m12, since.m22 + own);
    let determinant = xx * yy - xy * xy;
    if !(since.m11 > 0.0 && since.m22 > 0.0 && determinant > 0.0) {
        return false;
    }
    let inverse = Matrix2::new(yy, -xy, -xy, xx) / determinant;
    let columns: Matrix4x2<f32> = since.fixed_columns::<2>(0).into_owned();
    let gain = columns * inverse;
    let by: Vector4<f32> = gain * Vector2::from(offset);
    let placement = odometry.placement();
    let corrected = Placement {
        x: placement.x + by.x,
        y: placement.y + by.y,
        heading_rad: placement.heading_rad + by.z,
        altitude_ratio: placement.altitude_ratio * libm::expf(by.w),
    };
    odometry.restart(corrected, &(now - gain * columns.transpose()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagonal(place: f32, heading: f32) -> Covariance {
        Covariance::from_diagonal(&Vector4::new(place, place, heading, 0.0))
    }

    fn after(now: &Covariance) -> BoardOdometry {
        let mut odometry = BoardOdometry::new();
        let start = Placement {
            x: 2.0,
            y: 1.0,
            ..Placement::ORIGIN
        };
        assert!(odometry.restart(start, now));
        odometry
    }

    #[test]
    fn the_longer_the_way_the_more_a_place_corrects() {
        let then = diagonal(0.01, 0.0);
        let own = SPREAD * SPREAD;
        for way in [0.1 * own, own, 100.0 * own] {
            let mut odometry = after(&diagonal(0.01 + way, 0.0));
            assert!(correct(&mut odometry, [0.2, -0.1], &then));
            let (placement, share) = (odometry.placement(), way / (way + own));
            assert!((placement.x - 2.0 - 0.2 * share).abs() < 1e-5);
            assert!((placement.y - 1.0 + 0.1 * share).abs() < 1e-5);
            // No better than the place was known, nor than it is seen.
            let left = odometry.covariance().m11 - 0.01;
            assert!((left - way * own / (way + own)).abs() < 1e-5, "{left}");
        }
    }

    #[test]
    fn a_heading_that_led_astray_is_corrected_too() {
        // Four sides up with a heading that is wrong by 0.1: 0.4 to the right.
        let mut now = diagonal(0.0, 0.01);
        (now.m11, now.m22) = (0.16, 1e-4);
        (now.m13, now.m31) = (0.04, 0.04);
        let mut odometry = after(&now);
        assert!(correct(&mut odometry, [-0.4, 0.0], &Covariance::zeros()));
        let placement = odometry.placement();
        let share = 0.16 / (0.16 + SPREAD * SPREAD);
        assert!((placement.heading_rad + 0.1 * share).abs() < 1e-4);
        assert!((odometry.covariance().m33 - 0.01 * (1.0 - share)).abs() < 1e-5);
    }

    #[test]
    fn a_place_that_is_known_less_well_says_nothing() {
        let mut odometry = after(&diagonal(0.01, 0.0));
        assert!(!correct(&mut odometry, [0.2, 0.0], &diagonal(0.02, 0.0)));
        assert_eq!(odometry.placement().x, 2.0);
    }

    #[test]
    fn far_places_are_plausible_after_long_ways_only() {
        let (here, place) = (
            Point {
                x_px: 0.0,
                y_px: 0.0,
            },
            Point {
                x_px: 100.0,
                y_px: 0.0,
            },
        );
        let is = |variance| {
            let then = Covariance::zeros();
            is_plausible(here, &diagonal(variance, 0.0), place, &then)
        };
        assert!(!is(0.0) && !is(0.15) && is(0.25));
    }
}
