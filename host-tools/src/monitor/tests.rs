use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    sync::{
        Arc, LazyLock, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use eigenmark_core::{
    belief::Estimate,
    eigenspace::Normalize,
    landmark::{Metric, Point},
    link::{
        AtlasIdentity, Camera, Faults, Goals, Identity, MAX_REQUEST_LEN, PICTURE_PART_LEN,
        Receiver, Refusal, Reply, Report, Request, SlotState, encode,
    },
    localizer::Fix,
    mission::{self, State},
    slots::{Setup, SlotError},
};
use image::imageops::crop_imm;
use serde_json::Value;

use super::*;
use crate::{
    atlas::AtlasBuffer,
    learn::Settings,
    map::Map,
    output::Progress,
    select::Selection,
    simulate::{self, FlightSettings, Onboard, Recording, Statistics, Step, World, fly_watched},
    train::train,
};

const SECOND: Duration = Duration::from_secs(1);

fn at(x_px: f32, y_px: f32) -> Point {
    Point { x_px, y_px }
}

/// Of the tenth of a second with that number.
fn report(sequence: u32) -> Report {
    Report {
        sequence,
        time_ms: 100 * sequence,
        step_s: 0.1,
        took_us: 20_000,
        camera: Camera::Frame,
        heading_rad: Some(0.5),
        tilt_rad: None,
        altitude_ratio: Some(1.0),
        estimate: Some(Estimate {
            position: at(100.0 + sequence as f32, 50.0),
            covariance_px2: [9.0, 0.0, 4.0],
            heading_rad: 0.5,
            confidence: 0.995,
        }),
        odometry_px: [sequence as f32, 0.0],
        fix: None,
        refusal: None,
        state: State::Following,
        command: mission::Command {
            heading_rad: 0.25,
            speed: 1.0,
        },
        damaged: 3,
    }
}

fn fix(guaranteed: bool, known: bool) -> Fix {
    Fix {
        landmark: 6,
        view: 9,
        place: at(100.0, 50.0),
        position: at(104.0, 51.0),
        heading_rad: 0.0,
        altitude_ratio: 1.0,
        distance: 0.1,
        second: 0.2,
        margin: 2.0,
        from_feature_space: 0.1,
        guaranteed,
        known,
    }
}

fn identity() -> Identity {
    Identity {
        firmware: [0, 1, 2],
        atlas: Some(AtlasIdentity {
            crc: 0x1234_abcd,
            map_crc: 7,
            landmarks: 35,
            view_side: 20,
            dimensions: 15,
        }),
        setup: Setup {
            meters_per_px: 0.5,
            field_of_view_rad: 1.0,
        },
        stack_bytes: 0,
    }
}

/// The parts of a picture of 40×32 pixels that grow by one from `first`.
fn parts(sequence: u32, first: u8) -> Vec<Reply> {
    let pixels: Vec<u8> = (0..40 * 32)
        .map(|i| (i as u8).wrapping_add(first))
        .collect();
    parts_of(sequence, 40, 32, &pixels)
}

fn parts_of(sequence: u32, width: u16, height: u16, pixels: &[u8]) -> Vec<Reply> {
    let offsets = (0..).step_by(PICTURE_PART_LEN);
    let parts = offsets.zip(pixels.chunks(PICTURE_PART_LEN));
    parts
        .map(|(offset, bytes)| Reply::Picture {
            sequence,
            width,
            height,
            offset,
            bytes: bytes.try_into().expect("a part is short enough"),
        })
        .collect()
}

fn board() -> BoardState {
    let mut board = BoardState::new("tcp:board", 1);
    board.opened(Duration::ZERO);
    board
}

#[test]
fn a_board_is_what_it_said_last() {
    let mut board = board();
    assert_eq!(board.link(), &LinkState::Silent);
    let empty = SlotState {
        sequence: None,
        atlas: Err(SlotError::Empty),
        is_flown: false,
    };
    for reply in [
        Reply::Identity(identity()),
        Reply::Slots([empty; 2]),
        Reply::Faults(Faults::default()),
        Reply::Done,
    ] {
        assert_eq!(board.take(&reply, SECOND), News::Other);
    }
    assert_eq!(board.link(), &LinkState::Up);
    assert_eq!(board.identity(), Some(&identity()));
    assert!(board.slots().is_some() && board.faults().is_some());
    assert_eq!(board.report_age(SECOND), None);
    let news = board.take(&Reply::Report(report(0)), 2 * SECOND);
    assert_eq!(news, News::Report { restarted: false });
    assert_eq!(board.report_age(5 * SECOND), Some(3 * SECOND));
    assert_eq!(board.last_report(), Some(&report(0)));
    board.silent(6 * SECOND);
    assert_eq!(
        (board.link(), board.link_since()),
        (&LinkState::Silent, 6 * SECOND)
    );
    board.closed("the board hung up", 7 * SECOND);
    board.closed("the board hung up", 8 * SECOND);
    assert_eq!(board.link_since(), 7 * SECOND, "said once");
    board.opened(9 * SECOND);
    let told: Vec<&str> = board.events().map(|event| event.text.as_str()).collect();
    assert_eq!(
        told,
        [
            "tcp:board: link opened",
            "tcp:board: nothing comes any more",
            "tcp:board: the board hung up",
            "tcp:board: link opened again"
        ]
    );
    assert_eq!(board.events_since(3).count(), 1);
}

#[test]
fn rates_are_of_the_last_ten_seconds_by_the_boards_clock() {
    let mut board = board();
    for sequence in 0..300_u32 {
        let judged = match sequence % 4 {
            0 => (Some(fix(true, true)), None),
            1 => (Some(fix(false, true)), None),
            2 => (Some(fix(false, true)), Some(Refusal::Unknown)),
            _ => (None, Some(Refusal::Flat)),
        };
        let report = Report {
            fix: judged.0,
            refusal: judged.1,
            took_us: if sequence == 290 { 90_000 } else { 20_000 },
            ..report(sequence)
        };
        // Two reports at once, as a link may bring them.
        let now = Duration::from_millis(u64::from(100 * (sequence / 2 * 2)));
        board.take(&Reply::Report(report), now);
    }
    let now = Duration::from_millis(29_900);
    let rates = board.rates(now);
    let near = |found: Option<f64>, expected: f64| {
        assert!(
            (found.expect("known") - expected).abs() < 0.02 * expected,
            "{rates:?}"
        );
    };
    near(rates.frames_per_s, 10.0);
    near(rates.reports_per_s, 10.0);
    near(rates.fixes_per_s, 5.0);
    near(rates.known, 0.5);
    near(rates.guaranteed, 0.25);
    near(rates.took_us_mean, 20_700.0);
    assert_eq!((rates.seen, rates.took_us_worst), (Some(1.0), Some(90_000)));
    assert_eq!(
        board.rates(now + 11 * SECOND),
        Rates::default(),
        "of nothing"
    );
    let refusals: Vec<_> = board.refusals().collect();
    assert_eq!(refusals, [(Refusal::Flat, 75), (Refusal::Unknown, 75)]);
}

#[test]
fn missing_reports_are_counted_and_a_new_beginning_is_noticed() {
    let mut board = BoardState::new("board", 3);
    for sequence in [0, 3, 6, 15, 18] {
        board.take(&Reply::Report(report(sequence)), SECOND);
    }
    assert_eq!((board.reports(), board.lost_reports()), (5, 2));
    let news = board.take(&Reply::Report(report(1)), 2 * SECOND);
    assert_eq!(news, News::Report { restarted: true });
    assert_eq!((board.restarts(), board.lost_reports()), (1, 2));
    assert_eq!(board.rates(2 * SECOND).frames_per_s, None, "anew, too");
    assert!(
        board
            .trail()
            .newest()
            .next()
            .is_some_and(|sample| sample.restarted)
    );
}

#[test]
fn the_trail_is_bounded_and_numbered() {
    let mut board = board();
    for sequence in 0..MAX_TRAIL as u32 + 50 {
        board.take(&Reply::Report(report(sequence)), SECOND);
    }
    let trail = board.trail();
    assert_eq!(trail.next(), MAX_TRAIL as u64 + 50);
    let (first, samples) = trail.since(0);
    let samples: Vec<&Sample> = samples.collect();
    assert_eq!((first, samples.len()), (50, MAX_TRAIL));
    assert_eq!(samples[0].sequence, 50);
    let (first, mut samples) = trail.since(u64::MAX);
    assert_eq!((first, samples.next()), (trail.next(), None));
}

#[test]
fn pictures_come_whole_or_not_at_all() {
    let mut board = board();
    let mut take = |parts: &[Reply]| -> Vec<News> {
        parts.iter().map(|part| board.take(part, SECOND)).collect()
    };
    let whole = parts(4, 0);
    let news = take(&whole);
    assert_eq!(
        news.iter().filter(|news| **news == News::Picture).count(),
        1
    );
    assert_eq!(news.last(), Some(&News::Picture));
    // One part is missing, then a picture of which nothing is; one that is too small, and one that is too large.
    assert!(
        take(&parts(5, 1)[..3])
            .iter()
            .all(|news| *news == News::Other)
    );
    assert!(
        take(&parts(6, 2)[1..])
            .iter()
            .all(|news| *news == News::Other)
    );
    assert_eq!(take(&parts_of(7, 4, 4, &[0; 16])), [News::Other]);
    assert_eq!(take(&parts_of(8, 65_535, 65_535, &[0; 16])), [News::Other]);
    assert_eq!(take(&parts_of(8, 0, 0, &[0; 1])), [News::Other]);
    assert_eq!(board.broken_pictures(), 4);
    let picture = board.picture().expect("the first");
    assert_eq!((picture.sequence, picture.frame.width), (4, 40));
    assert_eq!(picture.frame.pixels[255..258], [255, 0, 1]);
}

#[test]
fn everything_is_shown_in_lines_and_json() {
    let mut board = board();
    for reply in [
        Reply::Identity(identity()),
        Reply::Faults(Faults {
            by_watchdog: 1,
            resets: 2,
            ..Faults::default()
        }),
        Reply::Report(Report {
            fix: Some(fix(false, false)),
            refusal: Some(Refusal::Unknown),
            ..report(7)
        }),
    ] {
        board.take(&reply, SECOND);
    }
    board.damaged(2);
    let text = view(&board, 2 * SECOND).join("\n");
    for expected in [
        "tcp:board: link up for 1 s",
        "firmware 0.1.2, 0.5 m per pixel, field of view 57.3°",
        "atlas 1234abcd of map 00000007: 35 landmarks, 15 dimensions, views of 20×20",
        "last reset by power switched on; 2 resets, 1 by the watchdog, 0 by low power",
        "(107.0, 50.0) px, confident (99.5 %)",
        "heading 29°, one sigma 3.0 by 2.0 px, its long axis at 90°",
        "landmark 7: refused: view is like nothing on the map",
        "following; asks for heading 14° at 100 % of the speed",
        "damaged packets: 2 here, 3 at the board",
    ] {
        assert!(text.contains(expected), "{expected}\n{text}");
    }
    assert!(
        line(&board, 2 * SECOND).starts_with("2 s, link up, frame 7, following, (107.0, 50.0)")
    );

    let odd = Report {
        estimate: Some(Estimate {
            position: at(f32::NAN, 1.0),
            ..report(8).estimate.expect("there")
        }),
        ..report(8)
    };
    board.take(&Reply::Report(odd), SECOND);
    let value = report_json(&odd);
    assert_eq!(
        value["estimate"]["position"],
        serde_json::json!([null, 1.0])
    );
    let (_, mut samples) = board.trail().since(1);
    assert_eq!(samples.next().expect("there").position, None);
}

/// What a board does on a connection.
type Serve = Box<dyn FnOnce(&mut Connection) + Send>;

/// A board on TCP: each connection is served by a function of its own.
fn serve(each: Vec<Serve>) -> (String, thread::JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let name = format!("tcp:{}", listener.local_addr().expect("bound"));
    let board = thread::spawn(move || {
        for serve in each {
            let (stream, _) = listener.accept().expect("connects");
            serve(&mut Connection { stream });
        }
    });
    (name, board)
}

struct Connection {
    stream: TcpStream,
}

impl Connection {
    /// The requests up to the one to watch.
    fn asked(&mut self) -> Vec<String> {
        let mut receiver = Receiver::<MAX_REQUEST_LEN>::new();
        let mut asked = Vec::new();
        let mut byte = [0];
        while self.stream.read(&mut byte).is_ok_and(|len| len == 1) {
            if let Some(request) = receiver.push::<Request<'_>>(byte[0]) {
                let request = request.expect("intact");
                asked.push(format!("{request:?}"));
                if matches!(request, Request::Watch { .. }) {
                    break;
                }
            }
        }
        asked
    }

    fn say(&mut self, reply: &Reply) {
        let (mut scratch, mut packet) = ([0; 512], [0; 512]);
        let packet = encode(reply, &mut scratch, &mut packet).expect("fits");
        // Whoever hung up hears nothing.
        let _ = self.stream.write_all(packet);
    }

    fn mutter(&mut self) {
        let _ = self.stream.write_all(&[7, 7, 7, 0]);
    }
}

fn settings(link: &str) -> WatchSettings {
    WatchSettings {
        link: link.to_owned(),
        baud: 115_200,
        every: 1,
        pictures: 10,
        goals: Goals::from_slice(&[3]).expect("room"),
        duration: Some(20 * SECOND),
    }
}

#[test]
fn a_board_is_watched_over_damage_and_lost_links() {
    let (sent, heard) = std::sync::mpsc::channel();
    let again = sent.clone();
    let (name, board) = serve(vec![
        Box::new(move |board| {
            sent.send(board.asked()).expect("heard");
            board.say(&Reply::Identity(identity()));
            board.say(&Reply::Report(report(0)));
            board.mutter();
            board.say(&Reply::Report(report(1)));
            parts(1, 0).iter().for_each(|part| board.say(part));
        }),
        // One that hangs up at once.
        Box::new(|_| ()),
        Box::new(move |board| {
            again.send(board.asked()).expect("heard");
            board.mutter();
            board.say(&Reply::Report(report(5)));
            // It goes on until the monitor leaves.
            again.send(board.asked()).expect("heard");
        }),
    ]);
    let state = Mutex::new(BoardState::new(&name, 1));
    let stop = AtomicBool::new(false);
    let mut told = Vec::new();
    let ended = watch(
        &settings(&name),
        &state,
        Instant::now(),
        &stop,
        |news, _| {
            told.extend(news.map(|(_, news)| news));
            if state.lock().expect("whole").reports() == 3 {
                stop.store(true, Ordering::Relaxed);
            }
            Ok::<(), String>(())
        },
    );
    assert_eq!(ended.expect("watched"), Ended::Stopped);
    board.join().expect("ends");
    let state = state.into_inner().expect("whole");
    assert_eq!((state.reports(), state.lost_reports()), (3, 3));
    assert_eq!((state.damaged_packets(), state.restarts()), (2, 0));
    assert_eq!(state.picture().map(|picture| picture.sequence), Some(1));
    assert_eq!(
        told.iter().filter(|news| **news == News::Picture).count(),
        1
    );
    let events: Vec<&str> = state.events().map(|event| event.text.as_str()).collect();
    assert!(
        events
            .iter()
            .any(|event| event.ends_with("the board hung up") || event.contains("broke")),
        "{events:?}"
    );
    assert!(
        events
            .iter()
            .any(|event| event.ends_with("link opened again")),
        "{events:?}"
    );

    let asked: Vec<Vec<String>> = heard.iter().collect();
    let names = |asked: &[String]| -> Vec<String> {
        let name = |request: &String| request.split([' ', '(']).next().map(str::to_owned);
        asked.iter().filter_map(name).collect()
    };
    assert_eq!(
        names(&asked[0]),
        ["Identify", "Slots", "Faults", "Go", "Watch"]
    );
    assert_eq!(
        names(&asked[1]),
        ["Identify", "Slots", "Faults", "Watch"],
        "goals go once"
    );
    assert_eq!(
        asked[0].last().expect("asked"),
        "Watch { every: 1, pictures: 10 }"
    );
    assert_eq!(
        asked[2],
        ["Watch { every: 0, pictures: 0 }"],
        "and no more of it"
    );
}

#[test]
fn a_silent_board_is_asked_again_until_the_time_is_over() {
    let (sent, heard) = std::sync::mpsc::channel();
    let (name, board) = serve(vec![Box::new(move |board| {
        for _ in 0..2 {
            sent.send(board.asked().len()).expect("heard");
        }
    })]);
    let state = Mutex::new(BoardState::new(&name, 1));
    let settings = WatchSettings {
        duration: Some(Duration::from_millis(2_500)),
        goals: Goals::new(),
        ..settings(&name)
    };
    let never = AtomicBool::new(false);
    let ended = watch(&settings, &state, Instant::now(), &never, |_, _| {
        Ok::<(), String>(())
    });
    assert_eq!(ended.expect("watched"), Ended::InTime);
    board.join().expect("ends");
    assert_eq!(heard.iter().collect::<Vec<_>>(), [4, 4]);
}

#[test]
fn a_link_that_never_opens_is_an_error() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let name = format!("tcp:{}", listener.local_addr().expect("bound"));
    drop(listener);
    let state = Mutex::new(BoardState::new(&name, 1));
    let never = AtomicBool::new(false);
    let ended = watch(&settings(&name), &state, Instant::now(), &never, |_, _| {
        Ok::<(), String>(())
    });
    let error = ended.expect_err("nobody listens").to_string();
    assert!(
        error.starts_with(&format!("{name}: cannot open the link")),
        "{error}"
    );
}

/// A part of the city, and a dense table of it.
static SMALL_CITY: LazyLock<(Map, AtlasBuffer)> = LazyLock::new(|| {
    let part = crop_imm(Map::city().luminance(), 100, 100, 400, 300).to_image();
    let map = Map::from_luminance("part", part);
    let settings = Settings {
        scale: 5.0,
        dimensions: 10,
        selection: Selection::All,
        view_size_px: 100,
        stride_px: Some(50),
        normalize: Normalize::Std,
        whiten: 0.5,
        metric: Metric::Cosine,
        ..Settings::default()
    };
    let trained = train(&map, &settings, false, &Progress::Hidden).expect("trains");
    (map, trained.atlas)
});

/// What a board says of a step.
fn said(step: &Step, sequence: u32, pilot: &Onboard<'_>) -> Report {
    let guidance = pilot.guidance().expect("decided");
    let odometry = step.report.odometry.expect("there");
    Report {
        sequence,
        time_ms: (step.time_s * 1000.0).round() as u32,
        step_s: step.step_s,
        camera: if step.seen {
            Camera::Frame
        } else {
            Camera::Late
        },
        heading_rad: step.readings.heading_rad,
        tilt_rad: step.readings.tilt_rad,
        altitude_ratio: step.readings.altitude_ratio,
        estimate: guidance.estimate,
        odometry_px: [odometry.x_px, odometry.y_px],
        fix: guidance.fix,
        refusal: None,
        state: guidance.state,
        command: guidance.command,
        ..report(sequence)
    }
}

/// An `Onboard` that can be asked while it flies.
struct Shared<'a, 'b>(&'b std::cell::RefCell<Onboard<'a>>);

impl simulate::Pilot for Shared<'_, '_> {
    fn decide(&mut self, sight: &simulate::Sight<'_>) -> simulate::Command {
        self.0.borrow_mut().decide(sight)
    }

    fn report(&self) -> simulate::Report {
        self.0.borrow().report()
    }
}

#[test]
fn a_log_is_replayed_to_the_vehicles_software_bit_for_bit() {
    let (map, buffer) = &*SMALL_CITY;
    let atlas = buffer.atlas();
    let camera = simulate::Camera::sized(64, 64, 100.0);
    let world = World {
        map,
        meters_per_px: 0.5,
        camera,
    };
    let flight = FlightSettings {
        time_limit_s: 5.0,
        ..FlightSettings::new(3, at(200.0, 150.0))
    };
    let field_of_view_rad = world.camera.field_of_view_rad() as f32;
    let pilot = || Onboard::new(atlas.clone(), &[], field_of_view_rad.into()).expect("no goals");

    let directory = tempfile::tempdir().expect("temporary directory");
    let target = directory.path().join("log");
    let ground = simulate::Ground {
        name: "part".to_owned(),
        crc: map.crc(),
    };
    let mut log = FlightLog::create(&target, ground, &atlas).expect("writable");
    let mut state = BoardState::new("board", 1);
    let onboard = std::cell::RefCell::new(pilot());
    let mut flown = Vec::new();
    fly_watched(&world, &flight, &mut Shared(&onboard), |step, frame| {
        let sequence = flown.len() as u32;
        let now = Duration::from_secs_f32(step.time_s);
        let report = said(&step, sequence, &onboard.borrow());
        state.take(&Reply::Report(report), now);
        log.report(&report, false, now).expect("writable");
        // A picture comes while the next reports do, and some do not come whole.
        for part in frame
            .into_iter()
            .flat_map(|frame| parts_of(sequence, frame.width, frame.height, &frame.pixels))
        {
            if state.take(&part, now) == News::Picture {
                log.picture(state.picture().expect("whole"));
            }
        }
        flown.push(step);
        Ok::<(), ()>(())
    })
    .expect("flyable");
    let seen = flown.iter().filter(|step| step.seen).count() as u64;
    assert_eq!(log.counts(), [51, seen]);
    assert!(!target.exists(), "not before its end");
    let setup = Setup {
        meters_per_px: 0.5,
        field_of_view_rad,
    };
    log.finish(Some(setup), Some(atlas.crc()))
        .expect("writable");

    let recording = Recording::open(&target).expect("opens");
    let header = recording.header();
    assert_eq!((header.frame_px, header.steps), ([64, 64], 51));
    assert_eq!((header.meters_per_px, header.footprint_px), (0.5, 100.0));
    assert_eq!(
        (header.map.crc, header.atlas_crc),
        (map.crc(), Some(atlas.crc()))
    );
    let thoughts = |steps: &[Step]| -> Vec<_> {
        let each = steps.iter();
        each.map(|step| {
            (
                step.step_s,
                step.command,
                step.report.estimate,
                step.report.fix,
            )
        })
        .collect()
    };
    assert_eq!(
        thoughts(&recording.steps().expect("reads")),
        thoughts(&flown)
    );
    let replayed = recording.replay(&mut pilot()).expect("replays");
    assert_eq!(thoughts(&replayed), thoughts(&flown));
    assert!(replayed.iter().any(|step| step.report.fix.is_some()));
    let statistics = Statistics::of(&replayed, None, 0.5, 100.0);
    assert_eq!(
        (statistics.distance_m, statistics.median_error_px),
        (None, None)
    );
}

#[test]
fn a_logs_time_goes_on_when_the_board_begins_anew() {
    let (map, buffer) = &*SMALL_CITY;
    let directory = tempfile::tempdir().expect("temporary directory");
    let target = directory.path().join("log");
    let ground = simulate::Ground {
        name: "part".to_owned(),
        crc: map.crc(),
    };
    let mut log = FlightLog::create(&target, ground, &buffer.atlas()).expect("writable");
    let odd = Report {
        heading_rad: Some(f32::NAN),
        odometry_px: [f32::INFINITY, 0.0],
        step_s: f32::NAN,
        ..report(10)
    };
    log.report(&odd, false, SECOND).expect("writable");
    log.report(&report(13), false, SECOND).expect("writable");
    log.report(&report(0), true, 3 * SECOND).expect("writable");
    // Of the report 0 of now, not the 10 of before; and one of another size than the first.
    let [small, large] = [32, 33].map(|side| Picture {
        sequence: 0,
        frame: simulate::CameraFrame {
            pixels: vec![9; side * side],
            width: side as u16,
            height: side as u16,
        },
    });
    log.picture(&Picture {
        sequence: 10,
        ..small.clone()
    });
    log.picture(&small);
    log.picture(&large);
    log.finish(None, None).expect("writable");
    let recording = Recording::open(&target).expect("opens");
    assert_eq!(recording.header().frame_px, [32, 32]);
    let steps = recording.steps().expect("reads");
    let times: Vec<[f32; 2]> = steps
        .iter()
        .map(|step| [step.time_s, step.step_s])
        .collect();
    assert_eq!(times, [[1.0, 0.0], [1.3, 0.3], [3.3, 2.0]]);
    assert_eq!(
        steps.iter().map(|step| step.seen).collect::<Vec<_>>(),
        [false, false, true]
    );
    assert_eq!(steps[0].readings.heading_rad, None);
    assert_eq!((steps[0].report.odometry, steps[0].truth), (None, None));
}

/// What a server answers to a request.
fn fetched(server: &WebServer, request: &str) -> (String, String) {
    let mut stream = TcpStream::connect(server.address()).expect("listens");
    stream.write_all(request.as_bytes()).expect("open");
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).expect("answers");
    let text = String::from_utf8_lossy(&bytes);
    let (head, body) = text.split_once("\r\n\r\n").expect("a head and a body");
    (head.to_owned(), body.to_owned())
}

#[test]
fn the_page_is_served_to_this_machine_and_nothing_else_is() {
    let (map, buffer) = &*SMALL_CITY;
    let gray = image::DynamicImage::ImageLuma8(map.luminance().clone());
    let terrain = Terrain::new()
        .with_atlas(&buffer.atlas())
        .with_picture(&gray);
    let mut board = board();
    board.take(&Reply::Report(report(7)), SECOND);
    parts(7, 0).iter().for_each(|part| {
        board.take(part, SECOND);
    });
    let state = Arc::new(Mutex::new(board));
    let server = WebServer::start("127.0.0.1:0", terrain, Arc::clone(&state), Instant::now())
        .expect("serves");
    let port = server.address().port();
    let get = |path: &str| {
        fetched(
            &server,
            &format!("GET {path} HTTP/1.1\r\nHost: localhost:{port}\r\nConnection: close\r\n\r\n"),
        )
    };
    for (path, kind, expected) in [
        ("/", "text/html", "<title>Eigenmark monitor</title>"),
        ("/page.css", "text/css", "--paper"),
        ("/page.js", "text/javascript", "state.json"),
        (
            "/terrain.json",
            "application/json",
            "\"footprint_px\":100.0",
        ),
        ("/map.jpg", "image/jpeg", "JFIF"),
        ("/picture.png?sequence=7", "image/png", "PNG"),
        (
            "/state.json",
            "application/json",
            "\"position\":[107.0,50.0]",
        ),
    ] {
        let (head, body) = get(path);
        let head = head.to_lowercase();
        assert!(head.starts_with("http/1.1 200"), "{path}: {head}");
        assert!(
            head.contains(&format!("content-type: {kind}")),
            "{path}: {head}"
        );
        assert!(
            head.contains("content-security-policy: default-src 'none'"),
            "{path}: {head}"
        );
        assert!(body.contains(expected), "{path}");
    }
    let value: Value = serde_json::from_str(&get("/state.json?from=0").1).expect("JSON");
    assert_eq!(
        value["samples"]["of"],
        serde_json::json!([[[1070.0, 500.0], 1, null, null, 0]])
    );
    assert_eq!(
        (&value["link"]["state"], &value["picture"]),
        (&"up".into(), &serde_json::json!([7, 40, 32]))
    );
    let value: Value = serde_json::from_str(&get("/state.json?from=1").1).expect("JSON");
    assert_eq!(
        (&value["samples"]["next"], &value["samples"]["of"]),
        (&1.into(), &serde_json::json!([]))
    );

    for path in [
        "/index.html",
        "/../Cargo.toml",
        "//",
        "/page.js?x",
        "/state.json?from=-1",
        "/state.json?to=1",
        "/picture.png?sequence=x",
    ] {
        assert!(get(path).0.starts_with("HTTP/1.1 404"), "{path}");
    }
    let host = |method: &str, hosts: &str| {
        fetched(
            &server,
            &format!("{method} / HTTP/1.1\r\n{hosts}Connection: close\r\n\r\n"),
        )
        .0
    };
    let here = format!("Host: 127.0.0.1:{port}\r\n");
    assert!(host("GET", &here).starts_with("HTTP/1.1 200"));
    assert!(host("POST", &here).starts_with("HTTP/1.1 404"));
    assert!(host("DELETE", &here).starts_with("HTTP/1.1 404"));
    assert!(host("GET", "").starts_with("HTTP/1.1 403"));
    assert!(host("GET", &format!("Host: rebound.example:{port}\r\n")).starts_with("HTTP/1.1 403"));
    assert!(
        host("GET", &format!("{here}Host: rebound.example:{port}\r\n")).starts_with("HTTP/1.1 403")
    );
    let taken = WebServer::start(
        &server.address().to_string(),
        Terrain::new(),
        state,
        Instant::now(),
    );
    let error = taken.err().expect("taken").to_string();
    assert!(error.contains("cannot serve the page"), "{error}");
}
