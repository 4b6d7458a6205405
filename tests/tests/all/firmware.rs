//! The firmware on the emulated board: the same bits as on the host, over the real link, from the real flash region.

use std::{collections::BTreeMap, fs, sync::mpsc};

use eigenmark::{
    atlas::AtlasBuffer,
    evaluate::Deviation,
    learn::Settings,
    map::Map,
    output::Progress,
    select::Selection,
    simulate::{Camera, CameraFrame, Scene, seeded},
    train::train,
};
use eigenmark_core::{
    atlas::Atlas,
    eigenspace::Normalize,
    explore,
    frame::FrameError,
    landmark::{Metric, Width},
    link::{AtlasIdentity, Damage, MAX_REQUEST_LEN, Rejection, Reply, Request},
    localizer::{DIGEST_LEN, Fix, Localizer, digest},
    navigator::{self, BOARD_PLACES, BOARD_STATES, Memory},
    track::{self, Odometry},
};
use eigenmark_tests::{
    board::{self, Board, Log, Running},
    maps::{self, TestMap},
    tables,
};
use rand::{Rng, RngExt};

/// Frames of the real maps that are compared in total, and frames of the city beside them.
const REAL_FRAMES: usize = 200;
const CITY_FRAMES: usize = 20;

/// Sides of the random windows that are compared: whole and fractional ratios, wide and tall.
const SIDES: [(u16, u16); 6] = [(97, 61), (64, 64), (32, 45), (80, 60), (33, 50), (64, 48)];

/// The largest frame that the board has room for, compared once per map: it takes long.
const LARGEST: (u16, u16) = (160, 120);

/// Every so many frames one is a slightly deviated view of a landmark, as a camera of 160×120 pixels sees it.
const RENDERED_EVERY: usize = 5;

/// Instruction counts and sizes may rise by this share before the record must be renewed.
const MAX_RISE: f64 = 0.02;

/// Budgets: RAM of the localizer without frames and of the odometry, stack of each, flash of the navigator without an
/// atlas, and the report's atlas.
const MAX_LOCALIZER_BYTES: u64 = 4 * 1024;
const MAX_STACK_BYTES: u64 = 8 * 1024;
const MAX_ODOMETRY_BYTES: u64 = 68 * 1024;
const MAX_FIRMWARE_BYTES: u64 = 96 * 1024;
const MAX_ATLAS_BYTES: u64 = 16 * 1024;

/// What a flight needs where `memory.x` has statics: the navigator's memory, a frame of 160×120, and 8 KiB for links. And
/// its stack, with the localizer on it.
const MAX_NAVIGATOR_BYTES: u64 = 108 * 1024 - 160 * 120 - 8 * 1024;
const MAX_NAVIGATOR_STACK_BYTES: u64 = 10 * 1024;

/// A whole step of the navigator within a frame of thirty per second, at 168 MHz.
const MAX_NAVIGATE_INSTRUCTIONS: u64 = 5_544_000;

fn trained(map: &TestMap, selection: Selection) -> (Map, AtlasBuffer) {
    let opened = map.open();
    let settings = Settings {
        view_size_px: map.view_size_px,
        selection,
        ..Settings::default()
    };
    let trained = train(&opened, &settings, false, &Progress::Hidden).expect("trains");
    (opened, trained.atlas)
}

fn run(board: &Board) -> (i32, Vec<Log>) {
    let mut logs = Vec::new();
    let code = board.run(|log| logs.push(log)).expect("runs");
    (code, logs)
}

/// A random window of the map in a frame of these sides, at a random contrast.
fn random_frame(map: &Map, (width, height): (u16, u16), random: &mut impl Rng) -> CameraFrame {
    let (x, y) = (
        random.random_range(0..=map.width() - u32::from(width)),
        random.random_range(0..=map.height() - u32::from(height)),
    );
    let contrast = random.random_range(64..=256_u32);
    let window =
        image::imageops::crop_imm(map.luminance(), x, y, width.into(), height.into()).to_image();
    let pixels = window
        .as_raw()
        .iter()
        .map(|&level| (u32::from(level) * contrast / 256) as u8)
        .collect();
    CameraFrame {
        pixels,
        width,
        height,
    }
}

/// A setting per map, so that every path of the arithmetic runs on the target: normalizations, metrics, widths, views
/// that need padding, dimensions that do not fill their last block.
fn parity_settings(map: &TestMap) -> Settings {
    let base = Settings {
        view_size_px: map.view_size_px,
        ..Settings::default()
    };
    match map.name {
        "nust" => Settings {
            normalize: Normalize::Std,
            metric: Metric::Euclid,
            width: Width::I8,
            ..base
        },
        "kitsap" => Settings {
            normalize: Normalize::Mean,
            dimensions: 13,
            scale: 5.0,
            ..base
        },
        "city" => Settings {
            normalize: Normalize::Std,
            highpass_px: 3.0,
            whiten: 0.5,
            metric: Metric::Cosine,
            scale: 8.0,
            dimensions: 7,
            ..base
        },
        // A dense table: positions between landmarks.
        "wellington" => Settings {
            normalize: Normalize::Std,
            metric: Metric::Cosine,
            width: Width::I8,
            dimensions: 48,
            stride_px: Some(20),
            selection: Selection::All,
            ..base
        },
        _ => base,
    }
}

#[test]
fn frames_of_the_maps_give_the_same_bits_on_host_and_target() {
    if !board::is_there() {
        return;
    }
    let firmware = board::firmware("navigator").expect("builds");
    let maps = maps::all();
    let real = maps.len() - 1;
    for map in &maps {
        let frames = if map.name == "city" {
            CITY_FRAMES
        } else {
            REAL_FRAMES.div_ceil(real)
        };
        let opened = map.open();
        let atlas = train(&opened, &parity_settings(map), false, &Progress::Hidden)
            .expect("trains")
            .atlas;
        let board = Board::with_atlas(&firmware, &atlas).expect("fits");
        let mut running = board.start(|_| ()).expect("starts");
        assert_eq!(flown(&mut running), Some(AtlasIdentity::of(&atlas.atlas())));

        let mut localizer = Localizer::new(atlas.atlas());
        let mut random = seeded(7, 0);
        let (mut known, mut guaranteed) = (0, 0);
        for index in 0..frames {
            let sides = if index == 1 {
                LARGEST
            } else {
                SIDES[index % SIDES.len()]
            };
            let frame = if index % RENDERED_EVERY == 0 {
                rendered_frame(
                    &opened,
                    &atlas.atlas(),
                    index / RENDERED_EVERY % 8,
                    &mut random,
                )
            } else {
                random_frame(&opened, sides, &mut random)
            };
            let on_host: Option<Fix> = localizer.locate(&frame.as_frame());
            let sequence = index as u32;
            let reply = running.locate(sequence, &frame).expect("answers");
            let Reply::Fix {
                sequence: answered,
                fix: on_target,
            } = reply
            else {
                panic!("{reply:?}")
            };
            assert_eq!(answered, sequence);
            assert_eq!(
                bits(on_host),
                bits(on_target),
                "{} frame {index}: {on_host:?} {on_target:?}",
                map.name
            );
            known += u32::from(on_host.is_some_and(|fix| fix.known));
            guaranteed += u32::from(on_host.is_some_and(|fix| fix.guaranteed));
        }
        println!(
            "{}: {frames} frames, the same bits; {known} known, {guaranteed} guaranteed",
            map.name
        );
        assert!(
            known > 0 && guaranteed > 0,
            "{}: both answers of both judgements are compared",
            map.name
        );
    }
}

/// A slightly deviated view of a landmark.
fn rendered_frame(
    map: &Map,
    atlas: &Atlas<'_>,
    landmark: usize,
    random: &mut impl Rng,
) -> CameraFrame {
    let view = atlas.landmarks().records()[landmark].view;
    let nominal = Scene::nominal(atlas.survey().place(view).expect("a candidate"));
    let square = Camera::square_for(atlas);
    let (scene, _) = Deviation::SLIGHT
        .draw(map, &square, &nominal, random)
        .expect("there is room");
    let camera = Camera::for_atlas(atlas);
    let mut frame = camera.frame();
    camera.render(map, &scene, random, &mut frame);
    frame
}

/// Every bit of a fix.
fn bits(fix: Option<Fix>) -> Option<[u32; 14]> {
    fix.map(|fix| {
        let numbers = [
            fix.place.x_px,
            fix.place.y_px,
            fix.position.x_px,
            fix.position.y_px,
            fix.heading_rad,
            fix.altitude_ratio,
            fix.distance,
            fix.second,
            fix.margin,
            fix.from_feature_space,
        ];
        let mut bits = [
            fix.landmark,
            fix.view,
            0,
            0,
            0,
            0,
            0,
            0,
            0,
            0,
            0,
            0,
            fix.guaranteed.into(),
            fix.known.into(),
        ];
        bits[2..12].copy_from_slice(&numbers.map(f32::to_bits));
        bits
    })
}

#[test]
fn the_link_survives_what_is_damaged() {
    if !board::is_there() {
        return;
    }
    let firmware = board::firmware("navigator").expect("builds");
    let (opened, atlas) = trained(&TestMap::city(), Selection::profile(8));
    let board = Board::with_atlas(&firmware, &atlas).expect("fits");
    let mut running = board.start(|_| ()).expect("starts");
    let rejected = |reason| Reply::Rejected {
        sequence: None,
        reason: Rejection::Damaged(reason),
    };

    running.send(&[5, 1, 2, 3, 4, 0]).expect("sends");
    assert_eq!(running.reply().expect("answers"), rejected(Damage::Crc));
    running.send(&[9, 1, 0]).expect("sends");
    assert_eq!(
        running.reply().expect("answers"),
        rejected(Damage::Encoding)
    );
    let mut overlong = vec![1; MAX_REQUEST_LEN + 1];
    overlong.push(0);
    running.send(&overlong).expect("sends");
    assert_eq!(running.reply().expect("answers"), rejected(Damage::TooLong));

    let tiny = CameraFrame {
        pixels: vec![0],
        width: 1,
        height: 1,
    };
    let reason = Rejection::Frame(FrameError::Size {
        width: 1,
        height: 1,
    });
    assert_eq!(
        running.locate(3, &tiny).expect("answers"),
        Reply::Rejected {
            sequence: Some(3),
            reason
        }
    );
    // What came of it without a frame.
    let gap = Rejection::Gap { expected: 0 };
    assert_eq!(
        running.reply().expect("answers"),
        Reply::Rejected {
            sequence: None,
            reason: gap
        }
    );

    let frame = random_frame(&opened, (160, 120), &mut seeded(1, 1));
    assert!(matches!(
        running.locate(4, &frame).expect("answers"),
        Reply::Fix {
            sequence: 4,
            fix: Some(_)
        }
    ));
}

/// What the board flies by.
fn flown(running: &mut Running) -> Option<AtlasIdentity> {
    match running.ask(&Request::Identify).expect("answers") {
        Reply::Identity(identity) => identity.atlas,
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_selftest_passes_and_its_digest_is_the_hosts() {
    if !board::is_there() {
        return;
    }
    let firmware = board::firmware("selftest").expect("builds");
    let mut pixels = Box::new([0; DIGEST_LEN]);
    let track = track::digest(&mut Box::new(Odometry::whole()), &mut *pixels);
    for map in maps::all() {
        let (_, atlas) = trained(&map, Selection::All);
        let atlas = tables::with_way(&atlas);
        let (code, logs) = run(&Board::with_atlas(&firmware, &atlas).expect("fits"));
        assert_eq!(code, 0, "{logs:?}");
        let result = printed(&logs);
        assert_eq!(
            result["digest"],
            format!("{:08x}", digest(&atlas.atlas(), &mut pixels)),
            "{}",
            map.name
        );
        assert_eq!(result["explore"], format!("{:08x}", explore::digest()));
        assert_eq!(result["track"], format!("{track:08x}"));
        // As much room as the board's.
        let memory = Box::new(Memory::<BOARD_STATES, BOARD_PLACES>::new());
        let navigate = navigator::digest(atlas.atlas(), memory, &mut *pixels);
        assert_eq!(result["navigate"], format!("{navigate:08x}"));
        println!("{}: {result}", map.name);
    }
}

#[test]
fn a_damaged_slot_is_skipped_and_without_an_atlas_the_link_still_works() {
    if !board::is_there() {
        return;
    }
    let firmware = board::firmware("navigator").expect("builds");
    let board = Board::flashed(&firmware).expect("firmware");
    let (sender, logs) = mpsc::channel();
    let mut running = board
        .start(move |log: Log| drop(sender.send(log.text)))
        .expect("starts");
    assert_eq!(flown(&mut running), None);
    running.cut();
    let logs: Vec<String> = logs.iter().collect();
    assert!(
        logs.iter().any(|log| log == "no slot holds a valid atlas"),
        "{logs:?}"
    );

    let (_, atlas) = trained(&TestMap::city(), Selection::profile(8));
    board.flash_atlas(0, &atlas).expect("fits");
    board.flash_atlas(1, &atlas).expect("fits");
    board
        .change_flash(|flash| flash[200] ^= 1)
        .expect("writable");
    let mut running = board.start(|_| ()).expect("starts");
    assert_eq!(flown(&mut running), Some(AtlasIdentity::of(&atlas.atlas())));
    let Reply::Slots([a, b]) = running.ask(&Request::Slots).expect("answers") else {
        panic!("no slots")
    };
    assert!(a.atlas.is_err() && b.is_flown);
}

#[test]
fn instruction_counts_do_not_rise_above_their_record() {
    if !board::is_there() {
        return;
    }
    let firmware = board::firmware("cycles").expect("builds");
    let mut lines: Vec<String> = Vec::new();
    for atlases in tables::of_cycles(&Progress::Hidden).expect("trains") {
        let board = Board::flashed(&firmware).expect("firmware");
        for (slot, atlas) in atlases.iter().enumerate() {
            board.flash_atlas(slot, atlas).expect("fits");
        }
        let (code, logs) = run(&board);
        assert_eq!(code, 0, "{logs:?}");
        let printed = logs.into_iter().filter(|log| log.level.is_none());
        lines.extend(printed.map(|log| log.text));
    }
    let steps = lines.iter().filter(|line| line.contains("navigate_"));
    let steps: Vec<u64> = steps.map(|line| number(line, "instructions")).collect();
    assert!(steps.len() == 2 && steps.iter().all(|&step| step <= MAX_NAVIGATE_INSTRUCTIONS));
    compare_with_record("cycles.jsonl", "instructions", &lines);
}

#[test]
fn sizes_do_not_rise_above_their_record() {
    if !board::is_there() {
        return;
    }
    let firmware = fs::read(board::firmware("navigator").expect("builds")).expect("readable");
    let flash = board::flash_bytes(&firmware).expect("an ELF file");
    let selftest = board::firmware("selftest").expect("builds");
    let atlas = tables::report(&Progress::Hidden).expect("trains");
    let dense = tables::dense(&Progress::Hidden).expect("trains");
    // What needs the most: a dense table of 8-bit coefficients is refined, and its coefficients are split.
    let bytes = |key: &str| {
        let of = |atlas: &AtlasBuffer| {
            let (code, logs) = run(&Board::with_atlas(&selftest, atlas).expect("fits"));
            assert_eq!(code, 0, "{logs:?}");
            printed(&logs)[key].as_u64().expect("a number of bytes")
        };
        of(&atlas).max(of(&dense))
    };
    let mut lines = Vec::new();
    for (name, bytes, budget) in [
        ("localizer", bytes("localizer_bytes"), MAX_LOCALIZER_BYTES),
        ("stack", bytes("stack_bytes"), MAX_STACK_BYTES),
        ("odometry", bytes("odometry_bytes"), MAX_ODOMETRY_BYTES),
        (
            "odometry_stack",
            bytes("odometry_stack_bytes"),
            MAX_STACK_BYTES,
        ),
        ("navigator", bytes("navigator_bytes"), MAX_NAVIGATOR_BYTES),
        (
            "navigator_stack",
            bytes("navigator_stack_bytes"),
            MAX_NAVIGATOR_STACK_BYTES,
        ),
        ("navigator_flash", flash, MAX_FIRMWARE_BYTES),
        ("atlas_83", atlas.bytes().len() as u64, MAX_ATLAS_BYTES),
    ] {
        assert!(bytes <= budget, "{name}: {bytes} bytes, budget {budget}");
        lines.push(format!("{{\"name\":\"{name}\",\"bytes\":{bytes}}}"));
    }
    compare_with_record("sizes.jsonl", "bytes", &lines);
}

/// What the self-test prints at its end.
fn printed(logs: &[Log]) -> serde_json::Value {
    let printed = logs.iter().find(|log| log.level.is_none());
    serde_json::from_str(&printed.expect("a result").text).expect("JSON")
}

#[test]
fn the_readme_states_the_records() {
    let read = |file: &str| fs::read_to_string(maps::workspace().join(file)).expect("readable");
    let readme = read("README.md");
    for (file, unit) in [("cycles.jsonl", "instructions"), ("sizes.jsonl", "bytes")] {
        for line in read(&format!("firmware/{file}")).lines() {
            let value: serde_json::Value = serde_json::from_str(line).expect("JSON");
            let number = value[unit].as_u64().expect("a number");
            let (thousands, rest) = (number / 1000, number % 1000);
            let stated = match thousands {
                0 => rest.to_string(),
                1..1000 => format!("{thousands},{rest:03}"),
                _ => format!("{},{:03},{rest:03}", thousands / 1000, thousands % 1000),
            };
            assert!(readme.contains(&stated), "README.md does not state {line}");
        }
    }
}

fn number(line: &str, unit: &str) -> u64 {
    let value: serde_json::Value = serde_json::from_str(line).expect("JSON");
    value[unit].as_u64().expect("a number")
}

/// Compares lines of JSON with their record in `firmware/`, or renews it.
fn compare_with_record(file: &str, unit: &str, lines: &[String]) {
    let path = maps::workspace().join("firmware").join(file);
    if std::env::var_os("EIGENMARK_BLESS").is_some() {
        fs::write(&path, lines.join("\n") + "\n").expect("writable");
        return;
    }
    let numbers = |lines: &mut dyn Iterator<Item = &str>| -> BTreeMap<String, u64> {
        let parsed = lines.map(|line| {
            let value: serde_json::Value = serde_json::from_str(line).expect("JSON");
            let name = value["name"].as_str().expect("a name").to_owned();
            (name, value[unit].as_u64().expect("a number"))
        });
        parsed.collect()
    };
    let record = numbers(&mut fs::read_to_string(&path).expect("the record").lines());
    let measured = numbers(&mut lines.iter().map(String::as_str));
    assert_eq!(
        measured.keys().collect::<Vec<_>>(),
        record.keys().collect::<Vec<_>>()
    );
    for (name, number) in measured {
        let recorded = record[&name];
        println!("{name}: {number} {unit}, on record {recorded}");
        assert!(
            number as f64 <= recorded as f64 * (1.0 + MAX_RISE),
            "{name}: {number} {unit}, on record {recorded}; EIGENMARK_BLESS=1 renews the record",
        );
    }
}
