//! A vehicle that is shown one landmark after the other.

use std::{boxed::Box, vec::Vec};

use core::f32::consts::FRAC_PI_2;

use super::*;
use crate::{
    atlas::{
        Likelihood,
        sample::{Sample, frame_of},
    },
    landmark::{Lattice, Point, Survey},
};

/// Windows of 100 map pixels side by side.
const COLUMNS: u16 = 8;
const ROWS: u16 = 3;

/// Three places in a row to the right, and an island.
const PLACES: [[f32; 2]; 4] = [
    [150.0, 150.0],
    [350.0, 150.0],
    [550.0, 150.0],
    [750.0, 50.0],
];
const LEGS: [&[u16]; 4] = [&[1], &[0, 2], &[1], &[]];
const ISLAND: u16 = 3;

/// What no landmark looks like.
const UNKNOWN: [u8; 4] = [255, 0, 255, 0];

const STEP_S: f32 = 0.1;

type Vehicle<'a> = Navigator<'a, Box<Memory<64, 8>>, 64, 8>;

/// Gray levels of a window; no two are alike.
fn grays(column: u16, row: u16) -> [u8; 4] {
    let level = |number: u16| (30 * number + 10) as u8;
    [
        level(column),
        level(row),
        level(7 - column),
        level(column * 3 % 8),
    ]
}

pub(super) fn world() -> Box<[u64]> {
    let lattice = Lattice {
        origin: Point {
            x_px: 50.0,
            y_px: 50.0,
        },
        stride_px: 100.0,
        columns: COLUMNS,
        rows: ROWS,
    };
    let windows = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| grays(column, row)));
    let sample = Sample {
        survey: Survey::nominal([lattice].into_iter().collect()),
        map_px: (800, 300),
        footprint_px: 100.0,
        likelihood: Likelihood {
            sharpness: 0.02,
            ceiling: 600.0,
        },
        grays: &windows.collect::<Vec<_>>(),
        places: &PLACES,
        legs: &LEGS,
    };
    sample.emit()
}

fn vehicle(words: &[u64]) -> Vehicle<'_> {
    let atlas = Atlas::parse(bytemuck::cast_slice(words)).expect("valid");
    Navigator::new(atlas, Box::default())
}

fn show(vehicle: &mut Vehicle<'_>, grays: [u8; 4], readings: &Readings) -> Guidance {
    let pixels = frame_of(grays);
    let frame = Frame::new(&pixels, 32, 32, 32).expect("a frame");
    vehicle.advance(Some(&frame), readings, STEP_S)
}

/// Shows what is to be seen at a place.
fn show_place(vehicle: &mut Vehicle<'_>, place: u16) -> Guidance {
    show(vehicle, seen_at(place), &Readings::default())
}

fn seen_at(place: u16) -> [u8; 4] {
    let [x, y] = PLACES[usize::from(place)].map(|at| (at / 100.0) as u16);
    grays(x, y)
}

fn leg(guidance: &Guidance) -> Option<(u16, u16)> {
    guidance.leg.map(|leg| (leg.from, leg.to))
}

#[test]
fn goals_are_flown_to_in_turn() {
    let words = world();
    let mut vehicle = vehicle(&words);
    vehicle.go(&[1, 2, 0]).expect("a plan");
    assert_eq!(vehicle.goals_left(), 2);
    let guidance = show_place(&mut vehicle, 0);
    assert_eq!(
        (guidance.state, leg(&guidance)),
        (State::Following, Some((0, 1)))
    );
    assert!(
        (guidance.command.heading_rad - FRAC_PI_2).abs() < 0.02,
        "to the right"
    );
    assert_eq!(guidance.command.speed, 1.0);
    let estimate = guidance.estimate.expect("a frame came");
    assert!(
        estimate.position.distance_px(Point {
            x_px: 150.0,
            y_px: 150.0
        }) < 2.0
    );
    assert_eq!(
        guidance.fix.map(|fix| (fix.view, fix.distance)),
        Some((10, 0.0))
    );

    show_place(&mut vehicle, 1);
    assert_eq!(vehicle.goals_left(), 1);
    let guidance = show_place(&mut vehicle, 1);
    assert_eq!(
        (guidance.state, leg(&guidance)),
        (State::Following, Some((1, 2)))
    );

    show_place(&mut vehicle, 2);
    assert_eq!(vehicle.goals_left(), 0);
    let guidance = show_place(&mut vehicle, 2);
    assert_eq!(leg(&guidance), Some((2, 1)), "back again");
    let guidance = show_place(&mut vehicle, 1);
    assert_eq!(
        (guidance.state, leg(&guidance)),
        (State::Following, Some((1, 0)))
    );
    let guidance = show_place(&mut vehicle, 0);
    assert_eq!(
        (guidance.state, guidance.command.speed),
        (State::Arrived, 0.0)
    );
    let guidance = show_place(&mut vehicle, 1);
    assert_eq!(guidance.state, State::Arrived, "until it is sent elsewhere");
    vehicle.go(&[2]).expect("a plan");
    let guidance = show_place(&mut vehicle, 1);
    assert_eq!(
        (guidance.state, leg(&guidance)),
        (State::Following, Some((1, 2)))
    );
}

#[test]
fn goals_that_cannot_be_reached_are_left_out() {
    let words = world();
    let mut vehicle = vehicle(&words);
    vehicle.go(&[1, ISLAND, 9, 2]).expect("a plan");
    show_place(&mut vehicle, 0);
    // Each step looks at one of them.
    for left in [2, 1, 0] {
        show_place(&mut vehicle, 1);
        assert_eq!(vehicle.goals_left(), left);
    }
    let guidance = show_place(&mut vehicle, 1);
    assert_eq!(leg(&guidance), Some((1, 2)));

    // The last ones, too: it has arrived.
    vehicle.go(&[1, ISLAND, 9]).expect("a plan");
    for left in [1, 0] {
        let guidance = show_place(&mut vehicle, 1);
        assert_eq!(
            (guidance.state, vehicle.goals_left()),
            (State::Arrived, left)
        );
    }
    let guidance = show_place(&mut vehicle, 1);
    assert_eq!(
        (guidance.state, guidance.command.speed),
        (State::Arrived, 0.0)
    );

    // And the first one, once it is known where the vehicle is.
    vehicle.go(&[ISLAND, 2]).expect("a plan");
    let guidance = show_place(&mut vehicle, 1);
    assert_eq!(
        (leg(&guidance), guidance.command.speed, vehicle.goals_left()),
        (None, 0.0, 0)
    );
    let guidance = show_place(&mut vehicle, 1);
    assert_eq!(leg(&guidance), Some((1, 2)));

    vehicle.go(&[ISLAND]).expect("a plan");
    for _ in 0..3 {
        let guidance = show_place(&mut vehicle, 1);
        assert_eq!(
            (leg(&guidance), guidance.command.speed),
            (None, 0.0),
            "it waits"
        );
    }
}

#[test]
fn goals_that_are_no_places_are_refused() {
    let words = world();
    let mut vehicle = vehicle(&words);
    vehicle.go(&[2]).expect("a plan");
    assert_eq!(leg(&show_place(&mut vehicle, 0)), Some((0, 1)));
    let places = PLACES.len() as u32;
    assert_eq!(
        vehicle.go(&[4, 1]),
        Err(RouteError::NoSuchPlace { place: 4, places })
    );
    assert_eq!(vehicle.goals_left(), 0);
    let guidance = show_place(&mut vehicle, 0);
    assert_eq!(
        (leg(&guidance), guidance.command.speed),
        (None, 0.0),
        "not to the old goal"
    );

    assert_eq!(vehicle.go(&[1, 2].repeat(MAX_GOALS)), Ok(()));
    assert_eq!(vehicle.goals_left(), MAX_GOALS - 1);
    assert_eq!(vehicle.go(&[]), Ok(()));
    assert_eq!(vehicle.goals_left(), 0);
    assert_eq!(
        leg(&show_place(&mut vehicle, 0)),
        Some((0, 1)),
        "the present goal stays"
    );
}

#[test]
fn without_frames_it_becomes_unsure() {
    let words = world();
    let mut vehicle = vehicle(&words);
    vehicle.go(&[2]).expect("a plan");
    let wait = |vehicle: &mut Vehicle<'_>| vehicle.advance(None, &Readings::default(), STEP_S);
    for _ in 0..20 {
        let guidance = wait(&mut vehicle);
        assert_eq!((guidance.state, guidance.estimate), (State::Boot, None));
        assert_eq!(guidance.command.speed, 0.0);
    }
    let guidance = show(&mut vehicle, UNKNOWN, &Readings::default());
    assert_eq!(guidance.state, State::Localizing);
    let guidance = show_place(&mut vehicle, 0);
    assert_eq!(guidance.state, State::Following);

    // The next frame is awaited for half a second.
    let before = vehicle.belief().clone();
    for _ in 0..4 {
        let guidance = wait(&mut vehicle);
        assert_eq!((guidance.fix, guidance.displacement), (None, None));
        assert_eq!(vehicle.belief().weights(), before.weights());
        assert_eq!(leg(&guidance), Some((0, 1)));
    }
    let mut states = Vec::new();
    for _ in 0..80 {
        states.push(wait(&mut vehicle).state);
    }
    let lost = states
        .iter()
        .position(|&state| state == State::Lost)
        .expect("it becomes lost");
    // Patience lasts five seconds.
    assert!((50..60).contains(&lost), "{lost}");
    assert!(states[lost..].iter().all(|&state| state == State::Lost));
    let guidance = show_place(&mut vehicle, 1);
    assert_eq!(
        (guidance.state, leg(&guidance)),
        (State::Following, Some((1, 2)))
    );
}

#[test]
fn what_instruments_do_not_say_is_done_without() {
    let words = world();
    // Frame-up is to the right on the map.
    let [a, b, c, d] = seen_at(0);
    let turned = [b, d, a, c];
    let known = |readings: &Readings, grays| {
        let mut vehicle = vehicle(&words);
        vehicle.go(&[2]).expect("a plan");
        show(&mut vehicle, grays, readings)
    };
    let compass = Readings {
        heading_rad: Some(FRAC_PI_2),
        ..Readings::default()
    };
    let guidance = known(&compass, turned);
    assert_eq!(
        (guidance.state, leg(&guidance)),
        (State::Following, Some((0, 1)))
    );
    let heading = guidance.estimate.map(|estimate| estimate.heading_rad);
    assert_eq!(heading, Some(FRAC_PI_2), "the compass's");

    // Map-up without one.
    let nothing = Readings::default();
    assert_eq!(known(&nothing, seen_at(0)).state, State::Following);
    assert_eq!(known(&nothing, turned).state, State::Localizing);
    for nonsense in [f32::NAN, f32::INFINITY] {
        let readings = Readings {
            heading_rad: Some(nonsense),
            altitude_ratio: Some(nonsense),
            ..nothing
        };
        assert_eq!(known(&readings, seen_at(0)), known(&nothing, seen_at(0)));
    }
    // As far out of range as it can be, it still gives a command.
    for ratio in [-1.0, 0.0, 1e-9, 1e9] {
        let readings = Readings {
            altitude_ratio: Some(ratio),
            ..nothing
        };
        let guidance = known(&readings, seen_at(0));
        assert!(guidance.command.heading_rad.is_finite() && guidance.command.speed <= 1.0);
    }
}
