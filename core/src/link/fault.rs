//! What went wrong, over resets.

use serde::{Deserialize, Serialize};

/// What went wrong before the last reset, and since.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Faults {
    /// Why the board was reset last.
    pub cause: Cause,
    /// Resets since power was switched on or faults were forgotten.
    pub resets: u16,
    /// Of these, by the watchdog.
    pub by_watchdog: u16,
    /// Of these, because power was low.
    pub by_brown_out: u16,
    /// The program's last crash, kept over resets.
    pub crash: Option<Crash>,
    /// Times that the camera was lost since the reset.
    pub camera_losses: u16,
    /// Times that a link brought more damage than messages for a while, and was left alone for a moment.
    pub link_storms: u16,
    /// Pages of flash that did not keep what was written to them.
    pub worn_pages: u16,
}

/// Why a board was reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Cause {
    /// Power was switched on.
    #[default]
    PowerOn,
    /// Power was low.
    BrownOut,
    /// The reset pin.
    Pin,
    /// The program asked for it.
    Software,
    /// The watchdog was not fed.
    Watchdog,
}

/// How a program crashed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Crash {
    /// The processor could not go on.
    HardFault {
        /// Where it was.
        pc: u32,
        /// Where it came from.
        lr: u32,
        /// Configurable Fault Status Register.
        status: u32,
        /// The address that was accessed, if known.
        address: u32,
    },
    /// The stack left its room.
    StackOverflow {
        /// Where it was.
        pc: u32,
        /// Where it came from.
        lr: u32,
    },
    /// The program made no progress for seconds.
    Hang {
        /// Where it was.
        pc: u32,
        /// Where it came from.
        lr: u32,
    },
    /// A promise of the program was broken.
    Panic {
        /// Line of the source file.
        line: u32,
    },
}

/// What can be provoked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Provocation {
    /// Access to an address where nothing is.
    HardFault,
    /// A recursion without end.
    StackOverflow,
    /// A loop without end.
    Hang,
    /// A panic.
    Panic,
}
