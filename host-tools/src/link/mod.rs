//! The host's end of a board's link: packets over a serial line or TCP, questions and answers, uploads.
//!
//! The messages are [`eigenmark_core::link`]'s. A [`BoardLink`] sends requests and receives replies, each of which may be
//! lost; whoever asks decides what that means. [`upload()`] brings an atlas into the slot that is not flown by, whatever
//! is lost on the way.

mod board_link;
mod restart;
#[cfg(test)]
mod simulated;
mod upload;
mod wire;
mod words;

pub use board_link::{ATTEMPTS, BoardLink, LinkError};
pub use restart::{RestartError, restart};
pub use upload::{UploadError, Uploaded, upload};
pub use wire::{DEFAULT_BAUD, Wire};
pub use words::{rejection, slot_error};
