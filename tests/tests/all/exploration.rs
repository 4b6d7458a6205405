//! Exploring every map without an atlas, in wind and with instruments that err: the chart against the truth, and flights to
//! places of it.

use eigenmark::simulate::{Camera, FlightSettings, Scout, World, fly};
use eigenmark_core::{chart::Pattern, landmark::Point, route::Router};
use eigenmark_tests::maps::{self, TestMap};

/// Seeds of the flights on each map.
const SEEDS: [u64; 2] = [1, 2];

/// A side in meters: a blimp takes 17 s for it at full speed.
const SIDE_M: f64 = 100.0;

/// Distance of the start from the map's edges, and the largest box, in sides.
const MARGIN: f64 = 1.4;
const BOX: [f64; 2] = [4.0, 1.8];

/// Distance of two lines, in sides.
const SPACING: f32 = 0.6;

/// Places that are visited after exploring; the last is where the flight began.
const VISITS: usize = 4;

/// Largest error of a place, and of an arrival, in sides.
const MAX_CHART: f64 = 0.5;
const MAX_ARRIVAL: f64 = 1.0;

/// Least number of places per square side of the box.
const MIN_DENSITY: f64 = 2.0;

/// Errors in sides, of the chart (mean, largest) and of arrivals (largest), by seed:
///
/// | map | places | chart | arrivals |
/// | --- | --- | --- | --- |
/// | city | 39, 38 | 0.07, 0.20; 0.14, 0.39 | 0.43, 0.51 |
/// | wellington | 46, 35 | 0.10, 0.16; 0.08, 0.24 | 0.40, 0.57 |
/// | nust | 21, 21 | 0.11, 0.40; 0.12, 0.25 | 0.52, 0.31 |
/// | kitsap | 37, 36 | 0.08, 0.28; 0.09, 0.16 | 0.52, 0.42 |
///
/// Arrivals count from a quarter of a side on, so that much of theirs is no error.
#[test]
fn every_map_is_explored_and_places_are_found_again() {
    for map in maps::all() {
        for seed in SEEDS {
            explore(&map, seed);
        }
    }
}

fn explore(of: &TestMap, seed: u64) {
    let map = of.open();
    let side_px = f64::from(of.view_size_px);
    let camera = Camera::sized(160, 120, side_px);
    let world = World {
        map: &map,
        meters_per_px: SIDE_M / side_px,
        camera,
    };
    let sides = [map.width(), map.height()].map(|px| f64::from(px) / side_px - 2.0 * MARGIN);
    let [across, down] = [0, 1].map(|axis| sides[axis].min(BOX[axis]));
    assert!(across > 1.0 && down > 1.0, "{} is small", of.name);
    let pattern = Pattern::Lawn {
        from: [0.0, 0.0],
        to: [across as f32, down as f32],
        spacing: SPACING,
    };
    let corner = (MARGIN * side_px) as f32;
    let start = Point {
        x_px: corner,
        y_px: corner,
    };
    let settings = FlightSettings {
        time_limit_s: 1_500.0,
        ..FlightSettings::new(seed, start)
    };
    let mut scout = Scout::new(pattern, VISITS, camera.field_of_view_rad(), side_px);
    let flight = fly(&world, &settings, &mut scout).expect("flies");

    let errors: Vec<f64> = scout
        .chart_errors_px()
        .iter()
        .map(|px| px / side_px)
        .collect();
    let arrivals: Vec<f64> = scout
        .arrivals()
        .iter()
        .map(|arrival| arrival.error_px() / side_px)
        .collect();
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let chart = scout.chart().map();
    println!(
        "{} {seed}: {} places, {} legs, chart off by {mean:.2} (mean), {worst:.2} (most) sides; arrivals {arrivals:.2?} in {:.0} s",
        of.name,
        errors.len(),
        chart.stored_legs().len(),
        flight.steps.last().map_or(0.0, |step| step.time_s),
    );
    let least = MIN_DENSITY * across * down;
    assert!(errors.len() as f64 >= least, "{} {seed}", of.name);
    assert!(worst <= MAX_CHART, "{} {seed}: {errors:.2?}", of.name);
    assert_eq!(arrivals.len(), VISITS, "{} {seed}", of.name);
    assert!(
        arrivals.iter().all(|&error| error <= MAX_ARRIVAL),
        "{} {seed}: {arrivals:?}",
        of.name
    );
    let mut router = Router::<128>::new();
    router.plan(&chart, 0).expect("home is a place");
    let is_reached = |place: usize| router.length_px(place as u16).is_some();
    assert!((0..chart.len()).all(is_reached), "{} {seed}", of.name);
}
