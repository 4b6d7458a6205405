//! All that flies, on a board that is not there.

use std::{boxed::Box, vec, vec::Vec};

use eigenmark_core::{
    atlas::sample,
    frame::{Frame, FrameError},
    link::{AtlasIdentity, Cause, Goals, Provocation, Upload},
    localizer::Localizer,
    slots::{Slot, SlotError},
};

use super::*;
use crate::{simulated::Simulation, storm};

/// An atlas of a few places in a row, as bytes.
fn atlas_bytes() -> Vec<u8> {
    let words = sample::row();
    let atlas = Atlas::parse(bytemuck::cast_slice(&words)).expect("valid");
    bytemuck::cast_slice(&words)[..atlas.total_len() as usize].to_vec()
}

fn with_atlas() -> Simulation {
    let mut flash = Simulation::flash();
    flash.put(0, &atlas_bytes());
    Simulation::start(flash, Cause::PowerOn)
}

/// A frame of four squares in these grays.
fn frame(grays: [u8; 4]) -> (u16, u16, Vec<u8>) {
    let gray = |at: usize| grays[at / 32 / 16 * 2 + at % 32 / 16];
    (32, 32, (0..32 * 32).map(gray).collect())
}

fn upload(board: &mut Simulation, bytes: &[u8], crc: u32) -> Vec<Reply> {
    let begin = Upload::Begin {
        len: bytes.len() as u32,
        crc,
        setup: Setup::default(),
    };
    let replies = board.ask(&Request::Upload(begin));
    assert_eq!(replies, [Reply::Upload { next: 0 }]);
    for (bytes, offset) in bytes.chunks(100).zip((0..).step_by(100)) {
        let next = offset + bytes.len() as u32;
        let replies = board.ask(&Request::Upload(Upload::Chunk { offset, bytes }));
        assert_eq!(replies, [Reply::Upload { next }]);
    }
    board.ask(&Request::Upload(Upload::Finish))
}

#[test]
fn an_empty_board_takes_an_atlas_and_flies_by_it_after_the_next_start() {
    let mut board = Simulation::start(Simulation::flash(), Cause::PowerOn);
    let [Reply::Identity(identity)] = board.ask(&Request::Identify)[..] else {
        panic!("no identity")
    };
    assert_eq!(identity.atlas, None);
    let (width, height, pixels) = frame([10, 20, 30, 40]);
    let rejected = |reason| Reply::Rejected {
        sequence: Some(1),
        reason,
    };
    assert_eq!(
        board.locate(1, width, height, &pixels),
        [rejected(Rejection::NoAtlas)]
    );

    let bytes = atlas_bytes();
    let crc = u32::from_le_bytes(bytes[12..16].try_into().expect("four"));
    let replies = upload(&mut board, &bytes, crc);
    let [Reply::Slots([a, b])] = &replies[..] else {
        panic!("{replies:?}")
    };
    assert_eq!((a.sequence, a.is_flown), (Some(1), false));
    assert_eq!(a.atlas.map(|atlas| atlas.crc), Ok(crc));
    assert_eq!(b.atlas, Err(SlotError::Empty));
    // Before the next start another one does not take the place of the first.
    let replies = upload(&mut board, &bytes, crc);
    assert!(
        matches!(&replies[..], [Reply::Slots([a, b])] if a.sequence == Some(1) && b.sequence == Some(2)),
        "{replies:?}"
    );
    assert_eq!(board.ask(&Request::Restart), [Reply::Done]);
    assert_eq!(board.clock.with(|clock| clock.restarts), 1);

    let mut board = Simulation::start(board.flight.parts.flash.clone(), Cause::Software);
    let replies = board.ask(&Request::Identify);
    let atlas = board.flight.atlas().map(AtlasIdentity::of);
    assert!(
        matches!(&replies[..], [Reply::Identity(identity)] if identity.atlas == atlas && atlas.is_some())
    );
    // It flies by the newer one; the next one goes to the other slot.
    let replies = upload(&mut board, &bytes, crc);
    assert!(matches!(&replies[..], [Reply::Slots([a, _])] if a.sequence == Some(3)));
}

#[test]
fn an_upload_that_is_none_leaves_the_atlas_that_is_flown_by() {
    let mut board = with_atlas();
    let mut bytes = atlas_bytes();
    let crc = u32::from_le_bytes(bytes[12..16].try_into().expect("four"));
    bytes[200] ^= 1;
    let replies = upload(&mut board, &bytes, crc);
    let reason = |reply: &Reply| match reply {
        Reply::Rejected { reason, .. } => Some(*reason),
        _ => None,
    };
    assert!(
        matches!(
            reason(&replies[0]),
            Some(Rejection::Slot(SlotError::Atlas(_)))
        ),
        "{replies:?}"
    );
    let board = Simulation::start(board.flight.parts.flash.clone(), Cause::PowerOn);
    assert_eq!(board.flight.atlas().map(Atlas::crc), Some(crc));
}

#[test]
fn worn_flash_is_reported() {
    let mut flash = Simulation::flash();
    flash.put(0, &atlas_bytes());
    flash.put(2048, &[0; 100]);
    flash.wear(2048);
    let mut board = Simulation::start(flash, Cause::PowerOn);
    let begin = Upload::Begin {
        len: 500,
        crc: 0,
        setup: Setup::default(),
    };
    let worn = Rejection::Slot(SlotError::Worn { offset: 2048 });
    let expected = Reply::Rejected {
        sequence: None,
        reason: worn,
    };
    assert_eq!(board.ask(&Request::Upload(begin)), [expected]);
    let replies = board.ask(&Request::Faults);
    assert!(matches!(&replies[..], [Reply::Faults(faults)] if faults.worn_pages == 1));
    assert!(said(&board).contains("a flash page is worn"));
    let replies = board.ask(&Request::ForgetFaults);
    assert!(matches!(&replies[..], [Reply::Faults(faults)] if faults.worn_pages == 1));
    assert_eq!(
        board.ask(&Request::Faults),
        [Reply::Faults(eigenmark_core::link::Faults::default())]
    );
}

/// Everything that went to the autopilot, as text.
fn said(board: &Simulation) -> std::string::String {
    board
        .autopilot
        .with(|wire| std::string::String::from_utf8_lossy(&wire.from_board).into_owned())
}

#[test]
fn a_frame_over_the_link_is_answered_as_a_localizer_does() {
    let mut board = with_atlas();
    let words = sample::row();
    let atlas = Atlas::parse(bytemuck::cast_slice(&words)).expect("valid");
    let mut localizer = Localizer::new(atlas);
    for sequence in 0..20 {
        let (width, height, pixels) = frame([10, 20, 30, 40].map(|gray| gray + sequence as u8 * 9));
        let frame = Frame::new(&pixels, width, height, width.into()).expect("a frame");
        let fix = localizer.locate(&frame);
        let replies = board.locate(sequence, width, height, &pixels);
        assert_eq!(replies, [Reply::Fix { sequence, fix }]);
    }
    // Parts that are missing, or too many.
    let (width, height, pixels) = frame([1, 2, 3, 4]);
    let rejected = |sequence, reason| Reply::Rejected { sequence, reason };
    board.send(&Request::Frame {
        sequence: 7,
        width,
        height,
    });
    let gap = board.ask(&Request::Pixels {
        offset: 512,
        bytes: &pixels[512..],
    });
    assert_eq!(gap, [rejected(Some(7), Rejection::Gap { expected: 0 })]);
    let replies = board.locate(8, width, height, &pixels);
    assert!(matches!(replies[..], [Reply::Fix { sequence: 8, .. }]));
    let replies = board.ask(&Request::Pixels {
        offset: 0,
        bytes: &pixels[..1],
    });
    assert_eq!(replies, [rejected(None, Rejection::Gap { expected: 0 })]);
    // Sides that no frame has, or that there is no room for.
    for (width, height, reason) in [
        (
            1,
            1,
            Rejection::Frame(FrameError::Size {
                width: 1,
                height: 1,
            }),
        ),
        (320, 240, Rejection::TooLarge { room: 19_200 }),
    ] {
        let sequence = 9;
        let request = Request::Frame {
            sequence,
            width,
            height,
        };
        assert_eq!(board.ask(&request), [rejected(Some(9), reason)]);
    }
}

fn reports(replies: Vec<Reply>) -> Vec<Report> {
    let report = |reply| match reply {
        Reply::Report(report) => Some(report),
        _ => None,
    };
    replies.into_iter().filter_map(report).collect()
}

#[test]
fn frames_of_the_camera_are_reported_and_a_camera_that_is_lost_is_too() {
    let mut board = with_atlas();
    let watch = Request::Watch {
        every: 1,
        pictures: 0,
    };
    assert_eq!(board.ask(&watch), [Reply::Done]);
    for number in 0..5 {
        board
            .camera
            .with(|camera| camera.next = Some(Ok(frame([10, 20, 30, 40]))));
        board.run(33);
        let reports = reports(board.replies());
        let [report] = &reports[..] else {
            panic!("{reports:?}")
        };
        assert_eq!(
            (report.sequence, report.camera),
            (number, CameraSays::Frame)
        );
        assert!(report.estimate.is_some());
    }
    // Unplugged: told once, and everything else goes on.
    board.camera.with(|camera| camera.is_unplugged = true);
    board.run(3000);
    let lost = reports(board.replies());
    assert!(
        lost.iter().all(|report| report.camera == CameraSays::Absent
            && report.refusal == Some(Refusal::NoFrame))
    );
    assert!((1..10).contains(&lost.len()), "{}", lost.len());
    assert!(said(&board).contains("camera lost"));
    let replies = board.ask(&Request::Faults);
    assert!(
        matches!(&replies[..], [Reply::Faults(faults)] if faults.camera_losses == 1),
        "{replies:?}"
    );
    // Plugged in again.
    board.camera.with(|camera| {
        camera.is_unplugged = false;
        camera.next = Some(Ok(frame([10, 20, 30, 40])));
    });
    board.run(2000);
    assert!(
        reports(board.replies())
            .iter()
            .any(|report| report.camera == CameraSays::Frame)
    );
}

#[test]
fn a_picture_comes_with_its_report() {
    let mut board = with_atlas();
    let watch = Request::Watch {
        every: 2,
        pictures: 2,
    };
    board.ask(&watch);
    let shown = frame([10, 20, 30, 40]);
    let (mut pixels, mut told) = (Vec::new(), 0);
    for _ in 0..8 {
        board
            .camera
            .with(|camera| camera.next = Some(Ok(shown.clone())));
        board.run(33);
        for reply in board.replies() {
            match reply {
                Reply::Report(_) => told += 1,
                Reply::Picture { offset, bytes, .. } => {
                    assert_eq!(offset as usize, pixels.len() % shown.2.len());
                    pixels.extend_from_slice(&bytes);
                }
                other => panic!("{other:?}"),
            }
        }
    }
    assert_eq!(told, 4);
    assert_eq!(pixels, [shown.2.clone(), shown.2].concat());
}

#[test]
fn goals_are_planned_to_or_refused() {
    let mut board = with_atlas();
    let go = |goals: &[u16]| Request::Go(Goals::from_slice(goals).expect("fits"));
    assert_eq!(board.ask(&go(&[2, 0])), [Reply::Done]);
    let replies = board.ask(&go(&[99]));
    assert!(
        matches!(
            &replies[..],
            [Reply::Rejected {
                reason: Rejection::Route(_),
                ..
            }]
        ),
        "{replies:?}"
    );
}

#[test]
fn nothing_is_provoked_in_flight() {
    let mut board = with_atlas();
    let refused = Reply::Rejected {
        sequence: None,
        reason: Rejection::Refused,
    };
    assert_eq!(board.ask(&Request::Provoke(Provocation::Hang)), [refused]);
}

#[test]
fn a_storm_is_noted_and_passes() {
    let mut board = with_atlas();
    board
        .host
        .with(|wire| wire.to_board.extend(vec![[7_u8, 0]; 5000].concat()));
    board.run(300);
    assert!(said(&board).contains("host link floods"));
    board.run(1500);
    let replies = board.ask(&Request::Faults);
    let Some(Reply::Faults(faults)) = replies.last() else {
        panic!("{replies:?}")
    };
    assert!(faults.link_storms >= 1);
}

#[test]
fn faults_before_the_start_are_told_to_the_autopilot() {
    let mut board = Simulation::start(Simulation::flash(), Cause::BrownOut);
    board.run(1500);
    assert!(said(&board).contains("reset: power was low"));
    let board = Simulation::start(Simulation::flash(), Cause::PowerOn);
    assert!(!said(&board).contains("reset"));
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config::with_cases(40))]

    #[test]
    fn arbitrary_bytes_on_both_wires_stop_nothing(
        host in proptest::collection::vec(proptest::arbitrary::any::<u8>(), 0..3000),
        autopilot in proptest::collection::vec(proptest::arbitrary::any::<u8>(), 0..3000),
    ) {
        let mut board = with_atlas();
        board.host.with(|wire| wire.to_board.extend(&host));
        board.autopilot.with(|wire| wire.to_board.extend(&autopilot));
        board.run(50);
        // A zero ends what is left of a packet; a storm passes.
        board.host.with(|wire| wire.to_board.extend(&[0]));
        board.run(1 + storm::IGNORED_US as u32 / 1000);
        let replies = board.ask(&Request::Identify);
        proptest::prop_assert!(matches!(replies.last(), Some(Reply::Identity(_))), "{replies:?}");
        let fed = board.clock.with(|clock| clock.fed);
        proptest::prop_assert!(fed > 1000);
    }
}

#[test]
fn slots_are_told() {
    let mut board = with_atlas();
    let replies = board.ask(&Request::Slots);
    let [Reply::Slots([a, b])] = &replies[..] else {
        panic!("{replies:?}")
    };
    assert!(a.is_flown && a.sequence.is_none() && a.atlas.is_ok());
    assert!(!b.is_flown && b.atlas == Err(SlotError::Empty));
    assert_eq!(board.flight.target.map(|target| target.slot()), Ok(Slot::B));
    drop(Box::new(board));
}
