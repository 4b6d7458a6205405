//! Every transition of the diagram, and legs flown in wind.

use core::f32::consts::{FRAC_PI_2, PI};

use std::vec::Vec;

use super::*;
use crate::{
    math::{heading_of, wrapped},
    route::Place,
};

const LIMITS: Limits = Limits {
    lookahead_px: 50.0,
    off_leg_px: 100.0,
    arrival_px: 25.0,
    patience_s: 2.0,
    searching_speed: 0.5,
    circle_s: 20.0,
    map_px: Some([1000.0, 1000.0]),
    border_px: 75.0,
};

/// Four places in a row to the right, 200 pixels apart, and legs between neighbours.
const PLACES: [Place; 4] = [
    place(100.0, 0),
    place(300.0, 1),
    place(500.0, 3),
    place(700.0, 5),
];

const fn place(x_px: f32, first_leg: u32) -> Place {
    Place {
        x_px,
        y_px: 500.0,
        first_leg,
    }
}

const LEGS: [u16; 6] = [1, 0, 2, 1, 3, 2];

fn at(x_px: f32, y_px: f32, confidence: f32) -> Situation {
    let estimate = Estimate {
        position: Point { x_px, y_px },
        covariance_px2: [100.0, 0.0, 100.0],
        heading_rad: 0.0,
        confidence,
    };
    Situation {
        estimate: Some(estimate),
        heading_rad: 1.0,
        drift_rad: 0.0,
        step_s: 0.5,
    }
}

fn world() -> (TopologicalMap<'static>, Router<8>) {
    let map = TopologicalMap::new(&PLACES, &LEGS, (1000, 1000)).expect("valid");
    let mut router = Router::new();
    router.plan(&map, 3).expect("a goal");
    (map, router)
}

#[test]
fn a_mission_takes_every_arrow_of_its_diagram() {
    let (map, router) = world();
    let mut mission = Mission::new(LIMITS);
    let blind = Situation {
        estimate: None,
        ..at(0.0, 0.0, 0.0)
    };
    let steps: [(Situation, State); 10] = [
        (blind, State::Boot),
        (at(120.0, 510.0, 0.2), State::Localizing),
        (at(120.0, 510.0, 1.0), State::Following),
        (at(150.0, 510.0, 0.5), State::Following),
        (blind, State::Following),
        (at(150.0, 510.0, 0.5), State::Following),
        // Two and a half seconds without confidence, patience is two.
        (at(150.0, 510.0, 0.5), State::Following),
        (at(150.0, 510.0, 0.5), State::Following),
        (at(150.0, 510.0, 0.5), State::Lost),
        (at(150.0, 510.0, 1.0), State::Following),
    ];
    for (index, (situation, state)) in steps.into_iter().enumerate() {
        mission = mission.step(&situation, &map, &router);
        assert_eq!(mission.state(), state, "step {index}");
    }
    mission = mission.step(&at(690.0, 490.0, 0.5), &map, &router);
    assert_eq!(mission.state(), State::Following, "not sure to be there");
    mission = mission.step(&at(690.0, 490.0, 1.0), &map, &router);
    assert_eq!(mission.state(), State::Arrived);
    assert_eq!(mission.command().speed, 0.0);
    mission = mission.step(&at(100.0, 490.0, 1.0), &map, &router);
    assert_eq!(
        mission.state(),
        State::Arrived,
        "until there is another goal"
    );
    assert_eq!(mission.redirected().state(), State::Localizing);
}

#[test]
fn who_does_not_know_flies_in_widening_circles() {
    let (map, router) = world();
    let mut mission = Mission::new(LIMITS);
    let (mut turned, mut farthest, mut laps) = (0.0, 0.0_f32, Vec::new());
    // A wind to the right of half the airspeed, which is 10 map pixels a second.
    let (mut x, mut y, mut course) = (0.0_f32, 0.0_f32, 0.0);
    let mut drift = 0.0;
    for step in 0..2000 {
        let unsure = at(500.0, 500.0, 0.2);
        let situation = Situation {
            step_s: 0.1,
            heading_rad: 0.0,
            drift_rad: drift,
            ..unsure
        };
        mission = mission.step(&situation, &map, &router);
        let Command { heading_rad, speed } = mission.command();
        assert_eq!((mission.state(), speed), (State::Localizing, 0.5));
        let (right, down) = (
            20.0 * speed * heading_rad.sin() + 5.0,
            -20.0 * speed * heading_rad.cos(),
        );
        (x, y) = (x + 0.1 * right, y + 0.1 * down);
        drift = wrapped(heading_of(right, down) - heading_rad);
        let next = heading_of(right, down);
        if step > 0 {
            turned += wrapped(next - course);
        }
        course = next;
        farthest = farthest.max(x.hypot(y));
        if turned > 2.0 * PI {
            turned -= 2.0 * PI;
            laps.push((step as f32 / 10.0, farthest));
        }
    }
    let (first_s, first_px) = laps[0];
    assert!(first_s > LIMITS.circle_s && first_s < 2.0 * LIMITS.circle_s);
    assert!(first_px < 10.0 * first_s / PI, "{laps:?}");
    assert!(
        laps[1].0 > 2.2 * first_s && laps[1].1 > 1.1 * first_px,
        "{laps:?}"
    );
    // It goes back to its leg as soon as it knows where it is.
    let sure = mission.step(&at(120.0, 510.0, 1.0), &map, &router);
    assert_eq!(sure.state(), State::Following);
    // Numbers that are none do no harm.
    for odd in [f32::NAN, f32::INFINITY, -1.0, 1e30] {
        let situation = Situation {
            step_s: odd,
            drift_rad: odd,
            ..at(500.0, 500.0, 0.2)
        };
        let command = mission.step(&situation, &map, &router).command();
        assert_eq!(command.speed, 0.5);
    }
}

#[test]
fn near_a_border_turns_lead_past_the_inside() {
    let (map, router) = world();
    let commanded = |situation: &Situation, limits: Limits| {
        let mission = Mission::new(limits).step(situation, &map, &router);
        wrapped(mission.command().heading_rad - situation.heading_rad)
    };
    // The nearest place is behind, to the left; nearer still is the border, 40 pixels ahead.
    let out = Situation {
        heading_rad: 0.2,
        ..at(900.0, 40.0, 1.0)
    };
    let nowhere = Limits {
        map_px: None,
        ..LIMITS
    };
    let right = |situation: &Situation, limits: Limits| commanded(situation, limits) / FRAC_PI_2;
    assert!((right(&out, nowhere) + 1.0).abs() < 1e-5);
    assert!((right(&out, LIMITS) - 1.0).abs() < 1e-5);
    let farther = Situation {
        estimate: at(900.0, 80.0, 1.0).estimate,
        ..out
    };
    assert!((right(&farther, LIMITS) + 1.0).abs() < 1e-5);
    // What was begun is ended on that side, at half speed, until the aim is ahead.
    let begun = Mission::new(LIMITS).step(&out, &map, &router);
    for (heading_rad, turn, speed) in [(0.2, 1.0, 0.5), (1.0, 1.0, 0.5), (2.8, 0.0, 1.0)] {
        let situation = Situation {
            heading_rad,
            ..farther
        };
        let command = begun.step(&situation, &map, &router).command();
        let ahead = wrapped(command.heading_rad - heading_rad) / FRAC_PI_2;
        assert_eq!(command.speed, speed);
        assert!(turn == 0.0 || (ahead - turn).abs() < 1e-5, "{ahead}");
    }
    // Who searches there begins with a turn to the inside.
    for (heading_rad, is_left) in [(FRAC_PI_2, false), (-FRAC_PI_2, true)] {
        let unsure = Situation {
            heading_rad,
            ..at(500.0, 40.0, 0.2)
        };
        assert_eq!(commanded(&unsure, LIMITS) < 0.0, is_left);
    }
}

#[test]
fn far_from_all_legs_the_nearest_place_is_flown_to() {
    let (map, router) = world();
    let mission = Mission::new(LIMITS).step(&at(290.0, 800.0, 1.0), &map, &router);
    let leg = mission.leg().expect("a leg");
    assert_eq!((leg.to, leg.end.x_px), (1, 300.0));
    assert!(mission.command().heading_rad.abs() < 0.1, "up the map");
    // Near it, the next leg is taken at once.
    let mission = mission.step(&at(300.0, 510.0, 1.0), &map, &router);
    assert_eq!(mission.leg().map(|leg| (leg.from, leg.to)), Some((1, 2)));
    let unreachable = Router::<8>::new();
    let mission = Mission::new(LIMITS).step(&at(290.0, 800.0, 1.0), &map, &unreachable);
    assert_eq!((mission.leg(), mission.command().speed), (None, 0.0));
}

/// Flies from the first place to the goal in a wind, with a compass that is wrong; the largest distance from the line
/// after the first leg, and whether it arrived.
fn flown(wind: [f32; 2], compass_rad: f32) -> (f32, bool) {
    let (map, router) = world();
    let mut mission = Mission::new(LIMITS);
    let (mut x, mut y, mut heading, mut drift) = (100.0, 500.0, 0.0, 0.0);
    let mut farthest = 0.0_f32;
    for _ in 0..3000 {
        let situation = Situation {
            step_s: 0.1,
            drift_rad: drift,
            ..at(x, y, 1.0)
        };
        mission = mission.step(&situation, &map, &router);
        if mission.state() == State::Arrived {
            return (farthest, true);
        }
        let Command { heading_rad, speed } = mission.command();
        heading =
            wrapped(heading + wrapped(heading_rad + compass_rad - heading).clamp(-0.05, 0.05));
        let (right, down) = (
            20.0 * speed * heading.sin() + wind[0],
            -20.0 * speed * heading.cos() + wind[1],
        );
        (x, y) = (x + 0.1 * right, y + 0.1 * down);
        // As it is seen: by and by, in the vehicle's axes, so the compass does not matter.
        drift += 0.1 * wrapped(heading_of(right, down) - heading - drift);
        if x > 400.0 {
            farthest = farthest.max((y - 500.0).abs());
        }
    }
    (farthest, false)
}

#[test]
fn wind_and_a_wrong_compass_are_held_against() {
    for (wind, compass, most) in [
        ([0.0, 0.0], 0.0, 10.0),
        ([0.0, 8.0], 0.0, 20.0),
        ([0.0, -8.0], 0.17, 20.0),
        ([-8.0, 4.0], -0.17, 20.0),
        ([6.0, 6.0], 0.1, 20.0),
    ] {
        let (farthest, has_arrived) = flown(wind, compass);
        assert!(has_arrived, "{wind:?} {compass}");
        assert!(farthest < most, "{wind:?} {compass}: {farthest}");
    }
}

#[test]
fn positions_are_measured_along_and_across() {
    let leg = Leg {
        from: 0,
        to: 1,
        start: Point {
            x_px: 10.0,
            y_px: 10.0,
        },
        end: Point {
            x_px: 10.0,
            y_px: 110.0,
        },
    };
    // Down the map: the right side is to the left.
    assert_eq!(
        guidance::on_leg(
            &leg,
            Point {
                x_px: 4.0,
                y_px: 40.0
            }
        ),
        (30.0, 6.0)
    );
    assert!((wrapped(leg.heading_rad()).abs() - PI).abs() < 1e-6);
    let right = Leg {
        end: Point {
            x_px: 60.0,
            y_px: 10.0,
        },
        ..leg
    };
    assert!((right.heading_rad() - FRAC_PI_2).abs() < 1e-6);
}
