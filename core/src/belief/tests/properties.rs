//! Of arbitrary beliefs, motions and frames.

use core::f32::consts::PI;
use std::vec::Vec;

use proptest::prelude::*;

use super::{reference::Reference, *};
use crate::math::turn;

/// Of single precision, and of the exponential, which is off by 2·10⁻⁴.
const TOLERANCE: f64 = 2e-3;

proptest! {
    #[test]
    fn predict_matches_reference(
        headings in 1_u8..=8, seed in 0_usize..1000, compass in -7.0_f32..7.0,
        motions in proptest::collection::vec(motions(), 1..4),
    ) {
        let words = world(headings);
        let mut belief = arbitrary(&atlas(&words), seed);
        let mut reference = Reference::of(&belief);
        for motion in &motions {
            belief.predict(motion, compass);
            reference.predict(motion, compass);
            prop_assume!(!reference.is_close);
            assert_matches(&belief, &reference);
        }
    }

    #[test]
    fn observe_matches_reference(
        headings in 1_u8..=8, seed in 0_usize..1000, motion in motions(), landmark in 0_usize..63,
        noise in -40_i16..40, least_worth in 0.0_f32..1.0,
    ) {
        let words = world(headings);
        let atlas = atlas(&words);
        let mut belief = arbitrary(&atlas, seed);
        belief.predict(&motion, 0.3);
        let mut reference = Reference::of(&belief);
        let values: Vec<i16> = seen_at(landmark).values().iter().map(|value| value + noise).collect();
        let coefficients = Coefficients::from_values(&values).expect("four");
        // The second frame is worth little: the vehicle did not move.
        for _ in 0..2 {
            let observation = Observation { least_worth, ..INDEPENDENT };
            belief.observe(&atlas, &coefficients, &observation);
            reference.observe(&atlas, &coefficients, &observation);
            prop_assume!(!reference.is_close);
            assert_matches(&belief, &reference);
        }
    }

    #[test]
    fn estimate_matches_reference(
        headings in 1_u8..=8, seed in 0_usize..1000, motion in motions(), peak in 0_usize..63,
        footprint_px in 0.0_f32..90.0,
    ) {
        let words = world(headings);
        let mut belief = arbitrary(&atlas(&words), seed);
        belief.predict(&motion, 0.3);
        belief.parts().1[peak] = 0.5;
        let (layers, weights, _) = belief.parts();
        layers.normalize(weights, 0.0);
        let (found, expected) =
            (belief.estimate(footprint_px), Reference::of(&belief).estimate(footprint_px));
        prop_assert!(found.position.distance_px(expected.position) < 1e-2, "{found:?} {expected:?}");
        for (found, expected) in found.covariance_px2.into_iter().zip(expected.covariance_px2) {
            prop_assert!((found - expected).abs() < 0.05 + 1e-3 * expected.abs(), "{found} {expected}");
        }
        prop_assert!((found.confidence - expected.confidence).abs() < 1e-5);
        // The sine is off by 0.002.
        prop_assert!(turn(found.heading_rad, expected.heading_rad).abs() < 0.01, "{found:?} {expected:?}");
    }

    /// Of any heading, far from the border: the belief as a whole moves as the vehicle does.
    #[test]
    fn what_is_believed_moves_as_the_vehicle_does(
        headings in 1_u8..=8, layer in 0_u8..8, compass in -7.0_f32..7.0, yaw_rad in -1.0_f32..1.0,
        forward_px in -30.0_f32..30.0, right_px in -30.0_f32..30.0,
    ) {
        let words = world(headings);
        let mut belief = arbitrary(&atlas(&words), 0);
        let layer = usize::from(layer % headings);
        belief.parts().1.fill(0.0);
        let cells = belief.layers.cells.layer();
        belief.parts().1[layer * cells + cells / 2] = 1.0;
        let before = belief.estimate(2.0 * SIDE_PX);
        let motion = Motion { forward_px, right_px, yaw_rad, ..at_rest() };
        belief.predict(&motion, compass);
        let after = belief.estimate(2.0 * SIDE_PX);
        let heading = if headings == 1 { compass } else { before.heading_rad + yaw_rad / 2.0 };
        let (sin, cos) = heading.sin_cos();
        let expected = Point {
            x_px: before.position.x_px + forward_px * sin + right_px * cos,
            y_px: before.position.y_px - forward_px * cos + right_px * sin,
        };
        prop_assert!(after.position.distance_px(expected) < 0.2, "{after:?} {expected:?}");
        let turned = if headings == 1 { compass } else { before.heading_rad + yaw_rad };
        prop_assert!(turn(after.heading_rad, turned).abs() < 0.01, "{after:?} {turned}");
    }

    #[test]
    fn nothing_makes_it_unsound(
        headings in 1_u8..=8,
        steps in proptest::collection::vec((0_u8..4, [number(), number(), number(), number(), number(), number()]), 1..20),
    ) {
        let words = world(headings);
        let atlas = atlas(&words);
        let mut belief = arbitrary(&atlas, 1);
        for (kind, [a, b, c, d, e, f]) in steps {
            match kind {
                0 => belief.gate(a, b),
                1 => {
                    let coefficients = seen_at(a as usize % 63);
                    belief.observe(&atlas, &coefficients, &Observation { independent_px: b, least_worth: c });
                }
                _ => {
                    let motion = Motion {
                        forward_px: a, right_px: b, yaw_rad: c, variance_px2: d, variance_rad2: e, carried_away: f,
                    };
                    belief.predict(&motion, a);
                }
            }
            assert_sound(&belief);
        }
    }
}

/// Mostly numbers as they should be.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => -3.0_f32..3.0,
        2 => -300.0_f32..300.0,
        1 => any::<f32>(),
        1 => proptest::sample::select(
            &[0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e19, 1e-45][..],
        ),
    ]
}

fn motions() -> impl Strategy<Value = Motion> {
    let way = -50.0_f32..50.0;
    (
        way.clone(),
        way,
        -2.0_f32..2.0,
        0.0_f32..300.0,
        0.0_f32..0.3,
        0.0_f32..0.2,
    )
        .prop_map(
            |(forward_px, right_px, yaw_rad, variance_px2, variance_rad2, carried_away)| Motion {
                forward_px,
                right_px,
                yaw_rad,
                variance_px2,
                variance_rad2,
                carried_away,
            },
        )
}

fn assert_matches(belief: &Filter, reference: &Reference) {
    assert_eq!(belief.weights().len(), reference.weights.len());
    for (&found, &expected) in belief.weights().iter().zip(&reference.weights) {
        let error = (f64::from(found) - expected).abs();
        assert!(error <= TOLERANCE * expected + 1e-7, "{found} {expected}");
    }
    for (found, expected) in belief.layers.offsets.iter().zip(&reference.offsets) {
        let error = [
            f64::from(found.x_px) - expected[0],
            f64::from(found.y_px) - expected[1],
        ];
        assert!(
            error.iter().all(|error| error.abs() < 1e-3),
            "{found:?} {expected:?}"
        );
    }
    let error = turn(belief.layers.heading_rad, reference.heading_rad as f32);
    assert!(
        error.abs() < 1e-4,
        "{} {}",
        belief.layers.heading_rad,
        reference.heading_rad
    );
}

fn assert_sound(belief: &Filter) {
    let weights = belief.weights();
    assert!(
        weights.iter().all(|weight| (0.0..=1.001).contains(weight)),
        "{weights:?}"
    );
    let total: f32 = weights.iter().sum();
    assert!((total - 1.0).abs() < 1e-3, "{total}");
    for footprint_px in [0.0, 40.0, 1e30, f32::INFINITY, f32::NAN] {
        let estimate = belief.estimate(footprint_px);
        let Estimate {
            position,
            covariance_px2: [xx, xy, yy],
            heading_rad,
            confidence,
        } = estimate;
        let numbers = [position.x_px, position.y_px, xx, xy, yy];
        assert!(
            numbers.iter().all(|number| number.is_finite()),
            "{estimate:?}"
        );
        assert!(
            xx > 0.0 && yy > 0.0 && heading_rad.abs() <= PI + 1e-6,
            "{estimate:?}"
        );
        assert!((0.0..=1.0).contains(&confidence), "{estimate:?}");
    }
}
