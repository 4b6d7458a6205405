//! Path integration over every map: what it drifts by when it only looks, and when the tilt it is told is wrong and a
//! compass and an altimeter help.

use std::f64::consts::TAU;

use eigenmark::{
    map::Map,
    simulate::{Camera, CameraFrame, Scene, seeded},
};
use eigenmark_core::{
    landmark::Point,
    preprocess::{Pose, Tilt},
    track::{Covariance, Odometry, Placement},
};
use eigenmark_tests::maps::{self, TestMap};
use rand::{Rng, RngExt};

/// Flights per map and conditions.
const FLIGHTS: u64 = 2;

/// Frames of a flight, and the way between two as a share of the footprint.
const FRAMES: u32 = 400;
const STEP: f64 = 0.04;

/// Noise of the sensor, in gray levels.
const NOISE: f64 = 2.0;

/// The largest roll and pitch, and by how much what is told of them is wrong, at most, in degrees.
const TILT_DEG: f64 = 4.0;
const TOLD_DEG: f64 = 1.0;

/// Standard deviations of a compass, in radians, and of an altimeter, as a share of the altitude.
const COMPASS_RAD: f64 = 0.03;
const ALTIMETER: f64 = 0.02;

/// Distance from the truth at the end over the way flown, at most, in percent. The goal is 3, most flights are below 0.5:
/// see [`flights_over_every_map_drift_little`].
const MAX_DRIFT_PERCENT: f64 = 1.0;

/// What else there is than level flight.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Conditions {
    /// The camera looks straight down, and nothing else is known.
    Level,
    /// The vehicle rolls and pitches, which is told with an error; it has a compass and an altimeter.
    Rough,
}

/// How a flight ended.
struct Flown {
    /// Distance from the truth over the way flown.
    drift_percent: f64,
    /// Standard deviation that is stated of it, likewise.
    stated_percent: f64,
    /// Frames that were not related to the one before.
    lost: u32,
}

/// Drift of two flights in percent of ways of 16 sides:
///
/// | map | level | rough |
/// | --- | --- | --- |
/// | city | 0.05, 0.59 | 0.32, 0.33 |
/// | wellington | 0.05, 0.16 | 0.33, 0.33 |
/// | nust | 0.17, 0.48 | 0.25, 0.31 |
/// | kitsap | 0.42, 0.47 | 0.36, 0.27 |
#[test]
fn flights_over_every_map_drift_little() {
    for map in maps::all() {
        let opened = map.open();
        for conditions in [Conditions::Level, Conditions::Rough] {
            let mut drifts = Vec::new();
            for seed in 0..FLIGHTS {
                let flown = fly(&opened, &map, conditions, seed);
                assert_eq!(flown.lost, 0, "{} {conditions:?} {seed}", map.name);
                assert!(
                    flown.drift_percent < MAX_DRIFT_PERCENT,
                    "{} {conditions:?} {seed}: {:.2} %",
                    map.name,
                    flown.drift_percent
                );
                drifts.push(format!(
                    "{:.2} (stated {:.2})",
                    flown.drift_percent, flown.stated_percent
                ));
            }
            println!(
                "{} {conditions:?}: drift in percent {}",
                map.name,
                drifts.join(", ")
            );
        }
    }
}

/// Around the middle of the map, as far out as frames stay on it, up and down a little.
fn fly(map: &Map, of: &TestMap, conditions: Conditions, seed: u64) -> Flown {
    let footprint = f64::from(of.view_size_px);
    let camera = Camera::square_of(footprint);
    let [width, height] = [map.width(), map.height()].map(f64::from);
    // Half a diagonal, higher than nominal and tilted, is less than a footprint.
    let [across, along] = [width, height].map(|side| side / 2.0 - 0.95 * footprint);
    let mut random = seeded(seed, 11);
    let mut frame = camera.frame();
    let mut odometry = Box::new(Odometry::whole());
    let (mut turn, mut way, mut lost) = (TAU * random.random::<f64>(), 0.0, 0);
    let phases: [f64; 3] = std::array::from_fn(|_| TAU * random.random::<f64>());
    let mut scene = Scene::nominal(Point {
        x_px: 0.0,
        y_px: 0.0,
    });
    for number in 0..FRAMES {
        let before = scene.place;
        let speed = (across * turn.sin()).hypot(along * turn.cos());
        turn += STEP * footprint / speed.max(footprint);
        let swing = |index: usize, frames: f64| (f64::from(number) / frames + phases[index]).sin();
        scene.place = Point {
            x_px: (width / 2.0 + across * turn.cos()) as f32,
            y_px: (height / 2.0 + along * turn.sin()) as f32,
        };
        // Along the way, which is (−sin, cos), from map-up; not quite, for there is wind.
        scene.heading_rad =
            (-across * turn.sin()).atan2(-along * turn.cos()) + 0.2 * swing(0, 40.0);
        scene.altitude_ratio = 1.0 + 0.05 * swing(1, 60.0);
        scene.noise = NOISE;
        scene.gamma = 1.0 + 0.3 * swing(2, 100.0);
        if conditions == Conditions::Rough {
            scene.roll_rad = TILT_DEG.to_radians() * swing(1, 8.0);
            scene.pitch_rad = TILT_DEG.to_radians() * swing(2, 11.0);
        }
        assert!(
            camera.is_on_map(map, &scene),
            "{} frame {number}: {scene:?}",
            of.name
        );
        camera.render(map, &scene, &mut random, &mut frame);
        if number == 0 {
            assert!(odometry.restart(truth(&scene, footprint), &Covariance::zeros()));
        } else {
            let [dx, dy] = [
                scene.place.x_px - before.x_px,
                scene.place.y_px - before.y_px,
            ];
            way += f64::from(dx.hypot(dy)) / footprint;
        }
        let is_related = advance(
            &mut odometry,
            &camera,
            &frame,
            &scene,
            conditions,
            &mut random,
        );
        lost += u32::from(number > 0 && !is_related);
    }
    let (found, truth) = (odometry.placement(), truth(&scene, footprint));
    let covariance = odometry.covariance();
    let percent = |sides: f32| 100.0 * f64::from(sides) / way;
    Flown {
        drift_percent: percent((found.x - truth.x).hypot(found.y - truth.y)),
        stated_percent: percent((covariance.m11 + covariance.m22).sqrt()),
        lost,
    }
}

fn advance(
    odometry: &mut Odometry,
    camera: &Camera,
    frame: &CameraFrame,
    scene: &Scene,
    conditions: Conditions,
    random: &mut impl Rng,
) -> bool {
    if conditions == Conditions::Level {
        return odometry.advance(&frame.as_frame(), None).is_some();
    }
    let mut wrong = || TOLD_DEG.to_radians() * random.random_range(-1.0..=1.0);
    let tilt = tilt(scene.roll_rad + wrong(), scene.pitch_rad + wrong(), camera);
    let is_related = odometry.advance(&frame.as_frame(), tilt).is_some();
    let mut error = |deviation: f64| {
        // Uniform, with that standard deviation.
        deviation * 3_f64.sqrt() * random.random_range(-1.0..=1.0)
    };
    let heading = scene.heading_rad + error(COMPASS_RAD);
    assert!(odometry.correct_heading(heading as f32, COMPASS_RAD.powi(2) as f32));
    let ratio = scene.altitude_ratio * (1.0 + error(ALTIMETER));
    assert!(odometry.correct_altitude(ratio as f32, ALTIMETER.powi(2) as f32));
    is_related
}

fn tilt(roll_rad: f64, pitch_rad: f64, camera: &Camera) -> Option<Tilt> {
    let [roll, pitch, view] =
        [roll_rad, pitch_rad, camera.field_of_view_rad()].map(|angle| angle as f32);
    Pose::NOMINAL
        .tilted(roll, pitch, view)
        .expect("in range")
        .tilt()
}

fn truth(scene: &Scene, footprint: f64) -> Placement {
    Placement {
        x: (f64::from(scene.place.x_px) / footprint) as f32,
        y: (f64::from(scene.place.y_px) / footprint) as f32,
        heading_rad: scene.heading_rad as f32,
        altitude_ratio: scene.altitude_ratio as f32,
    }
}
