//! The command line as scripts and people meet it: exit codes, one-line errors, no half-written files, every kind of
//! picture.

mod convert;
mod evaluate;
mod experiment;
mod flash;
mod headings;
mod monitor;
mod route;
mod segment;
mod simulate;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use eigenmark::map::Map;
use eigenmark_tests::cli::run;
use image::{DynamicImage, GrayImage, ImageFormat};
use tempfile::TempDir;

/// A directory with a small map (4×3 views of 100 pixels), an atlas of it, and things that are neither.
struct Fixture {
    directory: TempDir,
}

impl Fixture {
    fn empty() -> Self {
        Self {
            directory: tempfile::tempdir().expect("temporary directory"),
        }
    }

    /// Only the map.
    fn of_map() -> Self {
        let fixture = Self::empty();
        small_map().save(fixture.path("map.png")).expect("writable");
        fixture
    }

    fn new() -> Self {
        let fixture = Self::of_map();
        GrayImage::new(1, 1)
            .save(fixture.path("tiny.png"))
            .expect("writable");
        fs::write(fixture.path("text.png"), "this is no picture\n").expect("writable");
        // Trained by the first that needs it.
        static ATLAS: OnceLock<Vec<u8>> = OnceLock::new();
        let atlas = ATLAS.get_or_init(|| fixture.train());
        fs::write(fixture.path("good.atlas"), atlas).expect("writable");
        fs::write(fixture.path("cut.atlas"), &atlas[..atlas.len() - 7]).expect("writable");
        fs::write(fixture.path("long.atlas"), [&atlas[..], b"more"].concat()).expect("writable");
        fixture
    }

    fn train(&self) -> Vec<u8> {
        let out = run(&[
            "train",
            "--map",
            &self.name("map.png"),
            "--out",
            &self.name("good.atlas"),
            "--view-size",
            "100",
            "--scale",
            "5",
            "--dims",
            "5",
        ]);
        assert!(
            out.status.success(),
            "{}",
            String::from_utf8_lossy(&out.stderr)
        );
        fs::read(self.path("good.atlas")).expect("written")
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn name(&self, name: &str) -> String {
        self.path(name).to_str().expect("utf-8").to_owned()
    }

    fn files(&self) -> Vec<PathBuf> {
        let entries = fs::read_dir(self.directory.path()).expect("readable");
        let mut files: Vec<PathBuf> = entries
            .map(|entry| entry.expect("readable").path())
            .collect();
        files.sort();
        files
    }

    /// Runs a command that must fail with exit code 2 and one line that contains `expected`, and leave no file.
    fn refuses(&self, arguments: &[&str], expected: &str) {
        let arguments: Vec<String> = arguments
            .iter()
            .map(|argument| {
                argument
                    .strip_prefix('@')
                    .map_or_else(|| (*argument).to_owned(), |name| self.name(name))
            })
            .collect();
        let before = self.files();
        let output = run(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
        let stderr = String::from_utf8(output.stderr).expect("utf-8");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
        assert!(
            stderr.contains(expected),
            "{arguments:?}: expected …{expected}…, found {stderr}"
        );
        assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
        assert_eq!(self.files(), before, "{arguments:?} left a file");
    }
}

fn small_map() -> GrayImage {
    image::imageops::crop_imm(Map::city().luminance(), 100, 100, 400, 300).to_image()
}

#[test]
fn bad_input_is_refused_in_one_clear_line() {
    let fixture = Fixture::new();
    let train = |more: &[&'static str], expected: &str| {
        let base = [
            "train",
            "--map",
            "@map.png",
            "--out",
            "@new.atlas",
            "--view-size",
            "100",
            "--scale",
            "5",
        ];
        let defaults: &[&str] = if more.contains(&"--dims") {
            &[]
        } else {
            &["--dims", "5"]
        };
        fixture.refuses(&[&base[..], defaults, more].concat(), expected);
    };
    train(&["--dims", "0"], "invalid value '0' for '--dims <K>'");
    train(
        &["--dims", "18"],
        "the 18 views span only 17; choose --dims up to 17",
    );
    train(&["--dims", "129"], "129 is not in 1..=128");
    train(
        &["--landmarks", "19"],
        "19 landmarks are asked for, but the map has 18 views",
    );
    train(
        &["--landmarks", "0"],
        "invalid value '0' for '--landmarks <L>'",
    );
    train(
        &["--select", "all", "--landmarks", "3"],
        "--landmarks has no meaning with --select all",
    );
    train(
        &["--select", "most"],
        "invalid value 'most' for '--select <SELECT>'",
    );
    train(&["--export", "@map.png"], "map.png: cannot write");

    let with_map = |map: &str, more: &[&'static str], expected: &str| {
        fixture.refuses(
            &[&["train", "--map", map, "--out", "@new.atlas"], more].concat(),
            expected,
        );
    };
    with_map("@absent.png", &[], "absent.png: cannot read the picture");
    with_map(
        "@text.png",
        &[],
        "text.png: expected a PNG, JPEG or TIFF picture, found an unknown format",
    );
    with_map(
        "@tiny.png",
        &[],
        "a view of 200×200 pixels does not fit into the map of 1×1",
    );
    with_map(
        "@map.png",
        &["--view-size", "301"],
        "a view of 301×301 pixels does not fit into the map of 400×300",
    );
    with_map(
        "@map.png",
        &["--view-size", "100", "--scale", "1"],
        "a board holds 2 to 50 per side",
    );
    with_map(
        "@map.png",
        &["--view-size", "20"],
        "each side must be 32 to 4096",
    );
    with_map(
        "@map.png",
        &["--scale", "0.5"],
        "expected a number from 1 to 1000",
    );
    with_map(
        "builtin:village",
        &[],
        "builtin:village: no such built-in map",
    );
    fixture.refuses(&["train", "--out", "@new.atlas"], "--map <FILE>");
    fixture.refuses(
        &[
            "train",
            "--map",
            "builtin:city",
            "--out",
            "@no/such/dir.atlas",
        ],
        "cannot write",
    );
    fixture.refuses(&["fly"], "unrecognized subcommand 'fly'");

    fixture.refuses(
        &["inspect", "@cut.atlas"],
        "cut.atlas: the atlas is cut short",
    );
    fixture.refuses(
        &["inspect", "@long.atlas"],
        "long.atlas: expected an atlas of",
    );
    fixture.refuses(&["inspect", "@map.png"], "map.png: not an atlas");
    fixture.refuses(
        &["inspect", "@absent.atlas"],
        "absent.atlas: cannot read the atlas",
    );
    fixture.refuses(
        &["localize", "--atlas", "@cut.atlas", "@map.png"],
        "cut.atlas: the atlas is cut short",
    );
    fixture.refuses(
        &["localize", "--json", "--atlas", "@good.atlas", "@tiny.png"],
        "a frame of 1×1 pixels",
    );
    fixture.refuses(
        &["localize", "--json", "--atlas", "@good.atlas", "@text.png"],
        "text.png: expected a PNG",
    );
    fixture.refuses(&["localize", "--atlas", "@good.atlas"], "<FRAME>");
}

#[test]
fn pictures_that_are_cut_short_are_refused() {
    let fixture = Fixture::empty();
    for (whole, half) in [
        ("map.png", "half.png"),
        ("map.jpg", "half.jpg"),
        ("map.tif", "half.tif"),
    ] {
        small_map().save(fixture.path(whole)).expect("writable");
        let picture = fs::read(fixture.path(whole)).expect("written");
        fs::write(fixture.path(half), &picture[..picture.len() / 2]).expect("writable");
        let half = format!("@{half}");
        let train = [
            "train",
            "--map",
            &half,
            "--out",
            "@new.atlas",
            "--view-size",
            "100",
            "--scale",
            "5",
        ];
        fixture.refuses(&train, "the picture does not decode");
    }
}

#[test]
fn every_kind_of_picture_gives_the_same_map() {
    let fixture = Fixture::empty();
    let gray = DynamicImage::ImageLuma8(small_map());
    let kinds: [(&str, DynamicImage, ImageFormat); 8] = [
        ("rgb8.png", gray.to_rgb8().into(), ImageFormat::Png),
        ("rgba8.png", gray.to_rgba8().into(), ImageFormat::Png),
        ("gray16.png", gray.to_luma16().into(), ImageFormat::Png),
        ("rgb16.png", gray.to_rgb16().into(), ImageFormat::Png),
        ("alpha8.png", gray.to_luma_alpha8().into(), ImageFormat::Png),
        ("gray16.tif", gray.to_luma16().into(), ImageFormat::Tiff),
        ("gray8.tif", gray.clone(), ImageFormat::Tiff),
        ("rgb16.tif", gray.to_rgb16().into(), ImageFormat::Tiff),
    ];
    let mut names: Vec<&str> = Vec::new();
    for (name, picture, format) in &kinds {
        picture
            .save_with_format(fixture.path(name), *format)
            .expect("writable");
        names.push(name);
    }
    write_palette_png(&fixture.path("palette.png"), &small_map());
    names.push("palette.png");

    for name in names {
        let map = Map::open(&fixture.name(name)).unwrap_or_else(|error| panic!("{error}"));
        assert!(*map.luminance() == small_map(), "{name} gives another map");
    }
}

/// A PNG of 8-bit palette indices, which the palette maps to themselves.
fn write_palette_png(path: &Path, picture: &GrayImage) {
    let file = fs::File::create(path).expect("writable");
    let mut encoder = png::Encoder::new(file, picture.width(), picture.height());
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette((0..=255).flat_map(|level| [level; 3]).collect::<Vec<u8>>());
    let mut writer = encoder.write_header().expect("writable");
    writer.write_image_data(picture.as_raw()).expect("writable");
}

#[test]
fn json_has_the_fields_of_the_contract() {
    let fixture = Fixture::new();
    let atlas = fixture.name("good.atlas");
    let inspected = run(&["inspect", "--json", &atlas]);
    let summary: serde_json::Value = serde_json::from_slice(&inspected.stdout).expect("one object");
    assert_eq!(
        (&summary["dims"], &summary["landmarks"]),
        (&5.into(), &8.into())
    );
    assert_eq!(
        summary["flash_bytes"],
        fs::metadata(&atlas).expect("there").len()
    );
    for field in [
        "scale",
        "blur",
        "normalize",
        "metric",
        "coefficients",
        "view_size",
    ] {
        assert!(!summary["settings"][field].is_null(), "{field}");
    }
    let located = run(&[
        "localize",
        "--json",
        "--atlas",
        &atlas,
        &fixture.name("map.png"),
        &fixture.name("map.png"),
    ]);
    let lines = String::from_utf8(located.stdout).expect("utf-8");
    assert_eq!(lines.lines().count(), 2);
    let fix: serde_json::Value =
        serde_json::from_str(lines.lines().next().expect("a line")).expect("an object");
    for field in [
        "frame",
        "landmark",
        "view",
        "place",
        "position",
        "distance",
        "second",
        "margin",
        "guaranteed",
        "known",
        "seen",
    ] {
        assert!(!fix[field].is_null(), "{field}: {fix}");
    }
}

/// Runs `localize --json` on the good atlas; one object per frame.
fn located(fixture: &Fixture, arguments: &[&str]) -> Vec<serde_json::Value> {
    let atlas = fixture.name("good.atlas");
    let output = run(&[&["localize", "--json", "--atlas", &atlas], arguments].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    let lines = String::from_utf8(output.stdout).expect("utf-8");
    lines
        .lines()
        .map(|line| serde_json::from_str(line).expect("an object"))
        .collect()
}

/// The window of the fixture's map around the landmark (200, 150), as it is and turned clockwise: `north.png`, and
/// `east.png` as a camera sees it whose frame-up is map-right.
fn write_turned_frames(fixture: &Fixture) {
    let north = image::imageops::crop_imm(&small_map(), 150, 100, 100, 100).to_image();
    image::imageops::rotate270(&north)
        .save(fixture.path("east.png"))
        .expect("writable");
    north.save(fixture.path("north.png")).expect("writable");
}

#[test]
fn frames_are_located_at_their_poses() {
    let fixture = Fixture::new();
    write_turned_frames(&fixture);
    let (north, east) = (fixture.name("north.png"), fixture.name("east.png"));
    let plain = located(&fixture, &[&north]);
    assert_eq!(plain[0]["seen"], 1.0);
    let nominal = [
        "--heading",
        "0",
        "--altitude",
        "1",
        "--roll",
        "0",
        "--pitch",
        "0",
        "--fov",
        "70",
    ];
    assert_eq!(
        located(&fixture, &[&nominal[..], &[&north]].concat()),
        plain
    );

    let turned = located(&fixture, &["--heading", "90", &east]);
    assert_eq!(turned, located(&fixture, &["--heading", "-270", &east]));
    assert_eq!(turned[0]["landmark"], plain[0]["landmark"]);
    let distance = |line: &serde_json::Value| line["distance"].as_f64().expect("a number");
    let unturned = located(&fixture, &[&east]);
    assert!(
        (distance(&turned[0]) - distance(&plain[0])).abs() < 0.2 * distance(&unturned[0]),
        "{turned:?} {plain:?} {unturned:?}"
    );

    let low = located(&fixture, &["--altitude", "0.6", &north]);
    assert_eq!(
        (&low[0]["landmark"], &low[0]["known"]),
        (&().into(), &false.into())
    );
    assert!((low[0]["seen"].as_f64().expect("a share") - 0.36).abs() < 0.01);
    let tilted = located(
        &fixture,
        &["--roll", "5", "--pitch", "-5", "--altitude", "0.9", &north],
    );
    let seen = tilted[0]["seen"].as_f64().expect("a share");
    assert!((0.5..1.0).contains(&seen), "{seen}");
    assert_eq!(tilted[0]["guaranteed"], false);
    let narrow = located(
        &fixture,
        &[
            "--roll",
            "5",
            "--pitch",
            "-5",
            "--altitude",
            "0.9",
            "--fov",
            "20",
            &north,
        ],
    );
    assert!(narrow[0]["seen"].as_f64().expect("a share") < seen);
}

#[test]
fn poses_come_from_a_file() {
    let fixture = Fixture::new();
    write_turned_frames(&fixture);
    let poses = fixture.name("poses.csv");
    let rows =
        "altitude_ratio, frame, note, heading_deg\n1, north.png,\"a, b\", 0\n1.0,east.png,,90\n";
    fs::write(&poses, rows).expect("writable");
    let all = located(&fixture, &["--poses", &poses]);
    let names: Vec<_> = all.iter().map(|line| line["frame"].clone()).collect();
    assert_eq!(names, ["north.png", "east.png"]);
    let (north, east) = (fixture.name("north.png"), fixture.name("east.png"));
    let without_name = |mut line: serde_json::Value| {
        line["frame"] = serde_json::Value::Null;
        line
    };
    let single = [
        located(&fixture, &[&north]),
        located(&fixture, &["--heading", "90", &east]),
    ]
    .concat();
    let both = located(&fixture, &["--poses", &poses, &east, &north]);
    assert_eq!([both[1].clone(), both[0].clone()], *single);
    for (from_file, given) in all.into_iter().zip(single) {
        assert_eq!(without_name(from_file), without_name(given));
    }

    let rows =
        format!("frame,heading_deg,altitude_ratio,roll_deg,pitch_deg\n{north},10,0.9,-3,4\n");
    fs::write(&poses, rows).expect("writable");
    let flags = [
        "--heading",
        "10",
        "--altitude",
        "0.9",
        "--roll",
        "-3",
        "--pitch",
        "4",
        "--fov",
        "50",
        &north,
    ];
    assert_eq!(
        located(&fixture, &["--poses", &poses, "--fov", "50"]),
        located(&fixture, &flags)
    );
}

#[test]
fn poses_that_are_none_are_refused() {
    let fixture = Fixture::new();
    let refuses = |more: &[&str], expected: &str| {
        let base = ["localize", "--atlas", "@good.atlas"];
        fixture.refuses(&[&base[..], more].concat(), expected);
    };
    let flag = |flag: &str, value: &str, expected: &str| {
        refuses(&[flag, value, "@map.png"], expected);
    };
    flag(
        "--heading",
        "361",
        "a heading of 361.0°; expected -360 to 360°",
    );
    flag(
        "--heading",
        "north",
        "invalid value 'north' for '--heading <DEG>'",
    );
    flag("--heading", "nan", "a heading of NaN°");
    flag(
        "--altitude",
        "0.2",
        "an altitude ratio of 0.2; expected 0.25 to 4",
    );
    flag(
        "--altitude",
        "-1",
        "an altitude ratio of -1; expected 0.25 to 4",
    );
    flag("--roll", "61", "a roll of 61.0°; expected -60 to 60°");
    flag("--pitch", "-90", "a pitch of -90.0°; expected -60 to 60°");
    flag("--fov", "5", "a field of view of 5.0°; expected 10 to 150°");
    flag(
        "--poses",
        "@absent.csv",
        "absent.csv: cannot read the poses",
    );
    for single in ["--heading", "--altitude", "--roll", "--pitch"] {
        refuses(
            &["--poses", "@absent.csv", single, "1", "@map.png"],
            "cannot be used with",
        );
    }

    let path = fixture.path("poses.csv");
    let file = |text: &[u8], expected: &str| {
        fs::write(&path, text).expect("writable");
        refuses(&["--poses", "@poses.csv", "@map.png"], expected);
    };
    let head = "frame,heading_deg,altitude_ratio\n";
    file(b"", "poses.csv: line 1: expected a column frame, found ''");
    file(
        b"frame,heading,altitude_ratio\nmap.png,0,1\n",
        "poses.csv: line 1: expected a column heading_deg, found 'frame,heading,altitude_ratio'",
    );
    file(
        b"frame,heading_deg\nmap.png,0\n",
        "poses.csv: line 1: expected a column altitude_ratio",
    );
    file(
        head.as_bytes(),
        "poses.csv: expected at least one frame, found none",
    );
    let rows = |rows: &str, expected: &str| file(format!("{head}{rows}").as_bytes(), expected);
    rows(
        "a.png,0,1\nmap.png,north,1\n",
        "poses.csv: line 3: heading_deg: expected a number, found 'north'",
    );
    rows(
        "map.png,0,\n",
        "poses.csv: line 2: altitude_ratio: expected a number, found ''",
    );
    rows(
        "map.png,0,9\n",
        "poses.csv: line 2: an altitude ratio of 9; expected 0.25 to 4",
    );
    rows(
        "map.png,0,1\nmap.png,0,1\n",
        "poses.csv: line 3: expected one pose per frame, found map.png again",
    );
    rows(
        "map.png,0\n",
        "poses.csv: line 2: expected 3 columns, found 2",
    );
    rows(
        "other.png,0,1\n",
        "poses.csv: expected a line for the frame",
    );
    file(
        &[head.as_bytes(), b"\xff.png,0,1\n"].concat(),
        "poses.csv: CSV parse error: record 1 (line 2",
    );
    fs::write(&path, format!("{head}absent.png,0,1\n")).expect("writable");
    refuses(
        &["--poses", "@poses.csv"],
        "absent.png: cannot read the picture",
    );
}

/// What every command that trains on the fixture's map is told, before anything else.
const SMALL: [&str; 6] = ["--view-size", "100", "--scale", "5", "--dims", "5"];

/// Runs a command on the fixture's map that must succeed and print one JSON object.
fn printed(fixture: &Fixture, command: &str, more: &[&str]) -> serde_json::Value {
    let map = fixture.name("map.png");
    let output = run(&[&[command, "--json", "--map", &map], &SMALL[..], more].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command} {more:?}: {stderr}");
    serde_json::from_slice(&output.stdout).expect("one object")
}

/// The views of a table that `train --json` printed.
fn views(summary: &serde_json::Value) -> Vec<u64> {
    let table = summary["table"].as_array().expect("a list");
    let views = table.iter().map(|landmark| landmark["view"].as_u64());
    views.map(|view| view.expect("a number")).collect()
}

/// The views that `compare --json` printed for a method.
fn compared(comparison: &serde_json::Value, method: &str) -> Vec<u64> {
    let selections = comparison["selections"].as_array().expect("a list");
    let selection = selections.iter().find(|one| one["method"] == method);
    let landmarks = selection.expect("the method")["landmarks"].as_array();
    let views = landmarks.expect("a list").iter().map(|view| view.as_u64());
    views.map(|view| view.expect("a number")).collect()
}

#[test]
fn selections_that_cannot_be_made_are_refused() {
    let fixture = Fixture::of_map();
    let both = |more: &[&str], expected: &str| {
        for base in [
            &["train", "--map", "@map.png", "--out", "@new.atlas"][..],
            &["compare", "--map", "@map.png"],
        ] {
            fixture.refuses(&[base, &SMALL[..], more].concat(), expected);
        }
    };
    both(
        &["--spacing", "250"],
        "8 landmarks are asked for, but after 2 no view is 250 map pixels away from all",
    );
    fixture.refuses(
        &[
            &["compare", "--map", "@map.png", "--spacing", "250"],
            &SMALL[..],
        ]
        .concat(),
        "map.png: profile in 5 dimensions: 8 landmarks are asked for",
    );
    both(
        &["--spacing", "many"],
        "expected a number of meters from 0 to 1000000",
    );
    both(
        &["--spacing", "9", "--meters-per-pixel", "0"],
        "expected a number of meters from 0.001 to 1000",
    );
    both(
        &["--preselect", "harris", "--keep", "2", "--landmarks", "3"],
        "3 landmarks are asked for, but preselection keeps 2 views",
    );
    both(&["--preselect", "color"], "invalid value 'color'");
    both(&["--keep", "2"], "--preselect <PRESELECT>");
    both(&["--dissimilarity", "cosine"], "invalid value 'cosine'");
    both(
        &["--landmarks", "19"],
        "19 landmarks are asked for, but the map has 18 views",
    );

    let train = |more: &[&str], expected: &str| {
        let base = ["train", "--map", "@map.png", "--out", "@new.atlas"];
        fixture.refuses(&[&base[..], &SMALL, more].concat(), expected);
    };
    let ipca = |start: &str, expected: &str| {
        train(&["--select", "ipca", "--start", start], expected);
    };
    ipca(
        "1,1",
        "view 1 is in the start list twice; its members must differ",
    );
    ipca(
        "99",
        "view 99 of the start list does not exist; there are 18, numbered from 1",
    );
    ipca("0", "view 0 of the start list does not exist");
    ipca(
        "first",
        "expected profile, random, or numbers of views such as 20,51,79",
    );
    train(
        &["--start", "profile"],
        "--start and --stop-residual need --select ipca",
    );
    train(
        &["--select", "reliable", "--stop-residual", "1"],
        "--start and --stop-residual need --select ipca",
    );
    train(
        &["--select", "ipca", "--stop-residual", "much"],
        "expected a number from 0 to 1000",
    );
    train(
        &["--select", "ipca", "--start", "1,2", "--spacing", "150"],
        "views 2 and 1 of the start list are closer than the landmarks' spacing",
    );
    train(
        &["--select", "all", "--spacing", "5"],
        "--preselect and --spacing have no meaning with --select all",
    );
    train(&["--method", "slow"], "invalid value 'slow'");
    train(
        &["--shard", "3/2"],
        "expected i/n with i from 1 to n, such as 2/4",
    );
    train(
        &["--shard", "1/2", "--export", "@parts"],
        "cannot be used with",
    );
}

#[test]
fn landmarks_are_selected_as_asked() {
    let fixture = Fixture::of_map();
    let train = |name: &str, more: &[&str]| {
        let atlas = fixture.name(name);
        let summary = printed(&fixture, "train", &[&["--out", &atlas], more].concat());
        (views(&summary), fs::read(atlas).expect("written"))
    };
    let literally = |name: &str, more: &[&str]| {
        let (views, atlas) = train(name, more);
        let literal = train(name, &[more, &["--method", "literal"]].concat());
        assert!(literal == (views.clone(), atlas), "{more:?} literally");
        views
    };
    let comparison = printed(&fixture, "compare", &[]);
    let profile = literally("profile.atlas", &["--select", "profile"]);
    assert_eq!(profile, compared(&comparison, "profile"));

    let ipca = [
        "--select",
        "ipca",
        "--start",
        "1,2,3",
        "--stop-residual",
        "29",
    ];
    let ipca = literally("ipca.atlas", &ipca);
    assert!(
        ipca.starts_with(&[1, 2, 3]) && (4..8).contains(&ipca.len()),
        "{ipca:?}"
    );

    let apart = ["--landmarks", "3", "--preselect", "edges", "--keep", "12"];
    let apart = [&apart[..], &["--spacing", "200", "--meters-per-pixel", "2"]].concat();
    let (reliable, _) = train(
        "reliable.atlas",
        &[&["--select", "reliable"], &apart[..]].concat(),
    );
    let comparison = printed(&fixture, "compare", &apart);
    assert_eq!(comparison["kept"], 12);
    assert_eq!(reliable, compared(&comparison, "reliable"));
}

#[test]
fn selections_are_compared() {
    let fixture = Fixture::of_map();
    let comparison = printed(&fixture, "compare", &["--landmarks", "6"]);
    for (field, expected) in [
        ("candidates", 18),
        ("kept", 18),
        ("dims", 5),
        ("spanned", 17),
        ("landmarks", 6),
    ] {
        assert_eq!(comparison[field], expected, "{field}");
    }
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        let numbers = value.as_array().expect("a list").iter();
        numbers.map(|x| x.as_f64().expect("a number")).collect()
    };
    let selections = comparison["selections"].as_array().expect("a list");
    assert_eq!(selections.len(), 4);
    for (index, selection) in selections.iter().enumerate() {
        let [smallest, mean] =
            ["smallest_radius", "mean_radius"].map(|field| selection[field].as_f64());
        assert!(Some(0.0) < smallest && smallest <= mean, "{selection}");
        let overlaps = numbers(&comparison["overlaps"][index]);
        assert_eq!((overlaps.len(), overlaps[index]), (4, 1.0));
    }
    let across = &comparison["across"];
    assert_eq!(
        numbers(&across["dims"]),
        [1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 12.0, 15.0, 17.0]
    );
    for field in ["kendall_tau", "spearman_rho"] {
        let numbers = numbers(&across[field]);
        assert_eq!(numbers.len(), 8, "{field}");
        assert!(numbers.iter().all(|x| (-1.0..=1.0).contains(x)), "{across}");
    }
    for method in ["profile", "reliable"] {
        let stability = &across[method];
        assert_eq!(numbers(&stability["overlaps"][8]).len(), 9);
        assert!(stability["mean_of_neighbors"].is_f64(), "{stability}");
    }

    // The metric says what a profile averages, unless something else is asked for.
    let by = |dissimilarity: &str| {
        let more = ["--landmarks", "6", "--dissimilarity", dissimilarity];
        printed(&fixture, "compare", &more)
    };
    assert_eq!(by("nssd"), comparison);
    let ssd = by("ssd");
    assert_ne!(compared(&ssd, "profile"), compared(&comparison, "profile"));
    assert_eq!(
        compared(&ssd, "reliable"),
        compared(&comparison, "reliable")
    );

    let map = fixture.name("map.png");
    let output = run(&[&["compare", "--map", &map], &SMALL[..]].concat());
    assert!(output.status.success() && output.stderr.is_empty());
    let text = String::from_utf8(output.stdout).expect("utf-8");
    for word in ["profile", "ipca-random", "reliable", "5 and 7", "in common"] {
        assert!(text.contains(word), "{word} is not in {text}");
    }

    let refuses = |more: &[&str], expected: &str| {
        let base = ["compare", "--map", "@map.png"];
        fixture.refuses(&[&base[..], more].concat(), expected);
    };
    refuses(
        &["--view-size", "100", "--landmarks", "1", "--dims", "5"],
        "a comparison of radii needs at least 2 landmarks, and 1 is asked for",
    );
    refuses(
        &["--view-size", "100", "--dims", "18"],
        "the 18 views span only 17; choose --dims up to 17",
    );
    refuses(&["--select", "ipca"], "unexpected argument '--select'");
    fixture.refuses(
        &["compare", "--map", "@absent.png"],
        "absent.png: cannot read the picture",
    );
}

#[test]
fn help_is_on_stdout_and_no_error() {
    for arguments in [
        &["--help"][..],
        &["train", "--help"],
        &["compare", "--help"],
        &["evaluate", "--help"],
        &["--version"],
    ] {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(0));
        assert!(!output.stdout.is_empty() && output.stderr.is_empty());
    }
}
