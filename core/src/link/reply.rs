//! What a board answers.

use serde::{Deserialize, Serialize};

use super::{Damage, Faults, PICTURE_PART_LEN, Report};
use crate::{
    atlas::{Atlas, Head},
    frame::FrameError,
    localizer::Fix,
    route::RouteError,
    slots::{Setup, SlotError},
};

/// What a board says, asked or not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// The answer to [`Request::Identify`](super::Request::Identify).
    Identity(Identity),
    /// The answer to a frame.
    Fix {
        /// The request's number.
        sequence: u32,
        /// The fix, if there is one.
        fix: Option<Fix>,
    },
    /// A request that was not answered, and why.
    Rejected {
        /// The frame's number, when there is one.
        sequence: Option<u32>,
        /// Why.
        reason: Rejection,
    },
    /// How much of the new atlas has been written and read back, in bytes.
    Upload {
        /// Where the next part begins.
        next: u32,
    },
    /// What is in the slots.
    Slots([SlotState; 2]),
    /// What went wrong.
    Faults(Faults),
    /// It is done.
    Done,
    /// What became of a frame of the camera.
    Report(Report),
    /// Pixels of the frame that was reported last.
    Picture {
        /// The report's number.
        sequence: u32,
        /// Width of the frame, in pixels.
        width: u16,
        /// Height of the frame, in pixels.
        height: u16,
        /// How many pixels there were before.
        offset: u32,
        /// Luminance, row by row without gaps.
        bytes: heapless::Vec<u8, PICTURE_PART_LEN>,
    },
}

/// A board in brief.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the firmware: major, minor, patch.
    pub firmware: [u8; 3],
    /// The atlas that it flies by; none when no slot holds a valid one.
    pub atlas: Option<AtlasIdentity>,
    /// What was written with the atlas.
    pub setup: Setup,
    /// Bytes of stack that were used since the start, at most; 0 if not known.
    pub stack_bytes: u32,
}

/// An atlas in brief.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AtlasIdentity {
    /// Its CRC-32.
    pub crc: u32,
    /// CRC-32 of the map's luminance that it was trained on.
    pub map_crc: u32,
    /// Number of landmarks.
    pub landmarks: u32,
    /// Pixels per side of a view.
    pub view_side: u8,
    /// Dimensions of the eigenspace.
    pub dimensions: u8,
}

/// What is in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SlotState {
    /// Its number in the order of writing; none when that was not recorded.
    pub sequence: Option<u32>,
    /// The atlas, or why there is none.
    pub atlas: Result<AtlasIdentity, SlotError>,
    /// Whether the board flies by it.
    pub is_flown: bool,
}

/// Why a request was not answered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Rejection {
    /// The packet was damaged.
    Damaged(Damage),
    /// The pixels are not a frame.
    Frame(FrameError),
    /// The frame has more pixels than the board has room for.
    TooLarge {
        /// What it has room for.
        room: u32,
    },
    /// A part is missing, or there is one too many.
    Gap {
        /// Where the next part begins.
        expected: u32,
    },
    /// The new atlas cannot be written, or is none.
    Slot(SlotError),
    /// No slot holds a valid atlas.
    NoAtlas,
    /// No way leads there.
    Route(RouteError),
    /// Boards that fly do not do that.
    Refused,
}

impl AtlasIdentity {
    /// The identity of `atlas`.
    #[must_use]
    pub fn of(atlas: &Atlas<'_>) -> Self {
        Self {
            crc: atlas.crc(),
            map_crc: atlas.header().training.map_crc,
            landmarks: atlas.landmarks().len() as u32,
            view_side: atlas.eigenspace().side(),
            dimensions: atlas.eigenspace().dimensions(),
        }
    }

    /// The identity of an atlas of which only the first bytes are at hand.
    #[must_use]
    pub fn of_head(head: &Head) -> Self {
        Self {
            crc: head.crc,
            map_crc: head.header.training.map_crc,
            landmarks: head.header.landmarks,
            view_side: head.header.view_side,
            dimensions: head.header.dimensions,
        }
    }
}
