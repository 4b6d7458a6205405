use eigenmark_core::landmark::Point;
use image::GrayImage;

use super::*;
use crate::{
    map::Map,
    simulate::{
        Camera, Command, FlightSettings, Light, Pilot, Scene, Shutter, Sight, Step, World, fly,
        seeded,
    },
};

/// Keeps what it sees.
#[derive(Default)]
struct Keeper(Vec<Option<Vec<u8>>>);

impl Pilot for Keeper {
    fn decide(&mut self, sight: &Sight<'_>) -> Command {
        self.0.push(sight.frame.map(|frame| frame.pixels.clone()));
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

const MIDDLE: Point = Point {
    x_px: 300.0,
    y_px: 250.0,
};

fn world(map: &Map) -> World<'_> {
    World {
        map,
        meters_per_px: 0.5,
        camera: Camera::sized(80, 60, 100.0),
    }
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
    (keeper.0, flight.steps)
}

#[test]
fn about_the_stated_share_of_the_frames_does_not_arrive() {
    let lost: usize = (0..20)
        .map(|seed| {
            let (_, steps) = flown(&short(FlightSettings::new(seed, MIDDLE)));
            steps.iter().filter(|step| !step.seen).count()
        })
        .sum();
    // The deviation of a count of 101 in 2,020 is 10.
    assert!((60..142).contains(&lost), "{lost}");
}

#[test]
fn an_ideal_flight_shows_the_map_as_it_is() {
    let map = map();
    let settings = short(FlightSettings::ideal(1, MIDDLE));
    let (frames, steps) = flown(&settings);
    let camera = world(&map).camera;
    for (step, pixels) in steps.iter().zip(&frames) {
        let truth = step.truth.expect("simulated");
        let mut frame = camera.frame();
        let scene = Scene {
            heading_rad: truth.heading_rad,
            ..Scene::nominal(truth.place())
        };
        camera.render(&map, &scene, &mut seeded(1, 1), &mut frame);
        let seen = pixels.as_ref().expect("arrives");
        assert!(
            frame
                .pixels
                .iter()
                .zip(seen)
                .all(|(a, b)| a.abs_diff(*b) <= 1)
        );
        assert_eq!(step.readings.heading_rad, Some(truth.heading_rad as f32));
    }
}

#[test]
fn each_effect_of_the_sensor_changes_frames() {
    let ideal = short(FlightSettings::ideal(1, MIDDLE));
    let plain = flown(&ideal).0;
    let with = |sensor: Sensor, light: Light| {
        flown(&FlightSettings {
            sensor,
            light,
            ..ideal
        })
        .0
    };
    let mean = |frame: &Option<Vec<u8>>| {
        let frame = frame.as_ref().expect("arrives");
        frame.iter().map(|&p| f64::from(p)).sum::<f64>() / frame.len() as f64
    };
    let noisy = with(
        Sensor {
            noise: 5.0,
            ..Sensor::ideal()
        },
        Light::steady(),
    );
    let pairs = || {
        let noisy = noisy.iter().flatten().flatten();
        noisy.zip(plain.iter().flatten().flatten())
    };
    let squares: f64 = pairs()
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2))
        .sum();
    let deviation = (squares / pairs().count() as f64).sqrt();
    assert!((deviation - 5.0).abs() < 0.15, "{deviation}");

    let dim = with(
        Sensor {
            vignetting: 0.4,
            ..Sensor::ideal()
        },
        Light::steady(),
    );
    for (a, b) in dim.iter().zip(&plain) {
        let (a, b) = (a.as_ref().expect("arrives"), b.as_ref().expect("arrives"));
        assert!(
            (f64::from(a[0]) - 0.6 * f64::from(b[0])).abs() <= 1.0,
            "corner"
        );
        assert!(a[30 * 80 + 40].abs_diff(b[30 * 80 + 40]) <= 1, "middle");
    }

    let bright = Light {
        gamma: [0.5; 2],
        ..Light::steady()
    };
    for (a, b) in with(Sensor::ideal(), bright).iter().zip(&plain) {
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            let expected = 255.0 * (f64::from(*b) / 255.0).sqrt();
            assert!((f64::from(*a) - expected).abs() <= 0.51);
        }
    }

    let cloudy = Light {
        clouds: Light::default().clouds,
        ..Light::steady()
    };
    let ratios: Vec<f64> = with(Sensor::ideal(), cloudy)
        .iter()
        .zip(&plain)
        .map(|(a, b)| mean(a) / mean(b))
        .collect();
    let darkest = ratios.iter().copied().fold(1.0, f64::min);
    assert!(
        ratios.iter().all(|ratio| (0.59..=1.001).contains(ratio)),
        "{ratios:?}"
    );
    assert!(darkest < 0.99, "{darkest}");
}

#[test]
fn a_torn_frame_ends_with_the_frame_before() {
    let all = short(FlightSettings::new(2, MIDDLE));
    let sensor = |torn| Sensor {
        torn,
        noise: 0.0,
        dropped: 0.0,
        shutter: Shutter::INSTANT,
        ..all.sensor
    };
    let [whole, torn] = [0.0, 0.2].map(|torn| {
        flown(&FlightSettings {
            sensor: sensor(torn),
            ..all
        })
        .0
    });
    let mut count = 0;
    for index in 1..whole.len() {
        let [now, before] = [&whole[index], &torn[index - 1]].map(|f| f.as_ref().expect("arrives"));
        let seen = torn[index].as_ref().expect("arrives");
        if seen == now {
            continue;
        }
        count += 1;
        let cut = (1..60).find(|row| {
            seen[..row * 80] == now[..row * 80] && seen[row * 80..] == before[row * 80..]
        });
        assert!(cut.is_some(), "frame {index}");
    }
    assert!((8..35).contains(&count), "{count} of 100");
}
