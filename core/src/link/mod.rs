//! Framed messages between a board and a host, over any wire that carries bytes.
//!
//! A packet is a postcard message, followed by its CRC-32 (ISO-HDLC, little-endian), COBS-encoded, ended by a zero
//! byte. Whatever is damaged on the way is dropped up to the next zero, and said so.
//!
//! ```text
//! host  Identify ──────────────────────▶ board    host  Frame, Pixels … ───────▶ board
//! host ◀──────────────────────── Identity board    host ◀──── Fix or Rejected    board
//!
//! host  Upload(Begin) ─▶ ◀─ Upload { next }  Upload(Chunk) ─▶ ◀─ Upload { next } …  Upload(Finish) ─▶ ◀─ Slots
//! host  Watch ─▶ ◀─ Report ◀─ Report ◀─ Picture …
//! ```
//!
//! What is large comes in parts of at most [`PART_LEN`] bytes, so that neither side needs room for the whole of it beside
//! where it belongs: pixels go to the camera's buffer, an atlas goes to flash.

mod fault;
mod packet;
mod reply;
mod report;
mod request;

pub use fault::{Cause, Crash, Faults, Provocation};
pub use packet::{Damage, Receiver, encode, encoded_len};
pub use reply::{AtlasIdentity, Identity, Rejection, Reply, SlotState};
pub use report::{Camera, Refusal, Report};
pub use request::{Goals, Request, Upload};

/// Bytes of pixels or of an atlas in one message, at most.
pub const PART_LEN: usize = 512;

/// Pixels of a frame that the reference board has room for: 160×120.
pub const MAX_FRAME_LEN: usize = 160 * 120;

/// Bytes of a [`Request`] beside its part, at most.
const REQUEST_OVERHEAD: usize = 16;

/// Bytes of a packet that carries the largest request, its zero included.
pub const MAX_REQUEST_LEN: usize = encoded_len(REQUEST_OVERHEAD + PART_LEN);

/// Bytes of a packet that carries any reply, its zero included.
pub const MAX_REPLY_LEN: usize = 320;

/// Pixels in one [`Reply::Picture`], at most.
pub const PICTURE_PART_LEN: usize = 240;
