//! Where an atlas lies in a board's flash, and what brings it there: files of four formats, and a probe.
//!
//! A [`Board`] has two slots. [`Placement`] puts an atlas at an address, and the record that says that it is whole, and
//! newer than others, at the end of its slot. [`Format`] writes both as a file; [`Probe`] writes them through the program
//! `probe-rs`.

mod board;
#[cfg(test)]
mod fixture;
mod format;
mod placement;
mod probe;
mod rotation;

pub use board::{BOARDS, Board, Slot};
pub use format::{Format, FormatError};
pub use placement::{Placement, PlacementError, Segment, record_of};
pub use probe::{INSTALL, PROGRAM_VARIABLE, Probe, ProbeError};
pub use rotation::{Records, RotationError, Turn};
