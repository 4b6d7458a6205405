//! Frame → view: a small square of pixels, and the sums that normalization needs.
//!
//! A [`View`] is what the eigenspace sees: v×v pixels of 8 bits, row-major. It is made by exact area averaging
//! ([`reduce`]), or, when the frame was taken at another pose than the nominal one and that is known, by sampling the
//! frame turned, scaled and levelled ([`level`](level())). Blur, high-pass and the removal of the mean are linear, so
//! the trainer folds them into the basis and they cost nothing here; only the unit-variance normalization needs Σy and
//! Σy² of the view, which are kept with it.

mod level;
mod pose;
mod reduce;
mod reference;

use crate::kernel::{self, PIXELS_PER_GROUP, Pixels};

pub use level::{Coverage, level};
pub use pose::{
    MAX_ALTITUDE_RATIO, MAX_FIELD_OF_VIEW_RAD, MAX_HEADING_RAD, MAX_TILT_RAD, MIN_ALTITUDE_RATIO,
    MIN_FIELD_OF_VIEW_RAD, Pose, PoseError, Tilt,
};
pub use reduce::reduce;
pub use reference::reduce as reduce_reference;

/// The largest side of a view, in pixels.
pub const MAX_VIEW_SIDE: u8 = 50;

/// The smallest side of a view, in pixels.
pub const MIN_VIEW_SIDE: u8 = 2;

/// The largest number of pixels in a view.
pub const MAX_PIXELS: usize = MAX_VIEW_SIDE as usize * MAX_VIEW_SIDE as usize;

/// v×v preprocessed pixels, row-major, with their sums.
///
/// Pixels are stored in groups of four, of which the last ends in zeros.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct View {
    groups: [Pixels; MAX_PIXELS / PIXELS_PER_GROUP],
    side: u8,
    sum: u32,
    sum_of_squares: u32,
}

const _: () = assert!(MAX_VIEW_SIDE == kernel::MAX_COLUMNS);
const _: () = assert!(MAX_PIXELS.is_multiple_of(PIXELS_PER_GROUP));
const _: () = assert!(size_of::<View>() <= 2560);
// Σy² of a full view of white pixels fits.
const _: () = assert!(MAX_PIXELS as u64 * 255 * 255 < 1 << 32);

impl View {
    /// A view of `side`×`side` black pixels; `side` is clamped to [`MIN_VIEW_SIDE`]..=[`MAX_VIEW_SIDE`].
    #[must_use]
    pub const fn black(side: u8) -> Self {
        let side = if side < MIN_VIEW_SIDE {
            MIN_VIEW_SIDE
        } else if side > MAX_VIEW_SIDE {
            MAX_VIEW_SIDE
        } else {
            side
        };
        Self {
            groups: [Pixels([0; PIXELS_PER_GROUP]); MAX_PIXELS / PIXELS_PER_GROUP],
            side,
            sum: 0,
            sum_of_squares: 0,
        }
    }

    /// A view from its pixels, row-major: `None` unless there are v² of them with v in the range of views.
    #[must_use]
    pub fn from_pixels(pixels: &[u8]) -> Option<Self> {
        let side = u8::try_from(pixels.len().isqrt()).ok()?;
        let square = usize::from(side) * usize::from(side) == pixels.len();
        if !square || !(MIN_VIEW_SIDE..=MAX_VIEW_SIDE).contains(&side) {
            return None;
        }
        let mut view = Self::black(side);
        view.fill(|target| {
            for (target, &pixel) in target.iter_mut().zip(pixels) {
                *target = pixel;
            }
        });
        Some(view)
    }

    /// Pixels per side, v.
    #[must_use]
    pub fn side(&self) -> u8 {
        self.side
    }

    /// The m = v² pixels, row-major.
    #[must_use]
    pub fn pixels(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.groups)[..self.len()]
    }

    /// The pixels in groups of four; those that do not exist are zero.
    #[must_use]
    pub fn groups(&self) -> &[Pixels] {
        let groups = self.groups.get(..self.len().div_ceil(PIXELS_PER_GROUP));
        groups.unwrap_or_default()
    }

    /// Σy over the pixels.
    #[must_use]
    pub fn sum(&self) -> u32 {
        self.sum
    }

    /// Σy² over the pixels.
    #[must_use]
    pub fn sum_of_squares(&self) -> u32 {
        self.sum_of_squares
    }

    /// m² times the variance of the pixels, m·Σy² − (Σy)²: exact, and zero only for a flat view.
    #[must_use]
    pub fn scaled_variance(&self) -> u64 {
        self.len() as u64 * u64::from(self.sum_of_squares)
            - u64::from(self.sum) * u64::from(self.sum)
    }

    /// Lets `write` set the pixels, then brings the sums up to date.
    fn fill(&mut self, write: impl FnOnce(&mut [u8])) {
        let len = self.len();
        write(&mut bytemuck::cast_slice_mut(&mut self.groups)[..len]);
        (self.sum, self.sum_of_squares) = kernel::statistics(self.groups());
    }

    /// m; the bound holds for every side, and the compiler sees it.
    fn len(&self) -> usize {
        (usize::from(self.side) * usize::from(self.side)).min(MAX_PIXELS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_follow_the_pixels() {
        let view = View::from_pixels(&[1, 2, 3, 4]).expect("2×2");
        assert_eq!(
            (view.side(), view.sum(), view.sum_of_squares()),
            (2, 10, 30)
        );
        assert_eq!(view.scaled_variance(), 4 * 30 - 100);
        assert_eq!(view.groups(), [Pixels([1, 2, 3, 4])]);
    }

    #[test]
    fn odd_views_are_padded_with_zeros() {
        let view = View::from_pixels(&[255; 25]).expect("5×5");
        assert_eq!(view.groups().len(), 7);
        assert_eq!(view.groups()[6], Pixels([255, 0, 0, 0]));
    }

    #[test]
    fn pixels_that_are_no_square_are_no_view() {
        assert!(View::from_pixels(&[0; 5]).is_none());
        assert!(View::from_pixels(&[0; 1]).is_none());
        assert!(View::from_pixels(&[0; 51 * 51]).is_none());
    }
}
