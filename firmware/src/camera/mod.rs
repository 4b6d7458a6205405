//! Cameras on buses: what one is asked for, and what it gives.
//!
//! ```text
//! ArducamMega (SPI) ──┐                               ┌─▶ FrameSize: luminance lies in the buffer
//!                     ├─ Camera ─▶ Supervised ─ poll ─┤
//! Hm01b0 (I2C, port) ─┘                               └─▶ CameraError: none, and why
//! ```
//!
//! Nothing here waits for a frame: [`Camera::begin`] asks for one and [`Camera::take`] looks whether it has come, so
//! that links are served meanwhile. [`Supervised`] adds time: what is late, what is lost, when to try again.
//!
//! Drivers know buses as traits of `embedded-hal` 1.0, and put [`luminance`] without gaps into the caller's
//! buffer; beside it they keep a few bytes. A frame is told of only when all of it has come.

pub mod arducam_mega;
pub mod hm01b0;
pub mod luminance;
mod size;
mod supervised;

use core::fmt;

use eigenmark_core::link;

pub use arducam_mega::{ArducamMega, Encoding, Resolution};
pub use hm01b0::{Filter, Hm01b0, MAX_RAW_LEN, PixelPort, PortError};
pub use size::FrameSize;
pub use supervised::{Limits, Supervised};

/// A camera that is asked for frames, one after the other.
pub trait Camera {
    /// Asks for a frame. One that was asked for before and has not been taken is dropped.
    ///
    /// After a start or [`recover`](Self::recover) the camera is looked for and set up first.
    ///
    /// # Errors
    /// [`Absent`](CameraError::Absent) and [`Bus`](CameraError::Bus).
    fn begin(&mut self) -> Result<(), CameraError>;

    /// Takes the frame if it has come; none while it has not, or was not asked for.
    ///
    /// `pixels` is the same buffer, left alone, in all calls for one frame: it may be filled piece by piece. When a
    /// size is returned, luminance lies at its start, row by row without gaps; until then, and after an error, what
    /// lies there is no frame.
    ///
    /// # Errors
    /// All but [`Late`](CameraError::Late): time is not known here. The frame is gone; [`begin`](Self::begin) asks for
    /// the next.
    fn take(&mut self, pixels: &mut [u8]) -> Result<Option<FrameSize>, CameraError>;

    /// Forgets what the camera was told, so that the next [`begin`](Self::begin) resets it and sets it up again.
    fn recover(&mut self);

    /// When the last frame was taken, in microseconds, by a clock of the camera's own; none without such a clock.
    fn taken_us(&self) -> Option<u64> {
        None
    }
}

/// Why there is no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
#[non_exhaustive]
pub enum CameraError {
    /// None came in time.
    Late,
    /// It has too few bytes.
    Short {
        /// Bytes that a frame has.
        expected: u32,
        /// Bytes that came.
        found: u32,
    },
    /// It was overwritten while it was read, or its bytes make no picture.
    Torn,
    /// Nothing answers where the camera should be, or something else does.
    Absent,
    /// The bus failed.
    Bus,
    /// The buffer has no room for it.
    Room {
        /// Pixels that a frame has.
        needed: u32,
        /// Pixels that the buffer has room for.
        have: u32,
    },
}

impl From<CameraError> for link::Camera {
    /// What hosts are told: a bus that fails is a camera that does not answer, and a frame without room is a short one.
    fn from(error: CameraError) -> Self {
        match error {
            CameraError::Late => Self::Late,
            CameraError::Short { .. } | CameraError::Room { .. } => Self::Short,
            CameraError::Torn => Self::Torn,
            CameraError::Absent | CameraError::Bus => Self::Absent,
        }
    }
}

impl fmt::Display for CameraError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Late => f.write_str("no frame came in time"),
            Self::Short { expected, found } => {
                write!(f, "a frame has {found} bytes instead of {expected}")
            }
            Self::Torn => f.write_str("a frame is torn"),
            Self::Absent => f.write_str("no camera answers"),
            Self::Bus => f.write_str("the camera's bus failed"),
            Self::Room { needed, have } => {
                write!(
                    f,
                    "a frame has {needed} pixels, its buffer has room for {have}"
                )
            }
        }
    }
}

impl core::error::Error for CameraError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_are_told_what_they_know() {
        for (error, told) in [
            (CameraError::Late, link::Camera::Late),
            (
                CameraError::Short {
                    expected: 2,
                    found: 1,
                },
                link::Camera::Short,
            ),
            (CameraError::Torn, link::Camera::Torn),
            (CameraError::Absent, link::Camera::Absent),
            (CameraError::Bus, link::Camera::Absent),
            (
                CameraError::Room { needed: 2, have: 1 },
                link::Camera::Short,
            ),
        ] {
            assert_eq!(link::Camera::from(error), told);
        }
    }
}
