//! Why a slot holds no atlas, or cannot be written.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::atlas::AtlasError;

/// Why there is no atlas in a slot, or why it cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SlotError {
    /// It is erased.
    Empty,
    /// What is in it is not an atlas.
    Atlas(AtlasError),
    /// The atlas is longer than there is room for, shorter than was announced, or has no length.
    Length {
        /// Bytes of the atlas.
        len: u32,
        /// Bytes that a slot has room for, or that were announced.
        room: u32,
    },
    /// The setup has a number out of its range.
    Setup,
    /// The atlas is not the one that was announced, or that the slot's record names.
    Other {
        /// CRC-32 announced.
        expected: u32,
        /// CRC-32 found.
        found: u32,
    },
    /// Flash did not keep what was written to it, or did not become erased.
    Worn {
        /// Offset of the page in the atlas region, in bytes.
        offset: u32,
    },
    /// The flash's driver failed, or its pages do not fit the slots.
    Driver,
    /// No upload has begun, or its slot is still being erased.
    NotBegun,
    /// A part is missing, or comes twice.
    Gap {
        /// Where the next part begins.
        expected: u32,
    },
    /// There is a whole atlas, but what should be its record is neither one nor erased: its upload was cut, or it was
    /// flashed over another without erasing all of the slot.
    Unfinished,
    /// The atlas in slot A is longer than a slot, and goes on in this one.
    Covered,
}

impl fmt::Display for SlotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Empty => f.write_str("the slot is erased"),
            Self::Atlas(error) => error.fmt(f),
            Self::Length { len, room } => {
                write!(f, "the atlas has {len} bytes, expected 1 to {room}")
            }
            Self::Setup => f.write_str(
                "meters per pixel must be above 0, the field of view between 0 and π radians",
            ),
            Self::Other { expected, found } => {
                write!(
                    f,
                    "expected the atlas with CRC {expected:08x}, found the one with CRC {found:08x}"
                )
            }
            Self::Worn { offset } => {
                write!(
                    f,
                    "the flash page at offset {offset} of the atlas region does not keep what is written"
                )
            }
            Self::Driver => f.write_str("the flash cannot be erased, written or read"),
            Self::NotBegun => f.write_str("no upload has begun"),
            Self::Gap { expected } => {
                write!(f, "the next part of the atlas begins at byte {expected}")
            }
            Self::Unfinished => {
                f.write_str("the atlas was not finished: its record is neither whole nor erased")
            }
            Self::Covered => f.write_str("the atlas in slot A goes on in this slot"),
        }
    }
}

impl core::error::Error for SlotError {}

impl From<AtlasError> for SlotError {
    fn from(error: AtlasError) -> Self {
        Self::Atlas(error)
    }
}
