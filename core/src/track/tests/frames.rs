//! Two frames, and those that cannot be related.

use std::{boxed::Box, vec::Vec};

use proptest::prelude::*;

use super::*;

/// Errors of a displacement between two noiseless frames of 120 pixels: a twentieth of a pixel, and what that is at a
/// distance of 40.
const PLACE: f64 = 0.05 / 120.0;
const TURN: f64 = 0.05 / 40.0;

fn new() -> Box<Odometry> {
    Box::new(Odometry::whole())
}

#[track_caller]
fn assert_close(errors: [f64; 4], factor: f64) {
    let limits = [PLACE, PLACE, TURN, TURN].map(|limit| limit * factor);
    let is_close = errors
        .iter()
        .zip(limits)
        .all(|(error, limit)| error.abs() <= limit);
    assert!(is_close, "{errors:?}, limits {limits:?}");
}

/// A sight some pixels on, turned and higher.
fn moved(sight: Sight) -> Sight {
    let mut moved = sight;
    moved.place[0] += 0.0213;
    moved.place[1] -= 0.0341;
    moved.heading_rad += 0.012;
    moved.altitude_ratio *= 1.006;
    moved
}

#[test]
fn a_displacement_is_measured_to_a_twentieth_of_a_pixel() {
    let mut odometry = new();
    let sight = Sight::new(120);
    assert!(sight.show(&mut odometry).is_none(), "the first");
    for shift in [[0.0, 0.0], [0.0037, -0.0012], [-0.011, 0.0305], [0.0, 0.0]] {
        let there = Sight {
            place: shift,
            ..sight
        };
        there.show(&mut odometry).expect("overlaps");
        assert_close(errors(&odometry, &there), 1.0);
    }
}

#[test]
fn turns_and_climbs_are_measured() {
    let mut odometry = new();
    let mut sight = Sight {
        heading_rad: 0.7,
        ..Sight::new(120)
    };
    let start = Placement {
        heading_rad: 0.7,
        ..Placement::ORIGIN
    };
    assert!(odometry.restart(start, &Covariance::zeros()));
    sight.show(&mut odometry);
    for _ in 0..3 {
        let before = sight;
        sight = moved(sight);
        let displacement = sight.show(&mut odometry).expect("overlaps");
        let way = [0, 1].map(|axis| sight.place[axis] - before.place[axis]);
        let (sin, cos) = before.heading_rad.sin_cos();
        let expected = [
            way[0] * sin - way[1] * cos,
            way[0] * cos + way[1] * sin,
            0.012,
            1.006,
        ];
        let d = displacement;
        let found = [d.forward, d.right, d.yaw_rad, d.scale].map(f64::from);
        assert_close([0, 1, 2, 3].map(|i| found[i] - expected[i]), 4.0);
        assert_close(errors(&odometry, &sight), 3.0);
        assert!(d.inliers >= 6 && d.inliers <= d.tracked, "{d:?}");
    }
}

#[test]
fn large_steps_are_found_without_a_guess() {
    let start = Sight::new(200);
    // Sixteen pixels, eight degrees, eight percent of altitude.
    let steps: [fn(Sight) -> Sight; 3] = [
        |sight| Sight {
            place: [0.064, -0.048],
            ..sight
        },
        |sight| Sight {
            heading_rad: 8_f64.to_radians(),
            ..sight
        },
        |sight| Sight {
            altitude_ratio: 1.08,
            ..sight
        },
    ];
    for step in steps {
        let mut odometry = new();
        start.show(&mut odometry);
        let there = step(start);
        there.show(&mut odometry).expect("overlaps");
        assert_close(errors(&odometry, &there), 5.0);
    }
}

#[test]
fn light_and_contrast_do_no_harm() {
    let plain = Sight::new(120);
    let lights: [fn(Sight) -> Sight; 4] = [
        |sight| Sight {
            gamma: 0.9,
            ..sight
        },
        |sight| Sight { gain: 0.7, ..sight },
        |sight| Sight {
            offset: 30.0,
            gain: 0.9,
            ..sight
        },
        |sight| Sight {
            gamma: 1.25,
            ..sight
        },
    ];
    for light in lights {
        let mut odometry = new();
        plain.show(&mut odometry);
        let there = light(moved(plain));
        there.show(&mut odometry).expect("overlaps");
        assert_close(errors(&odometry, &there), 3.0);
    }
}

#[test]
fn light_may_change_twofold_over_a_flight() {
    let mut odometry = new();
    let mut sight = Sight {
        gamma: 0.5,
        noise: 1.0,
        ..Sight::new(120)
    };
    sight.show(&mut odometry);
    for _ in 0..60 {
        sight = Sight {
            gamma: sight.gamma * 1.0234,
            seed: sight.seed + 1,
            ..sight
        };
        sight.place[1] -= 0.01;
        sight.show(&mut odometry).expect("overlaps");
    }
    assert!((sight.gamma - 2.0).abs() < 0.01);
    assert!(distance(errors(&odometry, &sight)) < 0.01 * 0.6);
}

#[test]
fn what_is_known_of_the_tilt_is_taken_out() {
    for [roll_rad, pitch_rad] in [[0.1, 0.0], [0.0, -0.1], [0.15, 0.12]] {
        let mut odometry = new();
        let level = Sight::new(160);
        level.show(&mut odometry);
        let tilted = Sight {
            roll_rad,
            pitch_rad,
            ..moved(level)
        };
        let displacement = tilted.show(&mut odometry);
        assert!(displacement.is_some(), "{roll_rad} {pitch_rad}");
        // Windows are not levelled: they are drawn out by the tilt, as by a climb.
        assert_close(errors(&odometry, &tilted), 12.0);
    }
}

#[test]
fn flat_frames_have_no_corners() {
    let mut odometry = new();
    for level in [0, 128, 255, 128] {
        assert!(show(&mut odometry, 96, &[level; 96 * 96], None).is_none());
        assert!(odometry.tracks().is_empty());
    }
    let slope: Vec<u8> = (0..96 * 96).map(|i| (i % 96 * 2) as u8).collect();
    assert!(show(&mut odometry, 96, &slope, None).is_none());
    assert!(odometry.tracks().is_empty(), "slopes can slide");
    assert_eq!(odometry.placement(), Placement::ORIGIN);
}

#[test]
fn a_kidnapped_vehicle_is_noticed_and_goes_on() {
    let mut odometry = new();
    let here = Sight::new(120);
    here.show(&mut odometry);
    let here = moved(here);
    here.show(&mut odometry).expect("overlaps");
    for way in [1.0, 5.0, 30.0] {
        let there = Sight {
            place: [way, 0.3 * way],
            ..here
        };
        let before = odometry.placement();
        for is_waiting in [true, false] {
            assert!(there.show(&mut odometry).is_none(), "{way} sides away");
            assert_eq!(odometry.is_waiting(), is_waiting);
            assert_eq!(odometry.placement(), before);
        }
        there.show(&mut odometry).expect("the same place again");
    }
}

#[test]
fn torn_frames_are_passed_over() {
    let mut odometry = new();
    let here = Sight::new(120);
    here.show(&mut odometry);
    let here = moved(here);
    here.show(&mut odometry).expect("overlaps");
    // Below, there is still the frame of before.
    let next = moved(here);
    let mut torn = next.pixels();
    torn[60 * 120..].copy_from_slice(&here.pixels()[60 * 120..]);
    assert!(show(&mut odometry, 120, &torn, None).is_none());
    assert!(odometry.is_waiting());
    assert!(!odometry.skip(&still()), "it may still be seen");
    // The next frame says how the vehicle moved since the one before.
    let after = moved(next);
    let displacement = after.show(&mut odometry).expect("overlaps");
    assert!(!odometry.is_waiting());
    assert_close(errors(&odometry, &after), 1.0);
    let way = f64::from(displacement.forward).hypot(displacement.right.into());
    let [x, y] = [0, 1].map(|axis| after.place[axis] - here.place[axis]);
    assert!((way - x.hypot(y)).abs() < 0.005, "{way}");
}

#[test]
fn a_quarter_of_the_frame_may_go_another_way() {
    let mut odometry = new();
    let with_other = |sight: &Sight, other: [f64; 2]| {
        let mut pixels = sight.pixels();
        let other = Sight {
            place: other,
            ..Sight::new(120)
        }
        .pixels();
        let quarter = 120 * 30;
        pixels[..quarter].copy_from_slice(&other[..quarter]);
        pixels
    };
    let mut sight = Sight::new(120);
    show(&mut odometry, 120, &with_other(&sight, [9.0, 9.0]), None);
    for step in 1..=3 {
        sight = moved(sight);
        let other = [9.0 + 0.04 * f64::from(step), 9.0 + 0.02 * f64::from(step)];
        let displacement = show(&mut odometry, 120, &with_other(&sight, other), None);
        let displacement = displacement.expect("most agree");
        assert!(step > 1 || displacement.inliers < displacement.tracked);
    }
    assert_close(errors(&odometry, &sight), 5.0);
}

#[test]
fn frames_of_any_size_are_tracked() {
    for (width, height, pad) in [(32, 32, 0), (47, 40, 3), (160, 120, 0), (320, 240, 16)] {
        let mut odometry = new();
        let stride = usize::from(width) + pad;
        let side = width.min(height);
        let mut sight = Sight::new(side);
        for step in 0..4 {
            sight.place[0] = 0.02 * f64::from(step);
            let mut pixels = std::vec![77; stride * usize::from(height)];
            let left = usize::from((width - side) / 2);
            for (row, square) in pixels
                .chunks_exact_mut(stride)
                .zip(sight.pixels().chunks_exact(side.into()))
            {
                row[left..left + usize::from(side)].copy_from_slice(square);
            }
            let frame = Frame::new(&pixels, width, height, stride).expect("valid");
            let displacement = odometry.advance(&frame, None);
            assert_eq!(displacement.is_some(), step > 0, "{width}×{height}");
        }
        let limit = 0.2 / f64::from(side);
        assert!(
            distance(errors(&odometry, &sight)) < limit,
            "{width}×{height}: {:?}",
            errors(&odometry, &sight)
        );
    }
}

#[test]
fn another_size_starts_anew() {
    let mut odometry = new();
    Sight::new(96).show(&mut odometry);
    assert!(Sight::new(100).show(&mut odometry).is_none());
    assert!(Sight::new(100).show(&mut odometry).is_some());
}

#[test]
fn a_fix_moves_the_map_of_anchors_along() {
    let mut odometry = new();
    let mut sight = Sight::new(120);
    sight.show(&mut odometry);
    let at = Placement {
        x: 7.0,
        y: -3.0,
        heading_rad: 2.0,
        altitude_ratio: 1.2,
    };
    assert!(odometry.restart(at, &(Covariance::identity() * 1e-4)));
    // The ground is the same; only what it is called has changed.
    sight = Sight {
        place: [0.0, -0.03],
        ..sight
    };
    sight.show(&mut odometry).expect("overlaps");
    let placement = odometry.placement();
    let (sin, cos) = 2.0_f64.sin_cos();
    let way = 0.03 * 1.2;
    let expected = Sight {
        place: [7.0 + way * sin, -3.0 - way * cos],
        heading_rad: 2.0,
        altitude_ratio: f64::from(placement.altitude_ratio),
        ..sight
    };
    assert_close(errors(&odometry, &expected), 2.0);
    let variance = odometry.covariance().m11;
    assert!((1.0e-4..1.02e-4).contains(&variance), "{variance}");
}

#[test]
fn a_compass_and_an_altimeter_correct_what_they_measure() {
    let mut odometry = new();
    let sight = Sight::new(120);
    sight.show(&mut odometry);
    assert!(odometry.restart(
        Placement {
            heading_rad: 3.1,
            ..Placement::ORIGIN
        },
        &(Covariance::identity() * 0.01)
    ));
    assert!(odometry.correct_heading(-3.1, 0.01));
    assert!(odometry.correct_altitude(1.2, 0.0144));
    let placement = odometry.placement();
    // Halfway there, across the cut of angles; and half of the logarithm.
    let turn = (f64::from(placement.heading_rad) - TAU / 2.0).sin();
    assert!(turn.abs() < 1e-5, "{placement:?}");
    assert!(
        (placement.altitude_ratio - 1.2_f32.sqrt()).abs() < 1e-5,
        "{placement:?}"
    );
    let covariance = odometry.covariance();
    assert!((covariance.m33 - 0.005).abs() < 1e-6 && (covariance.m44 - 0.005).abs() < 1e-6);
    // The next frame agrees with that.
    sight.show(&mut odometry).expect("the same");
    assert!((odometry.placement().altitude_ratio - 1.2_f32.sqrt()).abs() < 1e-3);
}

#[test]
fn nonsense_is_refused() {
    let mut odometry = new();
    let before = odometry.clone();
    for bad in [f32::NAN, f32::INFINITY] {
        assert!(!odometry.correct_heading(bad, 1.0) && !odometry.correct_heading(0.1, bad));
        assert!(!odometry.correct_altitude(bad, 1.0) && !odometry.correct_altitude(1.1, bad));
        assert!(!odometry.restart(
            Placement {
                x: bad,
                ..Placement::ORIGIN
            },
            &Covariance::zeros()
        ));
        assert!(!odometry.restart(Placement::ORIGIN, &(Covariance::identity() * bad)));
        assert!(!odometry.skip(&Displacement {
            scale: bad,
            ..still()
        }));
    }
    for bad in [f32::NAN, f32::INFINITY, 1e4, -1e30] {
        let heading_rad = bad;
        let turned = Placement {
            heading_rad,
            ..Placement::ORIGIN
        };
        assert!(!odometry.restart(turned, &Covariance::zeros()));
        assert!(!odometry.skip(&Displacement {
            yaw_rad: bad,
            ..still()
        }));
    }
    assert!(!odometry.correct_heading(-1e30, 1.0));
    for bad in [0.0, -1.0] {
        assert!(!odometry.correct_heading(0.1, bad) && !odometry.correct_altitude(1.1, bad));
        assert!(!odometry.correct_altitude(bad, 1.0));
        assert!(!odometry.skip(&Displacement {
            scale: bad,
            ..still()
        }));
    }
    let far = Placement {
        x: f32::MAX,
        ..Placement::ORIGIN
    };
    assert!(odometry.restart(far, &Covariance::zeros()));
    assert!(
        !odometry.skip(&Displacement {
            right: f32::MAX,
            ..still()
        }),
        "beyond all numbers"
    );
    assert!(odometry.restart(before.placement(), &before.covariance()));
    assert_eq!(odometry.placement(), before.placement());
    assert_eq!(odometry.covariance(), before.covariance());
}

fn still() -> Displacement {
    Displacement {
        forward: 0.0,
        right: 0.0,
        yaw_rad: 0.0,
        scale: 1.0,
        covariance: Covariance::zeros(),
        tracked: 0,
        inliers: 0,
    }
}

#[test]
fn dead_reckoning_bridges_what_is_not_seen() {
    let mut odometry = new();
    let start = Sight {
        heading_rad: 0.5,
        ..Sight::new(120)
    };
    assert!(odometry.restart(
        Placement {
            heading_rad: 0.5,
            ..Placement::ORIGIN
        },
        &Covariance::zeros()
    ));
    start.show(&mut odometry);
    let (sin, cos) = 0.5_f64.sin_cos();
    let mut there = Sight {
        place: [2.0 * sin + 0.5 * cos, -2.0 * cos + 0.5 * sin],
        heading_rad: 0.8,
        altitude_ratio: 1.1,
        ..start
    };
    for _ in 0..2 {
        assert!(there.show(&mut odometry).is_none());
    }
    let covariance = Covariance::from_diagonal(&[0.04, 0.01, 1e-4, 1e-4].into());
    assert!(odometry.skip(&Displacement {
        forward: 2.0,
        right: 0.5,
        yaw_rad: 0.3,
        scale: 1.1,
        covariance,
        ..still()
    }));
    assert_close(errors(&odometry, &there), 0.1);
    there.place[0] += 0.02;
    there.show(&mut odometry).expect("goes on");
    assert_close(errors(&odometry, &there), 2.0);
    // Ahead is (sin, −cos) of the heading it had.
    let found = odometry.covariance();
    let ahead = 0.04 * sin * sin + 0.01 * cos * cos;
    assert!((f64::from(found.m11) - ahead).abs() < 1e-3, "{found}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_frames_give_finite_placements(
        sizes in prop::collection::vec((32_u16..80, 32_u16..80, 0_usize..4), 1..6),
        seed in any::<u32>(), coarse in 1_usize..9, tilt in prop::array::uniform2(-1.0_f32..1.0),
    ) {
        let mut odometry = new();
        let mut state = seed;
        for (number, &(width, height, pad)) in sizes.iter().enumerate() {
            // The same size again more often than not.
            let (width, height) = if number % 3 == 0 { (width, height) } else { (sizes[0].0, sizes[0].1) };
            let stride = usize::from(width) + pad;
            let mut pixels = std::vec![0_u8; stride * usize::from(height)];
            for run in pixels.chunks_mut(coarse) {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                run.fill((state >> 24) as u8);
            }
            let frame = Frame::new(&pixels, width, height, stride).expect("valid");
            let pose = Pose::NOMINAL.tilted(tilt[0], tilt[1], 1.2).expect("in range");
            let displacement = odometry.advance(&frame, pose.tilt().filter(|_| number % 2 == 1));
            prop_assert!(odometry.placement().is_valid());
            prop_assert!(odometry.covariance().iter().all(|number| number.is_finite()));
            prop_assert!(odometry.tracks().len() <= MAX_TRACKS);
            if let Some(d) = displacement {
                prop_assert!([d.forward, d.right, d.yaw_rad, d.scale].iter().all(|number| number.is_finite()));
                prop_assert!(d.scale > 0.0 && usize::from(d.tracked) <= MAX_TRACKS);
            }
        }
    }
}
