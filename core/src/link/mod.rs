//! Framed messages between a board and a host, over any wire that carries bytes.
//!
//! A packet is a postcard message, followed by its CRC-32 (ISO-HDLC, little-endian), COBS-encoded, ended by a zero
//! byte. Whatever is damaged on the way is dropped up to the next zero, and said so.
//!
//! ```text
//! host  Request::Identify ──────────────▶ board   host  Request::Locate { sequence, pixels … } ─▶ board
//! host ◀────────────── Reply::Identity    board   host ◀─ Reply::Fix or Reply::Rejected          board
//! ```

mod packet;
mod responder;

use serde::{Deserialize, Serialize};

use crate::{atlas::Atlas, frame::FrameError, localizer::Fix};

pub use packet::{Damage, Receiver, encode, encoded_len};
pub use responder::Responder;

/// The largest frame a board accepts over the link: 320×240 pixels.
pub const MAX_FRAME_LEN: usize = 320 * 240;

/// Bytes of a [`Request`] beside its pixels, at most: a tag, a sequence number, two sides and a length.
const REQUEST_OVERHEAD: usize = 1 + 5 + 3 + 3 + 5;

/// Bytes of a packet that carries the largest request, its zero included.
pub const MAX_REQUEST_LEN: usize = encoded_len(REQUEST_OVERHEAD + MAX_FRAME_LEN);

/// Bytes of a packet that carries any reply, its zero included.
pub const MAX_REPLY_LEN: usize = 128;

/// What a host asks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Who are you, and which atlas do you fly?
    Identify,
    /// Where was this frame taken?
    Locate {
        /// Comes back with the reply.
        sequence: u32,
        /// Width of the frame, in pixels.
        width: u16,
        /// Height of the frame, in pixels.
        height: u16,
        /// Luminance, row by row without gaps.
        pixels: &'a [u8],
    },
}

/// What a board answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// The answer to [`Request::Identify`].
    Identity(Identity),
    /// The answer to [`Request::Locate`].
    Fix {
        /// The request's number.
        sequence: u32,
        /// The fix, if there is one.
        fix: Option<Fix>,
    },
    /// A request that was not answered, and why.
    Rejected {
        /// The request's number, when it could be read.
        sequence: Option<u32>,
        /// Why.
        reason: Rejection,
    },
}

/// A board's atlas in brief.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// CRC-32 of the atlas.
    pub atlas_crc: u32,
    /// Number of landmarks.
    pub landmarks: u32,
    /// Pixels per side of a view.
    pub view_side: u8,
    /// Dimensions of the eigenspace.
    pub dimensions: u8,
}

/// Why a request was not answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Rejection {
    /// The packet was damaged.
    Damaged(Damage),
    /// The pixels are not a frame.
    Frame(FrameError),
}

impl Identity {
    /// The identity of `atlas`.
    #[must_use]
    pub fn of(atlas: &Atlas<'_>) -> Self {
        Self {
            atlas_crc: atlas.crc(),
            landmarks: atlas.landmarks().len() as u32,
            view_side: atlas.eigenspace().side(),
            dimensions: atlas.eigenspace().dimensions(),
        }
    }
}
