use eigenmark_core::{atlas::AtlasError, link::AtlasIdentity};

use super::{
    super::simulated::{Flash, Trouble, serve},
    *,
};

const LEN: usize = 20_123;
const CRC: u32 = 0x1234_5678;

/// For links that lose much: a busy machine still answers within it.
const QUICK: Patience = Patience {
    asking: Duration::from_millis(500),
    erasing: Duration::from_millis(500),
    writing: Duration::from_millis(50),
    checking: Duration::from_millis(500),
};

fn atlas() -> Vec<u8> {
    (0..LEN).map(|index| (index * index % 253) as u8).collect()
}

fn setup() -> Setup {
    Setup {
        meters_per_px: 0.25,
        field_of_view_rad: 0.9,
    }
}

/// Uploads to a board with that in its flash, over a link with that trouble.
fn upload_to(
    flash: Flash,
    trouble: Trouble,
    patience: Patience,
) -> (Result<Uploaded, UploadError>, Flash) {
    let (name, board) = serve(flash, trouble);
    let mut link = BoardLink::open(&name, 0).expect("listens");
    let transfer = Transfer {
        link: &mut link,
        bytes: &atlas(),
        len: LEN as u32,
        crc: CRC,
        setup: setup(),
        patience,
        tries: 0,
        repeated: 0,
    };
    let uploaded = transfer.run(&Progress::Hidden);
    drop(link);
    (uploaded, board.join().expect("ends"))
}

fn upload_with(trouble: Trouble) -> (Result<Uploaded, UploadError>, Flash) {
    upload_to(Flash::default(), trouble, QUICK)
}

/// Parts of the atlas.
fn parts() -> u64 {
    (LEN as u64).div_ceil(PART_LEN as u64)
}

#[test]
fn a_good_link_carries_every_part_once() {
    let (uploaded, flash) = upload_to(Flash::default(), Trouble::default(), PATIENCE);
    let expected = Uploaded {
        slot: 0,
        sequence: 1,
        resumed_at: 0,
        repeated: 0,
    };
    assert_eq!(uploaded.expect("uploads"), expected);
    assert_eq!(flash.bytes, atlas());
    assert_eq!(flash.announced, Some((LEN as u32, CRC, setup())));
    assert_eq!(flash.requests, parts() + 3, "slots, begin, parts, finish");
}

#[test]
fn the_atlas_arrives_whole_whatever_is_lost() {
    let none = Trouble::default();
    for trouble in [
        Trouble {
            request_lost: 7,
            ..none
        },
        Trouble {
            request_damaged: 5,
            ..none
        },
        Trouble {
            reply_lost: 6,
            ..none
        },
        Trouble { noise: 4, ..none },
        Trouble {
            is_talkative: true,
            ..none
        },
        Trouble {
            restart: 20,
            ..none
        },
        Trouble {
            request_lost: 11,
            // Never three in a row: a question is asked three times.
            reply_lost: 6,
            noise: 4,
            restart: 25,
            is_talkative: true,
            ..none
        },
    ] {
        let (uploaded, flash) = upload_with(trouble);
        let uploaded = uploaded.unwrap_or_else(|error| panic!("{trouble:?}: {error}"));
        assert_eq!((uploaded.slot, uploaded.sequence), (0, 1), "{trouble:?}");
        assert_eq!(flash.bytes, atlas(), "{trouble:?}");
    }
}

/// Answers that come after the part was sent again would double every part that follows, were each answered with a part.
#[test]
fn late_answers_do_not_double_what_follows() {
    let trouble = Trouble {
        late: Some((10, 2 * QUICK.writing)),
        ..Trouble::default()
    };
    let (uploaded, flash) = upload_with(trouble);
    let repeated = uploaded.expect("uploads").repeated;
    assert_eq!(flash.bytes, atlas());
    assert!(repeated < parts() / 2, "{repeated} parts were repeated");
}

#[test]
fn an_interrupted_upload_goes_on_where_it_was() {
    let hangs_up = Trouble {
        hang_up: 15,
        ..Trouble::default()
    };
    let (uploaded, flash) = upload_to(Flash::default(), hangs_up, PATIENCE);
    let error = uploaded.expect_err("hangs up");
    assert!(matches!(error, UploadError::Link(_)), "{error}");
    let has = flash.bytes.len() as u32;
    assert_eq!(has, 12 * PART_LEN as u32);
    let requests = flash.requests;
    let (uploaded, flash) = upload_to(flash, Trouble::default(), PATIENCE);
    assert_eq!(uploaded.expect("uploads").resumed_at, has);
    assert_eq!(flash.bytes, atlas());
    assert_eq!(flash.requests - requests, parts() - 12 + 3);
}

#[test]
fn the_lost_answer_to_the_end_is_looked_up() {
    let (uploaded, _) = upload_with(Trouble {
        reply_lost: parts() + 3,
        ..Trouble::default()
    });
    assert_eq!(uploaded.expect("uploads").sequence, 1);
}

#[test]
fn the_slot_that_is_flown_is_left_alone() {
    let atlas = AtlasIdentity {
        crc: CRC,
        map_crc: 0,
        landmarks: 1,
        view_side: 10,
        dimensions: 5,
    };
    let mut flash = Flash::default();
    flash.slots[0] = SlotState {
        sequence: Some(41),
        atlas: Ok(atlas),
        is_flown: true,
    };
    let (uploaded, flash) = upload_to(flash, Trouble::default(), PATIENCE);
    let uploaded = uploaded.expect("uploads");
    assert_eq!((uploaded.slot, uploaded.sequence), (1, 42));
    assert_eq!(flash.slots[0].sequence, Some(41));
}

#[test]
fn rejections_are_told_in_words() {
    for (reason, words) in [
        (Rejection::Refused, "boards that fly do not do that"),
        (
            Rejection::Slot(SlotError::Worn { offset: 0x4000 }),
            "0x4000 of the atlas region is worn",
        ),
        (
            Rejection::Slot(SlotError::Atlas(AtlasError::Magic { found: [7; 4] })),
            "no valid atlas",
        ),
    ] {
        let (uploaded, _) = upload_with(Trouble {
            rejection: Some((1024, reason)),
            ..Trouble::default()
        });
        let error = uploaded.expect_err("rejected").to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn boards_that_do_not_get_on_are_given_up() {
    for reason in [
        Rejection::Gap { expected: 0 },
        Rejection::Slot(SlotError::NotBegun),
    ] {
        let (uploaded, _) = upload_with(Trouble {
            rejection: Some((1024, reason)),
            ..Trouble::default()
        });
        let error = uploaded.expect_err("does not get on").to_string();
        assert!(error.contains("does not get past byte"), "{error}");
    }
}
