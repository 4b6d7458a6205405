//! Two atlases in flash, of which one is flown by while the other is written.
//!
//! The atlas region is two slots of equal length, each a whole number of the flash's pages. An atlas begins where its slot
//! does; the slot's last [`RECORD_LEN`] bytes are its [`Record`]: what makes it whole, and newer than the other. Rules and
//! a table of what a power cut leaves are in `core/docs/atlas-slots.md`.
//!
//! [`Region`] reads both slots and chooses; it looks at memory only. [`Writer`] writes an atlas that comes part by part to
//! the slot that is not flown by, through the traits of embedded-storage. It never erases, and never writes to, the other.
//!
//! **Cost.** Reading a slot is one [`Atlas::parse`](crate::atlas::Atlas::parse), which touches every byte of the atlas
//! twice. A writer is 72 bytes, and reads back what it writes through 64 bytes of stack.
//!
//! **Limits.** Where a flash corrects errors, a word that was being written when power was cut may not be readable at all:
//! the board must survive reading it from memory.

mod choose;
mod error;
mod record;
#[cfg(any(test, feature = "std"))]
mod simulated;
mod writer;

use serde::{Deserialize, Serialize};

pub use choose::{Choice, Found, Region, Target};
pub use error::SlotError;
pub use record::{RECORD_LEN, Record};
#[cfg(any(test, feature = "std"))]
pub use simulated::{Cut, SimulatedError, SimulatedFlash};
pub use writer::{Progress, Writer};

/// A slot of the atlas region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Slot {
    /// The first; an atlas in it that was flashed without a record may be as long as the whole region.
    A,
    /// The second.
    B,
}

/// What is written with an atlas: what a board has to know of its camera and of the map to give lengths in meters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Meters per map pixel; positive.
    pub meters_per_px: f32,
    /// Angle over the side of the frame's square, in radians; in 0 to π, both excluded.
    pub field_of_view_rad: f32,
}

impl Slot {
    /// Both, in their order.
    pub const BOTH: [Self; 2] = [Self::A, Self::B];

    /// The one that is not this.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

impl Setup {
    /// Whether both numbers are in their ranges.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let is_angle =
            self.field_of_view_rad > 0.0 && self.field_of_view_rad < core::f32::consts::PI;
        self.meters_per_px > 0.0 && self.meters_per_px.is_finite() && is_angle
    }
}

impl Default for Setup {
    /// A meter per pixel, and 60°.
    fn default() -> Self {
        Self {
            meters_per_px: 1.0,
            field_of_view_rad: core::f32::consts::FRAC_PI_3,
        }
    }
}

#[cfg(test)]
mod tests;
