use image::GrayImage;

use super::*;
use crate::simulate::{Command, Estimate, Readings, Report, Truth};

/// A step at `at` that believes to be at `believed`.
fn step(at: [f32; 2], believed: [f32; 2], confident: bool) -> Step {
    let [x_px, y_px] = believed;
    Step {
        time_s: 0.0,
        step_s: 0.1,
        kidnapped: false,
        truth: Some(Truth::still(at.map(f64::from))),
        readings: Readings::default(),
        seen: true,
        command: Command::default(),
        report: Report {
            estimate: Some(Estimate {
                position: Point { x_px, y_px },
                covariance_px2: None,
                confidence: None,
                confident,
            }),
            ..Report::default()
        },
    }
}

fn picture<'a>(map: &'a Map, steps: &'a [Step], places: &'a [Point]) -> FlightPicture<'a> {
    FlightPicture {
        map,
        meters_per_px: 0.5,
        footprint_px: 100.0,
        steps,
        goal: None,
        places,
        legs: &[[0, 1]],
        title: "title",
        caption: "caption",
    }
}

#[test]
fn ways_are_drawn_where_they_were() {
    let map = Map::from_luminance("gray", GrayImage::from_pixel(800, 600, image::Luma([90])));
    let mut steps = vec![
        step([100.0, 100.0], [100.0, 130.0], true),
        step([140.0, 100.0], [140.0, 130.0], true),
        step([180.0, 100.0], [180.0, 130.0], true),
        step([600.0, 500.0], [200.0, 130.0], true),
        step([640.0, 500.0], [230.0, 130.0], true),
    ];
    steps[3].kidnapped = true;
    let places = [[300.0, 300.0], [400.0, 300.0]].map(|[x_px, y_px]| Point { x_px, y_px });
    let drawn = picture(&map, &steps, &places).draw();
    // The map is enlarged twice.
    assert_eq!(drawn.width(), 1600);
    assert!(drawn.height() > 1200 + 100);
    let at = |x: u32, y: u32| drawn.get_pixel(2 * x, 2 * y).0;
    let is_near = |found: [u8; 3], ink: Ink| {
        found
            .into_iter()
            .zip(ink.color)
            .all(|(a, b)| a.abs_diff(b) < 40)
    };
    assert!(is_near(at(140, 100), PALE), "{:?}", at(140, 100));
    assert!(is_near(at(140, 130), AMBER), "{:?}", at(140, 130));
    assert!(is_near(at(215, 130), RED), "{:?}", at(215, 130));
    assert!(is_near(at(300, 300), STEEL), "{:?}", at(300, 300));
    assert_eq!(
        at(500, 200),
        at(700, 50),
        "ground, and no line of the jump as truth"
    );
    assert!(is_near(at(100, 97), GREEN), "{:?}", at(100, 97));
}

#[test]
fn the_belief_is_apart_by_trust_and_not_joined_over_jumps() {
    let steps = [
        step([0.0, 0.0], [0.0, 0.0], true),
        step([10.0, 0.0], [10.0, 0.0], true),
        step([20.0, 0.0], [20.0, 0.0], false),
        step([30.0, 0.0], [90.0, 0.0], true),
        step([40.0, 0.0], [130.0, 0.0], true),
        step([40.0, 0.0], [141.0, 0.0], true),
    ];
    let ways = Ways::of(&steps, 100.0, 1.0);
    let expected = [
        (Trust::Confident, vec![[0.0, 0.0], [10.0, 0.0]]),
        (Trust::Unsure, vec![[10.0, 0.0], [20.0, 0.0]]),
        (Trust::Confident, vec![[90.0, 0.0], [130.0, 0.0]]),
        (Trust::Wrong, vec![[130.0, 0.0], [141.0, 0.0]]),
    ];
    assert_eq!(ways.belief, expected);
}

#[test]
fn nothing_is_drawn_of_nothing() {
    let map = Map::from_luminance("dot", GrayImage::new(40, 30));
    let drawn = picture(&map, &[], &[]).draw();
    assert_eq!(drawn.width(), 100);
}

#[test]
fn a_picture_is_written_as_drawn() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("flight.png");
    let map = Map::from_luminance("gray", GrayImage::from_pixel(80, 60, image::Luma([90])));
    let steps = [step([10.0, 10.0], [12.0, 10.0], true)];
    picture(&map, &steps, &[]).write(&path).expect("writable");
    let read = image::open(&path).expect("a picture").to_rgb8();
    assert_eq!(read, picture(&map, &steps, &[]).draw());
}
