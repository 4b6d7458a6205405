use std::{cell::RefCell, rc::Rc, vec, vec::Vec};

use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use proptest::prelude::*;

use super::{
    simulated::{Capture, Event, Mega, Wires},
    *,
};
use crate::camera::{Limits, Supervised};

const ENCODINGS: [Encoding; 3] = [Encoding::Yuv, Encoding::Rgb565, Encoding::Rgb565LowFirst];
const RESOLUTIONS: [Resolution; 3] = [
    Resolution::Square96,
    Resolution::Square128,
    Resolution::Qvga,
];

/// Calls that are more than enough for a set-up and a frame of 320×240.
const CALLS: usize = 300;

fn bracket(operations: impl IntoIterator<Item = Transaction<u8>>) -> Vec<Transaction<u8>> {
    let mut transactions = vec![Transaction::transaction_start()];
    transactions.extend(operations);
    transactions.push(Transaction::transaction_end());
    transactions
}

fn writes(register: u8, value: u8) -> Vec<Transaction<u8>> {
    bracket([Transaction::write_vec(vec![register | 0x80, value])])
}

fn reads(register: u8, value: u8) -> Vec<Transaction<u8>> {
    let (sent, received) = (vec![register, 0, 0], vec![0xAA, 0xAA, value]);
    bracket([Transaction::transfer_in_place(sent, received)])
}

fn reads_on(command: &[u8], bytes: &[u8]) -> Vec<Transaction<u8>> {
    bracket([
        Transaction::write_vec(command.to_vec()),
        Transaction::read_vec(bytes.to_vec()),
    ])
}

/// Set up for YUV of 96×96, and told to capture.
fn set_up() -> Vec<Transaction<u8>> {
    [
        // `begin`
        reads(0x40, 0x83),
        writes(0x07, 0x40),
        // `take`: still resetting, then not
        reads(0x44, 0x01),
        reads(0x44, 0x02),
        writes(0x20, 3),
        // still taking the format, then not
        reads(0x44, 0x03),
        reads(0x44, 0x02),
        writes(0x21, 10),
        reads(0x44, 0x02),
        writes(0x04, 1),
        writes(0x04, 2),
    ]
    .concat()
}

fn length(len: u32) -> Vec<Transaction<u8>> {
    let [low, middle, high, _] = len.to_le_bytes();
    [reads(0x45, low), reads(0x46, middle), reads(0x47, high)].concat()
}

fn camera_on(transactions: &[Transaction<u8>]) -> (Mock<u8>, ArducamMega<Mock<u8>>) {
    let spi = Mock::new(transactions);
    let camera = ArducamMega::new(spi.clone(), Encoding::Yuv, Resolution::Square96);
    (spi, camera)
}

/// Takes until there is a frame or an error.
fn take<S: SpiDevice>(
    camera: &mut ArducamMega<S>,
    pixels: &mut [u8],
) -> Result<FrameSize, CameraError> {
    (0..CALLS)
        .find_map(|_| camera.take(pixels).transpose())
        .expect("a frame or an error")
}

fn simulated(
    encoding: Encoding,
    resolution: Resolution,
) -> (Rc<RefCell<Mega>>, ArducamMega<Wires>, Vec<u8>) {
    let (mega, wires) = Mega::new();
    let camera = ArducamMega::new(wires, encoding, resolution);
    (mega, camera, vec![0; resolution.size().len()])
}

#[test]
fn a_frame_is_these_transactions() {
    let frame: Vec<u8> = (0..18_432).map(|i| (i % 253) as u8).collect();
    let mut transactions = [
        set_up(),
        reads(0x44, 0x02),
        reads(0x44, 0x06),
        length(18_432),
    ]
    .concat();
    for (i, piece) in frame.chunks(64).enumerate() {
        let command: &[u8] = if i == 0 { &[0x3C, 0] } else { &[0x3C] };
        transactions.extend(reads_on(command, piece));
    }
    transactions.extend([reads(0x44, 0x06), reads(0x40, 0x83)].concat());
    // The next one: no set-up.
    transactions.extend([writes(0x04, 1), writes(0x04, 2), reads(0x44, 0x02)].concat());

    let (mut spi, mut camera) = camera_on(&transactions);
    let mut pixels = vec![0; 96 * 96 + 1];
    camera.begin().expect("present");
    let size = take(&mut camera, &mut pixels).expect("a frame");
    assert_eq!((size.width(), size.height()), (96, 96));
    let luminance: Vec<u8> = frame.iter().copied().step_by(2).collect();
    assert_eq!(pixels[..96 * 96], luminance[..]);
    assert_eq!(pixels[96 * 96], 0, "more was written than a frame");

    assert_eq!(
        camera.take(&mut pixels),
        Ok(None),
        "none without being asked"
    );
    camera.begin().expect("present");
    assert_eq!(camera.take(&mut pixels), Ok(None));
    spi.done();
}

#[test]
fn a_frame_is_read_in_portions() {
    let (mega, mut camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square128);
    camera.begin().expect("present");
    let mut before = mega.borrow().transactions;
    while camera.take(&mut pixels).expect("no error").is_none() {
        let now = mega.borrow().transactions;
        assert!(now - before <= PORTION_PIECES as u64);
        before = now;
    }
    assert_eq!(pixels, mega.borrow().luminance());
}

#[test]
fn lengths_that_are_not_a_frame_s_are_told() {
    for (found, error) in [
        (0, CameraError::Absent),
        (0xFF_FFFF, CameraError::Absent),
        (
            1,
            CameraError::Short {
                expected: 18_432,
                found: 1,
            },
        ),
        (
            18_431,
            CameraError::Short {
                expected: 18_432,
                found: 18_431,
            },
        ),
        (18_433, CameraError::Torn),
        (0xFF_FFFE, CameraError::Torn),
    ] {
        let transactions = [set_up(), reads(0x44, 0x06), length(found)].concat();
        let (mut spi, mut camera) = camera_on(&transactions);
        camera.begin().expect("present");
        let mut pixels = vec![0; 96 * 96];
        assert_eq!(take(&mut camera, &mut pixels), Err(error), "{found}");
        assert_eq!(camera.take(&mut pixels), Ok(None), "the frame is gone");
        spi.done();
    }
}

#[test]
fn what_is_no_mega_is_absent() {
    for sensor in [0x00, 0xFF, 0x80, 0x85, 0x01] {
        let (mut spi, mut camera) = camera_on(&[reads(0x40, sensor), reads(0x40, sensor)].concat());
        assert_eq!(camera.begin(), Err(CameraError::Absent));
        assert_eq!(camera.take(&mut []), Ok(None));
        assert_eq!(camera.begin(), Err(CameraError::Absent));
        spi.done();
    }
    for sensor in 0x81..=0x84 {
        let (mega, mut camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square96);
        mega.borrow_mut().sensor = sensor;
        camera.begin().expect("present");
        take(&mut camera, &mut pixels).expect("a frame");
    }
}

#[test]
fn every_format_and_size_arrives_as_luminance() {
    for encoding in ENCODINGS {
        for resolution in RESOLUTIONS {
            let (mega, mut camera, mut pixels) = simulated(encoding, resolution);
            for _ in 0..2 {
                camera.begin().expect("present");
                assert_eq!(take(&mut camera, &mut pixels), Ok(resolution.size()));
                let expected: Vec<u8> = mega
                    .borrow()
                    .captured
                    .chunks_exact(2)
                    .map(|pair| encoding.pixel_format().luminance([pair[0], pair[1]]))
                    .collect();
                assert_eq!(pixels, expected, "{encoding:?} {resolution:?}");
            }
        }
    }
}

#[test]
fn a_buffer_without_room_is_told_and_the_next_frame_comes() {
    let (mega, mut camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square96);
    camera.begin().expect("present");
    let room = CameraError::Room {
        needed: 9_216,
        have: 9_215,
    };
    assert_eq!(take(&mut camera, &mut pixels[1..]), Err(room));
    camera.begin().expect("present");
    take(&mut camera, &mut pixels).expect("a frame");
    assert_eq!(pixels, mega.borrow().luminance());
}

#[test]
fn a_frame_that_is_asked_for_again_is_captured_again() {
    let (mega, mut camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square96);
    camera.begin().expect("present");
    // In the middle of the first.
    while pixels.iter().all(|&pixel| pixel == 0) {
        assert_eq!(camera.take(&mut pixels), Ok(None));
    }
    let first = mega.borrow().luminance();
    camera.begin().expect("present");
    take(&mut camera, &mut pixels).expect("a frame");
    assert_eq!(pixels, mega.borrow().luminance());
    assert_ne!(pixels, first);
}

#[test]
fn a_bus_that_fails_anywhere_is_told_and_the_next_frame_comes() {
    let (mega, mut camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square96);
    camera.begin().expect("present");
    take(&mut camera, &mut pixels).expect("a frame");
    let transactions = mega.borrow().transactions;
    for at in 1..=transactions {
        let (mega, mut camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square96);
        mega.borrow_mut().events.push_back((at, Event::BusError));
        let told = camera
            .begin()
            .and_then(|()| take(&mut camera, &mut pixels).map(|_| ()));
        // At the very last transaction it is not known whether the frame was whole.
        let error = if at == transactions {
            CameraError::Torn
        } else {
            CameraError::Bus
        };
        assert_eq!(told, Err(error), "at {at}");
        let before = mega.borrow().transactions;
        assert_eq!(camera.take(&mut pixels), Ok(None), "the frame is gone");
        assert_eq!(mega.borrow().transactions, before);
        camera.begin().expect("present");
        take(&mut camera, &mut pixels).expect("a frame");
        assert_eq!(pixels, mega.borrow().luminance());
    }
}

#[test]
fn a_camera_that_loses_power_anywhere_gives_no_frame_in_part() {
    for event in [Event::Blip, Event::Unplug] {
        for at in 1..330 {
            for floating in [0x00, 0xFF] {
                let (mega, mut camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square96);
                mega.borrow_mut().events.push_back((at, event));
                mega.borrow_mut().floating = floating;
                let told = camera.begin().and_then(|()| {
                    let end = (0..CALLS).find_map(|_| camera.take(&mut pixels).transpose());
                    end.unwrap_or(Err(CameraError::Late))
                });
                if told.is_ok() {
                    assert_eq!(
                        pixels,
                        mega.borrow().luminance(),
                        "{event:?} at {at}, {floating}"
                    );
                }
                mega.borrow_mut().events.clear();
                mega.borrow_mut().happen(Event::Plug);
                camera.recover();
                camera.begin().expect("present");
                take(&mut camera, &mut pixels).expect("a frame");
                assert_eq!(pixels, mega.borrow().luminance());
            }
        }
    }
}

#[test]
fn a_camera_that_was_replaced_is_set_up_again() {
    // While it captures, and while it is read.
    for (at, event, error) in [
        (15, Event::Unplug, CameraError::Absent),
        (100, Event::Blip, CameraError::Torn),
        (100, Event::Unplug, CameraError::Torn),
    ] {
        let (mega, mut camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square96);
        mega.borrow_mut().events.push_back((at, event));
        camera.begin().expect("present");
        assert_eq!(take(&mut camera, &mut pixels), Err(error));
        mega.borrow_mut().happen(Event::Plug);
        camera.begin().expect("present");
        take(&mut camera, &mut pixels).expect("a frame");
        assert_eq!(pixels, mega.borrow().luminance());
    }
}

#[test]
fn a_camera_that_is_unplugged_is_lost_and_comes_back() {
    let (mega, camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square96);
    let mut camera = Supervised::new(camera, Limits::DEFAULT);
    let mut told = vec![];
    for now_ms in 0..10_000 {
        match now_ms {
            3_000 => mega.borrow_mut().happen(Event::Unplug),
            7_000 => mega.borrow_mut().happen(Event::Plug),
            _ => {}
        }
        if let Some(result) = camera.poll(now_ms * 1_000, &mut pixels) {
            told.push((now_ms, result.is_ok(), camera.is_lost()));
            if result.is_ok() {
                assert_eq!(pixels, mega.borrow().luminance());
            }
        }
    }
    let lost: Vec<_> = told.iter().filter(|(_, _, is_lost)| *is_lost).collect();
    assert_eq!(lost.len(), 1, "the loss is told once");
    assert!((3_400..=3_900).contains(&lost[0].0), "lost at {lost:?}");
    assert_eq!(camera.losses(), 1);
    let back = told
        .iter()
        .find(|(now_ms, is_ok, _)| *now_ms > 7_000 && *is_ok);
    assert!(
        back.is_some_and(|(now_ms, _, _)| *now_ms < 8_200),
        "back at {back:?}"
    );
    assert!(told.len() > 100);
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        Just(Event::Unplug),
        Just(Event::Plug),
        Just(Event::Blip),
        Just(Event::BusError)
    ]
}

fn capture() -> impl Strategy<Value = Capture> {
    prop_oneof![
        (1_usize..20_000).prop_map(Capture::Short),
        (1_usize..20_000).prop_map(Capture::Long),
        Just(Capture::Empty),
        Just(Capture::Never),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn a_camera_that_misbehaves_gives_whole_frames_or_none_and_is_back_in_the_end(
        events in proptest::collection::vec((0_u64..2_000, event()), 0..30),
        captures in proptest::collection::vec(capture(), 0..20),
        floating in prop_oneof![Just(0x00), Just(0xFF), any::<u8>()],
        busy in (0_u32..20, 0_u32..30),
        step_us in 200_u64..5_000, start_us in prop_oneof![Just(0), Just(u64::MAX - 1_000_000)],
    ) {
        let (mega, camera, mut pixels) = simulated(Encoding::Yuv, Resolution::Square96);
        let mut camera = Supervised::new(camera, Limits::DEFAULT);
        {
            let mut mega = mega.borrow_mut();
            let mut events = events;
            events.sort_by_key(|&(at, _)| at);
            mega.events = events.into();
            mega.captures = captures.into();
            mega.floating = floating;
            (mega.busy_after_setting, mega.busy_after_capture) = busy;
        }
        let mut now_us = start_us;
        let (mut losses, mut was_lost) = (0, false);
        for step in 0..6_000 {
            if step == 4_000 {
                // From here on all is well.
                let mut mega = mega.borrow_mut();
                mega.events.clear();
                mega.captures.clear();
                mega.happen(Event::Plug);
            }
            match camera.poll(now_us, &mut pixels) {
                Some(Ok(size)) => {
                    prop_assert_eq!(size.len(), pixels.len());
                    prop_assert_eq!(&pixels, &mega.borrow().luminance());
                    prop_assert!(!camera.is_lost());
                }
                Some(Err(error)) => {
                    prop_assert!(!was_lost, "told while lost");
                    prop_assert_eq!(camera.error(), Some(error));
                }
                None => {}
            }
            if camera.is_lost() && !was_lost {
                losses += 1;
            }
            was_lost = camera.is_lost();
            prop_assert_eq!(camera.losses(), losses);
            now_us = now_us.wrapping_add(step_us);
        }
        // Four tries at least, at the slowest: the first may be in the middle of a set-up.
        for _ in 0..30_000 {
            if let Some(Ok(_)) = camera.poll(now_us, &mut pixels) {
                return Ok(());
            }
            now_us = now_us.wrapping_add(step_us);
        }
        prop_assert!(false, "no frame came any more");
    }
}
