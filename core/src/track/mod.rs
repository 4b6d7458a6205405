//! Frames → where the vehicle is, relative to where it started: visual path integration.
//!
//! Report appendix B, algorithm B.1, corrected: corners are detected, tracked from frame to frame, and dropped where
//! they are about to leave; new ones are looked for where the ground comes in.

mod corner;
mod digest;
mod follow;
mod frames;
mod ground;
mod level;
mod odometry;
mod patch;
mod placement;
mod regions;
mod similarity;
#[cfg(test)]
mod tests;
mod tracks;

pub use digest::{digest, see_ground};
pub use level::MAX_SIDE_PX;
pub use odometry::Odometry;
pub use placement::{Covariance, Displacement, Placement};

/// Corners that are tracked at most: the number that the budget is made for.
pub const MAX_TRACKS: usize = 20;

/// Windows around corners this far from the border, in pixels, fit on the half-sized level: seven of its pixels, and two
/// to spare.
const INNER_PX: f32 = 18.0;

/// A corner that is followed from frame to frame.
///
/// Positions are [x, y] in pixels from the top-left corner of the tracked square: the frame's largest centered square, or
/// the middle [`MAX_SIDE_PX`] pixels of a larger one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Track {
    /// No other track of the same odometry has this number.
    pub id: u32,
    /// Frames since it was detected.
    pub age: u16,
    /// Where it is in the present frame.
    pub at_px: [f32; 2],
    /// Where it was in the frame before.
    pub before_px: [f32; 2],
    /// Where it was found in the frame that is looked at.
    found_px: Option<[f32; 2]>,
    /// Where it is in the frame that it is tracked from.
    reference_px: [f32; 2],
    /// Where it lies in the plane of path integration, in sides: as seen when it was detected.
    anchor: [f32; 2],
}

impl Track {
    /// Whether it can be found some way off: windows fit on coarser levels.
    fn is_inner(&self, side_px: u16) -> bool {
        let inner = INNER_PX..=f32::from(side_px) - INNER_PX;
        self.at_px.iter().all(|at| inner.contains(at))
    }

    /// How far it moved since the frame that it is tracked from, in pixels, squared.
    fn moved_squared(&self) -> f32 {
        let [dx, dy] = [0, 1].map(|axis| self.at_px[axis] - self.reference_px[axis]);
        dx * dx + dy * dy
    }
}
