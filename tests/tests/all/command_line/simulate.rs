//! `simulate`: flights, their numbers, recordings and pictures.

use std::{fs, path::Path, sync::LazyLock};

use eigenmark_tests::cli::run;
use image::{GrayImage, Luma};
use serde_json::Value;

use super::Fixture;

/// A dense table of the city without places, trained once.
static CITY: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let fixture = Fixture::empty();
    let out = fixture.name("city.atlas");
    let arguments = "train --map builtin:city --stride 50 --dims 48 --normalize std --highpass 3 --whiten 0.5 \
                     --metric cosine --coefficients i8 --select all --places";
    let places = fixture.name("places.json");
    fs::write(&places, PLACES).expect("writable");
    let mut arguments: Vec<&str> = arguments.split(' ').collect();
    arguments.extend([&places, "--out", &out]);
    let output = run(&arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    fs::read(out).expect("written")
});

/// Places all over the city, some 120 pixels apart, and two on an island of their own.
const PLACES: &str = r#"{
    "places": [
        {"x_px": 300, "y_px": 300}, {"x_px": 500, "y_px": 300}, {"x_px": 700, "y_px": 300}, {"x_px": 900, "y_px": 300},
        {"x_px": 300, "y_px": 500}, {"x_px": 500, "y_px": 500}, {"x_px": 700, "y_px": 500}, {"x_px": 900, "y_px": 500},
        {"x_px": 300, "y_px": 900}, {"x_px": 500, "y_px": 900}
    ],
    "legs": [[1, 2], [2, 3], [3, 4], [5, 6], [6, 7], [7, 8], [1, 5], [2, 6], [3, 7], [4, 8], [9, 10]]
}"#;

const METERS_PER_PX: &str = "0.25";

/// A directory with the city's atlas.
fn fixture() -> Fixture {
    let fixture = Fixture::empty();
    fs::write(fixture.path("city.atlas"), &*CITY).expect("writable");
    fixture
}

/// What flies over a map.
fn over<'a>(map: &'a str, atlas: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let base = ["simulate", "--map", map, "--atlas", atlas];
    [&base, more].concat()
}

/// What is printed as JSON by a flight over the city.
fn flown(fixture: &Fixture, more: &[&str]) -> String {
    let atlas = fixture.name("city.atlas");
    let output = run(&over("builtin:city", &atlas, &[more, &["--json"]].concat()));
    let stderr = String::from_utf8(output.stderr).expect("utf-8");
    assert!(output.status.success(), "{more:?}: {stderr}");
    assert_eq!(stderr, "", "{more:?}");
    String::from_utf8(output.stdout).expect("utf-8")
}

fn value(json: &str) -> Value {
    serde_json::from_str(json).expect("one value")
}

fn number(of: &Value, field: &str) -> f64 {
    of[field]
        .as_f64()
        .unwrap_or_else(|| panic!("{field} is no number: {of}"))
}

/// Names of what is in a directory.
fn entries(path: &Path) -> Vec<String> {
    let entries = fs::read_dir(path).expect("readable");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("readable").file_name().into_string())
        .collect::<Result<_, _>>()
        .expect("utf-8");
    names.sort();
    names
}

#[test]
fn a_route_is_flown_recorded_shown_again_and_drawn() {
    let fixture = fixture();
    let [recording, picture] = ["flight", "flight.png"].map(|name| fixture.name(name));
    let route = ["--meters-per-px", METERS_PER_PX, "--route", "1", "880,310"];
    let flight = flown(
        &fixture,
        &[
            &route[..],
            &[
                "--record",
                &recording,
                "--picture",
                &picture,
                "--min-arrived",
                "100",
            ],
        ]
        .concat(),
    );
    let totals = value(&flight);
    assert_eq!(
        (&totals["flights"], &totals["arrived"]),
        (&1.into(), &1.into())
    );
    let each = &totals["each"][0];
    assert_eq!(
        (&each["end"], &each["kidnapped"]),
        (&"arrived".into(), &false.into())
    );
    // From place 1 to place 4 it is 600 pixels, of which half a view's side at the end need not be flown.
    let distance_m = number(each, "distance_m");
    assert!((125.0..600.0).contains(&distance_m), "{each}");
    assert!(number(each, "median_error_px") < 50.0, "{each}");

    let drawn = image::open(&picture).expect("a picture").into_rgb8();
    // As large as the map, and what explains it below.
    assert_eq!(drawn.width(), 1600);
    assert!(
        (1201..1400).contains(&drawn.height()),
        "{:?}",
        drawn.dimensions()
    );
    let path = fixture.path("flight");
    assert_eq!(entries(&path), ["flight.json", "frames", "log.jsonl"]);
    let frames = entries(&path.join("frames")).len();
    assert_eq!(each["frames_seen"], frames);
    assert!(number(each, "frames") > frames as f64, "some are dropped");

    // The same software thinks the same of the same frames, and the recording knows the scale.
    assert_eq!(flown(&fixture, &["--replay", &recording]), flight);
    let again = fixture.name("again.jpg");
    flown(&fixture, &["--replay", &recording, "--picture", &again]);
    let again = image::open(&again).expect("a picture");
    assert_eq!((again.width(), again.height()), drawn.dimensions());

    let refuses = |more: &[&str], expected: &str| {
        fixture.refuses(&over("builtin:city", "@city.atlas", more), expected);
    };
    let log = fs::read_to_string(path.join("log.jsonl")).expect("written");
    refuses(
        &["--record", "@flight"],
        "flight: cannot write: directory not empty",
    );
    assert_eq!(
        fs::read_to_string(path.join("log.jsonl")).expect("still there"),
        log
    );

    let replay = ["--replay", "@flight", "--picture", "@new.png"];
    let steps = log.lines().count();
    let end = log[..log.len() - 1].rfind('\n').expect("lines") + 1;
    fs::write(path.join("log.jsonl"), &log[..end]).expect("writable");
    let expected = format!("log.jsonl: expected {steps} steps, found {}", steps - 1);
    refuses(&replay, &expected);
    fs::write(path.join("log.jsonl"), &log[..end + 20]).expect("writable");
    refuses(&replay, &format!("log.jsonl: line {steps} is not a step: "));
    fs::write(path.join("log.jsonl"), &log).expect("writable");

    let frame = path.join("frames").join(&entries(&path.join("frames"))[3]);
    let bytes = fs::read(&frame).expect("written");
    fs::write(&frame, &bytes[..bytes.len() / 2]).expect("writable");
    refuses(&replay, ".png: the picture does not decode");
    fs::remove_file(&frame).expect("written before");
    refuses(&replay, ".png: cannot read the picture");
    fs::write(&frame, &bytes).expect("writable");

    let header = fs::read_to_string(path.join("flight.json")).expect("written");
    fs::write(path.join("flight.json"), &header[..header.len() / 2]).expect("writable");
    refuses(
        &replay,
        "flight.json: not the header of a recorded flight: ",
    );
    fs::remove_file(path.join("flight.json")).expect("written before");
    refuses(&replay, "flight.json: cannot read: ");
}

#[test]
fn one_seed_is_one_flight_and_another_is_another() {
    let fixture = fixture();
    let seeded = |seed: &str| {
        let short = ["--meters-per-px", METERS_PER_PX, "--distance", "60"];
        flown(
            &fixture,
            &[&short[..], &["--flights", "2", "--seed", seed]].concat(),
        )
    };
    let flights = seeded("5");
    assert_eq!(flights, seeded("5"), "to the bit");
    let [totals, other] = [&flights, &seeded("6")].map(|json| value(json));
    let each = totals["each"].as_array().expect("a list");
    assert_eq!(each.len(), 2);
    for field in [
        "flights",
        "arrived",
        "median_error_px",
        "drift_percent",
        "confident_wrong_percent",
        "recovery_frames_median",
    ] {
        assert!(totals[field].is_number(), "{field}: {totals}");
    }
    assert_eq!(
        (&totals["flights"], &totals["kidnapped"]),
        (&2.into(), &2.into())
    );
    for field in ["distance_m", "frames", "frames_seen"] {
        let sum: f64 = each.iter().map(|flight| number(flight, field)).sum();
        assert!(
            (number(&totals, field) - sum).abs() < 1e-9 * sum,
            "{field}: {totals}"
        );
        assert_ne!(each[0][field], each[1][field]);
        assert_ne!(totals[field], other[field], "{field}");
    }
    let arrived = each.iter().filter(|flight| flight["end"] == "arrived");
    assert_eq!(totals["arrived"], arrived.count());
}

/// Over a ground where nothing is to be seen, nobody arrives.
#[test]
fn a_criterion_that_is_not_met_is_told() {
    let fixture = fixture();
    GrayImage::from_pixel(1600, 1200, Luma([128]))
        .save(fixture.path("gray.png"))
        .expect("writable");
    let [map, atlas] = ["gray.png", "city.atlas"].map(|name| fixture.name(name));
    let blind = |more: &[&str]| {
        let base = ["--meters-per-px", METERS_PER_PX, "--route", "1", "2"];
        let output = run(&over(&map, &atlas, &[&base[..], more].concat()));
        let [stdout, stderr] =
            [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("utf-8"));
        (output.status.code(), stdout, stderr)
    };
    let (code, stdout, stderr) = blind(&["--json", "--min-arrived", "100"]);
    assert_eq!(
        (code, stderr.as_str()),
        (
            Some(1),
            "error: 0.0 % of the flights arrived; 100 % were asked for\n"
        )
    );
    assert_eq!(value(&stdout)["arrived"], 0, "it is printed all the same");
    let (code, stdout, stderr) = blind(&["--min-arrived", "0"]);
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    let lines: Vec<&str> = stdout.lines().collect();
    assert_eq!(lines.len(), 3, "{stdout}");
    assert!(lines[0].starts_with("flight  end "), "{stdout}");
    assert!(lines[2].starts_with("0 of 1 flights arrived; "), "{stdout}");
}

#[test]
fn what_cannot_be_flown_is_refused() {
    let fixture = fixture();
    fs::write(fixture.path("text.atlas"), "this is no atlas\n").expect("writable");
    fs::create_dir(fixture.path("empty")).expect("writable");
    super::small_map()
        .save(fixture.path("small.png"))
        .expect("writable");
    let refuses = |more: &[&str], expected: &str| {
        fixture.refuses(&over("builtin:city", "@city.atlas", more), expected);
    };
    let outputs = ["--picture", "@new.png", "--record", "@new", "--route"];
    let route = |stops: &[&str], expected: &str| {
        refuses(&[&outputs[..], stops].concat(), expected);
    };
    route(
        &["1", "11"],
        "city.atlas: place 11; the atlas has places 1 to 10",
    );
    route(
        &["0", "1"],
        "city.atlas: place 0; the atlas has places 1 to 10",
    );
    route(
        &["1", "9"],
        "city.atlas: no way leads from place 1 to place 9",
    );
    route(
        &["1", "1600.5,10"],
        "city.atlas: (1600.5, 10) is not on the map of 1600×1200 pixels",
    );
    route(
        &["1", "home"],
        "expected the number of a place, or X,Y, found \"home\"",
    );
    route(&["1"], "2 values required by '--route <PLACE> <PLACE>...'");
    let far: Vec<&str> = [["1", "2"]; 17].concat();
    route(&far, "city.atlas: a route of 33 goals; expected at most 32");

    let ending = "expected a name that ends in .png, .jpg or .jpeg";
    refuses(
        &["--picture", "@new.gif"],
        &format!("new.gif: cannot write: {ending}"),
    );
    refuses(
        &["--picture", "@new"],
        &format!("new: cannot write: {ending}"),
    );
    refuses(&["--picture", "@no/new.png"], "no/new.png: cannot write");
    refuses(&["--record", "@no/new"], "no/new: cannot write");
    refuses(&["--record", "@city.atlas"], "city.atlas: cannot write");
    refuses(&["--replay", "@absent"], "absent/flight.json: cannot read");
    refuses(&["--replay", "@empty"], "empty/flight.json: cannot read");
    refuses(
        &["--replay", "@city.atlas"],
        "city.atlas/flight.json: cannot read",
    );

    for (option, found) in [
        ("--meters-per-px", "0"),
        ("--rate", "-1"),
        ("--distance", "far"),
    ] {
        let expected = format!("expected a positive number, found {found:?}");
        refuses(&[&format!("{option}={found}")], &expected);
    }
    refuses(&["--rate", "100000"], "frames in all");
    refuses(
        &["--frame", "10x10"],
        "expected 32x32 to 320x240, found \"10x10\"",
    );
    refuses(
        &["--min-arrived", "101"],
        "expected 0 to 100, found \"101\"",
    );
    refuses(&["--flights", "0"], "0 is not in 1..=1000");
    for other in ["--flights=2", "--distance=9"] {
        refuses(&["--route", "1", "2", other], "cannot be used with");
    }
    for other in [
        "--seed=2",
        "--rate=5",
        "--meters-per-px=2",
        "--no-kidnapping",
    ] {
        refuses(&["--replay", "@empty", other], "cannot be used with");
    }

    fixture.refuses(
        &over("@small.png", "@city.atlas", &[]),
        "city.atlas: the atlas is of a map of 1600×1200 pixels, ",
    );
    fixture.refuses(
        &over("@small.png", "@city.atlas", &[]),
        "small.png has 400×300",
    );
    fixture.refuses(
        &over("builtin:city", "@text.atlas", &[]),
        "text.atlas: not an atlas",
    );
    fixture.refuses(
        &over("builtin:city", "@absent.atlas", &[]),
        "absent.atlas: ",
    );
    fixture.refuses(
        &over("@absent.png", "@city.atlas", &[]),
        "absent.png: cannot read the picture",
    );
}

/// Landmarks stand for places that are missing; one of them is no route.
#[test]
fn an_atlas_without_places_needs_landmarks_to_fly_between() {
    let fixture = Fixture::of_map();
    let [map, atlas] = ["map.png", "one.atlas"].map(|name| fixture.name(name));
    let train = "--view-size 100 --scale 5 --dims 5 --landmarks 1 --json";
    let train: Vec<&str> = train.split(' ').collect();
    let trained = run(&[&["train", "--map", &map, "--out", &atlas], &train[..]].concat());
    assert!(trained.status.success());
    let before = fixture.files();
    let picture = fixture.name("new.png");
    let output = run(&over(&map, &atlas, &["--picture", &picture]));
    let stderr = String::from_utf8(output.stderr).expect("utf-8");
    let error = stderr.lines().last().expect("an error");
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(
        error.starts_with("error: ") && error.contains("one.atlas: ") && error.contains("places"),
        "{stderr}"
    );
    assert!(output.stdout.is_empty());
    assert_eq!(fixture.files(), before);
}
