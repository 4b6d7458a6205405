//! An atlas at an address, with or without the record of its slot.

use eigenmark_core::slots::{RECORD_LEN, Record, Setup};

use super::{Board, Slot};
use crate::atlas::AtlasBuffer;

/// What atlases must begin at a multiple of, in bytes: they are used in place.
const ALIGNMENT: u32 = 8;

/// Bytes at an address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// What they are: the name of their section in an ELF file.
    pub name: &'static str,
    /// Address of the first.
    pub address: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// An atlas at its address, and its slot's record, if it has one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Placement {
    segments: Vec<Segment>,
}

/// Why an atlas cannot be placed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlacementError {
    /// The address is not aligned.
    #[error("expected an address that is a multiple of {ALIGNMENT}, found {address:#010x}")]
    Alignment {
        /// The address.
        address: u32,
    },
    /// The atlas goes on after the end of its room.
    #[error("the atlas has {len} bytes; there is room for {room} from {address:#010x} on {}", what.unwrap_or("in the address space"))]
    TooLong {
        /// Bytes of the atlas.
        len: usize,
        /// Bytes there.
        room: u64,
        /// The address.
        address: u32,
        /// Where that is.
        what: Option<&'static str>,
    },
    /// A record belongs to a slot, and there is none at the address.
    #[error(
        "a record needs an atlas at the start of a slot of {} ({:#010x} or {:#010x}), found {address:#010x}",
        board.name, board.slots[0], board.slots[1]
    )]
    NoSlot {
        /// The board.
        board: &'static Board,
        /// The address.
        address: u32,
    },
    /// The setup has a number out of its range.
    #[error("expected meters per pixel above 0 and a field of view between 0 and 180°")]
    Setup,
}

/// The record of `atlas` as the `sequence`-th that is written, with `setup`.
///
/// # Errors
/// [`PlacementError::Setup`].
pub fn record_of(
    atlas: &AtlasBuffer,
    sequence: u32,
    setup: &Setup,
) -> Result<Record, PlacementError> {
    if !setup.is_valid() {
        return Err(PlacementError::Setup);
    }
    Ok(Record {
        sequence,
        len: atlas.bytes().len() as u32,
        crc: atlas.atlas().crc(),
        setup: *setup,
    })
}

impl Placement {
    /// An atlas without a record, at an address; where that is in a slot of `board`, it must not go on after the slots.
    ///
    /// # Errors
    /// When the address is not aligned, or there is no room for the atlas.
    pub fn at(
        address: u32,
        atlas: &AtlasBuffer,
        board: &'static Board,
    ) -> Result<Self, PlacementError> {
        if !address.is_multiple_of(ALIGNMENT) {
            return Err(PlacementError::Alignment { address });
        }
        let in_slots = board.room_at(address);
        let end = in_slots
            .as_ref()
            .map_or(1 << 32, |room| u64::from(room.end));
        let what = in_slots.map(|_| "in the board's slots");
        Self::within(end, what, address, atlas)
    }

    /// An atlas in a slot, without a record: it must not go on after the slot.
    ///
    /// # Errors
    /// When the atlas is too long.
    pub fn in_slot(
        slot: Slot,
        atlas: &AtlasBuffer,
        board: &'static Board,
    ) -> Result<Self, PlacementError> {
        let address = board.start(slot);
        let end = u64::from(address + board.slot_len);
        Self::within(end, Some("in the slot"), address, atlas)
    }

    /// An atlas in a slot, and the slot's record.
    ///
    /// # Errors
    /// When the atlas is too long.
    pub fn with_record(
        slot: Slot,
        atlas: &AtlasBuffer,
        record: &Record,
        board: &'static Board,
    ) -> Result<Self, PlacementError> {
        let (address, record_at) = (board.start(slot), board.record_at(slot));
        let what = Some("in the slot, its record not included");
        let mut placement = Self::within(record_at.into(), what, address, atlas)?;
        placement.segments.push(Segment {
            name: ".record",
            address: record_at,
            bytes: record.encode().to_vec(),
        });
        Ok(placement)
    }

    /// The atlas, and after it the record, if there is one. They do not overlap.
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    fn within(
        end: u64,
        what: Option<&'static str>,
        address: u32,
        atlas: &AtlasBuffer,
    ) -> Result<Self, PlacementError> {
        let (bytes, room) = (atlas.bytes(), end - u64::from(address));
        if bytes.len() as u64 > room {
            return Err(PlacementError::TooLong {
                len: bytes.len(),
                room,
                address,
                what,
            });
        }
        let atlas = Segment {
            name: ".atlas",
            address,
            bytes: bytes.to_vec(),
        };
        Ok(Self {
            segments: vec![atlas],
        })
    }
}

// A record after an atlas that fills the rest of its slot is aligned, too.
const _: () = assert!(RECORD_LEN.is_multiple_of(ALIGNMENT as usize));

#[cfg(test)]
mod tests;
