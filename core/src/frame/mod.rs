//! Camera pixels, borrowed and checked once.
//!
//! A [`Frame`] is 8-bit luminance, row by row, with a stride. By the camera convention its largest centered square, at
//! nominal altitude and heading, shows exactly one view's footprint on the map ([`Frame::square_row`]).
//! Pixels beside the square matter only to frames of another, known pose.
//!
//! Coordinates: x to the right, y down, the origin is the top-left corner of the top-left pixel.

use core::fmt;

/// The smallest accepted width and height, in pixels.
pub const MIN_SIDE: u16 = 32;

/// The largest accepted width and height, in pixels.
///
/// Area averaging adds up to 255·side² in 32 bits and rounds by half of side²: 255.5·4096² < 2³².
pub const MAX_SIDE: u16 = 4096;

/// Camera pixels: 8-bit luminance, `height` rows of `width` pixels, `stride` bytes from row to row.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    pixels: &'a [u8],
    width: u16,
    height: u16,
    stride: usize,
}

/// Why pixels are not a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FrameError {
    /// A side is outside [`MIN_SIDE`]..=[`MAX_SIDE`].
    Size {
        /// Width found, in pixels.
        width: u16,
        /// Height found, in pixels.
        height: u16,
    },
    /// The stride is shorter than a row.
    Stride {
        /// Stride found, in bytes.
        stride: u32,
        /// Width of a row, in pixels.
        width: u16,
    },
    /// There are fewer bytes than rows need.
    TooShort {
        /// Bytes needed.
        needed: u32,
        /// Bytes found.
        have: u32,
    },
}

impl<'a> Frame<'a> {
    /// Borrows `pixels` as a frame; `stride` is the distance between rows in bytes, at least `width`.
    ///
    /// # Errors
    /// When a side, the stride or the number of bytes does not fit.
    ///
    /// # Examples
    /// ```
    /// use eigenmark_core::frame::Frame;
    /// let pixels = [128; 160 * 120];
    /// let frame = Frame::new(&pixels, 160, 120, 160)?;
    /// assert_eq!(frame.square_side(), 120);
    /// # Ok::<(), eigenmark_core::frame::FrameError>(())
    /// ```
    pub fn new(
        pixels: &'a [u8],
        width: u16,
        height: u16,
        stride: usize,
    ) -> Result<Self, FrameError> {
        let sides = MIN_SIDE..=MAX_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(FrameError::Size { width, height });
        }
        if stride < usize::from(width) {
            return Err(FrameError::Stride {
                stride: saturate(stride),
                width,
            });
        }
        let needed = stride
            .checked_mul(usize::from(height) - 1)
            .and_then(|rows| rows.checked_add(usize::from(width)))
            .unwrap_or(usize::MAX);
        if pixels.len() < needed {
            return Err(FrameError::TooShort {
                needed: saturate(needed),
                have: saturate(pixels.len()),
            });
        }
        Ok(Self {
            pixels: &pixels[..needed],
            width,
            height,
            stride,
        })
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u16 {
        self.width
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u16 {
        self.height
    }

    /// All pixels, from the first of the first row to the last of the last: row `y` starts at `y * stride()`.
    #[must_use]
    pub fn pixels(&self) -> &'a [u8] {
        self.pixels
    }

    /// Bytes from row to row.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Side of the largest centered square, in pixels.
    #[must_use]
    pub fn square_side(&self) -> u16 {
        self.width.min(self.height)
    }

    /// Left and top of the largest centered square, in pixels. An odd margin is split with the larger half right and
    /// below.
    #[must_use]
    pub fn square_corner(&self) -> [u16; 2] {
        let side = self.square_side();
        [(self.width - side) / 2, (self.height - side) / 2]
    }

    /// Row `y` of the largest centered square, `square_side()` pixels; none below the square.
    #[must_use]
    pub fn square_row(&self, y: u16) -> &'a [u8] {
        let rows = self.square_from(y);
        rows.get(..usize::from(self.square_side()))
            .unwrap_or_default()
    }

    /// Everything from row `y` of the square on, rows [`stride`](Self::stride) bytes apart; nothing below the square.
    #[must_use]
    pub fn square_from(&self, y: u16) -> &'a [u8] {
        let side = self.square_side();
        if y >= side {
            return &[];
        }
        let [left, top] = self.square_corner().map(usize::from);
        let start = (top + usize::from(y)) * self.stride + left;
        self.pixels.get(start..).unwrap_or_default()
    }
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Size { width, height } => {
                write!(
                    f,
                    "a frame of {width}×{height} pixels; each side must be {MIN_SIDE} to {MAX_SIDE}"
                )
            }
            Self::Stride { stride, width } => {
                write!(
                    f,
                    "a stride of {stride} bytes is shorter than a row of {width} pixels"
                )
            }
            Self::TooShort { needed, have } => {
                write!(f, "a frame of {have} bytes; its rows need {needed}")
            }
        }
    }
}

impl core::error::Error for FrameError {}

fn saturate(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_square_is_centered() {
        let mut pixels = [0_u8; 64 * 32];
        pixels[16] = 1; // first pixel of the 32×32 square in a 64×32 frame
        pixels[31 * 64 + 47] = 2; // its last pixel
        let frame = Frame::new(&pixels, 64, 32, 64).expect("valid");
        assert_eq!(frame.square_row(0)[0], 1);
        assert_eq!(frame.square_row(31)[31], 2);
        assert!(frame.square_row(32).is_empty() && frame.square_from(32).is_empty());
    }

    #[test]
    fn the_last_row_needs_no_padding() {
        let bytes = [0_u8; 31 * 40 + 32];
        assert!(Frame::new(&bytes, 32, 32, 40).is_ok());
        let short = Frame::new(&bytes[1..], 32, 32, 40).expect_err("one byte is missing");
        assert_eq!(
            short,
            FrameError::TooShort {
                needed: 1272,
                have: 1271
            }
        );
    }

    #[test]
    fn unusable_sizes_are_named() {
        let bytes = [0_u8; 32 * 32];
        assert_eq!(
            Frame::new(&bytes, 1, 1, 1).expect_err("tiny"),
            FrameError::Size {
                width: 1,
                height: 1
            }
        );
        assert_eq!(
            Frame::new(&bytes, 32, 32, 31).expect_err("stride"),
            FrameError::Stride {
                stride: 31,
                width: 32
            }
        );
        let huge = Frame::new(&bytes, 32, 32, usize::MAX).expect_err("overflow");
        assert_eq!(
            huge,
            FrameError::TooShort {
                needed: u32::MAX,
                have: 1024
            }
        );
    }
}
