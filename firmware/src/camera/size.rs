//! How large a frame is.

use eigenmark_core::frame::{Frame, FrameError, MIN_SIDE};

use super::CameraError;

/// The largest accepted width, in pixels.
const MAX_WIDTH: u16 = 320;

/// The largest accepted height, in pixels.
const MAX_HEIGHT: u16 = 240;

/// Width and height of a frame that the localizer accepts: 32×32 to 320×240 pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct FrameSize {
    width: u16,
    height: u16,
}

impl FrameSize {
    /// A size; none when a side is out of its range.
    #[must_use]
    pub const fn new(width: u16, height: u16) -> Option<Self> {
        if width < MIN_SIDE || width > MAX_WIDTH || height < MIN_SIDE || height > MAX_HEIGHT {
            return None;
        }
        Some(Self { width, height })
    }

    /// Width in pixels.
    #[must_use]
    pub const fn width(self) -> u16 {
        self.width
    }

    /// Height in pixels.
    #[must_use]
    pub const fn height(self) -> u16 {
        self.height
    }

    /// Pixels of a frame: 1,024 to 76,800.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "no frame is empty")]
    pub const fn len(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The frame at the start of `pixels`, where a camera put it.
    ///
    /// # Errors
    /// When there are fewer pixels.
    pub fn frame(self, pixels: &[u8]) -> Result<Frame<'_>, FrameError> {
        Frame::new(pixels, self.width, self.height, usize::from(self.width))
    }

    /// The part of `pixels` that a frame fills.
    pub(super) fn room(self, pixels: &mut [u8]) -> Result<&mut [u8], CameraError> {
        let (needed, have) = (self.len(), pixels.len());
        pixels.get_mut(..needed).ok_or(CameraError::Room {
            needed: needed as u32,
            have: u32::try_from(have).unwrap_or(u32::MAX),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    #[test]
    fn sides_are_within_what_the_localizer_accepts() {
        for (width, height, is_accepted) in [
            (32, 32, true),
            (320, 240, true),
            (31, 32, false),
            (32, 31, false),
            (321, 240, false),
            (320, 241, false),
            (0, 0, false),
            (u16::MAX, u16::MAX, false),
        ] {
            let size = FrameSize::new(width, height);
            assert_eq!(size.is_some(), is_accepted, "{width}x{height}");
            let Some(size) = size else { continue };
            let pixels = vec![0; size.len()];
            let frame = size.frame(&pixels).expect("the core accepts it");
            assert_eq!((frame.width(), frame.height()), (width, height));
            assert!(size.frame(&pixels[1..]).is_err());
        }
    }

    #[test]
    fn a_buffer_without_room_is_told() {
        let size = FrameSize::new(160, 120).expect("valid");
        let mut pixels = vec![0; 160 * 120 - 1];
        assert_eq!(
            size.room(&mut pixels),
            Err(CameraError::Room {
                needed: 19_200,
                have: 19_199
            })
        );
        pixels.extend([0; 2]);
        assert_eq!(size.room(&mut pixels).map(|room| room.len()), Ok(19_200));
    }
}
