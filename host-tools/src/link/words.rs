//! Rejections in words.

use eigenmark_core::{link::Rejection, slots::SlotError};

/// Why a board did not do what it was asked, in words.
#[must_use]
pub fn rejection(reason: &Rejection) -> String {
    match reason {
        Rejection::Damaged(damage) => format!("the request was damaged on the way: {damage}"),
        Rejection::Frame(error) => format!("the frame is not usable: {error}"),
        Rejection::TooLarge { room } => {
            format!("the board has room for frames of at most {room} pixels")
        }
        Rejection::Gap { expected } => {
            format!("a part is missing or comes twice: expected the one at byte {expected}")
        }
        Rejection::Slot(error) => slot_error(error),
        Rejection::NoAtlas => "no slot of the board holds a valid atlas".to_owned(),
        Rejection::Route(error) => error.to_string(),
        Rejection::Refused => "boards that fly do not do that".to_owned(),
        other => format!("{other:?}"),
    }
}

/// Why there is no atlas in a slot, or why it cannot be written, in words.
#[must_use]
pub fn slot_error(error: &SlotError) -> String {
    match error {
        SlotError::Empty => "the slot is erased".to_owned(),
        SlotError::Atlas(error) => format!("the slot holds no valid atlas: {error}"),
        SlotError::Length { len, room } => {
            format!(
                "an atlas of {len} bytes does not fit into a slot of {room} bytes, record included"
            )
        }
        SlotError::Setup => {
            "meters per pixel must be above 0, the field of view between 0 and 180°".to_owned()
        }
        SlotError::Other { expected, found } => {
            format!("expected an atlas with CRC {expected:08x}, found {found:08x}")
        }
        SlotError::Worn { offset } => {
            format!(
                "the flash page at offset {offset:#x} of the atlas region is worn: it does not keep what is written"
            )
        }
        SlotError::Driver => "the board's flash does not work".to_owned(),
        SlotError::NotBegun => "no upload has begun".to_owned(),
        SlotError::Gap { expected } => {
            format!("a part is missing or comes twice: expected the one at byte {expected}")
        }
        other => format!("{other:?}"),
    }
}
