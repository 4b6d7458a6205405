//! `train --places` and `route`: the topological map, and ways over it.

use std::fs;

use eigenmark_tests::cli::run;
use serde_json::{Value, json};

use super::Fixture;

/// Six places of two islands: 1 to 4 in a row with a way around, 5 and 6 apart.
const PLACES: &str = r#"{
    "places": [
        {"x_px": 60, "y_px": 100}, {"x_px": 160, "y_px": 100}, {"x_px": 260, "y_px": 100},
        {"x_px": 340, "y_px": 100}, {"x_px": 60, "y_px": 250}, {"x_px": 160, "y_px": 250}
    ],
    "legs": [[1, 2], [2, 3], [4, 3], [5, 6]]
}"#;

/// What a command that succeeds prints, on stdout and stderr.
fn prints(arguments: &[&str]) -> (String, String) {
    let output = run(arguments);
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("utf-8"));
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    (stdout, stderr)
}

fn printed(arguments: &[&str]) -> Value {
    let with_json = [arguments, &["--json"]].concat();
    serde_json::from_str(&prints(&with_json).0).expect("one value")
}

/// An atlas of the small map, with `places`.
fn train(fixture: &Fixture, atlas: &str, more: &[&str]) {
    let (map, out) = (fixture.name("map.png"), fixture.name(atlas));
    let base = [
        "train",
        "--map",
        &map,
        "--out",
        &out,
        "--view-size",
        "100",
        "--scale",
        "5",
        "--dims",
        "5",
    ];
    prints(&[&base[..], more].concat());
}

/// The map, the places, and an atlas with them.
fn fixture() -> Fixture {
    let fixture = Fixture::of_map();
    fs::write(fixture.path("places.json"), PLACES).expect("writable");
    train(
        &fixture,
        "good.atlas",
        &["--places", &fixture.name("places.json")],
    );
    fixture
}

#[test]
fn places_come_back_as_they_were_given() {
    let fixture = fixture();
    let atlas = fixture.name("good.atlas");
    let list = printed(&["route", "--atlas", &atlas]);
    let given: Value = serde_json::from_str(PLACES).expect("one value");
    let points = |value: &Value| -> Vec<[f64; 2]> {
        let places = value["places"].as_array().expect("a list").iter();
        places
            .map(|place| ["x_px", "y_px"].map(|axis| place[axis].as_f64().expect("a number")))
            .collect()
    };
    assert_eq!(points(&list), points(&given));
    assert_eq!(list["legs"], json!([[1, 2], [2, 3], [3, 4], [5, 6]]));

    let (text, stderr) = prints(&["route", "--atlas", &atlas]);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!((lines.len(), lines[0]), (2 + 6, "6 places, 4 legs"));
    assert!(lines[3].ends_with("160    100  1 3"), "{text}");
    assert_eq!(stderr, "");
    let summary = printed(&["inspect", &atlas]);
    assert_eq!(
        (&summary["places"], &summary["legs"]),
        (&json!(6), &json!(4)),
        "{summary}"
    );
}

#[test]
fn found_places_can_be_given_back() {
    let fixture = Fixture::of_map();
    let dense = ["--stride", "25", "--select", "all"];
    train(&fixture, "found.atlas", &dense);
    let found = fixture.name("found.atlas");
    let (list, stderr) = prints(&["route", "--atlas", &found, "--json"]);
    assert_eq!(stderr, "", "dense tables come with places");
    let value: Value = serde_json::from_str(&list).expect("one value");
    assert!(
        value["places"]
            .as_array()
            .is_some_and(|places| places.len() > 1),
        "{value}"
    );
    assert!(
        value["legs"]
            .as_array()
            .is_some_and(|legs| !legs.is_empty()),
        "{value}"
    );

    fs::write(fixture.path("found.json"), &list).expect("writable");
    let found_json = fixture.name("found.json");
    let given = [&dense[..], &["--places", &found_json]].concat();
    train(&fixture, "given.atlas", &given);
    let bytes = |name: &str| fs::read(fixture.path(name)).expect("written");
    assert!(
        bytes("given.atlas") == bytes("found.atlas"),
        "the same atlas"
    );

    train(
        &fixture,
        "none.atlas",
        &[&dense[..], &["--places", "none"]].concat(),
    );
    let none = fixture.name("none.atlas");
    assert_eq!(printed(&["inspect", &none])["places"], json!(0));
    // A route takes its landmarks, and says so.
    let (list, stderr) = prints(&["route", "--atlas", &none]);
    assert!(list.contains(" places, "), "{list}");
    assert!(
        stderr.contains("none.atlas: the atlas has no places; "),
        "{stderr}"
    );
    assert_eq!(stderr.lines().count(), 1);
}

#[test]
fn ways_lead_over_legs() {
    let fixture = fixture();
    let atlas = fixture.name("good.atlas");
    let way = printed(&["route", "--atlas", &atlas, "--from", "1", "--to", "4"]);
    assert_eq!(way["length_px"], json!(280.0));
    let legs = way["legs"].as_array().expect("a list");
    let ends: Vec<[u64; 2]> = legs
        .iter()
        .map(|leg| ["from", "to"].map(|end| leg[end].as_u64().expect("a number")))
        .collect();
    assert_eq!(ends, [[1, 2], [2, 3], [3, 4]]);
    for leg in legs {
        assert!(
            (leg["heading_deg"].as_f64().expect("a number") - 90.0).abs() < 1e-3,
            "{leg}"
        );
    }
    assert_eq!(
        (&legs[2]["start"], &legs[2]["end"]),
        (&json!([260.0, 100.0]), &json!([340.0, 100.0]))
    );

    // Points stand for the places nearest to them, and goals are visited one after the other.
    let near = printed(&[
        "route",
        "--atlas",
        &atlas,
        "--from",
        "70,90",
        "--to",
        "300.5,100",
        "2",
    ]);
    let legs = near["legs"].as_array().expect("a list").iter();
    let to: Vec<&Value> = legs.map(|leg| &leg["to"]).collect();
    assert_eq!(to, [2, 3, 4, 3, 2]);
    let text = prints(&["route", "--atlas", &atlas, "--from", "2", "--to", "1"]).0;
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines[0],
        "    2 → 1     heading 270.0°,   100.0 map pixels, to (60, 100)"
    );
    assert_eq!(lines[1..], ["1 legs, 100.0 map pixels"]);
    let there = printed(&["route", "--atlas", &atlas, "--from", "3", "--to", "3"]);
    assert_eq!(there, json!({"length_px": 0.0, "legs": []}));
}

#[test]
fn what_is_no_place_is_refused() {
    let fixture = fixture();
    fs::write(fixture.path("text.png"), "this is no atlas\n").expect("writable");
    let route = |more: &[&str], expected: &str| {
        fixture.refuses(
            &[&["route", "--atlas", "@good.atlas"], more].concat(),
            expected,
        );
    };
    route(
        &["--from", "1", "--to", "5"],
        "no way leads from place 1 to place 5",
    );
    route(
        &["--from", "7", "--to", "1"],
        "place 7; the atlas has places 1 to 6",
    );
    route(
        &["--from", "1", "--to", "2", "0"],
        "place 0; the atlas has places 1 to 6",
    );
    route(
        &["--from", "1", "--to", "400.5,10"],
        "(400.5, 10) is not on the map of 400×300 pixels",
    );
    let expected = "expected the number of a place, or X,Y, found \"home\"";
    route(&["--from", "home", "--to", "1"], expected);
    route(&["--from", "1"], "--to <PLACE>");
    route(&["--to", "1"], "--from <PLACE>");
    fixture.refuses(&["route", "--atlas", "@absent.atlas"], "absent.atlas: ");
    fixture.refuses(&["route", "--atlas", "@text.png"], "text.png: ");
}

#[test]
fn what_is_no_topological_map_is_refused() {
    let fixture = fixture();
    let train = |places: &str, expected: &str| {
        let places = fixture.name(places);
        let base = ["train", "--map", "@map.png", "--out", "@new.atlas"];
        let small = ["--view-size", "100", "--scale", "5", "--dims", "5"];
        let arguments = [&base[..], &small, &["--places", &places]].concat();
        fixture.refuses(&arguments, expected);
    };
    let refuses = |text: &str, expected: &str| {
        fs::write(fixture.path("wrong.json"), text).expect("writable");
        train("wrong.json", &format!("wrong.json: {expected}"));
    };
    refuses(
        "places",
        "expected {\"places\": [{\"x_px\", \"y_px\"}, …], \"legs\": [[1, 2], …]}",
    );
    refuses(
        r#"{"places": [{"x_px": 401, "y_px": 3}]}"#,
        "place 1 at (401, 3) is not on the map of 400×300 pixels",
    );
    refuses(
        r#"{"places": [{"x_px": 4, "y_px": 3}], "legs": [[1, 2]]}"#,
        "leg [1, 2]; places are numbered 1 to 1",
    );
    fs::remove_file(fixture.path("wrong.json")).expect("written before");
    train("absent.json", "absent.json: cannot read places");
}

/// Minutes of training are not lost to a typo.
#[test]
fn places_are_read_before_anything_is_trained() {
    let fixture = Fixture::of_map();
    fs::write(fixture.path("wrong.json"), "{}").expect("writable");
    let [wrong, absent] = ["wrong.json", "absent.json"].map(|name| fixture.name(name));
    let train = |more: &[&str], expected: &str| {
        let base = "train --map @map.png --out @new.atlas --view-size 100 --scale 5";
        let base: Vec<&str> = base.split(' ').collect();
        fixture.refuses(&[&base[..], more].concat(), expected);
    };
    // There are too few views for so many dimensions, which only training finds out.
    let beyond = ["--dims", "18"];
    train(&beyond, "the 18 views span only 17");
    for (file, expected) in [(&wrong, "wrong.json: "), (&absent, "absent.json: ")] {
        train(&[&beyond[..], &["--places", file]].concat(), expected);
    }
    // A part has no places; merge adds them.
    train(
        &["--shard", "1/2", "--places", "none"],
        "cannot be used with",
    );
}
