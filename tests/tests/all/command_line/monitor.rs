//! `monitor`: a board on TCP is watched, logged, and its log is replayed.

use std::{
    fs,
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    thread::{self, JoinHandle},
};

use eigenmark_core::{
    link::{
        AtlasIdentity, Camera, Identity, MAX_REQUEST_LEN, Receiver, Reply, Report, Request, encode,
    },
    mission::{self, State},
    slots::Setup,
};
use eigenmark_tests::cli::run;
use serde_json::Value;

use super::Fixture;

/// Width and height of the board's frames.
const FRAME_PX: [u16; 2] = [64, 48];

/// Reports before the board hangs up, and after it came back.
const REPORTS: [u32; 2] = [5, 3];

fn report(sequence: u32) -> Report {
    Report {
        sequence,
        time_ms: 100 * sequence,
        step_s: 0.1,
        took_us: 25_000,
        camera: Camera::Frame,
        heading_rad: Some(0.0),
        tilt_rad: None,
        altitude_ratio: Some(1.0),
        estimate: None,
        odometry_px: [0.0, 0.0],
        fix: None,
        refusal: None,
        state: State::Localizing,
        command: mission::Command {
            heading_rad: 0.0,
            speed: 0.5,
        },
        damaged: 0,
    }
}

fn say(stream: &mut TcpStream, reply: &Reply) {
    let (mut scratch, mut packet) = ([0; 512], [0; 512]);
    let packet = encode(reply, &mut scratch, &mut packet).expect("fits");
    // Whoever hung up hears nothing.
    let _ = stream.write_all(packet);
}

/// Reads until it is asked to watch; false when the other side hung up before.
fn is_watched(stream: &mut TcpStream) -> bool {
    let mut receiver = Receiver::<MAX_REQUEST_LEN>::new();
    let mut byte = [0];
    while stream.read(&mut byte).is_ok_and(|len| len == 1) {
        if let Some(Ok(Request::Watch { .. })) = receiver.push(byte[0]) {
            return true;
        }
    }
    false
}

/// A board that reports, sends damaged bytes and a picture, hangs up, comes back, and reports again.
fn board(atlas_crc: u32) -> (String, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let name = format!("tcp:{}", listener.local_addr().expect("bound"));
    let serving = thread::spawn(move || {
        let mut next = 0;
        for reports in REPORTS {
            let (mut stream, _) = listener.accept().expect("connects");
            assert!(is_watched(&mut stream));
            say(
                &mut stream,
                &Reply::Identity(Identity {
                    firmware: [0, 1, 0],
                    atlas: Some(AtlasIdentity {
                        crc: atlas_crc,
                        map_crc: 1,
                        landmarks: 2,
                        view_side: 20,
                        dimensions: 5,
                    }),
                    stack_bytes: 0,
                    setup: Setup {
                        meters_per_px: 0.25,
                        field_of_view_rad: 1.0,
                    },
                }),
            );
            for _ in 0..reports {
                say(&mut stream, &Reply::Report(report(next)));
                let _ = stream.write_all(&[9, 9, 9, 9, 0]);
                next += 1;
            }
            let [width, height] = FRAME_PX;
            let pixels: Vec<u8> = (0..width * height).map(|i| (i % 251) as u8).collect();
            for (part, offset) in pixels.chunks(240).zip((0..).step_by(240)) {
                say(
                    &mut stream,
                    &Reply::Picture {
                        sequence: next - 1,
                        width,
                        height,
                        offset,
                        bytes: part.try_into().expect("a part"),
                    },
                );
            }
            if reports == REPORTS[1] {
                // Until the monitor leaves.
                is_watched(&mut stream);
            }
        }
    });
    (name, serving)
}

/// What it prints on stdout and stderr, and its exit code.
fn watched(arguments: &[&str]) -> (String, String, Option<i32>) {
    let output = run(&[&["monitor"][..], arguments].concat());
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("utf-8"));
    (stdout, stderr, output.status.code())
}

#[test]
fn a_board_is_watched_logged_and_replayed() {
    let fixture = Fixture::new();
    let [map, atlas, log] = ["map.png", "good.atlas", "log"].map(|name| fixture.name(name));
    let printed = run(&["inspect", &atlas, "--json"]).stdout;
    let summary: Value = serde_json::from_slice(&printed).expect("one value");
    let crc = summary["crc"].as_str().expect("a CRC");
    let crc = u32::from_str_radix(crc, 16).expect("a number");
    let (name, serving) = board(crc);
    let base = ["--link", &name, "--map", &map, "--atlas", &atlas];
    let more = ["--log", &log, "--pictures", "5", "--for", "4", "--json"];
    let (stdout, stderr, code) = watched(&[&base[..], &more].concat());
    serving.join().expect("ends");
    assert_eq!(code, Some(0), "{stderr}");
    let reports: Vec<Value> = stdout
        .lines()
        .map(|line| serde_json::from_str(line).expect("an object per line"))
        .collect();
    let numbers: Vec<u64> = reports
        .iter()
        .filter_map(|report| report["sequence"].as_u64())
        .collect();
    assert_eq!(numbers, [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(reports[0]["state"], "localizing");
    for expected in [
        "the board hung up",
        "link opened again",
        "logged 8 steps, 2 of them with frames",
    ] {
        assert!(stderr.contains(expected), "{expected}: {stderr}");
    }

    let replay = [
        "simulate", "--map", &map, "--atlas", &atlas, "--replay", &log,
    ];
    let output = run(&[&replay[..], &["--json"]].concat());
    let stderr = String::from_utf8(output.stderr).expect("utf-8");
    assert!(output.status.success(), "{stderr}");
    assert!(stderr.contains("errors cannot be measured"), "{stderr}");
    let totals: Value = serde_json::from_slice(&output.stdout).expect("one value");
    assert_eq!(totals["frames"], 8);
    assert_eq!(totals["frames_seen"], 2);
    for unknown in [
        "median_error_px",
        "drift_percent",
        "confident_wrong_percent",
        "distance_m",
    ] {
        assert!(totals[unknown].is_null(), "{unknown}: {totals}");
    }
    assert!(run(&replay).status.success(), "also for people");
}

#[test]
fn a_board_that_never_reports_is_an_unmet_criterion_and_leaves_no_log() {
    let fixture = Fixture::new();
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let name = format!("tcp:{}", listener.local_addr().expect("bound"));
    let [atlas, log] = ["good.atlas", "log"].map(|name| fixture.name(name));
    let before = fixture.files();
    let arguments = ["--link", &name, "--atlas", &atlas, "--log", &log];
    let (stdout, stderr, code) = watched(&[&arguments[..], &["--for", "1.5"]].concat());
    assert_eq!(code, Some(1), "{stderr}");
    assert!(stderr.contains("no report came in 1.5 s"), "{stderr}");
    // A line per second where stdout is no terminal.
    assert!(stdout.lines().count() >= 2, "{stdout}");
    assert!(stdout.starts_with("0 s, link silent"), "{stdout}");
    assert_eq!(fixture.files(), before);
}

#[test]
fn bad_arguments_of_monitor_are_refused() {
    let fixture = Fixture::new();
    let monitor = |more: &[&str], expected: &str| {
        fixture.refuses(&[&["monitor"][..], more].concat(), expected);
    };
    monitor(&[], "--link <PORT>");
    monitor(
        &["--link", "tcp:nowhere"],
        "tcp:nowhere: cannot open the link",
    );
    monitor(
        &["--link", "@no/port"],
        "cannot open the link (a serial port, or tcp:HOST:PORT)",
    );
    let silent = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let name = format!("tcp:{}", silent.local_addr().expect("bound"));
    let at = |more: &[&str], expected: &str| {
        monitor(&[&["--link", &name][..], more].concat(), expected);
    };
    at(&["--log", "@log"], "--atlas <ATLAS>");
    at(&["--for", "0"], "expected a positive number of seconds");
    at(&["--json", "--plain"], "cannot be used with");
    at(&["--go", "0"], "place 0; places are numbered from 1");
    at(&["--go", "10,20"], "--go X,Y needs --atlas");
    at(
        &["--atlas", "@good.atlas", "--go", "1000"],
        "place 1000; the atlas has places 1 to",
    );
    at(
        &["--map", "builtin:city", "--atlas", "@good.atlas"],
        "the atlas is of a map of 400×300 pixels, builtin:city has 1600×1200",
    );
    fs::create_dir(fixture.path("full")).expect("writable");
    fs::write(fixture.path("full/file"), "x").expect("writable");
    at(
        &["--atlas", "@good.atlas", "--log", "@full"],
        "full: cannot write: directory not empty",
    );
    let taken = silent.local_addr().expect("bound").to_string();
    at(&["--web", &taken], "cannot serve the page");
}
