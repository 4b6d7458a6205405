//! The command line as scripts and people meet it: exit codes, one-line errors, no half-written files, every kind of
//! picture.

use std::{
    fs,
    path::{Path, PathBuf},
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

    fn new() -> Self {
        let fixture = Self::empty();
        small_map().save(fixture.path("map.png")).expect("writable");
        GrayImage::new(1, 1)
            .save(fixture.path("tiny.png"))
            .expect("writable");
        fs::write(fixture.path("text.png"), "this is no picture\n").expect("writable");
        let out = run(&[
            "train",
            "--map",
            &fixture.name("map.png"),
            "--out",
            &fixture.name("good.atlas"),
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
        let atlas = fs::read(fixture.path("good.atlas")).expect("written");
        fs::write(fixture.path("cut.atlas"), &atlas[..atlas.len() - 7]).expect("writable");
        fs::write(fixture.path("long.atlas"), [&atlas[..], b"more"].concat()).expect("writable");
        fixture
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

#[test]
fn help_is_on_stdout_and_no_error() {
    for arguments in [&["--help"][..], &["train", "--help"], &["--version"]] {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(0));
        assert!(!output.stdout.is_empty() && output.stderr.is_empty());
    }
}
