//! Which slot is flown by, whatever is in them.

use std::vec::Vec;

use super::*;
use crate::atlas::AtlasError;
use proptest::prelude::*;

/// Bytes at an address that is a multiple of eight.
fn aligned(bytes: &[u8]) -> Vec<u64> {
    let mut words = vec![u64::MAX; bytes.len().div_ceil(8)];
    bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
    words
}

fn newest(contents: [Content; 2]) -> Option<Slot> {
    Board::<1>::new(contents).region().newest()
}

fn error(content: Content) -> SlotError {
    let board = Board::<1>::new([Content::Erased, content]);
    let found = board.region().found(Slot::B).atlas.clone();
    found.expect_err("not valid")
}

#[test]
fn the_newest_valid_atlas_is_flown_by() {
    use Content::{Erased, Flashed, Recorded, Stale, Uncommitted, Zeros};
    for (a, b, expected) in [
        (Erased, Erased, None),
        (Zeros, Erased, None),
        (Stale(1), Uncommitted(1), None),
        (Flashed(1), Erased, Some(Slot::A)),
        (Erased, Flashed(1), Some(Slot::B)),
        (Stale(1), Flashed(1), Some(Slot::B)),
        (Uncommitted(1), Flashed(1), Some(Slot::B)),
        (Flashed(1), Flashed(2), Some(Slot::A)),
        (Flashed(1), Recorded(1, 1), Some(Slot::B)),
        (Flashed(1), Recorded(1, 0), Some(Slot::B)),
        (Flashed(1), Recorded(1, u32::MAX), Some(Slot::B)),
        (Recorded(1, 3), Flashed(1), Some(Slot::A)),
        (Recorded(1, 3), Recorded(2, 3), Some(Slot::A)),
        (Recorded(1, 3), Recorded(2, 4), Some(Slot::B)),
        (Recorded(1, 4), Recorded(2, 3), Some(Slot::A)),
        (Recorded(1, u32::MAX), Recorded(2, 0), Some(Slot::B)),
        (Recorded(1, 0), Recorded(2, u32::MAX), Some(Slot::A)),
        (Recorded(1, 1), Recorded(2, 1 << 31), Some(Slot::B)),
        (Recorded(1, 0), Recorded(2, 1 << 31), Some(Slot::A)),
        (Recorded(1, 1 << 31), Recorded(2, 0), Some(Slot::A)),
        (Stale(1), Recorded(1, 1), Some(Slot::B)),
    ] {
        assert_eq!(newest([a, b]), expected, "{a:?}, {b:?}");
    }
}

#[test]
fn what_does_not_count_says_why() {
    assert_eq!(error(Content::Erased), SlotError::Empty);
    let found = [0; 4];
    let magic = SlotError::Atlas(AtlasError::Magic { found });
    assert_eq!(error(Content::Zeros), magic);
    let [expected, found] = [2, 1].map(|landmarks| crc_of(&atlas(landmarks)));
    assert_eq!(
        error(Content::Stale(1)),
        SlotError::Other { expected, found }
    );
    assert_eq!(error(Content::Uncommitted(1)), SlotError::Unfinished);
}

#[test]
fn a_record_gives_setup_and_number_and_without_one_they_are_unknown() {
    let board = Board::<1>::new([Content::Flashed(1), Content::Recorded(2, 7)]);
    let region = board.region();
    let [a, b] = region.states(Some(Slot::B));
    assert_eq!((a.sequence, a.is_flown), (None, false));
    assert_eq!((b.sequence, b.is_flown), (Some(7), true));
    assert_eq!(
        a.atlas.map(|atlas| (atlas.crc, atlas.landmarks)),
        Ok((crc_of(&atlas(1)), 1))
    );
    assert_eq!(region.choose().map(|choice| choice.setup), Some(SETUP));
    assert_eq!(region.found(Slot::A).setup(), Setup::default());
}

#[test]
fn flash_that_reads_zero_behind_an_atlas_holds_no_record() {
    let mut bytes = vec![0; SLOT_LEN];
    let atlas = atlas(2);
    bytes[..atlas.len()].copy_from_slice(&atlas);
    let mut board = Board::<1>::new([Content::Erased; 2]);
    board.flash.put(start(Slot::B), &bytes);
    assert_eq!(board.chosen(), Some((Slot::B, crc_of(&atlas))));
}

#[test]
fn no_flipped_bit_of_a_record_makes_another_one() {
    let contents = [Content::Recorded(1, 1), Content::Recorded(2, 2)];
    let bytes = Content::Recorded(2, 2).bytes();
    for bit in 0..RECORD_LEN * 8 {
        let mut damaged = bytes.clone();
        damaged[ROOM + bit / 8] ^= 1 << (bit % 8);
        let mut board = Board::<1>::new(contents);
        board.flash.put(start(Slot::B), &damaged);
        assert_eq!(board.region().newest(), Some(Slot::A), "bit {bit}");
        let found = board.region().found(Slot::B).atlas.clone();
        assert_eq!(found.err(), Some(SlotError::Unfinished), "bit {bit}");
    }
}

#[test]
fn a_record_of_another_length_does_not_vouch() {
    let mut bytes = Content::Flashed(1).bytes();
    let mut record = record_of(&atlas(1), 5);
    record.len += 1;
    bytes[ROOM..].copy_from_slice(&record.encode());
    let mut board = Board::<1>::new([Content::Erased; 2]);
    board.flash.put(start(Slot::A), &bytes);
    let found = board.region().found(Slot::A).atlas.clone();
    assert_eq!(found.err(), Some(SlotError::Unfinished));
}

#[test]
fn a_flashed_atlas_may_take_the_place_of_the_record() {
    let landmarks = (1..).find(|&landmarks| atlas(landmarks).len() > ROOM);
    let long = atlas(landmarks.expect("some"));
    assert!(long.len() <= SLOT_LEN);
    for slot in Slot::BOTH {
        let mut board = Board::<1>::new([Content::Erased; 2]);
        board.flash.put(start(slot), &long);
        assert_eq!(board.chosen(), Some((slot, crc_of(&long))));
        let target = board.region().target(Some(slot));
        assert_eq!(target.map(|target| target.slot()), Ok(slot.other()));
    }
}

#[test]
fn an_atlas_that_takes_both_slots_is_kept() {
    let landmarks = (1..).find(|&landmarks| atlas(landmarks).len() > SLOT_LEN);
    let long = atlas(landmarks.expect("some"));
    let mut board = Board::<1>::new([Content::Erased; 2]);
    board.flash.put(start(Slot::A), &long);
    assert_eq!(board.chosen(), Some((Slot::A, crc_of(&long))));
    let region = board.region();
    let found = region.found(Slot::B).atlas.clone();
    assert_eq!(found.err(), Some(SlotError::Covered));
    assert_eq!(region.target(Some(Slot::A)), Err(SlotError::Covered));
    assert_eq!(region.target(None), Err(SlotError::Covered));
    // One page further: an end is no atlas.
    board.flash.put(start(Slot::A), &[0xff; PAGE_LEN]);
    board.flash.put(start(Slot::B), &long);
    assert_eq!(board.chosen(), None);
}

#[test]
fn the_slot_to_write_is_never_the_one_to_keep() {
    use Content::{Erased, Flashed, Recorded};
    for (contents, flown, slot, sequence) in [
        ([Erased, Erased], None, Slot::A, 1),
        ([Flashed(1), Erased], Some(Slot::A), Slot::B, 1),
        ([Erased, Flashed(1)], Some(Slot::B), Slot::A, 1),
        // Uploaded since the start, and not flown by yet.
        ([Flashed(1), Recorded(1, 1)], Some(Slot::A), Slot::B, 1),
        ([Recorded(1, 1), Erased], None, Slot::B, 2),
        ([Recorded(1, 1), Recorded(2, 2)], None, Slot::A, 3),
        ([Recorded(1, 8), Recorded(2, 9)], Some(Slot::B), Slot::A, 10),
        ([Erased, Recorded(2, u32::MAX)], Some(Slot::B), Slot::A, 0),
    ] {
        let target = Board::<1>::new(contents).region().target(flown);
        let found = target.map(|target| (target.slot(), target.sequence()));
        assert_eq!(found, Ok((slot, sequence)), "{contents:?}");
    }
}

#[test]
fn slots_of_other_sizes_hold_nothing() {
    let bytes = aligned(&Content::Recorded(1, 1).bytes().repeat(2));
    let bytes = bytemuck::cast_slice(&bytes);
    for slot_len in [0, 1, 63, SLOT_LEN + 1, 2 * SLOT_LEN, usize::MAX] {
        let region = Region::read(bytes, slot_len);
        assert!(region.found(Slot::B).atlas.is_err(), "{slot_len}");
    }
    assert!(Region::read(&[], SLOT_LEN).choose().is_none());
    assert!(Region::read(bytes, SLOT_LEN).choose().is_some());
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..400),
        slot_len in 0_usize..400,
    ) {
        let words = aligned(&bytes);
        let region = Region::read(&bytemuck::cast_slice(&words)[..bytes.len()], slot_len);
        prop_assert!(region.choose().is_none());
        prop_assert!(region.target(None).is_ok());
    }

    #[test]
    fn changed_bytes_never_make_another_atlas(
        changes in proptest::collection::vec((0..2 * SLOT_LEN, any::<u8>()), 0..4),
    ) {
        let contents = [Content::Recorded(1, 1), Content::Recorded(2, 2)];
        let mut bytes = contents.map(Content::bytes).concat();
        for (offset, byte) in changes {
            bytes[offset] = byte;
        }
        let words = aligned(&bytes);
        let region = Region::read(bytemuck::cast_slice(&words), SLOT_LEN);
        if let Some(choice) = region.choose() {
            let landmarks = match choice.slot {
                Slot::A => 1,
                Slot::B => 2,
            };
            prop_assert_eq!(choice.atlas.crc(), crc_of(&atlas(landmarks)));
            prop_assert_eq!(choice.setup, SETUP);
        }
    }
}
