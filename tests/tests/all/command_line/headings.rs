//! `--headings` and `--altitudes`: a fix says the heading, a compass gates landmarks, and what is only made for one heading
//! says so.

use eigenmark_tests::cli::run;
use serde_json::Value;

use super::{Fixture, small_map};

/// A window of a map of 4×3 of them, cut around a landmark, and turned by a quarter: map-right is up.
fn quarter_turned() -> image::GrayImage {
    let upright = image::imageops::crop_imm(&small_map(), 150, 100, 100, 100).to_image();
    image::imageops::rotate270(&upright)
}

fn trained(more: &[&str]) -> (Fixture, Value) {
    let fixture = Fixture::of_map();
    let [map, atlas] = ["map.png", "turned.atlas"].map(|name| fixture.name(name));
    let train = ["train", "--map", &map, "--out", &atlas, "--json"];
    let settings = [
        "--view-size",
        "100",
        "--scale",
        "5",
        "--dims",
        "8",
        "--normalize",
        "std",
    ];
    let grid = ["--stride", "25", "--select", "all"];
    let out = run(&[&train[..], &settings, &grid, more].concat());
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    (
        fixture,
        serde_json::from_slice(&out.stdout).expect("one object"),
    )
}

fn localized(fixture: &Fixture, more: &[&str]) -> Value {
    quarter_turned()
        .save(fixture.path("turned.png"))
        .expect("writable");
    let [atlas, frame] = ["turned.atlas", "turned.png"].map(|name| fixture.name(name));
    let localize = ["localize", "--atlas", &atlas, "--json"];
    let out = run(&[&localize[..], more, &[&frame]].concat());
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    serde_json::from_slice(&out.stdout).expect("one object")
}

fn near(value: &Value, expected: f64, most: f64) {
    let found = value.as_f64().expect("a number");
    assert!(
        (found - expected).abs() <= most,
        "{found} is not {expected}"
    );
}

#[test]
fn a_fix_says_the_heading_and_the_altitude() {
    let (fixture, printed) = trained(&["--headings", "8", "--altitudes", "1,1.25"]);
    assert_eq!(printed["settings"]["headings"], 8);
    assert_eq!(printed["settings"]["altitudes"].to_string(), "[1.0,1.25]");
    let table = printed["table"].as_array().expect("a list");
    assert_eq!(printed["candidates"], table.len());
    let last = table.last().expect("landmarks");
    assert_eq!(
        (&last["heading_deg"], &last["altitude_ratio"]),
        (&315.0.into(), &1.25.into())
    );
    let text = run(&["inspect", &fixture.name("turned.atlas")]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("8 headings, altitude 1, 1.25"), "{text}");

    // The frame shows the map around (200, 150) with its right side up.
    let free = localized(&fixture, &[]);
    near(&free["heading_deg"], 90.0, 10.0);
    near(&free["position"][0], 200.0, 5.0);
    near(&free["position"][1], 150.0, 5.0);
    assert_eq!(free["altitude_ratio"], 1.0);
    // Levelled by a wrong heading: the fix says how wrong.
    let levelled = localized(&fixture, &["--heading", "45"]);
    near(&levelled["heading_deg"], 90.0, 10.0);
    // A compass that excludes the truth, and one that does not.
    let right = localized(&fixture, &["--heading", "80", "--compass-tolerance", "10"]);
    assert_eq!(right["heading_deg"], free["heading_deg"]);
    let wrong = localized(&fixture, &["--heading", "270", "--compass-tolerance", "20"]);
    let heading = wrong["heading_deg"].as_f64().expect("a number");
    assert!((200.0..340.0).contains(&heading), "{heading}");
}

#[test]
fn the_number_of_headings_is_measured_when_it_is_left_out() {
    let (_, printed) = trained(&["--headings"]);
    let headings = printed["settings"]["headings"].as_u64().expect("a number");
    assert!((4..=72).contains(&headings), "{headings}");
    let (_, again) = trained(&["--headings", "auto"]);
    assert_eq!(again["crc"], printed["crc"]);
}

#[test]
fn exported_views_say_their_headings_and_altitudes() {
    let fixture = Fixture::of_map();
    let [map, atlas, export] = ["map.png", "x.atlas", "export"].map(|name| fixture.name(name));
    let train = ["train", "--map", &map, "--out", &atlas, "--export", &export];
    let settings = ["--view-size", "100", "--scale", "5", "--dims", "5"];
    let layers = ["--headings", "4", "--altitudes", "0.8,1"];
    let out = run(&[&train[..], &settings, &layers].concat());
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let numbers = |name: &str| -> Vec<f64> {
        let bytes = std::fs::read(fixture.path("export").join(name)).expect("written");
        let values = bytes[128..].chunks_exact(8);
        values
            .map(|bytes| f64::from_le_bytes(bytes.try_into().expect("eight")))
            .collect()
    };
    // 4×3 windows, and 3×2 on their corners.
    let (headings, altitudes) = (numbers("headings.npy"), numbers("altitudes.npy"));
    assert_eq!((headings.len(), altitudes.len()), (18 * 8, 18 * 8));
    assert_eq!((headings[17], altitudes[17]), (0.0, f64::from(0.8_f32)));
    let quarter = std::f64::consts::FRAC_PI_2;
    assert!((headings[18] - quarter).abs() < 1e-6);
    assert!((headings[8 * 18 - 1] - 3.0 * quarter).abs() < 1e-6);
    assert_eq!(altitudes[4 * 18..], [1.0; 4 * 18]);
}

#[test]
fn what_is_made_for_one_heading_refuses_several() {
    let (fixture, _) = trained(&["--headings", "4"]);
    let [map, atlas, page] =
        ["map.png", "turned.atlas", "page.html"].map(|name| fixture.name(name));
    let one = fixture.name("one.atlas");
    let settings = ["--view-size", "100", "--scale", "5", "--dims", "5"];
    let train = ["train", "--map", &map, "--out", &one];
    assert!(run(&[&train[..], &settings].concat()).status.success());
    for (arguments, expected) in [
        (
            &["evaluate", "--map", &map, "--atlas", &atlas][..],
            "expected an atlas of one heading at the nominal altitude, found one of 4 headings, altitude 1",
        ),
        (
            &[
                "train",
                "--map",
                &map,
                "--out",
                &atlas,
                "--headings",
                "4",
                "--report",
                &page,
            ],
            "--report shows views at one heading",
        ),
        (
            &["train", "--map", &map, "--out", &atlas, "--headings", "73"],
            "expected auto, or a number from 1 to 72",
        ),
        (
            &[
                "train",
                "--map",
                &map,
                "--out",
                &atlas,
                "--altitudes",
                "1.2,1",
            ],
            "--altitudes: expected at most 4 ratios, ascending, found 1.2,1",
        ),
        (
            &["train", "--map", &map, "--out", &atlas, "--altitudes", "5"],
            "expected numbers from 0.25 to 4",
        ),
        (
            &[
                "train",
                "--map",
                &map,
                "--out",
                &atlas,
                "--view-size",
                "250",
                "--headings",
                "5",
            ],
            "which does not fit into the map of",
        ),
        (
            &[
                "localize",
                "--atlas",
                &one,
                "--compass-tolerance",
                "5",
                &map,
            ],
            "expected an atlas of several headings for --compass-tolerance, found one; train it with --headings",
        ),
    ] {
        let out = run(arguments);
        let stderr = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
    }
}
