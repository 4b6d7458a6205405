//! `experiment`, and pages of single atlases.

use std::fs;

use eigenmark::map::city;
use eigenmark_tests::cli::run;
use image::imageops::crop_imm;
use serde_json::Value;

use super::Fixture;

/// A part of the city with a grid of 8×6 views.
fn fixture() -> Fixture {
    let fixture = Fixture::empty();
    let part = crop_imm(&city::draw(), 300, 300, 400, 300).to_image();
    part.save(fixture.path("map.png")).expect("writable");
    fixture
}

fn experiment(fixture: &Fixture, out: &str, more: &[&str]) -> Value {
    let (map, out) = (fixture.name("map.png"), fixture.name(out));
    let base = [
        "experiment",
        "--map",
        &map,
        "--out",
        &out,
        "--json",
        "--colors",
        "3",
    ];
    let output = run(&[&base[..], more].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    serde_json::from_slice(&output.stdout).expect("one object")
}

const CELLS: [&str; 4] = ["--scales", "5,10", "--blurs", "none,gauss1"];

#[test]
fn the_same_input_gives_the_same_bytes_and_known_cells_are_kept() {
    let fixture = fixture();
    let first = experiment(&fixture, "one", &CELLS);
    assert_eq!(
        (&first["cells"], &first["computed"]),
        (&4.into(), &4.into())
    );
    assert_eq!(first["claims"].as_array().map(Vec::len), Some(10));
    let again = experiment(&fixture, "one", &CELLS);
    assert_eq!(
        (&again["cells"], &again["computed"]),
        (&4.into(), &0.into())
    );
    experiment(&fixture, "two", &CELLS);
    let files = |directory: &str| {
        let entries = fs::read_dir(fixture.path(directory)).expect("a directory");
        let mut names: Vec<_> = entries
            .map(|entry| entry.expect("readable").file_name())
            .collect();
        names.sort();
        names
    };
    let names = files("one");
    assert_eq!(names, files("two"));
    for expected in [
        "report.html",
        "experiment.json",
        "claims.md",
        "claims.csv",
        "clusters.csv",
        "dissimilarities.csv",
        "localization.csv",
        "profiles.csv",
        "reliability.csv",
        "segmentation.csv",
        "selections.csv",
        "silhouettes.csv",
        "variance.csv",
    ] {
        assert!(
            names.iter().any(|name| name == expected),
            "{expected} is missing"
        );
    }
    for name in names.iter().filter(|name| *name != "cells") {
        let [one, two] = ["one", "two"].map(|directory| {
            fs::read_to_string(fixture.path(directory).join(name)).expect("a file")
        });
        assert_eq!(one, two, "{name:?}");
        assert!(
            one.contains("eigenmark experiment --map map.png"),
            "{name:?} says how to make it again"
        );
        assert!(
            !one.contains(&fixture.name("")),
            "{name:?} names no directory"
        );
    }
}

#[test]
fn tables_have_a_row_for_everything() {
    let fixture = fixture();
    experiment(&fixture, "out", &["--scales", "5", "--blurs", "gauss1"]);
    let rows = |name: &str| {
        let text = fs::read_to_string(fixture.path("out").join(name)).expect("a file");
        let lines: Vec<Vec<String>> = text
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.split(',').map(str::to_owned).collect())
            .collect();
        assert!(lines.iter().all(|line| line.len() == lines[0].len()) || name == "claims.csv");
        lines.len() - 1
    };
    // 15 numbers of dimensions, 10 methods, 8 landmarks, 2 criteria; 83 views; 3 + 4 + 4 linkages.
    assert_eq!(rows("variance.csv"), 15);
    assert_eq!(rows("selections.csv"), 15 * 10 * 8);
    assert_eq!(rows("reliability.csv"), 15 * 10 * 2);
    assert_eq!(rows("silhouettes.csv"), 15 * 83);
    assert_eq!(rows("clusters.csv"), 15 * (4 + 4 + 3));
    assert_eq!(rows("segmentation.csv"), 3 * 2);
}

#[test]
fn what_cannot_be_computed_is_said_before_it_is_tried() {
    let fixture = fixture();
    fs::write(fixture.path("file"), "no directory").expect("writable");
    let [map, out, file] = ["map.png", "out", "file"].map(|name| fixture.name(name));
    for (arguments, expected) in [
        (
            vec!["--map", &map, "--out", &file],
            "file: cannot write: not a directory",
        ),
        (
            vec!["--map", &map, "--out", &out, "--scales", "20"],
            "2 pixels per side at scale 20; expected 4 at least",
        ),
        (
            vec!["--map", &map, "--out", &out, "--scales", "0.5"],
            "expected a number from 1 to 1000",
        ),
        (
            vec!["--map", &map, "--out", &out, "--blurs", "gauss9"],
            "gauss9",
        ),
        (
            vec!["--map", &map, "--out", &out, "--colors", "1"],
            "expected 0, or 2 to 64 colors",
        ),
        (
            vec!["--map", &map, "--out", &out, "--view-size", "301"],
            "does not fit into the map of 400×300",
        ),
        (
            vec!["--map", "absent.png", "--out", &out],
            "absent.png: cannot read the picture",
        ),
    ] {
        let output = run(&[&["experiment"], &arguments[..]].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(
            stderr.contains(expected) && stderr.lines().count() == 1,
            "{arguments:?}: {stderr}"
        );
    }
    assert!(!fixture.path("out").exists());
}

#[test]
fn an_atlas_has_a_page() {
    let fixture = fixture();
    let [map, atlas, trained, evaluated] =
        ["map.png", "map.atlas", "trained.html", "evaluated.html"].map(|name| fixture.name(name));
    let train = [
        "train",
        "--map",
        &map,
        "--out",
        &atlas,
        "--view-size",
        "50",
        "--scale",
        "5",
        "--report",
        &trained,
    ];
    assert!(run(&train).status.success());
    let evaluate = [
        "evaluate",
        "--map",
        &map,
        "--atlas",
        &atlas,
        "--report-only",
        "--views",
        "0",
        "--report",
        &evaluated,
    ];
    assert!(run(&evaluate).status.success());
    for page in ["trained.html", "evaluated.html"] {
        let text = fs::read_to_string(fixture.path(page)).expect("a page");
        assert!(
            text.contains("id=\"data\"") && text.contains("map.png"),
            "{page}"
        );
    }
    // What has too many views for pictures of all pairs still has a page.
    let dense = [
        "train",
        "--map",
        &map,
        "--out",
        &atlas,
        "--view-size",
        "50",
        "--scale",
        "5",
        "--stride",
        "10",
        "--report",
        &trained,
    ];
    assert!(run(&dense).status.success());
    let text = fs::read_to_string(fixture.path("trained.html")).expect("a page");
    assert!(text.contains("too many") && !text.contains("id=\"data\""));
}
