//! Flights over every map: the vehicle's own software in a closed loop, in wind and changing light, by a dense table.
//!
//! `tests/flights` flies twenty of a kilometer over the whole of each real map and keeps what it finds in `flights.md`;
//! these few are short, and over the middle of each map, so that there is less to train.

use eigenmark::{
    atlas::AtlasBuffer,
    learn::Settings,
    map::Map,
    output::Progress,
    select::Selection,
    simulate::{Camera, End, FlightSettings, Onboard, Statistics, World, fly_all, plan_flights},
    topology,
    train::train,
};
use eigenmark_core::{
    eigenspace::Normalize,
    landmark::{Metric, Width},
};
use eigenmark_tests::maps::{self, TestMap};
use image::imageops::crop_imm;

/// Flights over each map, their shortest way in meters, and their seed.
const FLIGHTS: u32 = 2;
const DISTANCE_M: f64 = 400.0;
const SEED: u64 = 1;

/// Width and height of the part of a map that is flown over, in sides of a view.
const PART: [u32; 2] = [5, 4];

/// Landmarks are that many to a view's side: with four, vehicles are lost now and then.
const LANDMARKS_PER_SIDE: u32 = 8;

/// Pixels per side of a view.
const VIEW_SIDE: u32 = 20;

/// Median distance of the believed position from the true one, at most, as a share of a view's side.
const MAX_ERROR: f64 = 0.25;

/// Confident estimates that are farther off than one view's side, at most, in percent.
const MAX_WRONG_PERCENT: f64 = 1.0;

/// Confident estimates, at least, in percent of the frames: who is never sure is never wrong.
const MIN_CONFIDENT_PERCENT: f64 = 75.0;

/// Drift of path integration over the way of one flight, at most, in percent. The goal, 3, is the mean of twenty long
/// flights: of single ones some drift twice as much, as their compass is wrong by up to 10° all the way.
const MAX_DRIFT_PERCENT: f64 = 6.0;

/// Meters per map pixel, as `tests/flights` has them; of the city, as of the map with views of the same size.
fn meters_per_px(map: &TestMap) -> f64 {
    match map.name {
        "nust" => 0.5,
        "kitsap" => 1.5,
        _ => 0.25,
    }
}

/// The middle of a map.
fn middle(of: &TestMap) -> Map {
    let map = of.open();
    let [width, height] = PART.map(|sides| sides * of.view_size_px);
    let (left, top) = ((map.width() - width) / 2, (map.height() - height) / 2);
    Map::from_luminance(
        of.name,
        crop_imm(map.luminance(), left, top, width, height).to_image(),
    )
}

/// What is flown by: a dense table, with places wherever there is room for them. Which of them are recognized in flight is
/// not tried first: that takes longer than the flights.
fn dense(map: &Map, view_size_px: u32) -> AtlasBuffer {
    let settings = Settings {
        scale: f64::from(view_size_px) / f64::from(VIEW_SIDE),
        dimensions: 48,
        selection: Selection::All,
        view_size_px,
        stride_px: Some(view_size_px / LANDMARKS_PER_SIDE),
        normalize: Normalize::Std,
        highpass_px: 3.0,
        whiten: 0.5,
        metric: Metric::Cosine,
        width: Width::I8,
        ..Settings::default()
    };
    let trained = train(map, &settings, false, &Progress::Hidden).expect("trains");
    let atlas = trained.atlas();
    let charted = topology::of_landmarks(&atlas).add_to(&atlas);
    charted.expect("places on the map")
}

/// Flights over the middle of a map, with wind, light, sensor and instruments as they usually are.
fn flown(of: &TestMap) -> Vec<Statistics> {
    let map = middle(of);
    let buffer = dense(&map, of.view_size_px);
    let atlas = buffer.atlas();
    let side_px = f64::from(of.view_size_px);
    let world = World {
        map: &map,
        meters_per_px: meters_per_px(of),
        camera: Camera::sized(160, 120, side_px),
    };
    let plans = plan_flights(&world, &atlas, FLIGHTS, DISTANCE_M, false, SEED).expect("ways");
    let settings: Vec<FlightSettings> = plans.iter().map(|plan| plan.settings).collect();
    let pilot = |index: usize, _: &FlightSettings| {
        let field_of_view_rad = world.camera.field_of_view_rad();
        Onboard::new(atlas.clone(), &plans[index].goals, field_of_view_rad).expect("planned to")
    };
    let flights = fly_all(&world, &settings, pilot, |_| ()).expect("flown");
    flights
        .iter()
        .map(|flight| {
            Statistics::of(
                &flight.steps,
                Some(flight.end),
                world.meters_per_px,
                side_px,
            )
        })
        .collect()
}

#[test]
fn vehicles_arrive_over_every_map_and_know_where_they_are() {
    for map in maps::all() {
        let side_px = f64::from(map.view_size_px);
        for (flight, number) in flown(&map).iter().zip(1..) {
            let error_px = flight.median_error_px.expect("estimates");
            let drift_percent = flight.drift_percent.expect("path integration");
            let wrong_percent = flight.confident_wrong_percent.expect("simulated");
            let distance_m = flight.distance_m.expect("simulated");
            let what = format!(
                "{}, flight {number}: {:?} after {distance_m:.0} m, error {error_px:.1} px, drift {drift_percent:.2} %, \
                 {:.1} % confident, of them {wrong_percent:.2} % wrong",
                map.name, flight.end, flight.confident_percent
            );
            println!("{what}");
            assert_eq!(flight.end, Some(End::Arrived), "{what}");
            // An arrival is one from half a view's side away, at each goal.
            assert!(distance_m > DISTANCE_M / 2.0, "{what}");
            assert!(error_px <= MAX_ERROR * side_px, "{what}");
            assert!(drift_percent <= MAX_DRIFT_PERCENT, "{what}");
            assert!(flight.confident_percent >= MIN_CONFIDENT_PERCENT, "{what}");
            assert!(wrong_percent <= MAX_WRONG_PERCENT, "{what}");
        }
    }
}
