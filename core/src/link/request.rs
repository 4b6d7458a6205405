//! What a host asks.

use serde::{Deserialize, Serialize};

use super::Provocation;
use crate::{navigator::MAX_GOALS, slots::Setup};

/// Places (0-based) to fly to, one after the other.
pub type Goals = heapless::Vec<u16, MAX_GOALS>;

/// What a host asks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Who are you, and which atlas do you fly by?
    Identify,
    /// A frame to be located follows: [`Pixels`](Self::Pixels), in order. While frames come this way, those of the camera
    /// are not looked at.
    Frame {
        /// Comes back with the reply.
        sequence: u32,
        /// Width of the frame, in pixels.
        width: u16,
        /// Height of the frame, in pixels.
        height: u16,
    },
    /// The next pixels of the frame. The last ones are answered with its fix.
    Pixels {
        /// How many there were before.
        offset: u32,
        /// Luminance, row by row without gaps: at most [`PART_LEN`](super::PART_LEN).
        bytes: &'a [u8],
    },
    /// A new atlas for the slot that is not flown by.
    Upload(Upload<'a>),
    /// What is in the slots?
    Slots,
    /// Fly to these places; none is to stay with the present goal only.
    Go(Goals),
    /// Send a [`Report`](super::Report) of every so many frames, and one of so many with its picture; 0 for none.
    Watch {
        /// Frames per report.
        every: u16,
        /// Reports per picture.
        pictures: u16,
    },
    /// What went wrong, before the last reset and since?
    Faults,
    /// The same, and forget it.
    ForgetFaults,
    /// Start anew, with the newest valid atlas.
    Restart,
    /// Do something wrong, to see that it is noticed. Boards that fly refuse.
    Provoke(Provocation),
}

/// A new atlas, part by part. Each is answered with how much has been written and read back, or why not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Upload<'a> {
    /// Erase the slot that is not flown by. An upload of the same atlas that was interrupted goes on where it was.
    Begin {
        /// Bytes of the atlas.
        len: u32,
        /// CRC-32 of the atlas, as in its preamble.
        crc: u32,
        /// What is written with it.
        setup: Setup,
    },
    /// The next bytes.
    Chunk {
        /// How many there were before.
        offset: u32,
        /// At most [`PART_LEN`](super::PART_LEN).
        bytes: &'a [u8],
    },
    /// Check all of it; from then on it is the newest.
    Finish,
    /// Leave it.
    Abandon,
}
