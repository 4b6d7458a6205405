use super::{
    super::{BOARDS, fixture::ATLAS},
    *,
};

fn len() -> usize {
    ATLAS.bytes().len()
}

#[test]
fn addresses_must_be_aligned() {
    let error = Placement::at(0x0804_0004, &ATLAS, &BOARDS[0]).expect_err("is not");
    assert_eq!(
        error.to_string(),
        "expected an address that is a multiple of 8, found 0x08040004"
    );
}

#[test]
fn an_atlas_may_fill_slots_up_to_their_end_and_not_a_byte_more() {
    let aligned = len().next_multiple_of(8) as u32;
    for (board, end, room) in [
        (0, 0x0810_0000_u32, 768 << 10),
        (1, 0x0820_0000, 1024 << 10),
    ] {
        let board = &BOARDS[board];
        assert_eq!(
            board.room_at(board.start(Slot::A)).expect("has room").len(),
            room
        );
        Placement::at(end - aligned, &ATLAS, board).expect("fits");
        let error = Placement::at(end - aligned + 8, &ATLAS, board).expect_err("does not fit");
        let expected = format!(
            "the atlas has {} bytes; there is room for {} from {:#010x} on in the board's slots",
            len(),
            aligned - 8,
            end - aligned + 8
        );
        assert_eq!(error.to_string(), expected);
    }
    // Over the end of slot A into B where nothing is between them.
    Placement::at(BOARDS[0].start(Slot::B) - 8, &ATLAS, &BOARDS[0]).expect("fits");
}

#[test]
fn elsewhere_only_the_address_space_ends() {
    Placement::at(0x2000_0000, &ATLAS, &BOARDS[0]).expect("fits");
    let error = Placement::at(0xffff_fff8, &ATLAS, &BOARDS[0]).expect_err("does not fit");
    assert!(
        error
            .to_string()
            .ends_with("room for 8 from 0xfffffff8 on in the address space")
    );
}

#[test]
fn the_record_is_the_last_of_its_slot_and_says_what_is_in_it() {
    let setup = Setup {
        meters_per_px: 0.5,
        field_of_view_rad: 1.0,
    };
    let record = record_of(&ATLAS, 7, &setup).expect("is valid");
    let placement = Placement::with_record(Slot::B, &ATLAS, &record, &BOARDS[0]).expect("fits");
    let [atlas, end] = placement.segments() else {
        panic!("{} segments", placement.segments().len());
    };
    assert_eq!(
        (atlas.address, atlas.bytes.as_slice()),
        (0x080a_0000, ATLAS.bytes())
    );
    assert_eq!(end.address, 0x0810_0000 - 64);
    let decoded = Record::decode(end.bytes.as_slice().try_into().expect("64 bytes"));
    let expected = Record {
        sequence: 7,
        len: len() as u32,
        crc: ATLAS.atlas().crc(),
        setup,
    };
    assert_eq!(decoded, Some(expected));
}

#[test]
fn setups_out_of_range_make_no_record() {
    for (meters_per_px, field_of_view_rad) in [
        (0.0, 1.0),
        (f32::INFINITY, 1.0),
        (1.0, 3.2),
        (1.0, f32::NAN),
    ] {
        let setup = Setup {
            meters_per_px,
            field_of_view_rad,
        };
        assert_eq!(record_of(&ATLAS, 1, &setup), Err(PlacementError::Setup));
    }
}
