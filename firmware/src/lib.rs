//! What the firmware's binaries share: the board, the atlas region of flash, logging, and how a program ends.
//!
//! This crate is glue: whatever can be tested on a host is in `eigenmark-core`. Logs are defmt frames over
//! semihosting, decoded on the host by the tool that runs the emulated board.

#![no_std]

pub mod atlas_region;
pub mod board;
mod exit;
pub mod guard;
pub mod room;
pub mod stack;

// The global logger.
use defmt_semihosting as _;

pub use exit::{fail, succeed};

defmt::timestamp!("");
