//! A whole session on the emulated board: it boots empty, takes an atlas over its link, flies, is disturbed in every way
//! that can be injected, and reports it.

use std::{
    fs,
    io::Write,
    path::Path,
    process::Command,
    sync::{Mutex, PoisonError, mpsc},
    thread,
    time::{Duration, Instant},
};

use eigenmark::{
    atlas::AtlasBuffer,
    link::upload,
    map::Map,
    output::Progress,
    simulate::{
        Camera, CameraFrame, FlightSettings, Pilot, Readings, Report as Thought, Sight, Truth,
        World, fly, seeded,
    },
};
use eigenmark_core::{
    atlas::Atlas,
    link::{
        AtlasIdentity, Camera as CameraSays, Cause, Crash, Faults, Provocation, Refusal, Rejection,
        Reply, Report, Request, Upload,
    },
    navigator::{self, BoardMemory, Navigator},
    preprocess::Pose,
    slots::{RECORD_LEN, Record, Setup, Slot},
};
use eigenmark_tests::{
    board::{self, Board, Running},
    maps::workspace,
    tables,
};
use rand::RngExt;

/// Seconds of the simulated flight, and frames that are located over the link; `tests/session`, which sets
/// `EIGENMARK_SESSION`, has them fly for five minutes and locates a thousand.
const FLIGHT_S: [f64; 2] = [15.0, 300.0];
const LOCATED: [u32; 2] = [100, 1000];

/// The deepest stack of a flight, in bytes: `memory.x` has 20 KiB.
const MAX_STACK_BYTES: u32 = 16 * 1024;

/// Frames per second of the flight: what an autopilot is told comes at this rate.
const RATE_HZ: f64 = 30.0;

/// Bytes of noise on the link.
const NOISE: usize = 10_000;

/// Meters per pixel of the city.
const METERS_PER_PX: f32 = 0.25;

/// An autopilot that is not ours: pymavlink, on the board's second wire.
struct Autopilot {
    process: std::process::Child,
    input: std::process::ChildStdin,
    summary: mpsc::Receiver<serde_json::Value>,
}

/// Held while one starts: the first of all installs what it needs.
static INSTALLING: Mutex<()> = Mutex::new(());

impl Autopilot {
    /// Starts it on a wire. `damage` is the share of what it says that is damaged on the way.
    fn start(damage: f64) -> (Self, String) {
        let _installing = INSTALLING.lock().unwrap_or_else(PoisonError::into_inner);
        let peers = workspace().join("tests/peers");
        let mut process = Command::new(peers.join("python"))
            .arg(peers.join("autopilot.py"))
            .arg(damage.to_string())
            .stdin(std::process::Stdio::piped())
            .stdout(std::process::Stdio::piped())
            .spawn()
            .expect("Python starts");
        let input = process.stdin.take().expect("piped");
        let stdout = process.stdout.take().expect("piped");
        let (sender, lines) = mpsc::channel();
        thread::spawn(move || {
            for line in std::io::BufRead::lines(std::io::BufReader::new(stdout)) {
                let Ok(line) = line else { return };
                let value = serde_json::from_str(&line).expect("JSON");
                if sender.send(value).is_err() {
                    return;
                }
            }
        });
        let first: serde_json::Value = lines
            .recv_timeout(Duration::from_secs(300))
            .expect("the autopilot says where it listens");
        let address = first["address"].as_str().expect("an address").to_owned();
        let autopilot = Self {
            process,
            input,
            summary: lines,
        };
        (autopilot, address)
    }

    /// Has it tell the board what its instruments read.
    fn tell(&mut self, readings: &Readings, altitude_m: Option<f32>) {
        let (roll, pitch) = readings.tilt_rad.unwrap_or((0.0, 0.0));
        let line = serde_json::json!({
            "yaw": readings.heading_rad, "roll": roll, "pitch": pitch, "altitude": altitude_m,
        });
        writeln!(self.input, "{line}").expect("it listens");
    }

    /// Ends it, and gives what it has heard.
    fn end(mut self) -> serde_json::Value {
        drop(self.input);
        let summary = self.summary.recv_timeout(Duration::from_secs(60));
        let status = self.process.wait().expect("it ends");
        assert!(status.success(), "{status}");
        summary.expect("a summary")
    }
}

fn faults(running: &mut Running) -> Faults {
    let is_it = |reply: &Reply| matches!(reply, Reply::Faults(_));
    let reply = running.insist(&Request::Faults, is_it).expect("answers");
    // What was asked more than once is answered more than once.
    running.drain().expect("drains");
    match reply {
        Reply::Faults(faults) => faults,
        other => panic!("{other:?}"),
    }
}

fn atlas_of(running: &mut Running) -> Option<AtlasIdentity> {
    let is_it = |reply: &Reply| matches!(reply, Reply::Identity(_));
    match running.insist(&Request::Identify, is_it).expect("answers") {
        Reply::Identity(identity) => identity.atlas,
        other => panic!("{other:?}"),
    }
}

fn setup() -> Setup {
    Setup {
        meters_per_px: METERS_PER_PX,
        ..Setup::default()
    }
}

/// The twin of the board's navigator, on the host.
struct Twin<'a> {
    navigator:
        Navigator<'a, Box<BoardMemory>, { navigator::BOARD_STATES }, { navigator::BOARD_PLACES }>,
    has_seen: bool,
}

impl Twin<'_> {
    /// Takes the step that the board has reported, and asserts that it comes to the same.
    fn follow(&mut self, report: &Report, frame: &CameraFrame) {
        let frame = (report.camera == CameraSays::Frame).then_some(frame);
        self.has_seen |= frame.is_some();
        if !self.has_seen {
            return;
        }
        let tilt = report.tilt_rad.and_then(|(roll, pitch)| {
            let pose = Pose::NOMINAL.tilted(roll, pitch, setup().field_of_view_rad);
            pose.ok()?.tilt()
        });
        let readings = navigator::Readings {
            heading_rad: report.heading_rad,
            tilt,
            altitude_ratio: report.altitude_ratio,
        };
        let frame = frame.map(CameraFrame::as_frame);
        let guidance = self
            .navigator
            .advance(frame.as_ref(), &readings, report.step_s);
        assert_eq!(guidance.fix, report.fix, "step {}", report.sequence);
        assert_eq!(
            guidance.estimate, report.estimate,
            "step {}",
            report.sequence
        );
        assert_eq!(guidance.command, report.command, "step {}", report.sequence);
        assert_eq!(guidance.state, report.state, "step {}", report.sequence);
    }
}

/// The board as a simulated vehicle's pilot.
struct Aboard<'a> {
    running: Running,
    autopilot: Autopilot,
    twin: Twin<'a>,
    nominal_m: f32,
    command: eigenmark::simulate::Command,
    steps: u32,
    late: u32,
    confident: u32,
    /// Of these, the estimates that are less than a view's side from the truth.
    right: u32,
    truth_px: [f32; 2],
    footprint_px: f32,
}

impl Pilot for Aboard<'_> {
    fn told(&mut self, truth: &Truth) {
        self.truth_px = truth.position_px.map(|px| px as f32);
    }

    fn decide(&mut self, sight: &Sight<'_>) -> eigenmark::simulate::Command {
        let altitude_m = sight
            .readings
            .altitude_ratio
            .map(|ratio| ratio * self.nominal_m);
        self.autopilot.tell(&sight.readings, altitude_m);
        // Without a frame the board goes on by itself.
        let Some(frame) = sight.frame else {
            return self.command;
        };
        let time_us = (f64::from(sight.time_s) * 1e6) as u64 + 1_000_000;
        self.running.show(frame, time_us).expect("shown");
        loop {
            let report = self.running.report().expect("reports");
            self.twin.follow(&report, frame);
            self.steps += 1;
            if let Some(estimate) = report.estimate.filter(|estimate| estimate.is_confident()) {
                self.confident += 1;
                let [x, y] = self.truth_px;
                let [dx, dy] = [estimate.position.x_px - x, estimate.position.y_px - y];
                self.right += u32::from(dx.hypot(dy) < self.footprint_px);
            }
            self.command = report.command.into();
            if report.camera == CameraSays::Frame {
                return self.command;
            }
            self.late += 1;
        }
    }

    fn report(&self) -> Thought {
        Thought::default()
    }
}

/// The short or the long one.
fn chosen<T: Copy>([short, long]: [T; 2]) -> T {
    match std::env::var_os("EIGENMARK_SESSION") {
        None => short,
        Some(_) => long,
    }
}

#[test]
fn a_board_goes_from_an_empty_slot_to_a_flight_and_survives_what_is_done_to_it() {
    if !board::is_there() {
        return;
    }
    let firmware = board::firmware("navigator").expect("builds");
    let board = Board::flashed(&firmware).expect("firmware");
    let buffer = tables::report(&Progress::Hidden).expect("trains");
    let atlas = buffer.atlas();

    // Empty: it is there, flies by nothing, and says so.
    let mut running = board.start(|_| ()).expect("starts");
    assert_eq!(atlas_of(&mut running), None);
    // The camera gives nothing yet.
    let found = faults(&mut running);
    assert_eq!(
        Faults {
            camera_losses: 0,
            ..found
        },
        Faults::default()
    );

    // It takes an atlas.
    let began = Instant::now();
    let uploaded = upload(running.link(), &buffer, &setup(), &Progress::Hidden).expect("uploaded");
    assert_eq!((uploaded.slot, uploaded.sequence), (0, 1));
    println!(
        "uploaded {} bytes in {:.1?}",
        buffer.bytes().len(),
        began.elapsed()
    );
    assert_eq!(
        running.ask(&Request::Restart).expect("answers"),
        Reply::Done
    );
    running.wait_for_restart().expect("starts anew");
    let mut running = board.start(|_| ()).expect("starts");
    let identity = AtlasIdentity::of(&atlas);
    assert_eq!(atlas_of(&mut running), Some(identity));

    // It answers frames with the bits of the host.
    let began = Instant::now();
    locate_frames(&mut running, &atlas);
    println!(
        "{} frames in {:.1?}, the same bits",
        chosen(LOCATED),
        began.elapsed()
    );

    // Noise on the link, then an upload that is damaged: it says so, and flies by what it had.
    let mut random = seeded(3, 0);
    let noise: Vec<u8> = (0..NOISE).map(|_| random.random()).collect();
    running.send(&noise).expect("sent");
    thread::sleep(Duration::from_millis(1500));
    running.send(&[0]).expect("sent");
    running.drain().expect("drains");
    assert!(faults(&mut running).link_storms > 0, "noise is a storm");
    damaged_upload(&mut running, &buffer);
    assert_eq!(atlas_of(&mut running), Some(identity));
    running.cut();

    // Power is cut in the midst of an upload.
    let mut running = board.start(|_| ()).expect("starts");
    let begin = Upload::Begin {
        len: buffer.bytes().len() as u32,
        crc: identity.crc,
        setup: setup(),
    };
    assert_eq!(
        running.ask(&Request::Upload(begin)).expect("answers"),
        Reply::Upload { next: 0 }
    );
    let bytes = &buffer.bytes()[..512];
    let chunk = Upload::Chunk { offset: 0, bytes };
    assert_eq!(
        running.ask(&Request::Upload(chunk)).expect("answers"),
        Reply::Upload { next: 512 }
    );
    running.cut();
    let mut running = board.start(|_| ()).expect("starts");
    assert_eq!(atlas_of(&mut running), Some(identity));
}

#[test]
fn a_flight_is_the_hosts_bit_for_bit_and_pymavlink_hears_it() {
    if !board::is_there() {
        return;
    }
    let firmware = board::firmware("navigator").expect("builds");
    let buffer = tables::flown(&Progress::Hidden).expect("trains");
    let atlas = buffer.atlas();
    let board = Board::with_atlas(&firmware, &buffer).expect("fits");
    let record = Record {
        sequence: 1,
        len: atlas.total_len(),
        crc: atlas.crc(),
        setup: setup(),
    };
    let end = board.slot_len();
    board
        .change_flash(|flash| {
            flash[end - RECORD_LEN..end].copy_from_slice(&record.encode());
        })
        .expect("writable");
    fly_over_the_city(&board, &atlas);
}

fn locate_frames(running: &mut Running, atlas: &Atlas<'_>) {
    let city = Map::city();
    let mut localizer = eigenmark_core::localizer::Localizer::new(atlas.clone());
    let mut random = seeded(11, 0);
    for sequence in 0..chosen(LOCATED) {
        let side: u16 = random.random_range(32..=64);
        let (x, y) = (
            random.random_range(0..=city.width() - u32::from(side)),
            random.random_range(0..=city.height() - u32::from(side)),
        );
        let window = image::imageops::crop_imm(city.luminance(), x, y, side.into(), side.into());
        let frame = CameraFrame {
            pixels: window.to_image().into_raw(),
            width: side,
            height: side,
        };
        let fix = localizer.locate(&frame.as_frame());
        let reply = running.locate(sequence, &frame).expect("answers");
        assert_eq!(reply, Reply::Fix { sequence, fix });
    }
}

/// The same atlas with a byte changed, announced as if it were whole.
fn damaged_upload(running: &mut Running, buffer: &AtlasBuffer) {
    let mut bytes = buffer.bytes().to_vec();
    let at = bytes.len() / 2;
    bytes[at] ^= 0x10;
    let begin = Upload::Begin {
        len: bytes.len() as u32,
        crc: buffer.atlas().crc(),
        setup: setup(),
    };
    assert_eq!(
        running.ask(&Request::Upload(begin)).expect("answers"),
        Reply::Upload { next: 0 }
    );
    for (bytes, offset) in bytes.chunks(512).zip((0..).step_by(512)) {
        let next = offset + bytes.len() as u32;
        let reply = running.ask(&Request::Upload(Upload::Chunk { offset, bytes }));
        assert_eq!(reply.expect("answers"), Reply::Upload { next });
    }
    let reply = running
        .ask(&Request::Upload(Upload::Finish))
        .expect("answers");
    assert!(
        matches!(
            reply,
            Reply::Rejected {
                reason: Rejection::Slot(_),
                ..
            }
        ),
        "{reply:?}"
    );
}

/// Flies, with pymavlink as the autopilot, of whose words some are damaged.
fn fly_over_the_city(board: &Board, atlas: &Atlas<'_>) {
    let city = Map::city();
    let footprint_px = atlas.header().footprint_px;
    let (autopilot, address) = Autopilot::start(0.02);
    let mut running = board
        .start_with_autopilot(&address, |_| ())
        .expect("starts");
    let watch = Request::Watch {
        every: 1,
        pictures: 0,
    };
    assert_eq!(running.ask(&watch).expect("answers"), Reply::Done);
    let goals = [4, 0, 4, 0];
    let list = eigenmark_core::link::Goals::from_slice(&goals).expect("fits");
    assert_eq!(
        running.ask(&Request::Go(list)).expect("answers"),
        Reply::Done
    );
    // What the camera did not give before the flight is of no interest.
    running.drain().expect("drains");
    let mut navigator = Navigator::new(atlas.clone(), Box::new(BoardMemory::new()));
    navigator.go(&goals).expect("a plan");

    let start = atlas.topology().places()[0];
    let settings = FlightSettings {
        time_limit_s: chosen(FLIGHT_S),
        frame_rate_hz: RATE_HZ,
        ..FlightSettings::new(
            5,
            eigenmark_core::landmark::Point {
                x_px: start.x_px,
                y_px: start.y_px,
            },
        )
    };
    let world = World {
        map: &city,
        meters_per_px: METERS_PER_PX.into(),
        camera: Camera::sized(160, 120, footprint_px.into()),
    };
    let half_angle = setup().field_of_view_rad / 2.0;
    let mut pilot = Aboard {
        running,
        autopilot,
        twin: Twin {
            navigator,
            has_seen: false,
        },
        nominal_m: footprint_px * METERS_PER_PX / (2.0 * half_angle.tan()),
        command: eigenmark::simulate::Command::default(),
        steps: 0,
        late: 0,
        confident: 0,
        right: 0,
        truth_px: [0.0; 2],
        footprint_px,
    };
    let began = Instant::now();
    let flight = fly(&world, &settings, &mut pilot).expect("flown");
    println!(
        "flown {:.0} s in {:.1?}: {} steps, {} late frames, {} confident, {} of them right, ended {:?}",
        chosen(FLIGHT_S),
        began.elapsed(),
        pilot.steps,
        pilot.late,
        pilot.confident,
        pilot.right,
        flight.end
    );
    assert!(pilot.confident > pilot.steps / 2, "it knows where it is");
    assert!(pilot.right >= pilot.confident - pilot.confident / 50);

    let Reply::Identity(identity) = pilot.running.ask(&Request::Identify).expect("answers") else {
        panic!("no identity")
    };
    println!("{} bytes of stack", identity.stack_bytes);
    assert!((1..=MAX_STACK_BYTES).contains(&identity.stack_bytes));
    unplug(&mut pilot);
    let faults = faults(&mut pilot.running);
    assert!(faults.camera_losses >= 1, "{faults:?}");
    let steps = pilot.steps;
    pilot.running.cut();
    let heard = pilot.autopilot.end();
    println!("pymavlink heard {heard}");
    assert_eq!(heard["errors"], 0);
    assert_eq!(heard["lost"], 0);
    let count = |name: &str| heard["messages"][name].as_u64().unwrap_or(0);
    assert!(count("ODOMETRY") >= u64::from(steps));
    assert!(count("OPTICAL_FLOW_RAD") > u64::from(steps) / 2);
    assert!(count("HEARTBEAT") >= 1);
    assert!(
        heard["texts"]
            .as_array()
            .expect("texts")
            .iter()
            .any(|text| text == "camera lost")
    );
    assert!(
        heard["damaged"].as_u64() > Some(0),
        "some of what it said was damaged"
    );
}

/// The camera gives torn and short frames, none at all, is unplugged and plugged in again: all of it is reported.
fn unplug(pilot: &mut Aboard<'_>) {
    let frame = CameraFrame {
        pixels: vec![100; 160 * 120],
        width: 160,
        height: 120,
    };
    let camera = pilot.running.camera().to_owned();
    let mut wait_for = |says: CameraSays, disturb: &mut dyn FnMut(&mut Running, &Path)| {
        for _ in 0..20 {
            disturb(&mut pilot.running, &camera);
            let report = pilot.running.report().expect("reports");
            if report.camera == says {
                let is_refused = report.refusal == Some(Refusal::NoFrame);
                assert_eq!(is_refused, says != CameraSays::Frame);
                return;
            }
        }
        panic!("never reported: {says:?}");
    };
    let mut time_us = 1_000_000_000;
    let mut show = |running: &mut Running, bytes: usize| {
        time_us += 33_333;
        running.show_part(&frame, time_us, bytes).expect("shown");
    };
    let whole = frame.pixels.len() + 24;
    wait_for(CameraSays::Late, &mut |_, _| ());
    wait_for(CameraSays::Frame, &mut |running, _| show(running, whole));
    wait_for(CameraSays::Torn, &mut |running, _| show(running, whole - 4));
    wait_for(CameraSays::Frame, &mut |running, _| show(running, whole));
    wait_for(CameraSays::Short, &mut |running, camera| {
        let file = fs::OpenOptions::new()
            .write(true)
            .open(camera)
            .expect("opens");
        file.set_len(1000).expect("cut");
        show(running, 1000);
    });
    wait_for(CameraSays::Frame, &mut |running, _| show(running, whole));
    wait_for(CameraSays::Absent, &mut |_, camera| {
        fs::write(camera, []).expect("emptied");
    });
    // Lost: tried once per second, and said nothing of.
    thread::sleep(Duration::from_secs(3));
    wait_for(CameraSays::Frame, &mut |running, _| {
        show(running, whole);
    });
}

#[test]
fn every_crash_is_kept_over_the_reset_and_reported() {
    if !board::is_there() {
        return;
    }
    let firmware = board::firmware("navigator").expect("builds");
    let buffer = tables::report(&Progress::Hidden).expect("trains");
    let board = Board::with_atlas(&firmware, &buffer).expect("fits");
    let (autopilot, address) = Autopilot::start(0.0);
    let mut running = board
        .start_with_autopilot(&address, |_| ())
        .expect("starts");
    for (resets, what) in (1..).zip([
        Provocation::HardFault,
        Provocation::StackOverflow,
        Provocation::Hang,
        Provocation::Panic,
    ]) {
        running.link().send(&Request::Provoke(what)).expect("sent");
        // It comes back by itself.
        thread::sleep(Duration::from_millis(if what == Provocation::Hang {
            4000
        } else {
            500
        }));
        running.send(&[0]).expect("sent");
        let found = faults(&mut running);
        println!("{what:?}: {found:?}");
        assert_eq!(
            (found.resets, found.cause),
            (resets, Cause::Software),
            "{what:?}"
        );
        let is_in_flash = |pc: u32| (0x0800_0000..0x0804_0000).contains(&pc);
        match (what, found.crash) {
            (Provocation::HardFault, Some(Crash::HardFault { pc, address, .. })) => {
                assert!(is_in_flash(pc) && address == 0x6000_0000);
            }
            (Provocation::StackOverflow, Some(Crash::StackOverflow { .. })) => {}
            (Provocation::Hang, Some(Crash::Hang { pc, .. })) => assert!(is_in_flash(pc)),
            (Provocation::Panic, Some(Crash::Panic { line })) => assert!(line > 0),
            other => panic!("{other:?}"),
        }
        // And flies on.
        assert!(atlas_of(&mut running).is_some());
    }
    thread::sleep(Duration::from_millis(2500));
    let forgotten = running.ask(&Request::ForgetFaults).expect("answers");
    assert!(matches!(forgotten, Reply::Faults(faults) if faults.resets == 4));
    assert_eq!(faults(&mut running).crash, None);
    running.cut();
    let heard = autopilot.end();
    let texts = heard["texts"].as_array().expect("texts");
    for words in ["hard fault", "stack overflow", "no progress", "panic"] {
        let said = format!("crashed before: {words}");
        assert!(texts.iter().any(|text| *text == *said), "{said}: {texts:?}");
    }
}

#[test]
fn two_corrupt_slots_are_reported_and_an_atlas_can_be_uploaded_all_the_same() {
    if !board::is_there() {
        return;
    }
    let firmware = board::firmware("navigator").expect("builds");
    let buffer = tables::report(&Progress::Hidden).expect("trains");
    let board = Board::with_atlas(&firmware, &buffer).expect("fits");
    board.flash_atlas(1, &buffer).expect("fits");
    let slot_len = board.slot_len();
    board
        .change_flash(|flash| {
            flash[300] ^= 1;
            flash[slot_len + 300] ^= 1;
        })
        .expect("writable");
    let (autopilot, address) = Autopilot::start(0.0);
    let mut running = board
        .start_with_autopilot(&address, |_| ())
        .expect("starts");
    assert_eq!(atlas_of(&mut running), None);
    let Reply::Slots(slots) = running.ask(&Request::Slots).expect("answers") else {
        panic!("no slots")
    };
    assert!(
        slots
            .iter()
            .all(|slot| slot.atlas.is_err() && !slot.is_flown)
    );
    // A frame is refused, with the reason; the autopilot hears it, too.
    let frame = CameraFrame {
        pixels: vec![9; 64 * 64],
        width: 64,
        height: 64,
    };
    let reply = running.locate(1, &frame).expect("answers");
    let reason = Rejection::NoAtlas;
    assert_eq!(
        reply,
        Reply::Rejected {
            sequence: Some(1),
            reason
        }
    );
    thread::sleep(Duration::from_millis(2500));
    running.show(&frame, 1).expect("shown");
    thread::sleep(Duration::from_millis(1500));
    let uploaded = upload(running.link(), &buffer, &setup(), &Progress::Hidden).expect("uploaded");
    assert_eq!(Slot::BOTH[uploaded.slot], Slot::A);
    running.cut();
    let heard = autopilot.end();
    let texts = heard["texts"].as_array().expect("texts");
    assert!(
        texts
            .iter()
            .any(|text| text == "no valid atlas in any slot"),
        "{texts:?}"
    );
    assert_eq!(heard["errors"], 0);
    let mut running = board.start(|_| ()).expect("starts");
    assert_eq!(
        atlas_of(&mut running),
        Some(AtlasIdentity::of(&buffer.atlas()))
    );
}
