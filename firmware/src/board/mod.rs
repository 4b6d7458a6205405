//! Boards: the only place that knows pins and registers.
//!
//! A board is four parts, each behind a trait, and [`System`] for the rest: a camera
//! ([`Camera`](crate::camera::Camera)), two wires ([`embedded_io`]), and flash
//! ([`NorFlash`](embedded_storage::nor_flash::NorFlash)). What flies is written for the traits.

#[cfg(target_os = "none")]
mod clock;
#[cfg(all(target_os = "none", feature = "emulated"))]
mod emulated;
#[cfg(target_os = "none")]
mod flash_error;
#[cfg(all(target_os = "none", feature = "stm32f405"))]
mod stm32f405;
#[cfg(all(target_os = "none", feature = "stm32h743"))]
mod stm32h743;

use eigenmark_core::link::Provocation;

#[cfg(all(target_os = "none", feature = "emulated"))]
use emulated as chosen;
#[cfg(all(target_os = "none", feature = "stm32f405"))]
use stm32f405 as chosen;
#[cfg(all(target_os = "none", feature = "stm32h743"))]
use stm32h743 as chosen;
#[cfg(all(target_os = "none", feature = "stm32h743"))]
pub use stm32h743::reading;

#[cfg(target_os = "none")]
pub use chosen::{CORE_HZ, REGION_OFFSET, cause, take};

#[cfg(all(
    target_os = "none",
    not(any(feature = "emulated", feature = "stm32f405", feature = "stm32h743"))
))]
compile_error!("choose a board: feature emulated, stm32f405 or stm32h743");

#[cfg(all(
    target_os = "none",
    any(
        all(feature = "emulated", feature = "stm32f405"),
        all(feature = "emulated", feature = "stm32h743"),
        all(feature = "stm32f405", feature = "stm32h743")
    )
))]
compile_error!("choose one board: feature emulated is on unless --no-default-features is given");

/// Reads flash that a power cut may have left unreadable. This chip reads anything.
#[cfg(all(target_os = "none", not(feature = "stm32h743")))]
pub fn reading<T>(read: impl FnOnce() -> T) -> T {
    read()
}

/// Clock, rest and resets.
pub trait System {
    /// Time since the start, in microseconds.
    fn now_us(&self) -> u64;

    /// Says that the program makes progress. Without that for some seconds the board resets itself.
    fn feed(&mut self);

    /// Waits for the next interrupt: a millisecond at most.
    fn rest(&mut self);

    /// Shows how it goes.
    fn show(&mut self, lamp: Lamp);

    /// Starts anew.
    fn restart(&mut self);

    /// Does something wrong, if it is a board that nobody flies.
    ///
    /// # Errors
    /// When it does not do that.
    fn provoke(&mut self, what: Provocation) -> Result<(), Refused>;
}

/// Boards that fly do not do that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused;

/// What a board shows without words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamp {
    /// No atlas, or no camera.
    Unfit,
    /// Frames come, and the place is not known.
    Searching,
    /// The place is known.
    Confident,
}

/// A board's parts.
#[derive(Debug)]
pub struct Parts<C, H, A, F, S> {
    /// Frames.
    pub camera: C,
    /// Bytes from and to a host.
    pub host: H,
    /// Bytes from and to the autopilot.
    pub autopilot: A,
    /// Flash in which atlases are kept.
    pub flash: F,
    /// The rest.
    pub system: S,
}

/// Flash in which atlases are kept.
pub trait AtlasFlash: embedded_storage::nor_flash::NorFlash {
    /// A slot as memory shows it, after what was written last; none where that shows only after the next start.
    fn mapped(&self, slot: eigenmark_core::slots::Slot) -> Option<&[u8]>;
}
