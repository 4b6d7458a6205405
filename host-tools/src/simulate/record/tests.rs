use std::{fs, path::Path};

use eigenmark_core::landmark::Point;
use image::GrayImage;
use rand::RngExt;

use super::*;
use crate::{
    map::Map,
    simulate::{
        Camera, Command, Estimate, Flight, FlightSettings, Pilot, Report, Sight, World, seeded,
    },
};

/// Thinks and commands whatever the bits of its sights add up to.
#[derive(Clone, Default)]
struct Hasher {
    state: u32,
}

impl Hasher {
    fn add(&mut self, bits: u32) {
        self.state = (self.state ^ bits).wrapping_mul(0x0100_0193);
    }

    /// A number with many digits.
    fn number(&self) -> f32 {
        1.0 + (self.state >> 8) as f32 / 1e7
    }
}

impl Pilot for Hasher {
    fn decide(&mut self, sight: &Sight<'_>) -> Command {
        self.add(sight.time_s.to_bits());
        self.add(sight.step_s.to_bits());
        let readings = sight.readings;
        let (roll, pitch) = readings.tilt_rad.unzip();
        for read in [readings.heading_rad, roll, pitch, readings.altitude_ratio] {
            self.add(read.map_or(1, f32::to_bits));
        }
        for &pixel in sight.frame.map_or(&[][..], |frame| &frame.pixels) {
            self.add(pixel.into());
        }
        Command {
            heading_rad: self.number(),
            speed: 0.3,
        }
    }

    fn report(&self) -> Report {
        Report {
            estimate: Some(Estimate {
                position: Point {
                    x_px: self.number(),
                    y_px: -self.number(),
                },
                covariance_px2: Some([self.number(), 1e-30, f32::MAX]),
                confidence: None,
                confident: self.state.is_multiple_of(2),
            }),
            mission: Some("hashing".to_owned()),
            ..Report::default()
        }
    }
}

fn recorded(target: &Path) -> Flight {
    let picture = GrayImage::from_fn(300, 300, |x, y| image::Luma([(x * 7 + y * 3) as u8]));
    let map = Map::from_luminance("gray", picture);
    let world = World {
        map: &map,
        meters_per_px: 0.5,
        camera: Camera::sized(64, 48, 60.0),
    };
    let start = Point {
        x_px: 150.0,
        y_px: 150.0,
    };
    let settings = FlightSettings {
        time_limit_s: 4.0,
        ..FlightSettings::new(3, start)
    };
    fly_recorded(&world, &settings, &mut Hasher::default(), Some(77), target).expect("recorded")
}

#[test]
fn a_replayed_pilot_thinks_the_same_bit_for_bit() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let target = directory.path().join("flight");
    let flight = recorded(&target);
    assert!(
        flight.steps.iter().any(|step| !step.seen),
        "a dropped frame"
    );
    let recording = Recording::open(&target).expect("opens");
    assert_eq!(recording.header().steps, 41);
    assert_eq!(recording.header().end, Some(flight.end));
    assert_eq!(recording.header().settings, Some(flight.settings));
    assert_eq!(recording.header().atlas_crc, Some(77));
    assert_eq!(recording.steps().expect("reads"), flight.steps);
    let replayed = recording.replay(&mut Hasher::default()).expect("replays");
    assert_eq!(replayed, flight.steps);
    let mut other = Hasher { state: 1 };
    assert_ne!(recording.replay(&mut other).expect("replays"), flight.steps);
}

#[test]
fn only_finished_recordings_are_there_and_none_is_overwritten() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let target = directory.path().join("flight");
    recorded(&target);
    let entries = fs::read_dir(directory.path()).expect("readable").count();
    assert_eq!(entries, 1, "no temporary directory is left");
    let header = Recording::open(&target).expect("opens").header().clone();
    let again = Recorder::create(&target, header.clone()).expect_err("refused");
    assert!(
        again.to_string().contains("flight: cannot write"),
        "{again}"
    );
    drop(Recorder::create(&directory.path().join("other"), header).expect("begins"));
    let entries = fs::read_dir(directory.path()).expect("readable").count();
    assert_eq!(entries, 1, "nothing is left of an unfinished one");
}

/// What a recording says after its files were changed.
fn refused(change: impl Fn(&Path)) -> String {
    let directory = tempfile::tempdir().expect("temporary directory");
    let target = directory.path().join("flight");
    recorded(&target);
    change(&target);
    let read = Recording::open(&target).and_then(|recording| recording.steps());
    let error = read.expect_err("refused").to_string();
    error.replace(&target.display().to_string(), "flight")
}

/// Replaces some text of a file.
fn replace(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).expect("readable");
    assert!(text.contains(from), "{from}");
    fs::write(path, text.replacen(from, to, 1)).expect("writable");
}

#[test]
fn damaged_recordings_are_refused_by_file_and_line() {
    let header = |from: &'static str, to: &'static str| {
        refused(|target| replace(&target.join(HEADER), from, to))
    };
    assert_eq!(
        header("eigenmark flight", "a diary"),
        "flight/flight.json: not the header of a recorded flight: expected the format \"eigenmark flight\", found \
         \"a diary\""
    );
    assert!(header("\"version\": 1", "\"version\": 9").contains("expected version 1, found 9"));
    assert!(header("64,", "0,").contains("found 0×48"));
    assert!(header("0.5", "-0.5").contains("positive meters_per_px"));
    assert!(header("{", "[").contains(" at line 2 column "));
    assert_eq!(
        header("\"steps\": 41", "\"steps\": 42"),
        "flight/log.jsonl: expected 42 steps, found 41"
    );
    assert_eq!(
        header("\"steps\": 41", "\"steps\": 40"),
        "flight/log.jsonl: line 41 is not a step: expected 40 lines"
    );

    let log = |from: &'static str, to: &'static str| {
        refused(|target| replace(&target.join(LOG), from, to))
    };
    assert!(
        log("{\"time_s\":0.2,", "{")
            .starts_with("flight/log.jsonl: line 3 is not a step: missing field")
    );
    assert!(
        log("\"time_s\":0.1,", "\"time_s\":1e60,")
            .starts_with("flight/log.jsonl: line 2 is not a step: ")
    );
    assert!(
        log("000001.png", "../../secret")
            .contains("line 2 is not a step: expected the name of a file")
    );
    assert!(
        log("000001.png", "none.png")
            .starts_with("flight/log.jsonl: line 2: flight/frames/none.png: cannot read")
    );

    let frame = |bytes: Vec<u8>| {
        refused(move |target| {
            fs::write(target.join(FRAMES).join("000001.png"), &bytes).expect("writable");
        })
    };
    assert!(
        frame(b"no picture".to_vec())
            .starts_with("flight/log.jsonl: line 2: flight/frames/000001.png: expected")
    );
    let mut small = std::io::Cursor::new(Vec::new());
    let picture = GrayImage::new(32, 32);
    picture
        .write_to(&mut small, image::ImageFormat::Png)
        .expect("memory takes any picture");
    assert!(
        frame(small.into_inner())
            .contains("line 2 is not a step: expected frames of 64×48 pixels, found 32×32")
    );

    let long = refused(|target| {
        let path = target.join(LOG);
        let text = fs::read_to_string(&path).expect("readable");
        fs::write(path, format!("{}{text}", " ".repeat(70_000))).expect("writable");
    });
    assert_eq!(
        long,
        "flight/log.jsonl: line 1 is not a step: longer than 65536 bytes"
    );
    let missing = refused(|target| fs::remove_file(target.join(LOG)).expect("there"));
    assert!(missing.starts_with("flight/log.jsonl: cannot read: "));
}

#[test]
fn every_cut_of_a_log_is_refused_or_complete() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let target = directory.path().join("flight");
    recorded(&target);
    let path = target.join(LOG);
    let whole = fs::read(&path).expect("readable");
    let recording = Recording::open(&target).expect("opens");
    for length in (0..whole.len() - 1).step_by(997) {
        fs::write(&path, &whole[..length]).expect("writable");
        assert!(recording.steps().is_err(), "{length} bytes");
    }
}

#[test]
fn whatever_bytes_are_changed_the_answer_is_steps_or_an_error() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let target = directory.path().join("flight");
    recorded(&target);
    let mut random = seeded(4, 4);
    let mut refused = 0;
    for file in [HEADER, LOG, "frames/000001.png"] {
        let path = target.join(file);
        let whole = fs::read(&path).expect("readable");
        for _ in 0..100 {
            let mut bytes = whole.clone();
            // Near the start, where each byte of the log matters soon.
            let at = random.random_range(0..bytes.len().min(3_000));
            bytes[at] = random.random();
            fs::write(&path, &bytes).expect("writable");
            match Recording::open(&target) {
                Ok(recording) => match recording.steps() {
                    Ok(steps) => assert_eq!(steps.len() as u64, recording.header().steps),
                    Err(_) => refused += 1,
                },
                Err(_) => refused += 1,
            }
        }
        fs::write(&path, whole).expect("writable");
    }
    assert!(refused > 100, "{refused} of 300");
}

#[test]
fn a_log_of_a_real_flight_needs_little() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let target = directory.path().join("flight");
    recorded(&target);
    replace(&target.join(HEADER), "\"steps\": 41", "\"steps\": 1");
    let line = r#"{"time_s": 0.5, "step_s": 0.1, "frame": "000001.png", "truth": {"position_px": [3, 4]}}"#;
    fs::write(target.join(LOG), line).expect("writable");
    let read = || Recording::open(&target).and_then(|recording| recording.steps());
    let step = &read().expect("reads")[0];
    let truth = step.truth.expect("told");
    assert_eq!(truth.position_px, [3.0, 4.0]);
    assert_eq!((truth.altitude_ratio, step.seen), (1.0, true));

    let line = r#"{"time_s": 0.5, "step_s": 0.1, "frame": null}"#;
    fs::write(target.join(LOG), line).expect("writable");
    assert_eq!(read().expect("reads")[0].truth, None);
}
