//! Power is cut in every step of an upload, in every way, over whatever was there before.

use super::*;

const CUTS: [Cut; 7] = [
    Cut::Before,
    Cut::FirstHalf,
    Cut::SecondHalf,
    Cut::Random(1),
    Cut::Random(2),
    Cut::Random(3),
    Cut::After,
];

/// Empty; an old atlas in one slot, flashed or uploaded; in both; and what earlier cuts may leave beside it.
const BEFORE: [[Content; 2]; 12] = {
    use Content::{Erased, Flashed, Recorded, Stale, Uncommitted, Zeros};
    [
        [Erased, Erased],
        [Zeros, Uncommitted(1)],
        [Uncommitted(2), Erased],
        [Flashed(1), Erased],
        [Recorded(1, 5), Erased],
        [Erased, Flashed(1)],
        [Uncommitted(2), Flashed(1)],
        [Stale(2), Flashed(1)],
        [Flashed(1), Flashed(2)],
        [Flashed(1), Recorded(2, 1)],
        [Recorded(1, 5), Recorded(2, 4)],
        [Recorded(1, u32::MAX - 1), Recorded(2, u32::MAX)],
    ]
};

/// Whether the new atlas was chosen after the cut.
fn cut<const W: usize>(start: &Board<W>, new: &[u8], steps: u64, cut: Cut) -> bool {
    let old = start.chosen();
    let flown = old.map(|(slot, _)| slot);
    let mut board = start.clone();
    board.flash.power_after(steps, cut);
    let result = board.upload(flown, new);
    assert_eq!(result, Err(SlotError::Driver));
    assert!(board.flash.is_off());

    board.restart();
    if let Some(slot) = flown {
        assert_eq!(board.slot(slot), start.slot(slot), "the slot flown by");
    }
    let chosen = board.region().choose();
    let is_new = match (&chosen, old) {
        (Some(choice), _) if choice.atlas.crc() == crc_of(new) => {
            let found = board.region().found(choice.slot).record;
            let target = start.region().target(flown).expect("not covered");
            assert_eq!(choice.slot, target.slot());
            assert_eq!(found, Some(record_of(new, target.sequence())));
            assert_eq!(choice.setup, SETUP);
            true
        }
        (Some(choice), Some(old)) => {
            assert_eq!((choice.slot, choice.atlas.crc()), old);
            false
        }
        (None, None) => false,
        (found, old) => panic!("{old:?} became {found:?}"),
    };

    // The board starts, and the same is sent again; nothing stands in its way.
    let flown = board.region().newest();
    let record = board.upload(flown, new).expect("power");
    let chosen = board.chosen().expect("a valid atlas");
    assert_eq!(chosen.1, crc_of(new));
    assert_eq!(
        Some(chosen.0),
        flown.map_or(Some(Slot::A), |slot| Some(slot.other()))
    );
    assert_eq!(board.region().found(chosen.0).record, Some(record));
    let outside = [
        &board.flash.bytes()[..REGION],
        &board.flash.bytes()[FLASH_LEN - PAGE_LEN..],
    ];
    assert_eq!(outside, [&[0x5a; REGION][..], &[0xa5; PAGE_LEN][..]]);
    is_new
}

/// Every cut, for an atlas that leaves a page unused, and for one that fills its slot.
fn cut_everywhere<const W: usize>() {
    for new in [atlas(3), longest()] {
        for contents in BEFORE {
            let start = Board::<W>::new(contents);
            let mut whole = start.clone();
            let flown = start.region().newest();
            whole.upload(flown, &new).expect("power");
            assert_eq!(whole.chosen().map(|(_, crc)| crc), Some(crc_of(&new)));
            let steps = whole.flash.steps();
            assert!(steps > (new.len() / W) as u64);

            for kind in CUTS {
                let chosen: Vec<bool> = (0..steps).map(|at| cut(&start, &new, at, kind)).collect();
                let commit = steps as usize - RECORD_LEN / 2 / W;
                assert!(!chosen[..commit].contains(&true), "before it is committed");
                if kind == Cut::After {
                    assert_eq!(chosen.last(), Some(&true), "after it is committed");
                }
            }
        }
    }
}

#[test]
fn words_of_one_byte() {
    cut_everywhere::<1>();
}

#[test]
fn words_of_four_bytes() {
    cut_everywhere::<4>();
}

#[test]
fn words_of_eight_bytes() {
    cut_everywhere::<8>();
}

#[test]
fn words_of_thirty_two_bytes() {
    cut_everywhere::<32>();
}

#[test]
fn a_cut_in_the_second_upload_leaves_the_first() {
    // Nothing was flown by, and nothing is until the next start; yet what was uploaded is kept.
    let (first, second) = (atlas(2), atlas(3));
    let mut start = Board::<8>::new([Content::Erased; 2]);
    start.upload(None, &first).expect("power");
    for steps in 0.. {
        let mut board = start.clone();
        board.flash.power_after(steps, Cut::FirstHalf);
        if board.upload(None, &second).is_ok() {
            assert_eq!(board.chosen(), Some((Slot::B, crc_of(&second))));
            break;
        }
        board.restart();
        assert_eq!(board.chosen(), Some((Slot::A, crc_of(&first))), "{steps}");
    }
}
