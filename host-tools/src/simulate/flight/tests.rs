use eigenmark_core::landmark::Point;
use image::GrayImage;

use super::*;
use crate::{
    map::Map,
    simulate::{Camera, Instruments, Sensor, Wind, World, flight_seed},
};

/// Heads one way and sees nothing.
struct Blind(Command);

impl Pilot for Blind {
    fn decide(&mut self, _: &Sight<'_>) -> Command {
        self.0
    }
}

/// Keeps what it sees.
#[derive(Default)]
struct Keeper {
    frames: Vec<Option<Vec<u8>>>,
}

impl Pilot for Keeper {
    fn decide(&mut self, sight: &Sight<'_>) -> Command {
        self.frames
            .push(sight.frame.map(|frame| frame.pixels.clone()));
        Command {
            heading_rad: 0.4,
            speed: 0.5,
        }
    }
}

fn map() -> Map {
    let picture = GrayImage::from_fn(600, 500, |x, y| {
        let wave = (f64::from(x) / 9.0).sin() * (f64::from(y) / 7.0).cos();
        image::Luma([(120.0 + 60.0 * wave) as u8])
    });
    Map::from_luminance("waves", picture)
}

fn world(map: &Map) -> World<'_> {
    World {
        map,
        meters_per_px: 0.5,
        camera: Camera::sized(80, 60, 100.0),
    }
}

fn at(x_px: f32, y_px: f32) -> Point {
    Point { x_px, y_px }
}

fn short(settings: FlightSettings) -> FlightSettings {
    FlightSettings {
        time_limit_s: 10.0,
        ..settings
    }
}

/// The frames and steps of a flight that pays no attention to them.
fn flown(settings: &FlightSettings) -> (Vec<Option<Vec<u8>>>, Vec<Step>) {
    let map = map();
    let mut keeper = Keeper::default();
    let flight = fly(&world(&map), settings, &mut keeper).expect("flyable");
    assert_eq!(keeper.frames.len(), flight.steps.len());
    (keeper.frames, flight.steps)
}

#[test]
fn the_same_seed_gives_the_same_flight_and_another_seed_another() {
    let settings = short(FlightSettings::new(5, at(300.0, 250.0)));
    let first = flown(&settings);
    assert_eq!(first, flown(&settings));
    assert_eq!(first.1.len(), 101, "ten a second, both ends included");
    let other = flown(&FlightSettings {
        seed: 6,
        ..settings
    });
    assert_ne!(first.1[0].readings, other.1[0].readings);
    assert_ne!(first.1[100].truth, other.1[100].truth);
}

/// Simulated flights know it at every step.
fn truth(step: &Step) -> Truth {
    step.truth.expect("simulated")
}

/// Steps without what the instruments read.
fn truths(steps: &[Step]) -> Vec<Truth> {
    steps.iter().map(truth).collect()
}

#[test]
fn switching_one_effect_off_changes_no_other() {
    let all = short(FlightSettings::new(5, at(300.0, 250.0)));
    let (frames, steps) = flown(&all);
    let ideal = FlightSettings::ideal(5, at(300.0, 250.0));

    // But the compass: headings are held by it.
    let (_, unread) = flown(&FlightSettings {
        instruments: Instruments {
            heading_rad: all.instruments.heading_rad,
            ..ideal.instruments
        },
        ..all
    });
    assert_eq!(truths(&steps), truths(&unread));

    let (dark, seen) = flown(&FlightSettings {
        sensor: Sensor {
            dropped: 0.0,
            torn: 0.0,
            ..all.sensor
        },
        ..all
    });
    assert_eq!(truths(&steps), truths(&seen));
    assert!(dark.iter().all(Option::is_some));
    let whole = flown(&FlightSettings {
        sensor: Sensor {
            torn: 0.0,
            ..all.sensor
        },
        ..all
    });
    for (a, b) in whole.0.iter().zip(&dark).filter(|(a, _)| a.is_some()) {
        assert_eq!(a, b, "what arrives is the same");
    }
    assert_eq!(
        frames.iter().map(Option::is_some).collect::<Vec<_>>(),
        whole.0.iter().map(Option::is_some).collect::<Vec<_>>()
    );

    let (_, calm) = flown(&FlightSettings {
        wind: Wind {
            gust_m_s: 0.0,
            ..all.wind
        },
        ..all
    });
    for (a, b) in steps.iter().zip(&calm) {
        assert_eq!(truth(a).altitude_ratio, truth(b).altitude_ratio);
        let error = |step: &Step| {
            let read = f64::from(step.readings.heading_rad.expect("read"));
            read - truth(step).heading_rad
        };
        assert!((error(a) - error(b)).abs() < 1e-6);
    }
    assert_ne!(
        truth(&steps[100]).position_px,
        truth(&calm[100]).position_px
    );
}

#[test]
fn a_guided_flight_follows_its_way_in_the_wind_and_arrives() {
    let map = map();
    let way = vec![
        at(100.0, 100.0),
        at(500.0, 120.0),
        at(450.0, 400.0),
        at(120.0, 380.0),
    ];
    let settings = FlightSettings {
        goal: way.last().copied(),
        sensor: Sensor::ideal(),
        ..FlightSettings::new(8, way[0])
    };
    let mut pilot = Guided::new(way.clone(), 0.5, 6.0, Blind(Command::default()));
    let flight = fly(&world(&map), &settings, &mut pilot).expect("flyable");
    assert_eq!(flight.end, End::Arrived);
    assert!(flight.steps.len() > 500, "more than 500 m");
    for step in &flight.steps {
        let [x, y] = truth(step).position_px;
        let off = way.windows(2).map(|leg| {
            let [(ax, ay), (bx, by)] =
                [leg[0], leg[1]].map(|p| (f64::from(p.x_px), f64::from(p.y_px)));
            let (dx, dy) = (bx - ax, by - ay);
            let along = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
            (x - ax - along * dx).hypot(y - ay - along * dy)
        });
        let off = off.fold(f64::MAX, f64::min);
        // A turning circle of 17 m, slip, and what the wind adds.
        assert!(off < 50.0, "25 m off at {x} {y}");
    }
}

#[test]
fn flights_end_off_the_map_in_time_or_by_mistake() {
    let map = map();
    let world = world(&map);
    let settings = FlightSettings::ideal(1, at(300.0, 250.0));
    let away = Command {
        heading_rad: 0.0,
        speed: 1.0,
    };
    let left = fly(&world, &settings, &mut Blind(away)).expect("flyable");
    assert_eq!(left.end, End::LeftMap);
    // 125 m at 6 m/s, after some seconds of getting there.
    assert!(
        (200..280).contains(&left.steps.len()),
        "{}",
        left.steps.len()
    );
    let idle = fly(&world, &short(settings), &mut Blind(Command::default())).expect("flyable");
    assert_eq!(idle.end, End::OutOfTime);
    let goal = Some(at(500.0, 250.0));
    let mut nowhere = Guided::new(Vec::new(), 0.5, 6.0, Blind(away));
    let wrong = fly(&world, &FlightSettings { goal, ..settings }, &mut nowhere).expect("flyable");
    assert_eq!((wrong.end, wrong.steps.len()), (End::Mistaken, 1));
}

#[test]
fn a_kidnapped_vehicle_is_elsewhere_from_then_on() {
    let mut settings = short(FlightSettings::ideal(1, at(300.0, 250.0)));
    settings.kidnapping = Some(Kidnapping {
        time_s: 5.0,
        to: at(100.0, 400.0),
    });
    let steps = flown(&settings).1;
    for (index, step) in steps.iter().enumerate() {
        assert_eq!(step.kidnapped, index == 50);
        let is_far = truth(step).position_px[1] > 350.0;
        assert_eq!(is_far, index >= 50);
    }
    assert_eq!(truth(&steps[50]).position_px, [100.0, 400.0]);
}

#[test]
fn several_flights_are_flown_as_each_alone() {
    let map = map();
    let world = world(&map);
    let settings: Vec<FlightSettings> = (0..4)
        .map(|index| short(FlightSettings::new(flight_seed(9, index), at(300.0, 250.0))))
        .collect();
    let count = std::sync::atomic::AtomicUsize::new(0);
    let flights = fly_all(
        &world,
        &settings,
        |_, _| Keeper::default(),
        |_| {
            count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        },
    )
    .expect("flyable");
    assert_eq!(count.into_inner(), 4);
    for (flight, settings) in flights.iter().zip(&settings) {
        let alone = fly(&world, settings, &mut Keeper::default()).expect("flyable");
        assert_eq!(*flight, alone);
    }
}

#[test]
fn settings_without_sense_are_named() {
    let map = map();
    let refused = |change: fn(&mut FlightSettings)| {
        let mut settings = FlightSettings::new(1, at(300.0, 250.0));
        change(&mut settings);
        let flown = fly(&world(&map), &settings, &mut Keeper::default());
        flown.expect_err("refused").to_string()
    };
    assert_eq!(
        refused(|settings| settings.frame_rate_hz = 0.0),
        "frames per second of 0; expected a positive number"
    );
    assert_eq!(
        refused(|settings| settings.start = at(600.0, 20.0)),
        "a start at (600, 20); expected a place on the map of 600×500 pixels"
    );
    assert!(refused(|settings| settings.sensor.dropped = f64::NAN).contains("dropped"));
    assert!(refused(|settings| settings.time_limit_s = 1e9).contains("frames in all"));
    assert!(
        refused(|settings| settings.instruments = Instruments {
            heading_rad: Some(-1.0),
            ..Instruments::none()
        })
        .contains("heading")
    );
}

#[test]
fn what_a_pilot_says_in_numbers_that_are_none_is_left_out() {
    struct Confused;
    impl Pilot for Confused {
        fn decide(&mut self, _: &Sight<'_>) -> Command {
            Command {
                heading_rad: f32::NAN,
                speed: f32::INFINITY,
            }
        }
        fn report(&self) -> Report {
            Report {
                estimate: Some(Estimate {
                    position: at(1.0, 2.0),
                    covariance_px2: Some([1.0, f32::NAN, 1.0]),
                    confidence: Some(0.5),
                    confident: true,
                }),
                odometry: Some(at(f32::NAN, 0.0)),
                ..Report::default()
            }
        }
    }
    let map = map();
    let settings = short(FlightSettings::new(1, at(300.0, 250.0)));
    let flight = fly(&world(&map), &settings, &mut Confused).expect("flyable");
    for step in &flight.steps {
        assert_eq!(Some(step.command.heading_rad), step.readings.heading_rad);
        assert_eq!(step.command.speed, 0.0);
        let estimate = step.report.estimate.expect("kept");
        assert_eq!(
            (estimate.covariance_px2, estimate.confidence),
            (None, Some(0.5))
        );
        assert_eq!(step.report.odometry, None);
    }
}
