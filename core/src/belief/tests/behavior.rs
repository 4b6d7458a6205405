//! What the filter finds, keeps, and loses.

use super::*;
use crate::math::turn;

#[test]
fn whole_cells_move_in_every_direction() {
    let words = world(1);
    for right in -10..=10_i16 {
        for down in -8..=8_i16 {
            let mut belief = arbitrary(&atlas(&words), 5);
            let before = belief.clone();
            // Map-up is forward.
            let motion = Motion {
                forward_px: -SIDE_PX * f32::from(down),
                right_px: SIDE_PX * f32::from(right),
                ..at_rest()
            };
            belief.predict(&motion, 0.0);
            let weight = |belief: &Filter, column: i16, row: i16| {
                let is_on =
                    (0..COLUMNS as i16).contains(&column) && (0..ROWS as i16).contains(&row);
                let index =
                    usize::from(row as u16) * usize::from(COLUMNS) + usize::from(column as u16);
                if is_on { belief.weights()[index] } else { 0.0 }
            };
            let is_off = right.unsigned_abs() >= COLUMNS || down.unsigned_abs() >= ROWS;
            let mut total = 0.0;
            for (column, row) in (0..9).flat_map(|column| (0..7).map(move |row| (column, row))) {
                total += weight(&before, column - right, row - down);
            }
            for (column, row) in (0..9).flat_map(|column| (0..7).map(move |row| (column, row))) {
                let expected = if is_off {
                    // Nothing is left: it knows nothing.
                    1.0 / 63.0
                } else {
                    weight(&before, column - right, row - down) / total
                };
                let found = weight(&belief, column, row);
                assert!(
                    (found - expected).abs() < 1e-5,
                    "{right} {down}: {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn small_ways_add_up() {
    let words = world(1);
    let mut belief = arbitrary(&atlas(&words), 0);
    belief.parts().1.fill(0.0);
    belief.parts().1[31] = 1.0;
    let start = belief.estimate(40.0).position;
    for _ in 0..70 {
        belief.predict(
            &Motion {
                right_px: 1.0,
                ..at_rest()
            },
            0.0,
        );
    }
    let end = belief.estimate(40.0).position;
    assert!(
        (end.x_px - start.x_px - 70.0).abs() < 0.2 && (end.y_px - start.y_px).abs() < 0.2,
        "{end:?}"
    );
    assert_eq!(
        belief
            .weights()
            .iter()
            .filter(|&&weight| weight > 0.5)
            .count(),
        1,
        "still one cell"
    );
}

#[test]
fn a_kidnapped_vehicle_is_found_again() {
    for headings in [1, 4] {
        let words = world(headings);
        let atlas = atlas(&words);
        let mut belief = Filter::default();
        belief.begin(&atlas);
        let cells = belief.layers.cells.layer();
        // Far from each other, at the last heading.
        let landmarks = [0, 62, 8].map(|cell| (usize::from(headings) - 1) * cells + cell);
        let unnoticed = Motion {
            forward_px: 0.1,
            carried_away: 1e-4,
            ..at_rest()
        };
        for landmark in landmarks {
            let survey = atlas.survey();
            let place = survey.place(landmark as u32 + 1).expect("a candidate");
            let heading = survey
                .heading_rad(landmark as u32 + 1)
                .expect("a candidate");
            let mut frames = 0;
            let found = |belief: &Filter| {
                let estimate = belief.estimate(atlas.header().footprint_px);
                estimate.is_confident() && estimate.position.distance_px(place) < SIDE_PX
            };
            assert!(!found(&belief), "not before it is seen");
            while !found(&belief) {
                belief.predict(&unnoticed, 0.0);
                belief.observe(&atlas, &seen_at(landmark), &INDEPENDENT);
                frames += 1;
                assert!(frames < 40, "{:?}", belief.estimate(40.0));
            }
            assert!(frames > 1, "a frame alone is no certainty");
            let estimate = belief.estimate(atlas.header().footprint_px);
            let expected = if headings == 1 { 0.0 } else { heading };
            assert!(
                turn(estimate.heading_rad, expected).abs() < 0.01,
                "{estimate:?}"
            );
        }
    }
}

#[test]
fn what_the_compass_says_is_kept() {
    let words = world(8);
    let mut belief = arbitrary(&atlas(&words), 3);
    // Headings at 5°, 50°, 95°, …; half a step is 22.5°.
    belief.predict(
        &Motion {
            yaw_rad: 5_f32.to_radians(),
            ..at_rest()
        },
        0.0,
    );
    let before = belief.clone();
    belief.gate(80_f32.to_radians(), 15_f32.to_radians());
    let cells = belief.layers.cells.layer();
    let share = |belief: &Filter, layer: usize| -> f32 {
        belief.weights()[layer * cells..][..cells].iter().sum()
    };
    for layer in 0..8 {
        let is_kept = layer == 1 || layer == 2;
        assert_eq!(share(&belief, layer) > 0.4, is_kept, "layer {layer}");
        assert!(is_kept || share(&belief, layer) < 1e-4, "layer {layer}");
    }
    // Within a heading, nothing changes.
    let [ratio, other] = [64, 100].map(|state| belief.weights()[state] / before.weights()[state]);
    assert!((ratio / other - 1.0).abs() < 1e-5);

    let mut unmoved = before.clone();
    unmoved.gate(f32::NAN, 0.1);
    unmoved.gate(0.0, f32::NAN);
    unmoved.gate(0.0, -1.0);
    assert_eq!(unmoved.weights(), before.weights());
    let words = world(1);
    let mut single = arbitrary(&atlas(&words), 3);
    let before = single.clone();
    single.gate(2.0, 0.1);
    assert_eq!(
        single.weights(),
        before.weights(),
        "one heading is the compass's"
    );
}

#[test]
fn what_is_no_motion_leaves_nothing_known() {
    let words = world(4);
    let atlas = atlas(&words);
    for motion in [
        Motion {
            forward_px: f32::NAN,
            ..at_rest()
        },
        Motion {
            right_px: 1e20,
            ..at_rest()
        },
        Motion {
            yaw_rad: f32::INFINITY,
            ..at_rest()
        },
        Motion {
            carried_away: f32::NAN,
            ..at_rest()
        },
    ] {
        let mut belief = arbitrary(&atlas, 9);
        belief.observe(&atlas, &seen_at(3), &INDEPENDENT);
        belief.predict(&motion, 0.0);
        assert!(
            belief
                .weights()
                .iter()
                .all(|&weight| weight == belief.layers.uniform()),
            "{motion:?}"
        );
        assert_eq!(
            belief.layers.way_px,
            f32::INFINITY,
            "the next frame counts in full"
        );
    }
}

#[test]
fn it_begins_with_what_there_is_room_for() {
    let words = world(8);
    let atlas = atlas(&words);
    let mut whole = Filter::default();
    whole.begin(&atlas);
    assert_eq!(whole.weights(), [1.0 / STATES as f32; STATES]);
    assert_eq!(
        (whole.cells().columns(), whole.cells().headings()),
        (COLUMNS, 8)
    );

    let mut coarse = Belief::<{ STATES - 1 }>::new();
    coarse.begin(&atlas);
    assert_eq!(coarse.cells().side_px(), 2.0 * SIDE_PX);
    assert_eq!(coarse.cells().headings(), 8);

    // Not even one state per heading.
    let mut tiny = Belief::<7>::new();
    tiny.begin(&atlas);
    assert_eq!(tiny.cells().headings(), 1);
    assert!(tiny.weights().len() > 1 && tiny.weights().len() <= 7);
    tiny.observe(&atlas, &seen_at(100), &INDEPENDENT);
    let total: f32 = tiny.weights().iter().sum();
    assert!((total - 1.0).abs() < 1e-5);
}
