//! What an upload answers, step by step.

use super::*;
use crate::atlas::{AtlasError, checksum};

const FLOWN: Slot = Slot::A;

fn board<const W: usize>() -> Board<W> {
    Board::new([Content::Recorded(1, 5), Content::Recorded(2, 4)])
}

/// A board that still flies by what it flew by.
fn assert_flown<const W: usize>(board: &Board<W>) {
    assert_eq!(board.chosen(), Some((FLOWN, crc_of(&atlas(1)))));
    assert_eq!(board.slot(FLOWN), Content::Recorded(1, 5).bytes());
}

fn parts_of_every_length<const W: usize>() {
    for new in [atlas(1), atlas(4), longest()] {
        for len in (1..=70).chain([127, 128, 129, 511, 512]) {
            let mut board = board::<W>();
            board.begin(Some(FLOWN), &new).expect("power");
            board.chunks(&new, len).expect("in order");
            assert_eq!(board.finish(Slot::B), Ok(record_of(&new, 6)));
            assert_eq!(&board.slot(Slot::B)[..new.len()], new);
            assert_eq!(board.chosen(), Some((Slot::B, crc_of(&new))));
        }
    }
}

#[test]
fn parts_may_have_any_length() {
    parts_of_every_length::<1>();
    parts_of_every_length::<2>();
    parts_of_every_length::<4>();
    parts_of_every_length::<8>();
    parts_of_every_length::<16>();
    parts_of_every_length::<32>();
}

#[test]
fn pages_that_are_not_needed_are_not_erased() {
    let new = atlas(1);
    let pages = new.len().div_ceil(PAGE_LEN);
    assert!(pages < SLOT_LEN / PAGE_LEN - 1);
    let mut board = board::<8>();
    board.flash.put(start(Slot::B), &[0; SLOT_LEN]);
    let target = board.region().target(Some(FLOWN)).expect("not covered");
    let begun = board
        .writer
        .begin(target, new.len() as u32, crc_of(&new), SETUP);
    assert_eq!(begun, Ok(Progress::Erasing));
    for page in 0..pages {
        assert_eq!(board.writer.step(&mut board.flash), Ok(Progress::Erasing));
        assert_eq!(
            board.slot(Slot::B)[page * PAGE_LEN..][..PAGE_LEN],
            [0xff; PAGE_LEN]
        );
        assert_eq!(board.slot(Slot::B)[(page + 1) * PAGE_LEN], 0);
    }
    let ready = Progress::Writing { next: 0 };
    assert_eq!(board.writer.step(&mut board.flash), Ok(ready));
    assert_eq!(board.writer.step(&mut board.flash), Ok(ready));
    let record_page = SLOT_LEN - PAGE_LEN;
    assert_eq!(board.slot(Slot::B)[record_page - 1], 0);
    assert_eq!(board.slot(Slot::B)[record_page], 0xff);
}

#[test]
fn lost_answers_repeated_parts_and_gaps_do_no_harm() {
    let new = atlas(4);
    let mut board = board::<32>();
    board.begin(Some(FLOWN), &new).expect("power");
    assert_eq!(board.chunk(&new, 1, 8), Err(SlotError::Gap { expected: 0 }));
    assert_eq!(board.chunk(&new, 0, 50), Ok(50));
    let steps = board.flash.steps();
    assert_eq!(board.chunk(&new, 0, 50), Ok(50), "again");
    assert_eq!(board.chunk(&new, 10, 40), Ok(50), "a part of it again");
    assert_eq!(board.chunk(&new, 50, 0), Ok(50), "nothing");
    let gap = Err(SlotError::Gap { expected: 50 });
    assert_eq!(board.chunk(&new, 49, 2), gap, "partly again");
    assert_eq!(board.chunk(&new, 51, 2), gap, "one too far");
    let (end, room) = (new.len() as u32 + 2, new.len() as u32);
    let beyond = board.writer.chunk(&mut board.flash, end - 12, &[0; 12]);
    assert_eq!(beyond, Err(SlotError::Length { len: end, room }));
    let beyond = board.writer.chunk(&mut board.flash, u32::MAX, &[0; 12]);
    let len = u32::MAX;
    assert_eq!(beyond, Err(SlotError::Length { len, room }));
    assert_eq!(board.finish(Slot::B), Err(SlotError::Gap { expected: 50 }));
    assert_eq!(board.flash.steps(), steps, "nothing of it was written");
    assert_eq!(board.writer.progress(), Ok(Progress::Writing { next: 50 }));

    for from in (50..new.len()).step_by(20) {
        let next = board.chunk(&new, from, 20);
        assert_eq!(board.chunk(&new, from, 20), next);
    }
    let record = board.finish(Slot::B);
    assert_eq!(record, Ok(record_of(&new, 6)));
    let steps = board.flash.steps();
    assert_eq!(board.finish(Slot::B), record, "its answer was lost");
    assert_eq!(board.flash.steps(), steps);
}

#[test]
fn an_upload_that_was_interrupted_goes_on_and_another_starts_over() {
    let (new, other) = (atlas(4), atlas(5));
    let mut board = board::<8>();
    let target = board.begin(Some(FLOWN), &new).expect("power");
    board.chunk(&new, 0, 100).expect("power");
    let (len, crc) = (new.len() as u32, crc_of(&new));
    let next = Ok(Progress::Writing { next: 100 });
    assert_eq!(board.writer.begin(target, len, crc, SETUP), next);
    // What cannot be begun does not end what has.
    let too_long = SlotError::Length {
        len: ROOM as u32 + 1,
        room: ROOM as u32,
    };
    let begun = board.writer.begin(target, ROOM as u32 + 1, crc, SETUP);
    assert_eq!(begun, Err(too_long));
    let nothing = SlotError::Length {
        len: 0,
        room: ROOM as u32,
    };
    assert_eq!(board.writer.begin(target, 0, crc, SETUP), Err(nothing));
    let setup = Setup {
        meters_per_px: f32::NAN,
        ..SETUP
    };
    let begun = board.writer.begin(target, len, crc, setup);
    assert_eq!(begun, Err(SlotError::Setup));
    assert_eq!(board.writer.begin(target, len, crc, SETUP), next);

    for (len, crc, setup) in [
        (other.len() as u32, crc_of(&other), SETUP),
        (len, crc_of(&other), SETUP),
        (len + 1, crc, SETUP),
        (len, crc, Setup::default()),
    ] {
        let begun = board.writer.begin(target, len, crc, setup);
        assert_eq!(begun, Ok(Progress::Erasing));
        assert_eq!(board.chunk(&new, 0, 8), Err(SlotError::NotBegun));
        assert_eq!(board.finish(Slot::B), Err(SlotError::NotBegun));
        assert_eq!(board.writer.begin(target, len, crc, setup), begun);
        board.erase().expect("power");
    }
    assert_eq!(board.upload(Some(FLOWN), &other), Ok(record_of(&other, 6)));
}

#[test]
fn nothing_goes_without_a_beginning() {
    let mut board = board::<1>();
    let not_begun = SlotError::NotBegun;
    assert_eq!(board.writer.step(&mut board.flash), Err(not_begun));
    assert_eq!(board.chunk(&atlas(1), 0, 8), Err(not_begun));
    assert_eq!(board.finish(Slot::B), Err(not_begun));
    assert_eq!(board.writer.progress(), Err(not_begun));
    board.begin(Some(FLOWN), &atlas(3)).expect("power");
    board.writer.abandon();
    assert_eq!(board.chunk(&atlas(3), 0, 8), Err(not_begun));
    assert_flown(&board);
}

#[test]
fn what_was_written_and_not_finished_does_not_count() {
    let new = atlas(4);
    let mut board = board::<1>();
    board.begin(Some(FLOWN), &new).expect("power");
    board.chunks(&new, PART_LEN).expect("in order");
    let found = board.region().found(Slot::B).atlas.clone();
    assert_eq!(found.err(), Some(SlotError::Unfinished));
    assert_flown(&board);
}

/// What finish says when `len` and `crc` are announced, and `bytes` come.
fn finished(len: usize, crc: u32, bytes: &[u8]) -> SlotError {
    let mut board = board::<4>();
    let target = board.region().target(Some(FLOWN)).expect("not covered");
    let begun = board.writer.begin(target, len as u32, crc, SETUP);
    assert_eq!(begun, Ok(Progress::Erasing));
    board.erase().expect("power");
    board.chunks(bytes, PART_LEN).expect("in order");
    let error = board.finish(Slot::B).expect_err("not what was announced");
    assert_flown(&board);
    assert_eq!(board.finish(Slot::B), Err(SlotError::NotBegun));
    assert!(board.upload(Some(FLOWN), &atlas(3)).is_ok());
    error
}

#[test]
fn only_what_was_announced_is_committed() {
    let new = atlas(4);
    let (len, found) = (new.len(), crc_of(&new));
    let expected = 0xdead_beef;
    let other = SlotError::Other { expected, found };
    assert_eq!(finished(len, expected, &new), other, "wrong CRC");

    let longer = [&new[..], &[0; 8]].concat();
    let length = SlotError::Length {
        len: len as u32,
        room: longer.len() as u32,
    };
    assert_eq!(finished(longer.len(), found, &longer), length);
    let truncated = AtlasError::Truncated {
        needed: len as u32,
        have: len as u32 - 8,
    };
    let shorter = finished(len - 8, found, &new[..len - 8]);
    assert_eq!(shorter, SlotError::Atlas(truncated));

    let mut damaged = new.clone();
    damaged[40] ^= 1;
    let crc = AtlasError::Crc {
        stored: found,
        computed: checksum(&damaged),
    };
    assert_eq!(finished(len, found, &damaged), SlotError::Atlas(crc));
}

#[test]
fn garbage_with_the_right_crc_is_no_atlas() {
    let garbage: Vec<u8> = (0..300_u32).map(|byte| (byte * 151 % 251) as u8).collect();
    let found = *garbage.first_chunk().expect("four bytes");
    let magic = SlotError::Atlas(AtlasError::Magic { found });
    assert_eq!(finished(300, checksum(&garbage), &garbage), magic);

    // A preamble that is right, CRC and all, with no header behind it.
    let mut garbage = garbage;
    garbage[..8].copy_from_slice(&atlas(1)[..8]);
    garbage[8..12].copy_from_slice(&300_u32.to_le_bytes());
    let crc = checksum(&garbage);
    garbage[12..16].copy_from_slice(&crc.to_le_bytes());
    let error = finished(300, crc, &garbage);
    assert!(
        matches!(error, SlotError::Atlas(AtlasError::Header { .. })),
        "{error}"
    );
}

#[test]
fn worn_pages_are_named() {
    let new = longest();
    for page in 0..SLOT_LEN / PAGE_LEN {
        let mut board = board::<8>();
        let offset = start(Slot::B) + page * PAGE_LEN;
        board.flash.put(offset, &[0; PAGE_LEN]);
        board.flash.wear(offset);
        let worn = SlotError::Worn {
            offset: (offset - REGION) as u32,
        };
        assert_eq!(board.upload(Some(FLOWN), &new), Err(worn));
        assert_eq!(board.writer.progress(), Err(SlotError::NotBegun));
        // It may be tried again; it is still worn.
        assert_eq!(board.upload(Some(FLOWN), &new), Err(worn));
        assert_flown(&board);
    }
}

#[test]
fn stuck_bits_are_named_by_their_pages() {
    let new = longest();
    let record = record_of(&new, 6).encode();
    let content = [&new[..], &vec![0xff; ROOM - new.len()], &record].concat();
    for (byte, &value) in content.iter().enumerate() {
        for is_high in [false, true] {
            let mut board = board::<4>();
            board.flash.stick_bits(start(Slot::B) + byte, 0x10, is_high);
            let is_kept = is_high && value & 0x10 != 0;
            let is_used = byte < new.len() || byte >= ROOM;
            let result = board.upload(Some(FLOWN), &new);
            if is_kept || (is_high && !is_used) {
                assert!(result.is_ok(), "byte {byte}");
            } else {
                let offset = (SLOT_LEN + byte / PAGE_LEN * PAGE_LEN) as u32;
                assert_eq!(result, Err(SlotError::Worn { offset }), "byte {byte}");
                assert_flown(&board);
            }
        }
    }
}

#[test]
fn a_part_over_two_pages_names_the_one_that_is_worn() {
    let new = longest();
    for page in [1, 2, 3] {
        let mut board = board::<1>();
        let byte = (page * PAGE_LEN..).find(|&byte| new[byte] & 1 == 0);
        let byte = byte.expect("an even byte");
        board.flash.stick_bits(start(Slot::B) + byte, 1, true);
        board.begin(Some(FLOWN), &new).expect("bits are ones");
        let offset = (SLOT_LEN + page * PAGE_LEN) as u32;
        assert_eq!(board.chunk(&new, 0, 400), Err(SlotError::Worn { offset }));
    }
}

#[test]
fn an_announcement_that_was_lost_is_not_committed() {
    let new = atlas(4);
    let mut board = board::<8>();
    board.begin(Some(FLOWN), &new).expect("power");
    board.chunks(&new, PART_LEN).expect("in order");
    board.flash.stick_bits(start(Slot::B) + ROOM, 1, false);
    let steps = board.flash.steps();
    let offset = (2 * SLOT_LEN - PAGE_LEN) as u32;
    assert_eq!(board.finish(Slot::B), Err(SlotError::Worn { offset }));
    assert_eq!(board.flash.steps(), steps);
    assert_flown(&board);
}

#[test]
fn a_driver_that_fails_ends_the_upload() {
    let new = atlas(4);
    let mut board = board::<8>();
    board.begin(Some(FLOWN), &new).expect("power");
    board.flash.power_after(0, Cut::Before);
    assert_eq!(board.chunk(&new, 0, 64), Err(SlotError::Driver));
    assert_eq!(board.chunk(&new, 0, 64), Err(SlotError::NotBegun));
    assert_eq!(board.begin(Some(FLOWN), &new), Err(SlotError::Driver));
    board.flash.power_on();
    assert_eq!(board.upload(Some(FLOWN), &new), Ok(record_of(&new, 6)));
}

#[test]
fn slots_must_be_whole_pages_of_the_flash() {
    let new = atlas(1);
    for (region, slot_len) in [
        (REGION + 8, SLOT_LEN),
        (REGION, SLOT_LEN + 8),
        (REGION, 1 << 20),
        (u32::MAX as usize - PAGE_LEN + 1, SLOT_LEN),
    ] {
        let mut board = board::<8>();
        let content = board.flash.bytes().to_vec();
        board.writer = Writer::new(region as u32, slot_len as u32);
        assert_eq!(board.begin(Some(FLOWN), &new), Err(SlotError::Driver));
        assert_eq!(board.flash.bytes(), content);
    }
    let mut writer = Writer::new(0, 10);
    let target = board::<8>().region().target(Some(FLOWN)).expect("a slot");
    let none = SlotError::Length { len: 1, room: 0 };
    assert_eq!(writer.begin(target, 1, 0, SETUP), Err(none));
}

#[test]
fn errors_say_what_is_wrong() {
    use std::string::ToString;
    let other = SlotError::Other {
        expected: 0xabc,
        found: 1,
    };
    assert_eq!(
        other.to_string(),
        "expected the atlas with CRC 00000abc, found the one with CRC 00000001"
    );
}
